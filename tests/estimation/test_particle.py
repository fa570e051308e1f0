"""The particle kernels against the same algebra with whole matrices, and against their statistics."""

import math

import numpy as np
import pytest

from radar_console.estimation import draws, particle
from radar_console.estimation.gaussian import log_density
from radar_console.estimation.particle import ACROSS, ALONG, MEASURED, RATE_GAIN, TERMS

TABLE = particle.normals()
S = np.array([[400.0, 120.0], [120.0, 60.0]])
R = np.array([[900.0, 250.0], [250.0, 1600.0]])
PACKED = np.array([900.0, 250.0, 1600.0])
COURSE = np.array([0.6, -0.8])
LAG, RATE_VARIANCE = 0.3, 4.0


def key(*numbers):
    return np.uint64(draws.key(*numbers))


def measurement(a=30.0, b=-20.0, rate=5.0, lag=LAG):
    return np.array([a, b, rate, lag, *COURSE], np.float32)


def joint(scale, doppler):
    """H (m, 4) and covariance of the innovation (m, m), for a particle of covariance S in each axis."""
    P = np.kron(S, np.eye(2))
    H = np.hstack([np.eye(2), LAG * np.eye(2)])
    noise = scale * R
    if doppler:
        H = np.vstack([H, [0.0, 0.0, *COURSE]])
        noise = np.block([[noise, np.zeros((2, 1))], [np.zeros((1, 2)), scale * RATE_VARIANCE]])
    return P, H, H @ P @ H.T + noise


def some_cloud(count, seed=7):
    rng = np.random.default_rng(seed)
    spread = np.array([[60.0], [60.0], [8.0], [8.0]])
    cloud = (spread * rng.normal(size=(4, count))).astype(np.float32)
    weights = rng.random(count).astype(np.float32)
    particle.normalise(weights)
    return cloud, weights


@pytest.mark.parametrize("doppler", [False, True])
@pytest.mark.parametrize("outliers", [0.0, 0.1])
def test_weigh_is_the_density_of_the_whole_measurement(doppler, outliers):
    """To the rounding of single precision in a sum of 500 terms of d²/2 up to 80: 1e-5."""
    cloud, weights = some_cloud(500)
    z, r = measurement(), RATE_VARIANCE if doppler else math.inf
    g = np.empty((2, 500))
    for part, (share, scale) in enumerate(((1.0 - outliers, 1.0), (outliers, particle.BROAD))):
        _, H, B = joint(scale, doppler)
        nu = z[: len(H)].astype(float) - (H @ cloud.astype(float)).T
        g[part] = share * np.exp(log_density(nu, B))
    relative = np.empty((2, 500), np.float32)
    found, total = particle.weigh(cloud, weights, S, z, PACKED, r, outliers, relative)
    assert found == pytest.approx(math.log(np.sum(weights * g)), abs=2e-5)
    assert np.allclose(relative / relative.sum(), g / g.sum(), rtol=1e-4, atol=1e-9)
    assert total == pytest.approx(np.sum(weights * relative, dtype=float), rel=1e-5)


@pytest.mark.parametrize("outliers", [0.0, 0.05])
@pytest.mark.parametrize("distance", [1e3, 1e6, 1e9])
def test_a_measurement_far_out_does_not_underflow(outliers, distance):
    cloud, weights = some_cloud(100)
    relative = np.empty((2, 100), np.float32)
    found, total = particle.weigh(
        cloud, weights, np.zeros((2, 2)), measurement(a=distance), PACKED, math.inf, outliers, relative
    )
    assert math.isfinite(found)
    assert found < -10.0
    assert total > 0.0
    assert np.all(np.isfinite(relative))
    assert relative.max() == pytest.approx(1.0 if outliers == 0.0 else relative.max())


@pytest.mark.parametrize(("doppler", "apart"), [(False, 0.0), (False, 150.0), (True, 0.0)])
def test_a_proposed_position_has_the_posterior_of_the_pair(doppler, apart):
    """200,000 children of one particle: mean within 4.5 standard errors, covariance within 1.5 %, which
    is 4.5 times √(2/n). What is left open of the position, and of the velocity with it, is not drawn."""
    count, z = 200_000, measurement()
    r = RATE_VARIANCE if doppler else math.inf
    P, H, B = joint(1.0, doppler)
    x = np.array([20.0, -35.0, 6.0, 3.0])
    K = P @ H.T @ np.linalg.inv(B)
    mean = x + K @ (z[: len(H)] - H @ x)
    slope, _ = particle.given_position(S)
    cov = P - K @ H @ P - np.kron(apart * np.array([[1.0, slope], [slope, slope * slope]]), np.eye(2))
    parents = np.tile(x.astype(np.float32)[:, None], count)
    noise, cloud = np.empty((4, count), np.float32), np.empty((4, count), np.float32)
    draws.pairs_of_normals(key(1, 1, 1), noise[0], noise[1])
    draws.pairs_of_normals(key(1, 1, 2), noise[2], noise[3])
    terms = np.empty(TERMS, np.float32)
    particle.condition(S, z, PACKED, r, 1.0, 0.0, apart, terms)
    particle.propose(parents, 0, count, z, terms, noise, cloud)
    particle.shake(cloud, 0, count, z, terms, noise)
    found = cloud.astype(float)
    error = np.abs(found[:2].mean(axis=1) - mean[:2])
    assert np.all(error < 4.5 * np.sqrt(np.diag(cov)[:2] / count))
    scale = np.sqrt(np.outer(np.diag(cov), np.diag(cov)))
    assert np.all(np.abs(np.cov(found) - cov)[:2, :2] < 0.015 * scale[:2, :2])
    # What the lag tells of the velocity beyond the position is let go: of order (lag / T)².
    assert np.all(np.abs(found[2:].mean(axis=1) - mean[2:]) < 0.05 * np.sqrt(np.diag(cov)[2:]))
    assert np.all(np.abs(np.cov(found) - cov)[2:, 2:] < 0.05 * scale[2:, 2:])


