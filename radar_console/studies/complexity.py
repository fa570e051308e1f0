"""What joint association costs with many targets and overlapping gates.

The paper, section 3.2.2: the cost of JPDA grows exponentially with the number of targets, as all feasible
joint events are made; remedies are partition into groups of tracks and plots that belong together, narrow
gates, and parallel hardware. There are no figures: nothing here is published. Four ways to the same
probabilities, on the same scans:

- all: every joint event, one by one, of the whole scan (compiled, depth first);
- clusters: the same for each group of tracks that share plots;
- exact: the tracker's own sums, cluster by cluster (`tracker/association/jpda.py`);
- propagation: loopy belief propagation (Williams and Lau, 2014), to which the tracker goes when a cluster is
  past the budget of the exact sums.

Targets abreast in one line, 1 radius of a gate apart; in groups of four, 0.8 radii apart; and 10, 20 and 40
of them at spacings from 2.5 to 0.05 radii. A gate holds 99.99 % (radius 543 m for σ = 100 m), there is
1 false plot per km², P_D is 0.9. Events past three million are counted, not gone through; in the figures
their time is the count times the time of an event. Times are processor times of one thread, medians over the
scans, and differ from machine to machine; counts, differences and probabilities do not. The table says on
what class of machine they were taken.

Running time: 100 runs take some two minutes on one core.
"""

import os
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.studies import association_runs
from radar_console.studies.association_runs import WAYS, Point
from radar_console.studies.drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, figure
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Arrays, Part, Work, chunks, generator

RUNS = 100
ABREAST = tuple(Point("abreast", n, 1.0) for n in (2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128))
GROUPS = tuple(Point("groups", n, 0.8) for n in (4, 8, 16, 32, 64, 128))
SPACINGS = (2.5, 2.0, 1.5, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05)
CROWDS = (10, 20, 40)

_CHUNK = 20  # runs of a part
_MANY = 16  # targets from which on powers are fitted: below, the time of the call itself rules
_BOUNDS = 3
_TITLES = {
    "all": "all events",
    "clusters": "all events of each cluster",
    "exact": "the tracker's exact sums",
    "propagation": "belief propagation",
}
_LOOKS = {"all": (RED, "s-"), "clusters": (ORANGE, "D-"), "exact": (BLUE, "o-"), "propagation": (GREEN, "^-")}
Results = dict[Point, Arrays]


def run(work: Work) -> list[Finding]:
    """Solve all scans; the findings, growth first."""
    overlap = [Point("abreast", n, spacing) for n in CROWDS for spacing in SPACINGS]
    points = list(dict.fromkeys([*ABREAST, *GROUPS, *overlap]))
    parts = [
        Part(association_runs.measure, (point, each, work.seed), len(each))
        for point in points
        for each in chunks(work.runs, _CHUNK)
    ]
    done = iter(work.do("complexity", parts))
    results: Results = {}
    for point in points:
        own = [next(done) for _ in chunks(work.runs, _CHUNK)]
        results[point] = {name: np.concatenate([part[name] for part in own]) for name in own[0]}
    draw_targets(work, results)
    draw_overlap(work, results)
    return findings(results, work)


def machine() -> str:
    """Its class, in words: processor and number of cores."""
    name = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.exists():
        lines = described.read_text(encoding="utf-8", errors="replace").splitlines()
        name = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), name)
    return f"{name} ({platform.machine()}, {os.cpu_count()} cores)"


def findings(results: Results, work: Work) -> list[Finding]:
    """How time grows, what it is at some points, and how far the ways are apart."""
    rng = generator(work.seed, _BOUNDS)
    where = machine()
    growth = [
        _growth(results, ABREAST, "events_all", "per target", rng),
        _growth(results, ABREAST, "exact", "power of the number", rng),
        _growth(results, GROUPS, "events_all", "per target", rng),
        _growth(results, GROUPS, "events_clusters", "power of the number", rng),
        _growth(results, GROUPS, "exact", "power of the number", rng),
    ]
    shown = [point for point in (*ABREAST, *GROUPS) if point.targets in (8, 16, 128)]
    shown += [Point("abreast", n, 0.2) for n in CROWDS]
    times = [row for point in shown for row in _times(results[point], point, where, rng)]
    wrong = max(float(each["wrong"].max()) for each in results.values())
    gone = sum(int(np.isfinite(each["all"]).sum()) for each in results.values())
    verdict = "equal to the tracker's sums" if wrong < 1e-9 else "not equal to the tracker's sums"
    same = Finding("largest |all events − exact|, probability", "", None, wrong, None, None, gone, verdict)
    apart = [row for n in CROWDS for spacing in SPACINGS for row in _apart(results, n, spacing, rng)]
    return [*growth, same, *times, *apart]


