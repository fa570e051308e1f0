"""Birth, promotion, coasting and death of tracks, counted in passes of the beam; their rows."""

import math
from typing import Any

import numpy as np

from radar_console.core.messages import TrackStatus
from radar_console.estimation.gaussian import Array
from radar_console.tracker import agenda, clutter, filters, gating, height, identity
from radar_console.tracker.kernels import bare, inlined, owning
from radar_console.tracker.records import (
    AUTO,
    B_CURVE,
    B_E,
    B_N,
    B_REACH,
    B_REACH_T,
    B_REACH_TT,
    B_ROOT,
    B_T,
    B_V_E,
    B_V_N,
    BRANCHING,
    C_BLANKED,
    C_CONFIRMED,
    C_DELETED,
    C_LOST,
    CONFIRMED,
    M_OF_N,
    N_DEAD,
    N_EDGES,
    N_ROWS,
    N_SLOTS,
    N_TRACKS,
    NO,
    PARTICLE,
    SCORE,
    STARTER,
    TENTATIVE,
    WHEREABOUTS,
    YES,
    Belief,
    Books,
    World,
    variable,
)

_too_fast, _predicted, _place, _turned = gating.too_fast, gating.predicted, gating.place, gating.turned
_resting, _start_belief = gating.resting, filters.start
_enter, _rest, _leave, _move_entry = agenda.enter, agenda.rest, agenda.leave, agenda.move
_gather = clutter.gather
_height, _begin_height, _learn = height.predicted, height.begin, identity.learn
_TURN = 2.0 * math.pi
FIRST_SCORE = math.log(0.1 / 0.9)  # one plot in ten is a new target's
_FIRST_SCORE = FIRST_SCORE
DROP = 4.6  # of the score from its peak, after which a young track is given up: odds of 1 to 100
_DENSER = math.log(10.0)  # what dense clutter adds to the score that confirms
_DOUBT = 0.1  # and more for each pass: what an error of the density by a tenth adds to a false score
_LEAST_HITS = 3
_LEAST_LOG_MISS = math.log(1e-3)
_WIDER = 3.0  # velocities at confirmation: so young an estimate errs more than its covariance says
_TENTATIVE = variable(TrackStatus.TENTATIVE)
_CONFIRMED = variable(TrackStatus.CONFIRMED)
_COASTING = variable(TrackStatus.COASTING)
_DELETED = variable(TrackStatus.DELETED)


@bare
def begin(plot: Any, dense: bool, w: World) -> None:
    """Start a track from a plot: position the plot's, velocity unknown within the largest speed.

    The speeds fill a disc of radius `max_speed`, whose standard deviation is half of that in each
    axis; the second plot is taken in by the Kalman update, which makes it the two-point start.
    """
    index = w.books.size[N_TRACKS]
    track, par = w.tracks[index], w.par
    w.books.size[N_TRACKS] += 1
    _enter(index, w.books)
    track.id, track.root, track.born, track.t = plot.ordinal, plot.ordinal, plot.t, plot.t
    x, P = track.x, track.P
    x[0], x[1], x[2], x[3] = plot.e, plot.n, 0.0, 0.0
    for i in range(4):
        for j in range(4):
            P[i, j] = 0.0
    P[0, 0], P[0, 1], P[1, 0], P[1, 1] = plot.ee, plot.en, plot.en, plot.nn
    P[2, 2] = P[3, 3] = 0.25 * par.max_speed * par.max_speed
    track.curve[0] = track.curve[1] = track.growth[1] = 0.0
    track.growth[0] = track.growth[2] = par.q / 3.0
    track.sd_range, track.sd_azimuth = plot.sd_range, plot.sd_azimuth
    track.psi, track.u_e, track.u_n = plot.phi, math.sin(plot.phi), math.cos(plot.phi)
    track.score, track.level = _FIRST_SCORE, STARTER
    track.peak = track.score
    track.history, track.passes, track.hits, track.misses = 1, 1, 1, 0
    track.last, track.previous = plot.ordinal, -1
    track.slot, track.place, track.first, track.s_e = -1, -1, -1, np.nan
    track.mode_3a, track.agreed, track.address = plot.mode_3a, 1, plot.address
    track.near = track.exposure = 0.0
    _begin_height(track, plot)
    track.dense, track.voiced = dense, True
    track.swept = track.served = track.dead = track.claims = track.proven = False
    report(track, _TENTATIVE, YES, YES, plot, 1.0, NO, plot.t, par, w.books)


