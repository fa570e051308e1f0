"""The particle filter in batched NumPy, to be read and for studies; `particle` has the tracker's kernels.

Particles are the first axis of their array, so that the models broadcast over them as over any other: runs
or tracks, all those that the models have, stand between particles and state. A random generator is passed
in; what one draw of it gives to a member of a stack depends on the stack.

[1] Gordon, Salmond, Smith, Novel approach to nonlinear/non-Gaussian Bayesian state estimation, IEE Proc. F
    140(2), 1993.
[2] Arulampalam, Maskell, Gordon, Clapp, A tutorial on particle filters, IEEE T-SP 50(2), 2002.
[3] Douc, Cappé, Moulines, Comparison of resampling schemes for particle filtering, ISPA 2005.
[4] Liu, West, Combined parameter and state estimation in simulation-based filtering, in Sequential Monte
    Carlo Methods in Practice, 2001, §10.3.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array, Gaussian, apply, root
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion

Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """A density as weighted particles, or a stack of them.

    Attributes
    ----------
    states : (N, ..., n)
    log_weights : (N, ...)  natural logarithms of weights that sum to 1: none underflows
    """

    states: Array
    log_weights: Array

    @property
    def weights(self) -> Array:
        """(N, ...), sum 1 over the first axis."""
        result: Array = np.exp(self.log_weights)
        return result


def draw(state: Gaussian, count: int, rng: Generator) -> Samples:
    """`count` particles of equal weight from each Gaussian (..., n)."""
    shape = (count, *state.mean.shape)
    states = state.mean + apply(root(state.cov), rng.standard_normal(shape))
    return Samples(states, np.full(shape[:-1], -np.log(count)))


def predict(cloud: Samples, motion: Motion, rng: Generator) -> Samples:
    """Draw each particle's successor from the prior x' = f(x) + w: the bootstrap's proposal [1]."""
    moved = motion.f(cloud.states)
    noise = apply(root(motion.Q), rng.standard_normal(moved.shape))
    return Samples(moved + noise, cloud.log_weights)


def update(cloud: Samples, z: Array, sensing: Sensing) -> tuple[Samples, Array]:
    """Weigh by the likelihood of `z` (..., m)  [2, (63)]; also the log-likelihood (...) of z."""
    nu = sensing.residual(z, sensing.h(cloud.states))
    return _weighed(cloud.states, cloud.log_weights + _log_density(nu, sensing.R))


def advance(
    cloud: Samples, motion: Motion, z: Array, sensing: Sensing, rng: Generator
) -> tuple[Samples, Array]:
    """Predict and update at once by the optimal proposal, which a linear measurement has.

    Each particle's successor is drawn from p(x' | x, z), and weighed by p(z | x)  [2, (53) to (57)].

    Returns
    -------
    The particles, and the log-likelihood (...) of `z` (..., m)

    Raises
    ------
    ValueError    the measurement is not linear
    """
    if not sensing.linear:
        raise ValueError("the optimal proposal needs a linear measurement; expected linear=True")
    moved, Q = motion.f(cloud.states), motion.Q
    H = sensing.jacobian(moved)
    nu = sensing.residual(z, sensing.h(moved))
    S = H @ Q @ H.mT + sensing.R
    K = np.linalg.solve(S, H @ Q).mT
    A = np.eye(moved.shape[-1]) - K @ H
    spread = root(A @ Q @ A.mT + K @ sensing.R @ K.mT)
    states = moved + apply(K, nu) + apply(spread, rng.standard_normal(moved.shape))
    return _weighed(states, cloud.log_weights + _log_density(nu, S))


def innovation(cloud: Samples, z: Array, sensing: Sensing) -> tuple[Array, Array]:
    """ν (..., m), what `z` (..., m) adds to the prediction, and its covariance S (..., m, m)."""
    nu = sensing.residual(z, sensing.h(cloud.states))
    seen = estimate(Samples(nu, cloud.log_weights))
    return seen.mean, seen.cov + sensing.R


def estimate(cloud: Samples) -> Gaussian:
    """The weighted mean and covariance."""
    w = cloud.weights
    mean = np.einsum("k...,k...i->...i", w, cloud.states)
    spread = np.moveaxis(np.sqrt(w)[..., None] * (cloud.states - mean), 0, -1)
    return Gaussian(mean, spread @ spread.mT)


def effective_size(cloud: Samples) -> Array:
    """N_eff = 1 / Σ w²  [2, (51)]."""
    result: Array = 1.0 / np.sum(cloud.weights**2, axis=0)
    return result


def systematic(weights: Array, rng: Generator) -> Counts:
    """How often each of the particles is copied, `weights` (..., N): N teeth, one uniform start."""
    count = weights.shape[-1]
    start = rng.random((*weights.shape[:-1], 1))
    return _copies(np.ceil(_cumulated(weights) * count - start))


