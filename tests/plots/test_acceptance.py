"""The acceptance figures of docs/detection.md in small; benchmarks/detection.py measures them at length.

Bounds are the accepted ones, widened by four standard errors of the smaller sample.
"""

import numpy as np
import pytest

from benchmarks.detection import (
    Passages,
    Separation,
    at_range,
    centroids_of,
    detection_probability,
    passages,
    resolved,
    scene,
    still_targets,
)
from radar_console.core.messages import CentroidFlag
from radar_console.core.units import DEG
from radar_console.scenario import RadarSettings


def four_errors(p: float, n: int) -> float:
    """Of an estimated probability."""
    return float(4.0 * np.sqrt(p * (1.0 - p) / n))


@pytest.fixture(scope="module")
def far() -> Passages:
    """400 passages at 250 km."""
    return at_range(250.0, 10, 7)


def test_theory_by_hand() -> None:
    """A target far below the noise leaves the false alarms of its cells; a strong one is always found."""
    radar = RadarSettings(snr_db=-60.0, p_fa=0.01)
    cells = 2 * 15  # pulses of 0.2° within a beam width of 1.5° on either side
    assert detection_probability(radar, 250.0, 1) == pytest.approx(1.0 - 0.99**cells, rel=1e-4)
    assert detection_probability(RadarSettings(snr_db=70.0), 250.0, 3) > 0.9999
    assert detection_probability(RadarSettings(), 250.0, 3) == pytest.approx(0.903, abs=0.0015)


def test_detection_probability(far: Passages) -> None:
    theory = detection_probability(RadarSettings(), 250.0, 3)
    error = four_errors(theory, far.count)
    assert theory - 0.03 - error < far.p_d < theory + 0.015 + error


def test_accuracy_in_azimuth(far: Passages) -> None:
    """The standard error of a deviation from n errors is about its n-th part by √(2n)."""
    widening = 1.0 + 4.0 / np.sqrt(2.0 * len(far.found))
    sigma = far.error_azimuth.std() / DEG
    assert 0.07 / widening < sigma < 0.10 * widening
    assert abs(far.error_azimuth.mean()) / DEG < 4.0 * 0.1 / np.sqrt(len(far.found)) + 0.002


def test_claims_are_kept(far: Passages) -> None:
    for z in np.abs(far.z):
        assert np.mean(z < 2.0) > 0.94 - four_errors(0.94, len(z))
        assert np.mean(z > 4.0) < 0.002 + four_errors(0.002, len(z))


def test_claims_are_kept_by_a_radar_of_another_scale() -> None:
    """A harbour radar from 2 to 6 km: cells of 10 m, and 14 pulses in a beam of 1°."""
    harbour = {
        "rotation_s": 2.5,
        "prf_hz": 2000.0,
        "beam_width_deg": 1.0,
        "cell_m": 10.0,
        "max_range_km": 7.0,
        "wavelength_m": 0.03,
        "snr_range_km": 5.0,
        "stc_range_km": 1.0,
        "p_fa": 1e-3,
    }
    near = passages(still_targets(4.0, 5, np.random.default_rng(9), **harbour), 9)
    assert near.error_range.std() < 3.0  # the default radar's is 20 m
    for z in np.abs(near.z):
        assert np.mean(z < 2.0) > 0.94 - four_errors(0.94, len(z))


def test_false_centroids() -> None:
    """Four scans of noise: Poisson with a mean of 35 to 50 a scan."""
    found = len(centroids_of(scene((), 4), 3))
    assert 140 - 4.0 * np.sqrt(140) < found < 200 + 4.0 * np.sqrt(200)


def test_strong_near_targets_are_neither_land_nor_split() -> None:
    near = at_range(50.0, 10, 8)
    assert near.p_d == 1.0
    assert near.flagged(CentroidFlag.EXTENDED | CentroidFlag.SPLIT) == 0


def test_resolution() -> None:
    error = four_errors(0.5, 72)
    assert resolved(Separation(1.5, 0.0), 72, 1) > 0.95
    assert resolved(Separation(0.0, 2.5), 72, 1) > 0.95
    assert resolved(Separation(1.25, 0.0), 72, 1) == pytest.approx(0.51, abs=error)
    assert resolved(Separation(0.0, 2.0), 72, 1) == pytest.approx(0.65, abs=error)
    assert resolved(Separation(0.5, 0.0), 72, 1) < 0.1
