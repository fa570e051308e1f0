"""The Rao-Blackwellised particle filter of a target that flies straight, turns or changes its speed.

A particle is a history: which regimes, from when to when, and about which acceleration. Given it the rest is
a Kalman filter of (east, north, v_east, v_north, a), where a is the acceleration of the present manoeuvre:
to the right in a turn, along the course in a change of speed. So a particle need not hit the acceleration, it
need only come near: the measurements then tell, and one particle stands for a whole family [1].

At each scan every particle goes on as it was, and a number of *branches* leave it at an instant within the
scan for another regime; these are spread evenly over the prior. All are weighed by the likelihood of the
measurement before any is dropped, and as many as there are particles stay by the optimal selection of [2]:
heavy ones as they are, light ones by lot, never two copies of one history.

[1] Schön, Gustafsson, Nordlund, Marginalized particle filters for mixed linear/nonlinear state-space
    models, IEEE T-SP 53(7), 2005.
[2] Fearnhead, Clifford, On-line inference for hidden Markov models via particle filters, JRSS B 65(4), 2003.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from radar_console.estimation import draws
from radar_console.estimation.gaussian import Array, Gaussian

STRAIGHT, TURN, SPEED = range(3)
N = 5  # length of the state
_mix = draws.mix
_TO_UNIT = 2.0**-53
_TURN_SQUARED = (2.0 * math.pi) ** 2
_SHIFT = np.uint64(11)
# The plastic number's powers: points k (a, b, c) mod 1 cover the cube evenly. Roberts, 2018.
_A, _B, _C = 0.8191725133961645, 0.6710436067037893, 0.5497004779019703
_SLOWEST = 1.0  # m/s: a target slower than that has no course


@dataclass(frozen=True, slots=True)
class Regimes:
    """What is known of manoeuvres before the flight.

    Attributes
    ----------
    mean, least : s, how long a straight, a turn and a change of speed last; after `least` exponentially
    turns : which part of the manoeuvres turns
    again : probability that a manoeuvre follows a manoeuvre
    turn, speed : m/s², the largest acceleration of a turn (uniform within), the mean one of a change of
        speed (two-sided exponential)
    kernel_turn, kernel_speed : m/s², standard deviation of the family that a new particle stands for
    noise : (straight, turn, speed) m/s², of an acceleration that is constant over a scan
    drift : (turn, speed) m/s² per √s, of the acceleration itself
    kernel_time : s, standard deviation of the instant of change that a new particle stands for
    """

    mean: tuple[float, float, float] = (70.0, 18.0, 18.0)
    least: tuple[float, float, float] = (10.0, 6.0, 6.0)
    turns: float = 0.7
    again: float = 0.2
    turn: float = 32.0
    speed: float = 4.0
    kernel_turn: float = 3.0
    kernel_speed: float = 2.0
    noise: tuple[float, float, float] = (0.03, 0.1, 0.1)
    drift: tuple[float, float] = (0.0, 0.0)
    kernel_time: float = 0.3

    def packed(self) -> Array:
        """In the order in which the kernels want it."""
        return np.array(
            [*self.mean, *self.least, self.turns, self.again, self.turn, self.speed, self.kernel_turn,
             self.kernel_speed, *self.noise, *self.drift, self.kernel_time]
        )  # fmt: skip


REGIMES = Regimes()
"""Chosen on the filter study's kinds of trajectories, with other random numbers than it is scored with."""

