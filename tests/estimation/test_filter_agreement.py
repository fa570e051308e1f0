"""The Gaussian filters and the IMM: against each other, against filterpy, and one at a time."""

import filterpy.kalman
import numpy as np
import pytest
import radar_runs

from radar_console.estimation import extended, imm, kalman, measurement, motion, unscented
from radar_console.estimation.filters import BY_NAME, EXTENDED, KALMAN, UNSCENTED
from radar_console.estimation.gaussian import Gaussian, root

R = np.diag([50.0, 80.0]) ** 2
POSITION = measurement.position(R)
POLAR = measurement.polar([50.0, 0.002])
SWITCHING = radar_runs.SWITCHING


def random_states(rng, count, n):
    """Some 50 km out, with correlated errors of 100 m, 20 m/s and 0.02 rad/s."""
    scale = np.array([100.0, 100.0, 20.0, 20.0, 0.02])[:n]
    A = scale[:, None] * rng.normal(size=(count, n, n))
    mean = scale * rng.normal(size=(count, n)) + np.array([3e4, 4e4, 150.0, -100.0, 0.01])[:n]
    return Gaussian(mean, A @ A.mT + np.diag(scale**2))


def assert_close(found, expected, tolerance=1e-9):
    """In standard deviations of the state: the unit that 1e-9 is meant in."""
    sd = np.sqrt(np.diagonal(expected.cov, axis1=-2, axis2=-1))
    assert np.all(np.abs(found.mean - expected.mean) <= tolerance * sd)
    assert np.all(np.abs(found.cov - expected.cov) <= tolerance * sd[..., :, None] * sd[..., None, :])


def test_on_a_linear_model_all_filters_are_the_kalman_filter():
    rng = np.random.default_rng(1)
    F, Q = motion.constant_velocity(4.0, 1.0)
    model, states = motion.linear(F, Q), dict.fromkeys(BY_NAME, random_states(rng, 10, 4))
    reference = states["kalman"]
    for _ in range(50):
        z = reference.mean[:, :2] + 100 * rng.normal(size=(10, 2))
        reference, log_reference = kalman.update(kalman.predict(reference, F, Q), z, np.eye(2, 4), R)
        for name, filter in BY_NAME.items():
            predicted = filter.predict(states[name], model)
            nu, S = filter.innovation(predicted, z, POSITION)
            states[name], log_likelihood = filter.update(predicted, z, POSITION)
            assert_close(states[name], reference)
            assert np.allclose(states[name].mean, reference.mean, rtol=0, atol=1e-9)
            assert np.allclose(log_likelihood, log_reference, rtol=0, atol=1e-9)
            assert nu.shape == (10, 2)
            assert S.shape == (10, 2, 2)


def test_the_kalman_filter_refuses_what_is_not_linear():
    state = random_states(np.random.default_rng(2), 1, 5)
    with pytest.raises(ValueError, match="linear"):
        KALMAN.predict(state, motion.coordinated_turn(1.0, 1.0, 1e-4))
    with pytest.raises(ValueError, match="linear"):
        KALMAN.update(state, np.zeros(2), POLAR)
    with pytest.raises(ValueError, match="linear"):
        KALMAN.innovation(state, np.zeros(2), POLAR)


def log_normal(nu, S):
    """filterpy's own takes S of m² beside rad² for singular, and leaves the small eigenvalue out."""
    return -0.5 * (nu @ np.linalg.inv(S) @ nu + np.log(np.linalg.det(2 * np.pi * S)))


def filterpy_state(f, state, k):
    f.x, f.P = state.mean[k].copy(), state.cov[k].copy()


def test_the_extended_filter_is_filterpys():
    rng = np.random.default_rng(3)
    model, state = motion.coordinated_turn(4.0, 1.0, 1e-6), random_states(rng, 20, 5)
    predicted = extended.predict(state, model)
    z = POLAR.h(predicted.mean) + rng.normal(size=(20, 2)) * [50.0, 0.002]
    found, log_likelihood = extended.update(predicted, z, POLAR)
    for k in range(20):
        f = filterpy.kalman.ExtendedKalmanFilter(5, 2)
        f.x, f.P, f.R = predicted.mean[k], predicted.cov[k], POLAR.R
        f.update(z[k], POLAR.jacobian, POLAR.h, residual=POLAR.residual)
        assert_close(found[k], Gaussian(f.x, f.P))
        assert log_likelihood[k] == pytest.approx(log_normal(f.y, f.S), abs=1e-9)
        # filterpy's own predict knows linear models only: take the linearised one.
        F = model.jacobian(state.mean[k])
        assert np.allclose(predicted.cov[k], F @ state.cov[k] @ F.T + model.Q, rtol=1e-12)
        assert np.array_equal(predicted.mean[k], model.f(state.mean[k]))


