"""Heights: evidence that parts aircraft above each other, and two states of their own."""

import numpy as np
import pytest
from scenes import FILTERS, Scene, held, of_track, run, sound, swaps, with_values

from radar_console.core.geometry import slant_range

FEET = 0.3048
# Both at the same place at the same time (t = 60 s), at an angle of 3.6°.
CROSSING = np.array([(-9.6e3, 79.68e3, 160.0, 5.0), (-9.6e3, 80.32e3, 160.0, -5.0)])
ABOVE = [9000.0, 9000.0 + 1000 * FEET]


def high(scene, heights, climb=0.0, known=lambda time: time >= 0, sd=10.0):
    """The scene's sectors seen from below: slant ranges, and reported heights at `known` times."""
    rng = np.random.default_rng(scene.seed)
    sectors = list(scene.sectors(8))
    noise = sd * rng.normal(size=len(scene.origin))
    for sector in sectors:
        table = sector.centroids
        true = np.array(heights)[scene.origin[table["ordinal"]]] + climb * table["time"]
        reported = np.where(known(table["time"]), true + noise[table["ordinal"]], np.nan)
        slant = np.where(np.isnan(reported), table["range"], slant_range(table["range"], reported))
        yield sector.adding(centroids=with_values(table, {"height": reported, "range": slant}))


@pytest.mark.parametrize("name", ["kalman", "adapted"])
def test_a_thousand_feet_part_two_aircraft_at_one_place(name):
    swapped = {2: 0, 3: 0}
    for seed in range(6):
        scene = Scene(CROSSING, turns=30, p_d=0.9, seed=seed)
        for dimensions in swapped:
            rows, counts = run(high(scene, ABOVE), dimensions=dimensions, **FILTERS[name])
            swapped[dimensions] += swaps(rows, scene)
            if dimensions == 3:
                assert (counts.confirmed, counts.lost) == (2, 0)
                assert sound(rows)
    assert swapped[3] == 0
    assert swapped[2] > 0


def test_rows_have_the_height_and_what_it_is_worth():
    scene = Scene(CROSSING[:1], turns=25, p_d=1.0)
    rows, _ = run(high(scene, [3000.0], climb=12.0))
    track = of_track(rows, held(rows)[0])[5:]
    true = 3000.0 + 12.0 * track["time"]
    assert np.isfinite(track["sd_up"]).all()
    # The claimed noise is 30 m, that of the reports 10 m.
    assert np.abs(track["up"] - true).max() < 30.0
    assert np.all(np.abs(track["up"] - true) < 3.0 * track["sd_up"])
    assert np.all(track["sd_up"] < 40.0)
    assert np.abs(track["v_up"][-10:] - 12.0).max() < 2.0
    assert np.all(np.abs(track["v_up"] - 12.0) < 3.0 * track["sd_v_up"])


@pytest.mark.parametrize("dimensions", [2, 3])
def test_without_heights_there_is_none(dimensions):
    scene = Scene(CROSSING, turns=8)
    given = high(scene, ABOVE) if dimensions == 2 else scene.sectors()
    rows, counts = run(given, dimensions=dimensions)
    assert counts.confirmed == 2
    for name in ("up", "v_up", "sd_up", "sd_v_up"):
        assert np.isnan(rows[name]).all()


def test_a_height_that_comes_late_and_goes_again():
    """A track learns its height when there is one, and predicts it when there is none any more."""
    scene = Scene(CROSSING[:1], turns=25, p_d=1.0)
    rows, counts = run(high(scene, [3000.0], 10.0, lambda time: (time > 30) & (time < 70)))
    assert (counts.confirmed, counts.lost) == (1, 0)
    track = of_track(rows, held(rows)[0])
    assert np.isnan(track["up"][track["time"] < 30]).all()
    after = track[track["time"] > 74]
    assert np.all(np.diff(after["sd_up"]) > 0)
    assert np.all(np.abs(after["up"] - 3000.0 - 10.0 * after["time"]) < 3.0 * after["sd_up"])


def test_a_garbled_height_moves_nothing():
    """One height in ten is anything: the track goes on, its height within what it claims."""
    scene = Scene(CROSSING[:1], turns=30, p_d=1.0)
    rng = np.random.default_rng(4)
    sectors = []
    for sector in high(scene, [9000.0]):
        table = sector.centroids
        wrong = rng.random(len(table)) < 0.1
        height = np.where(wrong, rng.uniform(0.0, 12e3, len(table)), table["height"])
        sectors.append(sector.adding(centroids=with_values(table, {"height": height})))
    rows, counts = run(sectors)
    assert (counts.confirmed, counts.lost) == (1, 0)
    late = of_track(rows, held(rows)[0])[8:]
    assert np.all(np.abs(late["up"] - 9000.0) < 4.0 * late["sd_up"])