_MEAN, _LEAST, _TURNS, _AGAIN, _TURN, _SPEED, _KERNEL_TURN, _KERNEL_SPEED, _NOISE, _DRIFT, _KERNEL_TIME = (
    0, 3, 6, 7, 8, 9, 10, 11, 12, 15, 17,
)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _bend(x: Array, regime: int, T: float, A: Array, B: Array, b: Array, d: Array) -> None:
    """Move `x` (5,) on by `T` s; fill the Jacobian's blocks: p' = p + A v + b a, v' = B v + d a."""
    e, n, a = x[2], x[3], x[4]
    A[0, 0] = A[1, 1] = T
    B[0, 0] = B[1, 1] = 1.0
    A[0, 1] = A[1, 0] = B[0, 1] = B[1, 0] = 0.0
    b[:] = 0.0
    d[:] = 0.0
    if regime == STRAIGHT:
        x[0] += T * e
        x[1] += T * n
        return
    s = max(math.hypot(e, n), _SLOWEST)
    if regime == SPEED:
        u, v = e / s, n / s
        half = 0.5 * T * T
        x[0] += T * e + half * a * u
        x[1] += T * n + half * a * v
        x[2] += T * a * u
        x[3] += T * a * v
        # d(course)/dv = (1 - u uᵀ) / s
        uu, uv, vv = v * v * a / s, -u * v * a / s, u * u * a / s
        A[0, 0] += half * uu
        A[0, 1] += half * uv
        A[1, 0] += half * uv
        A[1, 1] += half * vv
        B[0, 0] += T * uu
        B[0, 1] += T * uv
        B[1, 0] += T * uv
        B[1, 1] += T * vv
        b[0], b[1], d[0], d[1] = half * u, half * v, T * u, T * v
        return
    w = a / s
    theta = w * T
    sin, cos = math.sin(theta), math.cos(theta)
    if abs(theta) > 1e-3:
        along, aside = sin / w, (1.0 - cos) / w
        d_along, d_aside = (T * cos - along) / w, (T * sin - aside) / w
    else:
        along, aside = T * (1.0 - theta * theta / 6.0), 0.5 * T * theta
        d_along, d_aside = -T * T * theta / 3.0, 0.5 * T * T
    # Derivatives by the rate of turn w = a / s, then by a and by the velocity.
    p_e, p_n = d_along * e + d_aside * n, d_along * n - d_aside * e
    v_e, v_n = T * (cos * n - sin * e), -T * (cos * e + sin * n)
    x[0] += along * e + aside * n
    x[1] += along * n - aside * e
    x[2], x[3] = cos * e + sin * n, cos * n - sin * e
    w_e, w_n = -w * e / (s * s), -w * n / (s * s)
    A[0, 0], A[0, 1] = along + p_e * w_e, aside + p_e * w_n
    A[1, 0], A[1, 1] = -aside + p_n * w_e, along + p_n * w_n
    B[0, 0], B[0, 1] = cos + v_e * w_e, sin + v_e * w_n
    B[1, 0], B[1, 1] = -sin + v_n * w_e, cos + v_n * w_n
    b[0], b[1], d[0], d[1] = p_e / s, p_n / s, v_e / s, v_n / s


@njit(cache=True, nogil=True, error_model="numpy")
def _predict(
    x: Array, P: Array, regime: int, T: float, law: Array, A: Array, B: Array, b: Array, d: Array, FP: Array
) -> None:
    """Move the Gaussian `x` (5,), `P` (5, 5) on by `T` s; the rest is scratch."""
    if T <= 0.0:
        return
    _bend(x, regime, T, A, B, b, d)
    for j in range(N):
        FP[0, j] = P[0, j] + A[0, 0] * P[2, j] + A[0, 1] * P[3, j] + b[0] * P[4, j]
        FP[1, j] = P[1, j] + A[1, 0] * P[2, j] + A[1, 1] * P[3, j] + b[1] * P[4, j]
        FP[2, j] = B[0, 0] * P[2, j] + B[0, 1] * P[3, j] + d[0] * P[4, j]
        FP[3, j] = B[1, 0] * P[2, j] + B[1, 1] * P[3, j] + d[1] * P[4, j]
        FP[4, j] = P[4, j]
    for i in range(N):
        P[i, 0] = FP[i, 0] + A[0, 0] * FP[i, 2] + A[0, 1] * FP[i, 3] + b[0] * FP[i, 4]
        P[i, 1] = FP[i, 1] + A[1, 0] * FP[i, 2] + A[1, 1] * FP[i, 3] + b[1] * FP[i, 4]
        P[i, 2] = B[0, 0] * FP[i, 2] + B[0, 1] * FP[i, 3] + d[0] * FP[i, 4]
        P[i, 3] = B[1, 0] * FP[i, 2] + B[1, 1] * FP[i, 3] + d[1] * FP[i, 4]
        P[i, 4] = FP[i, 4]
    q = law[_NOISE + regime] ** 2 * T * T
    for p in range(2):
        P[p, p] += 0.25 * q * T * T
        P[p, p + 2] += 0.5 * q * T
        P[p + 2, p] += 0.5 * q * T
        P[p + 2, p + 2] += q
    if regime != STRAIGHT:
        P[4, 4] += law[_DRIFT + regime - 1] ** 2 * T


@njit(cache=True, nogil=True, error_model="numpy")
def _update(x: Array, P: Array, z: Array, R: Array, HP: Array) -> float:
    """Condition on the position `z` (2,) with covariance `R` (3,) ee, en, nn; the log-likelihood."""
    ee, en, nn = P[0, 0] + R[0], P[0, 1] + R[1], P[1, 1] + R[2]
    det = ee * nn - en * en
    nu_e, nu_n = z[0] - x[0], z[1] - x[1]
    HP[:] = P[:2]
    for i in range(N):
        k_e = (HP[0, i] * nn - HP[1, i] * en) / det
        k_n = (HP[1, i] * ee - HP[0, i] * en) / det
        x[i] += k_e * nu_e + k_n * nu_n
        for j in range(i + 1):
            P[i, j] -= k_e * HP[0, j] + k_n * HP[1, j]
            P[j, i] = P[i, j]
    d2: float = (nn * nu_e * nu_e - 2.0 * en * nu_e * nu_n + ee * nu_n * nu_n) / det
    return -0.5 * (d2 + math.log(_TURN_SQUARED * det))


