"""Joint probabilistic data association: exact by dynamic programming, else belief propagation.

A feasible event is a matching between tracks and measurements; its weight is the product of the
ratios r = likelihood / miss weight over the matched pairs. A measurement that only one track gates is
folded into that track's miss. What remains falls into clusters; each is summed over its tracks or
over its measurements, whichever costs less, or is approximated when both are past the budget.

Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §6.2 (the probabilities).
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association import elimination, pairs, propagation
from radar_console.tracker.association.pairs import Ints, Side

BUDGET = 8.0e6
"""Steps of one call, about 1 ns each, beyond which clusters are approximated.

Counted are the exact sums, the search for their order, and something for each pair, so that the time of a
call has a bound: half a million pairs whose plots are shared take it all.
"""

_SWEEPS = 200
_MESSAGES = 2.0e6  # of a call's belief propagation, about 3 ns each
_SPOKEN = 8.0  # messages that each track takes besides those of its pairs
_BLOCK = 128  # weights of a dense row that are looked at together; less than 256
_INDEX = np.dtype(np.int64)
_CHECKED = 512  # pairs that are checked together
_PASS, _TRACK, _LOOK = 16.0, 30.0, 3.0  # steps that a pair, a track and a look in a plan take besides
_CHEAP = 256.0  # steps for which it is not worth while to look for a cheaper way

_starts, _divide, find = pairs.starts, pairs.divide, pairs.find
_work, _plan, _eliminate = elimination.work, elimination.plan, elimination.eliminate
_WIDEST = elimination.WIDEST
_messages, _propagate, _propagate_all = propagation.messages, propagation.propagate, propagation.propagate_all


class Marginals(NamedTuple):
    """Probability of each pair (pairs,) and of each track's miss (tracks,); whose are approximate."""

    p: Array
    p_miss: Array
    approximate: NDArray[np.bool_]


def marginals(likelihood: Array, budget: float = BUDGET) -> Array:
    """Probability of each origin of each measurement, over all feasible events.

    Parameters
    ----------
    likelihood : (tracks, measurements + 1)  column 0 the miss weight 1 - P_D P_G; entry [t, j + 1]
        P_D N(z_j) / λ, and 0 outside the gate
    budget : steps of the exact sums; clusters beyond it are approximated

    Returns
    -------
    (tracks, measurements + 1)   rows sum to 1

    Raises
    ------
    ValueError      a weight is negative or not finite
    """
    weights = np.ascontiguousarray(likelihood, dtype=float)
    result = np.zeros(weights.shape)
    if not _dense(weights, budget, result):
        raise ValueError("expected finite weights that are not negative")
    return result


def sparse(miss: Array, columns: int, row: Ints, col: Ints, w: Array, budget: float = BUDGET) -> Marginals:
    """The same from the pairs inside the gates alone: `solve`, with its arrays checked and made.

    Parameters
    ----------
    miss : (tracks,)   weight of no measurement, 1 - P_D P_G
    columns : number of measurements
    row, col : (pairs,)   track, ascending, and measurement of each pair
    w : (pairs,)   P_D N(z) / λ

    Raises
    ------
    ValueError      a weight is negative or not finite, or a pair is out of range or order
    """
    tracks, count = len(miss), len(row)
    if not (col.flags.carray and col.dtype is _INDEX):
        col = np.array(col, _INDEX)  # or all kernels are compiled for it, too
    p, p_miss, approximate = np.empty(count), np.empty(tracks), np.zeros(tracks, np.bool_)
    if len(col) != count or len(w) != count or not _sound(miss, columns, row, col, w):
        raise ValueError("expected finite weights that are not negative, and pairs in range, rows ascending")
    solve(miss, columns, row, col, w, budget, p, p_miss, approximate)
    return Marginals(p, p_miss, approximate)


