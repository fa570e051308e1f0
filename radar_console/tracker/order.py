"""Putting few things in order: a bin has a handful of plots, and seldom a dead track."""

from typing import Any

import numpy as np
from numba import njit

from radar_console.tracker.association.pairs import Ints

_FEW = 24  # up to here insertion is faster than the library's sort, which starts by allocating


@njit(cache=True, nogil=True)
def ascending(values: Any) -> Ints:
    """Order of `values` (n,), the lowest first; equal ones keep their order."""
    n = values.size
    if n > _FEW:
        return np.argsort(values, kind="mergesort")
    order = np.empty(n, np.int64)
    for k in range(n):
        i = k
        while i > 0 and values[order[i - 1]] > values[k]:
            order[i] = order[i - 1]
            i -= 1
        order[i] = k
    return order