@njit(cache=True, nogil=True, error_model="numpy")
def _leaving(law: Array, regime: int, age: float, T: float) -> tuple[float, float]:
    """Probability that a regime of this `age` ends within `T` s, and the part of `T` before it can."""
    mean, least = law[_MEAN + regime], law[_LEAST + regime]
    sure = min(max(least - age, 0.0), T)
    return 1.0 - math.exp(-(T - sure) / (mean - least)), sure / T


@njit(cache=True, nogil=True, error_model="numpy")
def _uniform(key: Any) -> float:
    u: float = (_mix(key) >> _SHIFT) * _TO_UNIT
    return u


@njit(cache=True, nogil=True, error_model="numpy")
def _select(weights: Array, count: int, start: float, chosen: Any) -> int:
    """Keep at most `count` of `weights`; fill `chosen`, change the weights of what is kept; how many  [2]."""
    above, below = 0, weights.sum()
    c = below / count
    while True:
        above, below = 0, 0.0
        for w in weights:
            if w >= c:
                above += 1
            else:
                below += w
        if count <= above or below <= 0.0:
            break
        new = below / (count - above)
        if new >= c * (1.0 - 1e-12):
            break
        c = new
    kept, light, sum_ = 0, count - above, start * c
    for i in range(weights.size):
        w = weights[i]
        heavy = w >= c
        if not heavy:
            sum_ += w
            # Rounding must not let one light branch more in: there is room for `count`.
            if sum_ < c or light <= 0:
                continue
            sum_ -= c
            light -= 1
            weights[i] = c
        if kept < count:
            chosen[kept] = i
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def _blur(law: Array, regime: int, x: Array, P: Array) -> None:
    """A manoeuvre that begins or ends a little earlier or later: another velocity after it."""
    s = max(math.hypot(x[2], x[3]), _SLOWEST)
    u, v = x[2] / s, x[3] / s
    if regime == TURN:
        u, v = v, -u
    q = (law[_KERNEL_TIME] * x[4]) ** 2
    P[2, 2] += q * u * u
    P[2, 3] += q * u * v
    P[3, 2] += q * u * v
    P[3, 3] += q * v * v


@njit(cache=True, nogil=True, error_model="numpy")
def _branch(law: Array, regime: int, where: float, a: float, x: Array, P: Array) -> int:
    """Begin another regime: which, by `where` in [0, 1), with an acceleration by `a`; x and P get it."""
    again = law[_AGAIN]
    if regime != STRAIGHT:
        _blur(law, regime, x, P)
    P[4, :] = 0.0
    P[:, 4] = 0.0
    x[4] = 0.0
    if regime != STRAIGHT:
        if where >= again:
            return STRAIGHT
        where /= again
    if where < law[_TURNS]:
        x[4] = law[_TURN] * (2.0 * a - 1.0)
        P[4, 4] = law[_KERNEL_TURN] ** 2
        _blur(law, TURN, x, P)
        return TURN
    far = abs(2.0 * a - 1.0)
    x[4] = math.copysign(-law[_SPEED] * math.log(1.0 - min(far, 0.999)), a - 0.5)
    P[4, 4] = law[_KERNEL_SPEED] ** 2
    _blur(law, SPEED, x, P)
    return SPEED


