"""What our tracker reaches by itself: time, memory and accuracy, from 10 to 10,000 targets.

Processor time is that of all threads; medians over scans. Each case runs in a process of its own, so
that its memory is its own. A scene is described in `benchmarks/scenes.py`.
"""

import io
import math
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks import report, scenes
from benchmarks.scenes import Scene
from radar_console.core.messages import NO_CENTROIDS, TRACK, Table
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.gospa import gospa
from radar_console.evaluation.sampling import snapshots
from radar_console.evaluation.track_metrics import track_metrics
from radar_console.scenario import TrackerSettings
from radar_console.tracker import Tracker, warm_up

WARM = 10  # scans that accuracy leaves out
CUT_OFF = 5000.0  # m, of GOSPA
NEAR, LOST = 2000.0, 1000.0  # m, from a target: held by a track, and not lost by it
STRAIGHT = {"process_noise_m2ps3": 1.0}
"""Settings for the scenes whose targets fly straight."""
SET_JPDA = STRAIGHT | {"associator": "set-jpda"}
WELL, ROUGHLY = (50.0, 5.0), (100.0, 10.0)
"""Errors of given tracks, m and m/s: how well they are known decides what a dense scene costs."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What a tracker said of a scene, and what it took; `cpu`, `wall` (scans,) s, of each scan."""

    rows: Table
    cpu: Array
    wall: Array
    memory_mb: float = math.nan  # the largest that the process had held when it was done
    initiation: float = math.nan  # s of `cpu` a scan, median, that initiation took; NaN not known


@dataclass(frozen=True, slots=True)
class Score:
    """One run of one tracker; times are medians over the scans after the warm-up, ms."""

    scans: int
    targets: int
    cpu_ms: float
    wall_ms: float
    initiation_ms: float
    gospa_mean: float
    gospa_median: float
    confirmed: int
    scans_to_confirm: float  # median
    swaps: int
    lost: int  # of the targets that were held: by no track within 1 km in the last ten scans
    false: int
    duplicate: int
    memory_mb: float  # peak of the whole process
    before_mb: float  # the process before tracking: interpreter, libraries, scene


def track(
    scene: Scene,
    settings: dict[str, Any],
    given: Table | None,
    pushes: int,
    seed: int,
) -> Run | None:
    """Our tracker over a scene; None if tracks are given and it can't take them.

    Parameters
    ----------
    settings : of [tracker], where they are not the default
    given : TRACK, confirmed tracks at the first scan's instant, of a snapshot scene
    pushes : sectors a turn
    """
    tracker = Tracker(TrackerSettings(**settings), scene.radar, seed)
    parts = scenes.sectors(scene, pushes)
    rows, cpu, wall = io.BytesIO(), [], []
    if given is not None:
        if not hasattr(tracker, "adopt"):
            return None
        # The tracks are those of the first scan's instant: its turn has passed, and its plots are used up.
        for sector in parts.pop(0):
            tracker.push(sector.adding(centroids=NO_CENTROIDS))
        tracker.adopt(given)
        rows.write(given.tobytes())
        cpu, wall = [0.0], [0.0]
    for part in parts:
        began = time.process_time(), time.perf_counter()
        found = [tracker.push(sector).tracks for sector in part]
        cpu.append(time.process_time() - began[0])
        wall.append(time.perf_counter() - began[1])
        # What is kept for the score is written elsewhere outside the time, as it is of the others: who
        # shows tracks lets the old rows go, and does not pay for new memory with each scan.
        for table in found:
            rows.write(table.tobytes())
    last = tracker.flush()
    if last is not None:
        rows.write(last.tracks.tobytes())
    return Run(np.frombuffer(rows.getvalue(), TRACK), np.array(cpu), np.array(wall), peak_mb())


