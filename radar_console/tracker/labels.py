"""Which particles are whose, among tracks that share plots: set JPDA.

Between the scans tracks are taken as independent. Two of them that both may be at either of two places
would drift together, though one is here and one is there whichever way round. So joint events are drawn,
each particle of a track is put beside those of the others that stand for the same event, and two tracks
exchange the particles where that leaves both clouds tighter. Who is who is given up for where they are.

Source: Svensson, Svensson, Guerriero, Willett, Set JPDA filter for multitarget tracking, IEEE T-SP
59(10), 2011. There all labels of Gaussian hypotheses are permuted, here those of particles, by pairs.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation import draws
from radar_console.estimation.draws import Singles
from radar_console.estimation.gaussian import Array
from radar_console.tracker import cloud, manoeuvres
from radar_console.tracker.association import choose, events
from radar_console.tracker.association.pairs import Ints
from radar_console.tracker.kernels import bare, owning
from radar_console.tracker.records import ADAPTED, N_MEMBERS, N_PAIRS, NIL, PARTICLE, World

_key, _mix, _uniforms = draws.key, draws.mix, draws.uniforms
_draw, _plain, _take_moments = events.draw, manoeuvres.plain, cloud.take_moments
_SET_JPDA = choose.SET_JPDA
_RELABEL = 1 << 43  # added to the pass: random key of the events
_LEAST_GAIN = 1e-3  # of the squared distance between the means: less is not worth an exchange
_APART = 1.05  # mean square of the differences to the square of their mean, below which clouds lie apart
_UNLIKE = 1.5  # ratio of what two filters leave open, beyond which their particles are not of one kind
_POWER, _TURNS = 12, 3  # iterations of the main axis, and of the dividing direction

Places = NDArray[np.int32]


@bare
def relabel(w: World) -> None:
    """Exchange particles among the swept members of each cluster, after their update."""
    par, stop = w.par, w.books.size[N_MEMBERS]
    if par.associator != _SET_JPDA or par.filter != PARTICLE or par.proposal != ADAPTED or not _plain(par):
        return
    lo = NIL
    while lo < stop:
        hi = lo + 1
        while hi < stop and w.members[hi].cluster == w.members[lo].cluster:
            hi += 1
        if hi > lo + 1:
            _relabel(lo, hi, w)
        lo = hi


@owning
def _relabel(lo: int, hi: int, w: World) -> None:
    m, pool, par, particles = hi - lo, w.pool, w.par, w.belief.particles
    total = 0
    for i in range(m):
        total += w.members[lo + i].kept
    row, col, weight, first = (
        np.empty(total, np.int64),
        np.empty(total, np.int64),
        np.empty(total),
        np.empty(m, np.int64),
    )
    end = w.members[hi].pairs if hi < w.books.size[N_MEMBERS] else w.books.size[N_PAIRS]
    for k in range(w.members[lo].pairs, end):
        pool[w.pairs[k].plot].mark = -1
    n, plots = 0, 0
    for i in range(m):
        member = w.members[lo + i]
        first[i] = n
        for k in range(member.pairs, member.pairs + member.kept):
            plot = pool[w.pairs[k].plot]
            if plot.mark < 0:
                plot.mark = plots
                plots += 1
            row[n], col[n], weight[n] = i, plot.mark, w.pairs[k].w
            n += 1
    count = particles.shape[2]
    choice, known = np.empty((m, count), np.int32), np.zeros(m, np.bool_)
    head = w.tracks[w.members[lo].track]
    key = _key(par.seed, head.id, head.passes + _RELABEL)
    _draw(np.full(m, 1.0 - par.p_d * par.p_g), plots, row, col, weight, key, choice, known)
    lot = np.empty(count, np.float32)
    changed = np.zeros(m, np.bool_)
    for i in range(m):
        track = w.tracks[w.members[lo + i].track]
        # A target that says who it is stays under its label.
        known[i] &= track.swept and track.first >= 0 and track.address < 0 and track.mode_3a < 0
        if known[i]:
            key = _mix(key)
            _uniforms(key, lot)
            _place(choice[i], first[i], w.members[lo + i].kept, lot)
    claimant = np.zeros(plots, np.bool_)
    for i in range(m):
        if not known[i]:
            continue
        claimant[:] = False
        for k in range(first[i], first[i] + w.members[lo + i].kept):
            claimant[col[k]] = True
        for k in range(i + 1, m):
            if known[k] and _share(claimant, col[first[k] : first[k] + w.members[lo + k].kept]):
                a, b = w.tracks[w.members[lo + i].track], w.tracks[w.members[lo + k].track]
                if exchange(a, b, choice[i], choice[k], par, w.belief):
                    changed[i] = changed[k] = True
    for i in range(m):
        if changed[i]:
            _take_moments(w.tracks[w.members[lo + i].track], par, w.belief)


@njit(cache=True, nogil=True)
def _share(claimant: NDArray[np.bool_], col: Ints) -> bool:
    shared = False
    for c in col:
        shared |= claimant[c]
    return shared


@njit(cache=True, nogil=True, error_model="numpy")
def _place(choice: Places, first: int, kept: int, lot: Singles) -> None:
    """Turn a track's choices into particles: those of one alternative stand together, no plot first.

    Which of them it is is random. The counts of an alternative differ by the noise of the draws, so that
    a few particles at the seams stand for a neighbour.
    """
    count = choice.size
    shuffled, begin = np.arange(count), np.zeros(kept + 2, np.int64)
    for a in range(count - 1, 0, -1):
        k = min(int(lot[a] * (a + 1)), a)
        shuffled[a], shuffled[k] = shuffled[k], shuffled[a]
    for a in range(count):
        choice[a] = max(choice[a] - first + 1, 0)
        begin[choice[a] + 1] += 1
    for j in range(kept + 1):
        begin[j + 1] += begin[j]
    for event in shuffled:
        alternative = choice[event]
        choice[event] = begin[alternative]
        begin[alternative] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def exchange(a: Any, b: Any, mine: Places, yours: Places, par: Any, belief: Any) -> bool:
    """Let the tracks `a` and `b` exchange the particles whose exchange makes their clouds tighter; did any?

    Particle mine[k] of the one and yours[k] of the other belong to one event. The sum of the clouds'
    variances, of position and of what the velocity makes of it in a turn, is a constant less half the
    squared distance of their means, so the labels are chosen by a direction along which the differences lie.
    """
    p, q, S, R = belief.particles[a.slot], belief.particles[b.slot], belief.P[a.slot, 0], belief.P[b.slot, 0]
    for axis in range(2):
        if not (S[axis, axis] <= _UNLIKE * R[axis, axis] and R[axis, axis] <= _UNLIKE * S[axis, axis]):
            return False
    c, s = a.cos * b.cos + a.sin * b.sin, a.sin * b.cos - a.cos * b.sin  # turns b's axes into a's
    lag, base = a.t - b.t, np.empty(4)
    _offset(a, b, lag, base)
    count, horizon = mine.size, max(par.turn, 0.0)
    there, D = np.empty((4, count), np.float32), np.empty((4, count), np.float32)
    for k in range(count):
        i = yours[k]
        for x in (0, 2):
            there[x, k] = c * q[x, i] + s * q[x + 1, i] + base[x]
            there[x + 1, k] = c * q[x + 1, i] - s * q[x, i] + base[x + 1]
        for x in range(2):
            there[x, k] += lag * (there[2 + x, k] - base[2 + x])
            D[x, k] = p[x, mine[k]] - there[x, k]
            D[2 + x, k] = horizon * (p[2 + x, mine[k]] - there[2 + x, k])
    side = np.empty(4)
    if not _divide(D, side):
        return False
    other = 0
    for k in range(count):
        other += not _kept(D, side, k)
    if 2 * other > count:  # rather the fewer
        side *= -1.0
    for k in range(count):
        if _kept(D, side, k):
            continue
        i, h = mine[k], yours[k]
        e, n, ve, vn = p[0, i], p[1, i], p[2, i], p[3, i]
        for x in range(4):
            p[x, i] = there[x, k]
        ve -= base[2]
        vn -= base[3]
        e -= base[0] + lag * ve
        n -= base[1] + lag * vn
        q[0, h], q[1, h] = c * e - s * n, s * e + c * n
        q[2, h], q[3, h] = c * ve - s * vn, s * ve + c * vn
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _offset(a: Any, b: Any, lag: float, base: Array) -> None:
    """The anchor of `b`, moved by `lag`, from that of `a`, in the axes of `a`."""
    for x in (0, 2):
        e, n = b.anchor[x] - a.anchor[x], b.anchor[x + 1] - a.anchor[x + 1]
        if x == 0:
            e += lag * b.anchor[2]
            n += lag * b.anchor[3]
        base[x], base[x + 1] = a.sin * e + a.cos * n, a.cos * e - a.sin * n


@njit(cache=True, nogil=True, error_model="numpy")
def _kept(D: Singles, side: Array, k: int) -> bool:
    return bool(side[0] * D[0, k] + side[1] * D[1, k] + side[2] * D[2, k] + side[3] * D[3, k] >= 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _divide(D: Singles, side: Array) -> bool:
    """Fill `side` (4,), the direction whose signs of D (4, K) make |E ±D| large.

    False if +1 for all is as good. It begins at the mean, and at the main axis, of the differences; then
    come by turns the signs that a direction gives, and the direction of the mean with these signs.
    """
    count = D.shape[1]
    mean, C, square = np.zeros(4), np.zeros((4, 4)), 0.0
    for x in range(4):
        total = 0.0
        for k in range(count):
            total += D[x, k]
            square += D[x, k] * D[x, k]
        mean[x] = total / count
    now = mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2 + mean[3] ** 2
    if square / count < _APART * now:
        return False
    for x in range(4):
        for y in range(x + 1):
            total = 0.0
            for k in range(count):
                total += D[x, k] * D[y, k]
            C[x, y] = C[y, x] = total / count
    best, v, e = now, np.empty(4), np.empty(4)
    for start in range(2):
        if start == 0:
            v[:] = mean
        else:
            _main_axis(C, v)
        for _ in range(_TURNS):
            e[:] = 0.0
            for k in range(count):
                sign = 1.0 if _kept(D, v, k) else -1.0
                for x in range(4):
                    e[x] += sign * D[x, k]
            far = (e[0] ** 2 + e[1] ** 2 + e[2] ** 2 + e[3] ** 2) / count**2
            if far > best:
                best = far
                side[:] = v
            v[:] = e
    return bool(best > (1.0 + _LEAST_GAIN) * now)


@njit(cache=True, nogil=True, error_model="numpy")
def _main_axis(C: Array, v: Array) -> None:
    """Fill `v` (4,) with the direction of the largest eigenvalue of C (4, 4), by powers."""
    u, most = np.empty(4), 0
    for x in range(1, 4):
        if C[x, x] > C[most, most]:
            most = x
    v[:] = C[most]
    for _ in range(_POWER):
        size = 0.0
        for x in range(4):
            u[x] = C[x, 0] * v[0] + C[x, 1] * v[1] + C[x, 2] * v[2] + C[x, 3] * v[3]
            size += u[x] * u[x]
        if not size > 0.0:
            return
        size = 1.0 / math.sqrt(size)
        for x in range(4):
            v[x] = u[x] * size


__all__ = ["exchange", "relabel"]
