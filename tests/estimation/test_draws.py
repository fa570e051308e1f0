"""Random numbers without state, and the exponential of single precision."""

import math

import numpy as np
import pytest
from numba import njit
from scipy import stats

from radar_console.estimation import draws

_exponential = draws.exponential


def key(*numbers):
    return np.uint64(draws.key(*numbers))


def normals(count, *numbers):
    a, b = np.empty(count, np.float32), np.empty(count, np.float32)
    draws.pairs_of_normals(key(*numbers), a, b)
    return a, b


@njit(error_model="numpy")
def exponentials(x, out):
    for i in range(x.size):
        out[i] = _exponential(x[i])


def test_the_exponential_is_right_to_two_units_in_the_last_place():
    x = np.linspace(-87.0, 87.0, 1_000_001).astype(np.float32)
    found = np.empty_like(x)
    exponentials(x, found)
    assert np.abs(found / np.exp(x.astype(float)) - 1.0).max() < 2.4e-7  # 2 · 2⁻²³


def test_the_exponential_stays_within_its_bounds():
    x = np.array([-np.inf, -1e30, -88.0, 88.0, 1e30, np.inf], np.float32)
    found = np.empty_like(x)
    exponentials(x, found)
    assert np.allclose(found, np.exp([-87.0] * 3 + [87.0] * 3), rtol=2.4e-7)


@pytest.mark.parametrize("seed", [1, 2])
def test_normals_are_normal(seed):
    """Two million of each: moments within 4 of their standard errors, and Kolmogorov's distance."""
    count = 2_000_000
    for values in normals(count, seed, 1, 1):
        values = values.astype(float)
        for power, expected, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96), (6, 15, 10170)):
            assert abs((values**power).mean() - expected) < 4 * math.sqrt(variance / count)
        # D √n exceeds 1.95 once in a thousand.
        assert stats.kstest(values, "norm").statistic * math.sqrt(count) < 1.95
        assert 4.5 < np.abs(values).max() < 5.95


def test_draws_of_neighbouring_particles_tracks_and_steps_are_independent():
    """Correlations of values and of squares within 4.5 standard errors, of 136 and as many pairs."""
    count = 100_000
    rows = []
    for numbers in ((5, 1, 1), (5, 2, 1), (5, 1, 2), (6, 1, 1)):
        a, b = normals(count, *numbers)
        rows += [a, b, np.roll(a, 1), np.roll(b, 7)]
    for values in (np.array(rows), np.array(rows) ** 2):
        correlation = np.corrcoef(values) - np.eye(len(rows))
        assert np.abs(correlation).max() < 4.5 / math.sqrt(count)


def test_a_draw_depends_on_nothing_but_its_key_and_place():
    long, short = normals(1000, 1, 2, 3), normals(10, 1, 2, 3)
    assert np.array_equal(long[0][:10], short[0])
    assert np.array_equal(long[1][:10], short[1])


def test_uniforms_are_uniform_and_open():
    values = np.empty(1_000_000, np.float32)
    draws.uniforms(key(1, 1, 1), values)
    assert 0.0 < values.min()
    assert values.max() < 1.0
    assert stats.kstest(values.astype(float), "uniform").statistic * 1000.0 < 1.95
