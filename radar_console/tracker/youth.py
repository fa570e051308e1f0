"""Young tracks: how they start, branch, gather evidence and are merged.

A plot that no confirmed track used starts a track. At its second plot it branches: every plot in
its gate makes a pair of its own, with its own likelihood, so a wrong one costs nothing but itself.
From the third plot on a branch in sparse clutter is a Kalman filter with probabilistic data
association, whose score, the log-likelihood ratio of a target against clutter, grows by
ln(w_0 + Σ w); young tracks share plots, and those that come to the same last two plots are one.

In dense clutter the mean of all plots in the gate soon follows none of them. There a track branches
at every plot, and what comes to nearly the same state on one plot is one again: its likelihood is
the sum of the ways that led there. On each plot the likeliest few states go on, so that all
branches together are a beam search for the mixture that is the target's posterior.
"""

import math
from typing import Any

import numpy as np

from radar_console.core.messages import TrackStatus
from radar_console.estimation import particle
from radar_console.estimation.kalman import (
    add_alternative,
    condition_in_place,
    mix_in_place,
    predict_in_place,
)
from radar_console.tracker import agenda, clusters, clutter, gating, height, management, order
from radar_console.tracker.kernels import bare, inlined, owning
from radar_console.tracker.records import (
    AUTO,
    B_ROOT,
    BRANCHING,
    C_CAPPED,
    C_EXTENDED,
    C_LOST,
    C_MERGED,
    C_STARTED,
    CONFIRMED,
    N_DEAD,
    N_EDGES,
    N_OPEN,
    N_POOL,
    N_SLOTS,
    N_TRACKS,
    NO,
    STARTER,
    TENTATIVE,
    YES,
    World,
    variable,
)

_BROAD = particle.BROAD
_density_of, _predicted, _MARGIN = gating.density_of, gating.predicted, gating.MARGIN
_enter = agenda.enter
_density_at, _doubted = clutter.density_at, clutter.doubted
_evidence, _update_height = clusters.evidence, height.update
_serve, _begin, _kill, _report = management.serve, management.begin, management.kill, management.report
_confirm, _may_be_near = management.confirm, management.may_be_near
_DROP, _ascending = management.DROP, order.ascending
_TENTATIVE = variable(TrackStatus.TENTATIVE)
_DELETED = variable(TrackStatus.DELETED)
_PRUNE = 1e-3  # of the miss: a pair that is less likely is no pair
_NOBODY, _HELD = -2, -3  # marks of a plot: no track waits for it; some do
_DENSE = 0.3  # false plots in the gate of a track's second plot, from which on clutter counts as dense
_MOST_ENDS = 8  # branches that may end on one plot
_SAME = 4.0  # squared Mahalanobis distance of states, below which two branches are one
_SIGMAS_APART = 5.0  # of positions, from which on a young track is not a confirmed one's target
_APART = _SIGMAS_APART**2
_TRIAL = 2.2  # of the score, which a pair in dense clutter may lose: there are others
_PURGE = 0.95  # of the capacity is left when it was exceeded


@inlined
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
            if level == STARTER or _branches(track, w.par):
                _settle_branching(index, beam, w)
            else:
                _settle_alone(index, beam, w)


@bare
def _settle_alone(index: int, beam: Any, w: World) -> None:
    """Probabilistic data association of one track by itself; the edges' densities become weights."""
    track, pool, edges, par = w.tracks[index], w.pool, w.edges, w.par
    miss = 1.0 - par.p_d * par.p_g
    total, best, k = miss, -1, track.first
    while k >= 0:
        plot, weight = pool[edges[k].plot], 0.0
        # A plot that a confirmed track still waits for is left to it.
        if plot.weight > 0.0 and not plot.awaited:
            weight = par.p_d / _doubted(track, plot, par) * edges[k].density
            weight *= plot.weight * _evidence(track, plot, par)
            if weight > _PRUNE * miss:
                total += weight
                if best < 0 or weight > edges[best].density:
                    best = k
            else:
                weight = 0.0
        edges[k].density = weight
        k = edges[k].next
    track.score += math.log(max(total, 1e-300))
    if best < 0:
        _serve(track, index, NO, NO, pool[0], math.nan, NO, beam, par, w.books)
        return
    _update_by_edges(track, total, w)
    probability, hit = edges[best].density / total, total - miss >= 0.5 * total
    _serve(track, index, hit, YES, pool[edges[best].plot], probability, NO, beam, par, w.books)


