"""Motion models over one step of time: x' = f(x) + w, w ~ N(0, Q).

The state is ordered by derivative: positions, then velocities, then what is the model's own (accelerations,
or the rate of turn). In the plane that is (east, north, v_east, v_north, ...), in space (east, north, up,
v_east, v_north, v_up, ...). A model's `axes` say which: as many numbers as axes, each the factor of
the process noise in its axis.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
[2] Singer, Estimating optimal tracking filter performance for manned maneuvering targets, IEEE T-AES
    6(4), 1970.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from radar_console.estimation.gaussian import Array, apply

PLANE = (1.0, 1.0)
SPACE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A motion model over one step; its leading axes broadcast with those of the states.

    Attributes
    ----------
    f : (..., n) to (..., n)
    jacobian : of f, (..., n) to (..., n, n)
    Q : (..., n, n)
    linear : f(x) is a matrix times x
    """

    f: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    Q: Array
    linear: bool = False


def linear(F: Array, Q: Array) -> Motion:
    """The model x' = F x + w; `F`, `Q` (..., n, n)."""
    return Motion(lambda x: apply(F, x), lambda x: F, Q, linear=True)


def constant_velocity(
    T: ArrayLike, q: ArrayLike, axes: Sequence[float] = PLANE, *, piecewise: bool = False
) -> tuple[Array, Array]:
    """F and Q of nearly constant velocity.

    Parameters
    ----------
    T : (...)    step, s
    q : (...)    spectral density of the white acceleration, m²/s³; if `piecewise`, variance, m²/s⁴, of an
                 acceleration that is constant over the step and independent from step to step

    Returns
    -------
    F, Q : (..., 2 d, 2 d) with d the number of axes

    Source: [1], (6.2.2-4) and (6.2.2-12); piecewise (6.3.2-4).
    """
    return _kinematic(T, q, axes, 2, piecewise)


def constant_acceleration(
    T: ArrayLike, q: ArrayLike, axes: Sequence[float] = PLANE, *, piecewise: bool = False
) -> tuple[Array, Array]:
    """F and Q of nearly constant acceleration; the state ends in the accelerations.

    Parameters
    ----------
    T : (...)    step, s
    q : (...)    spectral density of the white jerk, m²/s⁵; if `piecewise`, variance, m²/s⁴, of the
                 acceleration's increment in a step

    Returns
    -------
    F, Q : (..., 3 d, 3 d) with d the number of axes

    Source: [1], (6.2.3-3) and (6.2.3-5); piecewise (6.3.3-3).
    """
    return _kinematic(T, q, axes, 3, piecewise)


def singer(
    T: ArrayLike, time_constant: ArrayLike, sd: ArrayLike, axes: Sequence[float] = PLANE
) -> tuple[Array, Array]:
    """F and Q of Singer's model: acceleration is an exponentially correlated process.

    Exact for any ratio of the step to the time constant: to constant acceleration as it goes to 0, to
    constant velocity as it grows.

    Parameters
    ----------
    T : (...)                step, s
    time_constant : (...)    of the acceleration, s
    sd : (...)               its rms value, m/s²

    Returns
    -------
    F, Q : (..., 3 d, 3 d) with d the number of axes; the state ends in the accelerations

    Source: [2]; [1], (8.2.3-2) and (8.2.3-4).
    """
    T, tau, sd = np.broadcast_arrays(*(np.asarray(a, float) for a in (T, time_constant, sd)))
    z = T / tau
    F = np.zeros((*T.shape, 3, 3))
    F[..., 0, 0] = F[..., 1, 1] = 1.0
    F[..., 0, 1] = T
    F[..., 0, 2] = T**2 * _exponential_sum(z, _SINGER_F)
    F[..., 1, 2] = T * _exponential_sum(z, _SINGER_GAIN)
    F[..., 2, 2] = np.exp(-z)
    Q = np.zeros_like(F)
    for (i, j), terms in _SINGER_Q.items():
        Q[..., i, j] = Q[..., j, i] = sd**2 / tau * T ** (5 - i - j) * _exponential_sum(z, terms)
    return _side_by_side(F, np.ones(len(axes))), _side_by_side(Q, axes)


