"""Runs of the ARPA scenes: what the tracker says of the target, seen from own ship, and what is true.

States are relative, (4,): east and north of the target from own ship, m, and their rates, m/s.
"""

from typing import NamedTuple

import numpy as np

# What a chain loads late is named here, so that parts are done anew when it changes.
import radar_console.plots.clustering as clustering
import radar_console.simulator.radar as simulator
import radar_console.tracker.stage as tracker
from radar_console.chain import Chain
from radar_console.core.geometry import to_cartesian, to_polar
from radar_console.core.messages import Table, TrackStatus
from radar_console.core.units import DEG, KT
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.scenario_run import ScenarioRun, follow
from radar_console.scenario import RadarSettings
from radar_console.studies.work import Arrays

LOADED = (clustering, simulator, tracker)
"""The stages of a chain."""

TIMES = np.arange(30.0, 181.0, 10.0)
"""s of steady tracking: since the target was confirmed."""


class Bound(NamedTuple):
    """The least deviations that an unbiased estimate can have at `TIMES`: rad and m/s, each (times,)."""

    course: Array
    speed: Array


def tracked(run: ScenarioRun, filter_name: str, runs: range, seed: int) -> Arrays:
    """Some runs of a scene under a filter of the tracker.

    Returns
    -------
    estimate, truth : (times, 4, runs) relative states at `TIMES`; NaN where the track is gone
    confirmed : (runs,) s, NaN never
    """
    each = [_one_tracked(run, filter_name, seed + number) for number in runs]
    return {name: np.stack([one[name] for one in each], axis=-1) for name in each[0]}


def own_velocity(radar: RadarSettings) -> Array:
    """(2,) m/s, east and north, of a radar that moves."""
    return np.array(to_cartesian(radar.speed_kt * KT, radar.course_deg * DEG))


def _one_tracked(run: ScenarioRun, filter_name: str, seed: int) -> Arrays:
    opened = run.opened({"tracker.filter": filter_name}, seed)
    rows = follow(Chain(opened))
    assert opened.truth is not None
    own = own_velocity(opened.settings.radar)
    estimate, truth = np.full((2, len(TIMES), 4), np.nan)
    shown = rows[np.isin(rows["status"], (TrackStatus.CONFIRMED, TrackStatus.COASTING))]
    if not len(shown):
        return {"estimate": estimate, "truth": truth, "confirmed": np.array(np.nan)}
    began = float(shown["time"].min())
    own_rows = rows[rows["track"] == shown["track"][shown["time"].argmin()]]
    for k, time in enumerate(began + TIMES):
        before = own_rows[own_rows["time"] <= time]
        last = before[before["time"].argmax()]
        truth[k] = _relative(opened.truth(time)[0], time, own)
        if last["status"] != TrackStatus.DELETED:
            estimate[k] = _relative(last, time, own)
    return {"estimate": estimate, "truth": truth, "confirmed": np.array(began)}


def _relative(row: Table, time: float, own: Array) -> Array:
    """A row of TRACK or TRUTH at `time`, from own ship, which began at the origin."""
    place, velocity = np.array([row["east"], row["north"]]), np.array([row["v_east"], row["v_north"]])
    return np.concatenate([place + (time - row["time"]) * velocity - time * own, velocity - own])


def bound(radar: RadarSettings, state: Array, began: float) -> Bound:
    """The Cramér-Rao bound on the relative motion, which does not change, from all looks since the start.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 2.7:
    the information of independent Gaussian measurements adds up. A look counts with its probability.

    Parameters
    ----------
    state : (4,) the true relative state at the start
    began : s, when steady tracking began
    """
    speed = np.hypot(*state[2:])
    along = state[2:] / speed
    across = np.array([along[1], -along[0]])
    course, pace = [], []
    for now in began + TIMES:
        information = np.zeros((4, 4))
        for time in np.arange(0.0, now, radar.rotation_s):
            distance, azimuth = to_polar(*(state[:2] + time * state[2:]))
            sight = np.array([[np.sin(azimuth), np.cos(azimuth)], [np.cos(azimuth), -np.sin(azimuth)]])
            sd = np.array([radar.sd_range_m, distance * radar.sd_azimuth_deg * DEG])
            H = np.hstack([sight, (time - now) * sight]) / sd[:, None]
            information += radar.p_d * H.T @ H
        P = np.linalg.inv(information)[2:, 2:]
        course.append(np.sqrt(across @ P @ across) / speed)
        pace.append(np.sqrt(along @ P @ along))
    return Bound(np.array(course), np.array(pace))
