"""Problems of association as the tracker has them, and four ways to solve each, with their times.

A problem is a scan: tracks predicted near their targets, the targets' plots, and clutter. The ways: all
joint events one by one, the same for each cluster by itself (the paper's remedy), the exact sums of
`tracker/association/jpda.py`, and the belief propagation that it falls back to.
"""

import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.random import Generator
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from radar_console.estimation.gaussian import Array
from radar_console.studies.work import Arrays, generator
from radar_console.tracker.association import jpda
from radar_console.tracker.association.pairs import Ints

SD = 100.0
"""Of a plot in each axis, m; a prediction has 0.6 of its variance."""
GATE = 18.4
"""Squared distance, in deviations, within which a plot is a track's: P_G = 0.9999."""
RADIUS = float(np.sqrt(1.6 * GATE)) * SD
"""Of a gate, m."""
LIMIT = 3.0e6
"""Joint events that are enumerated; where there are more, they are only counted."""
WAYS = ("all", "clusters", "exact", "propagation")

_P_D, _P_G = 0.9, 0.9999
_DENSITY = 1e-6  # m⁻², of the clutter
_PRUNE = 1e-3  # of the miss: pairs below are left out, as in the tracker
_GROUP, _FAR = 4, 20.0  # targets in a group; distance between groups in radii
_PATIENCE = 2e-3  # s, of repeated calls
_AMPLE = 1e8  # steps of the exact sums that differences and counts are taken from


class Problem(NamedTuple):
    """Pairs of tracks and plots, as `jpda.sparse` takes them."""

    miss: Array
    columns: int
    row: Ints
    col: Ints
    w: Array


class Point(NamedTuple):
    """Where times are taken.

    Attributes
    ----------
    layout : "abreast", in one line; "groups", of four, far from one another
    targets : how many
    spacing : between neighbours, in radii of a gate; below 2 their gates overlap
    """

    layout: str
    targets: int
    spacing: float


