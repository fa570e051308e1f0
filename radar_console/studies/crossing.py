"""GNN and JPDA where two targets cross in clutter.

The paper, section 3.2.3, figures 18 to 20: two targets on straight courses, 630 and 810 km/h, cross after
nine minutes 105 km away. Noise "σ² = 50 m" on the position, 6.7 false points per km². Published, of one
run: GNN goes to the wrong trajectory at the crossing and forms a third track; JPDA keeps two.

As given, the targets miss each other by 415 m (at 537 s, 106 km away). Played are the 80 s before and the
120 s after, 50 scans of 4 s, P_D 0.9; σ = 7.07 m (σ² = 50 m²) and σ = 50 m; clutter of 0.1 to 6.7 per km²
in discs of 3 km about the targets. All trackers get the same plots and the same two tracks at the start, off
by 2 σ and 10 m/s, and know the clutter's density. They have the console's defaults, particle filter and all,
but for the associator. Given tracks are fair to both: from scratch, in dense clutter, confirmation would take
longer than the crossing. Of each run:

- swap: in the end, 23 km apart, one of the tracks given is with the other's target (within 1 km);
- lost: in the end a target is without either of the tracks given;
- extra: a third track was confirmed. Only counted where initiation is at work, in runs of their own with the
  same plots; elsewhere there is room for the two tracks given, so that nothing disturbs swap and loss.

Beside: the Kalman filter; GNN with a gate of 0.99
in place of 0.999999; process noise for straight courses (1 in place of 30 m²/s³). What is due to the crossing
is seen beside the same courses moved aside, 15 km apart at the least, and meeting at 0 m. Intervals are
Wilson's, those of differences Newcombe's for the same runs.

Running time: 200 runs take some forty minutes on one core.
"""

from typing import NamedTuple

import numpy as np

from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.studies import crossing_figures as figures
from radar_console.studies import crossing_runs
from radar_console.studies.crossing_runs import Cell
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Arrays, Part, Work, chunks

RUNS = 200
SIGMAS = (50.0, 7.07)
DENSITIES = (0.1, 1.0, 2.0, 6.7)
PAPER = DENSITIES[-1]
EVENTS = {
    "swap": "swap",
    "lost": "lost target",
    "extra": "extra track",
    "kept": "both tracks kept",
    "early": "a track away 20 s before the meeting",
}

_CHUNK, _CHUNK_STARTED, _CHUNK_DENSE = 20, 5, 1  # runs of a part
_MAIN = ("GNN", "JPDA")
_BESIDE = ("GNN, Kalman", "JPDA, Kalman", "GNN, gate 0.99", "GNN, straight", "JPDA, straight")
_PUBLISHED = {("kept", "GNN"): 0.0, ("kept", "JPDA"): 1.0, ("extra", "GNN"): 1.0, ("extra", "JPDA"): 0.0}


class Played(NamedTuple):
    """What became of a cell: by event (trackers, runs) bool."""

    cell: Cell
    trackers: tuple[str, ...]
    events: Arrays

    def of(self, event: str, tracker: str) -> np.ndarray:
        """(runs,) whether each run was one."""
        flags: np.ndarray = self.events[event][self.trackers.index(tracker)]
        return flags


def plan(runs: int) -> list[tuple[Cell, tuple[str, ...], int]]:
    """What is played: the cells, the trackers in each, and how many runs."""
    main = [Cell(sd, density) for sd in SIGMAS for density in DENSITIES]
    beside = {1.0, PAPER}
    given = [(cell, _MAIN + (_BESIDE if cell.density in beside else ()), runs) for cell in main]
    started = [(cell._replace(initiation=True), _MAIN, runs) for cell in main]
    meeting = [Cell(sd, density, where="meeting") for sd in SIGMAS for density in DENSITIES[:2]]
    apart = [Cell(sd, density, where="apart") for sd in SIGMAS for density in sorted(beside)]
    return [*given, *((cell, _MAIN, runs) for cell in (*meeting, *apart)), *started]


