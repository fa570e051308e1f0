"""GOSPA and its parts against the density of clutter, for four associators.

The paper praises JPDA beside GNN in clutter (section 3.2.3) with one run at one density and no metric, so
nothing here is published. Asked is how the whole picture, all targets at once, gets worse as clutter grows,
and which part of it: where targets are, targets without a track, or tracks without a target.

Six targets on random straight courses, 150 to 300 m/s, another set in each run, all within a square of 12
km, 100 km away, in the middle of two minutes: 30 scans of 4 s, σ = 50 m, P_D 0.9, clutter of 0.03 to 2 per
km² in discs of 3 km about each. The tracks of the first scan are given, and initiation is at work: a target
that was lost may get a new track, and false tracks may start. The trackers have the console's defaults,
particle filter and all, know the clutter's density, and get the same plots: JPDA, PDA (each track by
itself), GNN and nearest neighbour (NN). Scored from the sixth scan: GOSPA with p = 2, α = 2 and c = 1 km,
root of the mean square over the scans, whose squared parts add up (Rahmathullah et al., 2017); OSPA's mean
beside it.

Running time: 100 runs take some six minutes on one core.
"""

from collections.abc import Mapping

import numpy as np

from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval, root_mean_square
from radar_console.studies import clutter_runs
from radar_console.studies.clutter_runs import FIGURES, TRACKERS
from radar_console.studies.drawing import BLUE, GREY, RED, SKY, figure
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Arrays, Part, Work, chunks, generator

RUNS = 100
DENSITIES = (0.03, 0.1, 0.3, 1.0, 2.0)
_CHUNK = 5  # runs of a part
_BOUNDS = 2
_GOSPA = ("gospa_rms_m", "gospa_location_m", "gospa_missed_m", "gospa_false_m")
_TITLES = {
    "gospa_rms_m": "GOSPA",
    "gospa_location_m": "its location part",
    "gospa_missed_m": "its missed part",
    "gospa_false_m": "its false part",
    "ospa_m": "OSPA",
    "lost": "lost targets a run",
    "false_tracks": "false tracks a run",
}
_LOOKS = {"NN": (GREY, "^:"), "GNN": (RED, "s-"), "PDA": (SKY, "D:"), "JPDA": (BLUE, "o-")}
Results = dict[float, Arrays]
"""By density: by figure, (trackers, runs)."""


def run(work: Work) -> list[Finding]:
    """Play all densities; the findings, JPDA beside the others first."""
    parts = [
        Part(clutter_runs.play, (density, each, work.seed), len(each) * (0.5 + density**2))
        for density in DENSITIES
        for each in chunks(work.runs, _CHUNK)
    ]
    done = iter(work.do("ospa-clutter", parts))
    results: Results = {}
    for density in DENSITIES:
        own = [next(done) for _ in chunks(work.runs, _CHUNK)]
        results[density] = {name: np.concatenate([part[name] for part in own], axis=1) for name in FIGURES}
    rng = generator(work.seed, _BOUNDS)
    figures = {
        (name, density): _interval(name, results[density][name], rng)
        for name in FIGURES
        for density in DENSITIES
    }
    draw(work, figures)
    return findings(results, figures, rng)


def _interval(name: str, values: Array, rng: np.random.Generator) -> Interval:
    """Over all runs: of parts of GOSPA the root of the mean square, of others the mean."""
    statistic = root_mean_square if name in _GOSPA else intervals.average
    return intervals.bootstrap(statistic, values, rng=rng)


def findings(
    results: Results, figures: Mapping[tuple[str, float], Interval], rng: np.random.Generator
) -> list[Finding]:
    """Ratios on the same runs, then every figure."""
    rows, names = [], list(TRACKERS)
    jpda = names.index("JPDA")
    for other in (name for name in names if name != "JPDA"):
        for density in DENSITIES:
            values = results[density]["gospa_rms_m"]
            ratio = intervals.paired_ratio(values[jpda], values[names.index(other)], rng, root_mean_square)
            verdict = {-1.0: "JPDA better", 0.0: "not told apart", 1.0: f"{other} better"}[
                float(ratio.beyond(1.0))
            ]
            rows.append(found(f"GOSPA, JPDA / {other}, {density:g}/km²", "", ratio, verdict))
    for (name, density), every in figures.items():
        least = every.value == np.min(every.value)
        for k, tracker in enumerate(names):
            one = Interval(every.value[k], every.low[k], every.high[k], every.runs)
            verdict = "the least" if least[k] and np.sum(least) == 1 else "as measured"
            unit = "m" if name in (*_GOSPA, "ospa_m") else ""
            rows.append(found(f"{_TITLES[name]}, {tracker}, {density:g}/km²", unit, one, verdict))
    return rows


def draw(work: Work, figures: Mapping[tuple[str, float], Interval]) -> None:
    """GOSPA, and its parts, against the density."""
    runs = figures["gospa_rms_m", DENSITIES[0]].runs
    titles = ("GOSPA", "Location", "Missed targets", "False tracks")
    with figure(work, "ospa-clutter", 4, size=(9.6, 4.2), sharey=True) as (drawn, axes):
        for ax, name, title in zip(axes, _GOSPA, titles, strict=True):
            for k, tracker in enumerate(TRACKERS):
                each = [figures[name, density] for density in DENSITIES]
                columns = list(zip(*each, strict=True))[:3]
                value, low, high = (np.array([bound[k] for bound in column], float) for column in columns)
                colour, look = _LOOKS.get(tracker, ("black", "v-"))
                # Side by side, so that intervals of equal figures do not hide one another.
                at = np.array(DENSITIES) * 1.09 ** (k - 0.5 * (len(TRACKERS) - 1))
                ax.errorbar(
                    at, value, np.abs([value - low, high - value]), fmt=look, color=colour, ms=4, lw=1.2,
                    capsize=2, label=tracker,
                )  # fmt: skip
            ax.set(xscale="log", xlabel="clutter, per km²", title=title, ylim=(0, None))
            ax.set_xticks(DENSITIES, [f"{density:g}" for density in DENSITIES])
            ax.minorticks_off()
        axes[0].set_ylabel(f"m, rms of {runs} runs (c = 1 km)")
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
