"""The motion of one Gaussian mode, predicted in place; modes of different models share one layout.

A mode's state is (e, n, v_e, v_n), then (a_e, a_n) where some model of the track has an
acceleration, then ω where some model turns. What a mode's own model lacks is zero, without
covariance. ω is anticlockwise seen from above: v̇_e = -ω v_n, v̇_n = ω v_e.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
[2] Arasaratnam, Haykin, Cubature Kalman filters, IEEE T-AC 54(6), 2009.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.records import CA, CT, EXTENDED, IMM, PARTICLE, SINGER

_ALMOST_STRAIGHT = 1e-3  # rad: below, series that are exact to 1e-13
_STEADY = 1e-4  # T/τ: below, series that are exact to 1e-13
_SLOW_DECAY = 0.1  # T/τ: below, the closed forms of Singer's noise lose digits
_MOST = 1e14, 1e10, 1e6, 1e2  # m², m²/s², m²/s⁴, rad²/s²: variances that say no more than "anywhere"


def state_size(models: Sequence[int]) -> int:
    """Length of the state that the motion models `models` (CV, CA, ...) share: 4 to 7."""
    accelerates = any(model in (CA, SINGER) for model in models)
    return 4 + (2 if accelerates else 0) + (1 if CT in models else 0)


def count(kind: int, models: Sequence[int]) -> int:
    """How many Gaussian modes a filter (KALMAN, ...) keeps for a track; a particle filter has none."""
    if kind == PARTICLE:
        return 0
    return len(models) if kind == IMM else 1


@njit(cache=True, nogil=True, error_model="numpy")
def has(model: int, i: int, n: int) -> bool:
    """Whether the model uses component `i` of a state of length `n`."""
    if i < 4:
        return True
    if i == n - 1 and n % 2 == 1:
        return model == CT
    return model in (CA, SINGER)


@njit(cache=True, nogil=True, error_model="numpy")
def prior_variance(i: int, n: int, par: Any) -> float:
    """Of component `i` ≥ 4 of a state of length `n`, in a target that has just begun its manoeuvre."""
    sd: float = par.turn_rate if i == n - 1 and n % 2 == 1 else par.manoeuvre
    return sd * sd


@njit(cache=True, nogil=True, error_model="numpy")
def predict(model: int, x: Array, P: Array, T: float, par: Any) -> None:
    """Propagate x (n,) and P (n, n) over `T` > 0 s by the motion `model` with its process noise."""
    if model == CT:
        if par.filter == EXTENDED:
            _turn(x, P, T)
        else:
            _turn_unscented(x, P, T)
        _turn_noise(x, P, T, par)
    elif model in (CA, SINGER):
        _accelerate(x, P, T, math.inf if model == CA else par.manoeuvre_time)
        _acceleration_noise(P, T, model, par.manoeuvre, par.manoeuvre_time)
    else:
        _straight(x, P, T)
        _white_acceleration(P, T, par.q)
    _bound(P)


@njit(cache=True, nogil=True, error_model="numpy")
def _straight(x: Array, P: Array, T: float) -> None:
    """Constant velocity [1, (6.2.2-4)]."""
    x[0] += T * x[2]
    x[1] += T * x[3]
    n = x.size
    for i in range(n):  # F P
        P[0, i] += T * P[2, i]
        P[1, i] += T * P[3, i]
    for i in range(n):  # (F P) Fᵀ
        P[i, 0] += T * P[i, 2]
        P[i, 1] += T * P[i, 3]


@njit(cache=True, nogil=True, error_model="numpy")
def _white_acceleration(P: Array, T: float, q: float) -> None:
    """Noise of nearly constant velocity [1, (6.2.2-12)]; `q` m²/s³."""
    for p in range(2):
        v = p + 2
        P[p, p] += q * T * T * T / 3.0
        P[p, v] += q * T * T / 2.0
        P[v, p] += q * T * T / 2.0
        P[v, v] += q * T


@njit(cache=True, nogil=True, error_model="numpy")
def _accelerate(x: Array, P: Array, T: float, tau: float) -> None:
    """Acceleration that decays with the time constant `tau`, [1, (8.2.2-6)]; constant if infinite."""
    y = T / tau
    rho = math.exp(-y)
    chord = -math.expm1(-y) / y if y > _STEADY else 1.0 - y / 2.0 + y * y / 6.0
    to_v = T * chord
    to_p = T * T * ((1.0 - chord) / y if y > _STEADY else 0.5 - y / 6.0 + y * y / 24.0)
    for p in range(2):
        v, a = p + 2, p + 4
        x[p] += T * x[v] + to_p * x[a]
        x[v] += to_v * x[a]
        x[a] *= rho
        for i in range(x.size):
            P[p, i] += T * P[v, i] + to_p * P[a, i]
            P[v, i] += to_v * P[a, i]
            P[a, i] *= rho
    for p in range(2):
        v, a = p + 2, p + 4
        for i in range(x.size):
            P[i, p] += T * P[i, v] + to_p * P[i, a]
            P[i, v] += to_v * P[i, a]
            P[i, a] *= rho


@njit(cache=True, nogil=True, error_model="numpy")
def _acceleration_noise(P: Array, T: float, model: int, sd: float, tau: float) -> None:
    """Noise of Singer's model [1, (8.2.2-8)], or of the constant acceleration with the same jerk.

    Both are driven by white jerk of spectral density 2 sd²/τ; in Singer's it makes an acceleration
    of standard deviation `sd`.
    """
    w = 2.0 * sd * sd / tau
    y = T / tau if model == SINGER else 0.0
    if y < _SLOW_DECAY:  # w ∫ h hᵀ, where h is the response to a jerk, to the fourth power of y
        T2 = T * T
        pp = w * T2 * T2 * T * (1 / 20 - y / 36 + 5 * y**2 / 504 - y**3 / 360 + 17 * y**4 / 25920)
        pv = w * T2 * T2 * (1 / 8 - y / 12 + 5 * y**2 / 144 - y**3 / 90 + 17 * y**4 / 5760)
        pa = w * T2 * T * (1 / 6 - y / 6 + 11 * y**2 / 120 - 13 * y**3 / 360 + 19 * y**4 / 1680)
        vv = w * T2 * T * (1 / 3 - y / 4 + 7 * y**2 / 60 - y**3 / 24 + 31 * y**4 / 2520)
        va = w * T2 * (1 / 2 - y / 2 + 7 * y**2 / 24 - y**3 / 8 + 31 * y**4 / 720)
        aa = w * T * (1 - y + 2 * y**2 / 3 - y**3 / 3 + 2 * y**4 / 15)
    else:
        s, e = sd * sd, math.exp(-y)
        pp = s * tau**4 * (1 - e * e + 2 * y + 2 * y**3 / 3 - 2 * y * y - 4 * y * e)
        pv = s * tau**3 * (e * e + 1 - 2 * e + 2 * y * e - 2 * y + y * y)
        pa = s * tau**2 * (1 - e * e - 2 * y * e)
        vv = s * tau**2 * (4 * e - 3 - e * e + 2 * y)
        va = s * tau * (e * e + 1 - 2 * e)
        aa = s * (1 - e * e)
    for p in range(2):
        v, a = p + 2, p + 4
        P[p, p] += pp
        P[v, v] += vv
        P[a, a] += aa
        P[p, v] += pv
        P[v, p] += pv
        P[p, a] += pa
        P[a, p] += pa
        P[v, a] += va
        P[a, v] += va


@njit(cache=True, nogil=True, error_model="numpy")
def _chord(theta: float) -> tuple[float, float]:
    """sin θ / θ and (1 - cos θ) / θ."""
    if abs(theta) < _ALMOST_STRAIGHT:
        return 1.0 - theta * theta / 6.0, theta / 2.0 * (1.0 - theta * theta / 12.0)
    return math.sin(theta) / theta, (1.0 - math.cos(theta)) / theta


@njit(cache=True, nogil=True, error_model="numpy")
def _chord_slopes(theta: float) -> tuple[float, float]:
    """Derivatives of the two by θ."""
    if abs(theta) < _ALMOST_STRAIGHT:
        return -theta / 3.0 * (1.0 - theta * theta / 10.0), 0.5 - theta * theta / 8.0
    s, c = math.sin(theta), math.cos(theta)
    return (theta * c - s) / (theta * theta), (theta * s - 1.0 + c) / (theta * theta)


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(x: Array, P: Array, T: float) -> None:
    """Coordinated turn with unknown rate [1, (11.7.1-4)], P by its Jacobian [1, (11.7.2-3)]."""
    w = x.size - 1
    theta = x[w] * T
    s, c = math.sin(theta), math.cos(theta)
    along, aside = _chord(theta)
    d_along, d_aside = _chord_slopes(theta)
    along, aside, d_along, d_aside = T * along, T * aside, T * T * d_along, T * T * d_aside
    ve, vn = x[2], x[3]
    # The Jacobian's column for ω.
    j0, j1 = d_along * ve - d_aside * vn, d_aside * ve + d_along * vn
    j2, j3 = -T * (s * ve + c * vn), T * (c * ve - s * vn)
    x[0] += along * ve - aside * vn
    x[1] += aside * ve + along * vn
    x[2], x[3] = c * ve - s * vn, s * ve + c * vn
    for i in range(x.size):  # F P
        a, b, d = P[2, i], P[3, i], P[w, i]
        P[0, i] += along * a - aside * b + j0 * d
        P[1, i] += aside * a + along * b + j1 * d
        P[2, i], P[3, i] = c * a - s * b + j2 * d, s * a + c * b + j3 * d
    for i in range(x.size):  # (F P) Fᵀ
        a, b, d = P[i, 2], P[i, 3], P[i, w]
        P[i, 0] += along * a - aside * b + j0 * d
        P[i, 1] += aside * a + along * b + j1 * d
        P[i, 2], P[i, 3] = c * a - s * b + j2 * d, s * a + c * b + j3 * d


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_unscented(x: Array, P: Array, T: float) -> None:
    """The same by sigma points: the mean bends with the spread of ω, and P stays positive semidefinite."""
    own = np.array([0, 1, 2, 3, x.size - 1])  # an acceleration is another model's
    part, cov, points = np.empty(5), np.empty((5, 5)), np.empty((10, 5))
    for i in range(5):
        part[i] = x[own[i]]
        for j in range(5):
            cov[i, j] = P[own[i], own[j]]
    sigma_points(part, cov, points)
    for k in range(10):
        row = points[k]
        theta, ve, vn = row[4] * T, row[2], row[3]
        along, aside = _chord(theta)
        s, c = math.sin(theta), math.cos(theta)
        row[0] += T * (along * ve - aside * vn)
        row[1] += T * (aside * ve + along * vn)
        row[2], row[3] = c * ve - s * vn, s * ve + c * vn
    for i in range(4):
        mean = 0.0
        for k in range(10):
            mean += points[k, i] / 10.0
        x[i] = mean
    for i in range(5):
        for j in range(i + 1):
            total = 0.0
            for k in range(10):
                total += (points[k, i] - x[own[i]]) * (points[k, j] - x[own[j]])
            P[own[i], own[j]] = total / 10.0
            P[own[j], own[i]] = total / 10.0


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_noise(x: Array, P: Array, T: float, par: Any) -> None:
    """White acceleration, and a random walk of ω with spectral density 2 turn_rate²/manoeuvre_time."""
    _white_acceleration(P, T, par.q)
    w = x.size - 1
    P[w, w] += 2.0 * par.turn_rate * par.turn_rate * T / par.manoeuvre_time


@njit(cache=True, nogil=True, error_model="numpy")
def sigma_points(x: Array, P: Array, points: Array) -> None:
    """Fill `points` (2n, n) with x ± √n times the columns of P's root.

    These are the unscented transform's points for κ = 0, whose central one has no weight [2]; a
    singular P is taken as the nearest one that is not. The root is upper triangular: a turn rate, the
    last component, varies in one pair of points only, and the others turn all alike. So a turn's
    moments do not depend on where north is.
    """
    n = x.size
    L = np.zeros((n, n))
    for j in range(n - 1, -1, -1):
        for i in range(j, -1, -1):
            s = P[i, j]
            for k in range(j + 1, n):
                s -= L[i, k] * L[j, k]
            if i < j:
                L[i, j] = s / L[j, j]
            else:
                L[j, j] = math.sqrt(max(s, 1e-12 * P[j, j], 1e-18))
    root = math.sqrt(n)
    for k in range(n):
        for i in range(n):
            points[k, i] = x[i] + root * L[i, k]
            points[n + k, i] = x[i] - root * L[i, k]


@njit(cache=True, nogil=True, error_model="numpy")
def _bound(P: Array) -> None:
    """Scale down what has grown beyond use, rows and columns alike, so that P stays a covariance."""
    n = P.shape[0]
    for i in range(n):
        most = _MOST[0] if i < 2 else _MOST[1] if i < 4 else _MOST[2]
        if i == n - 1 and n % 2 == 1:
            most = _MOST[3]
        if P[i, i] > most:
            scale = math.sqrt(most / P[i, i])
            for j in range(n):
                P[i, j] *= scale
                P[j, i] *= scale


__all__ = ["count", "has", "predict", "prior_variance", "sigma_points", "state_size"]
