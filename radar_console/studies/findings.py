"""What a study found: published beside ours, with an interval and a verdict in words."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from radar_console.evaluation.intervals import Interval

COLUMNS = ("quantity", "published", "ours", "95 % interval", "runs", "verdict")


@dataclass(frozen=True, slots=True)
class Finding:
    """One figure of a study; a row of its table and of `results.json`.

    Attributes
    ----------
    unit : of the figures, empty for a ratio
    published : what the paper says, None where it says nothing
    ci_low, ci_high : 95 % interval of `ours`, None where it has none
    runs : that `ours` was made from
    """

    quantity: str
    unit: str
    published: float | None
    ours: float
    ci_low: float | None
    ci_high: float | None
    runs: int
    verdict: str


def found(quantity: str, unit: str, ours: Interval, verdict: str, published: float | None = None) -> Finding:
    """A finding from a figure and its interval."""
    low, high = (float(bound) if np.isfinite(bound) else None for bound in (ours.low, ours.high))
    return Finding(quantity, unit, published, float(ours.value), low, high, ours.runs, verdict)


def within(value: float, low: float, high: float, smaller_is_better: bool = True) -> str:
    """The verdict on a figure that was expected between two bounds."""
    span = f"{low:g} to {high:g}"
    if low <= value <= high:
        return f"as expected ({span})"
    better = (value < low) == smaller_is_better
    return f"{'better than' if better else 'falls short of'} the expected {span}"


def beside(ours: Interval, reference: float, smaller_is_better: bool = True) -> str:
    """The verdict on a figure beside one that is known without an interval."""
    side = float(ours.beyond(reference))
    if side == 0.0:
        return f"as the reference, {reference:g}"
    better = (side < 0) == smaller_is_better
    return f"{'better' if better else 'worse'} than the reference, {reference:g}"


def rows(findings: Sequence[Finding]) -> list[tuple[str, ...]]:
    """The cells of the table, by `COLUMNS`."""
    return [
        (
            each.quantity + (f", {each.unit}" if each.unit else ""),
            "–" if each.published is None else f"{each.published:g}",
            _figure(each.ours, each),
            "–"
            if each.ci_low is None or each.ci_high is None
            else f"{_figure(each.ci_low, each)} … {_figure(each.ci_high, each)}",
            f"{each.runs:,}",
            each.verdict,
        )
        for each in findings
    ]


def markdown(findings: Sequence[Finding]) -> str:
    """The table as Markdown."""
    lines = [COLUMNS, ("---", "--:", "--:", ":-:", "--:", "---"), *rows(findings)]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def write(
    folder: Path, title: str, about: str, command: str, findings: Sequence[Finding], figures: Sequence[str]
) -> None:
    """Write `results.json` and `report.md` to `folder`."""
    results = json.dumps([asdict(each) for each in findings], indent=2, ensure_ascii=False)
    (folder / "results.json").write_text(results + "\n", encoding="utf-8")
    pictures = "".join(f"\n![{Path(name).stem}]({name})\n" for name in figures)
    text = f"# {title}\n\n    {command}\n\n{markdown(findings)}{pictures}\n## About\n\n```\n{about}\n```\n"
    (folder / "report.md").write_text(text, encoding="utf-8")


def _figure(value: float, of: Finding) -> str:
    """To a digit more than the interval's half width decides, else to four significant ones."""
    if value == 0.0:
        return "0"
    width = 0.0 if of.ci_low is None or of.ci_high is None else 0.5 * (of.ci_high - of.ci_low)
    if abs(value) < 1e-4:
        return f"{value:.1e}"
    scale = width if width > 0.0 else abs(value) / 1e2
    return f"{value:,.{int(np.clip(1 - np.floor(np.log10(scale)), 0, 6))}f}"
