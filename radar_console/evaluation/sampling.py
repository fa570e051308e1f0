"""What the operator was shown at the instants at which the truth is known."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radar_console.core.messages import Table, TrackStatus
from radar_console.estimation.gaussian import Array

_SLACK = 1e-6  # s; a row this much after an instant still counts as known at it: rounding of times
_SHOWN = (TrackStatus.CONFIRMED, TrackStatus.COASTING)


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The targets that are there at an instant, and the tracks that are held.

    Attributes
    ----------
    time : s
    target : (n,) numbers of the targets
    truth, truth_velocity : (n, 2) east and north, m and m/s
    track : (m,) numbers of the tracks
    estimate, velocity : (m, 2) east and north, m and m/s
    """

    time: float
    target: NDArray[np.int64]
    truth: Array
    truth_velocity: Array
    track: NDArray[np.int64]
    estimate: Array
    velocity: Array


def snapshots(truth: Table, tracks: Table, memory: float = np.inf) -> Iterator[Snapshot]:
    """Both tables at each instant of the truth, in the order of time, rows by their numbers.

    A track is held from its first confirmed row to the row that deletes it, or until `memory` s after
    its last row. Between rows it is where its latest row says, moved on by that row's velocity: what
    was known at the instant, never what came later. Tentative tracks are not shown.

    Parameters
    ----------
    truth : TRUTH; targets may come and go
    tracks : TRACK, in any order
    memory : s
    """
    times, instant = np.unique(truth["time"], return_inverse=True)
    order = np.lexsort((truth["target"], instant))
    truth = truth[order]
    shown, moment = _held(tracks, times, memory)
    ends_truth = np.searchsorted(instant[order], np.arange(len(times) + 1))
    ends_shown = np.searchsorted(moment, np.arange(len(times) + 1))
    for k, time in enumerate(times):
        there = truth[ends_truth[k] : ends_truth[k + 1]]
        held = shown[ends_shown[k] : ends_shown[k + 1]]
        velocity = _plane(held, "v_east", "v_north")
        yield Snapshot(
            float(time),
            there["target"].astype(np.int64),
            _plane(there, "east", "north"),
            _plane(there, "v_east", "v_north"),
            held["track"],
            _plane(held, "east", "north") + (time - held["time"])[:, None] * velocity,
            velocity,
        )


def _held(tracks: Table, times: Array, memory: float) -> tuple[Table, NDArray[np.intp]]:
    """For each instant the latest row of every track held, and the number of the instant."""
    rows = tracks[np.lexsort((tracks["time"], tracks["track"]))]
    last = np.ones(len(rows), np.bool_)
    last[:-1] = rows["track"][1:] != rows["track"][:-1]
    until = np.append(rows["time"][1:], np.inf)
    until[last] = rows["time"][last] + memory
    first = np.searchsorted(times, rows["time"] - _SLACK)
    stop = np.searchsorted(times, until - _SLACK)
    count = np.where(np.isin(rows["status"], _SHOWN), stop - first, 0)
    row = np.repeat(np.arange(len(rows)), count)
    moment = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + first[row]
    order = np.argsort(moment, kind="stable")
    return rows[row[order]], moment[order]


def _plane(table: Table, east: str, north: str) -> Array:
    return np.stack([table[east], table[north]], axis=1)
