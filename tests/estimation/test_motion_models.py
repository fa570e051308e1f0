"""Motion models against filterpy, quadrature, finite differences and their limits."""

import filterpy.common
import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from radar_console.estimation import motion
from radar_console.estimation.motion import PLANE, SPACE

STEPS = np.array([0.1, 1.0, 4.0, 12.0])
# An integral by quadrature, or a sum in another order: relative rounding only.
ROUNDING = 1e-12


@pytest.mark.parametrize("axes", [PLANE, SPACE])
@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("piecewise", [False, True])
def test_kinematic_noise_is_filterpys(axes, order, piecewise):
    make = motion.constant_velocity if order == 2 else motion.constant_acceleration
    oracle = filterpy.common.Q_discrete_white_noise if piecewise else filterpy.common.Q_continuous_white_noise
    F, Q = make(STEPS, 0.7, axes, piecewise=piecewise)
    for k, T in enumerate(STEPS):
        expected = oracle(order, T, 0.7, block_size=len(axes), order_by_dim=False)
        assert np.allclose(Q[k], expected, rtol=ROUNDING, atol=0)
        drift = np.kron(np.eye(order, k=1), np.eye(len(axes)))
        assert np.allclose(F[k], expm(drift * T), rtol=ROUNDING, atol=1e-15)


def test_noise_of_an_axis_is_scaled_by_its_factor():
    Q = motion.constant_velocity(2.0, 5.0, (1.0, 1.0, 0.1))[1]
    level = motion.constant_velocity(2.0, 5.0)[1]
    assert np.allclose(Q[np.ix_([0, 3], [0, 3])], level[np.ix_([0, 2], [0, 2])], rtol=ROUNDING)
    assert np.allclose(Q[np.ix_([2, 5], [2, 5])], 0.1 * level[np.ix_([0, 2], [0, 2])], rtol=ROUNDING)


@pytest.mark.parametrize("ratio", [1e-9, 1e-3, 0.1, 0.99, 1.01, 5.0, 300.0])
def test_singer_is_the_integral_of_its_differential_equation(ratio):
    """On either side of the change from the power series to the closed form, and far from it."""
    T, sd = 4.0, 3.0
    tau = T / ratio
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / tau]])

    def integrand(s):
        column = expm(A * s)[:, 2:]
        return 2 * sd**2 / tau * column @ column.T

    expected, _ = quad_vec(integrand, 0.0, T, epsrel=1e-13, points=[min(T, 20 * tau)])
    F, Q = motion.singer(T, tau, sd, (1.0,))
    assert np.allclose(F, expm(A * T), rtol=1e-11, atol=1e-14)
    assert np.allclose(Q, expected, rtol=1e-9)  # of the quadrature


def test_singer_tends_to_constant_acceleration_and_to_constant_velocity():
    T, q = 4.0, 0.5
    # White jerk of density q = 2 sd² / tau with tau to infinity; white acceleration of density 2 sd² tau
    # with tau to 0. What is left is of the order of the small ratio, 1e-6.
    F, Q = motion.singer(T, 4e6, np.sqrt(0.5 * q * 4e6))
    F_limit, Q_limit = motion.constant_acceleration(T, q)
    assert np.allclose(F, F_limit, rtol=2e-6, atol=1e-9)
    assert np.allclose(Q, Q_limit, rtol=2e-6)
    F, Q = motion.singer(T, 4e-6, np.sqrt(0.5 * q / 4e-6))
    F_limit, Q_limit = motion.constant_velocity(T, q)
    assert np.allclose(F[:4, :4], F_limit, rtol=1e-6)
    assert np.allclose(Q[:4, :4], Q_limit, rtol=4e-6)


@pytest.mark.parametrize("tau", [1e-3, 1.0, 20.0, 1e3, 1e9])
def test_singers_noise_is_never_negative(tau):
    values = np.linalg.eigvalsh(motion.singer(4.0, tau, 10.0, SPACE)[1])
    assert np.all(values >= -1e-14 * values.max())


