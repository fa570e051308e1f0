"""The compiled heart: tracks served bin by bin as the beam passes.

At a bin's end each track that the calendar has there is asked where the beam stands relative to its
own next pass (ρ), and how wide its gate is (h). Between ρ = -h and ρ = h it claims plots. When the
beam is past the gates of all confirmed tracks that share plots, their association is solved and each
is served: exactly once a pass. Young tracks come after them, each on its own.
"""

import math
from typing import Any

import numpy as np

from radar_console.tracker import agenda, clusters, clutter, gating, labels, management, order, youth
from radar_console.tracker.kernels import bare, inlined, owning
from radar_console.tracker.records import (
    N_EDGES,
    N_MEMBERS,
    N_OPEN,
    N_PAIRS,
    N_PAST,
    N_PHASE,
    N_POOL,
    N_QUEUE,
    N_ROWS,
    N_SLOTS,
    N_TRACKS,
    NIL,
    World,
)

_turn_page, _tear, _rest, _at_once = agenda.turn_page, agenda.tear, agenda.rest, agenda.at_once
_look, _density, _drift, _MARGIN = gating.look, gating.density, gating.drift, gating.MARGIN
_group, _weigh, _associate, _step = clusters.group, clusters.weigh, clusters.associate, clusters.step
_serve_members, _settle_young, _retire, _purge = (
    clusters.serve_members,
    youth.settle,
    youth.retire,
    youth.purge,
)
_relabel = labels.relabel
_bury, _turn_to = management.bury, clutter.turn_to
_survey, _forget = clutter.survey, clutter.forget
_ascending = order.ascending

_FRESH, _FOUND, _OPENED = range(3)


@bare
def sweep(beams: Any, queue: Any, w: World, final: bool) -> int:
    """Process bins until one needs larger tables (`w.need`); the number of bins that are done.

    `final` closes what the beam has passed without waiting for its competitors (the end of a stream).
    """
    for b in range(beams.size):
        if not open_bin(beams[b], queue, w, final):
            return b
        members = w.books.size[N_MEMBERS]
        if members:
            _weigh(w, NIL, members)
            _associate(w)
            _step(w, NIL, members)
        close_bin(beams[b], w, final)
    return int(beams.size)


@bare
def open_bin(beam: Any, queue: Any, w: World, final: bool) -> bool:
    """Gate the bin's plots, and find the clusters to associate; False if there is no room for them."""
    size, need = w.books.size, w.need
    for k in range(need.size):
        need[k] = size[k]
    if size[N_PHASE] == _FRESH:
        _find_open(beam, w)
        size[N_PHASE] = _FOUND
    if size[N_PHASE] == _FOUND:
        if not _gate(beam, queue, w):
            return False
        cell = math.floor(beam.phi / w.par.bin - 0.5)
        w.books.blank[cell % w.books.blank.size] = not beam.seen
        _link(w)
        _group(beam, w, final)
        size[N_PHASE] = _OPENED
    need[N_MEMBERS], need[N_PAIRS] = size[N_MEMBERS], size[N_PAIRS]
    return bool(size[N_PAIRS] <= w.pairs.size)


@bare
def close_bin(beam: Any, w: World, final: bool) -> None:
    """Let tracks exchange particles, serve confirmed and young ones, let plots go, bury the dead."""
    _relabel(w)
    _serve_members(beam, w)
    _settle_young(beam, w, final)
    _retire(beam, w)
    for place in range(w.books.size[N_OPEN]):
        track = w.tracks[w.opened[place]]
        if track.served:
            track.served = track.swept = False
    _purge(w)
    _bury(w)
    _turn_to(w.clutter, beam.phi)
    _forget(beam.phi, w)
    w.books.size[N_PHASE] = _FRESH


@inlined
def _find_open(beam: Any, w: World) -> None:
    """List the tracks whose gates the beam has reached and that were not served since."""
    n, width = 0, w.par.bin
    after = _turn_page(beam, width, w.books)
    while after >= 0:
        index = after
        after = _tear(index, w.books)
        track = w.tracks[index]
        angle, time = _look(track, beam, w.par)
        if angle > beam.phi:
            _rest(index, angle, time, width, w.books)
        else:
            _at_once(index, w.books)
        if track.claims or track.rho >= -track.half_width - _MARGIN:
            track.place, track.first = n, -1
            w.opened[n] = index
            n += 1
    w.books.size[N_OPEN] = n


