"""The story of each target and each track over a whole run.

Two assignments are made at every instant of the truth, both within a gate:

- **sticky, one to one**: a target and the track that held it last stay together whenever both are there
  and within the gate of each other, unless the track has held another since; what is left is paired by
  least distance [1]. It tells who holds whom.
- **nearest, many to one**: each track belongs to the target nearest to it [2]. It tells how many
  tracks a target has.

[1] Bernardin, Stiefelhagen, Evaluating multiple object tracking performance: the CLEAR MOT metrics,
    EURASIP Journal on Image and Video Processing, 2008.
[2] Votruba, Nisley, Rothrock, Zombro, Single Integrated Air Picture (SIAP) metrics implementation,
    SIAP System Engineering Task Force, 2001.
[3] Li, Huang, Nevatia, Learning to associate: HybridBoosted multi-target tracker for crowded scene,
    CVPR, 2009.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from radar_console.core.messages import Table
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.assignment import match
from radar_console.evaluation.rmse import Rmse, rmse
from radar_console.evaluation.sampling import Snapshot, snapshots

Numbers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class TrackMetrics:
    """How targets were held and what tracks were; n targets, m tracks that were ever confirmed.

    Attributes
    ----------
    target : (n,) their numbers
    time_to_confirm : (n,) s from the target's first instant to the first at which a track holds it;
        NaN never
    continuity : (n,) part of the target's instants at which a track holds it
    fragments : (n,) how often it was let go and held again, by whichever track  [3, "Frag"]
    swaps : (n,) how often the track that holds it is not the one that held it last  [1, "mismatch"]
    lost : (n,) it was held, but at none of its last instants (`tail` of them)
    longest_segment : (n,) the longest stretch of instants at which one track holds it without a break, as
        part of the target's instants; their mean weighted with the targets' lives is [2, "LS"]
    track : (m,) their numbers
    false : (m,) at more than half of its instants the track is near no target
    duplicate : (m,) at more than half of its instants it is near a target that another track holds
    purity : (m,) of the instants at which the track holds a target, the part that belongs to the
        target it holds most; NaN where it never holds one
    completeness : part of the targets, over all instants, that have a track  [2, "C"]
    ambiguity : tracks a target that has one, 1 is best  [2, "A"]
    spuriousness : part of the tracks, over all instants, that are near no target  [2, "S"]
    number_changes : swaps, over all targets, in a second in which a target is held, 1/s  [2, "R"]
    position_accuracy, velocity_accuracy : mean distance of the tracks from their targets, m and m/s;
        [2, "PA", "VA"]
    position_rmse, velocity_rmse : of targets and the tracks that hold them, over all instants, m and
        m/s, with the components east and north

    A ratio without anything to count is NaN.
    """

    target: Numbers
    time_to_confirm: Array
    continuity: Array
    fragments: Numbers
    swaps: Numbers
    lost: Flags
    longest_segment: Array
    track: Numbers
    false: Flags
    duplicate: Flags
    purity: Array
    completeness: float
    ambiguity: float
    spuriousness: float
    number_changes: float
    position_accuracy: float
    velocity_accuracy: float
    position_rmse: Rmse
    velocity_rmse: Rmse


def track_metrics(
    truth: Table, tracks: Table, gate: float = 2000.0, tail: int = 10, memory: float = np.inf
) -> TrackMetrics:
    """Score a run.

    Parameters
    ----------
    truth : TRUTH, at the instants of the scoring
    tracks : TRACK, all rows of the run; see `sampling.snapshots` for what counts as held, and where
        a track is between its rows
    gate : m, how far a track may be from the target that it holds
    tail : instants at the end of a target's life that decide whether it was lost
    memory : s that a track lives on after its last row

    Raises
    ------
    ValueError         gate or tail is not positive
    """
    return track_metrics_of(snapshots(truth, tracks, memory), gate, tail)


def track_metrics_of(pictures: Iterable[Snapshot], gate: float = 2000.0, tail: int = 10) -> TrackMetrics:
    """Score a run by its snapshots, in the order of time; see `track_metrics`."""
    if not gate > 0.0 or tail < 1:
        raise ValueError(f"gate must be positive and tail at least 1, not {gate} and {tail}")
    # Who held whom is gathered flat over all instants, and then summed up by target and by track.
    seen_time: list[Array] = [np.empty(0)]
    seen_target, holder, shown_track, holds = [_none()], [_none()], [_none()], [_none()]
    near: list[Flags] = [np.empty(0, np.bool_)]
    distances: list[Array] = [np.empty(0)]
    speeds: list[Array] = [np.empty(0)]
    at: list[Array] = [np.empty((0, 2, 4))]  # the states of target and track in each pair that holds
    covered = 0
    bonds = _Bonds()
    for now in pictures:
        row, column = bonds.pair(now, gate)
        held = np.full(len(now.target), -1, np.int64)
        held[row] = column
        seen_time.append(np.full(len(now.target), now.time))
        seen_target.append(now.target)
        at.append(_states(now, row, column))
        holder.append(np.where(held >= 0, now.track[held] if len(now.track) else -1, _NOBODY))
        holding = np.full(len(now.track), _NOBODY)
        holding[column] = now.target[row]
        nearest, distance = _nearest(now)
        inside = distance <= gate
        shown_track.append(now.track)
        near.append(inside)
        holds.append(holding)
        covered += len(np.unique(nearest[inside]))
        distances.append(distance[inside])
        speeds.append(np.linalg.norm(now.velocity - now.truth_velocity[nearest], axis=1)[inside]
                      if len(now.target) else np.empty(0))  # fmt: skip
    times = np.concatenate(seen_time)
    of_targets = _targets(times, np.concatenate(seen_target), np.concatenate(holder), tail)
    of_tracks = _tracks(np.concatenate(shown_track), np.concatenate(near), np.concatenate(holds))
    assigned = sum(map(len, distances))
    pairs = np.concatenate(at)
    instants = np.unique(times)
    step = float(np.median(np.diff(instants))) if len(instants) > 1 else float("nan")
    return TrackMetrics(
        *of_targets,
        *of_tracks,
        completeness=_ratio(covered, sum(map(len, seen_target))),
        ambiguity=_ratio(assigned, covered),
        spuriousness=_ratio(sum(map(len, shown_track)) - assigned, sum(map(len, shown_track))),
        number_changes=_ratio(float(of_targets[4].sum()), len(pairs)) / step,
        position_accuracy=_ratio(float(np.concatenate(distances).sum()), assigned),
        velocity_accuracy=_ratio(float(np.concatenate(speeds).sum()), assigned),
        position_rmse=rmse(pairs[:, 0, :2], pairs[:, 1, :2]),
        velocity_rmse=rmse(pairs[:, 0, 2:], pairs[:, 1, 2:]),
    )


_NOBODY = np.iinfo(np.int64).min


def _none() -> Numbers:
    return np.empty(0, np.int64)


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")


def _states(now: Snapshot, row: Numbers, column: Numbers) -> Array:
    """East, north and their rates of the targets and tracks of pairs, (pairs, 2, 4)."""
    true = np.concatenate([now.truth[row], now.truth_velocity[row]], axis=1)
    shown = np.concatenate([now.estimate[column], now.velocity[column]], axis=1)
    return np.stack([true, shown], axis=1)


class _Bonds:
    """Who held whom last."""

    def __init__(self) -> None:
        self._track_of: dict[int, int] = {}
        self._target_of: dict[int, int] = {}

    def pair(self, now: Snapshot, gate: float) -> tuple[Numbers, Numbers]:
        """Rows of the targets that are held, and of the tracks that hold them."""
        rows, columns = self._kept(now, gate)
        free_rows = np.setdiff1d(np.arange(len(now.target)), rows)
        free_columns = np.setdiff1d(np.arange(len(now.track)), columns)
        beyond = float(np.nextafter(gate, np.inf))
        first, second, _ = match(now.truth[free_rows], now.estimate[free_columns], beyond, 1.0)
        rows, columns = np.append(rows, free_rows[first]), np.append(columns, free_columns[second])
        targets, tracks = now.target[rows].tolist(), now.track[columns].tolist()
        self._track_of.update(zip(targets, tracks, strict=True))
        self._target_of.update(zip(tracks, targets, strict=True))
        return rows, columns

    def _kept(self, now: Snapshot, gate: float) -> tuple[Numbers, Numbers]:
        """Bonds in which each is the other's last, and that still hold."""
        place = {track: j for j, track in enumerate(now.track.tolist())}
        kept = [
            (i, place[track])
            for i, target in enumerate(now.target.tolist())
            if (track := self._track_of.get(target, _NOBODY)) in place and self._target_of[track] == target
        ]
        rows, columns = np.array(kept, np.int64).reshape(-1, 2).T
        inside = np.linalg.norm(now.truth[rows] - now.estimate[columns], axis=1) <= gate
        return rows[inside], columns[inside]


