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
from radar_console.tracker.association import elimination, grouping, pairs, propagation
from radar_console.tracker.association.grouping import Claims, Cluster, Places
from radar_console.tracker.association.pairs import Ints, Side
from radar_console.tracker.kernels import bare, inlined

BUDGET = 8.0e6
"""Steps of one call, about 1 ns each, beyond which clusters are approximated.

Counted are the exact sums, the search for their order, and something for each pair, so that the time of a
call has a bound.
"""

MOST_PAIRS = 125_000
"""Pairs of shared plots, many times a radar's, beyond which none of a call's clusters is summed exactly.

Spread over so much memory, a step takes several nanoseconds.
"""

_SWEEPS = 200
_MESSAGES = 2.0e6  # of a call's belief propagation, about 3 ns each
_SPOKEN = 8.0  # messages that each track takes besides those of its pairs
_BLOCK = 128  # weights of a dense row that are looked at together; less than 256
_INDEX = np.dtype(np.int64)
_CHECKED = 512  # pairs that are checked together
_PASS, _TRACK, _LOOK = 16.0, 30.0, 3.0  # steps that a pair, a track and a look in a plan take besides
_PAIRWISE = 4  # plots, up to which the sum of two tracks is written out; no second plan is made there
_USUAL = 256  # pairs of a cluster; for larger ones room is made when they come
_FEW = 4  # sweeps that cost less than to look for clusters
_CHEAP = 256.0  # steps for which it is not worth while to look for a cheaper way

_starts, _divide, find = pairs.starts, pairs.divide, pairs.find
_FAR, _AHEAD = grouping.FAR, grouping.AHEAD
_count_claims, _components, _room, _touch, _gather = (
    grouping.count_claims, grouping.components, grouping.room, grouping.touch, grouping.gather,
)  # fmt: skip
_work, _plan, _eliminate = elimination.work, elimination.plan, elimination.eliminate
_price_of_two, _add_up_two = elimination.price_of_two, elimination.add_up_two
_WIDEST = elimination.WIDEST
_messages, _propagate, _propagate_once, _propagate_all = (
    propagation.messages, propagation.propagate, propagation.propagate_once, propagation.propagate_all,
)  # fmt: skip


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
    # In vectors, as fast as memory delivers. Of the integers only signs are collected: differences do not
    # overflow before something is negative.
    highest, sign = columns - 1, 0
    for begin in range(0, row.size, _CHECKED):
        r, c, x = (
            row[max(begin - 1, 0) : begin + _CHECKED],
            col[begin : begin + _CHECKED],
            w[begin : begin + _CHECKED],
        )
        for k in range(1, r.size):
            sign |= r[k] | (r[k] - r[k - 1])
        unsound = 0
        for k in range(x.size):
            sign |= c[k] | (highest - c[k])
            unsound += not ((x[k] >= 0.0) & (x[k] < math.inf))
        if sign < 0 or unsound > 0:
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

    `approximate` are at first all tracks that share plots; those leave whom the exact sums reach. Up to a
    million pairs, fresh memory and another pass cost as much as a sweep: hence what is done in place.
    """
    _divide(miss, start, w, p)
    every = Side(start, col, p)
    claims, count = _count_claims(col, columns)
    sharing = _set_apart(every, claims, p_miss, approximate)
    if sharing == 0:
        return
    left, sweeps = budget - _PASS * count, _sweeps(count, sharing)
    folded = left >= 0.0
    if not folded:
        sweeps = _sweeps(col.size, _with_pairs(start))
    elif count > MOST_PAIRS or _too_wide(every, claims):
        left = 0.0
    if left > 0.0 or sweeps > _FEW:
        members, begin, number = _components(every, claims)
        if left > 0.0:
            _add_up_clusters(members, begin, every, claims, count, number, left, p_miss, approximate)
        if sweeps > _FEW:
            _propagate_clusters(members, begin, every, claims, folded, sweeps, p_miss, approximate)
            return
    if sweeps > 1:
        _propagate_rest(every, claims, folded, sweeps, p_miss, approximate)
    elif np.any(approximate):
        _propagate_once(every, claims, folded, approximate, p_miss)


@bare
def _set_apart(every: Side, claims: Claims, p_miss: Array, approximate: Any) -> int:
    """Give the tracks that share no plot their probabilities; mark the others, and say how many."""
    sharing = 0
    for t in range(approximate.size):
        k, end, free = every.start[t], every.start[t + 1], 1.0
        while k < end and claims[np.uint64(every.other[np.uint64(k)])] == 1:  # see `propagation`
            free += every.ratio[np.uint64(k)]
            k += 1
        approximate[t] = k < end
        sharing += k < end
        if k == end:
            _leave(t, every, free, p_miss)
    return sharing


@bare
def _leave(t: int, every: Side, free: float, p_miss: Array) -> None:
    """Of a track that shares no plot: the probabilities, of ratios that make `free` with the miss's 1."""
    rest = 1.0 / free
    p_miss[t] = rest
    for k in range(every.start[t], every.start[t + 1]):
        every.ratio[k] *= rest


