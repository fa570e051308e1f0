"""A run of a scenario: simulator, chain, and its score against the truth."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from radar_console.chain import Chain, Opened, simulation
from radar_console.core.messages import TRACK, Table
from radar_console.evaluation.grid import Setting, varied
from radar_console.evaluation.scoring import METRICS, Metric, Scoring, score

RUN_METRICS = (
    *METRICS,
    Metric("tracker_ms_per_turn", "tracker time", "ms", "less", "processor time a turn, median of the turns"),
)
"""What a run gives."""


@dataclass(frozen=True, slots=True)
class ScenarioRun:
    """Run a scenario under a setting with a seed, on whatever machine it is called.

    Attributes
    ----------
    raw : the scenario's TOML
    file : named in errors
    scoring : how it is scored
    """

    raw: Mapping[str, Any]
    file: Path
    scoring: Scoring = field(default_factory=Scoring)

    def __call__(self, setting: Setting, seed: int) -> dict[str, float]:
        """The figures, by the names of `RUN_METRICS`; the same seed gives the same, but for times."""
        chain = Chain(self.opened(setting, seed), clock=time.thread_time)
        tracks, truth = follow(chain), truth_of(chain.opened, self.scoring.interval)
        took = 1e3 * chain.tally.tracker_s.quantile(0.5)
        return score(truth, tracks, self.scoring) | {"tracker_ms_per_turn": took}

    def opened(self, setting: Setting, seed: int) -> Opened:
        """The simulation under a setting.

        Raises
        ------
        ScenarioError   the setting is none, or the scenario can't be played with it
        """
        return simulation(varied(self.raw, setting, self.file), seed, self.file)


def follow(chain: Chain) -> Table:
    """All rows of all tracks of a run: TRACK."""
    rows = [sector.tracks for sector in chain.run() if len(sector.tracks)]
    return np.concatenate(rows) if rows else np.empty(0, TRACK)


def truth_of(opened: Opened, interval: float) -> Table:
    """Where the targets are every `interval` s of a simulation: TRUTH."""
    assert opened.truth is not None
    count = int(opened.source.duration / interval * (1.0 + 1e-12)) + 1
    return np.concatenate([opened.truth(interval * k) for k in range(count)])