def _nearest(now: Snapshot) -> tuple[Numbers, Array]:
    """Of each track, the row of the nearest target and the distance to it, m."""
    if not len(now.target):
        return np.zeros(len(now.track), np.int64), np.full(len(now.track), np.inf)
    found = KDTree(now.truth).query(now.estimate)
    return np.asarray(found[1], np.int64), np.asarray(found[0], float)


def _targets(
    time: Array, target: Numbers, holder: Numbers, tail: int
) -> tuple[Numbers, Array, Array, Numbers, Numbers, Flags, Array]:
    """Sums over the instants of each target; the arrays are in the order of time."""
    numbers, owner = np.unique(target, return_inverse=True)
    n = len(numbers)
    order = np.argsort(owner, kind="stable")
    time, owner, holder = time[order], owner[order], holder[order]
    held = holder != _NOBODY
    instants = np.bincount(owner, minlength=n)
    start = np.cumsum(instants) - instants
    # Among the held instants of a target: a gap before one is a fragment, another holder a swap.
    at, who = np.flatnonzero(held), owner[held]
    same = who[1:] == who[:-1]
    gap = same & (np.diff(at) > 1)
    other = same & (holder[at][1:] != holder[at][:-1])
    time_to_confirm = np.full(n, np.nan)
    first = np.flatnonzero(np.append(True, ~same)) if len(at) else at
    time_to_confirm[who[first]] = time[at[first]] - time[start[who[first]]]
    late = np.arange(len(owner)) >= (start + instants - tail)[owner]
    return (
        numbers,
        time_to_confirm,
        np.bincount(who, minlength=n) / instants,
        np.bincount(who[1:][gap], minlength=n),
        np.bincount(who[1:][other], minlength=n),
        (np.bincount(who, minlength=n) > 0) & (np.bincount(owner[held & late], minlength=n) == 0),
        _longest(who, n, gap | other | ~same) / instants,
    )