@bare
def kill(track: Any, index: int, books: Books) -> None:
    """Have the track buried at the end of the bin."""
    if not track.dead:
        track.dead = track.served = True
        books.dead[books.size[N_DEAD]] = index
        books.size[N_DEAD] += 1


@bare
def serve(
    track: Any, index: int, hit: bool, seen: bool, plot: Any, probability: float, rough: bool, beam: Any,
    par: Any, books: Books,
) -> None:  # fmt: skip
    """Account for one pass of the beam over a track.

    `seen`: there was a plot in the gate, and the state is at its time; otherwise the state is left
    as it was. A pass over a blanked sector without a plot is no miss: the radar did not look.
    """
    t_pass = track.t if seen else max(beam.t - max(track.rho, 0.0) / par.bin * beam.step, track.t)
    e, n = _place(track, t_pass - track.t)
    de, dn = e - beam.e, n - beam.n
    r, crossed = math.sqrt(de * de + dn * dn), beam.phi - track.rho
    track.psi += _TURN + _turned(track, de, dn)
    if r > 0.0:
        track.u_e, track.u_n, track.turned = de / r, dn / r, 0.0
    track.served, track.claims = True, False
    if not seen:  # the gate is what it was, a turn on
        track.rho -= _TURN
        angle, time = _resting(track, beam, par)
        if angle > beam.phi:
            _rest(index, angle, time, par.bin, books)
    if not seen and books.blank[math.floor(crossed / par.bin) % books.blank.size]:
        books.tally[C_BLANKED] += 1
        return
    track.passes += 1
    if seen:
        _gather(track, plot)
    track.history = ((track.history << 1) | (1 if hit else 0)) & ((1 << par.confirm_passes) - 1)
    track.misses = 0 if hit else track.misses + 1
    if seen:
        track.sd_range = max(plot.sd_range, 0.9 * track.sd_range)
        track.sd_azimuth = max(plot.sd_azimuth, 0.9 * track.sd_azimuth)
        if track.level == CONFIRMED:
            note(track, books)
    if hit:
        track.hits += 1
        track.previous, track.last = track.last, plot.ordinal
        _learn(track, plot)
    status = (
        _keep(track, index, hit, par, books)
        if track.level == CONFIRMED
        else _judge(track, index, hit, par, books)
    )
    track.probability = probability
    if track.voiced and not track.proven:
        report(track, status, hit, seen, plot, probability, rough, t_pass, par, books)


@bare
def note(track: Any, books: Books) -> None:
    """Keep where a confirmed track is where all can be looked through in one go, see `may_be_near`.

    In T seconds its position's deviation grows by no more than T times its velocity's, and what the
    forecast adds, √(g T³), is no more than √g (T + T²) / 2.
    """
    x, P, curve, growth, row = track.x, track.P, track.curve, track.growth, books.whereabouts[track.slot]
    row[B_ROOT], row[B_T], row[B_E], row[B_N], row[B_V_E], row[B_V_N] = (
        track.root,
        track.t,
        x[0],
        x[1],
        x[2],
        x[3],
    )
    half = 0.5 * math.sqrt(max(growth[0] + growth[2], 0.0))
    row[B_REACH] = math.sqrt(max(P[0, 0] + P[1, 1], 0.0))
    row[B_REACH_T] = math.sqrt(max(P[2, 2] + P[3, 3], 0.0)) + half
    row[B_REACH_TT] = half
    row[B_CURVE] = 0.5 * math.hypot(curve[0], curve[1])


@bare
def may_be_near(slot: int, track: Any, spread: float, sigmas: float, books: Books) -> bool:
    """The confirmed track of a slot may be within so many deviations of the other, whose own is `spread`."""
    row = books.whereabouts[slot]
    T = max(track.t - row[B_T], 0.0)
    reach = (
        sigmas * (spread + row[B_REACH] + T * (row[B_REACH_T] + T * row[B_REACH_TT])) + T * T * row[B_CURVE]
    )
    de, dn = row[B_E] + T * row[B_V_E] - track.x[0], row[B_N] + T * row[B_V_N] - track.x[1]
    return bool(not de * de + dn * dn > reach * reach)


