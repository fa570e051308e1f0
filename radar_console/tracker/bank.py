"""Confirmed tracks as Gaussian modes: KF, EKF and UKF have one, the IMM has one for each motion model.

Modes switch with the rates `leave` [1, §11.6.6]. A mode that lacks a component, acceleration or turn
rate, brings the prior of a beginning manoeuvre when it is mixed into one that has it; see
docs/decisions/0040. Plots come as alternatives with probabilities β_j: each mode is conditioned on
each, with the noise it claims and as an outlier, and matched to the mixture's moments [2, §3.4].

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
[2] Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation import particle
from radar_console.estimation.gaussian import Array
from radar_console.estimation.particle import Singles
from radar_console.tracker import innovation, modes
from radar_console.tracker.records import CV, Belief

_predict, _has, _prior_variance = modes.predict, modes.has, modes.prior_variance
_measure, _invert, _log_density = innovation.measure, innovation.invert, innovation.log_density
_BROAD = particle.BROAD

_MOST_SWITCHING = 0.5  # mean number of switches in one step of the prediction
_MOST_STEPS = 1000
_LEAST_MODE = 1e-9
_LEAST_GROWTH = 1e-3  # of the growth by q
_LEAST_SHARE = 0.25  # of a mode in the forecast's covariance


@njit(cache=True, nogil=True, error_model="numpy")
def start(track: Any, sensor_e: float, sensor_n: float, par: Any, belief: Belief) -> None:
    """Every mode begins as the track's Gaussian, with the probability that its model has in the long run."""
    x, P, mu = belief.x[track.slot], belief.P[track.slot], belief.mu[track.slot]
    r, n = x.shape
    total = 0.0
    for k in range(r):
        mu[k] = 1.0 / par.leave[k] if par.leave[k] > 0.0 else 1.0
        total += mu[k]
        x[k] = 0.0
        P[k] = 0.0
        for i in range(4):
            x[k, i] = track.x[i]
            for j in range(4):
                P[k, i, j] = track.P[i, j]
        for i in range(4, n):
            if _has(par.model[k], i, n):
                P[k, i, i] = _prior_variance(i, n, par)
    for k in range(r):
        mu[k] /= total
    _forecast(track, x, P, mu, par)


@njit(cache=True, nogil=True, error_model="numpy")
def advance(track: Any, t: float, par: Any, belief: Belief) -> None:
    """Predict the modes and the moments to the time `t`; nothing happens if that is not later."""
    T = t - track.t
    if not T > 0.0:
        return
    x, P, mu = belief.x[track.slot], belief.P[track.slot], belief.mu[track.slot]
    _predict_modes(x, P, mu, T, par)
    _moments(x, P, mu, track.x, track.P)
    track.t = t


@njit(cache=True, nogil=True, error_model="numpy")
def log_likelihood(track: Any, plot: Any, par: Any, belief: Belief, relative: Singles) -> tuple[float, float]:
    """Log of the predictive density of a plot at its own time, m⁻², and 1; `relative` is left alone.

    The density is (1 - ε) N(ν; 0, S) + ε N(ν; 0, S + 63 R), mixed over the modes: an outlier errs eight
    times as much as it claims. With Doppler it is per m/s, too; see `innovation.measure`.
    """
    x, P, mu = belief.x[track.slot], belief.P[track.slot], belief.mu[track.slot]
    r, n = x.shape
    nu, u = np.empty(3), np.empty(3)
    Y, R, W, C = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((n, 3))
    lag, result = plot.t - track.t, -math.inf
    for k in range(r):
        m, factor = _measure(x[k], P[k], plot, lag, par, nu, Y, R, C)
        factor += _log(mu[k])
        log_det = _invert(Y, R, 1.0, m, W)
        narrow = _log(1.0 - par.outliers) + _log_density(nu, W, log_det, m, u)
        result = _log_sum(result, factor + narrow)
        if par.outliers > 0.0:
            log_det = _invert(Y, R, _BROAD, m, W)
            broad = _log(par.outliers) + _log_density(nu, W, log_det, m, u)
            result = _log_sum(result, factor + broad)
    return result, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def update(
    track: Any,
    miss: float,
    beta: Array,
    total: Array,
    relative: Singles,
    chosen: Any,
    pool: Any,
    par: Any,
    belief: Belief,
) -> None:
    """Condition every mode on the plots, set the modes' probabilities, the moments and the forecast.

    Parameters
    ----------
    miss : β_0
    beta : (plots,) β_j
    chosen : (plots,) rows of the plots in `pool`
    total, relative : of no use here
    """
    x, P, mu = belief.x[track.slot], belief.P[track.slot], belief.mu[track.slot]
    r, n = x.shape
    plots = beta.size
    Y, R, nu, size = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty((r, plots), np.int64)
    C, W, u = np.empty((r, plots, n, 3)), np.empty((r, plots, 2, 3, 3)), np.empty((r, plots, 2, 3))
    log_w = np.empty((r, plots, 2))
    for j in range(plots):
        plot, log_g = pool[chosen[j]], -math.inf
        for k in range(r):
            m, factor = _measure(x[k], P[k], plot, plot.t - track.t, par, nu, Y, R, C[k, j])
            size[k, j] = m
            for s in range(2):
                part, scale = (par.outliers, _BROAD) if s else (1.0 - par.outliers, 1.0)
                if part > 0.0:
                    log_det = _invert(Y, R, scale, m, W[k, j, s])
                    density = factor + _log_density(nu, W[k, j, s], log_det, m, u[k, j, s])
                    log_w[k, j, s] = _log(part) + density
                else:
                    log_w[k, j, s] = -math.inf
                log_g = _log_sum(log_g, _log(mu[k]) + log_w[k, j, s])
        for k in range(r):
            for s in range(2):
                log_w[k, j, s] += _log(beta[j]) - log_g if math.isfinite(log_g) else -math.inf
    sum_mu = 0.0
    for k in range(r):
        mu[k] *= _condition(x[k], P[k], _log(miss), log_w[k], size[k], C[k], W[k], u[k])
        sum_mu += mu[k]
    if sum_mu > 0.0:
        for k in range(r):
            mu[k] = max(mu[k] / sum_mu, _LEAST_MODE)
    else:
        mu[:] = 1.0 / r
    _moments(x, P, mu, track.x, track.P)
    _forecast(track, x, P, mu, par)