@bare
def _update_by_edges(track: Any, total: float, w: World) -> None:
    """The Kalman update with the track's plots, whose weights are the edges' densities, of `total`.

    The new time is their mean by probability.
    """
    pool, edges, par, first = w.pool, w.edges, w.par, track.first
    origin, used, t, heights, k = pool[edges[first].plot].t, 0.0, 0.0, False, first
    while k >= 0:
        used += edges[k].density
        t += edges[k].density * (pool[edges[k].plot].t - origin)
        heights |= edges[k].density > 0.0 and math.isfinite(pool[edges[k].plot].up)
        k = edges[k].next
    t = max(origin + t / used, track.t)
    predict_in_place(track.x, track.P, t - track.t, par.q)
    track.t = t
    w.mixture[:] = 0.0
    k = first
    while k >= 0:
        if edges[k].density > 0.0:
            _add(track, pool[edges[k].plot], edges[k].density / total, par, w.mixture)
        k = edges[k].next
    mix_in_place(track.x, track.P, w.mixture)
    if heights:
        _learn_height(track, total, w)


@bare
def _update_by_plot(track: Any, plot: Any, w: World) -> None:
    """The Kalman update with one plot that may be an outlier."""
    t = max(plot.t, track.t)
    predict_in_place(track.x, track.P, t - track.t, w.par.q)
    track.t = t
    w.mixture[:] = 0.0
    _add(track, plot, 1.0, w.par, w.mixture)
    mix_in_place(track.x, track.P, w.mixture)


@bare
def _add(track: Any, plot: Any, beta: float, par: Any, A: Any) -> None:
    """An alternative of the update: the plot with the noise that it claims, and as an outlier."""
    lag = plot.t - track.t
    later = max(lag, 0.0)
    narrow = (1.0 - par.outliers) * _density_of(track, later, plot, 1.0)
    broad = par.outliers * _density_of(track, later, plot, _BROAD)
    odd = beta * broad / (narrow + broad) if narrow + broad > 0.0 else 0.0
    x, P, e, n, ee, en, nn = track.x, track.P, plot.e, plot.n, plot.ee, plot.en, plot.nn
    add_alternative(x, P, e, n, ee, en, nn, lag, beta - odd, A)
    if odd > 0.0:
        add_alternative(x, P, e, n, _BROAD * ee, _BROAD * en, _BROAD * nn, lag, odd, A)


@owning
def _learn_height(track: Any, total: float, w: World) -> None:
    """Update the height with the track's plots, whose weights are the edges' densities, of `total`."""
    edges, count, k = w.edges, 0, track.first
    while k >= 0:
        count += edges[k].density > 0.0
        k = edges[k].next
    beta, chosen, n, k = np.empty(count), np.empty(count, np.int64), 0, track.first
    while k >= 0:
        if edges[k].density > 0.0:
            beta[n], chosen[n] = edges[k].density / total, edges[k].plot
            n += 1
        k = edges[k].next
    _update_height(track, w.pool, chosen, beta, w.par.up_q)


@inlined
def _settle_branching(index: int, beam: Any, w: World) -> None:
    """Branch: each plot in the gate makes a track of its own; the likeliest one is reported on.

    The track itself goes on as the branch whose target was missed. Not so a starter in dense
    clutter: its ever wider gate would only gather what later plots start again.
    """
    tracks, pool, edges, par = w.tracks, w.pool, w.edges, w.par
    track = tracks[index]
    best, value, k = -1, 0.0, track.first
    while k >= 0:
        plot, weight = pool[edges[k].plot], 0.0
        # A plot that a confirmed track still waits for is left to it.
        if plot.weight >= 0.5 and not plot.awaited:
            weight = par.p_d / _doubted(track, plot, par) * edges[k].density
            weight *= plot.weight * _evidence(track, plot, par)
            if weight > value:
                best, value = k, weight
        edges[k].density = weight
        k = edges[k].next
    miss = 1.0 - par.p_d * par.p_g
    least = _PRUNE * miss
    if best >= 0 and track.level == TENTATIVE:
        least = math.exp(track.peak - _DROP - track.score)
    taken = best >= 0 and value > least
    if taken:
        _branch(index, best, track.voiced, beam, w)
        k = track.first
        while k >= 0:
            if k != best and edges[k].density > least:
                _branch(index, k, NO, beam, w)
            k = edges[k].next
        track.voiced = False
    track.score += par.log_miss
    lost = track.score < track.peak - _DROP
    if track.level == STARTER:
        lost = taken and _branches(track, par)
    if lost and not track.voiced:
        _kill(track, index, w.books)
        return
    _serve(track, index, NO, NO, pool[0], math.nan, NO, beam, par, w.books)


