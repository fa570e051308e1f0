"""Global nearest neighbour: the one likeliest feasible event.

The assignment that maximises the sum of gains log(weight / miss weight), a miss having gain 0. Tracks
are added one by one, each along the shortest augmenting path in reduced costs, found with Dijkstra's
algorithm over the pairs alone; a path ends at a free plot, or at a track that is better missed.

Sources: Blackman and Popoli, Design and Analysis of Modern Tracking Systems, 1999, §6.4 (the problem);
Jonker and Volgenant, A shortest augmenting path algorithm for dense and sparse linear assignment
problems, Computing 38, 1987 (the method).
"""

import math
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
    """Fill `p` and `p_miss` with 0 or 1, see `pairs`. Always exact: `budget` is not used."""
    p[:], p_miss[:], approximate[:] = 0.0, 1.0, False
    if row.size == 0:
        return
    cost = -np.log(_ratios(miss, row, w))  # infinite where the weight is 0
    chosen = assign(miss.size, columns, row, col, cost)
    for t in range(miss.size):
        if chosen[t] >= 0:
            p[chosen[t]], p_miss[t] = 1.0, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def assign(tracks: int, columns: int, row: Ints, col: Ints, cost: Array) -> Ints:
    """(tracks,) the pair of each track, -1 none, such that the sum of the chosen costs is least.

    `row` ascending. To choose none costs nothing, so a pair of positive cost is of use only if never.
    """
    start = np.searchsorted(row, np.arange(tracks + 1))
    chosen = np.full(tracks, -1, np.int64)
    owner = np.full(columns, -1, np.int64)  # track that has the column
    u, v = np.zeros(tracks), np.zeros(columns)  # potentials: u + v ≤ cost, with equality where chosen
    far, via = np.full(columns, math.inf), np.empty(columns, np.int64)  # distance, and the last pair there
    done = np.zeros(columns, np.bool_)
    reached, settled = np.empty(columns, np.int64), np.empty(columns, np.int64)
    for t in range(tracks):
        i, here, n, m = t, 0.0, 0, 0  # track being looked from, its distance; columns reached, settled
        end, last, shortest = (
            -1,
            -1,
            math.inf,
        )  # the best end so far: a free column, or (-1) track `last` misses
        while True:
            if here - u[i] < shortest:
                shortest, end, last = here - u[i], -1, i
            for k in range(start[i], start[i + 1]):
                j = col[k]
                d = here + cost[k] - u[i] - v[j]
                if not done[j] and d < far[j]:
                    if far[j] == math.inf:
                        reached[n] = j
                        n += 1
                    far[j], via[j] = d, k
                    if owner[j] < 0 and d < shortest:
                        shortest, end = d, j
            at = -1
            for a in range(n):
                if at < 0 or far[reached[a]] < far[reached[at]]:
                    at = a
            if at < 0 or far[reached[at]] >= shortest:
                break
            j = reached[at]
            n -= 1
            reached[at] = reached[n]
            done[j] = True
            settled[m] = j
            m += 1
            i, here = owner[j], far[j]
        u[t] += shortest
        for a in range(m):
            j = settled[a]
            u[owner[j]] += shortest - far[j]
            v[j] -= shortest - far[j]
        _augment(t, end, last, row, col, via, chosen, owner)
        for a in range(m):
            far[settled[a]], done[settled[a]] = math.inf, False
        for a in range(n):
            far[reached[a]] = math.inf
    return chosen


@njit(cache=True, nogil=True)
def _augment(t: int, end: int, last: int, row: Ints, col: Ints, via: Ints, chosen: Ints, owner: Ints) -> None:
    """Hand on the columns along the path from track `t` to the free column `end`, or to `last`'s miss."""
    j = end
    if end < 0:
        if last == t:
            return
        j = col[chosen[last]]
        chosen[last] = -1
    while True:
        k = via[j]
        i = row[k]
        before = chosen[i]
        chosen[i], owner[j] = k, i
        if i == t:
            return
        j = col[before]
