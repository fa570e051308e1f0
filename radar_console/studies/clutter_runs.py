"""The runs of the study `ospa_clutter`: six targets that cross one another in clutter, by four trackers."""

from typing import Any

import numpy as np

from radar_console.core.units import KM
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.scoring import Scoring, score
from radar_console.studies import tracked
from radar_console.studies.tracked import Scene, T
from radar_console.studies.work import Arrays, generator

TRACKERS: dict[str, dict[str, Any]] = {
    "NN": {"associator": "nn"},
    "GNN": {"associator": "gnn"},
    "PDA": {"associator": "pda"},
    "JPDA": {"associator": "jpda"},
}
"""Settings by name, where they are not the console's defaults; another tracker is another line."""
FIGURES = (
    "gospa_rms_m",
    "gospa_location_m",
    "gospa_missed_m",
    "gospa_false_m",
    "ospa_m",
    "lost",
    "false_tracks",
)
CUT_OFF = 1.0 * KM
"""c of GOSPA and OSPA, and how far a track may be from the target that it holds, m."""
TARGETS, SCANS, SD = 6, 30, 50.0
_CENTRE, _SIDE, _SPEED = 100.0 * KM, 12.0 * KM, (150.0, 300.0)
_WARM = 5  # scans after the start that are not scored


def scene(density: float, rng: np.random.Generator) -> Scene:
    """Targets with random courses, all within a square in the middle of the time."""
    place = rng.uniform(-0.5 * _SIDE, 0.5 * _SIDE, (TARGETS, 2))
    place[:, 1] += _CENTRE
    speed, heading = rng.uniform(*_SPEED, TARGETS), rng.uniform(0.0, 2.0 * np.pi, TARGETS)
    velocity = speed[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=1)
    state: Array = np.concatenate([place - 0.5 * SCANS * T * velocity, velocity], axis=1)
    return Scene(state, SCANS, SD, _CENTRE, density)


def play(density: float, runs: range, seed: int) -> Arrays:
    """By figure, (trackers, runs); all trackers and densities get the same targets and errors."""
    rows = []
    for run in runs:
        played = tracked.play(scene(density, generator(seed, run, 1)), generator(seed, run))
        truth = played.truth[played.truth["time"] > _WARM * T]
        how = Scoring(cut_off=CUT_OFF, gate=CUT_OFF, interval=T)
        each = [
            score(truth, tracked.follow(played, settings, True, seed + run), how)
            for settings in TRACKERS.values()
        ]
        rows.append(each)
    return {
        name: np.array([[each[k][name] for each in rows] for k in range(len(TRACKERS))]) for name in FIGURES
    }