def test_the_unscented_filter_is_filterpys():
    rng = np.random.default_rng(4)
    model, state = motion.coordinated_turn(4.0, 1.0, 1e-6), random_states(rng, 20, 5)
    points = filterpy.kalman.MerweScaledSigmaPoints(5, unscented.ALPHA, unscented.BETA, unscented.KAPPA)
    predicted = unscented.predict(state, model)
    z = POLAR.h(predicted.mean) + rng.normal(size=(20, 2)) * [50.0, 0.002]
    nu, S = unscented.innovation(predicted, z, POLAR)
    found, log_likelihood = unscented.update(predicted, z, POLAR)
    for k in range(20):
        f = filterpy.kalman.UnscentedKalmanFilter(
            5, 2, 4.0, POLAR.h, lambda x, _: model.f(x), points, residual_z=POLAR.residual
        )
        f.Q, f.R = model.Q, POLAR.R
        filterpy_state(f, state, k)
        f.predict()
        assert_close(predicted[k], Gaussian(f.x, f.P))
        f.update(z[k])
        assert_close(found[k], Gaussian(f.x, f.P))
        # In its whole number of standard deviations, as above: ν of 50 m is to 1e-9 m, not 1e-9 of itself.
        assert np.all(np.abs(nu[k] - f.y) <= 1e-9 * np.sqrt(np.diag(f.S)))
        assert np.allclose(S[k], f.S, rtol=1e-9, atol=1e-9)
        assert log_likelihood[k] == pytest.approx(log_normal(f.y, f.S), abs=1e-9)


def test_the_imm_is_filterpys():
    """A quiet and a manoeuvring mode; filterpy documents M as transposed, and computes as we do."""
    rng = np.random.default_rng(5)
    models = [motion.constant_velocity(4.0, q) for q in (0.1, 100.0)]
    states = random_states(rng, 10, 4)
    modes = imm.start(states, np.array([0.7, 0.3]))
    oracles = []
    for k in range(10):
        filters = []
        for F, Q in models:
            f = filterpy.kalman.KalmanFilter(4, 2)
            f.F, f.Q, f.H, f.R = F, Q, np.eye(2, 4), R
            filterpy_state(f, states, k)
            filters.append(f)
        oracles.append(filterpy.kalman.IMMEstimator(filters, [0.7, 0.3], SWITCHING))
    for _ in range(10):
        z = imm.estimate(modes).mean[:, :2] + 150 * rng.normal(size=(10, 2))
        modes = imm.predict(modes, [motion.linear(*model) for model in models], SWITCHING, KALMAN)
        modes, _ = imm.update(modes, z, POSITION, KALMAN)
        found = imm.estimate(modes)
        for k, oracle in enumerate(oracles):
            oracle.predict()
            oracle.update(z[k])
            assert_close(found[k], Gaussian(oracle.x, oracle.P))
            assert np.allclose(modes.probability[k], oracle.mu, rtol=0, atol=1e-9)


def test_an_imm_of_equal_modes_is_the_single_filter():
    rng = np.random.default_rng(6)
    model, state = motion.coordinated_turn(4.0, 1.0, 1e-6), random_states(rng, 3, 5)
    modes = imm.start(state, np.array([0.2, 0.5, 0.3]))
    switching = np.array([[0.8, 0.1, 0.1], [0.2, 0.7, 0.1], [0.0, 0.5, 0.5]])
    for filter in (EXTENDED, UNSCENTED):
        single = filter.predict(state, model)
        z = POLAR.h(single.mean) + np.array([30.0, 0.003])
        predicted = imm.predict(modes, [model] * 3, switching, filter)
        nu, S = imm.innovation(predicted, z, POLAR, filter)
        updated, log_likelihood = imm.update(predicted, z, POLAR, filter)
        expected, log_expected = filter.update(single, z, POLAR)
        assert_close(imm.estimate(updated), expected)
        assert np.allclose(log_likelihood, log_expected, rtol=0, atol=1e-9)
        assert np.allclose(updated.probability, np.array([0.2, 0.5, 0.3]) @ switching, rtol=0, atol=1e-12)
        assert np.allclose(nu, filter.innovation(single, z, POLAR)[0], rtol=0, atol=1e-9)
        assert np.allclose(S, filter.innovation(single, z, POLAR)[1], rtol=1e-9, atol=1e-12)


