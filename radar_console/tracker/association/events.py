"""Joint association events drawn from their distribution: who has which plot, all tracks at once.

The elimination's sums up to each row are kept; from the last row back, each draw's choice then follows
from those of the rows after it (forward filtering, backward sampling).

Source: the events of Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §6.2.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation import draws
from radar_console.estimation.gaussian import Array
from radar_console.tracker.association import elimination, grouping, pairs
from radar_console.tracker.association.grouping import Claims
from radar_console.tracker.association.pairs import Ints, Side

NOTHING = -1
"""The choice of a track that has no plot."""

_mix, _uniforms = draws.mix, draws.uniforms
_starts, _divide = pairs.starts, pairs.divide
_count_claims, _by_plot, _components = grouping.count_claims, grouping.arranged, grouping.components
Work = elimination.Work
_work, _plan, _add_up = elimination.work, elimination.plan, elimination.add_up

_BUDGET = 1.0e5  # steps of the sums of one component, about 1 ns each
_UNKNOWN = -1

Choices = NDArray[np.int32]


@njit(cache=True, nogil=True, error_model="numpy")
def draw(
    miss: Array, columns: int, row: Ints, col: Ints, w: Array, key: Any, choice: Choices, known: Any
) -> None:
    """Draw joint events of the sparse problem of `pairs`.

    Parameters
    ----------
    miss : (tracks,)   weight of no plot, 1 - P_D P_G
    columns : number of plots
    row, col, w : (pairs,)   track, ascending, and plot of each pair, P_D N(z) / λ
    key : of the random numbers
    choice : (tracks, draws)   filled with the place of each track's pair, or NOTHING
    known : (tracks,) bool   filled: the track shares plots with others, and the sums over its component are
        affordable; the choices of the other tracks are left as they are
    """
    tracks, count = miss.size, choice.shape[1]
    known[:] = False
    first, ratio = _starts(tracks, row), np.empty(row.size)
    _divide(miss, first, w, ratio)
    claims, common = _count_claims(col, columns)
    if common == 0:
        return
    by_track, free = _shared(first, col, ratio, claims, common)
    by_plot = _by_plot(by_track, columns)
    members, begin, _ = _components(by_track, claims)
    work = _work(max(tracks, columns), by_track.other.size)
    lot = np.empty(count, np.float32)
    for g in range(begin.size - 1):
        group = members[begin[g] : begin[g + 1]]
        cost, room, _ = _plan(group, by_track, by_plot, _BUDGET, _BUDGET, work)
        if not cost <= _BUDGET:
            continue
        store = np.empty(room)
        tables = _add_up(group.size, by_track, by_plot, work, store)
        state = np.zeros(count, np.int64)
        end = 0
        for n in range(group.size):
            end += 1 << work.width[n]
        for n in range(group.size - 1, -1, -1):
            t = work.order[n]
            size = 1 << work.width[n]
            end -= size
            key = _mix(key)
            _uniforms(key, lot)
            _go_back(n, tables[end : end + size], by_track, work, lot, state, choice[t])
            _name(t, by_track, col, claims, ratio, free[t], first, lot, choice[t])
            known[t] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _shared(start: Ints, col: Ints, ratio: Array, claims: Claims, count: int) -> tuple[Side, Array]:
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
def _go_back(n: int, now: Array, rows: Side, work: Work, lot: Any, state: Ints, choice: Choices) -> None:
    """Draw the choice of the n-th row (which of its pairs, or NOTHING), and the state before it.

    `now` are the sums before the row, `state` (draws,) the states after it. The share of the draw's
    uniform number inside the alternative is left in `lot`, for what is still to be drawn.
    """
    i = work.order[n]
    begin, degree = rows.start[i], rows.start[i + 1] - rows.start[i]
    lo, hi = work.last[n], work.last[n + 1]
    fills, ways = 1 << (hi - lo), (1 << (hi - lo)) * (degree + 1)
    built = np.full(1 << work.width[n + 1], _UNKNOWN, np.int64)
    room, used = 8, 0
    weight, before, what = (
        np.empty((room, ways)),
        np.empty((room, ways), np.int64),
        np.empty((room, ways), np.int32),
    )
    for a in range(state.size):
        place = built[state[a]]
        if place == _UNKNOWN:
            if used == room:
                weight = np.concatenate((weight, np.empty((room, ways))))
                before = np.concatenate((before, np.empty((room, ways), np.int64)))
                what = np.concatenate((what, np.empty((room, ways), np.int32)))
                room *= 2
            place = built[state[a]] = used
            used += 1
            m, total = 0, 0.0
            for fill in range(fills):
                full = state[a]
                for e in range(hi - 1, lo - 1, -1):  # put the columns back that were summed out
                    b = work.ended[e]
                    low = full & ((1 << b) - 1)
                    full = ((full >> b) << (b + 1)) | (((fill >> (e - lo)) & 1) << b) | low
                for k in range(-1, degree):
                    s, r = full, 1.0
                    if k >= 0:
                        bit = 1 << work.spot[begin + k]
                        s, r = full ^ bit, rows.ratio[begin + k]
                        if full & bit == 0:
                            r = 0.0
                    total += r * now[s] if s < now.size else 0.0
                    weight[place, m], before[place, m], what[place, m] = total, s, k
                    m += 1
        w = weight[place]
        u = lot[a] * w[ways - 1]
        m = 0
        while m < ways - 1 and w[m] <= u:
            m += 1
        while m > 0 and w[m] == w[m - 1]:  # a number of 1 must not end at what has no weight
            m -= 1
        floor = w[m - 1] if m > 0 else 0.0
        lot[a] = (u - floor) / (w[m] - floor) if w[m] > floor else 0.0
        state[a], choice[a] = before[place, m], what[place, m]


@njit(cache=True, nogil=True, error_model="numpy")
def _name(
    t: int, rows: Side, col: Ints, claims: Claims, ratio: Array, free: float, first: Ints, lot: Any,
    choice: Choices,
) -> None:  # fmt: skip
    """Turn places among a track's shared pairs into places among all; draw what no shared plot stands for.

    That is no plot at all, or one that nobody else claims.
    """
    lo, hi = first[t], first[t + 1]
    place = np.empty(rows.start[t + 1] - rows.start[t], np.int32)
    n = 0
    for k in range(lo, hi):
        if claims[col[k]] > 1:
            place[n] = k
            n += 1
    for a in range(choice.size):
        if choice[a] >= 0:
            choice[a] = place[choice[a]]
            continue
        left, k = lot[a] * free - 1.0, lo
        choice[a] = NOTHING
        while left >= 0.0 and k < hi:
            if claims[col[k]] == 1:
                left -= ratio[k]
                choice[a] = k
            k += 1


__all__ = ["NOTHING", "draw"]
