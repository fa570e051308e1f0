"""The compiled heart: tracks served bin by bin as the beam passes.

At each bin's end every track is asked where the beam stands relative to its own next pass (ρ), and
how wide its gate is (h). Between ρ = -h and ρ = h it claims plots. When the beam is past the gates of
all confirmed tracks that share plots, their association is solved and each is served: exactly once a
pass. Tentative tracks and starters come after them, each on its own, and use no plot up: every plot
that no confirmed track used starts a track. Tracks that end on the same plots are merged.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.core.messages import TrackStatus
from radar_console.estimation import particle
from radar_console.estimation.gaussian import Array
from radar_console.estimation.kalman import predict_in_place, update_in_place
from radar_console.tracker import clutter, filters, gating, management
from radar_console.tracker.association import jpda
from radar_console.tracker.records import (
    C_APPROXIMATE,
    C_EXTENDED,
    C_FORCED,
    C_MERGED,
    C_STARTED,
    CONFIRMED,
    N_EDGES,
    N_POOL,
    N_QUEUE,
    N_ROWS,
    N_SLOTS,
    N_TRACKS,
    STARTER,
    TENTATIVE,
    Belief,
)

_BROAD = particle.BROAD
_find, _solve, _BUDGET = jpda.find, jpda.solve, jpda.BUDGET
_look, _density, _density_of, _MARGIN = gating.look, gating.density, gating.density_of, gating.MARGIN
_estimate, _turn_to, _place = clutter.estimate, clutter.turn_to, clutter.place
_advance, _log_likelihood, _update = filters.advance, filters.log_likelihood, filters.update
_serve, _remove, _begin, _report = management.serve, management.remove, management.begin, management.report
_DELETED = int(TrackStatus.DELETED)

_PRUNE = 1e-3  # of the miss: a pair that is less likely is no pair
_LEAST_DENSITY = 1e-15  # m⁻²
_NOBODY = -2  # mark of a plot that no track claims


@njit(cache=True, nogil=True, error_model="numpy")
def sweep(
    beams: Any,
    par: Any,
    clutter_map: Any,
    queue: Any,
    tracks: Any,
    pool: Any,
    edges: Any,
    belief: Belief,
    blank: Any,
    rows: Any,
    size: Any,
    need: Any,
    count: Any,
    final: bool,
) -> int:
    """Process bins until one needs larger tables; the number of bins that are done.

    `need` is filled with the rows that each table must hold for the bin that comes next.
    `final` closes what the beam has passed without waiting for its competitors (the end of a stream).
    """
    for b in range(beams.size):
        beam = beams[b]
        opened = _open_tracks(beam, par, tracks, size)
        stop = size[N_QUEUE]
        while stop < queue.size and queue[stop].phi < beam.phi:
            stop += 1
        fresh = stop - size[N_QUEUE]
        need[N_POOL] = size[N_POOL] + fresh
        need[N_EDGES] = size[N_EDGES] + opened.size * fresh
        need[N_TRACKS] = size[N_TRACKS] + size[N_POOL] + fresh
        need[N_ROWS] = size[N_ROWS] + opened.size + size[N_TRACKS] + size[N_POOL] + fresh
        need[N_SLOTS] = size[N_SLOTS] + opened.size
        if (
            need[N_POOL] > pool.size
            or need[N_EDGES] > edges.size
            or need[N_TRACKS] > tracks.size
            or need[N_ROWS] > rows.size
            or need[N_SLOTS] > belief.owner.size
        ):
            return b
        cell = math.floor(beam.phi / par.bin - 0.5)
        blank[cell % blank.size] = not beam.seen
        _gate(beam, par, queue, fresh, tracks, opened, pool, edges, size)
        for place in range(opened.size):
            track = tracks[opened[place]]
            track.swept = track.rho >= track.half_width + _MARGIN
        _link(opened, tracks, edges, size)
        for level in (CONFIRMED, TENTATIVE, STARTER):
            _close(
                level, beam, par, clutter_map, tracks, opened, pool, edges, belief, blank, rows, size,
                count, final,
            )  # fmt: skip
        _merge(par, tracks, opened, pool, rows, size, count)
        _tidy(beam, par, clutter_map, tracks, opened, pool, edges, belief, rows, size, count)
        _turn_to(clutter_map, beam.phi)
    return int(beams.size)


@njit(cache=True, nogil=True, error_model="numpy")
def _open_tracks(beam: Any, par: Any, tracks: Any, size: Any) -> Any:
    """The tracks whose gates the beam has reached and that were not served since, by their id."""
    found, ids = np.empty(size[N_TRACKS], np.int64), np.empty(size[N_TRACKS], np.int64)
    n = 0
    for i in range(size[N_TRACKS]):
        track = tracks[i]
        track.place = -1
        if beam.phi < track.wake_angle and beam.t < track.wake_time:
            continue
        _look(track, track.level == STARTER, beam, par)
        if track.claims or track.rho >= -track.half_width - _MARGIN:
            found[n], ids[n] = i, track.id
            n += 1
    opened = found[:n][np.argsort(ids[:n], kind="mergesort")]
    for place in range(n):
        tracks[opened[place]].place = place
    return opened


@njit(cache=True, nogil=True, error_model="numpy")
def _gate(
    beam: Any, par: Any, queue: Any, fresh: int, tracks: Any, opened: Any, pool: Any, edges: Any, size: Any
) -> None:
    """Take the bin's plots from the queue, and join each to the tracks in whose gates it is."""
    for _ in range(fresh):
        p = size[N_POOL]
        pool[p] = queue[size[N_QUEUE]]
        size[N_POOL] += 1
        size[N_QUEUE] += 1
        plot = pool[p]
        for place in range(opened.size):
            track = tracks[opened[place]]
            if track.swept or track.rho - (beam.phi - plot.phi) < -math.pi:
                continue
            likelihood = _density(track, track.level == STARTER, plot, par)
            if likelihood > 0.0:
                edge = edges[size[N_EDGES]]
                edge.track, edge.plot, edge.density = opened[place], p, likelihood
                size[N_EDGES] += 1
                track.claims = True


