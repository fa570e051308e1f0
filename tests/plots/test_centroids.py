"""Centroids recomputed in the plainest form; the valley split; the flags."""

import numpy as np
import pytest

from radar_console.core.messages import PLOT, CentroidFlag, Table, blank
from radar_console.core.units import DEG, TURN
from radar_console.plots.centroids import Resolution, claimed_deviations, measure, pulses_per_turn
from radar_console.plots.clusters import Clusters
from radar_console.scenario import PlotSettings, RadarSettings

RADAR = RadarSettings()
RESOLUTION = Resolution.of(RADAR)
THRESHOLD = 2.26  # of a false-alarm probability of 0.006


def plots_of(pulse: np.ndarray, cell: np.ndarray, amplitude: np.ndarray) -> Table:
    plots = blank(PLOT, len(pulse))
    plots["ordinal"] = 100 + np.arange(len(pulse))
    plots["pulse"], plots["cell"], plots["amplitude"] = pulse, cell, amplitude
    plots["range"] = (plots["cell"] + 0.5) * RADAR.cell_m
    plots["time"] = plots["pulse"] / RADAR.prf_hz
    return plots


def one(plots: Table, cut: bool = False, **settings: float) -> Table:
    """The centroids of one cluster."""
    cluster = Clusters(plots, np.array([0, len(plots)]), np.array([cut]))
    return measure(cluster, PlotSettings(**settings), RESOLUTION)


def target(*places: tuple[float, float, float]) -> Table:
    """Noiseless plots of targets at (pulse, cell, peak amplitude), in phase."""
    pulse, cell = (a.ravel() for a in np.meshgrid(np.arange(100), np.arange(40), indexing="ij"))
    beam = RESOLUTION.beam / RESOLUTION.pulse
    amplitude = sum(
        a * np.exp2(-4.0 * ((pulse - p) / beam) ** 2) * np.maximum(1.0 - abs(cell - c), 0.0)
        for p, c, a in places
    )
    seen = amplitude > THRESHOLD
    return plots_of(pulse[seen], cell[seen], amplitude[seen])


def test_centroid_by_its_definition() -> None:
    rng = np.random.default_rng(2)
    pulse, cell = np.repeat(np.arange(1796, 1806), 2), np.tile([30, 31], 10)
    amplitude = np.sqrt(5.1 + rng.exponential(60.0, 20))
    plots = plots_of(pulse, cell, amplitude)
    plots["doppler"], plots["elevation"] = rng.normal(size=(2, 20))
    plots["elevation"][::3] = np.nan
    centroid = one(plots)[0]

    weighs = amplitude >= 0.3 * amplitude.max()
    a, w = amplitude[weighs], amplitude[weighs] ** 2
    known = weighs & ~np.isnan(plots["elevation"])
    expected = {
        "ordinal": 100 + amplitude.argmax(),
        "time": np.average(plots["time"][weighs], weights=w),
        "azimuth": (np.average(pulse[weighs], weights=w) * TURN / 1800) % TURN,
        "range": np.average(plots["range"][weighs], weights=a),
        "doppler": np.average(plots["doppler"][weighs], weights=a),
        "elevation": np.average(plots["elevation"][known], weights=amplitude[known]),
        "snr": 20.0 * np.log10(amplitude.max()),
        "hits": 20,
        "flags": 0,
        "mode_3a": -1,
    }
    for name, value in expected.items():
        assert centroid[name] == pytest.approx(value, rel=1e-12), name
    assert centroid["azimuth"] < 0.02  # the cluster lies across north
    assert weighs.sum() < 20  # otherwise the edge was not tried
    assert np.isnan([centroid[name] for name in ("height", "sd_doppler", "sd_elevation")]).all()


def test_unknown_doppler_and_elevation_stay_unknown() -> None:
    centroid = one(target((50.0, 10.3, 30.0)))[0]
    assert np.isnan(centroid["doppler"])
    assert np.isnan(centroid["elevation"])


@pytest.mark.parametrize("pulse", [49.5, 50.0, 50.3])
@pytest.mark.parametrize("cell", [9.5, 10.0])
def test_a_noiseless_target_is_where_it_is(pulse: float, cell: float) -> None:
    """In the middle of a cell or of two, where no weaker cell falls below the edge: no error in range."""
    centroid = one(target((pulse, cell, 30.0)))[0]
    assert centroid["azimuth"] * 1800 / TURN == pytest.approx(pulse, abs=0.1)
    assert centroid["range"] == pytest.approx((cell + 0.5) * 150.0, abs=1e-9)


def test_azimuth_is_in_the_turn_just_before_north() -> None:
    plots = plots_of(np.full(3, 3600), np.array([4, 5, 6]), np.full(3, 3.0))
    assert one(plots)["azimuth"][0] == 0.0
    plots = plots_of(np.full(3, 3599), np.array([4, 5, 6]), np.full(3, 3.0))
    assert one(plots)["azimuth"][0] == pytest.approx(TURN * 1799 / 1800)