def problem(point: Point, rng: Generator) -> Problem:
    """A scan of targets in a line, in clutter of 1 per km² within a gate of each."""
    number = np.arange(point.targets)
    east = point.spacing * RADIUS * number
    if point.layout == "groups":
        east = point.spacing * RADIUS * (number % _GROUP) + _FAR * RADIUS * (number // _GROUP)
    truth = np.stack([east, np.zeros(point.targets)], axis=1)
    predicted = truth + np.sqrt(0.6) * SD * rng.standard_normal(truth.shape)
    seen = truth[rng.random(point.targets) < _P_D]
    seen = seen + SD * rng.standard_normal(seen.shape)
    reach = 2.0 * RADIUS
    width = truth[-1, 0] + 2.0 * reach
    false = rng.random((rng.poisson(_DENSITY * width * 2.0 * reach), 2))
    false = (false - [0.0, 0.5]) * [width, 2.0 * reach] - [reach, 0.0]
    plots = np.concatenate([seen, false])
    d2 = np.sum((plots - predicted[:, None]) ** 2, axis=-1) / (1.6 * SD**2)
    w = _P_D * np.exp(-0.5 * d2) / (2.0 * np.pi * 1.6 * SD**2) / _DENSITY
    miss = np.full(point.targets, 1.0 - _P_D * _P_G)
    row, col = map(np.ascontiguousarray, np.nonzero((d2 <= GATE) & (w >= _PRUNE * miss[:, None])))
    return Problem(miss, len(plots), row, col, w[row, col])


def measure(point: Point, runs: range, seed: int) -> Arrays:
    """By way: processor time, s, (runs,), NaN where there are too many events; events, and differences.

    `wrong`: the largest difference between an enumeration and the exact sums; `rough`: between
    propagation and the exact sums, NaN where these take too long; `past`: whether the tracker would have had
    to propagate.
    """
    _measure(problem(Point("groups", 8, 1.0), generator(0)))  # the first calls compile
    rows = [_measure(problem(point, generator(seed, run, point.targets))) for run in runs]
    return {name: np.array([each[name] for each in rows]) for name in rows[0]}


def _measure(given: Problem) -> dict[str, float]:
    exact = jpda.sparse(*given, budget=_AMPLE)
    groups = clusters(given)
    each = np.array([events(group) for group in groups])
    whole = float(np.prod(each))
    found = {"all": whole, "clusters": float(each.sum())}
    result = {"events_" + name: count for name, count in found.items()}
    wrong = 0.0
    for name, parts in (("all", [given]), ("clusters", groups)):
        result[name] = np.nan
        if found[name] <= LIMIT:
            if name == "all":
                wrong = float(np.abs(enumerate_events(*given) - exact.p).max(initial=0.0))
            result[name] = timed(partial(_each, parts))
    result["exact"] = timed(lambda: jpda.sparse(*given))
    result["propagation"] = timed(lambda: jpda.sparse(*given, budget=0.0))
    rough = np.abs(jpda.sparse(*given, budget=0.0).p - exact.p).max(initial=0.0)
    return result | {
        "wrong": wrong,
        "rough": np.nan if exact.approximate.any() else float(rough),
        "past": float(jpda.sparse(*given).approximate.any()),
        "pairs": float(len(given.row)),
    }


def _each(parts: list[Problem]) -> list[Array]:
    return [enumerate_events(*part) for part in parts]


def timed(call: Callable[[], Any]) -> float:
    """Processor time of a call, s: the median of as many as take 2 ms together, at least one."""
    taken: list[float] = []
    while not taken or (sum(taken) < _PATIENCE and len(taken) < 100):
        began = time.thread_time()
        call()
        taken.append(time.thread_time() - began)
    return float(np.median(taken))


def clusters(given: Problem) -> list[Problem]:
    """The problem cut into tracks that share no plots with others; their plots are numbered anew."""
    tracks = len(given.miss)
    edges = np.ones(len(given.row)), (given.row, tracks + given.col)
    graph = coo_array(edges, shape=2 * (tracks + given.columns,))
    label = connected_components(graph, directed=False)[1][:tracks]
    parts = []
    for one in np.unique(label):
        own = np.flatnonzero(label == one)
        chosen = np.isin(given.row, own)
        plots, col = np.unique(given.col[chosen], return_inverse=True)
        row = np.searchsorted(own, given.row[chosen])
        parts.append(Problem(given.miss[own], len(plots), row, col, given.w[chosen]))
    return parts


def events(given: Problem) -> float:
    """How many joint events are feasible, NaN if that takes too long to find out.

    With all weights 1, each is as likely as that of no plot at all.

    Track by track: among the events of the first t tracks, a part 1 / (events of t / events of t − 1) has
    no plot for the last of them.
    """
    count = 1.0
    for t in range(len(given.miss)):
        row = given.row[given.row <= t]
        ones = jpda.sparse(
            np.ones(t + 1), given.columns, row, given.col[: len(row)], np.ones(len(row)), _AMPLE
        )
        if ones.approximate.any():
            return np.nan
        count /= float(ones.p_miss[t])
    return count


@njit(cache=True, nogil=True)
def enumerate_events(miss: Array, columns: int, row: Ints, col: Ints, w: Array) -> Array:
    """(pairs,) probabilities, by going through every joint event: each track takes a free plot, or none.

    Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §6.2.
    """
    tracks, pairs = miss.size, row.size
    start = np.zeros(tracks + 1, np.int64)
    for k in range(pairs):
        start[row[k] + 1] += 1
    for t in range(tracks):
        start[t + 1] += start[t]
    p, total = np.zeros(pairs), 0.0
    taken = np.zeros(columns, np.bool_)
    # Of each track: the pair that it has now, start - 1 for none, and the weight of all tracks before.
    choice, weight = start[:-1] - 1, np.ones(tracks + 1)
    t = 0
    fresh = True
    while t >= 0:
        if fresh:  # first without a plot
            choice[t] = start[t] - 1
            weight[t + 1] = weight[t] * miss[t]
        else:  # the next pair whose plot is free
            k = choice[t]
            if k >= start[t]:
                taken[col[k]] = False
            k += 1
            while k < start[t + 1] and taken[col[k]]:
                k += 1
            if k == start[t + 1]:
                t -= 1
                continue
            choice[t] = k
            taken[col[k]] = True
            weight[t + 1] = weight[t] * w[k]
        if t + 1 < tracks:
            t += 1
            fresh = True
            continue
        total += weight[tracks]
        for s in range(tracks):
            if choice[s] >= start[s]:
                p[choice[s]] += weight[tracks]
        fresh = False
    return p / total
