"""The figures of a run: one number for each metric, by the names of the columns of `results.csv`."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from radar_console.core.messages import Table
from radar_console.evaluation.gospa import gospa
from radar_console.evaluation.ospa import averaged
from radar_console.evaluation.sampling import snapshots
from radar_console.evaluation.track_metrics import TrackMetrics, track_metrics_of

HOUR = 3600.0


@dataclass(frozen=True, slots=True)
class Scoring:
    """How runs are scored.

    Attributes
    ----------
    cut_off : m, c of GOSPA and OSPA (p = 2)
    gate : m, how far a track may be from the target that it holds
    tail : s, the end of a target's life that decides whether it was lost
    interval : s between the instants of a simulated truth
    """

    cut_off: float = 5000.0
    gate: float = 2000.0
    tail: float = 40.0
    interval: float = 1.0


class Metric(NamedTuple):
    """A column of figures.

    Attributes
    ----------
    name : of the column, with its unit
    title, unit : for people
    better : which way; empty where it is neither
    meaning : of one run
    counts : it is a number of events, of which people also ask in how many runs there was any
    """

    name: str
    title: str
    unit: str
    better: Literal["less", "more", ""]
    meaning: str
    counts: bool = False


METRICS = (
    Metric("gospa_m", "GOSPA", "m", "less", "mean over the instants"),
    Metric("gospa_rms_m", "GOSPA, rms", "m", "less", "root of the mean square over the instants"),
    Metric("gospa_location_m", "its location part", "m", "less", "squares of the three parts add up to rms²"),
    Metric("gospa_missed_m", "its missed part", "m", "less", "from targets without a track"),
    Metric("gospa_false_m", "its false part", "m", "less", "from tracks without a target"),
    Metric("ospa_m", "OSPA", "m", "less", "mean over the instants"),
    Metric("rmse_position_m", "RMSE of position", "m", "less", "over all instants of targets that are held"),
    Metric("rmse_east_m", "RMSE east", "m", "less", "its component"),
    Metric("rmse_north_m", "RMSE north", "m", "less", "its component"),
    Metric("rmse_velocity_mps", "RMSE of velocity", "m/s", "less", "over the same instants"),
    Metric("rmse_v_east_mps", "RMSE of velocity east", "m/s", "less", "its component"),
    Metric("rmse_v_north_mps", "RMSE of velocity north", "m/s", "less", "its component"),
    Metric("targets", "targets", "", "", "that were there"),
    Metric("held", "targets held", "", "more", "at some instant"),
    Metric("time_to_confirm_s", "time to confirm", "s", "less", "mean of the targets that were held"),
    Metric("continuity", "continuity", "", "more", "part of a target's instants at which it is held, mean"),
    Metric(
        "longest_segment", "longest segment", "", "more", "by one track without a break, part of all life"
    ),
    Metric("fragments", "fragments", "", "less", "a target is let go and held again", True),
    Metric("swaps", "swaps", "", "less", "another track holds a target than the last one", True),
    Metric("number_changes_per_h", "number changes", "1/h", "less", "swaps in an hour of a held target"),
    Metric("lost", "lost targets", "", "less", "held once, but not at the end", True),
    Metric("tracks", "tracks", "", "", "that were ever confirmed"),
    Metric("false_tracks", "false tracks", "", "less", "near no target for most of their life", True),
    Metric("duplicate_tracks", "duplicate tracks", "", "less", "near a target that another one holds", True),
    Metric("purity", "purity", "", "more", "part of a track's instants with its main target, mean"),
    Metric("completeness", "completeness", "", "more", "SIAP: part of the targets that have a track"),
    Metric("ambiguity", "ambiguity", "", "less", "SIAP: tracks for a target that has one; 1 is best"),
    Metric("spuriousness", "spuriousness", "", "less", "SIAP: part of the tracks that are near no target"),
    Metric("position_accuracy_m", "position accuracy", "m", "less", "SIAP: mean distance of tracks near one"),
    Metric("velocity_accuracy_mps", "velocity accuracy", "m/s", "less", "SIAP: the same of velocities"),
)
"""What `score` gives."""


def score(truth: Table, tracks: Table, how: Scoring = Scoring()) -> dict[str, float]:
    """All of `METRICS` for a run; NaN where there is nothing to measure.

    Parameters
    ----------
    truth : TRUTH, at the instants of the scoring
    tracks : TRACK, all rows of the run; see `sampling.snapshots` for what counts as held
    """
    pictures = list(snapshots(truth, tracks))
    steps = np.diff([now.time for now in pictures])
    tail = max(round(how.tail / float(np.median(steps))), 1) if len(steps) else 1
    wholes = [gospa(now.truth, now.estimate, how.cut_off) for now in pictures]
    location, missed, false = (
        _mean([getattr(whole, part) for whole in wholes]) for part in ("location", "missed", "false")
    )
    distances = {
        "gospa_m": _mean([whole.value for whole in wholes]),
        "gospa_rms_m": float(np.sqrt(location + missed + false)),
        "gospa_location_m": float(np.sqrt(location)),
        "gospa_missed_m": float(np.sqrt(missed)),
        "gospa_false_m": float(np.sqrt(false)),
        "ospa_m": _mean([averaged(whole, how.cut_off).value for whole in wholes]),
    }
    lives = np.array([len(now.target) for now in pictures]).sum()
    return distances | _story(track_metrics_of(pictures, how.gate, tail), float(lives), truth)


def _story(story: TrackMetrics, lives: float, truth: Table) -> dict[str, float]:
    """The story of targets and tracks, summed up over them."""
    position, velocity = story.position_rmse, story.velocity_rmse
    confirmed = story.time_to_confirm[np.isfinite(story.time_to_confirm)]
    life = np.unique(truth["target"], return_counts=True)[1]
    return {
        "rmse_position_m": float(position.value),
        "rmse_east_m": float(position.components[0]),
        "rmse_north_m": float(position.components[1]),
        "rmse_velocity_mps": float(velocity.value),
        "rmse_v_east_mps": float(velocity.components[0]),
        "rmse_v_north_mps": float(velocity.components[1]),
        "targets": float(len(story.target)),
        "held": float(len(confirmed)),
        "time_to_confirm_s": _mean(confirmed),
        "continuity": _mean(story.continuity),
        "longest_segment": float(story.longest_segment @ life) / lives if lives else float("nan"),
        "fragments": float(story.fragments.sum()),
        "swaps": float(story.swaps.sum()),
        "number_changes_per_h": HOUR * story.number_changes,
        "lost": float(story.lost.sum()),
        "tracks": float(len(story.track)),
        "false_tracks": float(story.false.sum()),
        "duplicate_tracks": float(story.duplicate.sum()),
        "purity": _mean(story.purity[np.isfinite(story.purity)]),
        "completeness": story.completeness,
        "ambiguity": story.ambiguity,
        "spuriousness": story.spuriousness,
        "position_accuracy_m": story.position_accuracy,
        "velocity_accuracy_mps": story.velocity_accuracy,
    }


def _mean(values: ArrayLike) -> float:
    numbers = np.asarray(values, float)
    return float(numbers.mean()) if len(numbers) else float("nan")
