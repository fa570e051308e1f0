"""Runs of scenarios that come along, for the studies of them: the score of each run, and what it is made of.

Run k of seed s plays the scenario with seed s + k, as `evaluation` does.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

# What a chain loads late is named here, so that parts are done anew when it changes.
import radar_console.plots.clustering as clustering
import radar_console.simulator.radar as simulator
import radar_console.tracker.stage as tracker
from radar_console import scenario
from radar_console.chain import Chain
from radar_console.core.messages import TRACK, Table
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.assignment import match
from radar_console.evaluation.gospa import gospa
from radar_console.evaluation.sampling import Snapshot, snapshots
from radar_console.evaluation.scenario_run import ScenarioRun, follow, truth_of
from radar_console.evaluation.scoring import METRICS, score
from radar_console.evaluation.track_metrics import track_metrics_of
from radar_console.studies.work import Arrays, Part, Work, chunks

LOADED = (clustering, simulator, tracker)
"""The stages of a chain."""

NOBODY = -1
OF_TARGETS = ("continuity", "swaps", "lost", "fragments", "time_to_confirm", "longest_segment")
_STEP = 4  # instants of the scoring between those of the curves over time


class Picture(NamedTuple):
    """One run, to be drawn.

    Attributes
    ----------
    truth : TRUTH, at the instants of the scoring
    tracks : TRACK, all rows
    seen : (n, 2) centroids, m east and north
    """

    truth: Table
    tracks: Table
    seen: Array


def shipped(name: str) -> ScenarioRun:
    """Runs of a scenario that comes along, by its name."""
    raw = scenario.read_toml(scenario.shipped()[name])
    return ScenarioRun(raw, Path(f"{name}.toml"))


def several(work: Work, title: str, names: Sequence[str], size: int = 1) -> dict[str, Arrays]:
    """All runs of some scenarios, `size` of them a part; see `scored`."""
    each = chunks(work.runs, size)
    parts = [Part(scored, (shipped(name), some, work.seed), len(some)) for name in names for some in each]
    done = iter(work.do(title, parts))
    return {name: _together([next(done) for _ in each]) for name in names}


def one(work: Work, name: str, seed: int) -> Picture:
    """One run of a scenario, to be drawn."""
    arrays: Mapping[str, Any] = work.do(f"{name}, one run", [Part(pictured, (shipped(name), seed))])[0]
    return Picture(arrays["truth"], arrays["tracks"], arrays["seen"])


def scored(run: ScenarioRun, runs: range, seed: int) -> Arrays:
    """The figures of some runs, which lie on the last axis.

    Returns
    -------
    (runs,) by the names of `scoring.METRICS`; (targets, runs) `target_…` by `OF_TARGETS` and
    `target_rmse`, m; (instants, targets, runs) `holder`, see `holders`; over time, every fourth
    instant, (instants, runs) `time_gospa`, m, `time_held`, targets with a track within the gate, and
    `time_false`, the other tracks
    """
    return _together([_one_scored(run, seed + number) for number in runs])


def pictured(run: ScenarioRun, seed: int) -> dict[str, Any]:
    """Truth, tracks and centroids of a run."""
    chain = Chain(run.opened({}, seed))
    tracks, seen = [np.empty(0, TRACK)], [np.empty((0, 2))]
    for sector in chain.run():
        tracks.append(sector.tracks)
        distance, azimuth = sector.centroids["range"], sector.centroids["azimuth"]
        seen.append(np.stack([distance * np.sin(azimuth), distance * np.cos(azimuth)], axis=1))
    truth = truth_of(chain.opened, run.scoring.interval)
    return {"truth": truth, "tracks": np.concatenate(tracks), "seen": np.concatenate(seen)}


def _one_scored(run: ScenarioRun, seed: int) -> Arrays:
    chain = Chain(run.opened({}, seed))
    tracks = follow(chain)
    truth, how = truth_of(chain.opened, run.scoring.interval), run.scoring
    figures = score(truth, tracks, how)
    pictures = list(snapshots(truth, tracks))
    story = track_metrics_of(pictures, how.gate, max(round(how.tail / how.interval), 1))
    holder, distance = holders(pictures, story.target, how.gate)
    held = np.isfinite(distance)
    error = np.sqrt(np.nansum(distance**2, axis=0) / np.maximum(held.sum(axis=0), 1))
    curves = pictures[::_STEP]
    result = {name: np.array([figures[name]]) for name in (metric.name for metric in METRICS)}
    result |= {f"target_{name}": getattr(story, name).astype(float)[:, None] for name in OF_TARGETS}
    result |= {
        "target_rmse": np.where(held.any(axis=0), error, np.nan)[:, None],
        "holder": holder[..., None],
        "time_gospa": np.array([[gospa(now.truth, now.estimate, how.cut_off).value] for now in curves]),
        "time_held": held[::_STEP].sum(axis=1, dtype=float)[:, None],
    }
    shown = np.array([[len(now.track)] for now in curves], float)
    return result | {"time_false": shown - result["time_held"]}


def holders(
    pictures: Sequence[Snapshot], targets: NDArray[np.int64], gate: float
) -> tuple[NDArray[np.int64], Array]:
    """Which track is at each target at each instant, by the assignment of the least distances.

    It knows nothing of earlier instants, so it is worth something where targets are farther apart than
    the gate, m.

    Returns
    -------
    holder, distance : (instants, targets) numbers of tracks, `NOBODY` where there is none, and m, NaN there
    """
    holder = np.full((len(pictures), len(targets)), NOBODY, np.int64)
    distance = np.full(holder.shape, np.nan)
    for k, now in enumerate(pictures):
        row, column, apart = match(now.truth, now.estimate, gate, 1.0)
        place = np.searchsorted(targets, now.target[row])
        holder[k, place], distance[k, place] = now.track[column], apart
    return holder, distance


def _together(parts: Sequence[Arrays]) -> Arrays:
    """Runs one after another on the last axis."""
    return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]}
