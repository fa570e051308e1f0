"""Our tracker beside Stone Soup's, on the same scans in one run; a filter's step beside filterpy's.

What is not installed is skipped, and said. Results are written as they come; those of the others are
kept in the results file and not measured again (`--again` does), ours always are. Ratios of times hold
for one machine: after a change of machine use `--again`.
"""

import importlib.util
import math
import platform
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from statistics import fmean, median
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks import report
from benchmarks.tracking import (
    ROUGHLY,
    STRAIGHT,
    WELL,
    Case,
    alone,
    formation,
    measure,
    peak_mb,
    score,
    with_tracks,
)
from radar_console.core.units import DEG
from radar_console.estimation.motion import constant_velocity

OURS, OURS_SET = "ours, particle", "ours, particle, set JPDA"
SETTINGS = {OURS: {"filter": "particle"}, OURS_SET: {"filter": "particle", "associator": "set-jpda"}}
FIRST = 29  # scans of ring25 that the others are asked to track
JOINT = ("PF + EHM2", "EKF + EHM2")
EACH = (*JOINT, "UKF + EHM2", "EKF + GNN")
GET = ".venv/bin/pip install --require-hashes -r requirements-bench.lock"

# Scenes, and the peers' trackers that run on them.
CASES = [
    (Case("ring25, from scratch", "ring25", {"scans": FIRST}, STRAIGHT, seeds=3), JOINT),
    (with_tracks("ring25", "ring25", {"scans": FIRST}, WELL, seeds=1), EACH),
    *((with_tracks("crossing2", "crossing2", {}, errors, seeds=3), EACH) for errors in (WELL, ROUGHLY)),
    *(
        (formation(count, errors, 3, quick=count == 8), EACH)
        for errors in (WELL, ROUGHLY)
        for count in (8, 15)
    ),
]


def measure_peer(case: Case, name: str, seed: int) -> dict[str, Any]:
    """One run of one of Stone Soup's trackers."""
    from benchmarks import stone_soup

    scene = case.scene(seed)
    before = peak_mb()
    return asdict(score(scene, stone_soup.track(scene, name, case.given_tracks(scene, seed), seed), before))


def processor_time(step: Callable[[], Any], repeats: int = 200) -> float:
    """Processor time of a call, µs: the median of seven means."""
    means = []
    for _ in range(7):
        began = time.process_time()
        for _ in range(repeats):
            step()
        means.append((time.process_time() - began) / repeats)
    return 1e6 * median(means)


def filterpy_steps() -> dict[str, float]:
    """µs for the prediction and update of one object, in filterpy."""
    from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

    F, Q = constant_velocity(4.0, 1.0)
    R = np.diag([50.0**2, (0.1 * DEG) ** 2])
    x, z = np.array([100e3, 100e3, -150.0, -150.0]), np.array([141e3, 45.0 * DEG])

    def h(x: Any) -> Any:
        return np.array([np.hypot(x[0], x[1]), np.arctan2(x[0], x[1])])

    def jacobian(x: Any) -> Any:
        r = math.hypot(x[0], x[1])
        return np.array([[x[0] / r, x[1] / r, 0.0, 0.0], [x[1] / r**2, -x[0] / r**2, 0.0, 0.0]])

    extended = ExtendedKalmanFilter(4, 2)
    points = MerweScaledSigmaPoints(4, 0.1, 2.0, -1.0)
    unscented = UnscentedKalmanFilter(4, 2, 4.0, h, lambda x, dt: F @ x, points)
    for each in (extended, unscented):
        each.R, each.Q = R, Q
    extended.F = F

    def fresh(each: Any) -> None:
        each.x, each.P = x.copy(), np.diag([1e4, 1e4, 100.0, 100.0])
        each.predict()

    def step_extended() -> None:
        fresh(extended)
        extended.update(z, jacobian, h)

    def step_unscented() -> None:
        fresh(unscented)
        unscented.update(z)

    return {"filterpy, EKF": processor_time(step_extended), "filterpy, UKF": processor_time(step_unscented)}


def stone_soup_steps() -> dict[str, float]:
    """µs for the prediction and update of one object, in Stone Soup."""
    from benchmarks import stone_soup

    return {
        f"Stone Soup, {name}": processor_time(stone_soup.one_step(name), repeats=30)
        for name in ("EKF", "UKF", "PF")
    }


