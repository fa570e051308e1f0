"""Loopy belief propagation: the probabilities of a cluster that is too wide for the exact sum.

Source: Williams and Lau, Approximate evaluation of marginal association probabilities with belief
propagation, IEEE T-AES 50(4), 2014, (24)-(26); it always converges (their theorem 1).

Where a million pairs come one by one indices are unsigned: numba looks at others whether they count from the
end.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.grouping import Claims
from radar_console.tracker.association.pairs import LEAST_MISS, SHORT, Ints, Side
from radar_console.tracker.kernels import bare, inlined

CLOSE = 1e-9
"""Relative change of what the plots hear below which the messages have converged."""


class Messages(NamedTuple):
    """Scratch: made once for all clusters of a call, and never cleared as a whole.

    Attributes
    ----------
    told : (pairs,) what the track told the plot
    heard, hears : (plots,) 1 and all that the plot was told, in the last sweep and in this one
    weight : (the most pairs of a track,)
    """

    told: Array
    heard: Array
    hears: Array
    weight: Array


@njit(cache=True, nogil=True)
def messages(tracks: Side, plots: int) -> Messages:
    widest = 0
    for t in range(tracks.start.size - 1):
        widest = max(widest, tracks.start[t + 1] - tracks.start[t])
    return Messages(np.empty(tracks.ratio.size), np.empty(plots), np.empty(plots), np.empty(widest))


@bare
def propagate(
    members: Ints, tracks: Side, plots: Ints, claims: Claims, folded: bool, sweeps: int, scratch: Messages,
    p_miss: Array,
) -> None:  # fmt: skip
    """Turn the ratios of a cluster into probabilities, in at most so many sweeps, and fill its `p_miss`.

    A track tells a plot ratio / (1 + the sum over its other plots of ratio · message), a plot tells a
    track 1 / (1 + the sum over its other tracks of message). Only what the tracks told is kept: what a
    plot tells follows from that and from all that the plot has heard.

    Parameters
    ----------
    members, plots : tracks and plots of the cluster
    claims : (columns,) pairs of each plot
    folded : plots of one track count as a part of its miss, where others are used more than once
    """
    told, heard, hears, weight = scratch
    for j in plots:
        heard[j] = 1.0
    for sweep in range(sweeps):
        for j in plots:
            hears[j] = 1.0
        for t in members:
            _speak(tracks.start[t], tracks.start[t + 1], tracks, sweep == 0, told, heard, hears, weight)
        heard, hears = hears, heard
        if sweep + 1 == sweeps:
            break
        change = 0.0
        for j in plots:
            change += abs(heard[j] - hears[j]) / heard[j]
        if change < CLOSE:
            break
    used = hears
    for j in plots:
        used[j] = 0.0
    for t in members:
        p_miss[t] = _use(tracks.start[t], tracks.start[t + 1], tracks, told, heard, used, weight)
    for j in plots:
        # Messages that have not converged may use a plot more than once.
        used[j] = 1.0 / max(used[j], 1.0)
    for t in members:
        _settle(t, tracks, used, claims, folded, p_miss)


@njit(cache=True, nogil=True, error_model="numpy")
def propagate_once(tracks: Side, claims: Claims, folded: bool, among: Any, p_miss: Array) -> None:
    """The same with one sweep, over all tracks that are `among` (tracks,) them; no messages are kept.

    For hundreds of thousands of short tracks, which wait for memory. Of a track, d is the weight that is
    left without the pair, r / d what it tells the plot, r / (heard - r / d) = r d / (heard d - r) the pair's
    new weight. What plots hear, and are used, is in single precision, of which caches hold twice as much.
    """
    plots = claims.size
    heard, used = np.ones(plots, np.float32), np.zeros(plots, np.float32)
    start, c, r = tracks
    for t in range(among.size):
        if among[t]:
            begin, end, total = np.uint64(start[t]), np.uint64(start[t + 1]), 1.0
            for k in range(begin, end):
                total += r[k]
            for k in range(begin, end):
                heard[np.uint64(c[k])] += r[k] / max(total - r[k], 1.0)
    for t in range(among.size):
        if among[t]:
            begin, end, total, together = np.uint64(start[t]), np.uint64(start[t + 1]), 1.0, 1.0
            for k in range(begin, end):
                total += r[k]
            for k in range(begin, end):
                d = max(total - r[k], 1.0)
                r[k] *= d / max(heard[np.uint64(c[k])] * d - r[k], d)
                together += r[k]
            share = 1.0 / together
            p_miss[t] = share
            for k in range(begin, end):
                r[k] *= share
                used[np.uint64(c[k])] += r[k]
    for j in range(plots):
        used[j] = 1.0 / max(used[j], 1.0)
    for t in range(among.size):
        if among[t]:
            _settle(t, tracks, used, claims, folded, p_miss)


@inlined
def _speak(
    begin: int, end: int, tracks: Side, first: bool, told: Array, heard: Array, hears: Array, weight: Array
) -> None:
    """A track's pairs begin:end tell their plots; in the first sweep all messages of plots are 1."""
    r, c = tracks.ratio, tracks.other
    if end - begin > SHORT:
        r, c, u = r[begin:end], c[begin:end], told[begin:end]
        if first:
            _tell(r, r, _sum(r), u)
        else:
            _tell(r, weight, _weigh(r, c, u, heard, weight), u)
        for k in range(r.size):
            hears[c[k]] += u[k]
        return
    total = 1.0
    for k in range(begin, end):
        w = r[k] if first else r[k] / max(heard[c[k]] - told[k], 1.0)
        weight[k - begin] = w
        total += w
    for k in range(begin, end):
        u = r[k] / max(total - weight[k - begin], 1.0)
        told[k] = u
        hears[c[k]] += u


