"""The IMO's four ARPA test scenes: pass or fail, after one minute and after three.

No paper but a standard: IMO resolution A.823(19), Performance standards for automatic radar plotting aids,
1995, section 3.8 and appendices 2 and 3: own ship steers 000°, a target of given range, bearing and
relative motion is tracked. Within 1 minute of steady tracking its relative course and speed and the CPA
must be known so well, within 3 minutes these, TCPA, true course and true speed, with a probability of 95 %.
Published: these limits.

Scenarios `arpa-1` to `arpa-4`: a radar of 24 turns a minute that moves with own ship, one measurement a
turn with P_D = 0.9. Its errors are appendix 3's, added up as variances and drawn anew at each turn (the
scenarios say how): glint of a ship of 200 m, pulse, beam, backlash, quantisation, encoder, and the sine
part of roll. The tracker has a Kalman filter of nearly constant velocity with little process noise, 1e-4
m²/s³, which suits steady courses and follows a turn late. The particle filter, which is the default
elsewhere, runs on the same measurements.

Steady tracking begins when the target is confirmed. The tracker knows own ship's position exactly; what
appendix 3 says of gyro and log is then laid on it: the gyro is off by ±0.5° and 0.12° rms, the log by ±0.5
kn and 0.07 kn rms, constant in a run, and in scenes 3 and 4 the mean of the roll's bearing error turns the
target by ±0.22°, all signs by lot. That is exact for a filter to which only relative motion matters, as it
is for these. An accuracy passes when the error that 95 % of the runs stay within is no larger than the
limit.

The Cramér-Rao bound says what no unbiased estimate of the relative motion can better with such
measurements.

Running time: 200 runs of the four scenes under both filters take some nine minutes on one core.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from radar_console import scenario
from radar_console.core.encounter import closest_approach, course_and_speed
from radar_console.core.geometry import wrap
from radar_console.core.units import DEG, KT, NM
from radar_console.estimation.gaussian import Array
from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.studies import arpa_figures, arpa_runs
from radar_console.studies.arpa_runs import TIMES
from radar_console.studies.findings import Finding, found
from radar_console.studies.scenario_runs import shipped
from radar_console.studies.work import Arrays, Part, Work, chunks, generator

RUNS = 200
FILTERS = {"kalman": "Kalman filter", "particle": "particle filter"}
QUANTITIES = {
    "relative course": "°",
    "relative speed": "kn",
    "CPA": "NM",
    "TCPA": "min",
    "true course": "°",
    "true speed": "kn",
}
LOST = 999.0
"""The error, in any unit, of a target that has no track."""
_SIZE = 10  # runs of a part
_OWN, _BOUNDS = 0, 1
_PART = 0.95  # of the runs must be within the limits
_TWO_SIDED = 1.96  # standard deviations of a Gaussian, which hold 95 %

# Appendix 3: a calibration error, by lot to either side, and what is normal about it, rms.
_GYRO_DEG, _LOG_KT, _ROLL_DEG = (0.5, 0.12), (0.5, 0.2 / 3.0), 0.22


class Scene(NamedTuple):
    """A scene, and the errors that 95 % of the runs may have at most, by quantity.

    Attributes
    ----------
    rolls : own ship's roll shows at the target's bearing
    minute, three : limits after one minute and after three, in the units of `QUANTITIES`
    """

    name: str
    rolls: bool
    minute: Mapping[str, float]
    three: Mapping[str, float]

    @property
    def limits(self) -> list[tuple[int, str, float]]:
        """Minutes, quantity and limit."""
        both = ((1, self.minute), (3, self.three))
        return [(minutes, what, limit) for minutes, each in both for what, limit in each.items()]


def _limits(*limits: float | None) -> dict[str, float]:
    return {what: limit for what, limit in zip(QUANTITIES, limits, strict=False) if limit is not None}


SCENES = (
    Scene("arpa-1", False, _limits(11, 2.8, 1.6), _limits(3.0, 0.8, 0.5, 1.0, 7.4, 1.2)),
    Scene("arpa-2", False, _limits(7, 0.6), _limits(2.3, 0.3, None, None, 2.8, 0.8)),
    Scene("arpa-3", True, _limits(14, 2.2, 1.8), _limits(4.4, 0.9, 0.7, 1.0, 3.3, 1.0)),
    Scene("arpa-4", True, _limits(15, 1.5, 2.0), _limits(4.6, 0.8, 0.7, 1.0, 2.6, 1.2)),
)


class Score(NamedTuple):
    """A scene under a filter.

    Attributes
    ----------
    errors, exact : by quantity (times, runs), in its unit: with what gyro and log do, and with own ship's
        motion exact
    tracked : (runs,) 1 where the target is tracked at all `TIMES`
    """

    scene: Scene
    errors: dict[str, Array]
    exact: dict[str, Array]
    tracked: Array

    def within(self, what: str) -> Array:
        """(times,) what 95 % of the runs stay within."""
        return most(self.errors[what])

    def at(self, minutes: int, what: str) -> tuple[Interval, float]:
        """The figure after so many minutes, and the one with own ship's motion exact."""
        k = int(np.flatnonzero(60.0 * minutes == TIMES)[0])
        rng = generator(_BOUNDS, minutes)  # the same runs for all figures
        figure = intervals.bootstrap(most, self.errors[what][k], rng=rng)
        return figure, float(most(self.exact[what][k]))


