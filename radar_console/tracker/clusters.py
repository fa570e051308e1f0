"""Confirmed tracks: the clusters that share plots, their association, their updates.

A cluster is associated when the beam is past all its members' gates, or one of them has waited too
long. `weigh` and `step` touch only the members they are given, so that slices of them can run side
by side; everything between is one thread's.
"""

import math
from typing import Any

import numpy as np

from radar_console.tracker import clutter, filters, gating, height, identity, management
from radar_console.tracker.association import choose, jpda
from radar_console.tracker.kernels import bare, inlined, owning
from radar_console.tracker.records import (
    C_APPROXIMATE,
    C_FORCED,
    CONFIRMED,
    N_EDGES,
    N_MEMBERS,
    N_OPEN,
    N_PAIRS,
    N_POOL,
    NIL,
    NO,
    YES,
    World,
)

_find, _solve, _BUDGET = jpda.find, choose.associate, jpda.BUDGET
_PDA, _JPDA, _SET_JPDA = choose.PDA, choose.JPDA, choose.SET_JPDA
_advance, _log_likelihood, _update = filters.advance, filters.log_likelihood, filters.update
_density_at, _doubted, _MARGIN = clutter.density_at, clutter.doubted, gating.MARGIN
_height_factor, _update_height, _identity_factor = height.factor, height.update, identity.factor
_serve = management.serve

_PRUNE = 1e-3  # of the miss: a pair that is less likely is no pair
_DENSITY_ERROR = 1.1  # by which clutter may be denser than its estimate, where a track's life is at stake


@inlined
def group(beam: Any, w: World, final: bool) -> None:
    """Find the clusters that are due, and list their members and pairs."""
    w.books.size[N_MEMBERS] = w.books.size[N_PAIRS] = 0
    for place in range(w.books.size[N_OPEN]):
        track = w.tracks[w.opened[place]]
        if track.level == CONFIRMED and track.swept:
            _group(beam, w, final)
            return


@owning
def _group(beam: Any, w: World, final: bool) -> None:
    size, tracks, pool, edges = w.books.size, w.tracks, w.pool, w.edges
    n = size[N_OPEN]
    for p in range(size[N_POOL]):
        pool[p].mark = -1
    parent = np.arange(n)
    for k in range(size[N_EDGES]):
        edge = edges[k]
        if edge.spent or tracks[edge.track].level != CONFIRMED:
            continue
        place, plot = tracks[edge.track].place, pool[edge.plot]
        if plot.mark < 0:
            plot.mark = place
        else:
            a, b = _find(parent, plot.mark), _find(parent, place)
            parent[max(a, b)] = min(a, b)
    head, next_member = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    complete, due = np.ones(n, np.bool_), np.zeros(n, np.bool_)
    for place in range(n - 1, -1, -1):
        track = tracks[w.opened[place]]
        if track.level != CONFIRMED:
            continue
        root = _find(parent, place)
        next_member[place], head[root] = head[root], place
        if not track.swept:
            complete[root] = False
        elif final or track.rho >= track.half_width + _MARGIN + w.par.wait:
            due[root] = True
    m, pairs = 0, 0
    for root in range(n):
        if head[root] < 0 or not (complete[root] or due[root]):
            continue
        if not complete[root]:
            w.books.tally[C_FORCED] += 1
        place = head[root]
        while place >= 0:
            index = w.opened[place]
            member = w.members[m]
            member.track, member.cluster, member.pairs = index, root, pairs
            member.kept, member.used, member.rough = 0, 0.0, False
            m += 1
            k = tracks[index].first
            while k >= 0:
                if pool[edges[k].plot].weight > 0.0:
                    pairs += 1
                k = edges[k].next
            place = next_member[place]
    size[N_MEMBERS], size[N_PAIRS] = m, pairs