@bare
def _branches(track: Any, par: Any) -> bool:
    return bool(par.initiation == BRANCHING or (par.initiation == AUTO and track.dense))


@bare
def _branch(index: int, k: int, voiced: bool, beam: Any, w: World) -> None:
    """A tentative track from another and the plot of edge `k`, whose likelihood ratio is its density."""
    child, edge = w.books.size[N_TRACKS], w.edges[k]
    w.books.size[N_TRACKS] += 1
    w.tracks[child] = w.tracks[index]
    _enter(child, w.books)
    track, chosen = w.tracks[child], edge.plot
    track.score += math.log(edge.density)
    if track.level == STARTER:
        # In dense clutter it is given up as if it had been likelier once.
        track.peak = track.score + (_DROP - _TRIAL if track.dense else 0.0)
    track.level, track.voiced, track.first, track.claims = TENTATIVE, voiced, -1, False
    if track.dense:  # where an outlier is as good as a false plot
        _take(track, w.pool[chosen], w.par)
    else:
        _update_by_plot(track, w.pool[chosen], w)
    if math.isfinite(w.pool[chosen].up):
        _take_height(track, chosen, w)
    _serve(track, child, YES, YES, w.pool[chosen], 1.0, NO, beam, w.par, w.books)
    track.served = track.swept = False
    if track.hits > 2:
        edge.track, edge.spent = child, True


@owning
def _take(track: Any, plot: Any, par: Any) -> None:
    """The Kalman update with one plot."""
    t = max(plot.t, track.t)
    predict_in_place(track.x, track.P, t - track.t, par.q)
    track.t = t
    condition_in_place(track.x, track.P, plot.e, plot.n, plot.ee, plot.en, plot.nn)


@owning
def _take_height(track: Any, chosen: int, w: World) -> None:
    """Update the height with the plot `chosen` of the pool."""
    _update_height(track, w.pool, np.full(1, chosen), np.ones(1), w.par.up_q)


@inlined
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
    n = 0
    for p in range(size[N_POOL]):
        plot, place, k = pool[p], -1, pool[p].head
        if plot.mark == _HELD:
            place = n
            n += 1
        else:
            taken = plot.head >= 0 and _merge(plot, beam, w)
            _start(plot, not taken, w)
        while k >= 0:
            edges[k].plot = place
            k = edges[k].next
        if 0 <= place < p:
            pool[place] = pool[p]
    size[N_POOL] = n
    n = 0
    for k in range(size[N_EDGES]):
        if edges[k].plot >= 0 and not tracks[edges[k].track].dead:
            if n != k:
                edges[n] = edges[k]
            n += 1
    size[N_EDGES] = n