def run(work: Work) -> list[Finding]:
    """Make all runs; the findings, how many accuracies pass first."""
    each = chunks(work.runs, _SIZE)
    keys = [(name, scene) for name in FILTERS for scene in SCENES]
    parts = [
        Part(arpa_runs.tracked, (shipped(scene.name), name, some, work.seed), len(some))
        for name, scene in keys
        for some in each
    ]
    done = iter(work.do("arpa", parts))
    scores: dict[str, list[Score]] = {name: [] for name in FILTERS}
    bounds = []
    for name, scene in keys:
        result = _together([next(done) for _ in each])
        scores[name].append(score(scene, result, work.seed))
        if name == "kalman":
            bounds.append(_bound(scene, result))
    arpa_figures.ratios(work, scores, bounds)
    arpa_figures.over_time(work, scores["kalman"])
    return [*_sums(scores), *_table(scores["kalman"], bounds)]


def score(scene: Scene, result: Arrays, seed: int) -> Score:
    """From the relative states of all runs."""
    radar = scenario.load(scenario.shipped()[scene.name]).radar
    own = arpa_runs.own_velocity(radar)
    estimate, truth = result["estimate"], result["truth"]
    runs = estimate.shape[-1]
    rng = generator(seed, _OWN, SCENES.index(scene))
    gyro = _off(*_GYRO_DEG, runs, rng) * DEG
    log = _off(*_LOG_KT, runs, rng) * KT
    roll = _off(_ROLL_DEG, 0.0, runs, rng) * DEG * scene.rolls
    exact = errors(estimate, truth, own[:, None] + np.zeros(runs), own)
    along = own / np.hypot(*own)
    shown = _turned((own[:, None] + along[:, None] * log)[None], gyro)[0]
    real = errors(_turned_state(estimate, gyro + roll), truth, shown, own)
    return Score(scene, real, exact, np.isfinite(estimate).all(axis=(0, 1)).astype(float))


def most(values: Array) -> Array:
    """What 95 % of the runs, the last axis, stay within; of 100 runs the 95th smallest."""
    rank = int(np.ceil(_PART * values.shape[-1] - 1e-9)) - 1
    result: Array = np.partition(values, rank, axis=-1)[..., rank]
    return result


def errors(estimate: Array, truth: Array, own_shown: Array, own: Array) -> dict[str, Array]:
    """Absolute errors (times, runs) of the six quantities, in their units; `LOST` where there is no track.

    Parameters
    ----------
    estimate, truth : (times, 4, runs) relative states
    own_shown : (2, runs) m/s, own ship's velocity as its sensors have it
    own : (2,) m/s, as it is
    """
    shown = _quantities(estimate, own_shown)
    real = _quantities(truth, own[:, None] + np.zeros(own_shown.shape))
    result: dict[str, Array] = {}
    for what, unit in QUANTITIES.items():
        error: Array = shown[what] - real[what]
        if unit == "°":
            error = wrap(error * DEG) / DEG
        result[what] = np.where(np.isfinite(error), np.abs(error), LOST)
    return result


