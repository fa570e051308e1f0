"""A confirmed track's particles: drawn, predicted, weighed and updated, in the track's own axes.

What the particles leave open is in `belief.P[slot, 0]` (2, 2), the rest S of `estimation.particle`.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation import draws, particle, resampling
from radar_console.estimation.draws import Singles
from radar_console.estimation.gaussian import Array
from radar_console.estimation.resampling import Indices
from radar_console.tracker import manoeuvres
from radar_console.tracker.records import ADAPTED, PRIOR, Belief

_key, _mix, _uniforms, _pairs_of_normals = draws.key, draws.mix, draws.uniforms, draws.pairs_of_normals
_systematic_pairs, _resample = resampling.systematic_pairs, resampling.resample
_draw, _grow, _diffuse, _cholesky = particle.draw, particle.grow, particle.diffuse, particle.cholesky
_weigh, _condition, _given_position = particle.weigh, particle.condition, particle.given_position
_condition_on_nothing, _propose = particle.condition_on_nothing, particle.propose
_shake, _gather, _centre = particle.shake, particle.gather, particle.centre
_normalise, _regularise = particle.normalise, particle.regularise
_begin_manoeuvres, _move, _forecast = manoeuvres.start, manoeuvres.advance, manoeuvres.forecast
_plain = manoeuvres.plain
_MEASURED, _TERMS, _BROAD = particle.MEASURED, particle.TERMS, particle.BROAD
_Z_A, _Z_B, _Z_RATE, _Z_LAG = particle.Z_A, particle.Z_B, particle.Z_RATE, particle.Z_LAG
_Z_U, _Z_V = particle.Z_U, particle.Z_V

# Added to the pass: random keys of what else happens in it.
_UPDATE, _PARTING, _START = 1 << 40, 1 << 42, 1 << 41
_KERNEL = 0.25
# The adapted filter parts few particles and widely: a mode stays narrow, and a lost target is found again.
_PARTED_OF = 4  # one of so many
_WIDE_KERNEL = 0.7
OPEN_SHARE = 0.9  # of the least variance of the plots: a little is drawn along all the axes
_FLAT = 1e-4  # of the product of the variances: a determinant below it is rounding's
_NEARLY = 0.999  # of the velocity's variance is left open at the start: what is drawn is no singular cloud
_SD_DOPPLER = 2.0  # m/s, where a plot does not say
_LEAST_GROWTH = 1e-3  # of that by white acceleration

OPEN = (1, 2, 2)
"""Shape of a track's row of `belief.P`."""

rows = manoeuvres.rows


@njit(cache=True, nogil=True, error_model="numpy")
def start(track: Any, sensor_e: float, sensor_n: float, par: Any, belief: Belief) -> None:
    """Draw the particles from the track's Gaussian; their first axis is its bearing."""
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    model, S = belief.model[track.slot], belief.P[track.slot, 0]
    x = track.x
    r = math.hypot(x[0] - sensor_e, x[1] - sensor_n)
    track.sin = (x[0] - sensor_e) / r if r > 0.0 else 0.0
    track.cos = (x[1] - sensor_n) / r if r > 0.0 else 1.0
    P, L = np.empty((4, 4)), np.empty((4, 4))
    for i in range(4):
        track.anchor[i] = x[i]
    _turn(track.P, track.cos, track.sin, P)
    S[:] = 0.0
    if par.proposal == ADAPTED:
        S[1, 1] = _NEARLY * _least_velocity_variance(P)
        P[2, 2] -= S[1, 1]
        P[3, 3] -= S[1, 1]
    _cholesky(P, L)
    key = _key(par.seed, track.id, track.passes + _START)
    _draw(particles, L, key, belief.table)
    weights[:] = np.float32(1.0 / weights.size)
    model[:] = 0
    if not _plain(par):
        _begin_manoeuvres(particles, model, _mix(key), par)
    take_moments(track, par, belief)


