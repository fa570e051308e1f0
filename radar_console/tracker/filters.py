"""The filter of the confirmed tracks, chosen by its name: the same four verbs for all.

`start` takes a track over from the Kalman filter of its youth, `advance` predicts it, `log_likelihood`
weighs a plot, and `update` conditions on plots with their association probabilities.
"""

from typing import Any

from radar_console.estimation.gaussian import Array
from radar_console.estimation.particle import Singles
from radar_console.tracker import bank, cloud
from radar_console.tracker.kernels import owning
from radar_console.tracker.records import PARTICLE, Belief

_start_cloud, _advance_cloud, _weigh_cloud, _update_cloud = (
    cloud.start,
    cloud.advance,
    cloud.log_likelihood,
    cloud.update,
)
_start_bank, _advance_bank, _weigh_bank, _update_bank = (
    bank.start,
    bank.advance,
    bank.log_likelihood,
    bank.update,
)


@owning
def start(track: Any, sensor_e: float, sensor_n: float, par: Any, belief: Belief) -> None:
    """Begin from the track's Gaussian; `track.slot` is its row of `belief`."""
    if par.filter == PARTICLE:
        _start_cloud(track, sensor_e, sensor_n, par, belief)
    else:
        _start_bank(track, sensor_e, sensor_n, par, belief)


@owning
def advance(track: Any, t: float, par: Any, belief: Belief) -> None:
    """Predict to the time `t`; sets the track's time and moments."""
    if par.filter == PARTICLE:
        _advance_cloud(track, t, par, belief)
    else:
        _advance_bank(track, t, par, belief)


@owning
def log_likelihood(track: Any, plot: Any, par: Any, belief: Belief, relative: Singles) -> tuple[float, float]:
    """log ĝ of a plot, and Σ w `relative`; `relative` (2, N) is for `update`."""
    if par.filter == PARTICLE:
        return _weigh_cloud(track, plot, par, belief, relative)
    return _weigh_bank(track, plot, par, belief, relative)


@owning
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
    """Condition on the plots `chosen` (plots,) of `pool` with probabilities `beta`, `miss` for none.

    `total` (plots,) and `relative` (plots, 2, N) are what `log_likelihood` gave.
    """
    if par.filter == PARTICLE:
        _update_cloud(track, miss, beta, total, relative, chosen, pool, par, belief)
    else:
        _update_bank(track, miss, beta, total, relative, chosen, pool, par, belief)


__all__ = ["advance", "log_likelihood", "start", "update"]
