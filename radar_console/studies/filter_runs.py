"""The filters of the study `filter_rmse` on its cases, many runs at once.

Runs draw from generators of their own, so a run is the same alone and among others. Scans are the first axis
of all arrays; the first two of them start the filters, and scoring begins two scans later.
"""

from typing import NamedTuple

import numpy as np

from radar_console.core.units import DEG
from radar_console.estimation import (
    extended,
    imm,
    kalman,
    measurement,
    motion,
    rao_blackwell,
    samples,
    unscented,
)
from radar_console.estimation.filters import EXTENDED, KALMAN
from radar_console.estimation.gaussian import Array, Gaussian, apply, root
from radar_console.studies import trajectories
from radar_console.studies.work import Arrays, generator

GRID = np.array(
    [0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8.5, 10, 12, 14, 17, 20, 25, 30, 40, 60, 100,
     200, 500]
)  # fmt: skip
"""σ_a of the Kalman filters, m/s²."""
NOMINAL = 3.0


class Case(NamedTuple):
    """A trajectory and how it is measured; `polar` noise is range m, azimuth deg."""

    trajectory: str
    T: float = 4.0
    sd: float = 100.0
    polar: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """As the tables have it."""
        noise = "polar" if self.polar else f"σ = {self.sd:g} m"
        return f"{self.trajectory} {self.T:g} s" + ("" if noise == "σ = 100 m" else f", {noise}")


CASES = (
    Case("RANDOM"),
    Case("E3REC"),
    Case("FIGHTER"),
    Case("AIRLINER"),
    Case("RANDOM", 2.0),
    Case("E3REC", 2.0),
    Case("E3REC", 1.0),
    Case("E3REC", polar=(50.0, 0.1)),
    Case("E3REC", sd=10.0),
    Case("FIGHTER", sd=10.0),
)
_SEED_OF_PATHS, _SEED_OF_NOISE, _SEED_OF_FILTER, _SEED_OF_MATCHED = range(4)


class Measured(NamedTuple):
    """Truth and measurements of some runs of a case, from the first scan on.

    Attributes
    ----------
    truth, z : (scans, runs, 2) m
    R : (2, 2) or (scans, runs, 2, 2) m²
    """

    truth: Array
    z: Array
    R: Array


def measure(case: Case, runs: range, seed: int) -> Measured:
    """Every run draws from a generator of its own: the same alone and among others."""
    truth, noise = [], []
    for run in runs:
        if case.trajectory == "RANDOM":
            target = trajectories.random_target(generator(seed, _SEED_OF_PATHS, run))
        else:
            target = trajectories.BY_HAND[case.trajectory]
        truth.append(trajectories.path(target, case.T))
        rng = generator(seed, _SEED_OF_NOISE, CASES.index(case), run)
        noise.append(rng.standard_normal(truth[-1].shape))
    p, n = np.stack(truth, axis=1), np.stack(noise, axis=1)
    if case.polar is None:
        return Measured(p, p + case.sd * n, case.sd**2 * np.eye(2))
    sd_range, sd_azimuth = case.polar[0], case.polar[1] * DEG
    distance = np.hypot(p[..., 0], p[..., 1]) + sd_range * n[..., 0]
    azimuth = np.arctan2(p[..., 0], p[..., 1]) + sd_azimuth * n[..., 1]
    converted = measurement.from_polar(distance, azimuth, sd_range, sd_azimuth)
    return Measured(p, converted.mean, converted.cov)


def start(seen: Measured, T: float) -> Gaussian:
    """Position and velocity (runs, 4) from the first two scans."""
    R = np.broadcast_to(seen.R, (*seen.z.shape, 2))
    mean = np.concatenate([seen.z[1], (seen.z[1] - seen.z[0]) / T], axis=-1)
    cov = np.empty((*mean.shape, 4))
    cov[..., :2, :2] = R[1]
    cov[..., :2, 2:] = cov[..., 2:, :2] = R[1] / T
    cov[..., 2:, 2:] = (R[0] + R[1]) / T**2
    return Gaussian(mean, cov)


def kalman_filters(seen: Measured, T: float, sigma: Array) -> Array:
    """Filtered positions (scans − 2, grid, runs, 2) for each of `sigma` (grid,), m/s²."""
    F, Q = motion.constant_velocity(T, np.asarray(sigma)[:, None] ** 2, piecewise=True)
    H, state = np.eye(2, 4), start(seen, T)
    # With one R for all, gains don't depend on the measurements: one covariance serves all runs.
    alike = seen.R.ndim == 2
    state = Gaussian(state.mean[None], state.cov[None, :1] if alike else state.cov[None])
    filtered = []
    for k in range(2, len(seen.z)):
        R = seen.R if alike else seen.R[k]
        state, _ = kalman.update(kalman.predict(state, F, Q), seen.z[k], H, R)
        filtered.append(state.mean[..., :2])
    return np.stack(filtered)


