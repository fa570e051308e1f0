"""The figures of the study `seven_targets`."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator

from radar_console.core.messages import Table
from radar_console.evaluation.intervals import Interval
from radar_console.studies.drawing import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, figure
from radar_console.studies.scenario_runs import Picture
from radar_console.studies.work import Work

if TYPE_CHECKING:
    from radar_console.studies.seven_targets import Meeting

_HALO = (withStroke(linewidth=2.5, foreground="white"),)
_CROWDED = 10e3  # m
COLOURS = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, INK)
_TRUTH = "#D0D6DB"
_FIRST = 7
"""The paper's figure of target 1."""


def each(work: Work, picture: Picture, tracks: Sequence[Table], met: Sequence["Meeting"]) -> None:
    """Figures 7 to 13: truth and track of each target."""
    with figure(work, "seven-targets-each", 4, rows=2, size=(9.6, 5.2)) as (_, axes):
        for number, (ax, rows) in enumerate(zip(axes, tracks, strict=False)):
            true = picture.truth[picture.truth["target"] == number]
            ax.plot(true["east"] / 1e3, true["north"] / 1e3, color=_TRUTH, lw=5.0, solid_capstyle="round")
            ax.plot(rows["east"] / 1e3, rows["north"] / 1e3, color=COLOURS[number], lw=1.4)
            ax.plot(true["east"][0] / 1e3, true["north"][0] / 1e3, "o", color=INK, ms=4)
            for meeting in met:
                if number in (meeting.first, meeting.second):
                    now = true[meeting.closest]
                    ax.plot(now["east"] / 1e3, now["north"] / 1e3, "o", mfc="none", mec=INK, ms=9, mew=0.9)
            _square(ax, true)
            ax.set_title(f"{_FIRST + number} · target {number + 1}")
            ax.set_title(f"{_rms(true, rows):.0f} m rms", loc="right", fontsize=8.5, weight="normal")
            ax.set_xlabel("east, km")
            ax.set_ylabel("north, km")
        key = axes[-1]
        key.axis("off")
        key.legend(handles=_key(), loc="center left", bbox_to_anchor=(0.0, 0.55), handlelength=1.6)


def whole(work: Work, picture: Picture, tracks: Sequence[Table], met: Sequence["Meeting"]) -> None:
    """Figure 14: all tracks, with what the radar saw."""
    with figure(work, "seven-targets-whole", size=(6.8, 6.8)) as (_, (ax,)):
        ax.plot(*(picture.seen.T / 1e3), ".", color=GREY, ms=1.8, alpha=0.45, lw=0, zorder=1)
        for number, rows in enumerate(tracks):
            ax.plot(rows["east"] / 1e3, rows["north"] / 1e3, color=COLOURS[number], lw=1.6)
            last, before = rows[-1], rows[-6]
            ahead = np.array([last["east"] - before["east"], last["north"] - before["north"]])
            place = np.array([last["east"], last["north"]]) / 1e3
            ax.annotate(
                "",
                _point(place + 2.5 * ahead / np.linalg.norm(ahead)),
                _point(place),
                arrowprops={"arrowstyle": "-|>", "color": COLOURS[number], "lw": 1.6},
            )
            ax.annotate(
                str(number + 1),
                (rows["east"][0] / 1e3, rows["north"][0] / 1e3),
                _point(_beside(rows, tracks)),
                textcoords="offset points",
                color=COLOURS[number],
                weight="bold",
                ha="center",
                va="center",
                path_effects=_HALO,
            )
        for meeting in met:
            now = picture.truth[picture.truth["target"] == meeting.first][meeting.closest]
            ax.plot(now["east"] / 1e3, now["north"] / 1e3, "o", mfc="none", mec=INK, ms=11, mew=0.9)
        ax.plot(0.0, 0.0, "+", color=INK, ms=9)
        ax.annotate("radar", (0.0, 0.0), (7, -11), textcoords="offset points", path_effects=_HALO)
        ax.set_aspect("equal")
        ax.set(xlabel="east, km", ylabel="north, km")
        ax.set_title("14 · the seven tracks, centroids (dots), meetings (rings)")
        far = 1.12 * max(np.abs(picture.truth[name]).max() for name in ("east", "north")) / 1e3
        ax.set(xlim=(-far, far), ylim=(-far, far))


def over_runs(work: Work, through: Mapping["Meeting", Interval], held: Sequence[Interval]) -> None:
    """Meetings kept and continuity, with 95 % intervals."""
    with figure(work, "seven-targets-kept", 2, size=(8.6, 3.4)) as (_, (left, right)):
        _bars(left, [f"{meeting.name}" for meeting in through], list(through.values()), BLUE)
        left.set(xlabel="part of the runs", title=f"Both tracks kept, {held[0].runs} runs")
        left.set_xlim(None, 1.005)
        _bars(right, [f"target {number + 1}" for number in range(len(held))], held, GREEN)
        right.set(xlabel="part of its time", title="Continuity")
        right.set_xlim(None, 1.002)


def _bars(ax: Axes, names: Sequence[str], figures: Sequence[Interval], colour: str) -> None:
    rows = np.arange(len(names))[::-1]
    value = np.array([float(each.value) for each in figures])
    low, high = (np.array([float(bound) for bound in side]) for side in zip(
        *[(each.low, each.high) for each in figures], strict=True))  # fmt: skip
    ax.errorbar(value, rows, xerr=[value - low, high - value], fmt="o", color=colour, capsize=3)
    ax.set_yticks(rows, names)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    ax.set_ylim(-0.6, len(names) - 0.4)


def _point(place: np.ndarray) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _beside(rows: Table, tracks: Sequence[Table]) -> np.ndarray:
    """Where the label of a track goes from its start, points: behind it, and aside from others near by."""
    way = np.array([rows["east"][3] - rows["east"][0], rows["north"][3] - rows["north"][0]])
    way = way / np.linalg.norm(way)
    place = np.array([rows["east"][0], rows["north"][0]])
    others = np.array([[each["east"][0], each["north"][0]] for each in tracks]) - place
    near = others[(np.linalg.norm(others, axis=1) < _CROWDED) & others.any(axis=1)]
    aside = -near.sum(axis=0) / max(float(np.linalg.norm(near.sum(axis=0))), 1.0)
    offset: np.ndarray = -11.0 * way + 8.0 * aside
    return offset


def _square(ax: Axes, true: Table) -> None:
    """The same scale both ways, with room for the whole path."""
    east, north = true["east"] / 1e3, true["north"] / 1e3
    half = 0.5 * max(np.ptp(east), np.ptp(north)) * 1.12
    x, y = 0.5 * (east.min() + east.max()), 0.5 * (north.min() + north.max())
    ax.set_xlim(x - half, x + half)
    ax.set_ylim(y - half, y + half)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(10.0 if half < 30.0 else 50.0))
    ax.set_aspect("equal")


def _rms(true: Table, rows: Table) -> float:
    """How far a track's rows are from the truth, which is given every second, m."""
    east, north = (np.interp(rows["time"], true["time"], true[name]) for name in ("east", "north"))
    return float(np.sqrt(np.mean((rows["east"] - east) ** 2 + (rows["north"] - north) ** 2)))


def _key() -> list[Line2D]:
    return [
        Line2D([], [], color=_TRUTH, lw=5.0, label="truth"),
        Line2D([], [], color=GREY, lw=1.4, label="track (in colour)"),
        Line2D([], [], color=INK, marker="o", ms=4, lw=0, label="start"),
        Line2D([], [], marker="o", mfc="none", mec=INK, ms=9, lw=0, label="meets another"),
    ]
