"""Birth, promotion, coasting and death of tracks, counted in passes of the beam; their rows."""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.core.messages import TrackStatus
from radar_console.estimation.kalman import predict_in_place
from radar_console.tracker import filters, gating
from radar_console.tracker.records import (
    C_BLANKED,
    C_CONFIRMED,
    C_DELETED,
    C_LOST,
    CONFIRMED,
    N_EDGES,
    N_ROWS,
    N_SLOTS,
    N_TRACKS,
    STARTER,
    TENTATIVE,
    Belief,
)

_wrap, _too_fast, _start_belief = gating.wrap, gating.too_fast, filters.start
_TURN = 2.0 * math.pi
_FIRST_SCORE = math.log(0.1 / 0.9)  # one plot in ten is a new target's
_TENTATIVE, _CONFIRMED = int(TrackStatus.TENTATIVE), int(TrackStatus.CONFIRMED)
_COASTING, _DELETED = int(TrackStatus.COASTING), int(TrackStatus.DELETED)


@njit(cache=True, nogil=True, error_model="numpy")
def begin(tracks: Any, plot: Any, par: Any, rows: Any, size: Any) -> None:
    """Start a track from a plot: position the plot's, velocity unknown within the largest speed.

    The speeds fill a disc of radius `max_speed`, whose standard deviation is half of that in each
    axis; the second plot is taken in by the Kalman update, which makes it the two-point start.
    """
    track = tracks[size[N_TRACKS]]
    size[N_TRACKS] += 1
    track.id, track.born, track.t = plot.ordinal, plot.t, plot.t
    x, P = track.x, track.P
    x[0], x[1], x[2], x[3] = plot.e, plot.n, 0.0, 0.0
    for i in range(4):
        for j in range(4):
            P[i, j] = 0.0
    P[0, 0], P[0, 1], P[1, 0], P[1, 1] = plot.ee, plot.en, plot.en, plot.nn
    P[2, 2] = P[3, 3] = 0.25 * par.max_speed * par.max_speed
    track.sd_range, track.sd_azimuth = plot.sd_range, plot.sd_azimuth
    track.psi = plot.phi
    track.wake_angle, track.wake_time = -math.inf, -math.inf
    track.score, track.level = _FIRST_SCORE, STARTER
    track.history, track.passes, track.misses = 1, 1, 0
    track.last, track.previous = plot.ordinal, -1
    track.slot, track.mode_3a, track.place, track.first = -1, plot.mode_3a, -1, -1
    track.swept = track.served = track.dead = track.claims = False
    report(track, _TENTATIVE, True, True, plot, 1.0, False, plot.t, 0.0, rows, size)


@njit(cache=True, nogil=True, error_model="numpy")
def serve(
    track: Any, index: int, hit: bool, seen: bool, plot: Any, probability: float, rough: bool, beam: Any,
    par: Any, belief: Belief, blank: Any, rows: Any, size: Any, count: Any,
) -> None:  # fmt: skip
    """Account for one pass of the beam over a track.

    `seen`: there was a plot in the gate, and the state is at its time; otherwise the state is left
    as it was. A pass over a blanked sector without a plot is no miss: the radar did not look.
    """
    t_pass = track.t if seen else max(beam.t - max(track.rho, 0.0) / par.bin * beam.step, track.t)
    T = t_pass - track.t
    e, n = track.x[0] + T * track.x[2] - beam.e, track.x[1] + T * track.x[3] - beam.n
    crossed = beam.phi - track.rho
    track.psi += _TURN + _wrap(math.atan2(e, n) - track.psi)
    track.served, track.claims = True, False
    track.wake_angle = -math.inf
    if not seen and blank[math.floor(crossed / par.bin) % blank.size]:
        count[C_BLANKED] += 1
        return
    track.passes += 1
    track.history = ((track.history << 1) | (1 if hit else 0)) & ((1 << par.confirm_passes) - 1)
    track.misses = 0 if hit else track.misses + 1
    if seen:
        track.sd_range = max(plot.sd_range, 0.9 * track.sd_range)
        track.sd_azimuth = max(plot.sd_azimuth, 0.9 * track.sd_azimuth)
        if plot.mode_3a >= 0 and hit:
            track.mode_3a = plot.mode_3a
        if hit:
            track.previous, track.last = track.last, plot.ordinal
    status = _promote(track, hit, beam, par, belief, index, size, count)
    report(track, status, hit, seen, plot, probability, rough, t_pass, par.q, rows, size)


