"""The particle filter of one track; its particles move in the plane.

Particles are float32 *offsets* (rows, N) from a float64 anchor that moves with them: east, north,
v_east, v_north, turned into axes of the track's own, so that a rotated scene is tracked alike; what
manoeuvring particles have beside these is in further rows, see `manoeuvres`. Weights (N,) are float32
and sum to 1.

A particle stands for a Gaussian: all share the *rest* S (2, 2), covariance of position and velocity
along any axis, which is what the particles leave open. The bootstrap filter [1] draws everything as it
predicts, and S is 0. With the optimal proposal [2, §V-C] the noise of one step is open until a plot has
come. The adapted filter leaves the velocity open for good (Rao and Blackwell): given the positions that
were drawn it is a Gaussian, whose covariance does not depend on the measurements [3]. Of the position it
leaves open what every posterior has, whichever plot is the target's or none; only the difference is drawn.

[1] Gordon, Salmond, Smith, Novel approach to nonlinear/non-Gaussian Bayesian state estimation,
    IEE Proc. F 140(2), 1993.
[2] Arulampalam et al., A tutorial on particle filters, IEEE T-SP 50(2), 2002.
[3] Schön, Gustafsson, Nordlund, Marginalized particle filters for mixed linear/nonlinear state-space
    models, IEEE T-SP 53(7), 2005.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from scipy.special import ndtri

from radar_console.estimation import draws
from radar_console.estimation.draws import Singles as Singles
from radar_console.estimation.gaussian import Array
from radar_console.estimation.resampling import Indices

_mix, _exponential, _of_bits = draws.mix, draws.exponential, draws.of_bits

BROAD = 64.0  # variance of an outlier, in units of the claimed one
_NORMALS_BITS = 16
_LEAST = 1e-30  # of a sum of weights
_TURN = 2.0 * math.pi
_HALF = np.float32(0.5)
# Sums in any order, so that they vectorise; the same order every time.
_SUMS = {"reassoc", "contract", "nsz"}


def normals() -> Singles:
    """The table that draws come from: the normal's 2^16 equally likely values, of unit variance.

    A draw is a look-up by 16 random bits, several times faster than a transformation; the largest
    value is 4.2, and the table's moments are the normal's to 1e-3 up to the fourth.
    """
    count = 1 << _NORMALS_BITS
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / values.std(), np.float32)


@njit(cache=True, nogil=True, error_model="numpy")
def draw(particles: Singles, L: Array, key: Any, table: Singles) -> None:
    """Fill the first rows of `particles` (≥ 4, N) from N(0, L Lᵀ), L (4, 4) lower triangular."""
    low = np.uint64(0xFFFF)
    for i in range(particles.shape[1]):
        bits = _mix(key + np.uint64(i))
        a = table[bits & low]
        b = table[(bits >> np.uint64(16)) & low]
        c = table[(bits >> np.uint64(32)) & low]
        d = table[bits >> np.uint64(48)]
        particles[0, i] = L[0, 0] * a
        particles[1, i] = L[1, 0] * a + L[1, 1] * b
        particles[2, i] = L[2, 0] * a + L[2, 1] * b + L[2, 2] * c
        particles[3, i] = L[3, 0] * a + L[3, 1] * b + L[3, 2] * c + L[3, 3] * d


@njit(cache=True, nogil=True, error_model="numpy")
def diffuse(particles: Singles, S: Array, noise: Singles) -> None:
    """Draw from the rest what the particles left open, and leave nothing; `noise` (4, N)."""
    if S[1, 1] > 0.0:
        slope, s_v = np.float32(S[0, 1] / S[1, 1]), np.float32(math.sqrt(S[1, 1]))
    else:
        slope, s_v = np.float32(0.0), np.float32(0.0)
    s_p = np.float32(math.sqrt(max(S[0, 0] - float(slope) * S[0, 1], 0.0)))
    for axis in range(2):
        p, v, first, second = particles[axis], particles[2 + axis], noise[axis], noise[2 + axis]
        for i in range(p.size):
            dv = s_v * first[i]
            p[i] += slope * dv + s_p * second[i]
            v[i] += dv
    S[:] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def grow(S: Array, T: float, Q: Array) -> None:
    """Predict the rest over `T` s: F S Fᵀ + Q."""
    pp, pv, vv = S[0, 0], S[0, 1], S[1, 1]
    S[0, 0] = pp + 2.0 * T * pv + T * T * vv + Q[0, 0]
    S[0, 1] = S[1, 0] = pv + T * vv + Q[0, 1]
    S[1, 1] = vv + Q[1, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def given_position(S: Array) -> tuple[float, float]:
    """Regression of velocity on position, 1/s, and the variance that is left of the velocity."""
    c = S[0, 1] / S[0, 0] if S[0, 0] > 0.0 else 0.0
    return c, max(S[1, 1] - c * S[0, 1], 0.0)


# Of a measurement z, as float32: position (2), range rate, lag, and the line of sight (2).
Z_A, Z_B, Z_RATE, Z_LAG, Z_U, Z_V = range(6)
MEASURED = 6
# What a particle does with it: whitening W (3, 3), lower triangular; gain A (2, 3) on the whitened
# innovation; factor C (2, 2) of the position's posterior covariance; regression of velocity on position;
# gain of the range rate; deviations of what is drawn of the velocity, along and across the line of sight.
(
    W_AA, W_BA, W_BB, W_RA, W_RB, W_RR, A_AA, A_AB, A_AR, A_BA, A_BB, A_BR, C_AA, C_BA, C_BB,
    SLOPE, RATE_GAIN, ALONG, ACROSS,
) = range(19)  # fmt: skip
TERMS = 19


@njit(cache=True, nogil=True, error_model="numpy")
def condition(
    S: Array, z: Singles, R: Array, r: float, scale: float, rest: float, apart: float, terms: Singles
) -> float:
    """Prepare a measurement: position of covariance `scale` R, range rate of variance `scale` r.

    Both are seen `lag` s after the particles' time. The position is drawn from its exact posterior;
    of what a lag tells about the velocity beyond that, a share of order (lag / T)² is let go.

    Parameters
    ----------
    S : (2, 2) rest of the particles
    z : (6,) the measurement
    R : (3,) aa, ab, bb, in the track's axes
    r : variance of the range rate; infinite where there is none
    rest : variance of the velocity, given the position, that the next step's particles leave open
    apart : variance of the position that they leave open
    terms : (19,) filled; named above

    Returns
    -------
    log of the density's normalising factor
    """
    lag, u, v = float(z[Z_LAG]), float(z[Z_U]), float(z[Z_V])
    pv = S[0, 1] + lag * S[1, 1]
    pp = S[0, 0] + lag * (S[0, 1] + pv)
    aa, ab, bb = pp + scale * R[0], scale * R[1], pp + scale * R[2]
    l_aa = math.sqrt(aa)
    l_ba = ab / l_aa
    l_bb = math.sqrt(max(bb - l_ba * l_ba, 1e-12 * bb))
    w_aa, w_bb = 1.0 / l_aa, 1.0 / l_bb
    w_ba = -l_ba * w_aa * w_bb
    log_norm = math.log(w_aa * w_bb / _TURN)
    slope, left = given_position(S)
    w_ra = w_rb = w_rr = cross_a = cross_b = rate_gain = 0.0
    if r < math.inf:
        g_a, g_b = w_aa * pv * u, w_ba * pv * u + w_bb * pv * v
        l_rr = math.sqrt(max(S[1, 1] - g_a * g_a - g_b * g_b, 0.0) + scale * r)
        w_rr = 1.0 / l_rr
        w_ra, w_rb = -(g_a * w_aa + g_b * w_ba) * w_rr, -g_b * w_bb * w_rr
        log_norm += math.log(w_rr / math.sqrt(_TURN))
        rate_gain = left / (left + scale * r)
        cross_a, cross_b = S[0, 1] * u, S[0, 1] * v
    k = S[0, 0] + lag * S[0, 1]
    a_aa, a_ab, a_ar = k * w_aa, k * w_ba, k * w_ra + cross_a * w_rr
    a_ba, a_bb, a_br = 0.0, k * w_bb, k * w_rb + cross_b * w_rr
    c_aa = math.sqrt(max(S[0, 0] - apart - a_aa * a_aa - a_ab * a_ab - a_ar * a_ar, 0.0))
    c_ba = -(a_aa * a_ba + a_ab * a_bb + a_ar * a_br) / c_aa if c_aa > 0.0 else 0.0
    c_bb = math.sqrt(max(S[0, 0] - apart - a_ba * a_ba - a_bb * a_bb - a_br * a_br - c_ba * c_ba, 0.0))
    terms[W_AA], terms[W_BA], terms[W_BB] = w_aa, w_ba, w_bb
    terms[W_RA], terms[W_RB], terms[W_RR] = w_ra, w_rb, w_rr
    terms[A_AA], terms[A_AB], terms[A_AR] = a_aa, a_ab, a_ar
    terms[A_BA], terms[A_BB], terms[A_BR] = a_ba, a_bb, a_br
    terms[C_AA], terms[C_BA], terms[C_BB] = c_aa, c_ba, c_bb
    terms[SLOPE], terms[RATE_GAIN] = slope, rate_gain
    terms[ALONG] = math.sqrt(max(left * (1.0 - rate_gain) - rest, 0.0))
    terms[ACROSS] = math.sqrt(max(left - rest, 0.0))
    return log_norm


@njit(cache=True, nogil=True, error_model="numpy")
def condition_on_nothing(S: Array, rest: float, apart: float, terms: Singles) -> None:
    """Prepare for the alternative that none of the measurements is the target's."""
    slope, left = given_position(S)
    terms[:] = 0.0
    terms[C_AA] = terms[C_BB] = math.sqrt(max(S[0, 0] - apart, 0.0))
    terms[SLOPE] = slope
    terms[ALONG] = terms[ACROSS] = math.sqrt(max(left - rest, 0.0))


