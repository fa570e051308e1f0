"""Joint probabilistic data association: exact by dynamic programming, else belief propagation.

A feasible event is a matching between tracks and measurements; its weight is the product of the
ratios r = likelihood / miss weight over the matched pairs. The sum over all matchings goes over the
*rows* of the ratio matrix one after the other; the state is which *columns* are taken, among those
that earlier and later rows share. So the cost grows with what overlaps at once, not with the size
of the cluster. Rows are the tracks or the measurements, whichever costs less: the sum is the same.

Sources: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §6.2 (the probabilities);
Horridge and Maskell, Real-time tracking of hundreds of targets with efficient exact JPDAF,
FUSION 2006 (the elimination); Williams and Lau, Approximate evaluation of marginal association
probabilities with belief propagation, IEEE T-AES 50(4), 2014, (24)-(26).
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array

Ints = NDArray[np.int64]

BUDGET = 1.0e6
"""Steps of the exact sum for one cluster (about 5 ns each), beyond which it is approximated."""

_WIDEST = 20  # columns in the state; 2^20 numbers at each row
_SWEEPS = 200
_CLOSE = 1e-9
_LEAST_MISS = 1e-30  # of a row's largest weight: keeps a certain detection (P_D = 1) divisible


def marginals(likelihood: Array, budget: float = BUDGET) -> Array:
    """Probability of each origin of each measurement, over all feasible events.

    Parameters
    ----------
    likelihood : (tracks, measurements + 1)  column 0 the miss weight 1 - P_D P_G; entry [t, j + 1]
        P_D N(z_j) / λ, and 0 outside the gate
    budget : steps of the exact sum for one cluster; a costlier one is approximated

    Returns
    -------
    (tracks, measurements + 1)   rows sum to 1

    Raises
    ------
    ValueError      a weight is negative or not finite
    """
    weights = np.ascontiguousarray(likelihood, dtype=float)
    if not np.all(np.isfinite(weights)) or np.any(weights < 0):
        raise ValueError("expected finite weights that are not negative")
    result = np.zeros_like(weights)
    _dense(weights, budget, result)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _dense(weights: Array, budget: float, result: Array) -> None:
    tracks, columns = weights.shape
    count = 0
    for t in range(tracks):
        for j in range(1, columns):
            count += weights[t, j] > 0
    row, col, w = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
    miss = weights[:, 0].copy()
    k = 0
    for t in range(tracks):
        for j in range(1, columns):
            if weights[t, j] > 0:
                row[k], col[k], w[k] = t, j - 1, weights[t, j]
                k += 1
    p, p_miss, approximate = np.empty(count), np.empty(tracks), np.zeros(tracks, np.bool_)
    solve(miss, columns - 1, row, col, w, budget, p, p_miss, approximate)
    result[:, 0] = p_miss
    for k in range(count):
        result[row[k], col[k] + 1] = p[k]


@njit(cache=True, nogil=True, error_model="numpy")
def solve(
    miss: Array,
    columns: int,
    row: Ints,
    col: Ints,
    w: Array,
    budget: float,
    p: Array,
    p_miss: Array,
    approximate: Any,
) -> None:
    """The sparse problem: `miss` (tracks,) and the pairs `row`, `col`, `w` (pairs,), rows ascending.

    Fills `p` (pairs,), `p_miss` (tracks,) and `approximate` (tracks,) for the tracks whose cluster
    was past the budget.
    """
    tracks, pairs = miss.size, row.size
    ratio = np.empty(pairs)
    largest = miss.copy()
    for k in range(pairs):
        largest[row[k]] = max(largest[row[k]], w[k])
    for k in range(pairs):
        ratio[k] = w[k] / max(miss[row[k]], _LEAST_MISS * largest[row[k]])
    label = _components(tracks, columns, row, col)
    order = np.argsort(label, kind="mergesort")  # tracks of one component stand together
    first = np.searchsorted(row, np.arange(tracks + 1))
    column_name = np.full(columns, -1, np.int64)
    begin = 0
    while begin < tracks:
        stop = begin + 1
        while stop < tracks and label[order[stop]] == label[order[begin]]:
            stop += 1
        members = order[begin:stop]
        begin = stop
        size = 0
        for t in members:
            size += first[t + 1] - first[t]
        if size == 0:
            p_miss[members[0]] = 1.0
            continue
        if members.size == 1:
            _single(members[0], first, ratio, p, p_miss)
            continue
        start, local, r = np.zeros(members.size + 1, np.int64), np.empty(size, np.int64), np.empty(size)
        used, n = 0, 0
        for i in range(members.size):
            for k in range(first[members[i]], first[members[i] + 1]):
                if column_name[col[k]] < 0:
                    column_name[col[k]] = used
                    used += 1
                local[n], r[n] = column_name[col[k]], ratio[k]
                n += 1
            start[i + 1] = n
        q = np.empty(size)
        rough = _cluster(start, local, r, used, budget, q)
        n = 0
        for i in range(members.size):
            total = 0.0
            for k in range(first[members[i]], first[members[i] + 1]):
                p[k] = q[n]
                total += q[n]
                n += 1
            p_miss[members[i]] = max(1.0 - total, 0.0)
            approximate[members[i]] = rough


@njit(cache=True, nogil=True, error_model="numpy")
def _components(tracks: int, columns: int, row: Ints, col: Ints) -> Ints:
    """The lowest track of each track's component, by union-find."""
    parent = np.arange(tracks)
    seen = np.full(columns, -1, np.int64)
    for k in range(row.size):
        if seen[col[k]] < 0:
            seen[col[k]] = row[k]
        else:
            a, b = find(parent, row[k]), find(parent, seen[col[k]])
            parent[max(a, b)] = min(a, b)
    for t in range(tracks):
        parent[t] = find(parent, t)
    return parent