@njit(cache=True, nogil=True)
def _sound(miss: Array, columns: int, row: Ints, col: Ints, w: Array) -> bool:
    if row.size > 0 and not (0 <= row[0] and row[-1] < miss.size):
        return False
    for t in range(miss.size):
        if not 0.0 <= miss[t] < math.inf:
            return False
    for begin in range(0, row.size, _CHECKED):
        end, good = min(begin + _CHECKED, row.size), 0
        for k in range(begin, end):  # without a branch, in vectors
            good += (0 <= col[k]) & (col[k] < columns) & (w[k] >= 0.0) & (w[k] < math.inf)
        for k in range(max(begin, 1), end):
            good -= row[k - 1] > row[k]
        if good < end - begin:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _dense(weights: Array, budget: float, result: Array) -> bool:
    """Fill `result`; False if a weight is not sound."""
    tracks, columns = weights.shape
    blocks = (columns - 1 + _BLOCK - 1) // _BLOCK
    bits = weights.view(np.uint64)
    some, pairs = np.zeros((tracks, blocks), np.uint8), 0
    for t in range(tracks):
        if not 0.0 <= weights[t, 0] < math.inf:
            return False
        for b in range(blocks):
            begin, end = 1 + b * _BLOCK, min(1 + (b + 1) * _BLOCK, columns)
            whole, any_bit = bits[t, begin:end], np.uint64(0)
            for j in range(whole.size):  # as fast as memory delivers
                any_bit |= whole[j]
            if any_bit == 0:
                continue
            block, count, sound = weights[t, begin:end], 0, 0
            for j in range(block.size):
                count += block[j] != 0.0
                sound += (block[j] >= 0.0) & (block[j] < math.inf)
            if sound < block.size:
                return False
            some[t, b] = count
            pairs += count
    if pairs == tracks * (columns - 1) and min(tracks, columns - 1) > _WIDEST:
        _propagate_all(weights, _sweeps(pairs, tracks), result)
        return True
    start, col, p = np.zeros(tracks + 1, np.int64), np.empty(pairs, np.int64), np.empty(pairs)
    n = 0
    for t in range(tracks):
        for b in range(blocks):
            block = weights[t, 1 + b * _BLOCK : min(1 + (b + 1) * _BLOCK, columns)]
            last, j = n + some[t, b], 0
            while n < last:  # each weight is written, and overwritten by the next unless it counts
                col[n], p[n] = b * _BLOCK + j, block[j]
                n += block[j] != 0.0
                j += 1
        start[t + 1] = n
    p_miss, approximate = np.empty(tracks), np.zeros(tracks, np.bool_)
    _solve(weights[:, 0].copy(), columns - 1, start, col, p, budget, p, p_miss, approximate)
    for t in range(tracks):
        result[t, 0] = p_miss[t]
        for k in range(start[t], start[t + 1]):
            result[t, col[k] + 1] = p[k]
    return True


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
    was past what was left of the budget.
    """
    _solve(miss, columns, _starts(miss.size, row), col, w, budget, p, p_miss, approximate)


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(
    miss: Array,
    columns: int,
    start: Ints,
    col: Ints,
    w: Array,
    budget: float,
    p: Array,
    p_miss: Array,
    approximate: Any,
) -> None:
    """`solve` for pairs start[t]:start[t + 1] of each track t; `p` may be `w`.

    Up to a million pairs, fresh memory and another pass cost as much as a sweep: hence what is done in place.
    """
    approximate[:] = False
    _divide(miss, start, w, p)
    claims = np.zeros(columns, np.int64)
    for k in range(col.size):
        claims[col[k]] += 1
    count = 0
    for c in range(columns):
        count += int(claims[c]) if claims[c] > 1 else 0
    # All pairs as they are where there are no others, or so many that they are to be approximated: belief
    # propagation needs no folding.
    if count == col.size or _PASS * count > budget:
        every = Side(start, col, p)
        _clusters(every, claims, budget, approximate)
        for t in range(miss.size):
            p_miss[t] = _rest(p[start[t] : start[t + 1]])
        return
    by_track, free = shared(start, col, p, claims, count)
    _clusters(by_track, claims, budget, approximate)
    n = 0
    for t in range(miss.size):
        rest = _rest(by_track.ratio[by_track.start[t] : by_track.start[t + 1]])
        rest /= free[t]  # of the track's miss; its own plots take their shares of it
        p_miss[t] = rest
        for k in range(start[t], start[t + 1]):
            if claims[col[k]] == 1:
                p[k] *= rest
            else:
                p[k] = by_track.ratio[n]
                n += 1


@njit(cache=True, nogil=True, fastmath={"reassoc", "nsz"})
def _rest(p: Array) -> float:
    """Of the probability, what a track's pairs leave."""
    total = 0.0
    for k in range(p.size):
        total += p[k]
    return max(1.0 - total, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def shared(start: Ints, col: Ints, ratio: Array, claims: Ints, count: int) -> tuple[Side, Array]:
    """The `count` pairs of plots that several tracks gate, their ratios to its miss and own plots together.

    Also returns that weight `free` (tracks,) of miss and own plots.
    """
    tracks = start.size - 1
    free = np.ones(tracks)
    # One place more: each pair is written, and overwritten by the next unless it is shared.
    begin, other, rest = np.zeros(tracks + 1, np.int64), np.empty(count + 1, np.int64), np.empty(count + 1)
    n = 0
    for t in range(tracks):
        for k in range(start[t], start[t + 1]):
            own = claims[col[k]] == 1
            other[n], rest[n] = col[k], ratio[k]
            n += not own
            free[t] += ratio[k] if own else 0.0
        begin[t + 1] = n
        for k in range(begin[t], n):
            rest[k] /= free[t]
    return Side(begin, other[:count], rest[:count]), free


@njit(cache=True, nogil=True, error_model="numpy")
def arranged(by_track: Side, columns: int) -> tuple[Side, Ints]:
    """The same pairs by plot, and the place of each by track; of no `columns`, none."""
    pairs = by_track.other.size if columns > 0 else 0
    start = np.zeros(columns + 1, np.int64)
    for c in by_track.other[:pairs]:
        start[c + 1] += 1
    for c in range(columns):
        start[c + 1] += start[c]
    fill = start[:-1].copy()
    other, r, place = np.empty(pairs, np.int64), np.empty(pairs), np.empty(pairs, np.int64)
    for t in range(by_track.start.size - 1 if pairs > 0 else 0):
        for k in range(by_track.start[t], by_track.start[t + 1]):
            n = fill[by_track.other[k]]
            fill[by_track.other[k]] += 1
            other[n], r[n], place[n] = t, by_track.ratio[k], k
    return Side(start, other, r), place


@njit(cache=True, nogil=True, error_model="numpy")
def components(by_track: Side, columns: int) -> tuple[Ints, Ints]:
    """Tracks that share plots, one component after the other, and where each begins."""
    tracks = by_track.start.size - 1
    parent, claimant = np.arange(tracks), np.full(columns, -1, np.int64)
    for t in range(tracks):
        for c in by_track.other[by_track.start[t] : by_track.start[t + 1]]:
            if claimant[c] < 0:
                claimant[c] = t
            elif parent[t] != parent[claimant[c]]:
                a, b = find(parent, t), find(parent, claimant[c])
                parent[max(a, b)] = min(a, b)
    size = np.zeros(tracks, np.int64)
    for t in range(tracks):
        parent[t] = find(parent, t)
        size[parent[t]] += by_track.start[t + 1] > by_track.start[t]
    begin, count, total = np.empty(tracks + 1, np.int64), 0, 0
    for t in range(tracks):  # a root is the lowest of its tracks
        if size[t] > 0:
            begin[count] = total
            count += 1
            total, size[t] = total + size[t], total
    begin[count] = total
    members = np.empty(total, np.int64)
    for t in range(tracks):
        if by_track.start[t + 1] > by_track.start[t]:
            members[size[parent[t]]] = t
            size[parent[t]] += 1
    return members, begin[: count + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _clusters(by_track: Side, claims: Ints, budget: float, approximate: Any) -> None:
    """Turn the ratios into probabilities, cluster by cluster."""
    pairs, tracks, columns = by_track.other.size, by_track.start.size - 1, claims.size
    if pairs == 0:
        return
    members, begin = components(by_track, columns)
    left, sweeps = budget - _PASS * pairs, _sweeps(pairs, members.size)
    if _too_wide(by_track, claims):
        left = 0.0
    by_plot, place = arranged(by_track, columns if left > 0.0 else 0)
    work, work2 = _work(max(tracks, columns), pairs), _work(max(tracks, columns), pairs)
    plots, listed = np.empty(columns, np.int64), np.zeros(columns, np.bool_)
    store, scratch = np.empty(1024), _messages(by_track, 0)
    for g in range(begin.size - 1):
        group = members[begin[g] : begin[g + 1]]
        if group.size == 1:
            alone = by_track.ratio[by_track.start[group[0]] : by_track.start[group[0] + 1]]
            alone /= 1.0 + alone.sum()
            continue
        n = _list_plots(group, by_track, listed, plots)
        cost, cost2, room, room2, looked2, spent = math.inf, math.inf, 0, 0, 0.0, 0.0
        if left > 0.0:
            patience = 0.5 * left / _LOOK
            cost, room, looked = _plan(group, by_track, by_plot, left, patience, work)
            if cost > _CHEAP:
                cost2, room2, looked2 = _plan(plots[:n], by_plot, by_track, min(left, cost), patience, work2)
            spent = _TRACK * group.size + _LOOK * (looked + looked2)
        if min(cost, cost2) > left:
            left -= spent
            if scratch.heard.size == 0:
                scratch = _messages(by_track, columns)
            _propagate(group, by_track, plots[:n], sweeps, scratch)
            for t in group:
                approximate[t] = True
            continue
        left -= spent + min(cost, cost2)
        if max(room, room2) > store.size:
            store = np.empty(max(room, room2))
        if cost <= cost2:
            _eliminate(group.size, by_track, by_plot, work, store)
            continue
        _eliminate(n, by_plot, by_track, work2, store)
        for c in plots[:n]:
            for k in range(by_plot.start[c], by_plot.start[c + 1]):
                by_track.ratio[place[k]] = by_plot.ratio[k]


@njit(cache=True, nogil=True)
def _sweeps(pairs: int, tracks: int) -> int:
    """How often belief propagation may go over so many pairs."""
    return min(_SWEEPS, max(round(_MESSAGES / (pairs + _SPOKEN * tracks)), 1))


@njit(cache=True, nogil=True)
def _too_wide(by_track: Side, claims: Ints) -> bool:
    """Every track and every plot alone makes more columns live than the exact sum can have."""
    for t in range(by_track.start.size - 1):
        if 0 < by_track.start[t + 1] - by_track.start[t] <= _WIDEST:
            return False
    narrow = 0
    for c in range(claims.size):
        narrow += 1 < claims[c] <= _WIDEST
    return narrow == 0


@njit(cache=True, nogil=True)
def _list_plots(group: Ints, by_track: Side, listed: NDArray[np.bool_], plots: Ints) -> int:
    """Fill `plots` with those of a cluster; how many."""
    n = 0
    for t in group:
        for c in by_track.other[by_track.start[t] : by_track.start[t + 1]]:
            if not listed[c]:
                listed[c] = True
                plots[n] = c
                n += 1
    return n
