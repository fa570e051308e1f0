"""The interacting multiple model estimator [1, §11.6.6]; its modes are one more leading axis.

Each mode has a motion model of its own, and any of the Gaussian filters serves it. Models of several sizes
are first brought to one state by `motion.embed`.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from radar_console.estimation.filters import EXTENDED, Filter
from radar_console.estimation.gaussian import Array, Gaussian, collapse
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """A Gaussian for every mode, and the probability of every mode.

    Attributes
    ----------
    probability : (..., r)
    states : mean (..., r, n), cov (..., r, n, n)
    """

    probability: Array
    states: Gaussian


def start(state: Gaussian, probability: Array) -> Modes:
    """The same Gaussian (..., n) in every mode; `probability` (r,)."""
    r, shape = probability.size, state.mean.shape
    mean = np.broadcast_to(state.mean[..., None, :], (*shape[:-1], r, shape[-1]))
    cov = np.broadcast_to(state.cov[..., None, :, :], (*mean.shape, shape[-1]))
    return Modes(np.broadcast_to(probability, mean.shape[:-1]), Gaussian(mean, cov))


def mix(modes: Modes, switching: Array) -> Modes:
    """What each mode starts the step from; `switching` (..., r, r) is P(mode j | was mode i).

    Source: [1], (11.6.6-6) to (11.6.6-9).
    """
    joint = modes.probability[..., :, None] * switching
    probability = joint.sum(axis=-2)
    # A mode that can't be reached keeps what it had.
    reached = probability[..., None, :] > 0
    shares = np.where(reached, joint / np.maximum(probability[..., None, :], _TINY), np.eye(joint.shape[-1]))
    every = modes.states
    mixed = collapse(shares.mT, Gaussian(every.mean[..., None, :, :], every.cov[..., None, :, :, :]))
    return Modes(probability, mixed)


def predict(modes: Modes, motions: Sequence[Motion], switching: Array, filter: Filter = EXTENDED) -> Modes:
    """Mix, then propagate each mode through its own of the r `motions`."""
    mixed = mix(modes, switching)
    states = [filter.predict(part, motion) for part, motion in zip(parts(mixed), motions, strict=True)]
    return Modes(mixed.probability, _stack(states))


def update(modes: Modes, z: Array, sensing: Sensing, filter: Filter = EXTENDED) -> tuple[Modes, Array]:
    """Condition every mode on `z` (..., m); also the log-likelihood of z.

    Source: [1], (11.6.6-10) to (11.6.6-15).
    """
    found = [filter.update(part, z, sensing) for part in parts(modes)]
    log_likelihood = np.stack([each for _, each in found], axis=-1)
    log_joint = np.log(np.maximum(modes.probability, _TINY)) + log_likelihood
    total = np.logaddexp.reduce(log_joint, axis=-1)
    return Modes(np.exp(log_joint - total[..., None]), _stack([state for state, _ in found])), total


def innovation(modes: Modes, z: Array, sensing: Sensing, filter: Filter = EXTENDED) -> tuple[Array, Array]:
    """ν (..., m) and its covariance S (..., m, m), of the modes' mixture matched by its moments."""
    found = [filter.innovation(part, z, sensing) for part in parts(modes)]
    mixture = Gaussian(np.stack([nu for nu, _ in found], axis=-2), np.stack([S for _, S in found], axis=-3))
    both = collapse(modes.probability, mixture)
    return both.mean, both.cov


def estimate(modes: Modes) -> Gaussian:
    """The moment-matched Gaussian  [1, (11.6.6-16), (11.6.6-17)]."""
    return collapse(modes.probability, modes.states)


def parts(modes: Modes) -> list[Gaussian]:
    """The r modes' Gaussians, each (..., n)."""
    every = modes.states
    return [Gaussian(every.mean[..., j, :], every.cov[..., j, :, :]) for j in range(every.mean.shape[-2])]


def _stack(states: Sequence[Gaussian]) -> Gaussian:
    return Gaussian(
        np.stack([state.mean for state in states], axis=-2),
        np.stack([state.cov for state in states], axis=-3),
    )
