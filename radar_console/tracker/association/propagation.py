"""Loopy belief propagation: the probabilities of a cluster that is too wide for the exact sum.

Source: Williams and Lau, Approximate evaluation of marginal association probabilities with belief
propagation, IEEE T-AES 50(4), 2014, (24)-(26); it always converges (their theorem 1).
"""

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.pairs import LEAST_MISS, Ints, Side

CLOSE = 1e-9
"""Relative change of what the plots hear below which the messages have converged."""


# Sums in any order, so that they run in vectors.
@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def propagate(members: Ints, tracks: Side, plots: int, sweeps: int) -> bool:
    """Turn the ratios of the tracks `members` into probabilities; False if `sweeps` were too few to converge.

    A track tells a plot ratio / (1 + the sum over its other plots of ratio · message), a plot tells a
    track 1 / (1 + the sum over its other tracks of message). Only what the tracks told is kept: what a
    plot tells follows from that and from all that the plot has heard.
    """
    told, heard, hears = np.zeros(tracks.ratio.size), np.ones(plots), np.empty(plots)
    widest = 0
    for t in members:
        widest = max(widest, tracks.start[t + 1] - tracks.start[t])
    weight = np.empty(widest)
    converged = False
    for _ in range(sweeps):
        hears[:] = 1.0
        for t in members:
            begin, end = tracks.start[t], tracks.start[t + 1]
            r, c, u = tracks.ratio[begin:end], tracks.other[begin:end], told[begin:end]
            total = _weigh(r, c, u, heard, weight)
            for k in range(r.size):
                # What is left without this pair; never below the miss's 1, whatever rounding does.
                u[k] = r[k] / max(total - weight[k], 1.0)
            for k in range(r.size):
                hears[c[k]] += u[k]
        change = 0.0
        for j in range(plots):
            change += abs(hears[j] - heard[j]) / hears[j]
        heard, hears = hears, heard
        if change < CLOSE:
            converged = True
            break
    used = hears
    used[:] = 0.0
    for t in members:
        begin, end = tracks.start[t], tracks.start[t + 1]
        r, c, u = tracks.ratio[begin:end], tracks.other[begin:end], told[begin:end]
        total = _weigh(r, c, u, heard, weight)
        for k in range(r.size):
            r[k] = weight[k] / total
            used[c[k]] += r[k]
    for t in members:
        for k in range(tracks.start[t], tracks.start[t + 1]):
            # Messages that have not converged may use a plot more than once.
            tracks.ratio[k] /= max(used[tracks.other[k]], 1.0)
    return converged


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _weigh(r: Array, c: Ints, u: Array, heard: Array, weight: Array) -> float:
    """Fill `weight` of a track's pairs, ratio times the plot's message; their sum with the miss's 1."""
    total = 1.0
    for k in range(r.size):
        weight[k] = r[k] / max(heard[c[k]] - u[k], 1.0)
        total += weight[k]
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def propagate_all(weights: Array, sweeps: int, result: Array) -> bool:
    """The same where every track gates every plot: on the matrices themselves, without lists of pairs.

    Parameters
    ----------
    weights, result : (tracks, plots + 1)  as `jpda.marginals` takes and returns them
    """
    tracks, plots = weights.shape[0], weights.shape[1] - 1
    told, heard, hears = np.zeros((tracks, plots)), np.ones(plots), np.empty(plots)
    weight = np.empty(plots)
    for t in range(tracks):
        miss, gate, r = weights[t, 0], weights[t, 1:], result[t, 1:]
        largest = max(miss, gate.max())
        least = max(miss / largest, LEAST_MISS)
        for k in range(plots):
            r[k] = gate[k] / largest / least
    converged = False
    for _ in range(sweeps):
        hears[:] = 1.0
        for t in range(tracks):
            u = told[t]
            total = _weigh_all(result[t, 1:], u, heard, weight)
            for k in range(plots):
                u[k] = result[t, 1 + k] / max(total - weight[k], 1.0)
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
    for t in range(tracks):
        p, together = result[t, 1:], 0.0
        for k in range(plots):
            p[k] /= max(used[k], 1.0)
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
