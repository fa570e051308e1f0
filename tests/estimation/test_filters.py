"""The filters against filterpy and against each other."""

import math

import filterpy.common
import filterpy.kalman
import numpy as np
import pytest

from radar_console.estimation import kalman, measurement, motion, particle
from radar_console.estimation.gaussian import Gaussian, collapse, log_density

H = np.eye(2, 4)
TABLE = particle.normals()


def key(*numbers):
    return np.uint64(particle.key(*numbers))


def random_gaussian(rng, *shape):
    A = rng.normal(size=(*shape, 4, 4))
    return Gaussian(rng.normal(size=(*shape, 4)), A @ A.mT + np.eye(4))


def test_constant_velocity_is_filterpys():
    F, Q = motion.constant_velocity([0.5, 4.0], 2.0)
    for k, T in enumerate((0.5, 4.0)):
        block = filterpy.common.Q_continuous_white_noise(2, T, 2.0)
        assert np.allclose(Q[k][::2, ::2], block, rtol=1e-14)
        assert np.allclose(Q[k][1::2, 1::2], block, rtol=1e-14)
        assert F[k, 0, 2] == F[k, 1, 3] == T


def test_a_thousand_batched_kalman_steps_are_filterpys():
    rng = np.random.default_rng(1)
    state, z = random_gaussian(rng, 100), rng.normal(size=(100, 2))
    F, Q = motion.constant_velocity(3.0, 0.7)
    R = np.diag([2.0, 3.0])
    found, log_likelihood = kalman.update(kalman.predict(state, F, Q), z, H, R)
    for k in range(100):
        f = filterpy.kalman.KalmanFilter(4, 2)
        f.x, f.P, f.F, f.Q, f.H, f.R = state.mean[k], state.cov[k], F, Q, H, R
        f.predict()
        f.update(z[k])
        assert np.allclose(found.mean[k], f.x, rtol=0, atol=1e-9)
        assert np.allclose(found.cov[k], f.P, rtol=0, atol=1e-9)
        assert log_likelihood[k] == pytest.approx(f.log_likelihood, abs=1e-9)


def test_the_compiled_steps_are_the_batched_ones():
    rng = np.random.default_rng(2)
    F, Q = motion.constant_velocity(4.0, 1.5)
    for state in (random_gaussian(rng) for _ in range(20)):
        x, P = state.mean.copy(), state.cov.copy()
        expected = kalman.predict(state, F, Q)
        kalman.predict_in_place(x, P, 4.0, 1.5)
        assert np.allclose(x, expected.mean, rtol=1e-13)
        assert np.allclose(P, expected.cov, rtol=1e-12)
        z, R = rng.normal(size=2), np.array([[2.0, 0.3], [0.3, 1.0]])
        expected, _ = kalman.update(expected, z, H, R)
        kalman.update_in_place(x, P, z[None], np.array([[2.0, 0.3, 1.0]]), np.zeros(1), np.ones(1))
        assert np.allclose(x, expected.mean, rtol=0, atol=1e-10)
        assert np.allclose(P, expected.cov, rtol=0, atol=1e-9)


def test_alternatives_are_the_collapsed_mixture():
    rng = np.random.default_rng(3)
    state, z = random_gaussian(rng), rng.normal(size=(3, 2))
    lag, beta = np.array([0.1, -0.2, 0.0]), np.array([0.5, 0.2, 0.1])
    R = np.array([[2.0, 0.3, 1.0], [1.0, 0.0, 1.0], [3.0, -0.5, 2.0]])
    parts = [state]
    for j in range(3):
        Hj = np.hstack([np.eye(2), lag[j] * np.eye(2)])
        Rj = np.array([[R[j, 0], R[j, 1]], [R[j, 1], R[j, 2]]])
        parts.append(kalman.update(state, z[j], Hj, Rj)[0])
    expected = collapse(
        np.append(1 - beta.sum(), beta),
        Gaussian(np.stack([p.mean for p in parts]), np.stack([p.cov for p in parts])),
    )
    x, P = state.mean.copy(), state.cov.copy()
    kalman.update_in_place(x, P, z, R, lag, beta)
    assert np.allclose(x, expected.mean, rtol=0, atol=1e-12)
    assert np.allclose(P, expected.cov, rtol=0, atol=1e-10)