@njit(cache=True, nogil=True, error_model="numpy")
def _distances(particles: Singles, z: Singles, terms: Singles, out: Singles) -> None:
    """Fill `out` (N,) with the squared whitened innovations of the particles."""
    z_a, z_b, rate, lag, u, v = z[Z_A], z[Z_B], z[Z_RATE], z[Z_LAG], z[Z_U], z[Z_V]
    w_aa, w_ba, w_bb = terms[W_AA], terms[W_BA], terms[W_BB]
    w_ra, w_rb, w_rr = terms[W_RA], terms[W_RB], terms[W_RR]
    p_a, p_b, v_a, v_b = particles[0], particles[1], particles[2], particles[3]
    for i in range(out.size):
        a = z_a - p_a[i] - lag * v_a[i]
        b = z_b - p_b[i] - lag * v_b[i]
        r = rate - u * v_a[i] - v * v_b[i]
        y_a, y_b, y_r = w_aa * a, w_ba * a + w_bb * b, w_ra * a + w_rb * b + w_rr * r
        out[i] = y_a * y_a + y_b * y_b + y_r * y_r


@njit(cache=True, nogil=True, error_model="numpy")
def _least(values: Singles) -> float:
    """The least of values ≥ 0, which are in the order of their bits: integers compare in one go."""
    bits, least = values.view(np.int32), np.int32(0x7F7FFFFF)  # the largest number
    for i in range(bits.size):
        least = min(least, bits[i])
    return float(_of_bits(least))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS)