@njit(cache=True, nogil=True, error_model="numpy")
def _least_velocity_variance(P: Array) -> float:
    """Least eigenvalue of the velocity's covariance given the position."""
    det = P[0, 0] * P[1, 1] - P[0, 1] * P[0, 1]
    if not det > 0.0:
        return 0.0
    C = np.empty((2, 2))
    for i in range(2):
        g_a = (P[1, 1] * P[2 + i, 0] - P[0, 1] * P[2 + i, 1]) / det
        g_b = (P[0, 0] * P[2 + i, 1] - P[0, 1] * P[2 + i, 0]) / det
        for k in range(2):
            C[i, k] = P[2 + i, 2 + k] - g_a * P[2 + k, 0] - g_b * P[2 + k, 1]
    middle = 0.5 * (C[0, 0] + C[1, 1])
    least: float = max(middle - math.hypot(0.5 * (C[0, 0] - C[1, 1]), C[0, 1]), 0.0)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def advance(track: Any, t: float, par: Any, belief: Belief) -> None:
    """Predict the moments by the forecast, the anchor and the particles, to the time `t`."""
    T = t - track.t
    if not T > 0.0:
        return
    slot, anchor = track.slot, track.anchor
    particles, S = belief.particles[slot], belief.P[slot, 0]
    key = _key(par.seed, track.id, track.passes)
    Q, velocity = np.empty((2, 2)), np.empty(2)
    _to_axes(track, anchor[2], anchor[3], velocity)
    _move(particles, belief.weights[slot], belief.model[slot], velocity, T, key, par, Q)
    anchor[0] += T * anchor[2]
    anchor[1] += T * anchor[3]
    _grow(S, T, Q)
    if par.proposal == PRIOR:
        noise = np.empty((4, particles.shape[1]), np.float32)
        _noise(_mix(key), noise)
        _diffuse(particles, S, noise)
    _extrapolate(track, T)
    track.t = t


@njit(cache=True, nogil=True, error_model="numpy")
def _extrapolate(track: Any, T: float) -> None:
    """Carry the moments on by the track's own forecast."""
    x, P, curve, growth = track.x, track.P, track.curve, track.growth
    for axis in range(2):
        x[axis] += T * (x[2 + axis] + 0.5 * T * curve[axis])
        x[2 + axis] += T * curve[axis]
    for i in range(4):  # F P
        P[0, i] += T * P[2, i]
        P[1, i] += T * P[3, i]
    for i in range(4):  # (F P) Fᵀ
        P[i, 0] += T * P[i, 2]
        P[i, 1] += T * P[i, 3]
    for i in range(2):
        for k in range(2):
            g = growth[i + k]
            P[i, k] += g * T * T * T
            P[i, 2 + k] += 1.5 * g * T * T
            P[2 + k, i] += 1.5 * g * T * T
            P[2 + i, 2 + k] += 3.0 * g * T


