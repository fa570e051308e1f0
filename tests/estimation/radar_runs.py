"""Independent runs of one target and its radar, all at once: truth from the filters' own models."""

from typing import NamedTuple

import numpy as np

from radar_console.estimation import imm, kalman, measurement, motion, samples
from radar_console.estimation.filters import BY_NAME, EXTENDED, KALMAN
from radar_console.estimation.gaussian import Gaussian, apply, root
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion

T, Q_WHITE = 4.0, 1.0  # s, m²/s³
SD = {"range": 50.0, "azimuth": 0.002, "elevation": 0.003, "doppler": 3.0}
SWITCHING = np.array([[0.95, 0.05], [0.1, 0.9]])
TURN = 0.02  # rad/s, standard deviation of a turn's rate


class Runs(NamedTuple):
    """Truth (steps, runs, n) and measurements (steps, runs, m); the first step is one after the prior."""

    prior: Gaussian
    truth: np.ndarray
    z: np.ndarray
    sensing: Sensing


def axes_of(d: int) -> tuple[float, ...]:
    return motion.PLANE if d == 2 else motion.SPACE


def straight(d: int) -> Motion:
    return motion.linear(*motion.constant_velocity(T, Q_WHITE, axes_of(d)))


def quantities_of(d: int, doppler: bool) -> tuple[measurement.Quantity, ...]:
    position: tuple[measurement.Quantity, ...] = ("range", "azimuth", "elevation")
    return (*position[:d], "doppler") if doppler else position[:d]


def radar(d: int, doppler: bool) -> Sensing:
    """The radar stands at a place of its own, and moves."""
    names = quantities_of(d, doppler)
    place, speed = np.array([2e3, -1e3, 50.0]), np.array([5.0, 3.0, 0.0])
    return measurement.polar([SD[name] for name in names], names, place[:d], speed[:d])


def prior_of(d: int, runs: int, extra: int = 0) -> Gaussian:
    """Targets on all sides at about 60 km, near north too; as far known as after the first plots."""
    azimuth = 2 * np.pi * np.arange(runs) / runs
    place = 60e3 * np.stack([np.sin(azimuth), np.cos(azimuth), np.full(runs, 0.1)], axis=-1)
    course = 2.4 * azimuth
    velocity = 200.0 * np.stack([np.sin(course), np.cos(course), np.zeros(runs)], axis=-1)
    mean = np.concatenate([place[:, :d], velocity[:, :d], np.zeros((runs, extra))], axis=-1)
    sd = [100.0] * d + [20.0] * d + [TURN] * extra
    return Gaussian(mean, np.tile(np.diag(sd) ** 2, (runs, 1, 1)))


def simulate(d: int, doppler: bool, rng: np.random.Generator, runs: int = 100, steps: int = 30) -> Runs:
    """One model, nearly constant velocity."""
    prior, model = prior_of(d, runs), straight(d)
    x = prior.mean + apply(root(prior.cov), rng.standard_normal(prior.mean.shape))
    truth = []
    for _ in range(steps):
        x = model.f(x) + apply(root(model.Q), rng.standard_normal(x.shape))
        truth.append(x)
    return observe(prior, np.array(truth), radar(d, doppler), rng)


def observe(prior: Gaussian, truth: np.ndarray, sensing: Sensing, rng: np.random.Generator) -> Runs:
    seen = sensing.h(truth)
    return Runs(prior, truth, seen + apply(root(sensing.R), rng.standard_normal(seen.shape)), sensing)


def modes_of(d: int) -> list[Motion]:
    """Straight flight and turns, over the state of a turn; in straight flight the rate is drawn anew."""
    turn = motion.coordinated_turn(T, Q_WHITE, 1e-7, axes_of(d))
    prior = np.append(np.zeros(2 * d), TURN**2)
    return [motion.embed(straight(d), range(2 * d), prior), turn]