def _densities(weights: Singles, log_norm: float, values: Singles) -> float:
    """Turn squared distances d² (N,) into exp(`log_norm` - d²/2); Σ w of these."""
    most, total = np.float32(log_norm), 0.0
    for i in range(values.size):
        g = _exponential(most - _HALF * values[i])
        values[i] = g
        total += weights[i] * g
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def weigh(
    particles: Singles,
    weights: Singles,
    S: Array,
    z: Singles,
    R: Array,
    r: float,
    outliers: float,
    relative: Singles,
) -> tuple[float, float]:
    """Likelihood of each particle for a measurement; parameters as in `condition`.

    The measurement's density is (1 - ε) N(z; H x, R) + ε N(z; H x, 64 R): a plot that was merged with
    a neighbour's must not carry the whole cloud away. ε = `outliers` = 0 is the Gaussian.

    Returns
    -------
    log ĝ = log Σ w_i g(x_i), and Σ w_i `relative`_i, where `relative` (2, N) is filled with the two
    parts of the particles' likelihoods up to a common factor: nothing underflows, however far z is out.
    """
    terms, near, far = np.empty(TERMS, np.float32), relative[0], relative[1]
    log_near = math.log(1.0 - outliers) + condition(S, z, R, r, 1.0, 0.0, 0.0, terms)
    _distances(particles, z, terms, near)
    shift = log_near - 0.5 * _least(near)
    if outliers > 0.0:
        log_far = math.log(outliers) + condition(S, z, R, r, BROAD, 0.0, 0.0, terms)
        _distances(particles, z, terms, far)
        shift = max(shift, log_far - 0.5 * _least(far))
        total = _densities(weights, log_near - shift, near) + _densities(weights, log_far - shift, far)
    else:
        far[:] = 0.0
        total = _densities(weights, log_near - shift, near)
    total = max(total, _LEAST)
    return math.log(total) + shift, total