@inlined
def _use(begin: int, end: int, tracks: Side, told: Array, heard: Array, used: Array, weight: Array) -> float:
    """Turn the ratios of a track's pairs begin:end into probabilities, also added to `used`; the miss's."""
    r, c = tracks.ratio, tracks.other
    if end - begin > SHORT:
        r, c = r[begin:end], c[begin:end]
        total = _weigh(r, c, told[begin:end], heard, weight)
        for k in range(r.size):
            r[k] = weight[k] / total
        for k in range(r.size):
            used[c[k]] += r[k]
        return 1.0 / total
    total = 1.0
    for k in range(begin, end):
        w = r[k] / max(heard[c[k]] - told[k], 1.0)
        weight[k - begin] = w
        total += w
    for k in range(begin, end):
        p = weight[k - begin] / total
        r[k] = p
        used[c[k]] += p
    return 1.0 / total


@inlined
def _settle(t: int, tracks: Side, used: Array, claims: Claims, folded: bool, p_miss: Array) -> None:
    """Take from a track what is `used` more than once; give it to the miss and what is folded into it.

    `used` (plots,) is the part of its probability that each plot keeps.
    """
    start, c, r = tracks
    begin, end = np.uint64(start[t]), np.uint64(start[t + 1])
    lost = 0.0
    for k in range(begin, end):
        p = r[k] * used[np.uint64(c[k])]
        lost += r[k] - p
        r[k] = p
    if not folded:
        p_miss[t] += lost
        return
    own = p_miss[t]  # also where nothing was lost: a mistaken branch costs more
    for k in range(begin, end):
        own += r[k] if claims[np.uint64(c[k])] == 1 else 0.0
    more = 1.0 + lost / own
    p_miss[t] *= more
    for k in range(begin, end):
        r[k] *= more if claims[np.uint64(c[k])] == 1 else 1.0


# Sums in any order, so that they run in vectors.
@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _sum(r: Array) -> float:
    """Of a track's ratios, with the miss's 1."""
    total = 1.0
    for k in range(r.size):
        total += r[k]
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _weigh(r: Array, c: Ints, u: Array, heard: Array, weight: Array) -> float:
    """Fill `weight` of a track's pairs, ratio times the plot's message; their sum with the miss's 1."""
    total = 1.0
    for k in range(r.size):
        weight[k] = r[k] / max(heard[c[k]] - u[k], 1.0)
        total += weight[k]
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _tell(r: Array, weight: Array, total: float, u: Array) -> None:
    """Fill `u` with what a track tells its plots."""
    for k in range(r.size):
        # What is left without this pair; never below the miss's 1, whatever rounding does.
        u[k] = r[k] / max(total - weight[k], 1.0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def propagate_all(weights: Array, sweeps: int, result: Array) -> bool:
    """The same where every track gates every plot: on the matrices themselves, without lists of pairs.

    Parameters
    ----------
    weights, result : (tracks, plots + 1)  as `jpda.marginals` takes and returns them
    """
    tracks, plots = weights.shape[0], weights.shape[1] - 1
    told, heard, hears = np.empty((tracks, plots)), np.ones(plots), np.empty(plots)
    weight = np.empty(plots)
    for t in range(tracks):
        miss, gate, r = weights[t, 0], weights[t, 1:], result[t, 1:]
        largest = max(miss, gate.max())
        least = max(miss / largest, LEAST_MISS)
        for k in range(plots):
            r[k] = gate[k] / largest / least
    converged = False
    for sweep in range(sweeps):
        hears[:] = 1.0
        for t in range(tracks):
            r, u = result[t, 1:], told[t]
            if sweep == 0:
                _tell(r, r, _sum(r), u)
            else:
                _tell(r, weight, _weigh_all(r, u, heard, weight), u)
            for k in range(plots):
                hears[k] += u[k]
        change = 0.0
        for j in range(plots):
            change += abs(hears[j] - heard[j]) / hears[j]
        heard, hears = hears, heard
        if change < CLOSE:
            converged = True
            break
    used = hears
    used[:] = 0.0
    for t in range(tracks):
        p = result[t, 1:]
        total = _weigh_all(p, told[t], heard, weight)
        for k in range(plots):
            p[k] = weight[k] / total
            used[k] += p[k]
    for k in range(plots):
        used[k] = 1.0 / max(used[k], 1.0)
    for t in range(tracks):
        p, together = result[t, 1:], 0.0
        for k in range(plots):
            p[k] *= used[k]
            together += p[k]
        result[t, 0] = max(1.0 - together, 0.0)
    return converged


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _weigh_all(r: Array, u: Array, heard: Array, weight: Array) -> float:
    """As `_weigh`, of a track that gates all plots: a loop that runs in vectors."""
    total = 1.0
    for k in range(r.size):
        weight[k] = r[k] / max(heard[k] - u[k], 1.0)
        total += weight[k]
    return total