@njit(cache=True, nogil=True, error_model="numpy")
def _promote(
    track: Any, hit: bool, beam: Any, par: Any, belief: Belief, index: int, size: Any, count: Any,
) -> int:  # fmt: skip
    """Confirm, coast or delete; the status after this pass."""
    if track.level == CONFIRMED:
        # A young track that its misses make less likely than a fresh plot goes before its time.
        if track.misses >= par.delete_misses or track.score < _FIRST_SCORE:
            track.dead = True
            count[C_LOST] += 1
            return _DELETED
        return _CONFIRMED if hit else _COASTING
    hits, left = 0, track.history
    while left:
        hits += left & 1
        left >>= 1
    if (
        track.level == TENTATIVE
        and hit
        and not _too_fast(track, par)
        and hits >= par.confirm_hits
        and track.score >= par.confirm_score
    ):
        track.level, track.slot = CONFIRMED, size[N_SLOTS]
        belief.owner[track.slot] = index
        size[N_SLOTS] += 1
        _start_belief(track, beam.e, beam.n, par, belief)
        count[C_CONFIRMED] += 1
        return _CONFIRMED
    if hits + max(par.confirm_passes - track.passes, 0) < par.confirm_hits or _too_fast(track, par):
        track.dead = True
        count[C_DELETED] += 1
        return _DELETED
    return _TENTATIVE


@njit(cache=True, nogil=True, error_model="numpy")
def report(
    track: Any, status: int, hit: bool, seen: bool, plot: Any, probability: float, rough: bool, t: float,
    q: float, rows: Any, size: Any,
) -> None:  # fmt: skip
    """Write a row of the TRACK table; a track whose pass saw nothing is predicted to the pass."""
    row = rows[size[N_ROWS]]
    size[N_ROWS] += 1
    x, P = track.x.copy(), track.P.copy()
    predict_in_place(x, P, max(t - track.t, 0.0), q)
    row.track, row.time, row.status, row.hit = track.id, t, status, hit
    row.east, row.north, row.v_east, row.v_north = x[0], x[1], x[2], x[3]
    row.sd_east, row.sd_north = math.sqrt(max(P[0, 0], 0.0)), math.sqrt(max(P[1, 1], 0.0))
    row.sd_v_east, row.sd_v_north = math.sqrt(max(P[2, 2], 0.0)), math.sqrt(max(P[3, 3], 0.0))
    row.up = row.v_up = row.sd_up = row.sd_v_up = np.nan
    row.plot, row.plot_time, row.probability = -1, np.nan, np.nan
    if seen:
        row.plot, row.plot_time, row.probability = plot.ordinal, plot.t, probability
    row.born, row.approximate, row.mode_3a = track.born, rough, track.mode_3a


@njit(cache=True, nogil=True, error_model="numpy")
def remove(index: int, tracks: Any, edges: Any, belief: Belief, size: Any) -> None:
    """Take a track out; the last one moves into the hole, and so does what it believes."""
    slot = tracks[index].slot
    if slot >= 0:
        last = size[N_SLOTS] - 1
        if slot != last:
            _move(belief, last, slot)
            tracks[belief.owner[slot]].slot = slot
        size[N_SLOTS] = last
    last = size[N_TRACKS] - 1
    if index != last:
        tracks[index] = tracks[last]
        if tracks[index].slot >= 0:
            belief.owner[tracks[index].slot] = index
        for k in range(size[N_EDGES]):
            if edges[k].track == last:
                edges[k].track = index
    size[N_TRACKS] = last


@njit(cache=True, nogil=True, error_model="numpy")
def _move(belief: Belief, source: int, target: int) -> None:
    belief.owner[target] = belief.owner[source]
    belief.particles[target], belief.weights[target] = belief.particles[source], belief.weights[source]
    belief.model[target] = belief.model[source]
    belief.x[target], belief.P[target] = belief.x[source], belief.P[source]
    belief.mu[target] = belief.mu[source]
