"""The filters against filterpy and against each other."""

import math

import filterpy.common
import filterpy.kalman
import numpy as np
import pytest

from radar_console.estimation import kalman, measurement, motion
from radar_console.estimation.gaussian import Gaussian, collapse

H = np.eye(2, 4)


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
        alone = x.copy(), P.copy()
        A = np.zeros(kalman.MIXTURE)
        kalman.add_alternative(x, P, *z, 2.0, 0.3, 1.0, 0.0, 1.0, A)
        kalman.mix_in_place(x, P, A)
        kalman.condition_in_place(*alone, *z, 2.0, 0.3, 1.0)
        for mean, cov in ((x, P), alone):
            assert np.allclose(mean, expected.mean, rtol=0, atol=1e-10)
            assert np.allclose(cov, expected.cov, rtol=0, atol=1e-9)


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
    A = np.zeros(kalman.MIXTURE)
    for j in range(3):
        kalman.add_alternative(x, P, *z[j], *R[j], lag[j], beta[j], A)
    kalman.mix_in_place(x, P, A)
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
