"""Resampling: every scheme copies in proportion to the weights."""

import math

import filterpy.monte_carlo
import numpy as np
import pytest

from radar_console.estimation import draws, resampling
from radar_console.estimation.resampling import MULTINOMIAL, RESIDUAL, STRATIFIED, SYSTEMATIC

SCHEMES = {
    SYSTEMATIC: filterpy.monte_carlo.systematic_resample,
    STRATIFIED: filterpy.monte_carlo.stratified_resample,
    RESIDUAL: filterpy.monte_carlo.residual_resample,
    MULTINOMIAL: filterpy.monte_carlo.multinomial_resample,
}


def key(*numbers):
    return np.uint64(draws.key(*numbers))


def some_weights(count, seed=8):
    weights = (np.random.default_rng(seed).random(count) ** 4).astype(np.float32)
    return weights / weights.sum(dtype=float).astype(np.float32)


def copies_of(scheme, weights, number):
    ancestors = np.empty(weights.size, np.int32)
    resampling.resample(scheme, weights, key(1, 2, number), ancestors)
    assert np.all(np.diff(ancestors) >= 0)
    return np.bincount(ancestors, minlength=weights.size)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_scheme_is_unbiased_and_varies_as_filterpys(scheme):
    """The mean of the copies over 4,000 draws within 4.5 of its standard errors; their variance as
    that of filterpy's, within a tenth (the variance of a variance, 2/4000, times 40 particles)."""
    weights, runs = some_weights(40), 4000
    expected = 40 * weights.astype(float)
    found = np.array([copies_of(scheme, weights, k) for k in range(runs)])
    # The copies' own spread, or that of the one copy that a small weight gets now and then.
    spread = np.maximum(found.std(axis=0), np.sqrt(np.minimum(expected, 0.25)))
    assert np.all(np.abs(found.mean(axis=0) - expected) <= 4.5 * spread / math.sqrt(runs))
    # filterpy draws from NumPy's global generator.
    np.random.seed(1)  # noqa: NPY002
    theirs = [
        np.bincount(SCHEMES[scheme](weights.astype(float) / weights.sum(dtype=float)), minlength=40)
        for _ in range(runs)
    ]
    assert found.var(axis=0).sum() == pytest.approx(np.var(theirs, axis=0).sum(), rel=0.1)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("heir", [0, 3, 9])
def test_one_weight_takes_all(scheme, heir):
    weights = np.zeros(10, np.float32)
    weights[heir] = 1.0
    assert copies_of(scheme, weights, 1)[heir] == 10


def select(terms, number):
    count = terms.shape[1]
    ancestors, bounds = np.empty(count, np.int32), np.empty(len(terms) + 1, np.int64)
    resampling.systematic_pairs(terms, float(terms.sum(dtype=float)), key(3, 4, number), ancestors, bounds)
    found = np.zeros(terms.shape, int)
    for row in range(len(terms)):
        np.add.at(found[row], ancestors[bounds[row] : bounds[row + 1]], 1)
    assert bounds[0] == 0
    assert bounds[-1] == count
    return found


@pytest.mark.parametrize(("alternatives", "count"), [(1, 300), (2, 64), (3, 5), (5, 300)])
def test_pairs_are_copied_in_proportion(alternatives, count):
    """Each pair within one copy of what it is worth, always; and on average what it is worth."""
    rng = np.random.default_rng(alternatives)
    terms = (rng.random((alternatives, count)) ** 6).astype(np.float32)
    terms[1:2] *= np.float32(1e-3)  # of an unlikely alternative most blocks have no copy
    expected = count * terms.astype(float) / terms.sum(dtype=float)
    runs = 1000
    found = np.array([select(terms, k) for k in range(runs)])
    assert np.all(np.abs(found - expected) < 1.0 + 1e-5)
    # A pair's copies vary by a Bernoulli variable's variance at most, ¼; 4.5 standard errors.
    assert np.abs(found.mean(axis=0) - expected).max() < 4.5 * 0.5 / math.sqrt(runs)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 299), (1, 150), (2, 0), (2, 299)])
def test_one_pair_takes_all(row, column):
    terms = np.zeros((3, 300), np.float32)
    terms[row, column] = 1e-20
    for k in range(50):
        assert select(terms, k)[row, column] == 300


def test_a_hundred_thousand_particles_fill_all_places():
    terms = np.random.default_rng(1).random((2, 100_000)).astype(np.float32)
    for k in range(5):
        assert np.abs(select(terms, k) - 1e5 * terms / terms.sum(dtype=float)).max() < 1.001
