"""Seven crossing targets: are tracks kept where targets are close and paths cross?

The paper, section 3.2.2, figures 7 to 14: seven targets on complex, crossing trajectories, which are shown
as pictures only, tracked with JPDA and a particle filter. Published: one picture of the tracks (figure 14),
and the claim that tracks stay on the trajectories when targets fly close together and cross. No figures.

The scenario `seven-targets` is of that kind: straight, accelerating and turning legs of up to 2 g, and six
meetings, among them a pair that flies 2.5 km apart for five minutes and then crosses twice; raw returns, 4 s
a turn. Truth and track of each target are drawn for one run, which has the scenario's own seed (figures 7 to
13), then all of them (figure 14; the console's own picture of it is
`radar-console seven-targets --after 600 --screenshot figure-14.png`). The rest is over all runs:

- a *meeting* is a stretch of time in which two targets are within 3 km. It is *kept* when both have the
  same track 20 s after it as 5 s before it, or 40 s from the start where it begins with them;
- continuity is the part of its time in which a target has a track within 2 km; swaps, lost targets and false
  tracks are those of `evaluation/track_metrics.py`.

Running time: 100 runs take some four minutes on one core.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from radar_console.core.messages import Table, TrackStatus
from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.evaluation.sampling import snapshots
from radar_console.studies import scenario_runs, seven_figures
from radar_console.studies.findings import Finding, found
from radar_console.studies.scenario_runs import NOBODY, Picture
from radar_console.studies.work import Arrays, Work, generator

RUNS = 100
NAME = "seven-targets"
SEED = 7
"""Of the run that is drawn, the scenario's own."""

CLOSE = 3000.0  # m
_BEFORE, _AFTER, _SETTLED = 5, 20, 40  # s, which are instants of the scoring
_SIZE = 2  # runs of a part
_BOUNDS = 0


class Meeting(NamedTuple):
    """Two targets within `CLOSE` of each other.

    Attributes
    ----------
    first, second : numbers of the targets, from 0
    before, after : the instants between which tracks must stay with their targets
    closest : the instant at which they are nearest
    distance : m, at that instant
    """

    first: int
    second: int
    before: int
    after: int
    closest: int
    distance: float

    @property
    def name(self) -> str:
        """For tables and figures, with the targets as the scenario names them."""
        return f"{self.first + 1} and {self.second + 1}, {self.closest} s"


def run(work: Work) -> list[Finding]:
    """Make all runs; the findings, the paper's claim first."""
    picture = scenario_runs.one(work, NAME, SEED)
    result = scenario_runs.several(work, NAME, [NAME], _SIZE)[NAME]
    met = meetings(places(picture.truth))
    through = {each: intervals.proportion(kept(result["holder"], each)) for each in met}
    held = [intervals.mean(each) for each in result["target_continuity"]]
    seven_figures.each(work, picture, followed(picture), met)
    seven_figures.whole(work, picture, followed(picture), met)
    seven_figures.over_runs(work, through, held)
    return [*_claim(result, met), *_meetings(through), *_targets(result), *_sums(result, work.seed)]


def places(truth: Table) -> Array:
    """Positions (instants, targets, 2), m, of a truth in which all targets are there all the time."""
    targets = len(np.unique(truth["target"]))
    order = np.lexsort((truth["target"], truth["time"]))
    plane = np.stack([truth["east"], truth["north"]], axis=1)[order]
    result: Array = plane.reshape(-1, targets, 2)
    return result


def meetings(at: Array) -> list[Meeting]:
    """All meetings of targets at `at` (instants, targets, 2), m, one instant a second; by time."""
    met = []
    last = len(at) - 1
    for first in range(at.shape[1]):
        for second in range(first + 1, at.shape[1]):
            distance = np.linalg.norm(at[:, first] - at[:, second], axis=1)
            turns = np.flatnonzero(np.diff(np.concatenate([[0], distance < CLOSE, [0]]).astype(int)))
            for begin, end in turns.reshape(-1, 2).tolist():
                closest = begin + int(distance[begin:end].argmin())
                before, after = max(begin - _BEFORE, _SETTLED), min(end + _AFTER, last)
                met.append(Meeting(first, second, before, after, closest, float(distance[closest])))
    return sorted(met, key=lambda meeting: meeting.closest)