def interacting(seen: Measured, T: float, turns: bool = False) -> Array:
    """Filtered positions (scans − 2, runs, 2) of an IMM.

    Its modes are constant velocity (0.1 m/s²) and constant acceleration (10 m/s² a scan); with `turns` also a
    coordinated turn (1 m²/s³, 10⁻⁴ rad²/s³), for which the filter is the extended one.
    """
    straight = motion.linear(*motion.constant_velocity(T, 0.1**2, piecewise=True))
    curved = motion.linear(*motion.constant_acceleration(T, 10.0**2, piecewise=True))
    # What a mode lacks is zero in it; 1e-9 keeps its covariance regular.
    size = 7 if turns else 6
    none = np.full(size, 1e-9)
    models = [motion.embed(straight, range(4), none), motion.embed(curved, range(6), none)]
    if turns:
        models.append(motion.embed(motion.coordinated_turn(T, 1.0, 1e-4), [0, 1, 2, 3, 6], none))
    first = start(seen, T)
    mean, cov = np.zeros((*first.mean.shape[:-1], size)), np.zeros((*first.mean.shape[:-1], size, size))
    mean[..., :4], cov[..., :4, :4] = first.mean, first.cov
    cov[..., range(4, size), range(4, size)] = [100.0, 100.0, 0.003][: size - 4]
    modes = imm.start(Gaussian(mean, cov), np.array([0.5, 0.25, 0.25] if turns else [0.5, 0.5]))
    switching = np.array(
        [[0.96, 0.02, 0.02], [0.04, 0.94, 0.02], [0.04, 0.02, 0.94]]
        if turns
        else [[0.98, 0.02], [0.02, 0.98]]
    )
    filter = EXTENDED if turns else KALMAN
    filtered = []
    for k in range(2, len(seen.z)):
        sensing = measurement.position(seen.R if seen.R.ndim == 2 else seen.R[k])
        modes = imm.predict(modes, models, switching, filter)
        modes, _ = imm.update(modes, seen.z[k], sensing, filter)
        filtered.append(imm.estimate(modes).mean[..., :2])
    return np.stack(filtered)


def regime_particles(
    seen: Measured, T: float, seed: int, runs: range, particles: int
) -> rao_blackwell.Estimates:
    """The Rao-Blackwellised particle filter from the third scan on."""
    R = seen.R if seen.R.ndim == 2 else seen.R[2:]
    return rao_blackwell.estimate(
        seen.z[2:],
        R,
        T,
        start(seen, T),
        seed + _SEED_OF_FILTER,
        list(runs),
        particles=particles,
        branches=particles // 2,
    )


def squared(estimate: Array, seen: Measured) -> Array:
    """Squared errors of filtered positions (scans − 2, ..., runs, 2), m²: (scans − 3, ..., runs)."""
    truth = seen.truth[3:]
    truth = truth.reshape(len(truth), *(1,) * (estimate.ndim - 3), *truth.shape[1:])
    error: Array = np.sum((estimate[1:] - truth) ** 2, axis=-1)
    return error


def compare(case: Case, runs: range, seed: int, particles: int) -> Arrays:
    """All filters on some runs: mean squared errors by run, `_time` by scan, m²."""
    seen = measure(case, runs, seed)
    errors = {
        "kf": squared(kalman_filters(seen, case.T, GRID), seen),
        "imm": squared(interacting(seen, case.T), seen),
        "imm3": squared(interacting(seen, case.T, turns=True), seen),
        "rbpf": squared(
            regime_particles(seen, case.T, seed, runs, particles).mean[..., :2],
            seen,
        ),
        "raw": squared(seen.z[2:], seen),
    }
    by_run = {name: error.mean(axis=0) for name, error in errors.items()}
    return by_run | {f"{name}_time": error.sum(axis=-1) for name, error in errors.items()}


def linear_case(runs: range, seed: int) -> Arrays:
    """Largest distance, m, between KF, EKF and UKF over all scans of some runs of E3REC: (1,) each."""
    case = Case("E3REC")
    seen = measure(case, runs, seed)
    model = motion.linear(*motion.constant_velocity(case.T, NOMINAL**2, piecewise=True))
    sensing = measurement.position(seen.R)
    reference = kalman_filters(seen, case.T, np.array([NOMINAL]))[:, 0]
    distance = {}
    for name, filter in (("ekf", extended), ("ukf", unscented)):
        state, largest = start(seen, case.T), 0.0
        for k in range(2, len(seen.z)):
            state, _ = filter.update(filter.predict(state, model), seen.z[k], sensing)
            largest = max(largest, float(np.abs(state.mean[..., :2] - reference[k - 2]).max()))
        distance[name] = np.array([largest])
    return distance


# Particle filters with the single model of the Kalman filter, on truth from that model.
MATCHED_COUNTS = (100, 1_000, 10_000)
_SCANS, _SIGMA = 60, 10.0