@bare
def weigh(w: World, lo: int, hi: int) -> None:
    """Predict the members from `lo` to `hi` to their plots, and weigh these."""
    tracks, pool, edges, par = w.tracks, w.pool, w.edges, w.par
    for m in range(lo, hi):
        member = w.members[m]
        track = tracks[member.track]
        n = member.pairs
        if track.swept and track.first >= 0:
            _advance(track, max(_mean_time(track, pool, edges), track.t), par, w.belief)
        k = track.first
        while k >= 0:
            plot = pool[edges[k].plot]
            if plot.weight > 0.0:
                pair = w.pairs[n]
                pair.plot, pair.w, pair.total, pair.beta = edges[k].plot, edges[k].density, 1.0, 0.0
                if track.swept:
                    log_g, pair.total = _log_likelihood(track, plot, par, w.belief, w.relative[n])
                    if not par.gaussian:
                        pair.w = math.exp(log_g)
                        if par.use_doppler and math.isfinite(plot.doppler):
                            pair.w *= 2.0 * par.max_speed  # false ones have any range rate
                n += 1
            k = edges[k].next


@bare
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


@bare
def evidence(track: Any, plot: Any, par: Any) -> float:
    """What a plot says besides its position: likelihood ratio of its height and its identity."""
    ratio = 1.0
    if math.isfinite(plot.up):
        ratio = _height_factor(track, plot, par.up_q)
    if par.identity and (plot.mode_3a >= 0 or plot.address >= 0):
        ratio *= _identity_factor(track, plot)
    return ratio


@bare
def associate(w: World) -> None:
    """Find the probability of every pair, cluster by cluster, and use the plots up."""
    lo, stop = NIL, w.books.size[N_MEMBERS]
    while lo < stop:
        hi = lo + 1
        while hi < stop and w.members[hi].cluster == w.members[lo].cluster:
            hi += 1
        if hi == lo + 1 and (w.par.associator in (_PDA, _JPDA, _SET_JPDA)):
            _associate_alone(lo, w)
        else:
            _associate(lo, hi, w)
        lo = hi


@bare
def _associate_alone(m: int, w: World) -> None:
    """The same for one track that shares no plots: probabilistic data association."""
    size, pool, par, member = w.books.size, w.pool, w.par, w.members[m]
    track, begin, end = w.tracks[member.track], member.pairs, size[N_PAIRS]
    if m + 1 < size[N_MEMBERS]:
        end = w.members[m + 1].pairs
    miss = 1.0 - par.p_d * par.p_g
    total, proof, track.crowded = miss, miss, False
    for k in range(begin, end):
        pair = w.pairs[k]
        pair.w *= _relative_to_clutter(track, pool[pair.plot], par)
        if pair.w > _PRUNE * miss:
            total += pair.w
            proof += _proof(pair.w, track, pool[pair.plot], par)
            _keep_pair(k, member, w)
    for k in range(begin, begin + member.kept):
        pair = w.pairs[k]
        plot = pool[pair.plot]
        pair.beta = min(pair.w / total, plot.weight)
        member.used += pair.beta
        if track.swept:
            plot.weight = max(plot.weight - pair.beta, 0.0)
    if track.swept:
        _credit(track, proof)


@bare
def _credit(track: Any, proof: float) -> None:
    """Add a pass's evidence to the track's score, and to its ledger, which is not held down."""
    track.score += math.log(proof)
    track.peak += math.log(proof)


@bare
def _proof(weight: float, track: Any, plot: Any, par: Any) -> float:
    """What a pair's weight counts for the track's life.

    Where it was born in dense clutter that can be denser than it looks, as for a young track: thrown
    off its target at the edge of a patch it would live on.
    """
    if not track.dense:
        return weight
    proof: float = weight * _density_at(plot, track.near, track.exposure, par)
    return proof / (_doubted(track, plot, par) * _DENSITY_ERROR)


@bare
def _relative_to_clutter(track: Any, plot: Any, par: Any) -> float:
    """What a pair's likelihood is to be multiplied by, to be relative to the plot's being false."""
    density = _density_at(plot, track.near, track.exposure, par)
    ratio: float = par.p_d / density * plot.weight * evidence(track, plot, par)
    return ratio


@owning
def _keep_pair(k: int, member: Any, w: World) -> None:
    """Those that stay stand together."""
    place = member.pairs + member.kept
    if place != k:
        w.relative[place] = w.relative[k]
        w.pairs[place] = w.pairs[k]
    member.kept += 1


