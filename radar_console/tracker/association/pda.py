"""Probabilistic data association: each track by itself, as if no other claimed its plots.

Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §3.4 (3.4.2-8).
"""

from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association import pairs
from radar_console.tracker.association.pairs import Ints

_ratios = pairs.ratios


@njit(cache=True, nogil=True, error_model="numpy")
def solve(
    miss: Array, columns: int, row: Ints, col: Ints, w: Array, budget: float, p: Array, p_miss: Array,
    approximate: Any,
) -> None:  # fmt: skip
    """Fill `p`, `p_miss` and `approximate` of the sparse problem, see `pairs`; `budget` is not used."""
    ratio = _ratios(miss, row, w)
    total = np.ones(miss.size)
    for k in range(row.size):
        total[row[k]] += ratio[k]
    for k in range(row.size):
        p[k] = ratio[k] / total[row[k]]
    for t in range(miss.size):
        p_miss[t] = 1.0 / total[t]
    approximate[:] = False