def test_what_is_left_open_is_not_drawn():
    terms = np.empty(TERMS, np.float32)
    _, left = particle.given_position(S)
    particle.condition(S, measurement(), PACKED, math.inf, 1.0, left, 0.0, terms)
    assert terms[ALONG] == terms[ACROSS] == terms[RATE_GAIN] == 0.0
    rest = left * RATE_VARIANCE / (left + RATE_VARIANCE)
    particle.condition(S, measurement(), PACKED, RATE_VARIANCE, 1.0, rest, 0.0, terms)
    assert terms[ALONG] == pytest.approx(0.0, abs=1e-3 * math.sqrt(left))
    assert terms[ACROSS] == pytest.approx(math.sqrt(left - rest))


def test_with_nothing_open_a_proposal_moves_nothing():
    cloud, _ = some_cloud(50)
    out, noise = np.empty_like(cloud), np.ones((4, 50), np.float32)
    terms = np.empty(TERMS, np.float32)
    particle.condition(np.zeros((2, 2)), measurement(), PACKED, math.inf, 1.0, 0.0, 0.0, terms)
    particle.propose(cloud, 0, 50, measurement(), terms, noise, out)
    assert np.array_equal(out, cloud)
    particle.condition_on_nothing(np.zeros((2, 2)), 0.0, 0.0, terms)
    particle.propose(cloud, 0, 50, np.zeros(MEASURED, np.float32), terms, noise, out)
    assert np.array_equal(out, cloud)


def test_the_rest_grows_and_is_drawn():
    """White acceleration from nothing, drawn by 200,000 particles; covariance within 1.5 %."""
    count, q, T = 200_000, 2.0, 4.0
    Q = q * np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]])
    rest, F = S.copy(), np.array([[1.0, T], [0.0, 1.0]])
    particle.grow(rest, T, Q)
    assert np.allclose(rest, F @ S @ F.T + Q, rtol=1e-12)
    cloud, noise = np.zeros((4, count), np.float32), np.empty((4, count), np.float32)
    for k in (0, 2):
        draws.pairs_of_normals(key(3, 3, k), noise[k], noise[k + 1])
    expected = rest.copy()
    particle.diffuse(cloud, rest, noise)
    assert np.all(rest == 0.0)
    cov = np.kron(expected, np.eye(2))
    scale = np.sqrt(np.outer(np.diag(cov), np.diag(cov)))
    assert np.all(np.abs(np.cov(cloud.astype(float)) - cov) < 0.015 * scale)


def test_centring_gives_the_weighted_moments():
    """Sums of 1,000 terms in single precision: 1e-5 of the spread."""
    cloud, weights = some_cloud(1000)
    cloud += np.float32(40.0)
    before = cloud.astype(float)
    expected, cov_expected = np.average(before, 1, weights), np.cov(before, aweights=weights, ddof=0)
    mean, cov = np.empty(4), np.empty((4, 4))
    particle.centre(cloud, weights, mean, cov)
    scale = np.sqrt(np.diag(cov_expected))
    assert np.all(np.abs(mean - expected) < 1e-5 * np.maximum(scale, 40.0))
    assert np.all(np.abs(cov - cov_expected) < 1e-5 * np.outer(scale, scale) + 1e-4)
    assert np.all(np.abs(cloud + expected[:, None] - before) < 1e-4)


def test_regularising_keeps_mean_and_covariance():
    count = 100_000
    rng = np.random.default_rng(9)
    A = rng.normal(size=(4, 4))
    P = A @ A.T + np.eye(4)
    L = np.empty((4, 4))
    particle.cholesky(P, L)
    assert np.allclose(L @ L.T, P, rtol=1e-12)
    cloud, scratch = np.empty((4, count), np.float32), np.empty((4, count), np.float32)
    particle.draw(cloud, L, key(1, 1, 1), TABLE)
    weights, mean, cov = np.full(count, 1 / count, np.float32), np.empty(4), np.empty((4, 4))
    particle.centre(cloud, weights, mean, cov)
    particle.regularise(cloud, cov, 0.25, key(1, 1, 2), TABLE, scratch)
    found = cloud.astype(float)
    scale = np.sqrt(np.diag(cov))
    assert np.all(np.abs(found.mean(axis=1)) < 0.01 * scale)
    assert np.all(np.abs(np.cov(found) - cov) < 0.02 * np.outer(scale, scale))


def test_a_singular_covariance_has_a_factor():
    L = np.empty((4, 4))
    particle.cholesky(np.zeros((4, 4)), L)
    assert np.all(np.isfinite(L))
    particle.cholesky(np.ones((4, 4)), L)
    assert np.allclose(L @ L.T, np.ones((4, 4)), atol=1e-5)


def test_the_table_has_the_moments_of_the_normal():
    values = TABLE.astype(float)
    assert abs(values.mean()) < 1e-6
    assert abs(values.var() - 1) < 1e-6
    assert abs((values**4).mean() - 3) < 3e-3
