"""Loopy belief propagation: the probabilities of a cluster that is too wide for the exact sum.

Source: Williams and Lau, Approximate evaluation of marginal association probabilities with belief
propagation, IEEE T-AES 50(4), 2014, (24)-(26); it always converges (their theorem 1).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.pairs import LEAST_MISS, Ints, Side

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


# Sums in any order, so that they run in vectors.
@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def propagate(members: Ints, tracks: Side, plots: Ints, sweeps: int, scratch: Messages) -> bool:
    """Turn the ratios of a cluster into probabilities; False if `sweeps` were too few to converge.

    A track tells a plot ratio / (1 + the sum over its other plots of ratio · message), a plot tells a
    track 1 / (1 + the sum over its other tracks of message). Only what the tracks told is kept: what a
    plot tells follows from that and from all that the plot has heard.

    Parameters
    ----------
    members, plots : tracks and plots of the cluster
    """
    told, heard, hears, weight = scratch
    for j in plots:
        heard[j] = 1.0
    converged = False
    for sweep in range(sweeps):
        for j in plots:
            hears[j] = 1.0
        for t in members:
            begin, end = tracks.start[t], tracks.start[t + 1]
            r, c, u = tracks.ratio[begin:end], tracks.other[begin:end], told[begin:end]
            if sweep == 0:
                _tell(r, r, _sum(r), u)
            else:
                _tell(r, weight, _weigh(r, c, u, heard, weight), u)
            for k in range(r.size):
                hears[c[k]] += u[k]
        change = 0.0
        for j in plots:
            change += abs(hears[j] - heard[j]) / hears[j]
        heard, hears = hears, heard
        if change < CLOSE:
            converged = True
            break
    used = hears
    for j in plots:
        used[j] = 0.0
    for t in members:
        begin, end = tracks.start[t], tracks.start[t + 1]
        r, c, u = tracks.ratio[begin:end], tracks.other[begin:end], told[begin:end]
        total = _weigh(r, c, u, heard, weight)
        for k in range(r.size):
            r[k] = weight[k] / total
        for k in range(r.size):
            used[c[k]] += r[k]
    for j in plots:
        # Messages that have not converged may use a plot more than once.
        used[j] = 1.0 / max(used[j], 1.0)
    for t in members:
        r, c = (
            tracks.ratio[tracks.start[t] : tracks.start[t + 1]],
            tracks.other[tracks.start[t] : tracks.start[t + 1]],
        )
        for k in range(r.size):
            r[k] *= used[c[k]]
    return converged


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
