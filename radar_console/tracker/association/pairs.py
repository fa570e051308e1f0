"""The sparse shape of an association problem, shared by all associators.

A problem is `miss` (tracks,), the weight of no plot, and pairs (row, col, w), rows ascending: plot `col`
lies in the gate of track `row` with weight w. An associator fills `p` (pairs,), the probability of each
pair, `p_miss` (tracks,), and `approximate` (tracks,), where it had to approximate.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array

Ints = NDArray[np.int64]

LEAST_MISS = 1e-30
"""Of a track's largest weight: keeps a certain detection (P_D P_G = 1, a miss of weight 0) divisible."""


class Side(NamedTuple):
    """The pairs by one side, tracks or plots.

    Attributes
    ----------
    start : (n + 1,) the pairs of i are start[i]:start[i + 1]
    other : (pairs,) the member of the other side
    ratio : (pairs,) weight of the pair over that of its absence
    """

    start: Ints
    other: Ints
    ratio: Array


@njit(cache=True, nogil=True, error_model="numpy")
def ratios(miss: Array, row: Ints, w: Array) -> Array:
    """(pairs,) weight over the track's miss weight; at most 1 / LEAST_MISS."""
    ratio = np.empty(row.size)
    end = 0
    while end < row.size:
        begin, track = end, row[end]
        largest = miss[track]
        while end < row.size and row[end] == track:
            largest = max(largest, w[end])
            end += 1
        if largest == 0.0:
            ratio[begin:end] = 0.0
            continue
        least = max(miss[track] / largest, LEAST_MISS)
        gate, r = w[begin:end], ratio[begin:end]
        for k in range(r.size):
            r[k] = gate[k] / largest / least  # two quotients: no overflow, no 0 / 0 below 1e-308
    return ratio


@njit(cache=True, nogil=True)
def find(parent: Ints, i: int) -> int:
    """The root of `i`; shortens the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i
