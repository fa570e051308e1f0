"""Twenty-five targets in clutter, in both readings of its density.

The paper, section 3.2.2, figures 15 and 16 and the table of 25 targets: thirteen from 250 km and twelve from
150 km fly toward the radar at 800 km/h for 8 minutes, tracked with JPDA and a particle filter. Around each
target, at each moment, there are false ones by a Poisson law, "radius 15 km² has 5 noise targets". Published:
one picture, and the claim that trajectories are held. No figures; turn, noise and detection are not given.

That can be read as 5 in a radius of 15 km, or as 5 in 15 km², which is 47 times as dense: the scenarios
`twenty-five` and `twenty-five-dense`. Raw returns, 4 s a turn, beam 1.5°. At 200 km the beam is 5 km wide,
so in the dense reading most false echoes merge with the target's. Both are scored once a second:

- a target is held while a track is within 2 km of it; it is lost if it was held, and is not in its last 40 s;
- a false track is near no target for most of its life;
- GOSPA has c = 5 km, p = 2: a missed target and a false track cost 3.5 km each, in quadrature.

Running time: 100 runs of both take some twenty minutes on one core.
"""

from collections.abc import Mapping

import numpy as np

from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.studies import scenario_runs
from radar_console.studies.drawing import BLUE, GREY, RED, figure
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Arrays, Work, generator

RUNS = 100
READINGS = {
    "twenty-five": "5 in a radius of 15 km",
    "twenty-five-dense": "5 in 15 km²",
}
_COLOURS = {"twenty-five": BLUE, "twenty-five-dense": RED}
_TARGETS, _EVERY = 25, 4.0  # s between the instants of the curves
_TOGETHER = 8  # instants of a mean where there is little to count
_FIGURES = (
    # name, what, unit
    ("held", "targets held at some time, of 25", ""),
    ("time_to_confirm_s", "time to confirm", "s"),
    ("continuity", "continuity", ""),
    ("false_tracks", "false tracks a run", ""),
    ("gospa_m", "GOSPA", "m"),
    ("rmse_position_m", "RMSE of position", "m"),
)
_EVENTS = (
    ("swaps", "runs with a swap"),
    ("lost", "runs with a lost target"),
    ("false_tracks", "runs with a false track"),
    ("duplicate_tracks", "runs with a second track of a target"),
)


def run(work: Work) -> list[Finding]:
    """Make all runs; the findings of one reading, then of the other."""
    results = scenario_runs.several(work, "twenty-five", list(READINGS))
    draw(work, results)
    return [row for name, result in results.items() for row in _findings(name, result, work.seed)]


def _findings(name: str, result: Arrays, seed: int) -> list[Finding]:
    # Resampled, for most of these have a bound at which they crowd.
    rng = generator(seed, 0)
    figures = {
        metric: intervals.bootstrap(intervals.average, result[metric], rng=rng) for metric, _, _ in _FIGURES
    }
    reading = READINGS[name]
    rows = [
        found(f"{what}, {reading}", unit, figures[metric], _verdict(metric, result))
        for metric, what, unit in _FIGURES
    ]
    for metric, what in _EVENTS:
        values = result[metric]
        total = f"{values.sum():,.0f} in {len(values):,} runs of {_TARGETS} targets"
        rows.append(found(f"{what}, {reading}", "", intervals.proportion(values > 0), total))
    return rows


def _verdict(metric: str, result: Arrays) -> str:
    """What a figure says to the paper's claim that trajectories are held; it has no figures itself."""
    values = result[metric]
    if metric == "held":
        lacking = int((values < _TARGETS).sum())
        return "every target in every run" if not lacking else f"not all of them in {_of(lacking, values)}"
    if metric == "continuity":
        worst = result["target_continuity"].mean(axis=1).min()
        after = 1.0 - result["time_to_confirm_s"].mean() / (_EVERY * (len(result["time_held"]) - 1))
        return f"{after:.3f} if none were let go once confirmed; the worst target has {worst:.3f}"
    if metric == "time_to_confirm_s":
        slow = np.nanquantile(result["target_time_to_confirm"], 0.95)
        return f"{values.mean() / 4.0:.1f} turns; 95 % of the targets within {slow:.0f} s"
    if metric == "false_tracks":
        return f"{values.max():.0f} at most in a run"
    if metric == "gospa_m":
        parts = {part: result[f"gospa_{part}_m"] ** 2 for part in ("location", "missed", "false")}
        whole = sum(each.mean() for each in parts.values())
        shares = ", ".join(f"{part} {each.mean() / whole:.0%}" for part, each in parts.items())
        return f"of its square: {shares}"
    return "of targets while they have a track"


def _of(count: int, values: np.ndarray) -> str:
    return f"{count:,} of {len(values):,} runs"


def draw(work: Work, results: Mapping[str, Arrays]) -> None:
    """Targets held, false tracks and GOSPA over time, with bands of 95 %."""
    panels = (
        ("time_held", "targets held", "Held"),
        ("time_false", "other tracks, means of 32 s", "False and second tracks"),
        ("time_gospa", "GOSPA, km", "GOSPA, c = 5 km"),
    )
    with figure(work, "twenty-five-clutter", 3, size=(9.6, 3.7)) as (drawn, axes):
        for ax, (name, label, title) in zip(axes, panels, strict=True):
            scale = 1e-3 if name == "time_gospa" else 1.0
            for reading, result in results.items():
                values, time = _over(scale * result[name], _TOGETHER if name == "time_false" else 1)
                each = intervals.mean(values)
                most = _TARGETS if name == "time_held" else np.inf
                ax.fill_between(time, *_bounds(each, most), color=_COLOURS[reading], alpha=0.22, lw=0)
                ax.plot(time, each.value, color=_COLOURS[reading], label=READINGS[reading], lw=1.3)
            ax.set(
                xlabel="time, min",
                ylabel=label,
                title=title,
                xlim=(0, _EVERY * (len(result[name]) - 1) / 60.0),
                ylim=(0, None),
            )
        axes[0].axhline(_TARGETS, color=GREY, lw=1.0, ls=(0, (5, 3)), zorder=1)
        axes[0].set_ylim(0, 26)
        runs = next(iter(results.values()))["held"].shape[-1]
        handles, labels = axes[0].get_legend_handles_labels()
        drawn.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=2,
            title=f"clutter around each target, {runs} runs",
        )


def _over(values: np.ndarray, together: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of so many instants of a curve (instants, runs), and their times, min."""
    whole = len(values) // together
    means = values[: whole * together].reshape(whole, together, -1).mean(axis=1)
    return means, _EVERY * (together * np.arange(whole) + 0.5 * (together - 1)) / 60.0


def _bounds(each: Interval, most: float) -> tuple[np.ndarray, np.ndarray]:
    return np.maximum(each.low, 0.0), np.minimum(each.high, most)