@bare
def _leave_alone(t: int, every: Side, p_miss: Array, approximate: Any) -> None:
    """The same of the only track of a cluster: a plot was given twice."""
    free = 1.0
    for k in range(every.start[t], every.start[t + 1]):
        free += every.ratio[k]
    _leave(t, every, free, p_miss)
    approximate[t] = False


@njit(cache=True, nogil=True)
def _with_pairs(start: Ints) -> int:
    count = 0
    for t in range(start.size - 1):
        count += start[t + 1] > start[t]
    return count


@njit(cache=True, nogil=True, fastmath={"reassoc", "nsz"})
def _rest(p: Array) -> float:
    """Of the probability, what a track's pairs leave."""
    total = 0.0
    for k in range(p.size):
        total += p[k]
    return max(1.0 - total, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _propagate_rest(
    every: Side, claims: Claims, folded: bool, sweeps: int, p_miss: Array, approximate: Any
) -> None:
    """Belief propagation over all tracks that are `approximate`, as if they were one cluster.

    They need no folding.
    """
    tracks, plots = np.empty(approximate.size, np.int64), np.empty(claims.size, np.int64)
    n = m = 0
    for t in range(tracks.size):
        if approximate[t]:
            tracks[n] = t
            n += 1
    if n == 0:
        return
    for c in range(plots.size):
        if claims[c] > 0:
            plots[m] = c
            m += 1
    _propagate(tracks[:n], every, plots[:m], claims, folded, sweeps, _messages(every, claims.size), p_miss)


@njit(cache=True, nogil=True, error_model="numpy")
def _propagate_clusters(
    members: Ints,
    begin: Ints,
    every: Side,
    claims: Claims,
    folded: bool,
    sweeps: int,
    p_miss: Array,
    approximate: Any,
) -> None:
    """The same, cluster by cluster: each ends when its own messages have converged."""
    plots, listed = np.empty(0, np.int64), np.empty(0, np.bool_)
    scratch = _messages(every, 0)
    for g in range(begin.size - 1):
        group = members[begin[g] : begin[g + 1]]
        if not approximate[group[0]]:
            continue
        if group.size == 1:
            _leave_alone(group[0], every, p_miss, approximate)
            continue
        if plots.size == 0:
            plots, listed = np.empty(claims.size, np.int64), np.zeros(claims.size, np.bool_)
            scratch = _messages(every, claims.size)
        n = _list_plots(group, every, listed, plots)
        _propagate(group, every, plots[:n], claims, folded, sweeps, scratch, p_miss)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_up_clusters(
    members: Ints,
    begin: Ints,
    every: Side,
    claims: Claims,
    count: int,
    number: Places,
    left: float,
    p_miss: Array,
    approximate: Any,
) -> None:
    """Sum the clusters exactly, for which the steps that are `left` suffice; they are not `approximate`."""
    size = min(count, _USUAL)
    most = size  # tracks, or plots; of these each has two pairs or more
    cluster, work, work2 = _room(most, size), _work(most, size), _work(most, size)
    ordinal, store = np.arange(most), np.empty(1024)
    touched, ahead = np.empty(1), 0
    for g in range(begin.size - 1):
        if begin[g + 1] - begin[g] == 1:
            _leave_alone(members[begin[g]], every, p_miss, approximate)
            continue
        if left <= 0.0:
            continue
        group = members[begin[g] : begin[g + 1]]
        if claims.size > _FAR and begin[g + 1] > ahead:
            touched[0] = _touch(members, begin[g], every, claims, number)
            ahead = begin[g] + _AHEAD
        needed = 0
        for t in group:
            needed += every.start[t + 1] - every.start[t]
        patience = 0.5 * left / _LOOK
        if needed > patience and _TRACK * group.size >= left and _shared(group, every, claims) > patience:
            left = 0.0  # a plan looks at each pair: both would fail, and to begin one costs what is left
            continue
        if needed > size or group.size > most:
            size, most = max(needed, size), max(group.size, needed // 2, most)
            cluster, work, work2 = _room(most, size), _work(most, size), _work(most, size)
            ordinal = np.arange(most)
        by_track, by_plot = cluster.tracks, cluster.plots
        n = _gather(group, every, claims, number, cluster)
        if group.size == 2 and n <= _PAIRWISE and by_plot.start[n] == 2 * n:
            cost, looked = _price_of_two(n)
            if cost <= left and looked <= patience:
                left -= 2.0 * _TRACK + _LOOK * looked + cost
                _add_up_two(n, cluster)
                _hand_out(group, every, claims, cluster, p_miss, approximate)
                continue
        cost2, room2, looked2 = math.inf, 0, 0.0
        cost, room, looked = _plan(ordinal[: group.size], by_track, by_plot, left, patience, work)
        if cost > _CHEAP:
            cost2, room2, looked2 = _plan(ordinal[:n], by_plot, by_track, min(left, cost), patience, work2)
        spent = _TRACK * group.size + _LOOK * (looked + looked2)
        if min(cost, cost2) > left:
            left -= spent
            continue
        left -= spent + min(cost, cost2)
        if max(room, room2) > store.size:
            store = np.empty(max(room, room2))
        if cost <= cost2:
            _eliminate(group.size, by_track, by_plot, work, store)
        else:
            _eliminate(n, by_plot, by_track, work2, store)
            for k in range(by_plot.start[n]):
                by_track.ratio[cluster.place[k]] = by_plot.ratio[k]
        _hand_out(group, every, claims, cluster, p_miss, approximate)


@inlined
def _shared(group: Ints, every: Side, claims: Claims) -> int:
    """Pairs of a cluster, without those of plots of one track."""
    count = 0
    for t in group:
        for k in range(every.start[t], every.start[t + 1]):
            count += claims[every.other[k]] > 1
    return count


@inlined
def _hand_out(
    group: Ints, every: Side, claims: Claims, cluster: Cluster, p_miss: Array, approximate: Any
) -> None:
    """Write the probabilities of a cluster to its pairs and tracks."""
    n = 0
    for i in range(group.size):
        t = group[i]
        rest = _rest(cluster.tracks.ratio[cluster.tracks.start[i] : cluster.tracks.start[i + 1]])
        rest /= cluster.free[i]  # of the track's miss; its own plots take their shares of it
        p_miss[t], approximate[t] = rest, False
        for k in range(every.start[t], every.start[t + 1]):
            if claims[every.other[k]] == 1:
                every.ratio[k] *= rest
            else:
                every.ratio[k] = cluster.tracks.ratio[n]
                n += 1


@njit(cache=True, nogil=True)
def _sweeps(pairs: int, tracks: int) -> int:
    """How often belief propagation may go over so many pairs."""
    return min(_SWEEPS, max(round(_MESSAGES / (pairs + _SPOKEN * tracks)), 1))


@njit(cache=True, nogil=True)
def _too_wide(every: Side, claims: Claims) -> bool:
    """Every track and every plot alone makes more columns live than the exact sum can have."""
    for t in range(every.start.size - 1):
        shared = 0
        for k in range(every.start[t], every.start[t + 1]):
            shared += claims[every.other[k]] > 1
            if shared > _WIDEST:
                break
        if 0 < shared <= _WIDEST:
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
