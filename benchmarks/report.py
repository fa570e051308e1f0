"""Results of benchmarks as they come, and the tables made of them."""

import json
import math
import os
import platform
import sys
from collections.abc import Callable, Iterable
from datetime import date
from pathlib import Path
from statistics import fmean, median
from typing import Any

Figures = dict[str, Any]


def say(text: str) -> None:
    """Progress."""
    print(text, file=sys.stderr, flush=True)


class Results:
    """Figures by scene, tracker and seed, in a JSON file that is renewed with each of them.

    A file from an earlier run is continued: what is not measured again stays, with its date.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self._rows: list[Figures] = json.loads(file.read_text())["runs"] if file.exists() else []

    def of(self, scene: str, tracker: str) -> list[Figures]:
        """All runs of a tracker on a scene."""
        return [row for row in self._rows if (row["scene"], row["tracker"]) == (scene, tracker)]

    def trackers(self, scene: str) -> list[str]:
        """Who ran on a scene, in the order of the first runs."""
        return list(dict.fromkeys(row["tracker"] for row in self._rows if row["scene"] == scene))

    def forget(self, scene: str, tracker: str) -> None:
        """Make way for new runs; the file keeps the old ones until the first of them is there."""
        self._rows = [row for row in self._rows if (row["scene"], row["tracker"]) != (scene, tracker)]

    def add(self, scene: str, tracker: str, seed: int, figures: Figures) -> None:
        """Take a run, and write the file."""
        row = {"scene": scene, "tracker": tracker, "seed": seed, "date": date.today().isoformat()}
        self._rows.append(row | figures)
        machine = {
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        }
        text = json.dumps({"machine": machine, "runs": [_plain(row) for row in self._rows]}, indent=1)
        self.file.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.file.with_suffix(".part")
        fresh.write_text(text + "\n")
        fresh.replace(self.file)


def _plain(row: Figures) -> Figures:
    """JSON knows no NaN and no infinity."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}


def brief(figures: Figures) -> str:
    """One line of a run."""
    return (
        f"{figures['cpu_ms']:.3g} ms a scan, GOSPA {figures['gospa_mean']:.0f} m, "
        f"{figures['confirmed']} of {figures['targets']} held, {figures['lost']} lost, "
        f"{figures['false']} false, {figures['swaps']} swaps, {figures['memory_mb']:.0f} MB"
    )


def _values(runs: list[Figures], name: str) -> list[float]:
    return [run[name] for run in runs if run[name] is not None and math.isfinite(run[name])]


def over(summary: Callable[[Iterable[float]], float], runs: list[Figures], name: str, form: str) -> str:
    """A summary of a figure over runs, as text; a dash where there is none."""
    values = _values(runs, name)
    return format(summary(values), form) if values else "–"


def _confirming(runs: list[Figures]) -> str:
    """Median scans to confirm; a run in which most targets never were, counts as the slowest."""
    slow = [run["scans_to_confirm"] for run in runs]
    middle = median(math.inf if value is None else value for value in slow)
    return f"{middle:.1f}" if math.isfinite(middle) else "never"


def duration(ms: float) -> str:
    """Milliseconds with three figures."""
    return f"{ms:,.0f}" if ms >= 99.95 else f"{ms:.3g}"


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]


def growth_table(results: Results, titles: list[str]) -> list[str]:
    """Time and memory by number of targets."""
    head = ["scene", "filter", "CPU ms a scan", "wall ms a scan", "µs a target", "held", "false", "memory MB",
            "of it before tracking"]  # fmt: skip
    rows = []
    for title in titles:
        for name in results.trackers(title):
            runs = results.of(title, name)
            cpu, wall = (median(_values(runs, key)) for key in ("cpu_ms", "wall_ms"))
            each = f"{1e3 * cpu / runs[0]['targets']:.1f}"
            rows.append([
                title, name, duration(cpu), duration(wall), each,
                f"{sum(run['confirmed'] for run in runs):,} of {sum(run['targets'] for run in runs):,}",
                str(sum(run["false"] for run in runs)),
                over(max, runs, "memory_mb", ".0f"), over(max, runs, "before_mb", ".0f"),
            ])  # fmt: skip
    return table(head, rows)


def accuracy_table(results: Results, titles: list[str], first: str = "filter") -> list[str]:
    """Time and accuracy by scene and tracker; GOSPA over the runs, of each run's mean over its scans."""
    head = ["scene", first, "runs × scans", "CPU ms a scan", "GOSPA m, median", "mean", "held",
            "scans to confirm", "lost", "swaps", "false", "memory MB"]  # fmt: skip
    rows = []
    for title in titles:
        for name in results.trackers(title):
            runs = results.of(title, name)
            targets = sum(run["targets"] for run in runs)
            rows.append([
                title, name, f"{len(runs)} × {runs[0]['scans']}", duration(median(_values(runs, "cpu_ms"))),
                over(median, runs, "gospa_mean", ".0f"), over(fmean, runs, "gospa_mean", ".0f"),
                f"{sum(run['confirmed'] for run in runs)} of {targets}",
                _confirming(runs),
                *(str(sum(run[key] for run in runs)) for key in ("lost", "swaps", "false")),
                over(max, runs, "memory_mb", ".0f"),
            ])  # fmt: skip
    return table(head, rows)


def publish(tables: dict[str, list[str]], document: Path | None) -> None:
    """Print the tables, and put each into the document between its marks.

    Table `x` stands between the lines ``<!-- x -->`` and ``<!-- end of x -->``; a document without
    them gets it at its end. Tables without rows are left as they are.
    """
    text = document.read_text(encoding="utf-8") if document and document.exists() else ""
    for name, lines in tables.items():
        if len(lines) < 3:
            continue
        print("\n".join(["", *lines]))
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        part = "\n".join([begin, "", *lines, "", end])
        if begin in text and end in text:
            text = text[: text.index(begin)] + part + text[text.index(end) + len(end) :]
        else:
            text = f"{text}\n{part}\n"
    if document:
        document.write_text(text, encoding="utf-8")