@njit(cache=True, nogil=True, error_model="numpy")
def propose(
    parents: Singles, lo: int, hi: int, z: Singles, terms: Singles, noise: Singles, particles: Singles
) -> None:
    """Draw particles `lo` to `hi` from their posterior, given their parents and one measurement.

    `parents` (4, N) predicted; `noise` (≥ 2, N) standard normals; `particles` are filled.
    """
    z_a, z_b, rate, lag, u, v = z[Z_A], z[Z_B], z[Z_RATE], z[Z_LAG], z[Z_U], z[Z_V]
    w_aa, w_ba, w_bb = terms[W_AA], terms[W_BA], terms[W_BB]
    w_ra, w_rb, w_rr = terms[W_RA], terms[W_RB], terms[W_RR]
    a_aa, a_ab, a_ar = terms[A_AA], terms[A_AB], terms[A_AR]
    a_ba, a_bb, a_br = terms[A_BA], terms[A_BB], terms[A_BR]
    c_aa, c_ba, c_bb = terms[C_AA], terms[C_BA], terms[C_BB]
    slope, gain = terms[SLOPE], terms[RATE_GAIN]
    p_a, p_b, v_a, v_b = parents[0, lo:hi], parents[1, lo:hi], parents[2, lo:hi], parents[3, lo:hi]
    to_a, to_b, n_a, n_b = particles[0, lo:hi], particles[1, lo:hi], noise[0, lo:hi], noise[1, lo:hi]
    to_va, to_vb = particles[2, lo:hi], particles[3, lo:hi]
    for k in range(hi - lo):
        a = z_a - p_a[k] - lag * v_a[k]
        b = z_b - p_b[k] - lag * v_b[k]
        r = rate - u * v_a[k] - v * v_b[k]
        y_a, y_b, y_r = w_aa * a, w_ba * a + w_bb * b, w_ra * a + w_rb * b + w_rr * r
        d_a = a_aa * y_a + a_ab * y_b + a_ar * y_r + c_aa * n_a[k]
        d_b = a_ba * y_a + a_bb * y_b + a_br * y_r + c_ba * n_a[k] + c_bb * n_b[k]
        new_a, new_b = v_a[k] + slope * d_a, v_b[k] + slope * d_b
        e = gain * (rate - u * new_a - v * new_b)
        to_a[k] = p_a[k] + d_a
        to_b[k] = p_b[k] + d_b
        to_va[k] = new_a + u * e
        to_vb[k] = new_b + v * e


@njit(cache=True, nogil=True, error_model="numpy")
def shake(particles: Singles, lo: int, hi: int, z: Singles, terms: Singles, noise: Singles) -> None:
    """Draw what particles `lo` to `hi` are not to leave open of the velocity; `noise` (4, N)."""
    along, across, u, v = terms[ALONG], terms[ACROSS], z[Z_U], z[Z_V]
    if along <= 0.0 and across <= 0.0:
        return
    v_a, v_b, n_a, n_b = particles[2, lo:hi], particles[3, lo:hi], noise[2, lo:hi], noise[3, lo:hi]
    for k in range(hi - lo):
        a, b = along * n_a[k], across * n_b[k]
        v_a[k] += u * a - v * b
        v_b[k] += v * a + u * b