@bare
def _highest_score(par: Any) -> float:
    """The score that `delete_misses` misses in a row, and no fewer, take away."""
    highest: float = _FIRST_SCORE - (par.delete_misses + 0.5) * max(par.log_miss, _LEAST_LOG_MISS)
    return highest


@bare
def _keep(track: Any, index: int, hit: bool, par: Any, books: Books) -> int:
    """Coast or delete a confirmed track; its status after this pass.

    Its score is held below what `delete_misses` misses in a row take away, so that they delete it,
    and so does evidence that says less and less for the target: in dense clutter there is always
    some plot in the gate.
    """
    track.score = min(track.score, max(_highest_score(par), par.confirm_score))
    if track.misses >= par.delete_misses or track.score < _FIRST_SCORE:
        kill(track, index, books)
        books.tally[C_LOST] += 1
        return _DELETED
    return _CONFIRMED if hit else _COASTING


@bare
def _judge(track: Any, index: int, hit: bool, par: Any, books: Books) -> int:
    """Find a young track proven, or delete it; its status after this pass."""
    track.peak = max(track.peak, track.score)
    moves = track.level == TENTATIVE
    fast = moves and _too_fast(track, par)
    ripe = moves and hit and track.hits >= _LEAST_HITS
    track.proven = ripe and not fast and _proven(track, par)
    if not track.proven and (fast or _hopeless(track, par)):
        kill(track, index, books)
        books.tally[C_DELETED] += track.voiced
        return _DELETED
    return _TENTATIVE


@bare
def confirm(index: int, plot: Any, beam: Any, w: World) -> None:
    """Promote a proven track, whose last plot is `plot`."""
    track, size = w.tracks[index], w.books.size
    if not track.voiced:
        # The number of its first plot is another branch's; no track starts from this plot.
        track.id, track.voiced = plot.ordinal, True
    track.proven, track.peak = False, track.score
    track.level, track.slot = CONFIRMED, size[N_SLOTS]
    w.belief.owner[track.slot] = index
    size[N_SLOTS] += 1
    report(track, _CONFIRMED, YES, YES, plot, track.probability, NO, track.t, w.par, w.books)
    if w.par.filter == PARTICLE:
        _widen(track.P)
    _start_belief(track, beam.e, beam.n, w.par, w.belief)
    note(track, w.books)
    w.books.tally[C_CONFIRMED] += 1


@bare
def _widen(P: Array) -> None:
    """Let the velocities of P (4, 4) err `_WIDER` times as much."""
    for i in range(4):
        for j in range(4):
            P[i, j] *= (_WIDER if i > 1 else 1.0) * (_WIDER if j > 1 else 1.0)


@bare
def adopt(index: int, sensor_e: float, sensor_n: float, w: World) -> None:
    """Have the filter take over a track whose moments are given."""
    track, par = w.tracks[index], w.par
    track.curve[0] = track.curve[1] = track.growth[1] = 0.0
    track.growth[0] = track.growth[2] = par.q / 3.0
    track.score = track.peak = max(_highest_score(par), par.confirm_score)
    track.level, track.slot = CONFIRMED, w.books.size[N_SLOTS]
    w.belief.owner[track.slot] = index
    _enter(index, w.books)
    w.books.size[N_SLOTS] += 1
    w.books.size[N_TRACKS] += 1
    _start_belief(track, sensor_e, sensor_n, par, w.belief)
    note(track, w.books)


@bare
def by_score(track: Any, par: Any) -> bool:
    """Evidence alone decides on the track: by name, or in dense clutter."""
    named = par.initiation == SCORE or par.initiation == BRANCHING
    return bool(named or (par.initiation == AUTO and track.dense))


@bare
def _recent_hits(track: Any) -> int:
    hits, left = 0, track.history
    while left:
        hits += left & 1
        left >>= 1
    return hits


