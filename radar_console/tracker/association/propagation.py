"""Loopy belief propagation: the probabilities of a cluster that is too wide for the exact sum.

Source: Williams and Lau, Approximate evaluation of marginal association probabilities with belief
propagation, IEEE T-AES 50(4), 2014, (24)-(26); it always converges (their theorem 1).
"""

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.pairs import Ints, Side

CLOSE = 1e-9
"""Change of a message below which it has converged."""


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def propagate(members: Ints, tracks: Side, plots: int, sweeps: int, p: Array) -> None:
    """Fill `p` (pairs,) for the tracks `members`, after `sweeps` sweeps at most."""
    start, other, r = tracks
    to_track, to_plot, heard = np.ones(p.size), np.empty(p.size), np.empty(plots)
    for _ in range(sweeps):
        heard[:] = 1.0
        for i in members:
            total = 1.0
            for k in range(start[i], start[i + 1]):
                total += r[k] * to_track[k]
            for k in range(start[i], start[i + 1]):
                # What is left without this pair; never below the miss's 1, whatever rounding does.
                to_plot[k] = r[k] / max(total - r[k] * to_track[k], 1.0)
            for k in range(start[i], start[i + 1]):
                heard[other[k]] += to_plot[k]
        change = 0.0
        for i in members:
            for k in range(start[i], start[i + 1]):
                message = 1.0 / max(heard[other[k]] - to_plot[k], 1.0)
                change = max(change, abs(message - to_track[k]))
                to_track[k] = message
        if change < CLOSE:
            break
    for i in members:
        total = 1.0
        for k in range(start[i], start[i + 1]):
            total += r[k] * to_track[k]
        for k in range(start[i], start[i + 1]):
            p[k] = r[k] * to_track[k] / total
