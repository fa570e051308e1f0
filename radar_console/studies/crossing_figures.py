"""The figures of the study `crossing`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from radar_console.core.geometry import to_cartesian
from radar_console.core.units import KM
from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.studies import crossing_runs, tracked
from radar_console.studies.crossing_runs import BEFORE, MEETING, Cell
from radar_console.studies.drawing import BLUE, GREY, INK, ORANGE, RED, figure
from radar_console.studies.tracked import GIVEN
from radar_console.studies.work import Work, generator

if TYPE_CHECKING:
    from radar_console.studies.crossing import Played

_COLOURS = {"GNN": RED, "JPDA": BLUE}
_HALF = 2.5  # km, of the window about the crossing
_SHOWN = Cell(50.0, 6.7)


def probabilities(work: Work, results: Sequence["Played"]) -> None:
    """Swap, lost and extra against the density of clutter, with 95 % intervals."""
    panels = (("swap", "A track on the wrong target"), ("lost", "A lost target"), ("extra", "A third track"))
    plain = [each for each in results if each.cell.where == "published"]
    with figure(work, "crossing-probabilities", 3, size=(9.6, 4.2), sharey=True) as (drawn, axes):
        for ax, (event, title) in zip(axes, panels, strict=True):
            chosen = [each for each in plain if each.cell.initiation == (event == "extra")]
            every = sorted({each.cell.sd for each in chosen}, reverse=True)
            for number, (tracker, sd) in enumerate((t, sd) for t in _COLOURS for sd in every):
                cells = [each for each in chosen if each.cell.sd == sd]
                each = [intervals.proportion(one.of(event, tracker)) for one in cells]
                value = 100.0 * np.array([float(one.value) for one in each])
                low = 100.0 * np.array([float(one.low) for one in each])
                high = 100.0 * np.array([float(one.high) for one in each])
                # Side by side, so that intervals of equal figures do not hide one another.
                at = np.array([one.cell.density for one in cells]) * 1.10 ** (number - 1.5)
                wide = sd > 10.0
                ax.errorbar(
                    at, value, np.abs([value - low, high - value]), fmt="o" if wide else "s",
                    mfc=_COLOURS[tracker] if wide else "white", color=_COLOURS[tracker], ms=4.5,
                    elinewidth=1.2, capsize=2, label=f"{tracker}, σ = {sd:g} m",
                )  # fmt: skip
                # A few runs at the last density hang on no line.
                most = np.array([one.events[event].shape[1] for one in cells])
                on = most == most.max()
                ax.plot(at[on], value[on], "-" if wide else "--", color=_COLOURS[tracker], lw=1.2, zorder=1)
            runs = sorted({one.events[event].shape[1] for one in chosen})
            said = f"{runs[-1]} runs" if len(runs) == 1 else f"{runs[-1]} runs, {runs[0]} at 6.7"
            ax.set(xscale="log", xlabel=f"clutter, per km² and scan\n({said})", title=title, ylim=(-3, 103))
            ax.set_xticks([0.1, 1.0, 2.0, 6.7], ["0.1", "1", "2", "6.7"])
            ax.minorticks_off()
        axes[0].set_ylabel("probability in a run, %")
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def tracks(work: Work, results: Sequence["Played"]) -> None:
    """Figures 18 to 20 redrawn: the scene, and both trackers at the crossing, of one run."""
    played = next(each for each in results if each.cell == _SHOWN)
    telling = np.flatnonzero(played.of("kept", "JPDA") & ~played.of("kept", "GNN"))
    run = int(telling[0]) if len(telling) else 0
    whole = tracked.play(crossing_runs.scene(_SHOWN), generator(work.seed, run))
    bare = tracked.play(crossing_runs.scene(_SHOWN._replace(density=0.0)), generator(work.seed, run))
    real, every = _plots(bare), _plots(whole)
    centre = crossing_runs.published(MEETING)[:, :2].mean(axis=0) / KM
    with figure(work, "crossing-tracks", 3, size=(9.6, 4.0)) as (drawn, axes):
        _scene(axes[0], centre)
        for ax, (tracker, number) in zip(axes[1:], (("GNN", 19), ("JPDA", 20)), strict=True):
            ax.plot(*every.T, ".", color=GREY, ms=2.4, mew=0, alpha=0.6, label="false plots")
            ax.plot(*real.T, "x", color=INK, ms=4, mew=0.9, label="plots of the targets")
            rows = crossing_runs.rows(whole, _SHOWN, tracker, work.seed + run)
            for number_of, colour in ((0, ORANGE), (1, BLUE)):
                own = rows[rows["track"] == GIVEN + number_of]
                ax.plot(
                    own["east"] / KM, own["north"] / KM, color=colour, lw=1.8, label=f"track {number_of + 1}"
                )
            ax.set(xlim=centre[0] + _HALF * np.array([-1, 1]), ylim=centre[1] + _HALF * np.array([-1, 1]))
            ax.set(xlabel="east, km", title=f"{tracker} (after figure {number})", aspect="equal")
        axes[1].set_ylabel("north, km")
        title = f"All scans of run {run} of seed {work.seed}, {_SHOWN.name}"
        handles = axes[1].get_legend_handles_labels()
        drawn.legend(*handles, title=title, loc="outside lower center", ncols=4, markerscale=1.6)


def _scene(ax: Axes, centre: Array) -> None:
    """The courses of the paper from their start, and what is played of them."""
    for number, colour in ((0, ORANGE), (1, BLUE)):
        path = np.array([crossing_runs.published(time)[number, :2] for time in (0.0, 840.0)]) / KM
        ax.plot(*path.T, color=colour, lw=1.0)
        part = np.array(
            [crossing_runs.published(MEETING + time)[number, :2] for time in (-BEFORE, crossing_runs.AFTER)]
        )
        ax.plot(*part.T / KM, color=colour, lw=3.0, solid_capstyle="butt")
        ax.annotate(f"{number + 1}", path[0], (5, 0), textcoords="offset points", color=colour)
    ax.plot(0, 0, "^", color=INK)
    ax.annotate("radar", (0, 0), (7, -3), textcoords="offset points")
    ax.plot(*centre, "s", mfc="none", color=INK, ms=9)
    ax.set(xlabel="east, km", ylabel="north, km", title="The scene (after figure 18)")
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_box_aspect(1.0)


def _plots(played: tracked.Played) -> Array:
    """(n, 2) km, of all turns."""
    rows = np.concatenate([sector.centroids for sector in played.sectors])
    east, north = to_cartesian(rows["range"], rows["azimuth"])
    return np.stack([east, north], axis=1) / KM
