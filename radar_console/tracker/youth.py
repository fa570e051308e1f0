"""Young tracks: how they start, branch, gather evidence and are merged.

A plot that no confirmed track used starts a track. At its second plot it branches: every plot in
its gate makes a pair of its own, with its own likelihood, so a wrong one costs nothing but itself.
From the third plot on each branch is a Kalman filter with probabilistic data association, and its
score, the log-likelihood ratio of a target against clutter, grows by ln(w_0 + Σ w). Young tracks
share plots; those that come to the same last two plots are one.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.core.messages import TrackStatus
from radar_console.estimation import particle
from radar_console.estimation.kalman import predict_in_place, update_in_place
from radar_console.tracker import clusters, clutter, gating, height, management, order
from radar_console.tracker.records import (
    AUTO,
    BRANCHING,
    C_CAPPED,
    C_EXTENDED,
    C_MERGED,
    C_STARTED,
    CONFIRMED,
    N_DEAD,
    N_EDGES,
    N_OPEN,
    N_POOL,
    N_TRACKS,
    STARTER,
    TENTATIVE,
    World,
)

_BROAD = particle.BROAD
_density_of, _MARGIN = gating.density_of, gating.MARGIN
_density_at, _doubted = clutter.density_at, clutter.doubted
_evidence, _update_height = clusters.evidence, height.update
_serve, _begin, _kill, _report = management.serve, management.begin, management.kill, management.report
_confirm, _ascending = management.confirm, order.ascending
_DELETED = int(TrackStatus.DELETED)
_PRUNE = 1e-3  # of the miss: a pair that is less likely is no pair
_NOBODY, _HELD = -2, -3  # marks of a plot: no track waits for it; some do
_DENSE = 0.3  # false plots in the gate of a track's second plot, from which on clutter counts as dense
_MOST_ENDS = 8  # branches that may end on one plot
_PURGE = 0.95  # of the capacity is left when it was exceeded


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def settle(beam: Any, w: World, final: bool) -> None:
    """Serve the young tracks that the beam has passed, once no open confirmed track claims their plots."""
    size, tracks, pool, edges = w.books.size, w.tracks, w.pool, w.edges
    for p in range(size[N_POOL]):
        pool[p].awaited = False
    for k in range(size[N_EDGES]):
        edge = edges[k]
        if not edge.spent and tracks[edge.track].level == CONFIRMED and not tracks[edge.track].served:
            pool[edge.plot].awaited = True
    for level in (TENTATIVE, STARTER):
        for place in range(size[N_OPEN]):
            index = w.opened[place]
            track = tracks[index]
            if track.level != level or track.served or not track.swept:
                continue
            if not final and track.rho < track.half_width + _MARGIN + w.par.wait:
                waits, k = False, track.first
                while k >= 0 and not waits:
                    waits = pool[edges[k].plot].awaited
                    k = edges[k].next
                if waits:
                    continue
            if level == TENTATIVE:
                _settle_tentative(index, beam, w)
            else:
                _settle_starter(index, beam, w)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _settle_tentative(index: int, beam: Any, w: World) -> None:
    """Probabilistic data association of one track by itself."""
    track, pool, edges, par = w.tracks[index], w.pool, w.edges, w.par
    count, k = 0, track.first
    while k >= 0:
        count += 1
        k = edges[k].next
    miss = 1.0 - par.p_d * par.p_g
    if count == 0:
        track.score += math.log(max(miss, 1e-300))
        _serve(track, index, False, False, pool[0], math.nan, False, beam, par, w.books)
        return
    beta, chosen = np.empty(count), np.empty(count, np.int64)
    n, total, best, k = 0, miss, -1, track.first
    while k >= 0:
        plot = pool[edges[k].plot]
        # A plot that a confirmed track still waits for is left to it.
        if plot.weight > 0.0 and not plot.awaited:
            weight = par.p_d / _doubted(track, plot, par) * edges[k].density
            weight *= plot.weight * _evidence(track, plot, par)
            if weight > _PRUNE * miss:
                beta[n], chosen[n] = weight, edges[k].plot
                total += weight
                if best < 0 or weight > beta[best]:
                    best = n
                n += 1
        k = edges[k].next
    track.score += math.log(max(total, 1e-300))
    if best < 0:
        _serve(track, index, False, False, pool[0], math.nan, False, beam, par, w.books)
        return
    used = 0.0
    for j in range(n):
        beta[j] /= total
        used += beta[j]
    _update_tentative(track, beta[:n], chosen[:n], pool, par)
    _serve(track, index, used >= 0.5, True, pool[chosen[best]], beta[best], False, beam, par, w.books)


@njit(cache=True, nogil=True, error_model="numpy")
def _update_tentative(track: Any, beta: Any, chosen: Any, pool: Any, par: Any) -> None:
    """The Kalman update with alternatives; the new time is their mean by probability."""
    m = beta.size
    origin, total, t = pool[chosen[0]].t, 0.0, 0.0
    for j in range(m):
        total += beta[j]
        t += beta[j] * (pool[chosen[j]].t - origin)
    t = max(origin + (t / total if total > 0.0 else 0.0), track.t)
    predict_in_place(track.x, track.P, t - track.t, par.q)
    track.t = t
    # Each plot twice: with the noise it claims, and as an outlier.
    z, R, lag, part = np.empty((2 * m, 2)), np.empty((2 * m, 3)), np.empty(2 * m), np.empty(2 * m)
    for j in range(m):
        plot = pool[chosen[j]]
        later = max(plot.t, t) - t
        narrow = (1.0 - par.outliers) * _density_of(track, later, plot, 1.0)
        broad = par.outliers * _density_of(track, later, plot, _BROAD)
        share = broad / (narrow + broad) if narrow + broad > 0.0 else 0.0
        for k in range(2):
            n = 2 * j + k
            z[n, 0], z[n, 1], lag[n] = plot.e, plot.n, plot.t - t
            scale = _BROAD if k else 1.0
            R[n, 0], R[n, 1], R[n, 2] = scale * plot.ee, scale * plot.en, scale * plot.nn
            part[n] = beta[j] * (share if k else 1.0 - share)
    update_in_place(track.x, track.P, z, R, lag, part)
    _update_height(track, pool, chosen, beta, par.up_q)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _settle_starter(index: int, beam: Any, w: World) -> None:
    """Branch: each plot in the gate makes a pair; the likeliest one is reported on.

    The starter itself goes on as the branch whose target was missed, except in dense clutter,
    where its ever wider gate would only gather what later plots start again.
    """
    tracks, pool, edges, par = w.tracks, w.pool, w.edges, w.par
    track = tracks[index]
    best, value, k = -1, 0.0, track.first
    while k >= 0:
        plot = pool[edges[k].plot]
        if plot.weight >= 0.5 and not plot.awaited:
            weight = par.p_d / _doubted(track, plot, par) * edges[k].density
            weight *= _evidence(track, plot, par)
            if weight > value:
                best, value = k, weight
        k = edges[k].next
    miss = 1.0 - par.p_d * par.p_g
    if best >= 0:
        _branch(index, best, value, track.voiced, beam, w)
        k = track.first
        while k >= 0:
            plot = pool[edges[k].plot]
            if k != best and plot.weight >= 0.5 and not plot.awaited:
                weight = par.p_d / _doubted(track, plot, par) * edges[k].density
                weight *= _evidence(track, plot, par)
                if weight > _PRUNE * miss:
                    _branch(index, k, weight, False, beam, w)
            k = edges[k].next
        track.voiced = False
        if _branches(track, par):
            _kill(track, index, w.books)
            return
    track.score += math.log(max(miss, 1e-300))
    _serve(track, index, False, False, pool[0], math.nan, False, beam, par, w.books)


@njit(cache=True, nogil=True, error_model="numpy")
def _branches(track: Any, par: Any) -> bool:
    return bool(par.initiation == BRANCHING or (par.initiation == AUTO and track.dense))


@njit(cache=True, nogil=True, error_model="numpy")
def _branch(index: int, k: int, weight: float, voiced: bool, beam: Any, w: World) -> None:
    """A tentative track from a starter and the plot of edge `k`, with likelihood ratio `weight`."""
    child = w.books.size[N_TRACKS]
    w.books.size[N_TRACKS] += 1
    w.tracks[child] = w.tracks[index]
    track, chosen = w.tracks[child], w.edges[k].plot
    track.level, track.voiced, track.first, track.claims = TENTATIVE, voiced, -1, False
    track.score += math.log(weight)
    track.peak = track.score
    _update_tentative(track, np.ones(1), np.full(1, chosen), w.pool, w.par)
    _serve(track, child, True, True, w.pool[chosen], 1.0, False, beam, w.par, w.books)
    track.served = track.swept = False


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def retire(beam: Any, w: World) -> None:
    """Let go the plots that no track waits for: merge the tracks that end there, and start new ones."""
    size, tracks, pool, edges = w.books.size, w.tracks, w.pool, w.edges
    if size[N_POOL] == 0:
        return
    for p in range(size[N_POOL]):
        pool[p].mark, pool[p].head = _NOBODY, -1
    for k in range(size[N_EDGES] - 1, -1, -1):
        edge = edges[k]
        if tracks[edge.track].served:
            edge.spent = True
        plot = pool[edge.plot]
        if not edge.spent:
            plot.mark = _HELD
        edge.next, plot.head = plot.head, k
    moved = np.empty(size[N_POOL], np.int64)
    n = 0
    for p in range(size[N_POOL]):
        plot = pool[p]
        if plot.mark == _HELD:
            moved[p] = n
            if n != p:
                pool[n] = pool[p]
            n += 1
        else:
            moved[p] = -1
            taken = plot.head >= 0 and _merge(plot, beam, w)
            _start(plot, not taken, w)
    size[N_POOL] = n
    n = 0
    for k in range(size[N_EDGES]):
        if moved[edges[k].plot] >= 0 and not tracks[edges[k].track].dead:
            edges[n] = edges[k]
            edges[n].plot = moved[edges[n].plot]
            n += 1
    size[N_EDGES] = n


@njit(cache=True, nogil=True, error_model="numpy")
def _merge(plot: Any, beam: Any, w: World) -> bool:
    """Settle which of the tracks that end on a plot go on; True if one of them was confirmed by it.

    Of young tracks whose last two plots are the same the likeliest one stays. The likeliest proven
    one is confirmed, and where a confirmed track ends, the young ones go.
    """
    edges, tracks = w.edges, w.tracks
    count, k, winner = 0, plot.head, -1
    while k >= 0:
        count += 1
        k = edges[k].next
    ends, n, k = np.empty(count, np.int64), 0, plot.head
    while k >= 0:
        index = edges[k].track
        track = tracks[index]
        if track.last == plot.ordinal and track.misses == 0 and not track.dead:
            ends[n] = index
            n += 1
            if (track.level == CONFIRMED or track.proven) and (winner < 0 or _before(index, winner, w)):
                winner = index
        k = edges[k].next
    if winner >= 0:
        _absorb(winner, ends[:n], False, w)
        if tracks[winner].level == CONFIRMED:
            return False
        _confirm(winner, plot, beam, w)
        plot.weight = max(plot.weight - tracks[winner].probability, 0.0)
        return True
    for i in range(n):
        stays = ends[i]
        if tracks[stays].dead or tracks[stays].previous < 0:
            continue
        for j in range(n):
            same = not tracks[ends[j]].dead and tracks[ends[j]].previous == tracks[stays].previous
            if same and _before(ends[j], stays, w):
                stays = ends[j]
        _absorb(stays, ends[:n], True, w)
    _keep_best(ends[:n], w)
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _keep_best(ends: Any, w: World) -> None:
    """Of the tracks with three plots or more that end on one plot only the likeliest go on."""
    score, index, n = np.empty(ends.size), np.empty(ends.size, np.int64), 0
    for i in ends:
        track = w.tracks[i]
        if not track.dead and track.hits > 2:
            score[n], index[n] = -track.score, i
            n += 1
    if n <= _MOST_ENDS:
        return
    for k in _ascending(score[:n])[_MOST_ENDS:]:
        track = w.tracks[index[k]]
        if track.voiced:
            _report(track, _DELETED, False, False, w.pool[0], math.nan, False, track.t, w.par, w.books)
            w.books.tally[C_MERGED] += 1
        _kill(track, index[k], w.books)


@njit(cache=True, nogil=True, error_model="numpy")
def _before(a: int, b: int, w: World) -> bool:
    """The track `a` goes before `b`: it is confirmed, or likelier, or older."""
    one, other = w.tracks[a], w.tracks[b]
    if one.level != other.level and (one.level == CONFIRMED or other.level == CONFIRMED):
        return bool(one.level == CONFIRMED)
    return bool((one.score, -one.id) > (other.score, -other.id))


@njit(cache=True, nogil=True, error_model="numpy")
def _absorb(stays: int, ends: Any, same: bool, w: World) -> None:
    """Have one track speak for the young ones that end on its plot; `same`: and have its last but one."""
    a, heir, born = w.tracks[stays], -1, 0.0
    for index in ends:
        b = w.tracks[index]
        if index == stays or b.dead or b.level == CONFIRMED or (same and b.previous != a.previous):
            continue
        if b.voiced and not a.voiced and (heir < 0 or b.id < heir):
            heir, born = b.id, b.born
    for index in ends:
        b = w.tracks[index]
        if index == stays or b.dead or b.level == CONFIRMED or (same and b.previous != a.previous):
            continue
        if b.voiced and b.id != heir:
            _report(b, _DELETED, False, False, w.pool[0], math.nan, False, b.t, w.par, w.books)
            w.books.tally[C_MERGED] += 1
        _kill(b, index, w.books)
    if heir >= 0:
        a.id, a.born, a.voiced = heir, born, True


@njit(cache=True, nogil=True, error_model="numpy")
def _start(plot: Any, free: bool, w: World) -> None:
    """Let a `free` plot that no confirmed track has used start a track."""
    if plot.extended:
        w.books.tally[C_EXTENDED] += 1
        return
    par = w.par
    if free and plot.weight >= 0.5:
        reach = par.max_speed * par.turn
        crowd = _density_at(plot, 0.0, 0.0, par) * math.pi * reach * reach
        _begin(plot, crowd > _DENSE, w)
        w.books.tally[C_STARTED] += 1


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def purge(w: World) -> None:
    """When there are more tracks than the capacity, the least likely young ones go."""
    size, tracks = w.books.size, w.tracks
    if size[N_TRACKS] - size[N_DEAD] <= w.par.max_tracks:
        return
    score, index, n = np.empty(size[N_TRACKS]), np.empty(size[N_TRACKS], np.int64), 0
    for i in range(size[N_TRACKS]):
        if tracks[i].level != CONFIRMED and not tracks[i].dead:
            score[n], index[n] = tracks[i].score, i
            n += 1
    excess = size[N_TRACKS] - size[N_DEAD] - int(_PURGE * w.par.max_tracks)
    for k in np.argsort(score[:n], kind="mergesort")[:excess]:
        track = tracks[index[k]]
        if track.voiced:
            _report(track, _DELETED, False, False, w.pool[0], math.nan, False, track.t, w.par, w.books)
        _kill(track, index[k], w.books)
        w.books.tally[C_CAPPED] += 1
