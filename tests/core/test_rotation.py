"""The beam's angle from marks and from reports."""

import itertools

import numpy as np
import pytest

from radar_console.core.geometry import wrap
from radar_console.core.messages import CENTROID, Radar, blank
from radar_console.core.rotation import (
    encoder_of_marks,
    encoder_of_reports,
    infer_rotation,
    rotation_of_marks,
)
from radar_console.core.sweep import LONGEST_SILENCE, SECTORS, cut, stated
from radar_console.core.units import DEG, TURN

RADAR = Radar("test", 4.0, 100e3, 50.0, 0.1 * DEG)


def flights(rng, rotation, turns, targets, p_d=0.8, noise=0.1 * DEG, granularity=1 / 128):
    """Times and azimuths of slowly moving targets seen by a steady beam, in the order of time."""
    azimuth = rng.uniform(0, TURN, targets)[:, None] + rng.normal(0, 1e-3, (targets, 1)) * np.arange(turns)
    time = (np.arange(turns) + np.mod(azimuth, TURN) / TURN) * rotation + 500.0
    seen = rng.random(time.shape) < p_d
    time, azimuth = time[seen], np.mod(azimuth[seen] + rng.normal(0, noise, seen.sum()), TURN)
    order = np.argsort(time)
    return np.round(time[order] / granularity) * granularity, azimuth[order]


@pytest.mark.parametrize("rotation", [0.7, 1.68, 2.5, 3.9, 5.0, 7.633, 10.0, 12.0])
@pytest.mark.parametrize("targets", [1, 3, 30])
def test_the_rotation_is_inferred_from_few_and_many_targets(rotation, targets):
    time, azimuth = flights(np.random.default_rng(targets), rotation, 60, targets)
    # A target that drifts by a milliradian a turn moves the phase by as much.
    assert infer_rotation(time, azimuth) == pytest.approx(rotation, rel=2e-3)


def test_strays_and_late_reports_do_not_move_the_rotation():
    rng = np.random.default_rng(3)
    time, azimuth = flights(rng, 4.0, 60, 10)
    bad = rng.random(len(time)) < 0.1
    azimuth[bad] = rng.uniform(0, TURN, bad.sum())
    assert infer_rotation(time, azimuth) == pytest.approx(4.0, rel=1e-3)


def test_unrelated_times_and_azimuths_have_no_rotation():
    rng = np.random.default_rng(0)
    assert infer_rotation(np.sort(rng.uniform(0, 300, 500)), rng.uniform(0, TURN, 500)) is None
    assert infer_rotation(np.zeros(0), np.zeros(0)) is None
    assert infer_rotation(np.full(50, 7.0), rng.uniform(0, TURN, 50)) is None


def test_the_encoder_of_reports_is_the_beam():
    time, azimuth = flights(np.random.default_rng(1), 4.0, 60, 20)
    encoder = encoder_of_reports(time, azimuth, 4.02)  # the rate need not be exact
    at = np.linspace(time[0] + 10, time[-1] - 10, 1000)
    true = TURN * (at - 500.0) / 4.0
    # A report's noise (0.1°, and 1/128 s is 0.7°) over some 80 of them, and a drift of 0.06° a turn.
    assert np.abs(wrap(encoder.angle_at(at) - true)).max() < 0.2 * DEG


def test_the_encoder_of_marks_passes_through_them_and_leaves_strays_out():
    time = np.arange(0, 40, 0.125)
    azimuth = np.mod(TURN * time / 4.0, TURN)
    azimuth[100] = np.mod(azimuth[100] + 2.0, TURN)
    encoder, strays = encoder_of_marks(time, azimuth, 4.0)
    assert strays == 1
    np.testing.assert_allclose(encoder.angle_at(time), TURN * time / 4.0 + encoder.angle[0], atol=1e-9)
    np.testing.assert_allclose(encoder.time_at(encoder.angle_at(np.array([-3.0, 50.0]))), [-3.0, 50.0])


def test_a_changing_rotation_is_followed():
    time = np.cumsum(np.linspace(0.115, 0.135, 640))
    angle = np.arange(640) * TURN / 32
    rotation = rotation_of_marks(time, np.mod(np.round(np.mod(angle, TURN) / TURN * 256), 256) / 256 * TURN)
    encoder, strays = encoder_of_marks(time, np.mod(angle, TURN), rotation)
    assert strays == 0
    np.testing.assert_allclose(encoder.angle_at(time) - encoder.angle[0], angle, atol=1e-9)


def test_the_rotation_of_less_than_a_turn_of_marks():
    assert rotation_of_marks(np.array([0.0, 0.5, 1.0]), np.array([5.5, 0.0, 0.7832])) == pytest.approx(
        4.0, rel=0.01
    )
    assert rotation_of_marks(np.array([1.0]), np.array([0.0])) is None


def made(time, azimuth):
    table = blank(CENTROID, len(time))
    table["ordinal"], table["time"], table["azimuth"] = np.arange(len(time)), time, azimuth
    table["range"] = 1000.0
    return table


def test_sectors_join_and_hold_every_row_where_the_beam_was():
    time, azimuth = flights(np.random.default_rng(5), 4.0, 20, 15, noise=0.0)
    encoder = encoder_of_reports(time, azimuth, 4.0)
    angle = encoder.angle_at(time) + wrap(azimuth - encoder.angle_at(time))
    sectors = list(cut(RADAR, encoder, made(time, azimuth), angle, angle))
    for before, after in itertools.pairwise(sectors):
        assert before.end == after.begin
        assert before.stop == after.start
    for sector in sectors:
        inside = angle[sector.centroids["ordinal"]]
        assert ((sector.begin <= inside) & (inside < sector.end)).all()
        assert sector.complete == sector.end
    ordinals = np.concatenate([s.centroids["ordinal"] for s in sectors])
    assert sorted(ordinals.tolist()) == list(range(len(time)))


def test_a_hole_in_the_recording_is_not_watched():
    time = np.concatenate((np.arange(0, 40, 0.1), np.arange(400, 440, 0.1)))
    azimuth = np.mod(TURN * time / 4.0, TURN)
    encoder, _ = encoder_of_marks(time, azimuth, 4.0)
    sectors = list(cut(RADAR, encoder, made(time, azimuth), encoder.angle_at(time), encoder.angle))
    assert sum(s.stop - s.start for s in sectors) == pytest.approx(80.0, abs=0.3)
    jumps = [b.begin - a.end for a, b in itertools.pairwise(sectors) if b.begin != a.end]
    assert len(jumps) == 1
    assert jumps[0] > LONGEST_SILENCE * TURN
    assert len(sectors) == pytest.approx(20 * SECTORS, abs=4)


def test_only_what_a_configuration_gives_is_stated():
    assert stated(RADAR, frozenset({"radar.rotation_s", "radar.sd_range_m", "radar.prf_hz"})) == {
        "rotation": 4.0,
        "sd_range": 50.0,
    }
    assert stated(None, frozenset()) == {}