@bare
def _merge(plot: Any, beam: Any, w: World) -> bool:
    """Settle which of the tracks that end on a plot go on; True if one of them was confirmed by it.

    The likeliest proven one is confirmed, and where a confirmed track ends, the young ones go. Else
    the young ones are thinned out: branches in nearly the same state are made one; of others whose
    last two plots are the same the likeliest stays.
    """
    edges, tracks, ends = w.edges, w.tracks, w.ends
    n, winner, k = 0, -1, plot.head
    while k >= 0:
        index = edges[k].track
        track = tracks[index]
        if track.last == plot.ordinal and track.misses == 0 and not track.dead:
            ends[n] = index
            n += 1
            if track.proven and _branches(track, w.par) and _is_known(track, w):
                track.proven = False
                if track.voiced:
                    _report(track, _TENTATIVE, YES, YES, plot, track.probability, NO, track.t, w.par, w.books)
            if (track.level == CONFIRMED or track.proven) and (winner < 0 or _before(index, winner, w)):
                winner = index
        k = edges[k].next
    if winner >= 0:
        known = _kin(tracks[winner], w)
        _absorb(winner, ends[:n], NO, w)
        if tracks[winner].level == CONFIRMED:
            return False
        if known >= 0:
            _succeed(winner, known, w)
        _confirm(winner, plot, beam, w)
        plot.weight = max(plot.weight - tracks[winner].probability, 0.0)
        return True
    for i in range(n):
        stays = ends[i]
        track = tracks[stays]
        if track.dead or track.previous < 0 or _branches(track, w.par):
            continue
        for j in range(n):
            same = not tracks[ends[j]].dead and tracks[ends[j]].previous == tracks[stays].previous
            if same and _before(ends[j], stays, w):
                stays = ends[j]
        _absorb(stays, ends[:n], YES, w)
    several = 0
    for i in range(n):
        several += not tracks[ends[i]].dead and tracks[ends[i]].hits > 2
    if several > 1:
        _pool(ends[:n], w)
    return False


@bare
def _is_known(track: Any, w: World) -> bool:
    """A confirmed track may be the young one's target: it waits until they are apart, or it has faded.

    Branches of one first plot share what had been found before they parted. Of these the young one
    waits only until the evidence since then is clearly for it.
    """
    spread = math.sqrt(track.P[0, 0] + track.P[1, 1])
    for slot in range(w.books.size[N_SLOTS]):
        kin = w.books.whereabouts[slot, B_ROOT] == track.root
        if not kin and not _may_be_near(slot, track, spread, _SIGMAS_APART, w.books):
            continue
        other = w.tracks[w.belief.owner[slot]]
        if other.dead:
            continue
        if other.root == track.root:
            if track.score < other.peak + _DROP:
                return True
            continue
        e, n, ee, en, nn = _predicted(other, max(track.t - other.t, 0.0))
        de, dn = e - track.x[0], n - track.x[1]
        ee, en, nn = ee + track.P[0, 0], en + track.P[0, 1], nn + track.P[1, 1]
        if nn * de * de - 2.0 * en * de * dn + ee * dn * dn < _APART * (ee * nn - en * en):
            return True
    return False


@bare
def _kin(track: Any, w: World) -> int:
    """The confirmed track from the same first plot as a young branch; -1 none."""
    if track.level != CONFIRMED and _branches(track, w.par):
        for slot in range(w.books.size[N_SLOTS]):
            if w.books.whereabouts[slot, B_ROOT] == track.root and not w.tracks[w.belief.owner[slot]].dead:
                return int(w.belief.owner[slot])
    return -1


@bare
def _succeed(index: int, known: int, w: World) -> None:
    """Have a proven track take over the number of the confirmed one, which was thrown off their target."""
    track, other = w.tracks[index], w.tracks[known]
    if track.voiced:
        _report(track, _DELETED, NO, NO, w.pool[0], math.nan, NO, track.t, w.par, w.books)
        w.books.tally[C_MERGED] += 1
    _take_name(track, other)
    other.voiced = False
    _kill(other, known, w.books)
    w.books.tally[C_LOST] += 1


@bare
def _take_name(track: Any, other: Any) -> None:
    """Go on under the other track's number, and its birth."""
    track.id, track.root, track.born, track.voiced = other.id, other.root, other.born, True


@bare
def _drop(index: int, w: World) -> None:
    """Give up a young track for another one's sake."""
    track = w.tracks[index]
    if track.voiced:
        _report(track, _DELETED, NO, NO, w.pool[0], math.nan, NO, track.t, w.par, w.books)
        w.books.tally[C_MERGED] += 1
    _kill(track, index, w.books)