def run(work: Work) -> list[Finding]:
    """Play all cells; the findings, the paper's claims first."""
    cells = plan(work.runs)
    parts = [
        Part(crossing_runs.play, (cell, trackers, each, work.seed), _cost(cell, trackers) * len(each))
        for cell, trackers, runs in cells
        for each in _cut(cell, runs)
    ]
    done = iter(work.do("crossing", parts))
    results = []
    for cell, trackers, runs in cells:
        own = [next(done) for _ in _cut(cell, runs)]
        events = {event: np.concatenate([part[event] for part in own], axis=1) for event in own[0]}
        results.append(Played(cell, trackers, events))
    figures.probabilities(work, results)
    figures.tracks(work, results)
    return findings(results)


def _cut(cell: Cell, runs: int) -> list[range]:
    """The runs of a cell in parts of a few seconds."""
    if not cell.initiation:
        return chunks(runs, _CHUNK)
    return chunks(runs, _CHUNK_DENSE if cell.density == PAPER else _CHUNK_STARTED)


def _cost(cell: Cell, trackers: tuple[str, ...]) -> float:
    """s a run, roughly."""
    each = 0.03 + (0.08 * cell.density**2 * cell.sd**0.25 if cell.initiation else 0.0)
    return 0.05 + each * len(trackers)


def findings(results: list[Played]) -> list[Finding]:
    """The paper's claims, then each event in each cell, then what stands beside."""
    rows = [row for played in results for row in _claims(played)]
    plain = [each for each in results if each.cell.where == "published"]
    for event in ("swap", "lost", "extra"):
        for played in plain:
            if played.cell.initiation == (event == "extra"):
                rows += _compared(played, event, *_MAIN)
    for played in results:
        cell = played.cell
        if cell.where != "published":
            rows += [row for event in ("swap", "lost") for row in _compared(played, event, *_MAIN)]
        elif _BESIDE[0] in played.trackers:
            rows += _compared(played, "lost", "GNN, Kalman", "JPDA, Kalman")
            rows += _compared(played, "lost", "GNN, straight", "JPDA, straight")
            rows += _compared(played, "lost", "GNN, gate 0.99", "JPDA")[::2]
            rows += _compared(played, "swap", "GNN, gate 0.99", "JPDA")[::2]
    return rows


def probability(played: Played, event: str, tracker: str) -> Interval:
    """Of an event, with Wilson's interval."""
    return intervals.proportion(played.of(event, tracker))


def _claims(played: Played) -> list[Finding]:
    """What the paper saw in one run, at its density."""
    cell = played.cell
    if cell.density != PAPER or cell.where != "published":
        return []
    rows = []
    for (event, tracker), published in _PUBLISHED.items():
        if cell.initiation == (event == "extra"):
            ours = probability(played, event, tracker)
            side = float(ours.beyond(0.5))
            verdict = "too few runs to tell"
            if side:
                verdict = f"{'as' if (side > 0.0) == (published > 0.5) else 'not as'} published of one run"
            name = f"{EVENTS[event]}, {tracker}, {cell.name}"
            rows.append(found(name, "", ours, verdict, published))
    if not cell.initiation:
        rows.append(_difference(played, "kept", "JPDA", "GNN"))
        rows += _compared(played, "early", *_MAIN)
    return rows


def _compared(played: Played, event: str, first: str, second: str) -> list[Finding]:
    """Both trackers, and their difference on the same runs."""
    rows = []
    for tracker in (first, second):
        hits = played.of(event, tracker)
        ours, verdict = probability(played, event, tracker), f"{hits.sum()} of {len(hits)} runs"
        rows.append(found(f"{EVENTS[event]}, {tracker}, {played.cell.name}", "", ours, verdict))
    return [*rows, _difference(played, event, first, second)]


def _difference(played: Played, event: str, first: str, second: str) -> Finding:
    apart = intervals.paired_proportions(played.of(event, first), played.of(event, second))
    side = float(apart.beyond(0.0)) * (1.0 if event == "kept" else -1.0)
    verdict = {1.0: f"{first} better", 0.0: "not told apart", -1.0: f"{second} better"}[side]
    name = f"{EVENTS[event]}, {first} − {second}, {played.cell.name}"
    return found(name, "", apart, verdict + (", beyond the interval" if side else ""))