def turned(rate, axes=PLANE, T=4.0):
    d = len(axes)
    x = np.concatenate([[1e4, -2e4, 5e3][:d], [150.0, 80.0, -4.0][:d], [rate]])
    return motion.coordinated_turn(T, 1.0, 1e-4, axes), x


@pytest.mark.parametrize("axes", [PLANE, SPACE])
@pytest.mark.parametrize("rate", [0.0, 1e-12, 1e-6, 0.0249, 0.0251, -0.1, 1.0])
def test_the_turns_jacobian_is_its_derivative(axes, rate):
    """Around the change from series to closed form too; central differences are good to 1e-6 here."""
    model, x = turned(rate, axes)
    steps = np.append(np.full(x.size - 1, 1.0), 1e-4)
    for column, step in enumerate(steps):
        shift = step * np.eye(x.size)[column]
        expected = (model.f(x + shift) - model.f(x - shift)) / (2 * step)
        assert np.allclose(model.jacobian(x)[:, column], expected, rtol=1e-6, atol=1e-6)


def test_the_turns_jacobian_does_not_step_where_series_and_closed_form_meet():
    """At 0.1 rad; the closed form cancels to some 1e-13 there, and 2e-12 of the angle lies between."""
    below, above = ((1 - 1e-12) * 0.025, (1 + 1e-12) * 0.025)
    for sign in (-1, 1):
        columns = [model.jacobian(x)[:2, -1] for model, x in (turned(sign * rate) for rate in (below, above))]
        assert np.allclose(columns[0], columns[1], rtol=1e-11, atol=0)


def test_a_positive_rate_turns_right_on_a_circle():
    model, x = turned(np.pi / 8)  # a quarter turn in 4 s
    moved = model.f(x)
    assert moved[2:4] == pytest.approx([x[3], -x[2]], abs=1e-9)
    centre = x[:2] + np.array([x[3], -x[2]]) / x[-1]
    assert np.hypot(*(moved[:2] - centre)) == pytest.approx(np.hypot(x[2], x[3]) / x[-1], abs=1e-7)


@pytest.mark.parametrize("axes", [PLANE, SPACE])
def test_a_turn_of_rate_zero_is_straight(axes):
    model, x = turned(0.0, axes)
    F = motion.constant_velocity(4.0, 1.0, axes)[0]
    assert np.array_equal(model.f(x)[:-1], F @ x[:-1])


def test_models_broadcast_over_steps_and_states():
    rng = np.random.default_rng(1)
    x, T = rng.normal(size=(5, 3, 7)), np.array([1.0, 2.0, 4.0])
    model = motion.coordinated_turn(T, 1.0, 1e-4, SPACE)
    assert model.jacobian(x).shape == (5, 3, 7, 7)
    assert model.Q.shape == (3, 7, 7)
    for k in range(3):
        one = motion.coordinated_turn(T[k], 1.0, 1e-4, SPACE)
        for i in range(5):
            assert np.array_equal(model.f(x)[i, k], one.f(x[i, k]))
            assert np.array_equal(model.jacobian(x)[i, k], one.jacobian(x[i, k]))


def test_an_embedded_model_moves_its_own_part_and_draws_the_rest_anew():
    rng = np.random.default_rng(2)
    F, Q = motion.constant_acceleration(2.0, 0.3)
    model = motion.embed(motion.linear(F, Q), [0, 1, 2, 3, 5, 6], [0, 0, 0, 0, 9.0, 0, 0])
    x = rng.normal(size=(4, 7))
    inner = [0, 1, 2, 3, 5, 6]
    assert np.allclose(model.f(x)[:, inner], x[:, inner] @ F.T, rtol=0, atol=1e-14)
    assert np.all(model.f(x)[:, 4] == 0)
    assert np.array_equal(model.Q[np.ix_(inner, inner)], Q)
    assert model.Q[4, 4] == 9.0
    assert np.allclose(model.jacobian(x) @ x[0], model.f(x)[0], rtol=0, atol=1e-13)
    assert model.linear