def stratified(weights: Array, rng: Generator) -> Counts:
    """How often each of the particles is copied, `weights` (..., N): one tooth in every Nth."""
    count = weights.shape[-1]
    teeth = rng.random(weights.shape)
    reach = _cumulated(weights) * count
    whole = np.minimum(reach.astype(np.int64), count - 1)
    return _copies(whole + (np.take_along_axis(teeth, whole, -1) < reach - whole))


def residual(weights: Array, rng: Generator) -> Counts:
    """How often each of the particles is copied, `weights` (..., N): ⌊N w⌋ times, the rest by lot."""
    count = weights.shape[-1]
    certain = np.floor(weights * count).astype(np.int64)
    rest = count - certain.sum(axis=-1)
    lots = np.maximum(weights * count - certain, 0.0)
    lots /= np.maximum(lots.sum(axis=-1, keepdims=True), np.finfo(float).tiny)
    total: Counts = certain + rng.multinomial(rest, lots)
    return total


def multinomial(weights: Array, rng: Generator) -> Counts:
    """How often each of the particles is copied, `weights` (..., N): N times by lot."""
    return rng.multinomial(weights.shape[-1], weights / weights.sum(axis=-1, keepdims=True))


RESAMPLING: dict[str, Callable[[Array, Generator], Counts]] = {
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
    "multinomial": multinomial,
}
"""By name. All copy a particle N w times on average [3]."""


def resample(
    cloud: Samples,
    rng: Generator,
    copies: Callable[[Array, Generator], Counts] = systematic,
    below: float = 0.5,
    width: float = 0.0,
) -> Samples:
    """Copy particles in proportion to their weights, where N_eff is less than `below` times N.

    With a `width` > 0 the copies are parted: by a Gaussian kernel of `width` times the cloud's own spread,
    after the cloud has shrunk toward its mean so that mean and covariance stay what they were [4].
    """
    count, shape = cloud.states.shape[0], cloud.states.shape
    log_weights = cloud.log_weights.reshape(count, -1).copy()
    poor = np.flatnonzero(effective_size(cloud).ravel() < below * count)
    parents = np.broadcast_to(np.arange(count)[:, None], log_weights.shape).copy()
    parents[:, poor] = _parents(copies(np.exp(log_weights[:, poor].T), rng)).T
    log_weights[:, poor] = -np.log(count)
    # One row number a particle: five times as fast as an index for each axis.
    rows = parents * log_weights.shape[1] + np.arange(log_weights.shape[1])
    states = np.take(cloud.states.reshape(-1, shape[-1]), rows.ravel(), axis=0)
    states = states.reshape(shape)
    if width > 0.0:
        resampled = np.isin(np.arange(log_weights.shape[1]), poor).reshape(shape[1:-1])
        states = np.where(resampled[..., None], _parted(states, estimate(cloud), width, rng), states)
    return Samples(states, log_weights.reshape(shape[:-1]))


def _parted(states: Array, around: Gaussian, width: float, rng: Generator) -> Array:
    jitter = apply(width * root(around.cov), rng.standard_normal(states.shape))
    parted: Array = around.mean + np.sqrt(1.0 - width**2) * (states - around.mean) + jitter
    return parted


def _weighed(states: Array, log_joint: Array) -> tuple[Samples, Array]:
    largest = log_joint.max(axis=0)
    total = largest + np.log(np.sum(np.exp(log_joint - largest), axis=0))
    return Samples(states, log_joint - total), total


def _log_density(nu: Array, S: Array) -> Array:
    """Log of N(nu; 0, S) for `nu` (N, ..., m) and one `S` (..., m, m) for all particles."""
    L = np.linalg.cholesky(2 * np.pi * S)
    white = apply(np.linalg.inv(L), nu)
    log_det = 2 * np.sum(np.log(np.diagonal(L, axis1=-2, axis2=-1)), axis=-1)
    result: Array = -np.pi * np.einsum("...i,...i->...", white, white) - 0.5 * log_det
    return result


def _cumulated(weights: Array) -> Array:
    """Sums of the weights up to each particle; the last is 1 in spite of rounding."""
    sums = np.cumsum(weights, axis=-1)
    result: Array = sums / sums[..., -1:]
    return result


def _copies(below: Array) -> Counts:
    """From the number of teeth below the end of each particle's share to the number within it."""
    reached = below.astype(np.int64)
    reached[..., 1:] -= reached[..., :-1].copy()
    return reached


def _parents(copies: Counts) -> Counts:
    """The copied particles' numbers, each as often as `copies` (B, N) says."""
    lines, count = copies.shape
    numbers = np.broadcast_to(np.arange(count), copies.shape)
    return np.repeat(numbers.ravel(), copies.ravel()).reshape(lines, count)
