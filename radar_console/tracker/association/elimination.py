"""The exact sum over all matchings of a cluster, one row after the other.

The weight of a matching is the product of its pairs' ratios. The state is which *columns* are taken,
among the live ones: those that rows before and rows to come both claim. It is a table with one axis of
length 2 for each live column; position b of a column means that it is bit b of the table's index, so all
work runs over whole blocks of 2^b neighbours. A column gets the highest position at its first row and is
summed out after its last. So the cost grows with what overlaps at once, not with the size of the cluster.

Source: Horridge and Maskell, Real-time tracking of hundreds of targets with efficient exact JPDAF,
FUSION 2006 (the elimination; the order and the tables are ours).
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association.grouping import Cluster
from radar_console.tracker.association.pairs import Ints, Side
from radar_console.tracker.kernels import inlined

WIDEST = 24
"""Live columns beyond which no plan is made: 2^24 numbers for each row."""


class Work(NamedTuple):
    """Scratch for the plan and the sum, large enough for either side of the problem."""

    left: Ints  # of each column, pairs that are still to come
    place: Ints  # of each column, its position
    line: Ints  # column at each position
    seen: Ints  # of each row: NEW, NEAR or DONE
    near: Ints  # rows that share a live column and are still to come
    order: Ints  # the rows as they are eliminated
    width: Ints  # live columns before each of them
    spot: Ints  # of each pair, its column's position in its row's table
    ended: Ints  # positions that are summed out, all rows' one after the other
    last: Ints  # where each row's part of `ended` begins


_NEW, _NEAR, _DONE = 0, 1, 2


@njit(cache=True, nogil=True)
def work(members: int, pairs: int) -> Work:
    """Scratch for up to so many members of one side, and pairs."""
    n = members + 1
    whole = np.empty(9 * n + pairs, np.int64)
    return Work(
        whole[:n],
        whole[n : 2 * n],
        whole[2 * n : 3 * n],
        whole[3 * n : 4 * n],
        whole[4 * n : 5 * n],
        whole[5 * n : 6 * n],
        whole[6 * n : 7 * n],
        whole[9 * n :],
        whole[7 * n : 8 * n],
        whole[8 * n : 9 * n],
    )


@inlined
def plan(
    members: Ints, rows: Side, columns: Side, ceiling: float, patience: float, work: Work
) -> tuple[float, int, float]:
    """Fill `work.order`: next comes always the row that leaves the fewest columns live (greedily).

    Returns the steps of plan and sum, infinite when above `ceiling` or when more than `patience` went
    into the plan; the numbers that the sum has to store; and the steps that went into the plan.
    """
    left, seen, near, order = work.left, work.seen, work.near, work.order
    first, fewest, looked = -1, 0, float(members.size)
    for i in members:
        seen[i] = _NEW
        degree = rows.start[i + 1] - rows.start[i]
        if first < 0 or degree < fewest:
            first, fewest = i, degree
    if fewest > WIDEST:
        return math.inf, 0, looked
    for i in members:
        for k in range(rows.start[i], rows.start[i + 1]):
            c = rows.other[k]
            left[c] = columns.start[c + 1] - columns.start[c]
    near[0], waiting = first, 1
    seen[first] = _NEAR
    width, peak, stored, steps = 0, 0, 1, 0.0
    for n in range(members.size):
        best, best_after, at = -1, 0, 0
        for m in range(waiting):
            i, after = near[m], width
            for k in range(rows.start[i], rows.start[i + 1]):
                c = rows.other[k]
                after += left[c] == columns.start[c + 1] - columns.start[c]
                after -= left[c] == 1
            looked += rows.start[i + 1] - rows.start[i]  # looking costs about as much as a step
            if best < 0 or after < best_after:
                best, best_after, at = i, after, m
        waiting -= 1
        near[at] = near[waiting]
        order[n], seen[best] = best, _DONE
        grown = width
        for k in range(rows.start[best], rows.start[best + 1]):
            c = rows.other[k]
            if left[c] == columns.start[c + 1] - columns.start[c]:
                grown += 1
                for m in range(columns.start[c], columns.start[c + 1]):
                    if seen[columns.other[m]] == _NEW:
                        seen[columns.other[m]] = _NEAR
                        near[waiting] = columns.other[m]
                        waiting += 1
            left[c] -= 1
        if grown > WIDEST:
            return math.inf, 0, looked
        steps += (rows.start[best + 1] - rows.start[best] + 2) * (1 << width) + (1 << grown)
        if steps + looked > ceiling or looked > patience:
            return math.inf, 0, looked
        peak, width = max(peak, grown), best_after
        stored += 1 << width
    return steps + looked, stored + 3 * (1 << peak), looked


@inlined
def price_of_two(plots: int) -> tuple[float, float]:
    """Of two tracks that share so many plots, as `plan` has it: steps of plan and sum, of the plan alone."""
    looked = 2.0 + 2.0 * plots
    return looked + (plots + 2.0 + (plots + 4.0) * (1 << plots)), looked


@inlined
def add_up_two(plots: int, cluster: Cluster) -> None:
    """Turn the ratios of two tracks that share all their plots into probabilities: the sum, written out.

    A track has plot i with weight r_i (1 + the other track's ratios of other plots): no differences.
    """
    ratio, r = cluster.tracks.ratio, cluster.plots.ratio
    total = 1.0
    for i in range(plots):
        rest, rest2 = 1.0, 1.0
        for j in range(plots):
            if j != i:
                rest += r[2 * j]
                rest2 += r[2 * j + 1]
        ratio[cluster.place[2 * i]] = r[2 * i] * rest2
        ratio[cluster.place[2 * i + 1]] = r[2 * i + 1] * rest
        total += r[2 * i] * rest2 + r[2 * i + 1]
    for k in range(2 * plots):
        ratio[k] /= total


@inlined
def _lay_out(rows_count: int, rows: Side, columns: Side, work: Work) -> int:
    """Positions of the columns at every row of `work.order`; the highest width."""
    left, place, line = work.left, work.place, work.line
    for n in range(rows_count):
        i = work.order[n]
        for k in range(rows.start[i], rows.start[i + 1]):
            c = rows.other[k]
            left[c] = columns.start[c + 1] - columns.start[c]
            place[c] = -1
    width, peak, ends = 0, 0, 0
    for n in range(rows_count):
        i = work.order[n]
        work.width[n], work.last[n] = width, ends
        for k in range(rows.start[i], rows.start[i + 1]):
            c = rows.other[k]
            if place[c] < 0:
                place[c], line[width] = width, c
                width += 1
            work.spot[k] = place[c]
            left[c] -= 1
        peak = max(peak, width)
        for b in range(width - 1, -1, -1):
            if left[line[b]] == 0:
                work.ended[ends] = b
                ends += 1
                width -= 1
                for above in range(b, width):
                    line[above] = line[above + 1]
                    place[line[above]] = above
    work.width[rows_count], work.last[rows_count] = width, ends
    return peak


@njit(cache=True, nogil=True, error_model="numpy")
def add_up(rows_count: int, rows: Side, columns: Side, work: Work, store: Array) -> Array:
    """The sums before each row of `work.order`, one table after the other, each up to a factor."""
    tables = store[2 << _lay_out(rows_count, rows, columns, work) :]
    _sum_forward(rows_count, rows, work, tables)
    return tables


@inlined
def _sum_forward(rows_count: int, rows: Side, work: Work, tables: Array) -> int:
    """Fill `tables` with the sums before each row, and where the last one, of all rows, begins."""
    tables[0] = 1.0
    begin, scale = 0, 1.0
    for n in range(rows_count):
        i, size = work.order[n], 1 << work.width[n]
        now, then = tables[begin : begin + size], tables[begin + size :]
        begin += size
        grown = size
        for k in range(rows.start[i], rows.start[i + 1]):
            grown = max(grown, 2 << work.spot[k])
        for s in range(size):
            then[s] = scale * now[s]
        then[size:grown] = 0.0
        for k in range(rows.start[i], rows.start[i + 1]):
            _take(now, size, work.spot[k], scale * rows.ratio[k], then)
        for e in range(work.last[n], work.last[n + 1]):
            grown >>= 1
            _sum_out(then, grown, work.ended[e])
        scale = 1.0 / _total(then, grown)
    return begin


@inlined
def eliminate(rows_count: int, rows: Side, columns: Side, work: Work, store: Array) -> None:
    """Turn the ratios of the rows of `work.order` into probabilities; `store` is as large as `plan` said."""
    peak = _lay_out(rows_count, rows, columns, work)
    ahead, behind = store[: 1 << peak], store[1 << peak : 2 << peak]
    tables = store[2 << peak :]
    begin = _sum_forward(rows_count, rows, work, tables)

    ahead[0] = 1.0
    grown = 1
    for n in range(rows_count - 1, -1, -1):
        i, size = work.order[n], 1 << work.width[n]
        begin -= size
        now = tables[begin : begin + size]
        for e in range(work.last[n + 1] - 1, work.last[n] - 1, -1):
            _spread(ahead, grown, work.ended[e])
            grown <<= 1
        for s in range(size):
            behind[s] = ahead[s]
        for k in range(rows.start[i], rows.start[i + 1]):
            rows.ratio[k] = _give(now, size, work.spot[k], rows.ratio[k], ahead, behind)
        total = _product(now, behind, size)
        for k in range(rows.start[i], rows.start[i + 1]):
            rows.ratio[k] /= total
        scale = 1.0 / _total(behind, size)
        for s in range(size):
            behind[s] *= scale
        ahead, behind, grown = behind, ahead, size


@njit(cache=True, nogil=True, error_model="numpy")
def _take(now: Array, size: int, b: int, r: float, then: Array) -> None:
    """Add to `then` that the row takes the column at position b, for each state where that is free."""
    half = 1 << b
    if half >= size:
        for s in range(size):
            then[half + s] += r * now[s]
    elif half == 1:
        for s in range(0, size, 2):
            then[s + 1] += r * now[s]
    elif half == 2:
        for s in range(0, size, 4):
            then[s + 2] += r * now[s]
            then[s + 3] += r * now[s + 1]
    elif half == 4:
        for s in range(0, size, 8):
            for i in range(4):
                then[s + 4 + i] += r * now[s + i]
    else:
        for s in range(0, size, 2 * half):
            for i in range(s, s + half):
                then[half + i] += r * now[i]


# Sums in any order, so that they run in vectors.
@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _give(now: Array, size: int, b: int, r: float, ahead: Array, behind: Array) -> float:
    """Add to `behind` that the row takes the column at b; the weight of all that."""
    half, weight = 1 << b, 0.0
    if half >= size:
        for s in range(size):
            h = r * ahead[half + s]
            weight += now[s] * h
            behind[s] += h
    elif half == 1:
        for s in range(0, size, 2):
            h = r * ahead[s + 1]
            weight += now[s] * h
            behind[s] += h
    elif half == 2:
        for s in range(0, size, 4):
            h, h2 = r * ahead[s + 2], r * ahead[s + 3]
            weight += now[s] * h + now[s + 1] * h2
            behind[s] += h
            behind[s + 1] += h2
    elif half == 4:
        for s in range(0, size, 8):
            for i in range(4):
                h = r * ahead[s + 4 + i]
                weight += now[s + i] * h
                behind[s + i] += h
    else:
        for s in range(0, size, 2 * half):
            for i in range(s, s + half):
                h = r * ahead[half + i]
                weight += now[i] * h
                behind[i] += h
    return weight


@njit(cache=True, nogil=True)
def _sum_out(table: Array, size: int, b: int) -> None:
    """Forget the column at position b; `size` numbers remain."""
    half = 1 << b
    for s in range(0, size, half):
        for i in range(half):
            table[s + i] = table[2 * s + i] + table[2 * s + half + i]


@njit(cache=True, nogil=True)
def _spread(table: Array, size: int, b: int) -> None:
    """The reverse: `size` numbers become twice as many, the same whether the column at b is taken or not."""
    half = 1 << b
    for s in range(size - half, -1, -half):
        for i in range(half):
            value = table[s + i]
            table[2 * s + i] = value
            table[2 * s + half + i] = value


@njit(cache=True, nogil=True, fastmath={"reassoc", "nsz"})
def _total(table: Array, size: int) -> float:
    total = 0.0
    for s in range(size):
        total += table[s]
    return total


@njit(cache=True, nogil=True, fastmath={"reassoc", "nsz"})
def _product(a: Array, b: Array, size: int) -> float:
    total = 0.0
    for s in range(size):
        total += a[s] * b[s]
    return total