def test_modes_that_cannot_be_reached_or_are_impossible_stay_finite():
    state = random_states(np.random.default_rng(7), 4, 5)
    modes = imm.start(state, np.array([1.0, 0.0]))
    models = radar_runs.modes_of(2)
    for far in (0.0, 1e5, 1e7):
        z = POLAR.h(state.mean) + np.array([far, 0.5])
        modes = imm.predict(modes, models, np.eye(2))
        modes, log_likelihood = imm.update(modes, z, POLAR)
        found = imm.estimate(modes)
        assert np.all(np.isfinite(found.mean))
        assert np.all(np.isfinite(found.cov))
        assert np.all(np.isfinite(log_likelihood))
        assert np.allclose(modes.probability.sum(-1), 1, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["extended", "unscented"])
def test_a_batch_is_its_members_one_by_one(name):
    """Two leading axes; a stack's products and a single matrix' round differently, hence 1e-11."""
    rng = np.random.default_rng(8)
    filter, model = BY_NAME[name], motion.coordinated_turn(np.array([[1.0], [4.0]]), 1.0, 1e-6)
    every = random_states(rng, 6, 5)
    state = Gaussian(every.mean.reshape(2, 3, 5), every.cov.reshape(2, 3, 5, 5))
    predicted = filter.predict(state, model)
    z = POLAR.h(predicted.mean) + np.array([40.0, -0.002])
    updated, log_likelihood = filter.update(predicted, z, POLAR)
    assert updated.mean.shape == (2, 3, 5)
    for i, T in enumerate((1.0, 4.0)):
        one = motion.coordinated_turn(T, 1.0, 1e-6)
        for k in range(3):
            expected, log_expected = filter.update(filter.predict(state[i, k], one), z[i, k], POLAR)
            assert_close(updated[i, k], expected, 1e-11)
            assert log_likelihood[i, k] == pytest.approx(log_expected, abs=1e-9)


def test_an_imm_of_a_batch_is_its_members_one_by_one():
    rng = np.random.default_rng(9)
    state, models = random_states(rng, 4, 5), radar_runs.modes_of(2)
    z = POLAR.h(state.mean) + rng.normal(size=(4, 2)) * [100.0, 0.003]

    def step(start, z):
        modes = imm.predict(imm.start(start, np.array([0.6, 0.4])), models, SWITCHING)
        return imm.update(modes, z, POLAR)

    modes, log_likelihood = step(state, z)
    for k in range(4):
        one, log_one = step(state[k], z[k])
        assert_close(imm.estimate(modes)[k], imm.estimate(one), 1e-11)
        assert np.allclose(modes.probability[k], one.probability, rtol=0, atol=1e-11)
        assert log_likelihood[k] == pytest.approx(log_one, abs=1e-9)


@pytest.mark.parametrize("name", list(BY_NAME))
@pytest.mark.parametrize(
    "P",
    [
        np.zeros((4, 4)),
        np.full((4, 4), 100.0),
        np.diag([1e20, 1e-20, 1.0, 0.0]),
        np.diag([1e4, 1e4, 1e2, 1e2]) - 1e-9,
        1e16 * (np.ones((4, 4)) + 1e-15 * np.eye(4)),
    ],
    ids=["zero", "rank one", "forty orders", "almost diagonal", "almost rank one"],
)
def test_singular_and_ill_conditioned_covariances_stay_finite_and_positive(name, P):
    filter = BY_NAME[name]
    model = motion.linear(*motion.constant_velocity(4.0, 0.0))
    state = Gaussian(np.array([3e4, 4e4, 100.0, 0.0]), P)
    for _ in range(5):
        state = filter.predict(state, model)
        z = np.array([3e4, 4e4]) + 100.0
        state, log_likelihood = filter.update(state, z, POSITION)
        assert np.all(np.isfinite(state.mean))
        assert np.isfinite(log_likelihood)
        values = np.linalg.eigvalsh(state.cov)
        # Rounding of what the step started from.
        assert values.min() >= -1e-12 * max(values.max(), np.abs(P).max())


def test_the_root_of_a_singular_matrix_is_a_root_of_it():
    A = np.random.default_rng(10).normal(size=(3, 4, 2))
    P = A @ A.mT
    P[1] = np.eye(4)
    L = root(P)
    assert np.allclose(L @ L.mT, P, rtol=0, atol=1e-12)
    # One member alone: the same as in the stack.
    assert np.array_equal(L[1], root(P[1]))
    assert np.array_equal(L[0], root(P[0]))
