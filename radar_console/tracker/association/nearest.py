"""Nearest neighbour: the likeliest pair first, each track and each plot once.

Source: Blackman and Popoli, Design and Analysis of Modern Tracking Systems, 1999, §6.4 (the greedy,
suboptimal assignment). A plot in a track's gate is taken even if a miss were likelier.
"""

from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.pairs import LEAST_MISS, Ints


@njit(cache=True, nogil=True, error_model="numpy")
def solve(
    miss: Array, columns: int, row: Ints, col: Ints, w: Array, budget: float, p: Array, p_miss: Array,
    approximate: Any,
) -> None:  # fmt: skip
    """Fill `p` and `p_miss` with 0 or 1, see `pairs`; of equal pairs the first is taken. No `budget`."""
    p[:], p_miss[:], approximate[:] = 0.0, 1.0, False
    if row.size == 0:
        return
    score = _scores(miss, row, w)
    taken = np.zeros(columns, np.bool_)
    for k in np.argsort(-score, kind="mergesort"):
        if w[k] > 0.0 and p_miss[row[k]] == 1.0 and not taken[col[k]]:
            p[k], p_miss[row[k]], taken[col[k]] = 1.0, 0.0, True


@njit(cache=True, nogil=True, error_model="numpy")
def _scores(miss: Array, row: Ints, w: Array) -> Array:
    """(pairs,) log of weight over miss; a miss of weight 0 counts as LEAST_MISS of the largest of all."""
    largest = w.max()
    least = np.log(max(largest, np.finfo(np.float64).tiny)) + np.log(LEAST_MISS)
    score = np.empty(row.size)
    for k in range(row.size):
        score[k] = np.log(w[k]) - (np.log(miss[row[k]]) if miss[row[k]] > 0.0 else least)
    return score
