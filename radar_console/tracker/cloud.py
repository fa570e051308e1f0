"""A confirmed track's particles: drawn, predicted, weighed and updated, in the track's own axes."""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation import particle
from radar_console.estimation.gaussian import Array
from radar_console.estimation.kalman import predict_in_place
from radar_console.estimation.particle import Singles
from radar_console.tracker.records import Belief

_draw, _predict, _weigh, _key = particle.draw, particle.predict, particle.weigh, particle.key
_normalise, _resample, _moments = particle.normalise, particle.resample, particle.moments
_cholesky, _regularise = particle.cholesky, particle.regularise

_RESAMPLING = 1 << 40  # added to the pass: the resampling's own random key
_START = 1 << 41
_PARTING = 1 << 42
_KERNEL = 0.25
_WIDER = 3.0  # velocities at confirmation: so young an estimate errs more than its covariance says


@njit(cache=True, nogil=True, error_model="numpy")
def start(track: Any, sensor_e: float, sensor_n: float, par: Any, belief: Belief) -> None:
    """Draw the particles from the track's Gaussian; their first axis is its bearing."""
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    x = track.x
    r = math.hypot(x[0] - sensor_e, x[1] - sensor_n)
    track.sin = (x[0] - sensor_e) / r if r > 0.0 else 0.0
    track.cos = (x[1] - sensor_n) / r if r > 0.0 else 1.0
    for i in range(4):
        track.anchor[i] = x[i]
    P, L = np.empty((4, 4)), np.empty((4, 4))
    for i in range(4):
        for j in range(4):
            track.P[i, j] *= (_WIDER if i > 1 else 1.0) * (_WIDER if j > 1 else 1.0)
    _turn(track.P, track.cos, track.sin, P)
    _cholesky(P, L)
    _draw(particles, L, _key(par.seed, track.id, track.passes + _START), belief.table)
    weights[:] = np.float32(1.0 / weights.size)


@njit(cache=True, nogil=True, error_model="numpy")
def advance(track: Any, t: float, par: Any, belief: Belief) -> None:
    """Predict the moments, the anchor and the particles to the time `t`."""
    T = t - track.t
    if T <= 0.0:
        return
    predict_in_place(track.x, track.P, T, par.q)
    anchor = track.anchor
    anchor[0] += T * anchor[2]
    anchor[1] += T * anchor[3]
    _predict(belief.particles[track.slot], T, par.q, _key(par.seed, track.id, track.passes), belief.table)
    track.t = t


@njit(cache=True, nogil=True, error_model="numpy")
def log_likelihood(track: Any, plot: Any, par: Any, belief: Belief, relative: Singles) -> tuple[float, float]:
    """log ĝ of the plot, and Σ w `relative`; see `particle.weigh`."""
    z, R, anchor = np.empty(2), np.empty(3), track.anchor
    lag = plot.t - track.t
    e = plot.e - anchor[0] - lag * anchor[2]
    n = plot.n - anchor[1] - lag * anchor[3]
    c, s = track.cos, track.sin
    z[0], z[1] = s * e + c * n, c * e - s * n
    R[0] = s * s * plot.ee + 2.0 * s * c * plot.en + c * c * plot.nn
    R[1] = s * c * (plot.ee - plot.nn) + (c * c - s * s) * plot.en
    R[2] = c * c * plot.ee - 2.0 * s * c * plot.en + s * s * plot.nn
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    return _weigh(particles, weights, z, R, lag, par.outliers, relative)


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
    """Reweigh by β_0 + Σ_j β_j g_j / ĝ_j, resample when N_eff is low, and take the moments.

    Parameters
    ----------
    miss : β_0
    beta, total : (plots,) β_j, and Σ w `relative`_j
    relative : (plots, N) likelihoods of the particles, relative to the largest
    chosen : (plots,) rows of the plots in `pool`
    """
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    seed, table = par.seed, belief.table
    factor = np.empty(weights.size, np.float32)
    factor[:] = np.float32(miss)
    for j in range(beta.size):
        scale = np.float32(beta[j] / total[j])
        row = relative[j]
        for i in range(weights.size):
            factor[i] += scale * row[i]
    for i in range(weights.size):
        weights[i] *= factor[i]
    mean, cov = np.empty(4), np.empty((4, 4))
    effective = _normalise(weights)
    _moments(particles, weights, mean, cov)
    c, s, anchor, x = track.cos, track.sin, track.anchor, track.x
    for p in (0, 2):
        x[p] = anchor[p] + s * mean[p] + c * mean[p + 1]
        x[p + 1] = anchor[p + 1] + c * mean[p] - s * mean[p + 1]
    _turn(cov, c, s, track.P)
    if effective < par.resample_below * weights.size:
        scratch = np.empty((4, weights.size), np.float32)
        _resample(particles, weights, _key(seed, track.id, track.passes + _RESAMPLING), scratch)
        _regularise(
            particles, mean, cov, _KERNEL, _key(seed, track.id, track.passes + _PARTING), table, scratch
        )
        for i in range(4):
            anchor[i] = x[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(P: Array, c: float, s: float, out: Array) -> None:
    """Covariance between east-north axes and the track's; the change of axes is its own inverse."""
    half = np.empty((4, 4))
    for i in range(4):
        for p in (0, 2):
            half[i, p] = s * P[i, p] + c * P[i, p + 1]
            half[i, p + 1] = c * P[i, p] - s * P[i, p + 1]
    for i in range(4):
        for p in (0, 2):
            out[p, i] = s * half[p, i] + c * half[p + 1, i]
            out[p + 1, i] = c * half[p, i] - s * half[p + 1, i]
    for i in range(4):
        for k in range(i):
            out[k, i] = out[i, k]


__all__ = ["advance", "log_likelihood", "start", "update"]