@owning
def _pool(ends: Any, w: World) -> None:
    """Of the tracks with three plots or more that end on one plot only the likeliest go on.

    A branch in nearly the same state as a likelier one is not lost: the two are made one.
    """
    score, index, n = np.empty(ends.size), np.empty(ends.size, np.int64), 0
    for i in ends:
        track = w.tracks[i]
        if not track.dead and track.hits > 2:
            score[n], index[n] = -track.score, i
            n += 1
    kept, roots, m = np.empty(_MOST_ENDS, np.int64), np.empty((_MOST_ENDS, 4, 4)), 0
    for k in _ascending(score[:n]):
        b, into = w.tracks[index[k]], -1
        if _branches(b, w.par):
            for j in range(m):
                a = w.tracks[kept[j]]
                if _branches(a, w.par) and a.t == b.t and _distance(a.x, roots[j], b.x) < _SAME:
                    into = j
                    break
        if into >= 0:
            a = w.tracks[kept[into]]
            _blend(a, b)
            if b.voiced and not a.voiced:
                _take_name(a, b)
                b.voiced = False
        elif m < _MOST_ENDS:
            kept[m] = index[k]
            _root(b.P, roots[m])
            m += 1
            continue
        _drop(index[k], w)


@owning
def _root(P: Any, L: Any) -> None:
    """Cholesky's root L (4, 4) of P, its diagonal inverted."""
    for i in range(4):
        for j in range(i + 1):
            s = P[i, j]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = s * L[j, j] if j < i else 1.0 / math.sqrt(max(s, 1e-12))


@owning
def _distance(x: Any, L: Any, y: Any) -> float:
    """Squared Mahalanobis distance of the states x and y (4,); L is the covariance's root."""
    z, d2 = np.empty(4), 0.0
    for i in range(4):
        s = y[i] - x[i]
        for j in range(i):
            s -= L[i, j] * z[j]
        z[i] = s * L[i, i]
        d2 += z[i] * z[i]
    return d2


@owning
def _blend(a: Any, b: Any) -> None:
    """Let `a` be the mixture of itself and the less likely `b`, by its first two moments."""
    odds = math.exp(b.score - a.score)
    part = odds / (1.0 + odds)
    d = np.empty(4)
    for i in range(4):
        d[i] = b.x[i] - a.x[i]
    for i in range(4):
        a.x[i] += part * d[i]
        for j in range(4):
            a.P[i, j] += part * (b.P[i, j] - a.P[i, j]) + part * (1.0 - part) * d[i] * d[j]
    a.score += math.log1p(odds)
    a.peak = max(a.peak, a.score)


@bare
def _before(a: int, b: int, w: World) -> bool:
    """The track `a` goes before `b`: it is confirmed, or likelier, or older."""
    one, other = w.tracks[a], w.tracks[b]
    if one.level != other.level and (one.level == CONFIRMED or other.level == CONFIRMED):
        return bool(one.level == CONFIRMED)
    return bool((one.score, -one.id) > (other.score, -other.id))


@bare
def _absorb(stays: int, ends: Any, same: bool, w: World) -> None:
    """Have one track speak for the young ones that end on its plot; `same`: and have its last but one."""
    a, heir = w.tracks[stays], -1
    for index in ends:
        b = w.tracks[index]
        if index == stays or b.dead or b.level == CONFIRMED or (same and b.previous != a.previous):
            continue
        if b.voiced and not a.voiced and (heir < 0 or b.id < w.tracks[heir].id):
            heir = index
    for index in ends:
        b = w.tracks[index]
        if index == stays or b.dead or b.level == CONFIRMED or (same and b.previous != a.previous):
            continue
        b.voiced &= index != heir
        _drop(index, w)
    if heir >= 0:
        _take_name(a, w.tracks[heir])


@bare
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


@inlined
def purge(w: World) -> None:
    """When there are more tracks than the capacity, the least likely young ones go."""
    if w.books.size[N_TRACKS] - w.books.size[N_DEAD] > w.par.max_tracks:
        _purge(w)


@owning
def _purge(w: World) -> None:
    size, tracks = w.books.size, w.tracks
    score, index, n = np.empty(size[N_TRACKS]), np.empty(size[N_TRACKS], np.int64), 0
    for i in range(size[N_TRACKS]):
        if tracks[i].level != CONFIRMED and not tracks[i].dead:
            score[n], index[n] = tracks[i].score, i
            n += 1
    excess = size[N_TRACKS] - size[N_DEAD] - int(_PURGE * w.par.max_tracks)
    for k in np.argsort(score[:n], kind="mergesort")[:excess]:
        track = tracks[index[k]]
        if track.voiced:
            _report(track, _DELETED, NO, NO, w.pool[0], math.nan, NO, track.t, w.par, w.books)
        _kill(track, index[k], w.books)
        w.books.tally[C_CAPPED] += 1
