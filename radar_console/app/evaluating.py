"""What `radar-console evaluate` does: runs of a scenario, or the score of someone's tracks."""

import os
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from radar_console import scenario
from radar_console.app.opening import find
from radar_console.app.status import RunLine
from radar_console.core.errors import InputError, RadarConsoleError
from radar_console.evaluation.grid import Setting, grid, label, option
from radar_console.evaluation.monte_carlo import Progress, carry_out
from radar_console.evaluation.results import Results
from radar_console.evaluation.scenario_run import RUN_METRICS, ScenarioRun
from radar_console.evaluation.scoring import METRICS, Scoring, score
from radar_console.evaluation.summary import MAIN, summarise, worded
from radar_console.evaluation.workers import Workers, dask, inline, processes
from radar_console.recording.scored import read_tracks, read_truth

NO_RESULT = ("title", "description", "seed", "display")
"""Keys of a scenario that change no figure of a run with a given seed."""


class Evaluation:
    """Runs of a scenario under a grid of settings, in a folder.

    Parameters
    ----------
    name : scenario file, or the name of one that comes along
    options : ``KEY=VALUE,VALUE`` each
    folder : of the results; without it, one by the scenario's name
    scoring : how runs are scored

    Raises
    ------
    RadarConsoleError   the scenario or a setting can't be; nothing was run
    """

    def __init__(self, name: str, options: Sequence[str], folder: Path | None, scoring: Scoring) -> None:
        self.file = find(name)
        if self.file.suffix.lower() != ".toml":
            raise InputError(self.file, "", "can't be run again and again; expected a scenario (.toml)")
        raw = scenario.read_toml(self.file)
        self.scenario = scenario.parse(raw, self.file)
        self.settings: list[Setting] = grid([option(text) for text in options])
        self.run = ScenarioRun(raw, self.file, scoring)
        for setting in self.settings:
            self.run.opened(setting, self.scenario.seed)  # what can't be played is known before the first run
        self.failed = ""  # what to say of the runs that failed
        self.folder = folder or Path(f"{self.file.stem}-evaluation")
        self.experiment = {
            "scenario": {key: value for key, value in raw.items() if key not in NO_RESULT},
            "scoring": asdict(scoring),
            "version": version("radar-console"),
        }

    def carry_out(self, runs: int, first: int | None, again: Sequence[int], workers: Workers) -> Progress:
        """Do what is missing and write the report; `again` are seeds to run anew, and no others."""
        start = self.scenario.seed if first is None else first
        seeds = list(again) or list(range(start, start + runs))
        metrics = [metric.name for metric in RUN_METRICS]
        with Results(self.folder, self.experiment, self.settings, metrics) as results:
            results.forget(again)
            with RunLine(self.scenario.title) as line:
                progress = carry_out(self.run, seeds, results, workers, line)
            self._report(results)
            _say(results)
            self.failed = _failed(results)
        return progress

    def _report(self, results: Results) -> None:
        from radar_console.evaluation.report import page  # with it comes matplotlib

        scoring = self.run.scoring
        about = [
            ("scenario", f"{self.file.name}, {self.scenario.duration_s:g} s"),
            ("runs", f"{len(results.rows):,}, of {len(results.seeds):,} seeds: {_ranges(results.seeds)}"),
            ("settings", "; ".join(map(label, self.settings))),
            (
                "scored",
                f"every {scoring.interval:g} s; cut-off of GOSPA and OSPA {scoring.cut_off:g} m (p = 2), "
                f"gate of a track {scoring.gate:g} m, lost if not held in the last {scoring.tail:g} s",
            ),
            ("version", str(self.experiment["version"])),
        ]
        text = page(self.scenario.title, about, results, RUN_METRICS, np.random.default_rng(0))
        file = self.folder / "report.html"
        try:
            file.write_text(text, encoding="utf-8")
        except OSError as error:
            raise InputError(file, "", f"can't be written: {error.strerror}; the runs are kept") from error


def workers_of(address: str | None, jobs: int | None) -> Workers:
    """A cluster, or so many processes (default: one for each processor); one job is this process."""
    if address is not None:
        return dask(address)
    count = jobs or os.cpu_count() or 1
    return inline if count == 1 else processes(count)


def score_files(tracks: Path, truth: Path, scoring: Scoring) -> dict[str, float]:
    """The figures of `METRICS` for a table of tracks."""
    return score(read_truth(truth), read_tracks(tracks), scoring)


def print_scores(figures: dict[str, float]) -> None:
    """A line for each figure."""
    table = Table(box=None, show_header=False)
    for metric in METRICS:
        value = figures[metric.name]
        table.add_row(metric.title, "–" if np.isnan(value) else f"{value:,.6g}", metric.unit, metric.meaning)
    Console().print(table)


def write_scores(figures: dict[str, float], file: Path) -> None:
    """A CSV of name and value."""
    lines = [f"{name},{'' if np.isnan(value) else repr(value)}" for name, value in figures.items()]
    try:
        file.write_text("\n".join(["metric,value", *lines]) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(file, "", f"can't be written: {error.strerror}") from error


def _say(results: Results) -> None:
    """The main figures on the terminal."""
    main = [metric for metric in RUN_METRICS if metric.name in MAIN]
    console = Console()
    names = [f"({k})" for k in range(1, len(results.settings) + 1)]
    for name, setting in zip(names, results.settings, strict=True):
        if setting:
            console.print(f"{name} {label(setting)}", highlight=False)
    table = Table("", *(names if len(names) > 1 else [""]), box=None)
    for summary in summarise(results, main, np.random.default_rng(0)):
        unit = f", {summary.metric.unit}" if summary.metric.unit else ""
        table.add_row(summary.metric.title + unit, *map(worded, summary.means))
    console.print(table)


def _failed(results: Results) -> str:
    """What to say of the runs that failed; nothing if none did."""
    failed = results.failed
    if not failed:
        return ""
    seeds = sorted({row.seed for row in failed})
    first = failed[0]
    return (
        f"{len(failed):,} of {len(results.rows):,} runs failed, and count nowhere; the first: "
        f"seed {first.seed}, {label(results.settings[first.setting])}: {first.error}\n"
        f"  run them again, alone: --rerun {','.join(map(str, seeds[:20]))}"
        + (f" … and {len(seeds) - 20} more" if len(seeds) > 20 else "")
    )


def _ranges(seeds: Sequence[int]) -> str:
    """``1–5, 9``"""
    parts: list[list[int]] = []
    for seed in seeds:
        if parts and seed == parts[-1][-1] + 1:
            parts[-1][1:] = [seed]
        else:
            parts.append([seed])
    return ", ".join("–".join(map(str, part)) for part in parts)


def seeds_of(texts: Sequence[str]) -> list[int]:
    """Numbers given one by one or with commas.

    Raises
    ------
    RadarConsoleError   one is no number
    """
    words = [word.strip() for text in texts for word in text.split(",")]
    wrong = next((word for word in words if not word.isdecimal()), None)
    if wrong is not None:
        raise RadarConsoleError(f"--rerun {wrong}: expected seeds, such as 137 or 137,140")
    return sorted({int(word) for word in words})