@owning
def _associate(lo: int, hi: int, w: World) -> None:
    tracks, pool, par = w.tracks, w.pool, w.par
    begin = w.members[lo].pairs
    end = w.members[hi].pairs if hi < w.books.size[N_MEMBERS] else w.books.size[N_PAIRS]
    m, pairs = hi - lo, end - begin
    miss = np.full(m, 1.0 - par.p_d * par.p_g)
    row, col, weight = np.empty(pairs, np.int64), np.empty(pairs, np.int64), np.empty(pairs)
    kept = np.empty(pairs, np.int64)
    for k in range(begin, end):
        pool[w.pairs[k].plot].mark = -1
    n, plots = 0, NIL
    for i in range(m):
        member = w.members[lo + i]
        track = tracks[member.track]
        until = w.members[lo + i + 1].pairs if lo + i + 1 < w.books.size[N_MEMBERS] else w.books.size[N_PAIRS]
        for k in range(member.pairs, until):
            pair = w.pairs[k]
            plot = pool[pair.plot]
            pair.w *= _relative_to_clutter(track, plot, par)
            if pair.w > _PRUNE * miss[i]:
                if plot.mark < 0:
                    plot.mark = plots
                    plots += 1
                row[n], col[n], weight[n], kept[n] = i, plot.mark, pair.w, k
                n += 1
    beta, beta_miss, rough = np.zeros(n), np.ones(m), np.zeros(m, np.bool_)
    _solve(par.associator, miss, plots, row[:n], col[:n], weight[:n], _BUDGET, beta, beta_miss, rough)
    _cap(col, plots, kept, w, beta)
    claims = np.zeros(plots, np.int64)
    for k in range(n):
        claims[col[k]] += 1
    for i in range(m):
        tracks[w.members[lo + i].track].crowded = False
    total = miss
    for k in range(n):
        i = row[k]
        member = w.members[lo + i]
        total[i] += _proof(weight[k], tracks[member.track], pool[w.pairs[kept[k]].plot], par)
        pair = w.pairs[member.pairs + member.kept]
        _keep_pair(kept[k], member, w)
        pair.beta = beta[k]
        if par.associator == _SET_JPDA and claims[col[k]] > 1:
            tracks[member.track].crowded = True
        member.used += beta[k]
        if tracks[member.track].swept:
            pool[pair.plot].weight = max(pool[pair.plot].weight - beta[k], 0.0)
    for i in range(m):
        track = tracks[w.members[lo + i].track]
        if track.swept:
            _credit(track, total[i])
            w.members[lo + i].rough = rough[i]
            if rough[i]:
                w.books.tally[C_APPROXIMATE] += 1


@owning
def _cap(col: Any, plots: int, kept: Any, w: World, beta: Any) -> None:
    """No plot is used for more than what is left of it."""
    used = np.zeros(plots)
    for k in range(beta.size):
        used[col[k]] += beta[k]
    for k in range(beta.size):
        left = w.pool[w.pairs[kept[k]].plot].weight
        if used[col[k]] > left:
            beta[k] *= left / used[col[k]]


@owning
def step(w: World, lo: int, hi: int) -> None:
    """Update the swept members from `lo` to `hi`."""
    for m in range(lo, hi):
        member = w.members[m]
        track, n, begin = w.tracks[member.track], member.kept, member.pairs
        if not track.swept or track.first < 0:
            continue
        beta, total, chosen = np.empty(n), np.empty(n), np.empty(n, np.int64)
        for k in range(n):
            pair = w.pairs[begin + k]
            beta[k], total[k], chosen[k] = pair.beta, pair.total, pair.plot
        relative = w.relative[begin : begin + n]
        _update(track, max(1.0 - member.used, 0.0), beta, total, relative, chosen, w.pool, w.par, w.belief)
        _update_height(track, w.pool, chosen, beta, w.par.up_q)


@inlined
def serve_members(beam: Any, w: World) -> None:
    """Account for the pass of every swept member."""
    for m in range(w.books.size[N_MEMBERS]):
        member = w.members[m]
        track = w.tracks[member.track]
        if not track.swept:
            continue
        best = -1
        for k in range(member.pairs, member.pairs + member.kept):
            if best < 0 or w.pairs[k].beta > w.pairs[best].beta:
                best = k
        if best >= 0:
            pair = w.pairs[best]
            _serve(track, member.track, member.used >= 0.5, YES, w.pool[pair.plot], pair.beta, member.rough,
                   beam, w.par, w.books)  # fmt: skip
        else:
            _serve(track, member.track, NO, NO, w.pool[0], math.nan, member.rough, beam, w.par, w.books)