def simulate_switching(
    d: int, doppler: bool, rng: np.random.Generator, runs: int = 100, steps: int = 30
) -> Runs:
    """The model jumps by `SWITCHING`; it starts with straight flight."""
    prior, models = prior_of(d, runs, 1), modes_of(d)
    x = prior.mean + apply(root(prior.cov), rng.standard_normal(prior.mean.shape))
    mode, truth = np.zeros(runs, int), []
    for _ in range(steps):
        mode = (rng.random(runs) > SWITCHING[mode, 0]).astype(int)
        ways = [model.f(x) + apply(root(model.Q), rng.standard_normal(x.shape)) for model in models]
        x = np.where(mode[:, None] == 0, *ways)
        truth.append(x)
    return observe(prior, np.array(truth), radar(d, doppler), rng)


class Found(NamedTuple):
    """Estimates (steps, runs, ...) and innovations; those of Doppler alone where they come after."""

    mean: np.ndarray
    cov: np.ndarray
    nu: np.ndarray
    S: np.ndarray


def found(steps: list[tuple[Gaussian, np.ndarray, np.ndarray]]) -> Found:
    return Found(
        np.array([state.mean for state, _, _ in steps]),
        np.array([state.cov for state, _, _ in steps]),
        np.array([nu for _, nu, _ in steps]),
        np.array([S for _, _, S in steps]),
    )


def run_gaussian(name: str, runs: Runs) -> Found:
    filter, model, state, steps = BY_NAME[name], straight(runs.truth.shape[-1] // 2), runs.prior, []
    for z in runs.z:
        state = filter.predict(state, model)
        nu, S = filter.innovation(state, z, runs.sensing)
        state, _ = filter.update(state, z, runs.sensing)
        steps.append((state, nu, S))
    return found(steps)


def run_converted(runs: Runs) -> Found:
    """The Kalman filter on converted positions; Doppler, where there is one, after it."""
    d, state, steps = runs.truth.shape[-1] // 2, runs.prior, []
    place, speed = np.array([2e3, -1e3, 50.0])[:d], np.array([5.0, 3.0, 0.0])[:d]
    convert = measurement.from_polar if d == 2 else measurement.from_spherical
    names = quantities_of(d, False)
    rate = measurement.polar([SD["doppler"]], ("doppler",), place, speed)
    F, Q = motion.constant_velocity(T, Q_WHITE, axes_of(d))
    for z in runs.z:
        plot = convert(*np.moveaxis(z[:, :d], -1, 0), *(SD[name] for name in names))
        seen = measurement.position(plot.cov)
        state = kalman.predict(state, F, Q)
        nu, S = KALMAN.innovation(state, plot.mean + place, seen)
        state, _ = KALMAN.update(state, plot.mean + place, seen)
        if z.shape[-1] > d:
            state, _ = EXTENDED.update(state, z[:, d:], rate)
        steps.append((state, nu, S))
    return found(steps)


def run_imm(runs: Runs, name: str = "extended") -> Found:
    d = runs.truth.shape[-1] // 2
    filter, models, steps = BY_NAME[name], modes_of(d), []
    modes = imm.start(runs.prior, np.array([1.0, 0.0]))
    for z in runs.z:
        modes = imm.predict(modes, models, SWITCHING, filter)
        nu, S = imm.innovation(modes, z, runs.sensing, filter)
        modes, _ = imm.update(modes, z, runs.sensing, filter)
        steps.append((imm.estimate(modes), nu, S))
    return found(steps)


def run_particles(runs: Runs, count: int, rng: np.random.Generator, width: float = 0.0) -> Found:
    model, steps = straight(runs.truth.shape[-1] // 2), []
    cloud = samples.draw(runs.prior, count, rng)
    for z in runs.z:
        cloud = samples.predict(cloud, model, rng)
        nu, S = samples.innovation(cloud, z, runs.sensing)
        cloud, _ = samples.update(cloud, z, runs.sensing)
        steps.append((samples.estimate(cloud), nu, S))
        cloud = samples.resample(cloud, rng, width=width)
    return found(steps)