def kept(holder: NDArray[Any], meeting: Meeting) -> NDArray[np.bool_]:
    """(runs,) whether both targets kept their tracks; `holder` (instants, targets, runs)."""
    pair = [meeting.first, meeting.second]
    before, after = holder[meeting.before, pair], holder[meeting.after, pair]
    result: NDArray[np.bool_] = ((before == after) & (before != NOBODY)).all(axis=0)
    return result


def followed(picture: Picture) -> list[Table]:
    """For each target, the rows of the track that holds it longest, from its confirmation on."""
    pictures = list(snapshots(picture.truth, picture.tracks))
    holder, _ = scenario_runs.holders(pictures, np.unique(picture.truth["target"]).astype(np.int64), CLOSE)
    shown = picture.tracks[np.isin(picture.tracks["status"], (TrackStatus.CONFIRMED, TrackStatus.COASTING))]
    rows = []
    for column in holder.T:
        numbers, count = np.unique(column[column != NOBODY], return_counts=True)
        rows.append(shown[shown["track"] == (numbers[count.argmax()] if len(numbers) else NOBODY)])
    return rows


def _claim(result: Arrays, met: Sequence[Meeting]) -> list[Finding]:
    """The paper's claim, over all runs."""
    through = np.all([kept(result["holder"], each) for each in met], axis=0)
    clean = through & (result["swaps"] == 0) & (result["lost"] == 0)
    all_meetings, all_clean = intervals.proportion(through), intervals.proportion(clean)
    said = "the paper, of one picture: tracks are kept; here"
    return [
        found(f"all {len(met)} meetings of a run kept", "", all_meetings, f"{said} {_of(through)}"),
        found("no swap and no lost target in a run", "", all_clean, f"{said} {_of(clean)}"),
    ]


def _meetings(through: dict[Meeting, Interval]) -> list[Finding]:
    rows = []
    for meeting, share in through.items():
        near = f"{meeting.distance / 1e3:.2g} km apart at the closest"
        rows.append(found(f"kept through the meeting of {meeting.name}", "", share, near))
    return rows


def _targets(result: Arrays) -> list[Finding]:
    rows = []
    for number, (held, error) in enumerate(
        zip(result["target_continuity"], result["target_rmse"], strict=True), start=1
    ):
        accuracy = f"RMSE of position {np.sqrt(np.nanmean(error**2)):.0f} m"
        rows.append(found(f"continuity of target {number}", "", intervals.mean(held), accuracy))
    return rows


def _sums(result: Arrays, seed: int) -> list[Finding]:
    rng = generator(seed, _BOUNDS)
    rmse = intervals.bootstrap(intervals.root_mean_square, result["rmse_position_m"], rng=rng)
    false = intervals.bootstrap(intervals.average, result["false_tracks"], rng=rng)
    rows = [
        found("time to confirm", "s", intervals.mean(result["time_to_confirm_s"]), "a turn takes 4 s"),
        found("RMSE of position", "m", rmse, "of all targets while they have a track"),
        found("false tracks a run", "", false, "of all that are confirmed"),
    ]
    for name, what in (
        ("swaps", "runs with a swap"),
        ("fragments", "runs with a break of a track"),
        ("lost", "runs with a lost target"),
        ("false_tracks", "runs with a false track"),
        ("duplicate_tracks", "runs with a second track of a target"),
    ):
        total = f"{result[name].sum():,.0f} in {len(result[name]):,} runs"
        rows.append(found(what, "", intervals.proportion(result[name] > 0), total))
    return rows


def _of(flags: NDArray[np.bool_]) -> str:
    return f"{int(flags.sum()):,} of {len(flags):,} runs"
