"""Four resampling schemes, from 100 to 10,000 particles.

The paper, section 2.1.3, resamples systematically (2.39 to 2.43) where N_eff (2.37) is small, and gives no
figures: nothing here is published. Asked is what the choice is worth beside the number of particles. Schemes:
systematic, stratified, residual, multinomial (Douc, Cappé, Moulines, Comparison of resampling schemes for
particle filtering, 2005).

One target of nearly constant velocity, σ_a = 3 m/s², measured every 4 s with σ = 100 m in each axis, 40
scans after two-point initiation, scored from the second of them; the bootstrap filter knows the model, draws
from the prior and resamples at every scan. All schemes get the same truths, measurements and seeds. Given:

- RMSE over the Kalman filter's, which is the least there is: 1 is perfect;
- N_eff / N = 1 / (N Σ w²) before resampling;
- survivors: which part of the particles has at least one copy;
- scatter: how far resampling moves the cloud's mean, rms, over its own standard deviation and times √N. It is
  what a scheme adds to the error; 0 is perfect, and multinomial sampling has 1.

Running time: 100 runs take about two minutes on one core.
"""

import numpy as np

from radar_console.estimation import measurement, motion, samples
from radar_console.estimation.gaussian import Array, Gaussian, root
from radar_console.estimation.samples import RESAMPLING
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval, root_mean_square
from radar_console.studies import filter_runs
from radar_console.studies.drawing import figure
from radar_console.studies.filter_runs import Measured
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Arrays, Part, Work, chunks, generator

RUNS = 100
COUNTS = (100, 300, 1_000, 3_000, 10_000)
_SCANS, _T, _SIGMA, _SD = 40, 4.0, 3.0, 100.0
_CHUNK = 25  # runs of a part
_TRUTH, _FILTER, _BOUNDS = range(3)
_Ratios = dict[tuple[str, int], Interval]


def run(work: Work) -> list[Finding]:
    """Make all runs; the findings by scheme and number of particles."""
    runs = chunks(work.runs, _CHUNK)
    plan = [(scheme, count) for count in COUNTS for scheme in RESAMPLING]
    parts = [
        Part(filter_with, (scheme, count, each, work.seed), count * len(each) / 25_000)
        for scheme, count in plan
        for each in runs
    ]
    done = iter(work.do("resampling", parts))
    results = {
        key: {
            name: np.concatenate([part[name] for part in own])
            for own in [[next(done) for _ in runs]]
            for name in own[0]
        }
        for key in plan
    }
    rng = generator(work.seed, _BOUNDS)
    ratio: _Ratios = {
        key: intervals.paired_ratio(
            np.sqrt(result["error"]), np.sqrt(result["kalman"]), rng, root_mean_square
        )
        for key, result in results.items()
    }
    mean: dict[str, _Ratios] = {
        name: {key: intervals.mean(result[name]) for key, result in results.items()}
        for name in ("effective", "survivors", "scatter")
    }
    draw(work, ratio, mean)
    return findings(ratio, mean, results, rng)


def filter_with(scheme: str, count: int, runs: range, seed: int) -> Arrays:
    """One scheme on some runs: by run, mean squared errors, m², and means over the scans."""
    seen = _measure(runs, seed)
    first = filter_runs.start(seen, _T)
    model = motion.linear(*_model())
    sensing = measurement.position(seen.R)
    rng = generator(seed, _FILTER, runs.start)
    cloud, filtered = samples.draw(first, count, rng), []
    effective, survivors, scatter = [], [], []
    for k in range(2, len(seen.z)):
        cloud, _ = samples.update(samples.predict(cloud, model, rng), seen.z[k], sensing)
        before = _spread(cloud)
        filtered.append(before.mean)
        effective.append(samples.effective_size(cloud) / count)
        cloud = samples.resample(cloud, rng, RESAMPLING[scheme], below=np.inf)
        survivors.append(_distinct(cloud.states[..., 0]) / count)
        moved = cloud.states[..., :2].mean(axis=0) - before.mean
        variance = np.diagonal(before.cov, axis1=-2, axis2=-1)
        scatter.append(count * np.mean(moved**2 / variance, axis=-1))
    kalman = filter_runs.kalman_filters(seen, _T, np.array([_SIGMA]))[:, 0]
    return {
        "error": filter_runs.squared(np.stack(filtered), seen).mean(axis=0),
        "kalman": filter_runs.squared(kalman, seen).mean(axis=0),
        "effective": np.mean(effective, axis=0),
        "survivors": np.mean(survivors, axis=0),
        "scatter": np.sqrt(np.mean(scatter, axis=0)),
    }