def coordinated_turn(T: ArrayLike, q: ArrayLike, q_turn: ArrayLike, axes: Sequence[float] = PLANE) -> Motion:
    """A level turn at a nearly constant rate, which is the last of the state: rad/s, positive to the right.

    Height, in space, is of nearly constant velocity.

    Parameters
    ----------
    T : (...)         step, s
    q : (...)         spectral density of the white acceleration, m²/s³
    q_turn : (...)    spectral density of the rate's white derivative, rad²/s³

    Source: [1], (11.7.1-4) and its Jacobian (11.7.2-4), in axes where azimuth is clockwise from north.
    """
    T, q, q_turn = np.broadcast_arrays(*(np.asarray(a, float) for a in (T, q, q_turn)))
    d = len(axes)
    Q = np.zeros((*T.shape, 2 * d + 1, 2 * d + 1))
    Q[..., :-1, :-1] = constant_velocity(T, q, axes)[1]
    Q[..., -1, -1] = q_turn * T

    def f(x: Array) -> Array:
        theta = x[..., -1] * T
        e, n = x[..., d], x[..., d + 1]
        along, aside, cos, sin = T * _sinc(theta), T * _cosc(theta), np.cos(theta), np.sin(theta)
        moved = np.empty((*theta.shape, 2 * d + 1))
        moved[:] = x
        moved[..., 0] += along * e + aside * n
        moved[..., 1] += along * n - aside * e
        moved[..., 2:d] += T[..., None] * x[..., d + 2 : 2 * d]
        moved[..., d] = cos * e + sin * n
        moved[..., d + 1] = cos * n - sin * e
        return moved

    def jacobian(x: Array) -> Array:
        theta = x[..., -1] * T
        e, n = x[..., d], x[..., d + 1]
        along, aside, cos, sin = T * _sinc(theta), T * _cosc(theta), np.cos(theta), np.sin(theta)
        d_along, d_aside = T**2 * _d_sinc(theta), T**2 * _d_cosc(theta)
        F = np.zeros((*theta.shape, 2 * d + 1, 2 * d + 1))
        F[..., range(2 * d + 1), range(2 * d + 1)] = 1.0
        F[..., range(2, d), range(d + 2, 2 * d)] = T[..., None]
        F[..., 0, d] = F[..., 1, d + 1] = along
        F[..., 0, d + 1], F[..., 1, d] = aside, -aside
        F[..., d, d] = F[..., d + 1, d + 1] = cos
        F[..., d, d + 1], F[..., d + 1, d] = sin, -sin
        F[..., 0, -1] = d_along * e + d_aside * n
        F[..., 1, -1] = d_along * n - d_aside * e
        F[..., d, -1] = T * (cos * n - sin * e)
        F[..., d + 1, -1] = -T * (cos * e + sin * n)
        return F

    return Motion(f, jacobian, Q)


def embed(motion: Motion, places: Sequence[int], prior: ArrayLike) -> Motion:
    """The model in a larger state, so that models of several sizes can be the modes of one IMM.

    What the model does not have (a rate of turn in straight flight) is drawn anew at each step from what
    it is before anything is known: N(0, prior).

    Parameters
    ----------
    places : (n,)    where the model's state is in the larger one
    prior : (N,)     variances of the larger state; those at `places` are not used
    """
    inner, prior = np.asarray(places), np.asarray(prior, float)
    size = prior.size
    rows = inner[:, None]
    Q = np.zeros((*motion.Q.shape[:-2], size, size))
    Q[..., range(size), range(size)] = prior
    Q[..., rows, inner] = motion.Q

    def f(x: Array) -> Array:
        own = motion.f(x[..., inner])
        moved = np.zeros((*own.shape[:-1], size))
        moved[..., inner] = own
        return moved

    def jacobian(x: Array) -> Array:
        own = motion.jacobian(x[..., inner])
        F = np.zeros((*own.shape[:-2], size, size))
        F[..., rows, inner] = own
        return F

    return Motion(f, jacobian, Q, motion.linear)


