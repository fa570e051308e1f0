"""Figures of whole runs, scored against the truth.

Examples:
  python benchmarks/acceptance.py scenario twenty-five --first 25 --seeds 10
  python benchmarks/acceptance.py codes flight.pcap --identity ignore
  python benchmarks/acceptance.py positions boats.csv truth.csv --config boats.toml
"""

import csv
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from radar_console.app.headless import figures_of
from radar_console.app.opening import open_source
from radar_console.chain import Chain, Opened
from radar_console.core.messages import Table, TrackStatus
from radar_console.evaluation.scenario_run import follow, truth_of

app = typer.Typer(
    add_completion=False, rich_markup_mode="rich", help="Figures of whole runs, scored against the truth."
)

Identity = Literal["use", "ignore"]
NEAR = 2000.0  # m; a confirmed track within it of a target is that target's
HELD = (TrackStatus.CONFIRMED, TrackStatus.COASTING)


@app.command(epilog="Example:  python benchmarks/acceptance.py scenario twenty-five --first 25 --seeds 10")
def scenario(
    name: str,
    seeds: Annotated[int, typer.Option(help="Runs, with one seed after the other.")] = 1,
    first: Annotated[int | None, typer.Option(help="The first seed (default: the scenario's).")] = None,
    near_m: Annotated[float, typer.Option(help="A track within it of a target is that target's.")] = NEAR,
) -> None:
    """Confirmation, loss and false tracks of a simulated scenario."""
    start = open_source(name).seed if first is None else first
    for seed in range(start, start + seeds):
        opened = open_source(name, seed=seed)
        chain = Chain(opened)
        tracks = follow(chain)
        held = tracks[np.isin(tracks["status"], HELD)]
        score = score_targets(held, opened, near_m)
        print(f"seed {seed}: {score}  {figures_of(chain, 0.0)['tracker_s_per_scan']} s a scan")


def score_targets(held: Table, opened: Opened, near: float) -> str:
    """Assign rows of confirmed tracks to targets; say who was held, when, and how well."""
    rotation = opened.source.radar.rotation
    targets = truth_of(opened, 1.0)
    numbers = np.unique(targets["target"])
    born = {n: targets["time"][targets["target"] == n].min() for n in numbers}
    dies = {n: targets["time"][targets["target"] == n].max() for n in numbers}
    distance = np.full((len(held), len(numbers)), np.inf)
    for column, n in enumerate(numbers):
        own = targets[targets["target"] == n]
        alive = (held["time"] >= born[n] - 1.0) & (held["time"] <= dies[n] + 1.0)
        east = np.interp(held["time"], own["time"], own["east"])
        north = np.interp(held["time"], own["time"], own["north"])
        gap = np.hypot(held["east"] - east, held["north"] - north)
        distance[alive, column] = gap[alive]
    nearest, gap = distance.argmin(axis=1), distance.min(axis=1)
    confirmed_in_time, rotations, lost, errors, owners = 0, [], 0, [], []
    for column, n in enumerate(numbers):
        mine = held[(nearest == column) & (gap < near)]
        errors.append(gap[(nearest == column) & (gap < near) & held["hit"]])
        if not len(mine):
            lost += 1
            continue
        after = (mine["time"].min() - born[n]) / rotation
        rotations.append(after)
        confirmed_in_time += after <= 5.0
        times = np.sort(np.append(mine["time"], dies[n]))
        lost += bool((np.diff(times) > 3.0 * rotation).any())
        owners.append(len(np.unique(mine["track"])))
    false = sum(np.median(gap[held["track"] == track]) >= near for track in np.unique(held["track"]))
    rms = np.sqrt(np.mean(np.concatenate(errors) ** 2)) if errors else np.nan
    slowest = max(rotations, default=np.nan)
    return (
        f"{len(rotations)} of {len(numbers)} targets confirmed, {confirmed_in_time} within 5 rotations "
        f"(slowest {slowest:.1f}), {lost} lost afterwards, "
        f"{sum(o > 1 for o in owners)} with more than one track, "
        f"{false} false confirmed tracks, RMS {rms:.0f} m"
    )