@njit(cache=True, nogil=True)
def find(parent: Ints, i: int) -> int:
    """The root of `i`; shortens the path on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def _single(t: int, first: Ints, ratio: Array, p: Array, p_miss: Array) -> None:
    """A track that shares nothing."""
    largest = 1.0
    for k in range(first[t], first[t + 1]):
        largest = max(largest, ratio[k])
    total = 1.0 / largest
    for k in range(first[t], first[t + 1]):
        total += ratio[k] / largest
    for k in range(first[t], first[t + 1]):
        p[k] = ratio[k] / largest / total
    p_miss[t] = 1.0 / largest / total


@njit(cache=True, nogil=True, error_model="numpy")
def _cluster(start: Ints, col: Ints, r: Array, columns: int, budget: float, p: Array) -> bool:
    """One component; True if it was approximated."""
    rows, pairs = start.size - 1, col.size
    start2 = np.zeros(columns + 1, np.int64)  # the same matrix by columns
    for k in range(pairs):
        start2[col[k] + 1] += 1
    start2 = np.cumsum(start2)
    fill = start2[:-1].copy()
    col2, r2, where = np.empty(pairs, np.int64), np.empty(pairs), np.empty(pairs, np.int64)
    for i in range(rows):
        for k in range(start[i], start[i + 1]):
            n = fill[col[k]]
            fill[col[k]] += 1
            col2[n], r2[n], where[n] = i, r[k], k
    order, order2 = np.empty(rows, np.int64), np.empty(columns, np.int64)
    cost = _plan(start, col, start2, col2, order)
    cost2 = _plan(start2, col2, start, col, order2)
    if min(cost, cost2) > budget:
        _propagate(start, col, r, columns, p)
        return True
    if cost <= cost2:
        _eliminate(start, col, r, columns, order, p)
    else:
        p2 = np.empty(pairs)
        _eliminate(start2, col2, r2, rows, order2, p2)
        for n in range(pairs):
            p[where[n]] = p2[n]
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _plan(start: Ints, col: Ints, start2: Ints, col2: Ints, order: Ints) -> float:
    """Fill the order of rows that keeps the state narrow, greedily; the cost of the exact sum."""
    rows, columns = start.size - 1, start2.size - 1
    left = np.empty(columns, np.int64)
    for c in range(columns):
        left[c] = start2[c + 1] - start2[c]
    live = np.zeros(columns, np.bool_)
    done, near = np.zeros(rows, np.bool_), np.zeros(rows, np.bool_)
    width, cost = 0, 0.0
    for n in range(rows):
        best, best_width = -1, 0
        for any_row in range(2):  # first the neighbours of the live columns, else any row
            for i in range(rows):
                if done[i] or not (near[i] or any_row):
                    continue
                after = width
                for k in range(start[i], start[i + 1]):
                    c = col[k]
                    if left[c] == 1:
                        after -= live[c]
                    else:
                        after += not live[c]
                if best < 0 or after < best_width:
                    best, best_width = i, after
            if best >= 0:
                break
        order[n], done[best] = best, True
        cost += (start[best + 1] - start[best] + 1) * math.ldexp(1.0, min(width, 1000))
        for k in range(start[best], start[best + 1]):
            c = col[k]
            left[c] -= 1
            if not live[c]:
                live[c] = True
                for m in range(start2[c], start2[c + 1]):
                    near[col2[m]] = True
        width = best_width
        if width > _WIDEST:
            return math.inf
    return cost


@njit(cache=True, nogil=True, error_model="numpy")
def _eliminate(start: Ints, col: Ints, r: Array, columns: int, order: Ints, p: Array) -> None:
    """Forward and backward sums over the rows; a state is the set of taken columns, as bits."""
    rows, pairs = start.size - 1, col.size
    left = np.zeros(columns, np.int64)
    for k in range(pairs):
        left[col[k]] += 1
    private = left == 1  # used by one row only: a part of that row's free choice
    bit = np.zeros(pairs, np.int64)
    held = np.zeros(columns, np.int64)
    before, ends = np.zeros(rows + 1, np.int64), np.zeros(rows, np.int64)
    offset = np.zeros(rows + 2, np.int64)
    offset[1] = 1
    mask = 0
    for n in range(rows):
        i = order[n]
        for k in range(start[i], start[i + 1]):
            c = col[k]
            if private[c]:
                continue
            if held[c] == 0:
                held[c] = ~mask & (mask + 1)  # the lowest bit that is free
                mask |= held[c]
            bit[k] = held[c]
            left[c] -= 1
            if left[c] == 0:
                ends[n] |= held[c]
        mask &= ~ends[n]
        before[n + 1] = mask
        size = 1
        while size <= mask:
            size *= 2
        offset[n + 2] = offset[n + 1] + size

    free = np.ones(rows)
    for i in range(rows):
        for k in range(start[i], start[i + 1]):
            if private[col[k]]:
                free[i] += r[k]

    forward = np.zeros(offset[rows + 1])
    forward[0] = 1.0
    for n in range(rows):
        i = order[n]
        source, sink = forward[offset[n] :], forward[offset[n + 1] : offset[n + 2]]
        s = 0
        while True:
            a = source[s]
            if a > 0.0:
                sink[s & ~ends[n]] += a * free[i]
                for k in range(start[i], start[i + 1]):
                    if bit[k] and not s & bit[k]:
                        sink[(s | bit[k]) & ~ends[n]] += a * r[k]
            s = ((s | ~before[n]) + 1) & before[n]
            if s == 0:
                break
        sink /= sink.max()

    widest = 1
    for n in range(rows + 1):
        widest = max(widest, offset[n + 1] - offset[n])
    behind, ahead = np.zeros(widest), np.zeros(widest)
    ahead[0] = 1.0
    for n in range(rows - 1, -1, -1):
        i = order[n]
        source = forward[offset[n] :]
        for k in range(start[i], start[i + 1]):
            p[k] = 0.0
        total, largest = 0.0, 0.0
        s = 0
        while True:
            g = free[i] * ahead[s & ~ends[n]]
            total += source[s] * g
            for k in range(start[i], start[i + 1]):
                if bit[k] and not s & bit[k]:
                    h = r[k] * ahead[(s | bit[k]) & ~ends[n]]
                    p[k] += source[s] * h
                    g += h
            behind[s] = g
            largest = max(largest, g)
            s = ((s | ~before[n]) + 1) & before[n]
            if s == 0:
                break
        free_total = total
        for k in range(start[i], start[i + 1]):
            total += p[k]
        for k in range(start[i], start[i + 1]):
            p[k] = free_total * r[k] / free[i] / total if bit[k] == 0 else p[k] / total
        s = 0
        while True:
            behind[s] /= largest
            s = ((s | ~before[n]) + 1) & before[n]
            if s == 0:
                break
        behind, ahead = ahead, behind


@njit(cache=True, nogil=True, error_model="numpy")
def _propagate(start: Ints, col: Ints, r: Array, columns: int, p: Array) -> None:
    """Loopy belief propagation; it always converges."""
    rows, pairs = start.size - 1, col.size
    to_track, to_plot, heard = np.ones(pairs), np.empty(pairs), np.empty(columns)
    for _ in range(_SWEEPS):
        heard[:] = 1.0
        for i in range(rows):
            total = 1.0
            for k in range(start[i], start[i + 1]):
                total += r[k] * to_track[k]
            for k in range(start[i], start[i + 1]):
                # What is left without this pair; never below the miss's 1, whatever rounding does.
                to_plot[k] = r[k] / max(total - r[k] * to_track[k], 1.0)
                heard[col[k]] += to_plot[k]
        change = 0.0
        for k in range(pairs):
            message = 1.0 / max(heard[col[k]] - to_plot[k], 1.0)
            change = max(change, abs(message - to_track[k]))
            to_track[k] = message
        if change < _CLOSE:
            break
    for i in range(rows):
        total = 1.0
        for k in range(start[i], start[i + 1]):
            total += r[k] * to_track[k]
        for k in range(start[i], start[i + 1]):
            p[k] = r[k] * to_track[k] / total