@njit(cache=True, nogil=True, error_model="numpy")
def _link(opened: Any, tracks: Any, edges: Any, size: Any) -> None:
    """Chain each track's edges, in the order of the plots."""
    for place in range(opened.size):
        tracks[opened[place]].first = -1
    for k in range(size[N_EDGES] - 1, -1, -1):
        track = tracks[edges[k].track]
        edges[k].next = track.first
        track.first = k


@njit(cache=True, nogil=True, error_model="numpy")
def _close(
    level: int, beam: Any, par: Any, clutter_map: Any, tracks: Any, opened: Any, pool: Any, edges: Any,
    belief: Belief, blank: Any, rows: Any, size: Any, count: Any, final: bool,
) -> None:  # fmt: skip
    """Serve the clusters of one level that are complete, or have waited too long."""
    n = opened.size
    for p in range(size[N_POOL]):
        pool[p].awaited, pool[p].mark = False, -1
    parent = np.arange(n)
    for k in range(size[N_EDGES]):
        track, plot = tracks[edges[k].track], pool[edges[k].plot]
        if track.served:
            continue
        if track.level == CONFIRMED:
            plot.awaited = True
        if track.level != level or level != CONFIRMED:
            continue
        if plot.mark < 0:
            plot.mark = track.place
        else:
            a, b = _find(parent, plot.mark), _find(parent, track.place)
            parent[max(a, b)] = min(a, b)
    head, next_member = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    complete, due = np.ones(n, np.bool_), np.zeros(n, np.bool_)
    for place in range(n - 1, -1, -1):
        track = tracks[opened[place]]
        if track.level != level or track.served:
            continue
        root = _find(parent, place)
        next_member[place], head[root] = head[root], place
        if not track.swept:
            complete[root] = False
        elif final or track.rho >= track.half_width + _MARGIN + par.wait:
            due[root] = True
        k = track.first
        while k >= 0:
            if level != CONFIRMED and pool[edges[k].plot].awaited:
                complete[root] = False
            k = edges[k].next
    members = np.empty(n, np.int64)
    for root in range(n):
        if head[root] < 0 or not (complete[root] or due[root]):
            continue
        m, place = 0, head[root]
        while place >= 0:
            members[m] = opened[place]
            m += 1
            place = next_member[place]
        if not complete[root]:
            count[C_FORCED] += 1
        if level == STARTER:
            _settle_starter(members[0], beam, par, tracks, pool, edges, belief, blank, rows, size, count,
                            clutter_map)  # fmt: skip
        else:
            _settle(level, members[:m], beam, par, tracks, pool, edges, belief, blank, rows, size, count,
                    clutter_map)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _false_density(track: Any, beam: Any, par: Any, clutter_map: Any) -> float:
    """λ, m⁻², where the track is."""
    if not math.isnan(par.clutter):
        return max(float(par.clutter), _LEAST_DENSITY)
    T = max(beam.t - track.t, 0.0)
    x = track.x
    e, n = x[0] + T * x[2] - beam.e, x[1] + T * x[3] - beam.n
    return max(_estimate(clutter_map, e, n, par.max_range), _LEAST_DENSITY)


