"""The runs of the study `crossing`: two targets cross, and what became of the tracks that followed them."""

from typing import Any, Literal, NamedTuple

import numpy as np

from radar_console.core.messages import Table, TrackStatus
from radar_console.core.units import DEG, KM, KMH
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.sampling import snapshots
from radar_console.studies import tracked
from radar_console.studies.tracked import GIVEN, Played, Scene, T
from radar_console.studies.work import Arrays, generator

MEETING = 537.0
"""When the targets of the paper are closest, s after their start."""
BEFORE, AFTER = 80.0, 120.0
"""What is played, s before and after the meeting."""
DISTANCE = 106.0 * KM
"""Of the meeting from the radar, m."""
NEAR = 1.0 * KM
"""A track is with a target within it, m. At the end the targets are 23 km apart."""
_APART = 30.0 * KM
_TAIL = 5  # scans at the end that decide; a track is with a target in most of them
_EARLY = 20.0  # s before the meeting

TRACKERS: dict[str, dict[str, Any]] = {
    "GNN": {"associator": "gnn"},
    "JPDA": {"associator": "jpda"},
    "GNN, Kalman": {"associator": "gnn", "filter": "kalman"},
    "JPDA, Kalman": {"associator": "jpda", "filter": "kalman"},
    "GNN, gate 0.99": {"associator": "gnn", "gate_probability": 0.99},
    "GNN, straight": {"associator": "gnn", "process_noise_m2ps3": 1.0},
    "JPDA, straight": {"associator": "jpda", "process_noise_m2ps3": 1.0},
}
"""Settings by name, where they are not the console's defaults; another tracker is another line."""


class Cell(NamedTuple):
    """What is played.

    Attributes
    ----------
    sd : of a measured position in each axis, m
    density : of the clutter, per km²
    initiation : new tracks may start beside the two given
    where : "published", they miss each other by 415 m; "meeting", the second target is moved so that they
        meet; "apart", it is moved aside, and they stay 15 km from each other
    """

    sd: float
    density: float
    initiation: bool = False
    where: Literal["published", "meeting", "apart"] = "published"

    @property
    def name(self) -> str:
        where = "" if self.where == "published" else f", {self.where}"
        return f"σ = {self.sd:g} m, {self.density:g}/km²{where}"


def published(time: float) -> Array:
    """States (2, 4) of the paper's targets, `time` s after their start: m and m/s, east and north."""
    azimuth, heading = np.array([150.0, 180.0]) * DEG, np.array([330.0, 26.0]) * DEG
    speed = np.array([630.0, 810.0]) * KMH
    velocity = speed[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=1)
    start = 200.0 * KM * np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)
    return np.concatenate([start + time * velocity, velocity], axis=1)


def scene(cell: Cell) -> Scene:
    """The minutes about the meeting."""
    state = published(MEETING - BEFORE)
    if cell.where == "meeting":
        apart, closing = (state[1] - state[0]).reshape(2, 2)
        state[1, :2] -= apart - closing * (apart @ closing) / (closing @ closing)
    elif cell.where == "apart":
        state[1, 0] += _APART
    return Scene(state, round((BEFORE + AFTER) / T), cell.sd, DISTANCE, cell.density)


def play(cell: Cell, trackers: tuple[str, ...], runs: range, seed: int) -> Arrays:
    """What became of the tracks, by event: (trackers, runs) bool; see `outcome`."""
    events = []
    for run in runs:
        played = tracked.play(scene(cell), generator(seed, run))
        events.append([outcome(rows(played, cell, name, seed + run), played.truth) for name in trackers])
    return {
        event: np.array([[each[k][event] for each in events] for k in range(len(trackers))])
        for event in events[0][0]
    }


def rows(played: Played, cell: Cell, tracker: str, seed: int) -> Table:
    """TRACK: what a tracker, by its name, says of a run."""
    return tracked.follow(played, TRACKERS[tracker], cell.initiation, seed)


def outcome(tracks: Table, truth: Table) -> dict[str, bool]:
    """What became of the two tracks given.

    swap : in the end one of them is with the other's target
    lost : in the end one of the targets is without either
    extra : a third track was confirmed at some time
    kept : in the end both are with their own targets
    early : one of them was away from its own target already 20 s before the meeting
    """
    pictures = list(snapshots(truth, tracks))
    beside = np.zeros((len(pictures), 2, 2), np.bool_)  # scan, track, target
    for k, now in enumerate(pictures):
        given = now.track >= GIVEN
        apart = np.linalg.norm(now.estimate[given][:, None] - now.truth, axis=-1)
        beside[k, now.track[given] - GIVEN] = apart < NEAR
    end = beside[-_TAIL:].mean(axis=0) > 0.5
    times = np.array([now.time for now in pictures])
    early = beside[np.searchsorted(times, BEFORE - _EARLY)]
    confirmed = np.unique(tracks["track"][tracks["status"] == TrackStatus.CONFIRMED])
    return {
        "swap": bool(end[0, 1] or end[1, 0]),
        "lost": bool((~end.any(axis=0)).any()),
        "extra": bool((confirmed < GIVEN).any()),
        "kept": bool(end[0, 0] and end[1, 1]),
        "early": bool(~(early[0, 0] and early[1, 1])),
    }
