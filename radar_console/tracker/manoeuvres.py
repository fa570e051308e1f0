"""Several motion models in one set of particles: each particle has its own, and its own manoeuvre.

A particle is in one of the models of `par.model`; the first is that of undisturbed flight. Behind
position and velocity it carries the rate of its turn (rad/s) if one of the models is CT, and then its
acceleration (m/s², two rows) if one is CA or SINGER, all in the track's axes; 0 in the other models.

The turn rate of CT and the acceleration of SINGER decay with `manoeuvre_time` and are driven to their
rms; the acceleration of CA is driven by white jerk of density 2 σ²/τ. The particles draw them; white
noise of position and velocity is left to the rest S. In a set of several models that noise is CV's
for all, so that one S serves all.

A target leaves model k with rate `leave[k]`, to each of the others alike. So few particles do so in one
interval that a manoeuvre would be met by a handful: more are sent, and their weights are corrected.

Sources: McGinnity and Irwin, Multiple model bootstrap filter for maneuvering target tracking, IEEE
T-AES 36(3), 2000 (a model in each particle); Singer, Estimating optimal tracking filter performance for
manned maneuvering targets, IEEE T-AES 6(4), 1970; Bar-Shalom, Li, Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, (8.2.3-1) and (11.7.1-4).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation import draws
from radar_console.estimation.draws import Singles
from radar_console.estimation.gaussian import Array
from radar_console.tracker.records import CA, CT, CV, SINGER

Models = NDArray[np.uint8]

_half_turn, _uniforms, _pairs_of_normals, _mix = (
    draws.half_turn,
    draws.uniforms,
    draws.pairs_of_normals,
    draws.mix,
)

_LEAST_LEAVING = 0.15  # of the particles, sent from each model to the others whatever the rate
_SMALL = 0.01  # T/τ below which Singer's noise is that of white jerk: the closed form cancels
_STILL = np.float32(1e-4)  # half a turn's angle that is none
_PI = np.float32(math.pi)
_INVERSE_PI = np.float32(1.0 / math.pi)
_ONE, _HALF = np.float32(1.0), np.float32(0.5)

# Columns of a table of models over an interval: by what the turn rate decays, and the deviation that drives
# it; the same of the acceleration; what the old and the new acceleration do to position and velocity; the
# probability that the model is left.
TURN_DECAY, TURN_SD, PULL_DECAY, PULL_SD, P_OLD, P_NEW, V_OLD, V_NEW, LEAVE = range(9)
_COLUMNS = 9


def rows(models: Sequence[int]) -> int:
    """Rows that a particle needs for these motion models (CV, CA, CT, SINGER)."""
    return 4 + (CT in models) + 2 * (CA in models or SINGER in models)


@njit(cache=True, nogil=True, error_model="numpy")
def plain(par: Any) -> bool:
    """Undisturbed flight is all there is."""
    return bool(par.models == 1 and par.model[0] == CV)


@njit(cache=True, nogil=True, error_model="numpy")
def _has(par: Any, a: int, b: int) -> bool:
    found = False
    for k in range(par.models):
        found = found or par.model[k] == a or par.model[k] == b
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _singer(T: float, tau: float, Q: Array) -> None:
    """Covariance Q (3, 3) of position, velocity and acceleration over `T` s, for unit jerk density."""
    a = T / tau
    if a < _SMALL:
        Q[0, 0], Q[0, 1], Q[0, 2] = T**5 / 20.0, T**4 / 8.0, T**3 / 6.0
        Q[1, 1], Q[1, 2], Q[2, 2] = T**3 / 3.0, T**2 / 2.0, T
        return
    e = math.exp(-a)
    Q[0, 0] = 0.5 * tau**5 * (1.0 - e * e + 2.0 * a + 2.0 * a**3 / 3.0 - 2.0 * a * a - 4.0 * a * e)
    Q[0, 1] = 0.5 * tau**4 * (e * e + 1.0 - 2.0 * e + 2.0 * a * e - 2.0 * a + a * a)
    Q[0, 2] = 0.5 * tau**3 * (1.0 - e * e - 2.0 * a * e)
    Q[1, 1] = 0.5 * tau**3 * (4.0 * e - 3.0 - e * e + 2.0 * a)
    Q[1, 2] = 0.5 * tau**2 * (e * e + 1.0 - 2.0 * e)
    Q[2, 2] = 0.5 * tau * (1.0 - e * e)


@njit(cache=True, nogil=True, error_model="numpy")
def _prepare(par: Any, T: float, Q: Array, table: Singles) -> None:
    """Fill `table` (models, 9) for `T` s, and the noise Q (2, 2) of position and velocity.

    An acceleration that goes from a to a' moves the particle by its mean course between the two; what
    the course wanders about that (Brownian or Ornstein-Uhlenbeck bridge) is noise.
    """
    q, tau, q3 = par.q, par.manoeuvre_time, np.zeros((3, 3))
    Q[0, 0], Q[0, 1], Q[1, 0], Q[1, 1] = q * T**3 / 3.0, q * T * T / 2.0, q * T * T / 2.0, q * T
    table[:] = np.float32(0.0)
    for k in range(par.models):
        model = par.model[k]
        table[k, LEAVE] = -math.expm1(-par.leave[k] * T) if par.models > 1 else 0.0
        decay = 1.0 if model == CA else math.exp(-T / tau)
        if model == CT:
            table[k, TURN_DECAY], table[k, TURN_SD] = decay, par.turn_rate * math.sqrt(1.0 - decay * decay)
        elif model in (CA, SINGER):
            jerk = 2.0 * par.manoeuvre * par.manoeuvre / tau
            _singer(T, math.inf if model == CA else tau, q3)
            if model == CA or T < _SMALL * tau:
                p, v = T * T / 2.0, T
            else:
                p, v = tau * tau * (T / tau - 1.0 + decay), tau * (1.0 - decay)
            b_p, b_v = (q3[0, 2] / q3[2, 2], q3[1, 2] / q3[2, 2]) if T > 0.0 else (0.0, 0.0)
            table[k, PULL_DECAY], table[k, PULL_SD] = decay, math.sqrt(jerk * q3[2, 2])
            table[k, P_OLD], table[k, P_NEW] = p - decay * b_p, b_p
            table[k, V_OLD], table[k, V_NEW] = v - decay * b_v, b_v
            if par.models == 1:
                Q[0, 0] = jerk * max(q3[0, 0] - b_p * q3[0, 2], 0.0)
                Q[0, 1] = Q[1, 0] = jerk * (q3[0, 1] - b_p * q3[1, 2])
                Q[1, 1] = jerk * max(q3[1, 1] - b_v * q3[1, 2], 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def start(particles: Singles, model: Models, key: Any, par: Any) -> None:
    """Draw models by the part of its time that a target spends in each, and manoeuvres by their rms."""
    count, total = model.size, 0.0
    share = np.ones(par.models)
    for k in range(par.models):
        if par.models > 1:
            share[k] = 1.0 / par.leave[k]
        total += share[k]
    lot = np.empty(count, np.float32)
    _uniforms(key, lot)
    for i in range(count):
        k, left = 0, lot[i] * total - share[0]
        while left >= 0.0 and k < par.models - 1:
            k += 1
            left -= share[k]
        model[i] = k
    _engage(particles, model, np.ones(count, np.bool_), _mix(key), par)


@njit(cache=True, nogil=True, error_model="numpy")
def _engage(particles: Singles, model: Models, fresh: Any, key: Any, par: Any) -> None:
    """Give the `fresh` particles the manoeuvre of their model."""
    count = model.size
    a, b = np.empty(count, np.float32), np.empty(count, np.float32)
    _pairs_of_normals(key, a, b)
    turns, pulls = _has(par, CT, CT), _has(par, CA, SINGER)
    row = 5 if turns else 4
    for i in range(count):
        if not fresh[i]:
            continue
        kind = par.model[model[i]]
        if turns:
            particles[4, i] = par.turn_rate * a[i] if kind == CT else 0.0
        if pulls:
            rms = par.manoeuvre if kind in (CA, SINGER) else 0.0
            particles[row, i] = rms * a[i]
            particles[row + 1, i] = rms * b[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _switch(particles: Singles, weights: Singles, model: Models, table: Singles, key: Any, par: Any) -> None:
    """Let particles change their model; the weights take what more were sent than the rates ask for."""
    count, others = model.size, par.models - 1
    lot, fresh, any_fresh = np.empty(count, np.float32), np.zeros(count, np.bool_), False
    _uniforms(key, lot)
    sent, leaving, staying = np.empty(par.models), np.empty(par.models), np.empty(par.models)
    for k in range(par.models):
        p = float(table[k, LEAVE])
        sent[k] = max(p, _LEAST_LEAVING) if p > 0.0 else 0.0
        leaving[k], staying[k] = p / sent[k] if p > 0.0 else 0.0, (1.0 - p) / max(1.0 - sent[k], 1e-300)
    total = 0.0
    for i in range(count):
        k = model[i]
        if lot[i] < sent[k]:
            step = 1 + min(int(lot[i] / sent[k] * others), others - 1)
            model[i] = (k + step) % par.models
            weights[i] *= leaving[k]
            fresh[i] = any_fresh = True
        else:
            weights[i] *= staying[k]
        total += weights[i]
    scale = np.float32(1.0 / total)
    for i in range(count):
        weights[i] *= scale
    if any_fresh:
        _engage(particles, model, fresh, _mix(key), par)


@njit(cache=True, nogil=True, error_model="numpy")
def straight(particles: Singles, T: float) -> None:
    """Move the particles along their velocities for `T` s."""
    step = np.float32(T)
    for axis in range(2):
        p, v = particles[axis], particles[2 + axis]
        for i in range(p.size):
            p[i] += step * v[i]


@njit(cache=True, nogil=True, error_model="numpy")
def advance(
    particles: Singles,
    weights: Singles,
    model: Models,
    velocity: Array,
    T: float,
    key: Any,
    par: Any,
    Q: Array,
) -> None:
    """Move the particles over `T` s; Q (2, 2) is filled with the noise that is still to come.

    `velocity` (2,) is what the particles' velocities are offsets from, in their axes: a turn turns both,
    while what the positions are offsets from is expected to move straight.
    """
    table = np.empty((par.models, _COLUMNS), np.float32)
    _prepare(par, T, Q, table)
    if plain(par):
        straight(particles, T)
    else:
        if par.models > 1:
            _switch(particles, weights, model, table, _mix(key), par)
        a, b = np.empty(model.size, np.float32), np.empty(model.size, np.float32)
        turns = _has(par, CT, CT)
        old = np.empty((2, model.size), np.float32)
        if turns:
            _pairs_of_normals(_mix(key + np.uint64(1)), a, b)
            _drive(particles[4], model, table, TURN_DECAY, TURN_SD, a, old[0])
            _turn(particles, velocity, old[0], T)
        else:
            straight(particles, T)
        if _has(par, CA, SINGER):
            _pairs_of_normals(_mix(key + np.uint64(2)), a, b)
            row = 5 if turns else 4
            for axis in range(2):
                noise = a if axis == 0 else b
                _drive(particles[row + axis], model, table, PULL_DECAY, PULL_SD, noise, old[axis])
                _pull(particles, axis, old[axis], particles[row + axis], model, table)


@njit(cache=True, nogil=True, error_model="numpy")
def _drive(
    parameter: Singles, model: Models, table: Singles, decay: int, sd: int, noise: Singles, old: Singles
) -> None:
    """Let a parameter of the manoeuvres decay and be driven, by these columns; `old` keeps what it was."""
    for i in range(parameter.size):
        k = model[i]
        old[i] = parameter[i]
        parameter[i] = table[k, decay] * old[i] + table[k, sd] * noise[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(particles: Singles, velocity: Array, old: Singles, T: float) -> None:
    """Move along arcs for `T` s, at the mean of the old and the new rate."""
    p_a, p_b, v_a, v_b, rate = particles[0], particles[1], particles[2], particles[3], particles[4]
    step, u_a, u_b = np.float32(T), np.float32(velocity[0]), np.float32(velocity[1])
    quarter = np.float32(0.25 * T)
    for i in range(rate.size):
        along, aside, c, s = _arc(quarter * (old[i] + rate[i]))
        a, b = u_a + v_a[i], u_b + v_b[i]
        p_a[i] += step * (along * a - aside * b - u_a)
        p_b[i] += step * (aside * a + along * b - u_b)
        v_a[i] = c * a - s * b - u_a
        v_b[i] = s * a + c * b - u_b


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _arc(h: Any) -> Any:
    """Of a turn by the angle 2 h: chord along and across the first course, of the arc's length 1, and
    cosine and sine of the whole angle."""
    # Half a turn more changes the signs of both sine and cosine; the products don't depend on it.
    s, c = _half_turn(h - _PI * np.float32(math.floor(h * _INVERSE_PI + _HALF)))
    part = s / h if abs(h) > _STILL else c
    return part * c, part * s, _ONE - (s * s + s * s), s * c + s * c


@njit(cache=True, nogil=True, error_model="numpy")
def _pull(particles: Singles, axis: int, old: Singles, new: Singles, model: Models, table: Singles) -> None:
    """What the acceleration adds to position and velocity along one axis."""
    p, v = particles[axis], particles[2 + axis]
    for i in range(old.size):
        k = model[i]
        p[i] += table[k, P_OLD] * old[i] + table[k, P_NEW] * new[i]
        v[i] += table[k, V_OLD] * old[i] + table[k, V_NEW] * new[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _openness(par: Any, T: float, table: Singles, lateral: Singles, everyway: Singles) -> None:
    """Variance that is still to come to a particle of each model by its manoeuvre.

    Fill `lateral` (models,), in units of its speed squared, across its course, and `everyway` (models,).
    """
    fresh = np.zeros((par.models, 2))
    for k in range(par.models):
        kind = par.model[k]
        lateral[k] = everyway[k] = 0.0
        stay = 1.0 - float(table[k, LEAVE])
        if kind == CT:
            rho, sd, reach = float(table[k, TURN_DECAY]), float(table[k, TURN_SD]), 0.25 * T * T
            lateral[k] = stay * (reach * sd) ** 2
            fresh[k, 0] = (reach * (1.0 + rho) * par.turn_rate) ** 2 + (reach * sd) ** 2
        elif kind in (CA, SINGER):
            rho, sd = float(table[k, PULL_DECAY]), float(table[k, PULL_SD])
            old, new = float(table[k, P_OLD]), float(table[k, P_NEW])
            everyway[k] = stay * (new * sd) ** 2
            fresh[k, 1] = ((old + rho * new) * par.manoeuvre) ** 2 + (new * sd) ** 2
    for k in range(par.models):
        for other in range(par.models):
            if other != k:
                part = float(table[k, LEAVE]) / (par.models - 1)
                lateral[k] += part * fresh[other, 0]
                everyway[k] += part * fresh[other, 1]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def forecast(
    particles: Singles,
    weights: Singles,
    model: Models,
    velocity: Array,
    T: float,
    par: Any,
    mean: Array,
    cov: Array,
    Q: Array,
) -> None:
    """Moments of the positions that `advance` would give after `T` s, without its noise Q (2, 2).

    `mean` (2,) and `cov` (3,), aa, ab, bb, are filled. What turns do is taken to first order where it
    is not yet drawn.
    """
    models = par.models
    table = np.empty((models, _COLUMNS), np.float32)
    lateral, everyway = np.empty(models, np.float32), np.empty(models, np.float32)
    _prepare(par, T, Q, table)
    _openness(par, T, table, lateral, everyway)
    turns, pulls = _has(par, CT, CT), _has(par, CA, SINGER)
    row = 5 if turns else 4
    step, quarter = np.float32(T), np.float32(0.25 * T)
    u_a, u_b = np.float32(velocity[0]), np.float32(velocity[1])
    p_a, p_b, v_a, v_b, rate = particles[0], particles[1], particles[2], particles[3], particles[4]
    pull_a, pull_b = (particles[row], particles[row + 1]) if pulls else (rate, rate)
    ahead_a, ahead_b = np.empty(model.size, np.float32), np.empty(model.size, np.float32)
    open_aa = open_ab = open_bb = mean_a = mean_b = np.float32(0.0)
    for i in range(model.size):
        k, w = model[i], weights[i]
        a, b = u_a + v_a[i], u_b + v_b[i]
        m_a = m_b = np.float32(0.0)
        if turns:
            along, aside, _, _ = _arc(quarter * (_ONE + table[k, TURN_DECAY]) * rate[i])
            m_a += step * (along * a - aside * b - a)
            m_b += step * (aside * a + along * b - b)
        if pulls:
            pull = table[k, P_OLD] + table[k, PULL_DECAY] * table[k, P_NEW]
            m_a += pull * pull_a[i]
            m_b += pull * pull_b[i]
        stay = _ONE - table[k, LEAVE]
        part = stay * table[k, LEAVE]
        ahead_a[i] = p_a[i] + step * v_a[i] + stay * m_a
        ahead_b[i] = p_b[i] + step * v_b[i] + stay * m_b
        mean_a += w * ahead_a[i]
        mean_b += w * ahead_b[i]
        open_aa += w * (part * m_a * m_a + lateral[k] * b * b + everyway[k])
        open_ab += w * (part * m_a * m_b - lateral[k] * a * b)
        open_bb += w * (part * m_b * m_b + lateral[k] * a * a + everyway[k])
    for i in range(model.size):
        a, b, w = ahead_a[i] - mean_a, ahead_b[i] - mean_b, weights[i]
        open_aa += w * a * a
        open_ab += w * a * b
        open_bb += w * b * b
    mean[0], mean[1] = mean_a, mean_b
    cov[0], cov[1], cov[2] = open_aa, open_ab, open_bb
