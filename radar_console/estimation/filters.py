"""The Gaussian filters under one shape: three verbs over the same models, chosen by name."""

from collections.abc import Callable
from typing import NamedTuple

from radar_console.estimation import extended, kalman, unscented
from radar_console.estimation.gaussian import Array, Gaussian
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion


class Filter(NamedTuple):
    """What a filter does with a state (..., n), and a measurement z (..., m) of it.

    predict       carries the state through a motion model
    innovation    ν (..., m) and its covariance S (..., m, m)
    update        conditions the state on z; also the log-likelihood (...) of z
    """

    predict: Callable[[Gaussian, Motion], Gaussian]
    innovation: Callable[[Gaussian, Array, Sensing], tuple[Array, Array]]
    update: Callable[[Gaussian, Array, Sensing], tuple[Gaussian, Array]]


def _predict(state: Gaussian, motion: Motion) -> Gaussian:
    _check(motion)
    return kalman.predict(state, motion.jacobian(state.mean), motion.Q)


def _innovation(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Array, Array]:
    _check(sensing)
    return extended.innovation(state, z, sensing)


def _update(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Gaussian, Array]:
    _check(sensing)
    return kalman.update(state, z, sensing.jacobian(state.mean), sensing.R)


def _check(model: Motion | Sensing) -> None:
    if not model.linear:
        raise ValueError("the Kalman filter needs linear models; expected linear=True")


KALMAN = Filter(_predict, _innovation, _update)
"""Linear models only: converted measurements. Raises ValueError for others."""
EXTENDED = Filter(extended.predict, extended.innovation, extended.update)
UNSCENTED = Filter(unscented.predict, unscented.innovation, unscented.update)

BY_NAME = {"kalman": KALMAN, "extended": EXTENDED, "unscented": UNSCENTED}
