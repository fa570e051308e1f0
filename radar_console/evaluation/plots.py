"""Plots of results as SVG that a page can hold; the same results give the same bytes."""

from collections.abc import Sequence
from io import StringIO
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from radar_console.evaluation.grid import Setting, label, text_of
from radar_console.evaluation.results import Results
from radar_console.evaluation.summary import Summary

# Colours that also the colour-blind tell apart: Okabe, Ito, Color universal design, 2008.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
MARKS = ("o", "s", "^", "D", "v", "P", "X")
STYLE: Any = {  # of matplotlib
    "svg.fonttype": "none",
    "svg.hashsalt": "radar-console",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
}


def _svg(figure: Figure) -> str:
    out = StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None}, bbox_inches="tight")
    text = out.getvalue()
    return text[text.index("<svg") :]


def means(summaries: Sequence[Summary], settings: Sequence[Setting]) -> str:
    """A panel for each metric: a dot and an interval for each setting."""
    columns = 3
    rows = -(-len(summaries) // columns)
    height = 0.9 + 0.24 * len(settings)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, rows * height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for place, axis in enumerate(axes):
            if place >= len(summaries):
                axis.set_axis_off()
                continue
            summary = summaries[place]
            for k, mean in enumerate(summary.means):
                colour = COLOURS[k % len(COLOURS)]
                axis.plot([mean.low, mean.high], [k, k], color=colour, linewidth=2)
                axis.plot([mean.value], [k], MARKS[k % len(MARKS)], color=colour, markersize=5)
            names = [label(setting) for setting in settings] if place % columns == 0 else []
            axis.set_yticks(range(len(settings)), names or [""] * len(settings))
            axis.set_ylim(len(settings) - 0.5, -0.5)
            axis.set_title(_named(summary), loc="left", fontsize=9)
        return _svg(figure)


def distribution(results: Results, summary: Summary) -> str:
    """The part of the runs at or below each value of a metric, a line for each setting."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 3.2), layout="constrained")
        axis = figure.subplots()
        for k, values in enumerate(results.figures(summary.metric.name)):
            there = values[np.isfinite(values)]
            if len(there):
                axis.ecdf(there, color=COLOURS[k % len(COLOURS)], label=label(results.settings[k]))
        axis.set_xlabel(_named(summary))
        axis.set_ylabel("part of the runs at or below")
        axis.legend(fontsize=8, frameon=False)
        return _svg(figure)


def numeric_keys(settings: Sequence[Setting]) -> list[str]:
    """The keys whose values are several different numbers."""
    return [
        key
        for key in settings[0]
        if all(isinstance(s[key], int | float) and not isinstance(s[key], bool) for s in settings)
        and len({s[key] for s in settings}) > 1
    ]


def against(summaries: Sequence[Summary], settings: Sequence[Setting], key: str) -> str:
    """A panel for each metric over the values of a numeric key, a line for each rest of the setting."""
    columns = 3
    rows = -(-len(summaries) // columns)
    lines: dict[str, list[int]] = {}
    for k in sorted(range(len(settings)), key=lambda k: float(settings[k][key])):
        rest = ", ".join(f"{name}={text_of(v)}" for name, v in settings[k].items() if name != key)
        lines.setdefault(rest, []).append(k)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 2.4 * rows), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for place, axis in enumerate(axes):
            if place >= len(summaries):
                axis.set_axis_off()
                continue
            for n, (rest, numbers) in enumerate(lines.items()):
                at = [settings[k][key] for k in numbers]
                value, low, high = np.array([summaries[place].means[k][:3] for k in numbers], float).T
                colour = COLOURS[n % len(COLOURS)]
                axis.fill_between(at, low, high, color=colour, alpha=0.2, linewidth=0)
                axis.plot(
                    at, value, MARKS[n % len(MARKS)] + "-", color=colour, markersize=4, label=rest or None
                )
            axis.set_title(_named(summaries[place]), loc="left", fontsize=9)
            axis.set_xlabel(key)
            if place == 0 and len(lines) > 1:
                axis.legend(fontsize=8, frameon=False)
        return _svg(figure)


def _named(summary: Summary) -> str:
    unit = f", {summary.metric.unit}" if summary.metric.unit else ""
    return summary.metric.title + unit