@njit(cache=True, nogil=True, error_model="numpy")
def _condition(
    x: Array, P: Array, log_miss: float, log_w: Array, size: Any, C: Array, W: Array, u: Array
) -> float:
    """Match one mode to its mixture over the alternatives; the sum of their weights.

    An alternative of weight w, with W = S⁻¹ and u = W ν, has the mean x + C u and the covariance
    P - C W Cᵀ [2, (3.4.2-7) to (3.4.2-10)]; so the matched covariance is
    P - Σ C (Σ w (W - u uᵀ)) Cᵀ - d dᵀ, with the mean's shift d = Σ w C u.

    Parameters
    ----------
    x, P : (n,), (n, n) of the mode, predicted; changed in place
    log_w : (plots, 2) of the weights of the plots as claimed, and as outliers
    size : (plots,) length of the measurement, 2 or 3
    C, W, u : (plots, n, 3), (plots, 2, 3, 3), (plots, 2, 3); see `innovation`
    """
    n, plots = x.size, log_w.shape[0]
    log_most = log_miss
    for j in range(plots):
        log_most = max(log_most, log_w[j, 0], log_w[j, 1])
    if not math.isfinite(log_most):
        return 0.0
    total = math.exp(log_miss - log_most)
    for j in range(plots):
        for s in range(2):
            log_w[j, s] = math.exp(log_w[j, s] - log_most)
            total += log_w[j, s]
    d, v, M = np.zeros(n), np.empty(3), np.empty((3, 3))
    half = np.empty(3)
    for j in range(plots):
        m = size[j]
        for a in range(m):
            v[a] = 0.0
            for b in range(m):
                M[a, b] = 0.0
        for s in range(2):
            w = log_w[j, s] / total
            if w > 0.0:
                for a in range(m):
                    v[a] += w * u[j, s, a]
                    for b in range(m):
                        M[a, b] += w * (W[j, s, a, b] - u[j, s, a] * u[j, s, b])
        for i in range(n):
            for a in range(m):
                d[i] += C[j, i, a] * v[a]
                half[a] = 0.0
                for b in range(m):
                    half[a] += M[a, b] * C[j, i, b]
            for g in range(i + 1):
                for a in range(m):
                    P[i, g] -= half[a] * C[j, g, a]
    for i in range(n):
        x[i] += d[i]
        for g in range(i + 1):
            P[i, g] -= d[i] * d[g]
    _mend(P)
    return math.exp(log_most) * total


@njit(cache=True, nogil=True, error_model="numpy")
def _mend(P: Array) -> None:
    """Copy the lower triangle to the upper; what rounding made impossible becomes barely possible."""
    n = P.shape[0]
    for i in range(n):
        P[i, i] = max(P[i, i], 0.0)
        for g in range(i):
            most = math.sqrt(P[i, i] * P[g, g])
            P[i, g] = min(max(P[i, g], -most), most)
            P[g, i] = P[i, g]


@njit(cache=True, nogil=True, error_model="numpy")
def _predict_modes(x: Array, P: Array, mu: Array, T: float, par: Any) -> None:
    """Mix and propagate (r, n), (r, n, n), (r,) over `T` s; a long time in several steps."""
    r = mu.size
    steps = 1
    if r > 1:
        often = 0.0
        for k in range(r):
            often = max(often, par.leave[k])
        steps = int(min(max(math.ceil(T * often / _MOST_SWITCHING), 1.0), _MOST_STEPS))
    for _ in range(steps):
        if r > 1:
            _mix(x, P, mu, T / steps, par)
        for k in range(r):
            _predict(par.model[k], x[k], P[k], T / steps, par)


