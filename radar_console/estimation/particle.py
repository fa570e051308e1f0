"""The bootstrap particle filter of one track; its particles move in the plane.

Particles are float32 *offsets* (4, N) from a float64 anchor that moves with them: east, north,
v_east, v_north, turned into axes of the track's own, so that a rotated scene is tracked alike.
Weights (N,) are float32 and sum to 1. Random numbers have no state: particle i of a step draws
from a hash of (key, i), so nothing depends on the order of the work or the number of threads.

Sources: Gordon, Salmond, Smith, Novel approach to nonlinear/non-Gaussian Bayesian state estimation,
IEE Proc. F 140(2), 1993; Arulampalam et al., A tutorial on particle filters, IEEE T-SP 50(2), 2002.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import ndtri

from radar_console.estimation.gaussian import Array

Singles = NDArray[np.float32]

_NORMALS_BITS = 16
_LEAST = 1e-30  # of a sum of weights
BROAD = 64.0  # variance of an outlier, in units of the claimed one


def normals() -> Singles:
    """The table that draws come from: the normal's 2^16 equally likely values, of unit variance.

    A draw is a look-up by 16 random bits, several times faster than a transformation; the largest
    value is 4.2, and the table's moments are the normal's to 1e-3 up to the fourth.
    """
    count = 1 << _NORMALS_BITS
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / values.std(), np.float32)


@njit(cache=True, nogil=True)
def mix(z: Any) -> Any:
    """64 well mixed bits (Steele, Lea, Flood, Fast splittable pseudorandom number generators, 2014)."""
    z = np.uint64(z) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, nogil=True)
def key(seed: int, track: int, step: int) -> Any:
    """The random key of one step of one track."""
    return mix(mix(mix(np.uint64(seed)) ^ np.uint64(track)) ^ np.uint64(step))


@njit(cache=True, nogil=True, error_model="numpy")
def draw(particles: Singles, L: Array, key: Any, table: Singles) -> None:
    """Fill `particles` (4, N) from N(0, L Lᵀ), L (4, 4) lower triangular."""
    low = np.uint64(0xFFFF)
    for i in range(particles.shape[1]):
        bits = mix(key + np.uint64(i))
        a = table[bits & low]
        b = table[(bits >> np.uint64(16)) & low]
        c = table[(bits >> np.uint64(32)) & low]
        d = table[bits >> np.uint64(48)]
        particles[0, i] = L[0, 0] * a
        particles[1, i] = L[1, 0] * a + L[1, 1] * b
        particles[2, i] = L[2, 0] * a + L[2, 1] * b + L[2, 2] * c
        particles[3, i] = L[3, 0] * a + L[3, 1] * b + L[3, 2] * c + L[3, 3] * d


@njit(cache=True, nogil=True, error_model="numpy")
def predict(particles: Singles, T: float, q: float, key: Any, table: Singles) -> None:
    """Nearly constant velocity over `T` s, white acceleration of spectral density `q` m²/s³."""
    low = np.uint64(0xFFFF)
    step, half = np.float32(T), np.float32(0.5 * T)
    s_v, s_p = np.float32(math.sqrt(q * T)), np.float32(math.sqrt(q * T * T * T / 12.0))
    for i in range(particles.shape[1]):
        bits = mix(key + np.uint64(i))
        for axis in range(2):
            v = particles[2 + axis, i]
            dv = s_v * table[bits & low]
            bits >>= np.uint64(16)
            particles[axis, i] += step * v + half * dv + s_p * table[bits & low]
            bits >>= np.uint64(16)
            particles[2 + axis, i] = v + dv


@njit(cache=True, nogil=True, error_model="numpy")
def weigh(
    particles: Singles,
    weights: Singles,
    z: Array,
    R: Array,
    lag: float,
    outliers: float,
    relative: Singles,
) -> tuple[float, float]:
    """Likelihood of each particle for a position seen `lag` s after the particles' time.

    The measurement's density is (1 - ε) N(z; x, R) + ε N(z; x, 64 R): a plot that was merged with a
    neighbour's must not carry the whole cloud away. ε = 0 is the Gaussian.

    Parameters
    ----------
    z : (2,) offset of the measurement from the anchor at its own time, in the track's axes
    R : (3,) its covariance there: aa, ab, bb
    outliers : ε, in [0, 1)

    Returns
    -------
    log ĝ = log Σ w_i g(x_i), and Σ w_i `relative`_i, where `relative` (N,) is filled with the
    particles' likelihoods up to a common factor: nothing underflows, however far z is out.
    """
    # R = L Lᵀ; the whitened difference is L⁻¹ (z - x).
    l_aa = math.sqrt(R[0])
    l_ab = R[1] / l_aa
    l_bb = math.sqrt(max(R[2] - l_ab * l_ab, 1e-12 * R[2]))
    i_aa, i_bb = np.float32(1.0 / l_aa), np.float32(1.0 / l_bb)
    i_ab = np.float32(-l_ab / (l_aa * l_bb))
    z_a, z_b, t = np.float32(z[0]), np.float32(z[1]), np.float32(lag)
    count = particles.shape[1]
    nearest = np.float32(np.inf)
    for i in range(count):
        a = z_a - particles[0, i] - t * particles[2, i]
        b = z_b - particles[1, i] - t * particles[3, i]
        u, v = i_aa * a, i_ab * a + i_bb * b
        d2 = u * u + v * v
        relative[i] = d2
        nearest = min(nearest, d2)
    # With y the broad component, the narrow one is y^64, both relative to the nearest particle's;
    # the larger of their factors is 1.
    log_narrow = -0.5 * (1.0 - 1.0 / BROAD) * float(nearest)
    log_broad = math.log(outliers / ((1.0 - outliers) * BROAD)) if outliers > 0.0 else -math.inf
    log_factor = max(log_narrow, log_broad)
    narrow = np.float32(math.exp(log_narrow - log_factor))
    broad = np.float32(math.exp(log_broad - log_factor))
    scale = np.float32(0.5 / BROAD)
    total = 0.0
    for i in range(count):
        y = np.float32(math.exp(scale * (nearest - relative[i])))
        y4 = (y * y) * (y * y)
        y16 = (y4 * y4) * (y4 * y4)
        g = narrow * (y16 * y16) * (y16 * y16) + broad * y
        relative[i] = g
        total += weights[i] * g
    total = max(total, _LEAST)
    log_norm = log_factor + math.log((1.0 - outliers) / (2.0 * math.pi * l_aa * l_bb))
    return math.log(total) - 0.5 * float(nearest) / BROAD + log_norm, total


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
def resample(particles: Singles, weights: Singles, key: Any, scratch: Singles) -> None:
    """Systematic resampling: comb of N teeth, one uniform start; `scratch` (4, N)."""
    count = weights.size
    tooth = float(mix(key) >> np.uint64(11)) / 9007199254740992.0  # 2^53
    i, cumulative = 0, float(weights[0]) * count
    for j in range(count):
        while cumulative < tooth + j and i < count - 1:
            i += 1
            cumulative += float(weights[i]) * count
        for row in range(4):
            scratch[row, j] = particles[row, i]
    particles[:] = scratch
    weights[:] = np.float32(1.0 / count)


@njit(cache=True, nogil=True, error_model="numpy")
def moments(particles: Singles, weights: Singles, mean: Array, cov: Array) -> None:
    """Fill the weighted mean (4,) and covariance (4, 4) of the offsets."""
    mean[:] = 0.0
    for row in range(4):
        m = 0.0
        for i in range(weights.size):
            m += weights[i] * particles[row, i]
        mean[row] = m
    for row in range(4):
        for column in range(row + 1):
            m, n = mean[row], mean[column]
            total = 0.0
            for i in range(weights.size):
                total += weights[i] * (particles[row, i] - m) * (particles[column, i] - n)
            cov[row, column] = total
            cov[column, row] = total


@njit(cache=True, nogil=True, error_model="numpy")
def regularise(
    particles: Singles, mean: Array, cov: Array, width: float, key: Any, table: Singles, scratch: Singles
) -> None:
    """Part the copies that resampling made: a kernel of `width` times the cloud's own spread.

    The cloud is shrunk toward its mean by √(1 - width²) first, so that mean and covariance stay
    what they were. It is left as offsets from `mean` (4,), which the anchor has to take over.

    Source: Liu and West, Combined parameter and state estimation in simulation-based filtering, in
    Sequential Monte Carlo Methods in Practice, 2001, §10.3.
    """
    L = np.empty((4, 4))
    cholesky(cov, L)
    draw(scratch, width * L, key, table)
    shrink = np.float32(math.sqrt(1.0 - width * width))
    for row in range(4):
        m = np.float32(mean[row])
        for i in range(particles.shape[1]):
            particles[row, i] = shrink * (particles[row, i] - m) + scratch[row, i]


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky(P: Array, L: Array) -> None:
    """Fill L (4, 4) with P = L Lᵀ; a singular P is taken as the nearest one that is not."""
    L[:] = 0.0
    for j in range(4):
        for i in range(j, 4):
            s = P[i, j]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = math.sqrt(max(s, 1e-12 * P[i, i], 1e-12))
            else:
                L[i, j] = s / L[j, j]