@bare
def _proven(track: Any, par: Any) -> bool:
    """The track is a target's."""
    counted = _recent_hits(track) >= par.confirm_hits
    if par.initiation == M_OF_N:
        return bool(counted)
    scored = track.score >= par.confirm_score
    if par.initiation == SCORE:
        return bool(scored)
    if by_score(track, par):
        enough = par.confirm_score + _DENSER + _DOUBT * track.passes
        return bool(track.score >= enough)
    return bool(counted and scored)


@bare
def _hopeless(track: Any, par: Any) -> bool:
    """The young track will not be confirmed."""
    if by_score(track, par):
        return bool(track.score < track.peak - DROP)
    return bool(_recent_hits(track) + max(par.confirm_passes - track.passes, 0) < par.confirm_hits)


@bare
def report(
    track: Any, status: int, hit: bool, seen: bool, plot: Any, probability: float, rough: bool, t: float,
    par: Any, books: Books,
) -> None:  # fmt: skip
    """Write a row of the TRACK table; a track whose pass saw nothing is predicted to the pass."""
    row = books.rows[books.size[N_ROWS]]
    books.size[N_ROWS] += 1
    x, P, T = track.x, track.P, max(t - track.t, 0.0)
    e, n, ee, _, nn = _predicted(track, T)
    row.track, row.time, row.status, row.hit = track.id, t, status, hit
    row.east, row.north = e, n
    row.v_east, row.v_north = x[2] + T * track.curve[0], x[3] + T * track.curve[1]
    row.sd_east, row.sd_north = math.sqrt(max(ee, 0.0)), math.sqrt(max(nn, 0.0))
    row.sd_v_east = math.sqrt(max(P[2, 2] + 3.0 * T * track.growth[0], 0.0))
    row.sd_v_north = math.sqrt(max(P[3, 3] + 3.0 * T * track.growth[2], 0.0))
    up, v_up, pp, _, vv = _height(track, t, par.up_q)
    row.up, row.v_up = up, v_up
    known = math.isfinite(up)
    row.sd_up, row.sd_v_up = math.sqrt(pp) if known else np.nan, math.sqrt(vv) if known else np.nan
    row.plot, row.plot_time, row.probability = -1, np.nan, np.nan
    if seen:
        row.plot, row.plot_time, row.probability = plot.ordinal, plot.t, probability
    row.born, row.approximate, row.mode_3a = track.born, rough, track.mode_3a


@inlined
def bury(w: World) -> None:
    """Take the dead out; the last tracks move into the holes, and so does what they believe."""
    size, tracks, belief, edges = w.books.size, w.tracks, w.belief, w.edges
    count = size[N_DEAD]
    if count == 0:
        return
    for k in range(count):
        _leave(w.books.dead[k], w.books)
        slot = tracks[w.books.dead[k]].slot
        if slot >= 0:
            last = size[N_SLOTS] - 1
            if slot != last:
                _move(belief, last, slot)
                for column in range(WHEREABOUTS):
                    w.books.whereabouts[slot, column] = w.books.whereabouts[last, column]
                tracks[belief.owner[slot]].slot = slot
            tracks[w.books.dead[k]].slot = -1
            size[N_SLOTS] = last
    n = 0
    for k in range(size[N_EDGES]):
        if not tracks[edges[k].track].dead:
            if n != k:
                edges[n] = edges[k]
            n += 1
    size[N_EDGES] = n
    left = size[N_TRACKS] - count
    mover = size[N_TRACKS] - 1
    for k in range(count):
        index = w.books.dead[k]
        if index >= left:
            continue
        while tracks[mover].dead:
            mover -= 1
        tracks[mover].place = index  # for its edges
        tracks[index] = tracks[mover]
        _move_entry(mover, index, w.books)
        if tracks[index].slot >= 0:
            belief.owner[tracks[index].slot] = index
        mover -= 1
    for k in range(n):
        if edges[k].track >= left:
            edges[k].track = tracks[edges[k].track].place
    size[N_TRACKS], size[N_DEAD] = left, 0


@owning
def _move(belief: Belief, source: int, target: int) -> None:
    belief.owner[target] = belief.owner[source]
    belief.particles[target], belief.weights[target] = belief.particles[source], belief.weights[source]
    belief.model[target] = belief.model[source]
    belief.x[target], belief.P[target] = belief.x[source], belief.P[source]
    belief.mu[target] = belief.mu[source]
