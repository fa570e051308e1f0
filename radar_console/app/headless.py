"""Runs without a window: tracks to a file, plots to a file, with progress and figures."""

import json
import os
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from radar_console.app.status import StatusLine
from radar_console.chain import Chain, Opened, Tally
from radar_console.core.durations import Durations
from radar_console.core.errors import InputError
from radar_console.core.messages import TrackStatus
from radar_console.recording.writing import PlotWriter, TrackWriter, TruthWriter

TRUTH_INTERVAL = 1.0  # s between the rows of one target in a truth file


def track(opened: Opened, output: Path, stats: Path | None, threads: bool) -> dict[str, Any]:
    """Track a source as fast as it can be read; the figures that `stats` gets, too."""
    if stats is not None:
        check_writable(stats)
    chain = Chain(opened)
    began = time.perf_counter()
    with TrackWriter(output) as writer, StatusLine(opened.title, opened.source.duration) as status:
        for sector in chain.run(threads):
            writer.write(sector)
            status(sector.stop, brief(chain.tally))
    figures = figures_of(chain, time.perf_counter() - began)
    if stats is not None:
        stats.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return figures


def simulate(opened: Opened, output: Path, truth: Path | None) -> tuple[int, int]:
    """Write what the radar of a scenario returns; the numbers of plots and of truth rows."""
    rows = truth_rows = 0
    due = 0.0
    with ExitStack() as stack:
        writer = stack.enter_context(PlotWriter(output))
        truth_writer = stack.enter_context(TruthWriter(truth)) if truth is not None else None
        status = stack.enter_context(StatusLine(opened.title, opened.source.duration))
        for sector in opened.source.sectors():
            writer.write(sector)
            rows += len(sector.plots) + len(sector.centroids)
            while truth_writer is not None and opened.truth is not None and due <= sector.stop:
                table = opened.truth(due)
                truth_writer.write(table)
                truth_rows += len(table)
                due += TRUTH_INTERVAL
            status(sector.stop, f"{rows:,} plots")
    return rows, truth_rows


def brief(tally: Tally) -> str:
    """The state of a run in a few words."""
    return (
        f"{tally.plots:,} plots  {tally.centroids:,} centroids  "
        f"{tally.live_with(TrackStatus.CONFIRMED, TrackStatus.COASTING)} tracks  "
        f"{tally.live_with(TrackStatus.TENTATIVE)} tentative"
    )


def figures_of(chain: Chain, wall_s: float) -> dict[str, Any]:
    """The figures of a finished run, by the names of `stats.json`."""
    tally = chain.tally
    return {
        "scans": tally.turns,
        "plots": tally.plots,
        "centroids": tally.centroids,
        "tracks_confirmed": len(tally.confirmed),
        "tracker_s_per_scan": _spread(tally.tracker_s),
        "latency_s": _spread(tally.latency_s),
        "dropped": chain.gauge.sectors_dropped,
        "skipped": chain.skipped,
        "noted": chain.noted,
        "wall_s": round(wall_s, 3),
        "peak_rss_mb": peak_rss_mb(),
    }


def _spread(times: Durations) -> dict[str, float | None]:
    """Median, 99th percentile and maximum; null when there is nothing."""
    if not len(times):
        return {"median": None, "p99": None, "max": None}
    found = {"median": times.quantile(0.5), "p99": times.quantile(0.99), "max": times.longest}
    return {name: round(value, 6) for name, value in found.items()}


def peak_rss_mb() -> float | None:
    """The most memory this process has held, MB; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6, 1)


def check_writable(file: Path) -> None:
    """Find out before a long run, not after it, that a file can't be written.

    Raises
    ------
    InputError   its folder is missing or closed to us
    """
    if file.is_dir():
        raise InputError(file, "", "is a folder; expected the name of a file to write")
    if not file.parent.is_dir():
        raise InputError(file, "", f"the folder {file.parent} does not exist")
    if not os.access(file if file.exists() else file.parent, os.W_OK):
        raise InputError(file, "", "can't be written: permission denied")