@njit(cache=True, nogil=True, error_model="numpy")
def _settle(
    level: int, members: Any, beam: Any, par: Any, tracks: Any, pool: Any, edges: Any, belief: Belief,
    blank: Any, rows: Any, size: Any, count: Any, clutter_map: Any,
) -> None:  # fmt: skip
    """Solve a cluster's association, and update its swept members."""
    m, pairs, plots = members.size, 0, 0
    for i in range(m):
        k = tracks[members[i]].first
        while k >= 0:
            pairs += 1
            pool[edges[k].plot].mark = -1
            k = edges[k].next
    miss = np.full(m, 1.0 - par.p_d * par.p_g)
    row, col, w = np.empty(pairs, np.int64), np.empty(pairs, np.int64), np.empty(pairs)
    plot_of, total = np.empty(pairs, np.int64), np.empty(pairs)
    first = np.zeros(m + 1, np.int64)
    clouds = level == CONFIRMED
    relative = np.empty((pairs if clouds else 0, belief.particles.shape[2]), np.float32)
    n = 0
    for i in range(m):
        track = tracks[members[i]]
        sampled = clouds and track.swept and track.first >= 0
        if sampled:
            t = max(_mean_time(track, pool, edges), track.t)
            _advance(track, t, par, belief)
        scale = par.p_d / _false_density(track, beam, par, clutter_map)
        k = track.first
        while k >= 0:
            plot = pool[edges[k].plot]
            # A plot that a confirmed track still waits for is left to it.
            if plot.weight > 0.0 and (clouds or not plot.awaited):
                likelihood, sum_relative = edges[k].density, 1.0
                if sampled:
                    log_g, sum_relative = _log_likelihood(track, plot, par, belief, relative[n])
                    likelihood = math.exp(log_g)
                weight = scale * likelihood * plot.weight
                if weight > _PRUNE * miss[i]:
                    if plot.mark < 0:
                        plot.mark = plots
                        plots += 1
                    row[n], col[n], w[n] = i, plot.mark, weight
                    plot_of[n], total[n] = edges[k].plot, sum_relative
                    n += 1
            k = edges[k].next
        first[i + 1] = n
    row, col, w = row[:n], col[:n], w[:n]
    beta, beta_miss, rough = np.zeros(n), np.ones(m), np.zeros(m, np.bool_)
    _solve(miss, plots, row, col, w, _BUDGET, beta, beta_miss, rough)
    _cap(col, plots, plot_of, pool, beta)
    for i in range(m):
        track = tracks[members[i]]
        if not track.swept:
            continue
        lo, hi = first[i], first[i + 1]
        used, best, evidence = 0.0, -1, miss[i]
        for k in range(lo, hi):
            plot = pool[plot_of[k]]
            used += beta[k]
            evidence += w[k]
            if clouds:
                plot.weight = max(plot.weight - beta[k], 0.0)
            if best < 0 or beta[k] > beta[best]:
                best = k
        track.score += math.log(evidence)
        if rough[i]:
            count[C_APPROXIMATE] += 1
        if hi > lo:
            if clouds:
                _update(track, max(1.0 - used, 0.0), beta[lo:hi], total[lo:hi], relative[lo:hi],
                        plot_of[lo:hi], pool, par, belief)  # fmt: skip
            else:
                _update_tentative(track, beta[lo:hi], plot_of[lo:hi], pool, par)
        if best >= 0:
            _serve(track, members[i], used >= 0.5, True, pool[plot_of[best]], beta[best], rough[i], beam, par,
                   belief, blank, rows, size, count)  # fmt: skip
        else:
            _serve(track, members[i], False, False, pool[0], math.nan, rough[i], beam, par,
                   belief, blank, rows, size, count)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _mean_time(track: Any, pool: Any, edges: Any) -> float:
    """Mean time of the plots in the gate, weighted by their likelihoods."""
    total, t, k = 0.0, 0.0, track.first
    origin = pool[edges[k].plot].t
    while k >= 0:
        total += edges[k].density
        t += edges[k].density * (pool[edges[k].plot].t - origin)
        k = edges[k].next
    mean: float = origin + t / total
    return mean