@pytest.mark.parametrize("sd_azimuth", [0.002, 0.05])
def test_converted_measurements_are_unbiased_and_their_covariance_is_theirs(sd_azimuth):
    """A million draws: the mean within 4 of its standard errors, the covariance within 1 %."""
    rng, r, a, n = np.random.default_rng(4), 1e5, 0.7, 1_000_000
    z = measurement.from_polar(
        r + 50 * rng.normal(size=n), a + sd_azimuth * rng.normal(size=n), 50.0, sd_azimuth
    )
    truth = np.array([r * math.sin(a), r * math.cos(a)])
    error = z.mean - truth
    assert np.all(np.abs(error.mean(axis=0)) < 4 * error.std(axis=0) / math.sqrt(n))
    claimed = measurement.from_polar(r, a, 50.0, sd_azimuth).cov
    # Along the line of sight the variance is small beside that across: compare in its own axes.
    u = np.array([[math.sin(a), math.cos(a)], [math.cos(a), -math.sin(a)]])
    found, claimed = np.diag(u @ np.cov(error.T) @ u.T), np.diag(u @ claimed @ u.T)
    assert np.allclose(found, claimed, rtol=0.01)


def test_range_zero_has_a_proper_covariance():
    z = measurement.from_polar(0.0, 1.0, 50.0, 0.002)
    assert np.all(np.linalg.eigvalsh(z.cov) > 0)


def test_the_table_has_the_moments_of_the_normal():
    values = TABLE.astype(float)
    assert abs(values.mean()) < 1e-6
    assert abs(values.var() - 1) < 1e-6
    assert abs((values**4).mean() - 3) < 3e-3


def test_draws_of_neighbouring_particles_tracks_and_steps_are_independent():
    n = 20_000
    clouds = np.empty((3, 4, n), np.float32)
    for cloud, (track, step) in zip(clouds, ((1, 1), (2, 1), (1, 2)), strict=True):
        particle.draw(cloud, np.eye(4), key(5, track, step), TABLE)
    rows = np.concatenate([*clouds, clouds[0][:, np.arange(n) - 1]])
    correlation = np.corrcoef(rows) - np.eye(16)
    assert np.abs(correlation).max() < 4.5 / math.sqrt(n)


def run_both(rng, particles, turns=25):
    """A track of the model's own kind: errors of the Kalman filter and of the particle filter."""
    F, Q = motion.constant_velocity(4.0, 1.0)
    R = np.diag([50.0**2, 80.0**2])
    prior = Gaussian(np.zeros(4), np.diag([50.0, 80.0, 20.0, 20.0]) ** 2)
    truth = prior.mean + np.linalg.cholesky(prior.cov) @ rng.normal(size=4)
    cloud, weights = np.empty((4, particles), np.float32), np.full(particles, 1 / particles, np.float32)
    relative, scratch = np.empty(particles, np.float32), np.empty((4, particles), np.float32)
    mean, cov = np.empty(4), np.empty((4, 4))
    seed, kf, errors = int(rng.integers(1 << 40)), prior, []
    particle.draw(cloud, np.linalg.cholesky(prior.cov), key(seed, 0, 0), TABLE)
    anchor = np.zeros(4)
    for k in range(1, turns):
        truth = F @ truth + np.linalg.cholesky(Q) @ rng.normal(size=4)
        z = truth[:2] + np.sqrt(np.diag(R)) * rng.normal(size=2)
        kf, _ = kalman.update(kalman.predict(kf, F, Q), z, H, R)
        anchor = F @ anchor
        particle.predict(cloud, 4.0, 1.0, key(seed, 0, k), TABLE)
        particle.weigh(cloud, weights, z - anchor[:2], np.array([R[0, 0], 0.0, R[1, 1]]), 0.0, 0.0, relative)
        weights *= relative
        effective = particle.normalise(weights)
        particle.moments(cloud, weights, mean, cov)
        errors.append([kf.mean - truth, anchor + mean - truth])
        if effective < 0.5 * particles:
            particle.resample(cloud, weights, key(seed, 1, k), scratch)
            particle.regularise(cloud, mean, cov, 0.25, key(seed, 2, k), TABLE, scratch)
            anchor = anchor + mean
    return np.array(errors)


