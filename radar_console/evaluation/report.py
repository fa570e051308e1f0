"""A page of HTML that holds everything: tables with intervals, differences, plots, the runs that failed."""

from collections.abc import Sequence
from html import escape

import numpy as np

from radar_console.evaluation import plots
from radar_console.evaluation.grid import label
from radar_console.evaluation.results import Results
from radar_console.evaluation.scoring import Metric
from radar_console.evaluation.summary import MAIN, Summary, summarise, verdict, worded

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 72em; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9em; }
th, td { padding: 0.25em 0.8em; text-align: left; border-bottom: 1px solid #dde2e7; white-space: nowrap; }
td.meaning { color: #57606a; white-space: normal; min-width: 16em; }
.better { background: #dff3e8; } .worse { background: #fbe4dc; }
svg { max-width: 100%; height: auto; } code { background: #f0f2f4; padding: 0.1em 0.3em; }
"""


def page(
    title: str,
    about: Sequence[tuple[str, str]],
    results: Results,
    metrics: Sequence[Metric],
    rng: np.random.Generator,
) -> str:
    """The report of results as one self-contained page.

    Parameters
    ----------
    title, about : the heading, and label and text of what the reader must know of the runs
    rng : of the bootstrap; the same state gives the same page
    """
    summaries = summarise(results, metrics, rng)
    main = [summary for summary in summaries if summary.metric.name in MAIN]
    settings = results.settings
    parts = [
        f"<h1>{escape(title)}</h1>",
        _table([], [[escape(name), escape(text)] for name, text in about]),
        _failures(results),
        _figures(results, summaries),
    ]
    if len(settings) > 1:
        parts.append(_differences(results, summaries))
    parts.append(_parts(results, summaries))
    if main:
        parts += ["<h2>Means and 95 % intervals</h2>", plots.means(main, settings)]
        for key in plots.numeric_keys(settings):
            parts += [f"<h2>Over {escape(key)}</h2>", plots.against(main, settings, key)]
        parts += ["<h2>All runs</h2>", plots.distribution(results, main[0])]
    body = "\n".join(part for part in parts if part)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _figures(results: Results, summaries: Sequence[Summary]) -> str:
    runs = len(results.seeds)
    rows = [
        [
            *_titles(summary.metric),
            *(escape(worded(mean)) + _of(mean.runs, runs) for mean in summary.means),
            summary.metric.meaning,
        ]
        for summary in summaries
    ]
    heading = "<h2>Figures: mean over the runs, with 95 % bootstrap intervals</h2>"
    return heading + _table(["metric", "", *_names(results), "in a run"], rows)


def _differences(results: Results, summaries: Sequence[Summary]) -> str:
    runs = len(results.seeds)
    rows: list[list[Cell]] = []
    for summary in summaries:
        cells: list[Cell] = []
        for difference in summary.differences[1:]:
            said = verdict(summary.metric, difference)
            words = f" {said}" if said else ""
            cells.append((said, escape(worded(difference, signed=True)) + words + _of(difference.runs, runs)))
        rows.append([*_titles(summary.metric), *cells])
    first = escape(label(results.settings[0]))
    heading = (
        f"<h2>Differences to <code>{first}</code>, run by run on the same seeds</h2>"
        "<p>Better and worse are said where the whole 95 % interval is on one side of 0. Among so many "
        "figures one in twenty is so by chance.</p>"
    )
    return heading + _table(["metric", "", *_names(results)[1:]], rows)


def _parts(results: Results, summaries: Sequence[Summary]) -> str:
    rows = [
        [summary.metric.title, *(escape(worded(part)) for part in summary.parts)]
        for summary in summaries
        if summary.parts
    ]
    if not rows:
        return ""
    heading = "<h2>Part of the runs with at least one, with Wilson's 95 % intervals</h2>"
    return heading + _table(["", *_names(results)], rows)


def _failures(results: Results) -> str:
    failed = results.failed
    if not failed:
        return ""
    rows = [
        [str(row.seed), escape(label(results.settings[row.setting])), escape(row.error)] for row in failed
    ]
    heading = f"<h2>{len(failed):,} of {len(results.rows):,} runs failed, and count nowhere</h2>"
    return heading + _table(["seed", "setting", "why"], rows)


def _names(results: Results) -> list[str]:
    return [f"<code>{escape(label(setting))}</code>" for setting in results.settings]


def _titles(metric: Metric) -> list[str]:
    return [escape(metric.title), escape(metric.unit)]


def _of(runs: int, all_runs: int) -> str:
    """How many runs have the figure, where not all do."""
    return "" if runs == all_runs else f" <small>({runs:,} runs)</small>"


Cell = str | tuple[str, str]
"""HTML of a cell, or its class and that."""


def _table(head: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    lines = ["<div class='wide'><table>"]
    if head:
        lines.append("<tr>" + "".join(f"<th>{cell}</th>" for cell in head) + "</tr>")
    for row in rows:
        cells = [
            f"<td>{cell}</td>" if isinstance(cell, str) else f"<td class='{cell[0]}'>{cell[1]}</td>"
            for cell in row
        ]
        lines.append("<tr>" + "".join(cells) + "</tr>")
    return "\n".join([*lines, "</table></div>"])