def score(scene: Scene, run: Run, before_mb: float = math.nan, warm: int = WARM) -> Score:
    """GOSPA over the scans from `warm` on, and the story of the tracks."""
    values = [gospa(now.truth, now.estimate, CUT_OFF).value for now in snapshots(scene.truth, run.rows)]
    story = track_metrics(scene.truth, run.rows, NEAR)
    late = slice(min(warm, scene.scans // 2), None)
    return Score(
        scans=scene.scans,
        targets=len(story.target),
        cpu_ms=1e3 * float(np.median(run.cpu[late])),
        wall_ms=1e3 * float(np.median(run.wall[late])),
        initiation_ms=1e3 * run.initiation,
        gospa_mean=float(np.mean(values[late])),
        gospa_median=float(np.median(values[late])),
        confirmed=int(np.isfinite(story.time_to_confirm).sum()),
        scans_to_confirm=float(np.median(np.nan_to_num(story.time_to_confirm, nan=np.inf)) / scenes.PERIOD),
        swaps=int(story.swaps.sum()),
        lost=int(track_metrics(scene.truth, run.rows, LOST).lost.sum()),
        false=int(story.false.sum()),
        duplicate=int(story.duplicate.sum()),
        memory_mb=run.memory_mb,
        before_mb=before_mb,
    )


def peak_mb() -> float:
    """The largest memory that this process has held, MB; NaN where the system does not say."""
    status = Path("/proc/self/status")
    if not status.exists():
        return math.nan
    lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
    return int(lines["VmHWM"].split()[0]) / 1024.0


def alone(function: Callable[..., Any], *arguments: Any) -> Any:
    """The function's result from a fresh process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


@dataclass(frozen=True, slots=True)
class Case:
    """A scene by its recipe, so that a fresh process can make it.

    Attributes
    ----------
    title : in tables
    make : name of a function of `benchmarks/scenes.py`
    arguments : of it, besides the seed
    settings : of [tracker]
    seeds : a run each
    given : confirmed tracks are there at the start
    errors : of these, standard deviations in m and m/s
    pushes : sectors a turn
    quick : for `--quick`
    """

    title: str
    make: str
    arguments: dict[str, Any]
    settings: dict[str, Any]
    seeds: int = 1
    given: bool = False
    errors: tuple[float, float] = ROUGHLY
    pushes: int = 1
    quick: bool = False

    def scene(self, seed: int) -> Scene:
        scene: Scene = getattr(scenes, self.make)(seed=seed, **self.arguments)
        return scene

    def given_tracks(self, scene: Scene, seed: int) -> Table | None:
        return scenes.given_tracks(scene, seed, *self.errors) if self.given else None


def with_tracks(
    title: str,
    make: str,
    arguments: dict[str, Any],
    errors: tuple[float, float],
    seeds: int,
    settings: dict[str, Any] = STRAIGHT,
    quick: bool = False,
) -> Case:
    """A scene whose targets' tracks are given, with these errors."""
    title += f", given to {errors[0]:.0f} m" + (", set JPDA" if settings is SET_JPDA else "")
    return Case(title, make, arguments, settings, seeds, True, errors, quick=quick)


def formation(
    count: int,
    errors: tuple[float, float],
    seeds: int,
    settings: dict[str, Any] = STRAIGHT,
    quick: bool = False,
) -> Case:
    """A formation whose tracks are given, with these errors."""
    return with_tracks(f"formation {count}", "formation", {"count": count}, errors, seeds, settings, quick)


def measure(case: Case, settings: dict[str, Any], seed: int) -> dict[str, Any] | None:
    """One run of our tracker; None if it can't take the tracks that are given."""
    scene = case.scene(seed)
    warm_up()
    before = peak_mb()
    given = case.given_tracks(scene, seed)
    # Whoever is given tracks starts none: there is room for these alone.
    room = {} if given is None else {"max_tracks": len(given)}
    run = track(scene, case.settings | room | settings, given, case.pushes, seed)
    return None if run is None else asdict(score(scene, run, before))


def _growing(count: int, scans: int) -> Case:
    """As many false returns as targets; from scratch, as a turning radar sees it."""
    arguments = {"count": count, "false": count, "scans": scans, "swept": True}
    return Case(f"swarm {count:,}", "swarm", arguments, {}, pushes=64, quick=count <= 100)


GROWTH = [_growing(count, 15) for count in (10, 100, 1000, 3000, 10_000)]
ACCURACY = [
    Case("ring25, from scratch", "ring25", {}, STRAIGHT, seeds=10, quick=True),
    Case("dense E2, from scratch", "dense", {}, STRAIGHT, seeds=10),
    with_tracks("crossing2", "crossing2", {}, WELL, seeds=60, quick=True),
    with_tracks("crossing2", "crossing2", {}, ROUGHLY, seeds=60),
    Case("crossing2, from scratch", "crossing2", {}, STRAIGHT, seeds=10),
    *(
        formation(count, errors, 10, settings)
        for count in (8, 15)
        for errors in (WELL, ROUGHLY)
        for settings in (STRAIGHT, SET_JPDA)
    ),
    Case("swarm 200, from scratch", "swarm", {"count": 200}, {}, seeds=4),
]

app = typer.Typer(add_completion=False, rich_markup_mode="rich", help=__doc__)
EXAMPLES = (
    "Examples:  python -m benchmarks.tracking --quick   |   "
    "python -m benchmarks.tracking --filter particle,extended --only crossing2 --json out/tracking.json"
)


@app.command(epilog=EXAMPLES)
def main(
    quick: Annotated[bool, typer.Option("--quick", help="Few scenes and seeds, about two minutes.")] = False,
    only: Annotated[str, typer.Option(help="Only scenes whose title contains this.")] = "",
    filters: Annotated[str, typer.Option("--filter", help="Filters, with commas.")] = "particle",
    seeds: Annotated[int | None, typer.Option(help="Runs a scene (default: the scene's own).")] = None,
    json: Annotated[Path, typer.Option(help="Results; written after each run.")] = Path("out/tracking.json"),
    markdown: Annotated[
        Path | None, typer.Option(help="Document whose tables `growth` and `accuracy` are renewed.")
    ] = None,
) -> None:
    """Measure our tracker: time, memory and accuracy, each run in a process of its own."""
    results = report.Results(json)
    for case in [*GROWTH, *ACCURACY]:
        if only not in case.title or (quick and not case.quick):
            continue
        runs = seeds or (min(case.seeds, 3) if quick else case.seeds)
        for name in filters.split(","):
            results.forget(case.title, name)
            for seed in range(1, runs + 1):
                found = alone(measure, case, {"filter": name}, seed)
                if found is None:
                    report.say(f"{case.title}: skipped, the tracker can't take given tracks")
                    break
                results.add(case.title, name, seed, found)
                report.say(f"{case.title}, {name}, seed {seed}: {report.brief(found)}")
    tables = {
        "growth": report.growth_table(results, [case.title for case in GROWTH]),
        "accuracy": report.accuracy_table(results, [case.title for case in ACCURACY]),
    }
    report.publish(tables, markdown)


if __name__ == "__main__":
    app()