def with_identity(opened: Opened, identity: Identity) -> Opened:
    """The same source, its codes and addresses evidence to the tracker or not."""
    tracker = opened.settings.tracker.model_copy(update={"identity": identity})
    return replace(opened, settings=opened.settings.model_copy(update={"tracker": tracker}))


@app.command(epilog="Example:  python benchmarks/acceptance.py codes flight.pcap")
def codes(
    recording: Path,
    config: Annotated[Path | None, typer.Option()] = None,
    least: Annotated[int, typer.Option(help="Reports that a code needs to count.")] = 20,
    identity: Annotated[
        Identity | None, typer.Option(help="In place of the setting: does the tracker see the codes?")
    ] = None,
) -> None:
    """How many Mode 3/A codes one track holds for at least 90 % of their reports."""
    opened = open_source(str(recording), config)
    if identity is not None:
        opened = with_identity(opened, identity)
    code_of: dict[int, int] = {}
    chain = Chain(opened)
    followers: defaultdict[int, Counter[int]] = defaultdict(Counter)
    matched: list[tuple[int, int]] = []
    for sector in chain.run():
        code_of.update(
            zip(sector.centroids["ordinal"].tolist(), sector.centroids["mode_3a"].tolist(), strict=True)
        )
        matched.extend(zip(sector.tracks["plot"].tolist(), sector.tracks["track"].tolist(), strict=True))
    for plot, track in matched:
        if plot >= 0:
            followers[code_of[plot]][track] += 1
    reports = Counter(code_of.values())
    counted = sorted(code for code, n in reports.items() if n >= least and code >= 0)
    held = 0
    confirmed = chain.tally.confirmed
    print("code  reports  by one track  tracks  confirmed")
    for code in counted:
        best = max(followers[code].values(), default=0)
        sure = len(confirmed & set(followers[code]))
        share = best / reports[code]
        held += share >= 0.9
        print(f"{code:04o}  {reports[code]:7}  {share:12.3f}  {len(followers[code]):6}  {sure:9}")
    print(f"{held} of {len(counted)} codes held by one track for at least 90 % of their reports")
    print(figures_of(chain, 0.0))


@app.command(epilog="Example:  python benchmarks/acceptance.py positions boats.csv truth.csv")
def positions(
    table: Path,
    truth: Path,
    config: Annotated[Path | None, typer.Option()] = None,
    near_m: Annotated[float, typer.Option(help="A track within it of a target is that target's.")] = 50.0,
) -> None:
    """Tracks of a plot table against positions in a truth file (time_s, target, east_m, north_m)."""
    opened = open_source(str(table), config)
    tracks = follow(Chain(opened))
    held = tracks[np.isin(tracks["status"], HELD)]
    with truth.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for target in sorted({row["target"] for row in rows}):
        own = np.array(
            [
                [float(r["time_s"]), float(r["east_m"]), float(r["north_m"])]
                for r in rows
                if r["target"] == target
            ]
        )
        inside = held[(held["time"] >= own[0, 0]) & (held["time"] <= own[-1, 0])]
        gap = np.hypot(
            inside["east"] - np.interp(inside["time"], own[:, 0], own[:, 1]),
            inside["north"] - np.interp(inside["time"], own[:, 0], own[:, 2]),
        )
        near = inside[gap < near_m]
        rotation = opened.source.radar.rotation
        edges = np.arange(own[0, 0], own[-1, 0], rotation)
        seen = np.isin(np.arange(len(edges)), ((near["time"] - own[0, 0]) / rotation).astype(int))
        print(
            f"target {target}: held in {seen.mean():.1%} of {len(edges)} turns by "
            f"{len(np.unique(near['track']))} track(s), RMS {np.sqrt(np.mean(gap[gap < near_m] ** 2)):.1f} m"
        )
    print(f"{len(np.unique(held['track']))} confirmed tracks in all")


if __name__ == "__main__":
    app()