def matched(count: int, runs: range, seed: int) -> Arrays:
    """Mean squared errors by run, m², of the KF and of particle filters of `count` with either proposal."""
    T, R = 4.0, 100.0**2 * np.eye(2)
    F, Q = motion.constant_velocity(T, _SIGMA**2, piecewise=True)
    model, sensing = motion.linear(F, Q), measurement.position(R)
    L = root(Q)
    x, z = [], []
    for run in runs:
        rng = generator(seed, _SEED_OF_MATCHED, run)
        states = [np.array([0.0, 0.0, 200.0, 0.0])]
        for _ in range(_SCANS + 1):
            states.append(F @ states[-1] + L @ rng.standard_normal(4))
        x.append(states)
        z.append(np.array(states)[:, :2] + 100.0 * rng.standard_normal((_SCANS + 2, 2)))
    seen = Measured(np.stack(x, axis=1)[..., :2], np.stack(z, axis=1), R)
    first = start(seen, T)
    found = {"kf": kalman_filters(seen, T, np.array([_SIGMA]))[:, 0]}
    for number, name in enumerate(("prior", "optimal")):
        rng = generator(seed, _SEED_OF_MATCHED, runs.start, count, number)
        cloud, filtered = samples.draw(first, count, rng), []
        for k in range(2, len(seen.z)):
            if name == "prior":
                cloud, _ = samples.update(samples.predict(cloud, model, rng), seen.z[k], sensing)
            else:
                cloud, _ = samples.advance(cloud, model, seen.z[k], sensing, rng)
            filtered.append(np.einsum("k...,k...i->...i", cloud.weights, cloud.states[..., :2]))
            cloud = samples.resample(cloud, rng)
        found[name] = np.stack(filtered)
    return {name: squared(estimate, seen).mean(axis=0) for name, estimate in found.items()}


BOOTSTRAP = (500, 5_000)
LOST = 1_000.0  # m at the end: the filter has lost its target


def bootstrap_regimes(case: Case, count: int, runs: range, seed: int) -> Arrays:
    """Everything drawn, from the prior: regime, acceleration, position and velocity.

    The regime is left in a scan with 0.05 (straight) or 0.15 (manoeuvre); accelerations are uniform, 70 %
    to the side within ±32 m/s², else along the course within ±6; noise 0.1 m/s², in manoeuvres 6.

    Returns
    -------
    mean squared error by run, m², and the distance at the end, m
    """
    seen, T = measure(case, runs, seed), case.T
    rng = generator(seed, _SEED_OF_FILTER, CASES.index(case), count, runs.start)
    x = samples.draw(start(seen, T), count, rng).states
    shape = x.shape[:-1]
    bent = np.zeros(shape, np.bool_)
    side: Array = np.zeros(shape)
    along: Array = np.zeros(shape)
    filtered = []
    for k in range(2, len(seen.z)):
        leave = rng.random(shape) < np.where(bent, 0.15, 0.05)
        turns, size = rng.random(shape) < 0.7, rng.uniform(-1.0, 1.0, shape)
        bent ^= leave
        side = np.where(leave, np.where(bent & turns, 32.0 * size, 0.0), side)
        along = np.where(leave, np.where(bent & ~turns, 6.0 * size, 0.0), along)
        x = _steer(x, side, along, np.where(bent, 6.0, 0.1), T, rng)
        sensing = measurement.position(seen.R if seen.R.ndim == 2 else seen.R[k])
        cloud, _ = samples.update(samples.Samples(x, np.full(shape, -np.log(count))), seen.z[k], sensing)
        filtered.append(np.einsum("k...,k...i->...i", cloud.weights, x[..., :2]))
        carried = np.concatenate([x, np.stack([bent, side, along], axis=-1)], axis=-1)
        carried = samples.resample(samples.Samples(carried, cloud.log_weights), rng, below=1.1).states
        x, bent, side, along = carried[..., :4], carried[..., 4] > 0.5, carried[..., 5], carried[..., 6]
    error = squared(np.stack(filtered), seen)
    return {"bootstrap": error.mean(axis=0), "last": np.sqrt(error[-1])}


def _steer(x: Array, side: Array, along: Array, noise: Array, T: float, rng: np.random.Generator) -> Array:
    """States (..., 4) after `T` s of accelerations to the right and along the course, m/s²."""
    v = x[..., 2:]
    speed = np.maximum(np.hypot(v[..., 0], v[..., 1]), 1.0)
    theta = side / speed * T
    half = 0.5 * theta
    chord = T * (1.0 + 0.5 * along * T / speed) * np.sinc(half / np.pi)
    shift = apply(_rotation(half), v) * chord[..., None]
    after = apply(_rotation(theta), v) * (1.0 + along * T / speed)[..., None]
    w = noise[..., None] * rng.standard_normal(v.shape)
    return np.concatenate([x[..., :2] + shift + 0.5 * T**2 * w, after + T * w], axis=-1)


def _rotation(theta: Array) -> Array:
    """Clockwise by `theta`: (..., 2, 2)."""
    sin, cos = np.sin(theta), np.cos(theta)
    return np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], axis=-2)
