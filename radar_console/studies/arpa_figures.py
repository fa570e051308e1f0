"""The figures of the study `arpa`."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import LogLocator, NullLocator

from radar_console.studies.arpa_runs import TIMES
from radar_console.studies.drawing import BLUE, GREEN, INK, ORANGE, PURPLE, RED, figure
from radar_console.studies.work import Work

if TYPE_CHECKING:
    from radar_console.studies.arpa import Score

_SCENES = (BLUE, ORANGE, GREEN, PURPLE)
_FILTERS = {"kalman": ("Kalman filter", BLUE, 0.16), "particle": ("particle filter", RED, -0.16)}


def ratios(
    work: Work, scores: Mapping[str, Sequence["Score"]], bounds: Sequence[Mapping[str, np.ndarray]]
) -> None:
    """Errors over their limits, after one minute and after three, with 95 % intervals.

    Parameters
    ----------
    bounds : by scene and quantity, (times,) the Cramér-Rao bound of 95 % errors, in the quantity's unit
    """
    first = next(iter(scores.values()))
    with figure(work, "arpa", 2, size=(9.0, 6.0), sharex=True) as (drawn, axes):
        for ax, minutes in zip(axes, (1, 3), strict=True):
            lines = [
                (number, what, limit)
                for number, score in enumerate(first)
                for k, what, limit in score.scene.limits
                if k == minutes
            ]
            rows = np.arange(len(lines))[::-1]
            for name, (label, colour, dy) in _FILTERS.items():
                each = [(scores[name][number].at(minutes, what)[0], limit) for number, what, limit in lines]
                value, low, high = (
                    np.array([float(getattr(one, part)) / limit for one, limit in each])
                    for part in ("value", "low", "high")
                )
                ax.errorbar(
                    value,
                    rows + dy,
                    xerr=[value - low, high - value],
                    fmt="o" if name == "kalman" else "s",
                    ms=4.5,
                    mfc=colour if name == "kalman" else "white",
                    color=colour,
                    capsize=2,
                    lw=1.1,
                    label=label,
                )
            at = int(np.flatnonzero(60.0 * minutes == TIMES)[0])
            bounded = [
                (row, bounds[number][what][at] / limit)
                for row, (number, what, limit) in zip(rows, lines, strict=True)
                if what in bounds[number]
            ]
            ax.plot(
                [ratio for _, ratio in bounded],
                [row for row, _ in bounded],
                "|",
                color=INK,
                ms=13,
                mew=1.4,
                label="Cramér-Rao bound (without gyro and log)",
            )
            ax.axvline(1.0, color=INK, lw=1.2, ls=(0, (5, 3)), zorder=1)
            ax.set_yticks(rows, [f"scene {number + 1} · {what}" for number, what, _ in lines])
            ax.tick_params(axis="y", length=0)
            ax.grid(axis="y", visible=False)
            ax.set_ylim(-0.7, len(lines) - 0.3)
            ax.set(xlabel="error of 95 % of the runs / limit")
            ax.set_title(f"After {minutes} minute{'s' * (minutes > 1)}")
            for row, (line, after) in zip(rows, pairwise(lines), strict=False):
                if line[0] != after[0]:
                    ax.axhline(row - 0.5, color=INK, lw=0.5, alpha=0.35)
        axes[0].set_xlim(0.0, None)
        runs = len(first[0].tracked)
        handles, labels = axes[0].get_legend_handles_labels()
        drawn.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=3,
            title=f"{runs} runs; left of the dashed line passes",
        )


def over_time(work: Work, scores: Sequence["Score"]) -> None:
    """Errors of 95 % of the runs since the confirmation, and the limits."""
    from radar_console.studies.arpa import QUANTITIES

    with figure(work, "arpa-time", 3, rows=2, size=(8.8, 5.0), sharex=True) as (drawn, axes):
        for ax, (what, unit) in zip(axes, QUANTITIES.items(), strict=True):
            for number, (score, colour) in enumerate(zip(scores, _SCENES, strict=False)):
                ax.plot(TIMES / 60.0, score.within(what), color=colour, label=f"scene {number + 1}")
                for minutes, of, limit in score.scene.limits:
                    if of == what:
                        beside = minutes + 0.055 * (number - 1.5)  # equal limits must not hide one another
                        ax.plot(beside, limit, "v", color=colour, ms=7, mec="white", mew=0.7)
            ax.set(yscale="log", title=what[0].upper() + what[1:], ylabel=f"error, {unit}")
            ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
            ax.yaxis.set_minor_locator(NullLocator())
            ax.yaxis.set_major_formatter("{x:g}")
            ax.set_xlim(0.4, 3.15)
        for ax in axes[3:]:
            ax.set_xlabel("steady tracking, min")
        handles, labels = axes[0].get_legend_handles_labels()
        drawn.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=4,
            title="error that 95 % of the runs stay within (lines), and the standard's limits (triangles)",
        )