def test_on_a_linear_model_the_particle_filter_is_the_kalman_filter():
    """100 runs, 1,000 particles: RMSE of the position within 3 %; the bound is the specification's."""
    rng = np.random.default_rng(6)
    errors = np.array([run_both(rng, 1000) for _ in range(100)])
    rmse = np.sqrt((errors[..., :2] ** 2).sum(-1).mean((0, 1)))
    assert rmse[1] / rmse[0] < 1.03


def test_weigh_is_the_mixture_of_two_gaussians():
    rng, n = np.random.default_rng(7), 500
    cloud, weights = rng.normal(size=(4, n)).astype(np.float32), rng.random(n).astype(np.float32)
    particle.normalise(weights)
    relative = np.empty(n, np.float32)
    z, R = np.array([1.0, -2.0]), np.array([[2.0, 0.4], [0.4, 1.0]])
    nu = z - (cloud[:2] + 0.5 * cloud[2:]).T
    g = 0.9 * np.exp(log_density(nu, R)) + 0.1 * np.exp(log_density(nu, particle.BROAD * R))
    found, total = particle.weigh(cloud, weights, z, np.array([2.0, 0.4, 1.0]), 0.5, 0.1, relative)
    assert found == pytest.approx(math.log(np.sum(weights * g)), abs=1e-5)
    assert np.allclose(relative / relative.sum(), g / g.sum(), rtol=1e-4)
    assert total == pytest.approx(np.sum(weights * relative), rel=1e-5)


@pytest.mark.parametrize("outliers", [0.0, 0.05])
def test_a_measurement_far_out_does_not_underflow(outliers):
    n = 100
    cloud, weights = np.zeros((4, n), np.float32), np.full(n, 1 / n, np.float32)
    cloud[0] = np.linspace(-1, 1, n)
    relative = np.empty(n, np.float32)
    found, total = particle.weigh(
        cloud, weights, np.array([1e4, 0.0]), np.array([1.0, 0.0, 1.0]), 0.0, outliers, relative
    )
    assert math.isfinite(found)
    assert total > 0
    assert np.all(np.isfinite(relative))


def test_systematic_resampling_copies_in_proportion():
    n = 1000
    rng = np.random.default_rng(8)
    weights = rng.random(n).astype(np.float32) ** 4
    particle.normalise(weights)
    expected = n * weights.astype(float)
    cloud = np.tile(np.arange(n, dtype=np.float32), (4, 1))
    particle.resample(cloud, weights, key(1, 2, 3), np.empty((4, n), np.float32))
    copies = np.bincount(cloud[0].astype(int), minlength=n)
    assert np.all(np.abs(copies - expected) <= 1.001)
    assert np.all(weights == np.float32(1 / n))


def test_regularising_keeps_mean_and_covariance():
    n = 100_000
    cloud, scratch = np.empty((4, n), np.float32), np.empty((4, n), np.float32)
    L = np.linalg.cholesky(random_gaussian(np.random.default_rng(9)).cov)
    particle.draw(cloud, L, key(1, 1, 1), TABLE)
    weights, mean, cov = np.full(n, 1 / n, np.float32), np.empty(4), np.empty((4, 4))
    particle.moments(cloud, weights, mean, cov)
    particle.regularise(cloud, mean, cov, 0.25, key(1, 1, 2), TABLE, scratch)
    after, cov2 = np.empty(4), np.empty((4, 4))
    particle.moments(cloud, weights, after, cov2)
    assert np.all(np.abs(after) < 0.01 * np.sqrt(np.diag(cov)))
    assert np.allclose(cov2, cov, rtol=0, atol=0.02 * np.sqrt(np.outer(np.diag(cov), np.diag(cov))))