def _longest(who: Numbers, n: int, cut: Flags) -> Array:
    """The most rows in a row of each of `n` owners; `cut` (rows - 1,) where a new stretch begins."""
    longest = np.zeros(n)
    if len(who):
        starts = np.flatnonzero(np.append(True, cut))
        np.maximum.at(longest, who[starts], np.diff(np.append(starts, len(who))))
    return longest


def _tracks(track: Numbers, near: Flags, holds: Numbers) -> tuple[Numbers, Flags, Flags, Array]:
    """Sums over the instants of each track."""
    numbers, owner = np.unique(track, return_inverse=True)
    m = len(numbers)
    holding = holds != _NOBODY
    instants = np.bincount(owner, minlength=m)
    false = np.bincount(owner[~near & ~holding], minlength=m) > 0.5 * instants
    duplicate = np.bincount(owner[near & ~holding], minlength=m) > 0.5 * instants
    pairs, count = np.unique(np.stack([owner[holding], holds[holding]], axis=1), axis=0, return_counts=True)
    most, total = np.zeros(m), np.bincount(owner[holding], minlength=m)
    np.maximum.at(most, pairs[:, 0], count)
    purity = np.divide(most, total, out=np.full(m, np.nan), where=total > 0)
    return numbers, false, duplicate, purity