def _growth(
    results: Results, points: Sequence[Point], what: str, law: str, rng: np.random.Generator
) -> Finding:
    """The factor for one more target, or the power of their number, from a straight line through the logs."""
    points = [point for point in points if law == "per target" or point.targets >= _MANY]
    x = np.array([point.targets for point in points], float)
    x = x if law == "per target" else np.log(x)
    logs = np.log(np.stack([results[point][what] for point in points]))

    def slope(values: Array) -> Array:
        mean = values.mean(axis=-1)
        result: Array = np.tensordot(x - x.mean(), mean, (0, 0)) / np.sum((x - x.mean()) ** 2)
        return result

    fitted = intervals.bootstrap(slope, logs, rng=rng, resamples=2_000)
    way = what.removeprefix("events_")
    name = f"time, {_TITLES[what]}" if way == what else f"joint events, {_TITLES[way]}"
    layout = "abreast" if points[0].layout == "abreast" else "in groups of four"
    if law == "per target":
        fitted = Interval(np.exp(fitted.value), np.exp(fitted.low), np.exp(fitted.high), fitted.runs)
        verdict = "exponential, as the paper says"
        return found(f"{name}, {layout}: factor for one more target", "", fitted, verdict)
    verdict = {-1.0: "less than linear", 0.0: "linear", 1.0: "more than linear, not exponential"}[
        float(fitted.beyond(1.0))
    ]
    return found(f"{name}, {layout}: power of the number from {_MANY} targets", "", fitted, verdict)


def _times(each: Arrays, point: Point, where: str, rng: np.random.Generator) -> list[Finding]:
    name = f"{point.targets} {point.layout}, {point.spacing:g} radii"
    rows = []
    for way in WAYS:
        if np.isfinite(each[way]).all():
            rows.append(found(f"time, {_TITLES[way]}, {name}", "ms", _median(1e3 * each[way], rng), where))
        elif way in ("all", "clusters"):
            count = each["events_" + way]
            if np.isfinite(count).all():
                power, said = _median(np.log10(count), rng), "too many to go through"
                rows.append(found(f"log10 of joint events, {_TITLES[way]}, {name}", "", power, said))
    return rows


def _apart(results: Results, n: int, spacing: float, rng: np.random.Generator) -> list[Finding]:
    """How far propagation is off, and whether the tracker had to use it."""
    each = results[Point("abreast", n, spacing)]
    name = f"{n} abreast, {spacing:g} radii"
    past, known = intervals.proportion(each["past"]), np.isfinite(each["rough"])
    said = "within the budget in all runs" if past.value == 0.0 else "the tracker propagates"
    rows = [found(f"past the exact budget, {name}", "", past, said)]
    if known.any():
        off = _median(each["rough"][known], rng)
        verdict = "close" if off.value < 0.01 else "noticeable" if off.value < 0.1 else "a tenth and more"
        if not known.all():
            verdict += f"; of the {known.sum()} scans whose exact sums are within reach"
        rows.append(found(f"largest error of propagation, {name}", "", off, verdict))
    return rows


def _median(values: Array, rng: np.random.Generator) -> Interval:
    return intervals.median(values, rng, resamples=2_000)