def missing() -> list[str]:
    """Packages of the others that are not installed."""
    return [name for name in ("stonesoup", "pyehm") if importlib.util.find_spec(name) is None]


def rows_of(results: report.Results) -> list[str]:
    """The comparison as a Markdown table; times as multiples of ours on the same scans."""
    head = ["scene", "tracker", "runs × scans", "CPU ms a scan", "of it initiation", "times ours",
            "GOSPA m, median", "mean", "lost", "swaps", "false", "memory MB"]  # fmt: skip
    rows = []
    for case, _ in CASES:
        own = results.of(case.title, OURS)
        ours = median([run["cpu_ms"] for run in own]) if own else math.nan
        names = results.trackers(case.title)
        for name in sorted(names, key=lambda name: name not in SETTINGS):
            runs = results.of(case.title, name)
            cpu = median([run["cpu_ms"] for run in runs])
            rows.append([
                case.title, name, f"{len(runs)} × {runs[0]['scans']}", report.duration(cpu),
                report.over(median, runs, "initiation_ms", ".0f"),
                f"{cpu / ours:,.0f}" if own and name != OURS else "–",
                report.over(median, runs, "gospa_mean", ".0f"),
                report.over(fmean, runs, "gospa_mean", ".0f"),
                *(str(sum(run[key] for run in runs)) for key in ("lost", "swaps", "false")),
                report.over(max, runs, "memory_mb", ".0f"),
            ])  # fmt: skip
    return report.table(head, rows)


app = typer.Typer(add_completion=False, rich_markup_mode="rich", help=__doc__)
EXAMPLES = (
    "Examples:  python -m benchmarks.peers --quick   |   "
    "python -m benchmarks.peers --json out/peers.json --markdown docs/performance.md   |   "
    "python -m benchmarks.peers --only crossing2 --again"
)


@app.command(epilog=EXAMPLES)
def main(
    quick: Annotated[bool, typer.Option("--quick", help="One scene, about a minute.")] = False,
    only: Annotated[str, typer.Option(help="Only scenes whose title contains this.")] = "",
    again: Annotated[bool, typer.Option("--again", help="Measure the others again, too.")] = False,
    json: Annotated[Path, typer.Option(help="Results; written after each run.")] = Path("out/peers.json"),
    markdown: Annotated[
        Path | None, typer.Option(help="Document whose tables `peers` and `steps` are renewed.")
    ] = None,
) -> None:
    """Measure ours and the others on the same scans; what the results file has of the others is kept."""
    results = report.Results(json)
    lacking = missing()
    if lacking:
        report.say(f"not installed: {', '.join(lacking)}; only ours is measured. To get them: {GET}")
    for case, peers in CASES:
        if only not in case.title or (quick and not case.quick):
            continue
        for name in (OURS, OURS_SET) if case.make == "formation" else (OURS,):
            results.forget(case.title, name)
            for seed in range(1, case.seeds + 1):
                found = alone(measure, case, SETTINGS[name], seed)
                if found is None:
                    report.say(f"{case.title}: ours skipped, the tracker can't take given tracks")
                    break
                results.add(case.title, name, seed, found)
                report.say(f"{case.title}, {name}, seed {seed}: {report.brief(found)}")
        for name in () if lacking else peers:
            label = f"Stone Soup, {name}"
            if again:
                results.forget(case.title, label)
            there = {run["seed"] for run in results.of(case.title, label)}
            for seed in sorted(set(range(1, case.seeds + 1)) - there):
                try:
                    found = alone(measure_peer, case, name, seed)
                except Exception as error:  # theirs: the others go on, and it has no row
                    report.say(f"{case.title}, {label}, seed {seed}: failed, {error!r}")
                    continue
                results.add(case.title, label, seed, found)
                report.say(f"{case.title}, {label}, seed {seed}: {report.brief(found)}")
    steps = alone(filterpy_steps) | ({} if lacking else alone(stone_soup_steps))
    rows = [[name, f"{us:.0f}"] for name, us in steps.items()]
    tables = {"peers": rows_of(results), "steps": report.table(["one object", "µs a step"], rows)}
    report.publish(tables, markdown)
    print(f"\n{platform.machine()}, Python {platform.python_version()}")


if __name__ == "__main__":
    app()