@njit(cache=True, nogil=True, error_model="numpy")
def gather(source: Singles, ancestors: Indices, out: Singles) -> None:
    """Copy each ancestor's column of `source` (rows, N) to `out` (rows, N)."""
    for row in range(source.shape[0]):
        values, copies = source[row], out[row]
        for k in range(ancestors.size):
            copies[k] = values[np.uint32(ancestors[k])]  # or numba looks whether it counts from the end


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS)
def centre(particles: Singles, weights: Singles, mean: Array, cov: Array) -> None:
    """Subtract the weighted mean; fill `mean` (4,) and `cov` (4, 4)."""
    p_a, p_b, v_a, v_b = particles[0], particles[1], particles[2], particles[3]
    m_a = m_b = m_va = m_vb = np.float32(0.0)
    for i in range(weights.size):
        w = weights[i]
        m_a += w * p_a[i]
        m_b += w * p_b[i]
        m_va += w * v_a[i]
        m_vb += w * v_b[i]
    aa = ab = bb = aa_v = ab_v = ba_v = bb_v = vaa = vab = vbb = np.float32(0.0)
    for i in range(weights.size):
        w, a, b, c, d = weights[i], p_a[i] - m_a, p_b[i] - m_b, v_a[i] - m_va, v_b[i] - m_vb
        p_a[i], p_b[i], v_a[i], v_b[i] = a, b, c, d
        wa, wb, wc = w * a, w * b, w * c
        aa += wa * a
        ab += wa * b
        bb += wb * b
        aa_v += wa * c
        ab_v += wa * d
        ba_v += wb * c
        bb_v += wb * d
        vaa += wc * c
        vab += wc * d
        vbb += w * d * d
    mean[0], mean[1], mean[2], mean[3] = m_a, m_b, m_va, m_vb
    cov[0, 0], cov[1, 1], cov[2, 2], cov[3, 3] = aa, bb, vaa, vbb
    cov[0, 1] = cov[1, 0] = ab
    cov[0, 2] = cov[2, 0] = aa_v
    cov[0, 3] = cov[3, 0] = ab_v
    cov[1, 2] = cov[2, 1] = ba_v
    cov[1, 3] = cov[3, 1] = bb_v
    cov[2, 3] = cov[3, 2] = vab


@njit(cache=True, nogil=True, error_model="numpy")
def normalise(weights: Singles) -> float:
    """Make the weights sum to 1; returns the effective sample size 1 / Σ w²."""
    total = 0.0
    for i in range(weights.size):
        total += weights[i]
    scale = np.float32(1.0 / total)
    squares = 0.0
    for i in range(weights.size):
        weights[i] *= scale
        squares += weights[i] * weights[i]
    return 1.0 / squares


@njit(cache=True, nogil=True, error_model="numpy")
def regularise(
    particles: Singles, cov: Array, width: float, key: Any, table: Singles, scratch: Singles
) -> None:
    """Part the copies that resampling made: a kernel of `width` times the cloud's own spread.

    The cloud, whose mean is 0, is shrunk by √(1 - width²) first, so that mean and covariance `cov`
    (4, 4) stay what they were. `scratch` (4, N).

    Source: Liu and West, Combined parameter and state estimation in simulation-based filtering, in
    Sequential Monte Carlo Methods in Practice, 2001, §10.3.
    """
    L = np.empty((4, 4))
    cholesky(cov, L)
    draw(scratch, width * L, key, table)
    shrink = np.float32(math.sqrt(1.0 - width * width))
    for row in range(4):
        for i in range(particles.shape[1]):
            particles[row, i] = shrink * particles[row, i] + scratch[row, i]


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky(P: Array, L: Array) -> None:
    """Fill L (4, 4) with P = L Lᵀ; a singular P is taken as the nearest one that is not."""
    L[:] = 0.0
    for j in range(4):
        for i in range(j, 4):
            s, left = P[i, j], P[i, i]
            for k in range(j):
                s -= L[i, k] * L[j, k]
                left -= L[i, k] * L[i, k]
            if i == j:
                L[i, i] = math.sqrt(max(s, 1e-12 * P[i, i], 1e-12))
            else:
                # Where rounding leaves next to nothing to divide by: no more than there is of the variance.
                most = math.sqrt(max(left, 0.0))
                L[i, j] = min(max(s / L[j, j], -most), most)