def draw_targets(work: Work, results: Results) -> None:
    """Time against the number of targets, in one line and in groups."""
    with figure(work, "complexity-targets", 2, size=(8.6, 4.4), sharey=True) as (drawn, axes):
        titles = ("In one line, neighbours' gates overlap", "In groups of four")
        for ax, points, title in zip(axes, (ABREAST, GROUPS), titles, strict=True):
            x = np.array([point.targets for point in points], float)
            for way in WAYS:
                _line(ax, x, [results[point] for point in points], way)
            ax.set(
                xscale="log",
                yscale="log",
                ylim=(1e-3, 1e6),
                xlabel="targets (dashed: from the count of events)",
                title=title,
            )
            ax.xaxis.set_major_formatter("{x:g}")
            ax.set_xticks([2, 4, 8, 16, 32, 64, 128] if points is ABREAST else [4, 8, 16, 32, 64, 128])
            ax.minorticks_off()
            _turn(ax, 128.0, "right")
        axes[0].set_ylabel("processor time of a scan, ms")
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def draw_overlap(work: Work, results: Results) -> None:
    """Time and the error of propagation against the spacing of neighbours."""
    with figure(work, "complexity-overlap", 2, size=(8.6, 4.4)) as (drawn, (left, right)):
        x, n = np.array(SPACINGS), CROWDS[0]
        for way in WAYS:
            _line(left, x, [results[Point("abreast", n, spacing)] for spacing in SPACINGS], way)
        left.set(
            yscale="log",
            ylim=(1e-3, 1e6),
            ylabel="processor time of a scan, ms",
            title=f"{n} targets in a line",
        )
        _turn(left, 2.5)
        for n, colour in zip(CROWDS, (BLUE, INK, GREY), strict=True):
            each = [results[Point("abreast", n, spacing)]["rough"] for spacing in SPACINGS]
            # Where the exact sums took too long in some scans, nothing is known of the whole.
            quarters = np.array([np.quantile(values, (0.5, 0.25, 0.75)) for values in each])
            middle, low, high = np.maximum(quarters.T, 1e-12)
            right.plot(x, middle, "o-", color=colour, ms=4, label=f"{n} targets")
            right.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
        right.set(yscale="log", ylim=(1e-6, 1.0), ylabel="largest error, median and quartiles")
        right.set_title("Error of belief propagation")
        right.legend(loc="lower right")
        for ax in (left, right):
            ax.set(xscale="log", xlim=(2.8, 0.045), xlabel="spacing, radii of a gate (closer to the right)")
            ax.set_xticks([2, 1, 0.5, 0.2, 0.1, 0.05], ["2", "1", "0.5", "0.2", "0.1", "0.05"])
            ax.minorticks_off()
        drawn.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _line(ax: Axes, x: Array, each: Sequence[Arrays], way: str) -> None:
    """Medians of the times, ms; dashed from where events were only counted, at the time of an event."""
    colour, look = _LOOKS[way]
    wide = 2.4 if way == "all" else 1.5  # where there is one cluster, the line of clusters lies on it
    taken = [one[way] for one in each]
    if way in ("all", "clusters"):
        taken = [_estimated(one[way], one["events_" + way], each, way) for one in each]
    middle = 1e3 * np.array([np.median(values) for values in taken])
    done = np.cumsum([not np.isfinite(one[way]).all() for one in each]) == 0
    ax.plot(x[done], middle[done], look, color=colour, ms=4, lw=wide, label=_TITLES[way])
    rest = np.arange(len(x)) >= max(int(done.sum()) - 1, 0)
    if not done.all():
        ax.plot(x[rest], middle[rest], "--", color=colour, lw=wide - 0.3)


def _estimated(taken: Array, count: Array, each: Sequence[Arrays], way: str) -> Array:
    """Times (runs,), s; where there is none, the count times the time of an event of this figure's points."""
    times, counts = (np.concatenate([one[name] for one in each]) for name in (way, "events_" + way))
    known = np.isfinite(times) & (counts >= min(1e4, np.nanmax(counts[np.isfinite(times)])))
    return np.where(np.isfinite(taken), taken, count * np.median(times[known] / counts[known]))


def _turn(ax: Axes, at: float, align: str = "left") -> None:
    """The time that there is."""
    ax.axhline(4e3, color=INK, lw=1.0, ls=(0, (1, 2)), zorder=1)
    ax.text(at, 5e3, "a turn of the antenna, 4 s", color=INK, fontsize=8.5, ha=align, va="bottom")
