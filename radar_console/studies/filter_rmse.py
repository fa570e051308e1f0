"""Accuracy of EKF, UKF, IMM and particle filters on a manoeuvring target.

The paper, section 3.2.3, figure 17 and table 2: one target on a complex trajectory, which is shown as a
picture only, measured in (x, y) with Gaussian noise "σ² = 100 m". RMSE = sqrt(mean |estimate − truth|²).
Published: EKF 186.366 m, UKF 186.366 m, particle filter 135.357 m, hence particle filter / EKF 0.726.

With σ = 100 m in each axis the raw measurements have RMSE 141.4 m: the published EKF is worse than no filter,
and a Kalman filter alone gives either figure with some setting of its process noise σ_a. So the pair can't be
traced to one setting, and the fair question is what a filter gains over the *best* Kalman filter, on
trajectories that favour nobody.

Trajectories: E3REC (a reconstruction of figure 17), FIGHTER, AIRLINER, and RANDOM, another one in each run;
see `trajectories`. Scans every 4 s, also 2 and 1; σ = 100 m, also 10 m, also polar with 50 m and 0.1°.
Filters, all started from two scans and scored from the second scan after those, over runs and time:

- Kalman filter (KF) of nearly constant velocity. The measurement is linear, so the EKF and the UKF are the
  KF: what they linearise or sample is linear already. σ_a on a grid: *best* is the σ_a of the least RMSE on
  the very runs that are scored, which favours it; *nominal* is σ_a = 3 m/s².
- IMM of constant velocity (0.1 m/s²) and constant acceleration (10 m/s² a scan), switching with 0.02 a scan;
  IMM3 has a coordinated turn beside these.
- RBPF, the Rao-Blackwellised particle filter of `estimation/rao_blackwell.py`, 500 particles, one setting for
  all cases, chosen on other random trajectories than those scored, and on the others with other noise.
- Bootstrap particle filter with regimes, 500 and 5,000 particles, on a fifth of the runs: fragile.
- Particle filters with a single model, σ_a = 10 m/s², on truth from that model: they go to the KF as they
  grow.

Running time: 200 runs take some five minutes on one core.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval, root_mean_square
from radar_console.studies import filter_figures as figures
from radar_console.studies import filter_runs as filters
from radar_console.studies.filter_runs import CASES, GRID, NOMINAL, Case
from radar_console.studies.findings import Finding, beside, found, within
from radar_console.studies.work import Arrays, Part, Work, chunks, generator

RUNS = 200
EKF, PF = 186.366, 135.357
"""Published RMSE, m, of the EKF and the UKF, and of the particle filter."""

_CHUNK = 25  # runs of a part
_PARTICLES = 500
_SEED_OF_BOUNDS = 9
_NOMINAL = int(np.flatnonzero(GRID == NOMINAL)[0])


class Expected(NamedTuple):
    """Ratios of RMSE known from an earlier program: a value, or bounds that a good filter is to reach."""

    imm: float
    rbpf: float
    rbpf_nominal: float
    imm_bounds: tuple[float, float] | None = None
    rbpf_bounds: tuple[float, float] | None = None
    best_bounds: tuple[float, float] | None = None


EXPECTED = {
    "RANDOM 4 s": Expected(0.817, 0.719, 0.633),
    "E3REC 4 s": Expected(0.736, 0.668, 0.573, (0.71, 0.76), (0.64, 0.70), (120.0, 127.0)),
    "FIGHTER 4 s": Expected(0.862, 0.783, 0.525, None, (0.76, 0.81)),
    "AIRLINER 4 s": Expected(0.921, 0.876, 0.876, None, (0.85, 0.90)),
    "RANDOM 2 s": Expected(0.777, 0.679, 0.506),
    "E3REC 2 s": Expected(0.732, 0.622, 0.444),
    "E3REC 1 s": Expected(0.695, 0.608, 0.348),
    "E3REC 4 s, polar": Expected(0.724, 0.674, 0.595),
    "E3REC 4 s, σ = 10 m": Expected(0.709, 0.703, 0.680),
    "FIGHTER 4 s, σ = 10 m": Expected(0.843, 0.810, 0.727),
}
_MATCHED = {("prior", 100): 1.46, ("prior", 1_000): 1.023, ("prior", 10_000): 1.002,
            ("optimal", 100): 1.083, ("optimal", 1_000): 1.010, ("optimal", 10_000): 1.0015}  # fmt: skip
_FRAGILE = (Case("FIGHTER"), Case("E3REC", polar=(50.0, 0.1)))


def run(work: Work) -> list[Finding]:
    """Make all runs; the findings, the headline first."""
    runs, fifth = chunks(work.runs, _CHUNK), chunks(max(work.runs // 5, 2), _CHUNK)
    plan = {
        case.name: [
            Part(filters.compare, (case, each, work.seed, _PARTICLES), _cost(case, each)) for each in runs
        ]
        for case in CASES
    }
    plan["linear"] = [Part(filters.linear_case, (each, work.seed), 0.3 * len(each)) for each in runs]
    for count in filters.MATCHED_COUNTS:
        parts = [Part(filters.matched, (count, each, work.seed), 3e-5 * count * len(each)) for each in runs]
        plan[f"matched {count}"] = parts
    for case in _FRAGILE:
        for count in filters.BOOTSTRAP:
            plan[f"bootstrap {count} {case.name}"] = [
                Part(filters.bootstrap_regimes, (case, count, each, work.seed), 4e-5 * count * len(each))
                for each in fifth
            ]
    done = iter(work.do("filter-rmse", [part for parts in plan.values() for part in parts]))
    results = {name: _together([next(done) for _ in parts]) for name, parts in plan.items()}

    scores = [Score.of(case, results[case.name], work.seed) for case in CASES]
    convergence = _convergence(results, work.seed)
    figures.curve(work, scores, EKF, PF)
    figures.ratios(work, scores, PF / EKF)
    figures.flight(work, scores[1], work.runs)
    figures.convergence(work, convergence)
    return [
        *_headline(scores[0]),
        *_published(scores[1]),
        *_equal(results["linear"], work.runs),
        *(finding for score in scores for finding in _ratios(score)),
        *_matched(convergence),
        *_fragile(results, work.seed),
    ]


def _cost(case: Case, runs: range) -> float:
    seconds = 560.0 if case.trajectory != "E3REC" else 1_100.0
    return len(runs) * seconds / case.T / 2_500.0


def _together(parts: Sequence[Arrays]) -> Arrays:
    """Runs one after another on the last axis; what is by scan is summed."""
    names = parts[0].keys()
    return {
        name: sum(part[name] for part in parts)  # type: ignore[misc]
        if name.endswith("_time")
        else np.concatenate([part[name] for part in parts], axis=-1)
        for name in names
    }


class Score(NamedTuple):
    """A case over all runs: RMSE, m, and ratios of RMSE, paired by run.

    Attributes
    ----------
    curve : (grid,) RMSE of the Kalman filters, m
    best : number of the best of them in the grid
    rmse : by filter: kf (the best), nominal, imm, imm3, rbpf, raw
    ratio : by filter and opponent, as in ``ratio["rbpf", "kf"]``
    time : by filter, squared errors, m², summed over the runs by scan
    """

    case: Case
    curve: Array
    best: int
    rmse: dict[str, Interval]
    ratio: dict[tuple[str, str], Interval]
    time: dict[str, Array]

    @classmethod
    def of(cls, case: Case, result: Arrays, seed: int) -> "Score":
        """From mean squared errors by run."""
        curve = np.sqrt(result["kf"].mean(axis=-1))
        best = int(np.argmin(curve))
        mse = {name: result[name] for name in ("imm", "imm3", "rbpf", "raw")}
        mse |= {"kf": result["kf"][best], "nominal": result["kf"][_NOMINAL]}
        by_run = {name: np.sqrt(values) for name, values in mse.items()}
        rng = generator(seed, _SEED_OF_BOUNDS)
        rmse = {
            name: intervals.bootstrap(root_mean_square, values, rng=rng) for name, values in by_run.items()
        }
        opponents = ("kf", "nominal", "imm", "imm3")
        pairs = [(ours, other) for ours in ("imm", "imm3") for other in opponents[:2]]
        pairs += [("rbpf", other) for other in opponents]
        ratio = {
            (ours, other): intervals.paired_ratio(by_run[ours], by_run[other], rng, root_mean_square)
            for ours, other in pairs
        }
        time = {name: result[f"{name}_time"] for name in ("imm", "rbpf", "raw")}
        return cls(case, curve, best, rmse, ratio, time | {"kf": result["kf_time"][:, best]})

    @property
    def expected(self) -> Expected:
        """What is known of the case."""
        return EXPECTED[self.case.name]


def _headline(score: Score) -> list[Finding]:
    ratio, reference = score.ratio["rbpf", "kf"], score.expected.rbpf
    verdict = f"headline; {beside(ratio, reference)}"
    return [found("RBPF / best KF, RANDOM 4 s (headline)", "", ratio, verdict, round(PF / EKF, 3))]


def _published(score: Score) -> list[Finding]:
    """The published pair, beside the same case here and on the curve RMSE against σ_a."""
    name, runs = score.case.name, score.rmse["kf"].runs
    not_traced = "not traced: the paper does not say what it was measured with"
    rows = [
        found(f"EKF, σ_a = 3, {name}", "m", score.rmse["nominal"], not_traced, EKF),
        found(
            f"UKF, σ_a = 3, {name}",
            "m",
            score.rmse["nominal"],
            f"{not_traced}; equal to the EKF, as here",
            EKF,
        ),
        found(
            f"particle filter (RBPF), {name}", "m", score.rmse["rbpf"], "lower, as all that know regimes", PF
        ),
        found(f"no filter, {name}", "m", score.rmse["raw"], "below the published EKF"),
    ]
    for published, of in ((EKF, "EKF"), (PF, "particle filter")):
        for sigma in crossings(GRID, score.curve, published):
            quantity = f"σ_a at which the KF has the {of}'s {published:g} m, {name}"
            verdict = "a KF alone gives the published figure"
            rows.append(Finding(quantity, "m/s²", None, sigma, None, None, runs, verdict))
    return rows


def crossings(sigma: Array, curve: Array, level: float) -> list[float]:
    """Where a curve over `sigma` takes the value `level`, between its points on a logarithmic scale."""
    above = curve > level
    at = np.flatnonzero(above[1:] != above[:-1])
    x, y = np.log(sigma), np.log(curve)
    part = (np.log(level) - y[at]) / (y[at + 1] - y[at])
    result: list[float] = np.exp(x[at] + part * (x[at + 1] - x[at])).tolist()
    return result


def _equal(result: Arrays, runs: int) -> list[Finding]:
    """EKF and UKF against the KF."""
    why = (
        "motion and measurement are linear: nothing to linearise, and sigma points carry both moments exactly"
    )
    rows = []
    for name in ("ekf", "ukf"):
        largest = float(result[name].max())
        verdict = f"{'equal' if largest < 1e-8 else 'not equal'} to 1e-8 m; {why}"
        quantity = f"largest |{name.upper()} − KF|, E3REC 4 s"
        rows.append(Finding(quantity, "m", 0.0, largest, None, None, runs, verdict))
    return rows


def _ratios(score: Score) -> list[Finding]:
    """Best Kalman filter, and every filter against both opponents."""
    name, expected, ratio = score.case.name, score.expected, score.ratio
    sigma = f"{GRID[score.best]:g}"
    nominal = float(score.rmse["nominal"].value)
    best = f"at σ_a = {sigma}; nominal σ_a = 3: {nominal:.1f} m"
    if expected.best_bounds:
        best = f"{within(float(score.rmse['kf'].value), *expected.best_bounds)}, {best}"
    imm = ratio["imm", "kf"]
    judged = (
        within(float(imm.value), *expected.imm_bounds) if expected.imm_bounds else beside(imm, expected.imm)
    )
    rbpf = ratio["rbpf", "kf"]
    bounds = expected.rbpf_bounds
    verdict = within(float(rbpf.value), *bounds) if bounds else beside(rbpf, expected.rbpf)
    published = None
    if name == "E3REC 4 s":
        side = "below" if rbpf.high < PF / EKF else "not below"
        verdict = f"{verdict}; upper bound {side} the published {PF / EKF:.3f}"
        published = round(PF / EKF, 3)
    over, turning = ratio["rbpf", "imm"], ratio["rbpf", "imm3"]
    sure = {-1.0: "better than the {}", 0.0: "not told from the {}", 1.0: "worse than the {}"}
    return [
        found(f"best KF, {name}", "m", score.rmse["kf"], best),
        found(f"IMM / best KF, {name}", "", imm, judged),
        found(f"IMM / KF σ_a = 3, {name}", "", ratio["imm", "nominal"], "against the nominal opponent"),
        found(f"IMM3 / best KF, {name}", "", ratio["imm3", "kf"], "against the best opponent"),
        found(f"IMM3 / KF σ_a = 3, {name}", "", ratio["imm3", "nominal"], "against the nominal opponent"),
        found(f"RBPF / best KF, {name}", "", rbpf, verdict, published),
        found(f"RBPF / KF σ_a = 3, {name}", "", ratio["rbpf", "nominal"],
              beside(ratio["rbpf", "nominal"], expected.rbpf_nominal)),
        found(f"RBPF / IMM, {name}", "", over, sure[float(over.beyond(1.0))].format("IMM")),
        found(f"RBPF / IMM3, {name}", "", turning, sure[float(turning.beyond(1.0))].format("IMM3")),
    ]  # fmt: skip


def _convergence(results: dict[str, Arrays], seed: int) -> dict[tuple[str, int], Interval]:
    """PF / KF by proposal and number of particles, where the truth is the model's."""
    rng = generator(seed, _SEED_OF_BOUNDS, 1)
    return {
        (name, count): intervals.paired_ratio(
            np.sqrt(results[f"matched {count}"][name]),
            np.sqrt(results[f"matched {count}"]["kf"]),
            rng,
            root_mean_square,
        )
        for name in ("prior", "optimal")
        for count in filters.MATCHED_COUNTS
    }


