"""Targets that manoeuvre: motion models and filters of ours beside each other and beside Stone Soup's.

The scenes `turns` and `sprints` are described in `benchmarks/scenes.py`, and so is the swarm of random
turns. All trackers get the same scans, at instants. Who is given tracks starts none, so that a track
that a manoeuvre shakes off stays lost. What the results file has of Stone Soup is kept and not measured
again (`--again` does).
"""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from benchmarks import report
from benchmarks.peers import missing
from benchmarks.tracking import Case, alone, measure, peak_mb, score

CASES = [
    Case("turns, given", "turns", {}, {}, seeds=3, given=True, quick=True),
    Case("turns, from scratch", "turns", {}, {}, seeds=2),
    Case("sprints, given", "sprints", {}, {}, seeds=3, given=True, quick=True),
    Case("sprints, from scratch", "sprints", {}, {}, seeds=2),
    Case("swarm 100, given", "swarm", {"count": 100}, {}, given=True),
    Case("swarm 1,000, given", "swarm", {"count": 1000, "scans": 20}, {}, given=True),
]


def _settings(name: str, models: str, q: float | None = None) -> tuple[str, dict[str, Any]]:
    """Name and [tracker] settings of a filter with motion models, as ``cv ct``."""
    noise = {} if q is None else {"process_noise_m2ps3": q}
    label = f"{name} {models}" + ("" if q is None else f", q {q:g}")
    return label, {"filter": name, "models": tuple(models.split())} | noise


OURS = dict(
    [
        *(_settings(name, "cv", q) for name in ("kalman", "particle") for q in (1.0, 30.0, 300.0)),
        _settings("kalman", "singer"),
        *(_settings(name, models) for name in ("imm", "particle") for models in ("cv ct", "cv ca ct")),
    ]
)
# Trackers of `benchmarks/stone_soup.py`, and their process noise.
PEERS = {
    f"Stone Soup, {name}, q {q:g}": (f"{name} + EHM2", q)
    for name, q in (("EKF", 1.0), ("EKF", 300.0), ("EKF", 3000.0), ("EKF turn", 300.0))
}
SLOW = "swarm"  # Stone Soup needs ten seconds to minutes for each of its scans


def measure_ours(case: Case, settings: dict[str, Any], runs: int) -> list[dict[str, Any]]:
    """Runs of our tracker with the seeds from 1 on."""
    found = [measure(case, settings, seed) for seed in range(1, runs + 1)]
    return [each for each in found if each is not None]


def measure_peer(case: Case, name: str, q: float, seed: int) -> dict[str, Any]:
    """One run of one of Stone Soup's trackers."""
    from benchmarks import stone_soup

    scene = case.scene(seed)
    before = peak_mb()
    run = stone_soup.track(scene, name, case.given_tracks(scene, seed), seed, q)
    return asdict(score(scene, run, before))


app = typer.Typer(add_completion=False, rich_markup_mode="rich", help=__doc__)
EXAMPLES = (
    "Examples:  python -m benchmarks.manoeuvres --quick   |   "
    "python -m benchmarks.manoeuvres --only turns --markdown docs/performance.md"
)


@app.command(epilog=EXAMPLES)
def main(
    quick: Annotated[bool, typer.Option("--quick", help="Two scenes, two seeds.")] = False,
    only: Annotated[str, typer.Option(help="Only scenes whose title contains this.")] = "",
    ours: Annotated[bool, typer.Option(help="Measure ours.")] = True,
    seeds: Annotated[int | None, typer.Option(help="Runs a scene (default: the scene's own).")] = None,
    peer_seeds: Annotated[int, typer.Option(help="Runs a scene of Stone Soup's.")] = 1,
    again: Annotated[bool, typer.Option("--again", help="Measure Stone Soup's again, too.")] = False,
    json: Annotated[Path, typer.Option(help="Results; written after each run.")] = Path(
        "out/manoeuvres.json"
    ),
    markdown: Annotated[
        Path | None, typer.Option(help="Document whose table `manoeuvres` is renewed.")
    ] = None,
) -> None:
    """Measure filters and motion models on targets that manoeuvre."""
    results = report.Results(json)
    lacking = missing()
    if lacking:
        report.say(f"not installed: {', '.join(lacking)}; only ours is measured")
    for case in CASES:
        if only not in case.title or (quick and not case.quick):
            continue
        runs = seeds or (min(case.seeds, 2) if quick else case.seeds)
        for label, settings in OURS.items() if ours else ():
            results.forget(case.title, label)
            for seed, found in enumerate(alone(measure_ours, case, settings, runs), 1):
                _note(results, case, label, seed, found)
        for label, (name, q) in {} if lacking or case.title.startswith(SLOW) else PEERS.items():
            if again:
                results.forget(case.title, label)
            there = {run["seed"] for run in results.of(case.title, label)}
            for seed in sorted(set(range(1, min(runs, peer_seeds) + 1)) - there):
                _note(results, case, label, seed, alone(measure_peer, case, name, q, seed))
    rows = report.accuracy_table(results, [case.title for case in CASES], first="tracker")
    report.publish({"manoeuvres": rows}, markdown)


def _note(results: report.Results, case: Case, label: str, seed: int, found: dict[str, Any]) -> None:
    results.add(case.title, label, seed, found)
    report.say(f"{case.title}, {label}, seed {seed}: {report.brief(found)}")


if __name__ == "__main__":
    app()