@inlined
def _gate(beam: Any, queue: Any, w: World) -> bool:
    """Take the bin's plots from the queue, and join each to the tracks in whose gates it is.

    False if there is no room for them.
    """
    size, need, par = w.books.size, w.need, w.par
    begin = stop = size[N_QUEUE]
    while stop < queue.size and queue[stop].phi < beam.phi:
        stop += 1
    n, opened, first, count = stop - begin, size[N_OPEN], size[N_POOL], size[N_EDGES]
    if n > 0 and opened > 0:
        count = _join(queue[begin:stop], beam, w)
    # Every starter's edge may make a branch, every plot a starter.
    need[N_EDGES], need[N_POOL] = count, first + n
    need[N_TRACKS] = size[N_TRACKS] + count + first + n
    need[N_ROWS] = size[N_ROWS] + opened + 2 * (count + first + n) + _purged(need[N_TRACKS], par)
    need[N_SLOTS] = size[N_SLOTS] + min(opened + count, first + n)  # a plot confirms one at most
    need[N_MEMBERS] = opened
    need[N_PAST] = size[N_PAST] + n
    if (
        count > w.edges.size
        or need[N_PAST] > w.past.size
        or need[N_POOL] > w.pool.size
        or need[N_TRACKS] > w.tracks.size
        or need[N_ROWS] > w.books.rows.size
        or need[N_SLOTS] > w.belief.owner.size
        or need[N_MEMBERS] > w.members.size
    ):
        return False
    for k in range(n):
        w.pool[first + k] = queue[begin + k]
        _survey(w.pool[first + k], beam, w)
    size[N_POOL], size[N_EDGES], size[N_QUEUE] = first + n, count, stop
    for place in range(opened):
        track = w.tracks[w.opened[place]]
        track.swept = track.rho >= track.half_width + _MARGIN
    return True


@owning
def _join(fresh: Any, beam: Any, w: World) -> int:
    """Join the plots that are `fresh` to tracks; how many edges there are then, with or without room.

    The plots of a bin are close in angle; in range, each track finds its own by bisection.
    """
    size, par, edges, n = w.books.size, w.par, w.edges, fresh.size
    distance, lag = np.empty(n), 0.0
    for k in range(n):
        e, north = fresh[k].e - beam.e, fresh[k].n - beam.n
        distance[k] = math.sqrt(e * e + north * north)
        lag = max(lag, abs(beam.t - fresh[k].t))
    by_range = _ascending(distance)
    distance = distance[by_range]
    first, count = size[N_POOL], size[N_EDGES]
    for place in range(size[N_OPEN]):
        index = w.opened[place]
        track = w.tracks[index]
        if track.swept:
            continue
        r, along = track.range, track.along + _drift(track, lag)
        i = np.searchsorted(distance, r - along)
        while i < n and distance[i] <= r + along:
            plot = fresh[by_range[i]]
            i += 1
            phase = track.rho - (beam.phi - plot.phi)
            if not -math.pi <= phase <= math.pi:
                continue
            likelihood = _density(track, plot, par)
            if likelihood > 0.0:
                if count < edges.size:
                    edge = edges[count]
                    edge.track, edge.plot, edge.density = index, first + by_range[i - 1], likelihood
                    edge.spent = False
                count += 1
                track.claims = True
    return int(count)


@bare
def _purged(tracks: int, par: Any) -> int:
    """Rows that the end of the capacity may need."""
    return tracks if tracks > par.max_tracks else 0


@inlined
def _link(w: World) -> None:
    """Chain each track's edges, in the order in which they came."""
    for k in range(w.books.size[N_EDGES] - 1, -1, -1):
        edge = w.edges[k]
        if not edge.spent:
            track = w.tracks[edge.track]
            edge.next, track.first = track.first, k


__all__ = ["close_bin", "open_bin", "sweep"]