def _model() -> tuple[Array, Array]:
    return motion.constant_velocity(_T, _SIGMA**2, piecewise=True)


def _measure(runs: range, seed: int) -> Measured:
    F, Q = _model()
    L = root(Q)
    truth, z = [], []
    for run in runs:
        rng = generator(seed, _TRUTH, run)
        states = [np.array([0.0, 0.0, 200.0, 0.0])]
        for _ in range(_SCANS + 1):
            states.append(F @ states[-1] + L @ rng.standard_normal(4))
        truth.append(np.array(states)[:, :2])
        z.append(truth[-1] + _SD * rng.standard_normal(truth[-1].shape))
    return Measured(np.stack(truth, axis=1), np.stack(z, axis=1), _SD**2 * np.eye(2))


def _spread(cloud: samples.Samples) -> Gaussian:
    """Mean and covariance of the positions."""
    return samples.estimate(samples.Samples(cloud.states[..., :2], cloud.log_weights))


def _distinct(east: Array) -> Array:
    """How many particles (N, ...) are no copy of another: copies stand together, and others differ."""
    count: Array = 1.0 + np.count_nonzero(np.diff(east, axis=0), axis=0)
    return count


def findings(
    ratio: _Ratios, mean: dict[str, _Ratios], results: dict[tuple[str, int], Arrays], rng: np.random.Generator
) -> list[Finding]:
    """All figures, the accuracy first; each scheme is judged beside multinomial resampling.

    The verdicts on the accuracy are so sure that all of them together hold with 95 % (Bonferroni).
    """
    level = 1.0 - 0.05 / (3 * len(COUNTS))
    said = {-1.0: "better than multinomial", 0.0: "not told from multinomial", 1.0: "worse than multinomial"}
    rows = []
    for scheme, count in ratio:
        ours, other = (np.sqrt(results[each, count]["error"]) for each in (scheme, "multinomial"))
        against = intervals.paired_ratio(ours, other, rng, root_mean_square, level)
        verdict = "the plainest" if scheme == "multinomial" else said[float(against.beyond(1.0))]
        rmse = intervals.bootstrap(root_mean_square, ours, rng=rng)
        rows += [
            found(f"RMSE, {scheme}, N = {count:,}", "m", rmse, verdict),
            found(f"RMSE / KF, {scheme}, N = {count:,}", "", ratio[scheme, count], verdict),
        ]
    for name, what in (
        ("effective", "N_eff / N"),
        ("survivors", "survivors / N"),
        ("scatter", "scatter of the mean"),
    ):
        for (scheme, count), value in mean[name].items():
            plain = mean[name]["multinomial", count]
            apart = value.low > plain.high or value.high < plain.low
            side = "more than" if value.value > plain.value else "less than"
            verdict = "the plainest" if scheme == "multinomial" else f"{side if apart else 'as'} multinomial"
            rows.append(found(f"{what}, {scheme}, N = {count:,}", "", value, verdict))
    return rows


def draw(work: Work, ratio: _Ratios, mean: dict[str, _Ratios]) -> None:
    """Accuracy, N_eff and scatter against the number of particles."""
    with figure(work, "resampling", 3, size=(9.6, 3.8)) as (drawn, axes):
        panels = (
            (ratio, "RMSE above the KF's, %", "Accuracy"),
            (mean["effective"], r"$N_\mathrm{eff}$ / N before resampling", "Weights"),
            (mean["scatter"], "√N · shift of the mean / its deviation", "What resampling adds"),
        )
        for ax, (figures, label, title) in zip(axes, panels, strict=True):
            for number, scheme in enumerate(RESAMPLING):
                each = [figures[scheme, count] for count in COUNTS]
                value, low, high = (
                    np.array(list(column), float) for column in list(zip(*each, strict=True))[:3]
                )
                if figures is ratio:
                    value, low, high = (
                        np.maximum(100.0 * (bound - 1.0), 0.02) for bound in (value, low, high)
                    )
                # Side by side, so that intervals of equal figures do not hide one another.
                at = np.array(COUNTS) * 1.09 ** (number - 1.5)
                marker = "osD^"[number]
                ax.errorbar(
                    at, value, [value - low, high - value], fmt=f"{marker}-", ms=4, lw=1.0, label=scheme
                )
            ax.set(xscale="log", xlabel="particles N", ylabel=label, title=title)
            ax.xaxis.set_major_formatter("{x:,.0f}")
        axes[0].set_yscale("log")
        axes[0].yaxis.set_major_formatter("{x:g}")
        axes[1].set_ylim(0, None)
        axes[2].set_ylim(0, None)
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
