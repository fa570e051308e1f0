"""A track's height: two states beside those of the plane, the same for every filter.

Heights are measured by themselves (a reported flight level, or the elevation of a three-dimensional
radar), so the height is a Kalman filter of its own that shares the plots and their probabilities.
"""

import math
from typing import Any

import numpy as np

from radar_console.estimation.gaussian import Array
from radar_console.tracker.kernels import bare

_SD_CLIMB = 15.0  # m/s, before anything is known
_SPAN = 12_000.0  # m, over which other heights are spread
_ODD = 0.05  # part of the heights that say nothing


@bare
def begin(track: Any, plot: Any) -> None:
    """The height of the first plot that has one."""
    up, P = track.up, track.up_P
    up[0], up[1] = plot.up, 0.0 if math.isfinite(plot.up) else np.nan
    P[0], P[1], P[2] = plot.uu, 0.0, _SD_CLIMB * _SD_CLIMB
    track.up_t = plot.t


@bare
def predicted(track: Any, t: float, q: float) -> tuple[float, float, float, float, float]:
    """Height and rate at the time `t`, and their covariance pp, pv, vv."""
    up, P = track.up, track.up_P
    T = max(t - track.up_t, 0.0)
    return (
        up[0] + T * up[1],
        up[1],
        P[0] + 2.0 * T * P[1] + T * T * P[2] + q * T * T * T / 3.0,
        P[1] + T * P[2] + q * T * T / 2.0,
        P[2] + q * T,
    )


@bare
def factor(track: Any, plot: Any, q: float) -> float:
    """Likelihood of the plot's height, relative to that of any other target's; 1 where one is unknown."""
    if not (math.isfinite(track.up[0]) and math.isfinite(plot.up)):
        return 1.0
    u, _, pp, _, _ = predicted(track, plot.t, q)
    S = pp + plot.uu
    nu = plot.up - u
    return (1.0 - _ODD) * _SPAN * math.exp(-0.5 * nu * nu / S) / math.sqrt(2.0 * math.pi * S) + _ODD


@bare
def update(track: Any, pool: Any, chosen: Any, beta: Array, q: float) -> None:
    """Condition on the plots `chosen` (m,) of `pool`, with probabilities `beta` (m,): the PDA update."""
    likeliest = -1
    for j in range(beta.size):
        known = math.isfinite(pool[chosen[j]].up)
        if known and (likeliest < 0 or beta[j] > beta[likeliest]):
            likeliest = j
    if likeliest < 0:
        return
    if not math.isfinite(track.up[0]):
        if beta[likeliest] >= 0.5:
            begin(track, pool[chosen[likeliest]])
        return
    t = max(pool[chosen[likeliest]].t, track.up_t)
    u, v, pp, pv, vv = predicted(track, t, q)
    shift, square, gain_p, gain_v, part = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(beta.size):
        plot = pool[chosen[j]]
        if not math.isfinite(plot.up):
            continue
        S = pp + plot.uu
        nu = plot.up - u
        if nu * nu > 50.0 * S:  # no height of this target
            continue
        shift += beta[j] * nu / S
        square += beta[j] * nu * nu / (S * S)
        part += beta[j] / S
    spread = square - shift * shift
    track.up[0], track.up[1], track.up_t = u + pp * shift, v + pv * shift, t
    gain_p, gain_v = pp * pp * (spread - part), pv * pv * (spread - part)
    P = track.up_P
    P[0], P[1], P[2] = max(pp + gain_p, 1e-3), pv + pp * pv * (spread - part), max(vv + gain_v, 1e-6)