@njit(cache=True, nogil=True, error_model="numpy")
def log_likelihood(track: Any, plot: Any, par: Any, belief: Belief, relative: Singles) -> tuple[float, float]:
    """log ĝ of the plot, m⁻² (with a range rate per m/s), and Σ w `relative` (2, N); see `particle.weigh`."""
    z, R = np.empty(_MEASURED, np.float32), np.empty(3)
    r = _measure(track, plot, par, z, R)
    slot = track.slot
    return _weigh(
        belief.particles[slot], belief.weights[slot], belief.P[slot, 0], z, R, r, par.outliers, relative
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _measure(track: Any, plot: Any, par: Any, z: Singles, R: Array) -> float:
    """Fill the plot's `z` and `R` in the track's axes; variance of its range rate, infinite without."""
    anchor, axes = track.anchor, np.empty(2)
    lag = plot.t - track.t
    _to_axes(track, plot.e - anchor[0] - lag * anchor[2], plot.n - anchor[1] - lag * anchor[3], axes)
    z[_Z_A], z[_Z_B], z[_Z_RATE], z[_Z_LAG], z[_Z_U], z[_Z_V] = axes[0], axes[1], 0.0, lag, 1.0, 0.0
    c, s = track.cos, track.sin
    R[0] = s * s * plot.ee + 2.0 * s * c * plot.en + c * c * plot.nn
    R[1] = s * c * (plot.ee - plot.nn) + (c * c - s * s) * plot.en
    R[2] = c * c * plot.ee - 2.0 * s * c * plot.en + s * s * plot.nn
    de, dn = plot.e - plot.s_e, plot.n - plot.s_n
    distance = math.hypot(de, dn)
    if not par.use_doppler or not math.isfinite(plot.doppler) or distance == 0.0:
        return math.inf
    _to_axes(track, de / distance, dn / distance, axes)
    z[_Z_U], z[_Z_V] = axes[0], axes[1]
    z[_Z_RATE] = plot.doppler - (de * anchor[2] + dn * anchor[3]) / distance
    sd = plot.sd_doppler if plot.sd_doppler > 0.0 and math.isfinite(plot.sd_doppler) else _SD_DOPPLER
    return float(sd * sd)


@njit(cache=True, nogil=True, error_model="numpy")
def update(
    track: Any,
    miss: float,
    beta: Array,
    total: Array,
    relative: Singles,
    chosen: Any,
    pool: Any,
    par: Any,
    belief: Belief,
) -> None:
    """Condition on alternative plots, take the moments, and make a forecast.

    The particles' weights become w (β_0 + Σ_j β_j g_j / ĝ_j). The bootstrap filter resamples them when
    N_eff is low. With the other proposals each new particle comes from a pair of an old one and a plot,
    such as it claims to be or an outlier, or none, and its position is drawn from the pair's posterior;
    the adapted filter resamples the pairs.

    Parameters
    ----------
    miss : β_0
    beta, total : (plots,) β_j, and Σ w `relative`_j
    relative : (plots, 2, N) likelihoods of the particles, up to a factor: as claimed, and as an outlier
    chosen : (plots,) rows of the plots in `pool`
    """
    weights = belief.weights[track.slot]
    key = _key(par.seed, track.id, track.passes + _UPDATE)
    terms = np.empty((1 + 2 * beta.size, weights.size), np.float32)
    everything = _pair_weights(weights, miss, beta, total, relative, terms)
    if not everything > 0.0:
        return
    if par.proposal == PRIOR:
        _sum_alternatives(terms, weights)
        effective = _normalise(weights)
        take_moments(track, par, belief)
        if effective < par.resample_below * weights.size:
            _resample_cloud(track, key, par, belief)
    else:
        effective = _effective(terms, everything) if par.proposal == ADAPTED else math.inf
        _propose_cloud(track, terms, everything, chosen, pool, key, par, belief)
        take_moments(track, par, belief)
        # The shape of a cloud that is here or there, as those in a crowd often are, is too wide for a kernel.
        if effective < par.resample_below * weights.size and not track.crowded:
            _part_copies(track, key, par, belief)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _pair_weights(
    weights: Singles, miss: float, beta: Array, total: Array, relative: Singles, terms: Singles
) -> float:
    """Fill `terms` (1 + 2 plots, N) with β_0 w, and for each plot twice β_j w g_j / ĝ_j; their sum.

    The two are of g_j's parts, the plot such as it claims to be, and an outlier.
    """
    nothing, everything = np.float32(miss), 0.0
    first = terms[0]
    for i in range(weights.size):
        first[i] = nothing * weights[i]
        everything += first[i]
    for j in range(beta.size):
        scale = np.float32(beta[j] / total[j])
        for part in range(2):
            row, g = terms[1 + 2 * j + part], relative[j, part]
            for i in range(weights.size):
                row[i] = scale * weights[i] * g[i]
                everything += row[i]
    return everything


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _effective(terms: Singles, everything: float) -> float:
    """Effective number of the particles, by their weights over all alternatives; the sum is `everything`."""
    together = terms[0].copy()
    for row in range(1, terms.shape[0]):
        term = terms[row]
        for i in range(together.size):
            together[i] += term[i]
    squares = 0.0
    for i in range(together.size):
        squares += together[i] * together[i]
    return everything * everything / squares


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_alternatives(terms: Singles, weights: Singles) -> None:
    weights[:] = terms[0]
    for row in range(1, terms.shape[0]):
        term = terms[row]
        for i in range(weights.size):
            weights[i] += term[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _resample_cloud(track: Any, key: Any, par: Any, belief: Belief) -> None:
    """Resample by the scheme of the settings, and part the copies."""
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    model, count = belief.model[track.slot], weights.size
    ancestors, scratch = np.empty(count, np.int32), np.empty(particles.shape, np.float32)
    _resample(par.resampling, weights, key, ancestors)
    _gather(particles, ancestors, scratch)
    particles[:] = scratch
    model[:] = model[ancestors]
    weights[:] = np.float32(1.0 / count)
    _part_copies(track, key, par, belief)


@njit(cache=True, nogil=True, error_model="numpy")
def _part_copies(track: Any, key: Any, par: Any, belief: Belief) -> None:
    """Part the copies of particles by a kernel, whose shape is the cloud's own covariance, P less S.

    The particles of one ancestor stand together, so that one in a few is an even share of them all.
    """
    adapted, S, cov = par.proposal == ADAPTED, belief.P[track.slot, 0], np.empty((4, 4))
    width = _WIDE_KERNEL if adapted else _KERNEL
    particles = belief.particles[track.slot][:, :: _PARTED_OF if adapted else 1]
    _turn(track.P, track.cos, track.sin, cov)
    for axis in range(2):
        whole = cov[axis, axis] * cov[2 + axis, 2 + axis]
        cov[axis, axis] -= S[0, 0]
        cov[axis, 2 + axis] -= S[0, 1]
        cov[2 + axis, axis] -= S[0, 1]
        cov[2 + axis, 2 + axis] -= S[1, 1]
        # A cloud that rounding leaves without a spread of its own has no shape to part its copies by.
        shape = cov[axis, axis] * cov[2 + axis, 2 + axis] - cov[axis, 2 + axis] ** 2
        if not (cov[axis, axis] > 0.0 and shape > _FLAT * whole):
            return
    scratch = np.empty((4, particles.shape[1]), np.float32)
    _regularise(particles, cov, width, _mix(key + np.uint64(5)), belief.table, scratch)


@njit(cache=True, nogil=True, error_model="numpy")
def _propose_cloud(
    track: Any, terms: Singles, everything: float, chosen: Any, pool: Any, key: Any, par: Any, belief: Belief
) -> None:
    """Draw new particles from the pairs of an alternative and an old particle."""
    particles, weights = belief.particles[track.slot], belief.weights[track.slot]
    model, S, count, m = belief.model[track.slot], belief.P[track.slot, 0], weights.size, chosen.size
    ancestors, bounds = np.empty(count, np.int32), np.empty(len(terms) + 1, np.int64)
    if par.proposal == ADAPTED:
        _systematic_pairs(terms, everything, key, ancestors, bounds)
        weights[:] = np.float32(1.0 / count)
    else:
        _choose_pairs(terms, weights, key, par, ancestors, bounds)
    noise, parents = np.empty((4, count), np.float32), np.empty(particles.shape, np.float32)
    _pairs_of_normals(_mix(key), noise[0], noise[1])
    _gather(particles, ancestors, parents)
    for row in range(4, particles.shape[0]):
        particles[row] = parents[row]
    if not _plain(par):
        model[:] = model[ancestors]
    Z, R, r = np.empty((m, _MEASURED), np.float32), np.empty((m, 3)), np.empty(m)
    least_r = math.inf
    for j in range(m):
        r[j] = _measure(track, pool[chosen[j]], par, Z[j], R[j])
        least_r = min(least_r, r[j])
    slope, rest = _given_position(S)
    rest = 0.0 if par.proposal != ADAPTED else rest / (1.0 + rest / least_r)
    apart = _open_position(S, Z, R) if par.proposal == ADAPTED and least_r == math.inf else 0.0
    shaken = par.proposal != ADAPTED or least_r < math.inf
    if shaken:
        _pairs_of_normals(_mix(key + np.uint64(1)), noise[2], noise[3])
    how, nothing = np.empty(_TERMS, np.float32), np.zeros(_MEASURED, np.float32)
    nothing[_Z_U] = 1.0
    _condition_on_nothing(S, rest, apart, how)
    _propose_some(parents, bounds[0], bounds[1], nothing, how, noise, shaken, particles)
    for j in range(m):
        for part in range(2):
            lo, hi, scale = bounds[1 + 2 * j + part], bounds[2 + 2 * j + part], _BROAD if part else 1.0
            if lo < hi:
                _condition(S, Z[j], R[j], r[j], scale, rest, apart, how)
                _propose_some(parents, lo, hi, Z[j], how, noise, shaken, particles)
    S[0, 0] = apart
    S[0, 1] = S[1, 0] = slope * apart
    S[1, 1] = rest + slope * slope * apart


@njit(cache=True, nogil=True, error_model="numpy")
def _propose_some(
    parents: Singles, lo: int, hi: int, z: Singles, how: Singles, noise: Singles, shaken: bool,
    particles: Singles,
) -> None:  # fmt: skip
    """Draw particles `lo` to `hi`, whose alternative is the same."""
    _propose(parents, lo, hi, z, how, noise, particles)
    if shaken:
        _shake(particles, lo, hi, z, how, noise)


@njit(cache=True, nogil=True, error_model="numpy")
def _open_position(S: Array, Z: Singles, R: Array) -> float:
    """What is left open of the position's variance: less than any of the plots Z and R would leave of it."""
    left: float = S[0, 0]
    for j in range(R.shape[0]):
        lag, half = float(Z[j, _Z_LAG]), 0.5 * (R[j, 0] - R[j, 2])
        least = max(0.5 * (R[j, 0] + R[j, 2]) - math.hypot(half, R[j, 1]), 0.0)
        k = S[0, 0] + lag * S[0, 1]
        seen = k + lag * (S[0, 1] + lag * S[1, 1]) + OPEN_SHARE * least
        left = min(left, max(S[0, 0] - k * k / seen, 0.0) if seen > 0.0 else 0.0)
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def _choose_pairs(
    terms: Singles, weights: Singles, key: Any, par: Any, ancestors: Indices, bounds: Any
) -> None:
    """Resample if N_eff is low, then draw each particle's alternative; `weights` are those they go on with.

    `ancestors` (N,) and `bounds` (alternatives + 1,) are filled as by `resampling.systematic_pairs`.
    """
    count, alternatives = weights.size, terms.shape[0]
    parent, choice = np.empty(count, np.int32), np.empty(count, np.int64)
    lot, old = np.empty(count, np.float32), np.empty(count, np.float32)
    _sum_alternatives(terms, weights)
    if _normalise(weights) < par.resample_below * count:
        _resample(par.resampling, weights, _mix(key + np.uint64(3)), parent)
        weights[:] = np.float32(1.0 / count)
    else:
        for k in range(count):
            parent[k] = k
    _uniforms(_mix(key + np.uint64(4)), lot)
    bounds[:] = 0
    for k in range(count):
        together = np.float32(0.0)
        for row in range(alternatives):
            together += terms[row, parent[k]]
        row, left = 0, lot[k] * together - terms[0, parent[k]]
        while left >= 0.0 and row < alternatives - 1:
            row += 1
            left -= terms[row, parent[k]]
        choice[k] = row
        bounds[row + 1] += 1
    for row in range(alternatives):
        bounds[row + 1] += bounds[row]
    place = bounds[:-1].copy()
    old[:] = weights
    for k in range(count):
        to = place[choice[k]]
        place[choice[k]] += 1
        ancestors[to], weights[to] = parent[k], old[k]


@njit(cache=True, nogil=True, error_model="numpy")
def take_moments(track: Any, par: Any, belief: Belief) -> None:
    """The track's moments and forecast; the anchor becomes the mean."""
    slot, x, anchor, P = track.slot, track.x, track.anchor, track.P
    particles, weights, S = belief.particles[slot], belief.weights[slot], belief.P[slot, 0]
    mean, cov, axes = np.empty(4), np.empty((4, 4)), np.empty(2)
    _centre(particles, weights, mean, cov)
    for p in (0, 2):
        _to_axes(track, mean[p], mean[p + 1], axes)
        anchor[p] += axes[0]
        anchor[p + 1] += axes[1]
    for axis in range(2):
        cov[axis, axis] += S[0, 0]
        cov[axis, 2 + axis] += S[0, 1]
        cov[2 + axis, axis] += S[0, 1]
        cov[2 + axis, 2 + axis] += S[1, 1]
    x[:] = anchor
    _turn(cov, track.cos, track.sin, P)
    if _plain(par):
        track.curve[:] = 0.0
        track.growth[0] = track.growth[2] = par.q / 3.0
        track.growth[1] = 0.0
    else:
        _look_ahead(track, cov, par, belief)


@njit(cache=True, nogil=True, error_model="numpy")
def _look_ahead(track: Any, P: Array, par: Any, belief: Belief) -> None:
    """Fit the forecast to the particles' own prediction over a turn of the antenna; P (4, 4) turned."""
    slot, T = track.slot, max(par.turn, 1e-3)
    mean, cov, velocity, axes = np.empty(2), np.empty(3), np.empty(2), np.empty(2)
    Q, S = np.empty((2, 2)), belief.P[slot, 0]
    _to_axes(track, track.anchor[2], track.anchor[3], velocity)
    _forecast(
        belief.particles[slot], belief.weights[slot], belief.model[slot], velocity, T, par, mean, cov, Q
    )
    _to_axes(track, mean[0], mean[1], axes)
    for axis in range(2):
        track.curve[axis] = 2.0 * axes[axis] / (T * T)
    open_ahead = S[0, 0] + T * (2.0 * S[0, 1] + T * S[1, 1]) + Q[0, 0]
    third = 1.0 / (T * T * T)
    aa = third * (cov[0] + open_ahead - (P[0, 0] + T * (2.0 * P[0, 2] + T * P[2, 2])))
    ab = third * (cov[1] - (P[0, 1] + T * (P[0, 3] + P[1, 2] + T * P[2, 3])))
    bb = third * (cov[2] + open_ahead - (P[1, 1] + T * (2.0 * P[1, 3] + T * P[3, 3])))
    # Raise the lesser eigenvalues to a floor: what is left of the covariance must not shrink to nothing.
    least = _LEAST_GROWTH * Q[0, 0] * third
    middle, half = 0.5 * (aa + bb), math.hypot(0.5 * (aa - bb), ab)
    high, low = max(middle + half, least), max(middle - half, least)
    if half > 0.0:
        scale = 0.5 * (high - low) / half
        aa, ab, bb = (
            0.5 * (high + low) + scale * 0.5 * (aa - bb),
            scale * ab,
            0.5 * (high + low) + scale * 0.5 * (bb - aa),
        )
    else:
        aa, ab, bb = high, 0.0, high
    c, s, growth = track.cos, track.sin, track.growth
    growth[0] = s * s * aa + 2.0 * s * c * ab + c * c * bb
    growth[1] = s * c * (aa - bb) + (c * c - s * s) * ab
    growth[2] = c * c * aa - 2.0 * s * c * ab + s * s * bb


@njit(cache=True, nogil=True, error_model="numpy")
def _noise(key: Any, noise: Singles) -> None:
    """Fill `noise` (4, N) with standard normals."""
    _pairs_of_normals(key, noise[0], noise[1])
    _pairs_of_normals(_mix(key), noise[2], noise[3])


@njit(cache=True, nogil=True, error_model="numpy")
def _to_axes(track: Any, e: float, n: float, out: Array) -> None:
    """East and north to along and across the track's bearing, or back: the change is its own inverse."""
    out[0], out[1] = track.sin * e + track.cos * n, track.cos * e - track.sin * n


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(P: Array, c: float, s: float, out: Array) -> None:
    """Covariance between east-north axes and the track's; the change of axes is its own inverse."""
    half = np.empty((4, 4))
    for i in range(4):
        for p in (0, 2):
            half[i, p] = s * P[i, p] + c * P[i, p + 1]
            half[i, p + 1] = c * P[i, p] - s * P[i, p + 1]
    for i in range(4):
        for p in (0, 2):
            out[p, i] = s * half[p, i] + c * half[p + 1, i]
            out[p + 1, i] = c * half[p, i] - s * half[p + 1, i]
    for i in range(4):
        for k in range(i):
            out[k, i] = out[i, k]


__all__ = ["OPEN", "advance", "log_likelihood", "rows", "start", "take_moments", "update"]