@njit(cache=True, nogil=True, error_model="numpy")
def _cap(col: Any, plots: int, plot_of: Any, pool: Any, beta: Array) -> None:
    """No plot is used for more than what is left of it."""
    used = np.zeros(plots)
    for k in range(beta.size):
        used[col[k]] += beta[k]
    for k in range(beta.size):
        left = pool[plot_of[k]].weight
        if used[col[k]] > left:
            beta[k] *= left / used[col[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def _update_tentative(track: Any, beta: Array, plot_of: Any, pool: Any, par: Any) -> None:
    """The Kalman update with alternatives; the new time is their mean by probability."""
    m = beta.size
    origin, total, t = pool[plot_of[0]].t, 0.0, 0.0
    for j in range(m):
        total += beta[j]
        t += beta[j] * (pool[plot_of[j]].t - origin)
    t = max(origin + (t / total if total > 0.0 else 0.0), track.t)
    predict_in_place(track.x, track.P, t - track.t, par.q)
    track.t = t
    # Each plot twice: with the noise it claims, and as an outlier.
    z, R, lag, part = np.empty((2 * m, 2)), np.empty((2 * m, 3)), np.empty(2 * m), np.empty(2 * m)
    for j in range(m):
        plot = pool[plot_of[j]]
        later = max(plot.t, t) - t
        narrow = (1.0 - par.outliers) * _density_of(track, later, plot, 1.0, par.q)
        broad = par.outliers * _density_of(track, later, plot, _BROAD, par.q)
        share = broad / (narrow + broad) if narrow + broad > 0.0 else 0.0
        for k in range(2):
            n = 2 * j + k
            z[n, 0], z[n, 1], lag[n] = plot.e, plot.n, plot.t - t
            scale = _BROAD if k else 1.0
            R[n, 0], R[n, 1], R[n, 2] = scale * plot.ee, scale * plot.en, scale * plot.nn
            part[n] = beta[j] * (share if k else 1.0 - share)
    update_in_place(track.x, track.P, z, R, lag, part)


@njit(cache=True, nogil=True, error_model="numpy")
def _settle_starter(
    index: int, beam: Any, par: Any, tracks: Any, pool: Any, edges: Any, belief: Belief, blank: Any,
    rows: Any, size: Any, count: Any, clutter_map: Any,
) -> None:  # fmt: skip
    """The second plot is the likeliest one; a mean of several would give no velocity.

    Other young tracks may take it too: if this pair is wrong, the next one is not robbed by it.
    """
    track = tracks[index]
    best, value, k = -1, 0.0, track.first
    while k >= 0:
        plot = pool[edges[k].plot]
        if plot.weight >= 0.5 and not plot.awaited and edges[k].density > value:
            best, value = edges[k].plot, edges[k].density
        k = edges[k].next
    miss = 1.0 - par.p_d * par.p_g
    if best < 0:
        track.score += math.log(miss)
        _serve(track, index, False, False, pool[0], math.nan, False, beam, par,
               belief, blank, rows, size, count)  # fmt: skip
        return
    track.score += math.log(miss + par.p_d * value / _false_density(track, beam, par, clutter_map))
    _update_tentative(track, np.ones(1), np.full(1, best), pool, par)
    track.level = TENTATIVE
    _serve(track, index, True, True, pool[best], 1.0, False, beam, par,
           belief, blank, rows, size, count)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _merge(par: Any, tracks: Any, opened: Any, pool: Any, rows: Any, size: Any, count: Any) -> None:
    """Of tracks with the same last two plots one stays: the confirmed one, else the likelier one.

    A young track that ends on a plot of a confirmed track goes, too.
    """
    for place in range(opened.size):
        a = tracks[opened[place]]
        if not a.served or a.dead or a.misses > 0:
            continue
        for i in range(size[N_TRACKS]):
            b = tracks[i]
            if b.last != a.last or b.dead or i == opened[place] or (a.level == CONFIRMED == b.level):
                continue
            if a.level != CONFIRMED and b.level != CONFIRMED and (a.previous != b.previous or a.previous < 0):
                continue
            first = a.level < b.level or (a.level == b.level and (a.score, -a.id) > (b.score, -b.id))
            worse = b if first else a
            worse.dead = worse.served = True
            count[C_MERGED] += 1
            _report(worse, _DELETED, False, False, pool[0], math.nan, False, worse.t, par.q, rows, size)
            if not first:
                break


@njit(cache=True, nogil=True, error_model="numpy")
def _tidy(
    beam: Any, par: Any, clutter_map: Any, tracks: Any, opened: Any, pool: Any, edges: Any,
    belief: Belief, rows: Any, size: Any, count: Any,
) -> None:  # fmt: skip
    """Drop the edges of what was served; plots without a claimant start tracks or go; bury the dead."""
    for p in range(size[N_POOL]):
        pool[p].mark = _NOBODY
    n = 0
    for k in range(size[N_EDGES]):
        if not tracks[edges[k].track].served:
            pool[edges[k].plot].mark = 0
            edges[n] = edges[k]
            n += 1
    size[N_EDGES] = n
    for place in range(opened.size):
        track = tracks[opened[place]]
        if track.served:
            track.served = track.swept = False
    # In the order of the table, so that those moved into a hole below are never among the dead.
    dead = np.empty(size[N_TRACKS], np.int64)
    buried = 0
    for i in range(size[N_TRACKS]):
        if tracks[i].dead:
            dead[buried] = i
            buried += 1
    n = 0
    moved = np.empty(size[N_POOL], np.int64)
    for p in range(size[N_POOL]):
        plot = pool[p]
        if plot.mark == _NOBODY:
            _retire(plot, beam, par, clutter_map, tracks, rows, size, count)
        else:
            moved[p] = n
            if n != p:
                pool[n] = pool[p]
            n += 1
    size[N_POOL] = n
    for k in range(size[N_EDGES]):
        edges[k].plot = moved[edges[k].plot]
    for k in range(buried - 1, -1, -1):
        _remove(dead[k], tracks, edges, belief, size)


@njit(cache=True, nogil=True, error_model="numpy")
def _retire(
    plot: Any, beam: Any, par: Any, clutter_map: Any, tracks: Any, rows: Any, size: Any, count: Any
) -> None:
    """A plot that no track waits for any more: count it as clutter, and let it start a track."""
    if plot.extended:
        count[C_EXTENDED] += 1
        return
    ring, column = _place(plot.e - beam.e, plot.n - beam.n, par.max_range)
    clutter_map.fresh[ring, column] += plot.weight
    if plot.weight >= 0.5:
        _begin(tracks, plot, par, rows, size)
        count[C_STARTED] += 1


__all__ = ["sweep"]