def test_claimed_deviations_of_the_default_radar() -> None:
    peak, hits = np.array([3.0, 9.0, 200.0]), np.array([3, 11, 34])
    sd_range, sd_azimuth = claimed_deviations(peak, hits, RESOLUTION)
    azimuth = np.sqrt(0.0081**2 + (0.91 * peak**-0.99 * hits**-0.41) ** 2) * DEG
    distance = np.sqrt(14.8**2 + (277 * peak**-0.52 * hits**-1.05) ** 2)
    np.testing.assert_allclose(sd_azimuth, azimuth, rtol=1e-12)
    np.testing.assert_allclose(sd_range, distance, rtol=1e-12)


def test_claimed_deviations_scale_with_the_radar() -> None:
    peak, hits = np.array([3.0, 9.0]), np.array([3, 11])
    base = np.array(claimed_deviations(peak, hits, RESOLUTION))
    half = Resolution(RESOLUTION.pulse / 2, RESOLUTION.cell / 15, RESOLUTION.beam / 2)
    scaled = np.array(claimed_deviations(peak, hits, half))
    np.testing.assert_allclose(scaled, base * [[1 / 15], [1 / 2]], rtol=1e-12)
    # Four times the pulses and hits: noise averages to half, and so does the step's share at most.
    dense = Resolution(RESOLUTION.pulse / 4, RESOLUTION.cell, RESOLUTION.beam)
    finer = np.array(claimed_deviations(peak, 4 * hits, dense))
    assert (finer[1] < 0.51 * base[1]).all()
    assert (finer[1] > 0.47 * base[1]).all()


def test_a_turn_has_a_whole_number_of_pulses() -> None:
    assert pulses_per_turn(RADAR) == 1800
    assert pulses_per_turn(RadarSettings(rotation_s=2.5, prf_hz=333.3)) == 833


@pytest.mark.parametrize("second", [(61.25, 10.2, 30.0), (50.0, 12.7, 30.0), (59.0, 11.8, 20.0)])
def test_two_targets_are_parted(second: tuple[float, float, float]) -> None:
    first = (50.0, 10.2, 30.0)
    found = one(target(first, second))
    assert (found["flags"] == CentroidFlag.SPLIT).all()
    assert len(found) == 2
    for centroid, (pulse, cell, _) in zip(np.sort(found, order="ordinal"), (first, second), strict=True):
        assert centroid["azimuth"] * 1800 / TURN == pytest.approx(pulse, abs=0.5)
        assert centroid["range"] / 150.0 - 0.5 == pytest.approx(cell, abs=0.3)
    together = one(target(first, second), split=False)
    assert len(together) == 1
    assert together["hits"][0] == found["hits"].sum()


def test_a_peak_of_too_few_hits_is_no_target() -> None:
    plots = target((50.0, 10.0, 30.0))
    spike = plots_of(plots["pulse"].max() + np.array([2, 3]), np.array([10, 10]), np.array([25.0, 25.0]))
    assert len(one(np.concatenate([plots, spike]))) == 1


@pytest.mark.parametrize("amplitude", [10.0, 200.0, 5000.0])
def test_a_single_target_is_whole_however_strong(amplitude: float) -> None:
    """200 is 46 dB, the mean at 50 km; 5,000 spans more than the 22 pulses of a flagged cluster."""
    plots = target((50.0, 10.2, amplitude))
    centroid = one(plots)
    assert len(centroid) == 1
    assert centroid["flags"][0] == 0
    assert np.ptp(plots["pulse"]) + 1 > (22 if amplitude > 1000 else 5)


def test_wide_and_deep_clusters_are_extended() -> None:
    for pulses, cells, flag in ((22, 5, 0), (23, 2, CentroidFlag.EXTENDED), (9, 6, CentroidFlag.EXTENDED)):
        pulse, cell = (a.ravel() for a in np.meshgrid(np.arange(pulses), np.arange(cells), indexing="ij"))
        found = one(plots_of(pulse, cell, np.full(len(pulse), 8.0)))
        assert found["flags"].tolist() == [flag], (pulses, cells)


def test_two_strong_targets_over_the_limits_are_parted_and_not_land() -> None:
    found = one(target((40.0, 10.2, 100.0), (55.0, 10.6, 100.0)))
    assert found["flags"].tolist() == [CentroidFlag.SPLIT] * 2


def test_a_piece_of_a_longer_cluster_is_extended_whatever_its_size() -> None:
    assert one(target((50.0, 10.2, 30.0)), cut=True)["flags"].tolist() == [CentroidFlag.EXTENDED]


def test_speckled_land_is_one_extended_cluster() -> None:
    """Peaks everywhere, as land has them: over the limits, and too many parts to be targets."""
    rng = np.random.default_rng(3)
    places = [
        (float(p), float(c), float(rng.uniform(5.0, 60.0))) for p in range(5, 45, 8) for c in range(5, 21, 2)
    ]
    assert one(target(*places))["flags"].tolist() == [CentroidFlag.EXTENDED]