@njit(cache=True, nogil=True, error_model="numpy")
def _mix(x: Array, P: Array, mu: Array, T: float, par: Any) -> None:
    """Let the modes switch for `T` s [1, (11.6.6-7) to (11.6.6-9)]."""
    r, n = x.shape
    old_x, old_P, joint = x.copy(), P.copy(), np.empty((r, r))
    for i in range(r):
        # No mode is left for the others more than it would be if its past were forgotten.
        left = min(-math.expm1(-T * par.leave[i]), (r - 1) / r)
        for j in range(r):
            joint[i, j] = mu[i] * (1.0 - left if i == j else left / (r - 1))
    for j in range(r):
        mu[j] = 0.0
        for i in range(r):
            mu[j] += joint[i, j]
        x[j] = 0.0
        P[j] = 0.0
        if not mu[j] > 0.0:
            mu[j] = 0.0
            joint[j, j], mu_j = 1.0, 1.0
        else:
            mu_j = mu[j]
        for i in range(r):
            w = joint[i, j] / mu_j
            for a in range(n):
                if _has(par.model[j], a, n):
                    x[j, a] += w * old_x[i, a]
        for i in range(r):
            w = joint[i, j] / mu_j
            for a in range(n):
                if not _has(par.model[j], a, n):
                    continue
                if not _has(par.model[i], a, n):
                    P[j, a, a] += w * _prior_variance(a, n, par)
                for b in range(a + 1):
                    if _has(par.model[j], b, n):
                        spread = (old_x[i, a] - x[j, a]) * (old_x[i, b] - x[j, b])
                        P[j, a, b] += w * (old_P[i, a, b] + spread)
        for a in range(n):
            for b in range(a):
                P[j, b, a] = P[j, a, b]


@njit(cache=True, nogil=True, error_model="numpy")
def _moments(x: Array, P: Array, mu: Array, mean: Array, cov: Array) -> None:
    """Fill the mean (4,) and covariance (4, 4) of position and velocity over the modes."""
    r = mu.size
    for i in range(4):
        mean[i] = 0.0
        for k in range(r):
            mean[i] += mu[k] * x[k, i]
    for i in range(4):
        for j in range(i + 1):
            total = 0.0
            for k in range(r):
                total += mu[k] * (P[k, i, j] + (x[k, i] - mean[i]) * (x[k, j] - mean[j]))
            cov[i, j] = total
            cov[j, i] = total


@njit(cache=True, nogil=True, error_model="numpy")
def _forecast(track: Any, x: Array, P: Array, mu: Array, par: Any) -> None:
    """Set the track's `curve` and `growth`, so that its forecast is the modes' own after one turn.

    After T s the forecast is at x + T v + T²/2 curve, its covariance that of constant velocity without
    noise, and T³ growth. No mode counts less than `_LEAST_SHARE` in the covariance: the gate that is
    made from it must let in the first plot of a manoeuvre, when its mode is still improbable.
    """
    T, least = par.turn, _LEAST_GROWTH * par.q / 3.0
    if (mu.size == 1 and par.model[0] == CV) or not T > 0.0:
        track.curve[0] = track.curve[1] = 0.0
        track.growth[0], track.growth[1], track.growth[2] = par.q / 3.0, 0.0, par.q / 3.0
        return
    x, P, mu = x.copy(), P.copy(), mu.copy()
    _predict_modes(x, P, mu, T, par)
    mean, cov = np.empty(4), np.empty((4, 4))
    _moments(x, P, mu, mean, cov)
    T3, before = T * T * T, track.P
    for i in range(2):
        track.curve[i] = 2.0 * (mean[i] - track.x[i] - T * track.x[i + 2]) / (T * T)
    _raise(mu)
    _moments(x, P, mu, mean, cov)
    ee = (cov[0, 0] - before[0, 0] - 2.0 * T * before[0, 2] - T * T * before[2, 2]) / T3
    nn = (cov[1, 1] - before[1, 1] - 2.0 * T * before[1, 3] - T * T * before[3, 3]) / T3
    en = (cov[0, 1] - before[0, 1] - T * (before[0, 3] + before[1, 2]) - T * T * before[2, 3]) / T3
    # Eigenvalues below the least are raised to it.
    middle, half = 0.5 * (ee + nn), math.hypot(0.5 * (ee - nn), en)
    high, low = max(middle + half, least), max(middle - half, least)
    c, s = (0.5 * (ee - nn) / half, en / half) if half > 0.0 else (1.0, 0.0)
    middle, half = 0.5 * (high + low), 0.5 * (high - low)
    track.growth[0], track.growth[1], track.growth[2] = middle + half * c, half * s, middle - half * c


@njit(cache=True, nogil=True, error_model="numpy")
def _raise(mu: Array) -> None:
    """Give every mode its least share, and scale the sum back to 1."""
    total = 0.0
    for k in range(mu.size):
        mu[k] = max(mu[k], _LEAST_SHARE)
        total += mu[k]
    for k in range(mu.size):
        mu[k] /= total


@njit(cache=True, nogil=True, error_model="numpy")
def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else -math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _log_sum(a: float, b: float) -> float:
    """log(eᵃ + eᵇ)."""
    high, low = max(a, b), min(a, b)
    return high + math.log1p(math.exp(low - high)) if low > -math.inf else high


__all__ = ["advance", "log_likelihood", "start", "update"]
