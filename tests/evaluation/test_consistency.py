"""NEES, NIS and their bands against definitions and simulation."""

import numpy as np
import pytest

from radar_console.evaluation.consistency import chi_square_band, nees, nis


def test_nees_and_nis_are_quadratic_forms_with_the_inverse():
    rng = np.random.default_rng(1)
    A, truth, mean = rng.normal(size=(5, 3, 4, 4)), rng.normal(size=(5, 3, 4)), rng.normal(size=(3, 4))
    P = A @ A.mT + np.eye(4)
    found = nees(truth, mean, P)
    for i in range(5):
        for k in range(3):
            error = truth[i, k] - mean[k]
            assert found[i, k] == pytest.approx(error @ np.linalg.inv(P[i, k]) @ error, rel=1e-10)
    assert np.array_equal(nis(truth, P), nees(truth, np.zeros(4), P))


def test_the_band_of_the_book():
    """Bar-Shalom, Li, Kirubarajan 2001, §5.4.2: 50 runs of a state of two, [1.5, 2.6] for 95 %."""
    assert chi_square_band(50, 2) == pytest.approx((1.5, 2.6), abs=0.05)


def test_means_over_runs_lie_in_the_band_as_often_as_it_says():
    rng = np.random.default_rng(2)
    low, high = chi_square_band(100, 4, 0.9)
    means = nees(rng.normal(size=(4000, 100, 4)), np.zeros(4), np.eye(4)).mean(axis=1)
    # 4 standard errors of a part of 4,000.
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.9, abs=0.019)
