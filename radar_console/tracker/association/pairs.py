"""The sparse shape of an association problem, shared by all associators.

A problem is `miss` (tracks,), the weight of no plot, and pairs (row, col, w), rows ascending: plot `col`
lies in the gate of track `row` with weight w. An associator fills `p` (pairs,), the probability of each
pair, `p_miss` (tracks,), and `approximate` (tracks,), where it had to approximate.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array

Ints = NDArray[np.int64]

LEAST_MISS = 1e-30
"""Of a track's largest weight: keeps a certain detection (P_D P_G = 1, a miss of weight 0) divisible."""

SHORT = 8
"""Pairs of a track, up to which loops in vectors cost more than they gain."""

_LEAP = 32  # pairs of one track that are passed over at once


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


@njit(cache=True, nogil=True)
def starts(tracks: int, row: Ints) -> Ints:
    """(tracks + 1,) the pairs of track t are starts[t]:starts[t + 1]."""
    start = np.empty(tracks + 1, np.int64)
    k = 0
    for t in range(tracks):
        start[t] = k
        while k + _LEAP < row.size and row[k + _LEAP] == t:
            k += _LEAP
        while k < row.size and row[k] == t:
            k += 1
    start[tracks] = k
    return start


# No weight is NaN, and the largest is the same in any order: so it is looked for in vectors.
@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz", "reassoc"})
def divide(miss: Array, start: Ints, w: Array, ratio: Array) -> None:
    """Fill `ratio` (pairs,) with weight over the track's miss weight, at most 1 / LEAST_MISS; may be `w`."""
    for t in range(miss.size):
        begin, end, m = start[t], start[t + 1], miss[t]
        largest = m
        if end - begin <= SHORT:
            first, stop = np.uint64(begin), np.uint64(end)  # else numba looks whether they count from the end
            for k in range(first, stop):
                largest = max(largest, w[k])
            if m > LEAST_MISS * largest:
                for k in range(first, stop):
                    ratio[k] = w[k] / m
            else:
                for k in range(first, stop):
                    ratio[k] = _certain(w[k], largest)
            continue
        gate, r = w[begin:end], ratio[begin:end]
        for k in range(r.size):
            r[k] = gate[k]
            largest = max(largest, r[k])
        if m > LEAST_MISS * largest:
            for k in range(r.size):
                r[k] /= m
        else:
            for k in range(r.size):
                r[k] = _certain(r[k], largest)


@njit(cache=True, nogil=True, error_model="numpy")
def _certain(w: float, largest: float) -> float:
    """Ratio of a weight where the miss is as good as impossible: two quotients, no overflow."""
    return w / largest / LEAST_MISS if largest > 0.0 else 0.0


@njit(cache=True, nogil=True)
def ratios(miss: Array, row: Ints, w: Array) -> Array:
    """(pairs,) the same, in an array of its own."""
    ratio = np.empty(row.size)
    divide(miss, starts(miss.size, row), w, ratio)
    return ratio


@njit(cache=True, nogil=True)
def find(parent: NDArray[np.signedinteger[Any]], i: int) -> int:
    """The root of `i`; shortens the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i