def _kinematic(
    T: ArrayLike, q: ArrayLike, axes: Sequence[float], order: int, piecewise: bool
) -> tuple[Array, Array]:
    T, q = np.broadcast_arrays(np.asarray(T, float)[..., None, None], np.asarray(q, float)[..., None, None])
    i = np.arange(order)
    power = i - i[:, None]
    F = np.where(power >= 0, T ** np.maximum(power, 0), 0.0) / [
        [math.factorial(max(p, 0)) for p in row] for row in power
    ]
    highest = 2 * order - 1 if not piecewise else 4
    Q = q * _unit_noise(order, piecewise) * T ** (highest - i - i[:, None])
    return _side_by_side(F, np.ones(len(axes))), _side_by_side(Q, axes)


@lru_cache
def _unit_noise(order: int, piecewise: bool) -> Array:
    """Q of one axis for T = 1 and q = 1."""
    # Imported here: it takes half a second, and the console starts without it.
    from filterpy.common import Q_continuous_white_noise, Q_discrete_white_noise

    return np.asarray(Q_discrete_white_noise(order) if piecewise else Q_continuous_white_noise(order))


def _side_by_side(block: Array, axes: ArrayLike) -> Array:
    """One axis' matrix (..., k, k), for all of them with factors `axes` (d,): (..., k d, k d)."""
    factors = np.diag(np.asarray(axes, float))
    size = block.shape[-1] * factors.shape[0]
    every = block[..., :, None, :, None] * factors[:, None, :]
    return every.reshape(*block.shape[:-2], size, size)


# Singer's entries are sums a e^(-2z) + b e^(-z) + c z e^(-z) + p(z), over z^m, with z = T / time constant and
# p a polynomial that takes away all powers below m. Each is (m, a, b, c, coefficients of p). [1], (8.2.3-4)
_Terms = tuple[int, float, float, float, tuple[float, ...]]
_SINGER_F: _Terms = (2, 0.0, 1.0, 0.0, (-1.0, 1.0))
_SINGER_GAIN: _Terms = (1, 0.0, -1.0, 0.0, (1.0,))
_SINGER_Q: dict[tuple[int, int], _Terms] = {
    (0, 0): (5, -1.0, 0.0, -4.0, (1.0, 2.0, -2.0, 2.0 / 3.0)),
    (0, 1): (4, 1.0, -2.0, 2.0, (1.0, -2.0, 1.0)),
    (0, 2): (3, -1.0, 0.0, -2.0, (1.0,)),
    (1, 1): (3, -1.0, 4.0, 0.0, (-3.0, 2.0)),
    (1, 2): (2, 1.0, -2.0, 0.0, (1.0,)),
    (2, 2): (1, -1.0, 0.0, 0.0, (1.0,)),
}


def _exponential_sum(z: Array, terms: _Terms) -> Array:
    """The sum in closed form; below z = 1, where its terms cancel, by its power series."""
    m, a, b, c, polynomial = terms
    # 2^k / k! at k = 30 is 4e-24.
    series = [(-1.0) ** k * (a * 2.0**k + b - c * k) / math.factorial(k) for k in range(m, 30)]
    small = np.polynomial.polynomial.polyval(np.minimum(z, 1.0), series)
    w = np.maximum(z, 1.0)
    exact = a * np.exp(-2 * w) + (b + c * w) * np.exp(-w) + np.polynomial.polynomial.polyval(w, polynomial)
    return np.where(z < 1.0, small, exact / w**m)


def _sinc(theta: Array) -> Array:
    """sin θ / θ."""
    result: Array = np.sinc(theta / math.pi)
    return result


def _cosc(theta: Array) -> Array:
    """(1 − cos θ) / θ, without cancellation."""
    return 0.5 * theta * _sinc(0.5 * theta) ** 2


def _d_sinc(theta: Array) -> Array:
    """The derivative of sin θ / θ; below 0.1 by its series, whose next term is 2e-16."""
    t = np.minimum(np.abs(theta), 0.1)
    t2 = t * t
    small = -t / 3 * (1 - t2 / 10 * (1 - t2 / 28 * (1 - t2 / 54)))
    large = np.where(np.abs(theta) < 0.1, 1.0, theta)
    return np.where(np.abs(theta) < 0.1, np.sign(theta) * small, (np.cos(large) - _sinc(large)) / large)


def _d_cosc(theta: Array) -> Array:
    """The derivative of (1 − cos θ) / θ."""
    result: Array = _sinc(theta) - 0.5 * _sinc(0.5 * theta) ** 2
    return result