def _quantities(state: Array, own: Array) -> dict[str, Array]:
    place, motion = (np.moveaxis(each, 1, -1) for each in (state[:, :2], state[:, 2:]))
    course, speed = course_and_speed(motion)
    cpa, tcpa = closest_approach(place, motion)
    true_course, true_speed = course_and_speed(motion + own.T)
    figures = (course / DEG, speed / KT, cpa / NM, tcpa / 60.0, true_course / DEG, true_speed / KT)
    return dict(zip(QUANTITIES, figures, strict=True))


def _off(calibration: float, sd: float, runs: int, rng: np.random.Generator) -> Array:
    side: Array = calibration * rng.choice([-1.0, 1.0], runs)
    return side + sd * rng.standard_normal(runs)


def _turned(plane: Array, angle: Array) -> Array:
    """Vectors (times, 2, runs) turned clockwise by angles (runs,), rad."""
    s, c = np.sin(angle), np.cos(angle)
    return np.stack([c * plane[:, 0] + s * plane[:, 1], c * plane[:, 1] - s * plane[:, 0]], axis=1)


def _turned_state(state: Array, angle: Array) -> Array:
    return np.concatenate([_turned(state[:, :2], angle), _turned(state[:, 2:], angle)], axis=1)


def _bound(scene: Scene, result: Arrays) -> dict[str, Array]:
    """The Cramér-Rao bound on 95 % errors by quantity (times,), in its unit."""
    radar = scenario.load(scenario.shipped()[scene.name]).radar
    began = float(np.nanmedian(result["confirmed"]))
    state = np.nanmean(result["truth"], axis=-1)[0]
    start = np.concatenate([state[:2] - (began + TIMES[0]) * state[2:], state[2:]])
    least = arpa_runs.bound(radar, start, began)
    return {
        "relative course": _TWO_SIDED * least.course / DEG,
        "relative speed": _TWO_SIDED * least.speed / KT,
    }


def _sums(scores: Mapping[str, Sequence[Score]]) -> list[Finding]:
    rows = []
    for name, each in scores.items():
        judged = [
            (score.scene.name, minutes, what, float(score.at(minutes, what)[0].value) <= limit)
            for score in each
            for minutes, what, limit in score.scene.limits
        ]
        passed = sum(passes for *_, passes in judged)
        failing = ", ".join(
            f"{what} in {scene} at {k} min" for scene, k, what, passes in judged if not passes
        )
        runs = len(each[0].tracked)
        verdict = f"of {len(judged)}; fails: {failing}" if failing else f"all of {len(judged)}"
        what = f"accuracies that pass, {FILTERS[name]}"
        rows.append(Finding(what, "", float(len(judged)), passed, None, None, runs, verdict))
        tracked = intervals.proportion(np.concatenate([score.tracked for score in each]))
        rows.append(found(f"target tracked to the end, {FILTERS[name]}", "", tracked, "all scenes"))
    return rows


def _table(scores: Sequence[Score], bounds: Sequence[Mapping[str, Array]]) -> list[Finding]:
    """Every accuracy of the Kalman filter beside its limit."""
    rows = []
    for score, bound in zip(scores, bounds, strict=True):
        for minutes, what, limit in score.scene.limits:
            figure, exact = score.at(minutes, what)
            verdict = f"{judged(figure, limit)}; {exact:.2g} with own motion exact"
            if what in bound:
                least = bound[what][int(np.flatnonzero(60.0 * minutes == TIMES)[0])]
                beyond = ", which is beyond the limit" if least > limit else ""
                verdict += f", Cramér-Rao bound {least:.2g}{beyond}"
            quantity = f"{score.scene.name}, {minutes} min: {what}"
            rows.append(found(quantity, QUANTITIES[what], figure, verdict, limit))
    return rows


def judged(figure: Interval, limit: float) -> str:
    """Pass or fail, and whether the interval leaves it open."""
    word = "pass" if figure.value <= limit else "fail"
    return word if figure.high <= limit or figure.low > limit else f"{word}, but the limit is in the interval"


def _together(parts: Sequence[Arrays]) -> Arrays:
    """Runs one after another on the last axis."""
    return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]}
