"""The figures of the study `filter_rmse`."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FixedLocator, NullLocator

from radar_console.evaluation.intervals import Interval
from radar_console.studies import trajectories
from radar_console.studies.drawing import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, RED, figure
from radar_console.studies.filter_runs import GRID
from radar_console.studies.work import Work

if TYPE_CHECKING:
    from radar_console.studies.filter_rmse import Score

_FILTERS = {
    "kf": ("best Kalman filter", GREY),
    "imm": ("IMM", ORANGE),
    "imm3": ("IMM with turns", GREEN),
    "rbpf": ("RBPF", BLUE),
}


def curve(work: Work, scores: Sequence["Score"], ekf: float, pf: float) -> None:
    """RMSE of the Kalman filter against its process noise, with the published pair on it."""
    colours = {"RANDOM": BLUE, "E3REC": RED, "FIGHTER": GREEN, "AIRLINER": PURPLE}
    with figure(work, "filter-rmse-kalman") as (_, (ax,)):
        for score in scores[:4]:
            name = score.case.trajectory
            ax.plot(GRID, score.curve, color=colours[name], label=name)
            ax.plot(GRID[score.best], score.curve[score.best], "o", color=colours[name])
        levels = (
            (ekf, "published EKF, UKF 186.4 m"),
            (float(scores[0].rmse["raw"].value), "no filter 141.4 m"),
            (pf, "published particle filter 135.4 m"),
        )
        for k, (level, text) in enumerate(levels):
            ax.axhline(level, color=INK, lw=1.0, ls=(0, (1, 2)) if k == 1 else (0, (5, 3)), zorder=1)
            side, shift = ("top", -2) if k == 2 else ("bottom", 1)
            ax.annotate(text, (0.105, level), (0, shift), textcoords="offset points", va=side, fontsize=8.5)
        ax.set(xscale="log", yscale="log", xlim=(0.1, 500), ylim=(95, 600))
        ax.yaxis.set_major_locator(FixedLocator([100, 120, 150, 200, 300, 400, 600]))
        ax.yaxis.set_minor_locator(NullLocator())
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:g}")
        ax.set(xlabel=r"process noise $\sigma_a$ of the Kalman filter, m/s²", ylabel="RMSE, m")
        ax.set_title("A Kalman filter alone gives both published figures")
        ax.legend(loc="upper right")


def ratios(work: Work, scores: Sequence["Score"], published: float) -> None:
    """IMM and RBPF over the Kalman filter, by case, with 95 % intervals."""
    with figure(work, "filter-rmse-ratios", 2, size=(8.6, 4.8), sharey=True) as (drawn, axes):
        rows = np.arange(len(scores))[::-1]
        for ax, opponent, title in zip(
            axes,
            ("kf", "nominal"),
            ("Over the best-tuned KF", r"Over the nominal KF, $\sigma_a$ = 3 m/s²"),
            strict=True,
        ):
            for name, dy in (("imm", 0.2), ("imm3", 0.0), ("rbpf", -0.2)):
                each = [score.ratio[name, opponent] for score in scores]
                value = np.array([float(ratio.value) for ratio in each])
                below = value - [float(ratio.low) for ratio in each]
                above = [float(ratio.high) for ratio in each] - value
                label, colour = _FILTERS[name]
                ax.errorbar(
                    value, rows + dy, xerr=[below, above], fmt="o", color=colour, label=label, capsize=2
                )
            ax.axvline(published, color=INK, lw=1.0, ls=(0, (5, 3)), zorder=1)
            ax.axvline(1.0, color=GREY, lw=1.0)
            ax.set(xlabel="RMSE ratio", title=title, xlim=(0.25, 1.05))
            ax.grid(axis="y", visible=False)
        axes[0].set_yticks(rows, [score.case.name for score in scores])
        for ax in axes:
            ax.tick_params(axis="y", length=0)
        axes[0].text(
            published - 0.01, rows[0] + 0.62, "published 0.726", ha="right", va="center", fontsize=8.5
        )
        axes[0].set_ylim(-0.6, len(scores) - 0.1)
        drawn.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=3)


def flight(work: Work, score: "Score", runs: int) -> None:
    """The reconstructed trajectory, and the filters' errors along it."""
    T = score.case.T
    target = trajectories.BY_HAND[score.case.trajectory]
    path = trajectories.path(target, 1.0) / 1e3
    with figure(work, "filter-rmse-flight", 2, width_ratios=(1, 1.9)) as (_, (left, right)):
        left.plot(*path.T, color=INK)
        left.plot(*path[0], "o", color=INK)
        left.annotate("start", path[0], (-6, 6), textcoords="offset points", ha="right")
        left.set_aspect("equal")
        left.set(xlabel="east, km", ylabel="north, km", title=f"{score.case.trajectory} (after figure 17)")
        begin = 0.0
        for leg in target.legs:
            if leg.kind != "straight":
                right.axvspan(begin, begin + leg.duration_s, color=PALE, lw=0)
            begin += leg.duration_s
        time = T * (3 + np.arange(len(score.time["kf"])))
        for name in ("kf", "imm", "rbpf"):
            label, colour = _FILTERS[name]
            width = 1.2 if name != "rbpf" else 1.8
            right.plot(time, np.sqrt(score.time[name] / runs), color=colour, label=label, lw=width)
        right.axhline(float(score.rmse["raw"].value), color=INK, lw=1.0, ls=(0, (1, 2)))
        right.set(xlabel="time, s (shaded: manoeuvres)", ylabel="RMSE, m", xlim=(0, begin))
        right.set_ylim(0, 1.15 * right.get_ylim()[1])
        right.set_title(f"Error along it, {runs} runs (dotted: no filter)")
        right.legend(loc="upper right", ncols=3, columnspacing=1.2)


def convergence(work: Work, ratio: Mapping[tuple[str, int], Interval]) -> None:
    """Particle filters with the Kalman filter's model, on truth from it, as they grow."""
    with figure(work, "filter-rmse-convergence", size=(6.4, 3.8)) as (_, (ax,)):
        for name, colour in (("prior", RED), ("optimal", BLUE)):
            counts = np.array([count for proposal, count in ratio if proposal == name])
            each = [ratio[name, int(count)] for count in counts]
            value, low, high = (
                100 * (np.array(list(column), float) - 1) for column in list(zip(*each, strict=True))[:3]
            )
            floor = 0.01
            bounds = [value - np.maximum(low, floor), high - value]
            ax.errorbar(
                counts * (0.97 if name == "prior" else 1.03),  # side by side where they are equal
                value,
                yerr=np.maximum(bounds, 0),
                fmt="o-",
                color=colour,
                capsize=2,
                label=f"{name} proposal",
            )
        ax.set(
            xscale="log",
            yscale="log",
            ylim=(0.03, 100),
            xlabel="particles",
            ylabel="RMSE above the Kalman filter's, %",
        )
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:,g}")
        ax.set_title("With one model, on its own truth, PF → KF")
        ax.legend(loc="upper right")