def _matched(ratios: dict[tuple[str, int], Interval]) -> list[Finding]:
    rows = []
    for (name, count), ratio in ratios.items():
        verdict = beside(ratio, _MATCHED[name, count])
        if (name, count) == ("optimal", 10_000):
            side = "below" if ratio.value < 1.005 else "not below"
            verdict = f"{side} 1.005: the particle filter has gone to the Kalman filter"
        rows.append(found(f"PF / KF, {name} proposal, N = {count:,}, matched truth", "", ratio, verdict))
    return rows


def _fragile(results: dict[str, Arrays], seed: int) -> list[Finding]:
    """The bootstrap filter with regimes: what is lost where everything is drawn."""
    rng = generator(seed, _SEED_OF_BOUNDS, 2)
    rows = []
    for case in _FRAGILE:
        for count in filters.BOOTSTRAP:
            result = results[f"bootstrap {count} {case.name}"]
            rmse = intervals.bootstrap(root_mean_square, np.sqrt(result["bootstrap"]), rng=rng)
            gone = result["last"] > filters.LOST
            said = "fragile: loses targets" if gone.any() else "loses none here"
            what = f"bootstrap regime PF, N = {count:,}, {case.name}"
            rows += [
                found(what, "m", rmse, said),
                found(f"{what}: lost", "", intervals.proportion(gone), "more than 1 km off at the end"),
            ]
    return rows