@njit(cache=True, nogil=True, error_model="numpy")
def _run(
    z: Array, R: Array, T: float, law: Array, x0: Array, P0: Array, count: int, branches: int, seed: int,
    number: int, mean: Array, probability: Array,
) -> None:  # fmt: skip
    """One target; see `estimate`."""
    most = count + branches
    x, P = np.zeros((count, N)), np.zeros((count, N, N))
    y, Q = np.zeros((most, N)), np.zeros((most, N, N))
    regime, age, weight = np.zeros(count, np.int64), np.zeros(count), np.ones(count)
    kind, since, term = np.zeros(most, np.int64), np.zeros(most), np.zeros(most)
    chosen, leave, sure = np.zeros(count, np.int64), np.zeros(count), np.zeros(count)
    A, B, b, d = np.empty((2, 2)), np.empty((2, 2)), np.empty(2), np.empty(2)
    FP, HP, level = np.empty((N, N)), np.empty((2, N)), np.empty(most)
    live = 1
    x[0, :4], P[0, :4, :4] = x0, P0
    age[0] = law[_LEAST]
    for k in range(z.shape[0]):
        key = draws.key(seed, number, k)
        mass = 0.0
        for i in range(live):
            leave[i], sure[i] = _leaving(law, regime[i], age[i], T)
            mass += weight[i] * leave[i]
            y[i], Q[i], kind[i], since[i] = x[i], P[i], regime[i], age[i] + T
            term[i] = weight[i] * (1.0 - leave[i]) if branches > 0 else weight[i]
            _predict(y[i], Q[i], regime[i], T, law, A, B, b, d, FP)
        c = live
        if mass > 0.0 and branches > 0:
            share = mass / branches
            sum_ = share * _uniform(key)
            u_1, u_2, u_3 = _uniform(key + 1), _uniform(key + 2), _uniform(key + 3)
            for i in range(live):
                sum_ += weight[i] * leave[i]
                while sum_ >= share and c < most:
                    sum_ -= share
                    n = c - live
                    at = sure[i] * T + (1.0 - sure[i]) * T * ((u_1 + n * _A) % 1.0)
                    y[c], Q[c], term[c] = x[i], P[i], share
                    _predict(y[c], Q[c], regime[i], at, law, A, B, b, d, FP)
                    kind[c] = _branch(law, regime[i], (u_2 + n * _B) % 1.0, (u_3 + n * _C) % 1.0, y[c], Q[c])
                    since[c] = T - at
                    _predict(y[c], Q[c], kind[c], T - at, law, A, B, b, d, FP)
                    c += 1
        top = -math.inf
        for i in range(c):
            level[i] = _update(y[i], Q[i], z[k], R[k], HP)
            if term[i] > 0.0:
                top = max(top, level[i])
        total = 0.0
        for i in range(c):
            term[i] *= math.exp(max(level[i] - top, -700.0))
            total += term[i]
        for i in range(c):
            w = term[i] / total
            term[i] = w
            probability[k, kind[i]] += w
            for j in range(4):
                mean[k, j] += w * y[i, j]
        if c > count:
            live = _select(term[:c], count, _uniform(key + 4), chosen)
        else:
            live = c
            for i in range(c):
                chosen[i] = i
        for i in range(live):
            j = chosen[i]
            x[i], P[i], regime[i], age[i], weight[i] = y[j], Q[j], kind[j], since[j], term[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _run_all(
    z: Array, R: Array, T: float, law: Array, x0: Array, P0: Array, count: int, branches: int, seed: int,
    numbers: Any, mean: Array, probability: Array,
) -> None:  # fmt: skip
    for run in range(z.shape[0]):
        _run(z[run], R[run], T, law, x0[run], P0[run], count, branches, seed, numbers[run], mean[run],
             probability[run])  # fmt: skip


class Estimates(NamedTuple):
    """What a filter knew after each scan.

    Attributes
    ----------
    mean : (scans, runs, 4) east, north, m, v_east, v_north, m/s
    probability : (scans, runs, 3) of the regimes STRAIGHT, TURN and SPEED
    """

    mean: Array
    probability: Array


def estimate(
    z: Array,
    R: Array,
    T: float,
    start: Gaussian,
    seed: int,
    numbers: Sequence[int] | None = None,
    regimes: Regimes = REGIMES,
    particles: int = 500,
    branches: int = 250,
) -> Estimates:
    """Filter the measurements of many runs, each of one target.

    Parameters
    ----------
    z : (scans, runs, 2)    measured positions, m, every `T` s
    R : (..., 2, 2)         their covariances, m²; broadcast to the scans and runs
    start : (runs, 4)       one scan before the first
    seed, numbers : of the random draws; (runs,) numbers of the runs, so that a run alone is as in a stack
    particles : that stay after each scan
    branches : that leave them in each scan; 0 is the Kalman filter of a straight flight
    """
    scans, runs, _ = z.shape
    every = np.broadcast_to(R, (scans, runs, 2, 2))
    R3 = np.stack([every[..., 0, 0], every[..., 0, 1], every[..., 1, 1]], axis=-1)
    mean, probability = np.zeros((runs, scans, 4)), np.zeros((runs, scans, 3))
    cov = np.ascontiguousarray(np.broadcast_to(start.cov, (runs, 4, 4)), float)
    _run_all(
        _by_run(z), _by_run(R3), T, regimes.packed(), np.ascontiguousarray(start.mean, float), cov,
        particles, branches, seed, np.asarray(range(runs) if numbers is None else numbers, np.int64),
        mean, probability,
    )  # fmt: skip
    return Estimates(_by_run(mean), _by_run(probability))


def _by_run(values: Array) -> Array:
    return np.ascontiguousarray(np.moveaxis(values, 0, 1), float)
