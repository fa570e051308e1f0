"""Stone Soup's trackers over a scene: its own components, joined by its own rules.

Prediction, gating, association (joint probabilistic with EHM2, or global nearest neighbour), initiation
from four hits and deletion after six misses are Stone Soup's; the loop over scans is that of its
`MultiTargetMixtureTracker`, written out so that initiation can be timed by itself and so that particle
states can be mixed: a particle's weight after the update is the sum over the hypotheses of their
probabilities times the weights that each alone would give.

q, P_D and the clutter density are the scene's. Stone Soup takes one density in bearing and range, so it
is that of the plane times the targets' mean range. The gate of 0.99 and the four hits of an initiation
are chosen for it: with 0.9999 its association of a formation took more than ten times as long, and
with that gate and three hits ring25 had 32 false tracks after 13 scans. It works in kilometres:
beside metres squared it takes the variance of a good azimuth for zero, and refuses the covariance.
"""

import math
import time
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from pyehm.plugins.stonesoup import JPDAWithEHM2
from scipy.special import logsumexp
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.functions import gm_reduce_single
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.models.transition.nonlinear import ConstantTurn
from stonesoup.predictor.kalman import ExtendedKalmanPredictor, UnscentedKalmanPredictor
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.resampler.particle import ESSResampler
from stonesoup.types.angle import Bearing
from stonesoup.types.array import StateVector, StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.prediction import GaussianStatePrediction, ParticleStatePrediction
from stonesoup.types.state import GaussianState, ParticleState
from stonesoup.types.track import Track
from stonesoup.types.update import GaussianStateUpdate, ParticleStateUpdate
from stonesoup.updater.kalman import ExtendedKalmanUpdater, UnscentedKalmanUpdater
from stonesoup.updater.particle import ParticleUpdater

from benchmarks.scenes import PERIOD, Scene, formation, given_tracks
from benchmarks.tracking import Run, peak_mb
from radar_console.core.messages import TRACK, Table, TrackStatus, blank
from radar_console.core.units import DEG, KM

Q = 1.0  # m²/s³
TURN_RATE = 3.0 * DEG  # rad/s, deviation of a new track's
TURN_NOISE = TURN_RATE**2 / 20.0  # rad²/s³, of its random walk: that deviation in 20 s
P_G, GATE = 0.99, 3.03  # and the Mahalanobis distance that belongs to it
PARTICLES = 1000
HITS, MISSES = 4, 6
SPEED = 400.0  # m/s, the largest a target is taken to have
_EPOCH = datetime(2020, 1, 1)
_ORDER = (0, 2, 1, 3)  # our east, north, v_east, v_north in its order


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """Components of one tracker."""

    model: Any
    predictor: Any
    updater: Any
    associator: Any
    initiator: Any
    deleter: Any
    particles: bool


def one_step(name: str) -> Callable[[], Any]:
    """The prediction and update of one object by the EKF, the UKF or the PF."""
    scene = formation(1, seed=1, scans=2)
    parts = parts_of(scene, f"{name} + GNN")
    prior = _state(given_tracks(scene, 1)[0], parts)
    now, detection = _time(PERIOD), next(iter(next(_detections(scene, parts.model))[1]))

    def step() -> None:
        prior_now = copy(prior)  # predictions are kept for each prior: this one is new
        prediction = parts.predictor.predict(prior_now, timestamp=now)
        parts.updater.update(SingleHypothesis(prediction, detection))

    return step


def parts_of(scene: Scene, name: str, q: float = Q) -> Parts:
    """The components of ``PF + EHM2``, ``EKF + EHM2``, ``UKF + EHM2``, ``EKF turn + EHM2`` or ``EKF + GNN``.

    `q` is the process noise, m²/s³; ``turn`` is a coordinated turn whose rate is part of the state.
    """
    filter_name, _, association = name.partition(" + ")
    sd = scene.radar.sd_azimuth, scene.radar.sd_range / KM
    turning = filter_name == "EKF turn"
    size = 5 if turning else 4
    model = CartesianToBearingRange(ndim_state=size, mapping=(0, 2), noise_covar=np.diag(np.square(sd)))
    noise = np.full(2, q / KM**2)
    motion = (
        ConstantTurn(noise, TURN_NOISE)
        if turning
        else CombinedLinearGaussianTransitionModel([ConstantVelocity(each) for each in noise])
    )
    extended = ExtendedKalmanPredictor(motion), ExtendedKalmanUpdater(model)
    predictor, updater = {
        "EKF": extended,
        "EKF turn": extended,
        "UKF": (UnscentedKalmanPredictor(motion), UnscentedKalmanUpdater(model)),
        "PF": (ParticlePredictor(motion), ParticleUpdater(model)),
    }[filter_name]
    near = DistanceHypothesiser(*extended, Mahalanobis(), missed_distance=GATE)
    if association == "GNN":
        associator = GNNWith2DAssignment(
            DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE)
        )
    else:
        mean_range = float(np.mean(np.hypot(scene.truth["east"], scene.truth["north"])))
        density = scene.clutter * mean_range * KM  # per radian and kilometre
        associator = JPDAWithEHM2(PDAHypothesiser(predictor, updater, density, scene.p_d, P_G))
    spread = (SPEED / 2 / KM) ** 2
    spreads = [0.0, spread, 0.0, spread, TURN_RATE**2][:size]
    unknown = GaussianState(np.zeros((size, 1)), np.diag(spreads))
    initiator = MultiMeasurementInitiator(
        unknown, UpdateTimeStepsDeleter(2), GNNWith2DAssignment(near), extended[1], model, min_points=HITS
    )
    deleter = UpdateTimeStepsDeleter(MISSES)
    return Parts(model, predictor, updater, associator, initiator, deleter, filter_name == "PF")


def track(scene: Scene, name: str, given: Table | None, seed: int, q: float = Q) -> Run:
    """One of its trackers over a snapshot scene; from scratch, or on from tracks that are given."""
    np.random.seed(seed)  # noqa: NPY002  Stone Soup draws from the global generator
    parts = parts_of(scene, name, q)
    tracks = (
        {Track([_state(row, parts)], id=str(row["track"])) for row in given} if given is not None else set()
    )
    numbers: dict[str, int] = {track.id: int(track.id) for track in tracks}
    rows, cpu, wall, initiation = [_rows(tracks, numbers, 0.0)], [], [], []
    for scan, (now, detections) in enumerate(_detections(scene, parts.model)):
        if given is not None and scan == 0:
            cpu.append(0.0)
            wall.append(0.0)
            continue
        began = time.process_time(), time.perf_counter()
        left = detections - _update(tracks, detections, now, parts)
        before = set(tracks)
        tracks -= parts.deleter.delete_tracks(tracks)
        middle = time.process_time()
        if given is None:
            fresh = parts.initiator.initiate(left, now)
            for started in fresh if parts.particles else ():
                started[-1] = _cloud(started[-1])
            tracks |= fresh
            before |= fresh
        ended = time.process_time()
        cpu.append(ended - began[0])
        wall.append(time.perf_counter() - began[1])
        initiation.append(ended - middle)
        rows += [
            _rows(tracks, numbers, _seconds(now)),
            _rows(before - tracks, numbers, _seconds(now), TrackStatus.DELETED),
        ]
    median = float(np.median(initiation)) if given is None else math.nan
    return Run(np.concatenate(rows), np.array(cpu), np.array(wall), peak_mb(), median)


def _update(tracks: set[Any], detections: set[Any], now: datetime, parts: Parts) -> set[Any]:
    """Associate and update all tracks; the detections that are taken."""
    taken = set()
    for track, hypotheses in parts.associator.associate(tracks, detections, now).items() if tracks else ():
        if isinstance(parts.associator, GNNWith2DAssignment):
            track.append(parts.updater.update(hypotheses) if hypotheses else hypotheses.prediction)
            taken |= {hypotheses.measurement} if hypotheses else set()
            continue
        miss = next(hypothesis.weight for hypothesis in hypotheses if not hypothesis)
        likelier = {hypothesis.measurement for hypothesis in hypotheses if hypothesis.weight > miss}
        mix = _mixed_particles if parts.particles else _mixed_gaussians
        track.append(mix(hypotheses, parts.updater, bool(likelier)))
        taken |= likelier
    return taken


def _mixed_gaussians(hypotheses: Any, updater: Any, hit: bool) -> Any:
    """Moment matching, as its own tracker does."""
    states = [updater.update(each) if each else each.prediction for each in hypotheses]
    mean, covar = gm_reduce_single(
        StateVectors([state.state_vector for state in states]),
        np.stack([state.covar for state in states], axis=2),
        np.asarray([each.probability for each in hypotheses]),
    )
    now = states[0].timestamp
    return (
        GaussianStateUpdate(mean, covar, hypotheses, now)
        if hit
        else GaussianStatePrediction(mean, covar, now)
    )


def _mixed_particles(hypotheses: Any, updater: Any, hit: bool) -> Any:
    """One set of particles under all hypotheses: they share one prediction."""
    logs = [
        math.log(each.probability) + (updater.update(each) if each else each.prediction).log_weight
        for each in hypotheses
        if each.probability > 0
    ]
    state = next(each.prediction for each in hypotheses if not each)
    weights = logsumexp(logs, axis=0)
    if hit:
        mixed = ParticleStateUpdate(
            state.state_vector, hypotheses, log_weight=weights - logsumexp(weights), timestamp=state.timestamp
        )
    else:
        mixed = ParticleStatePrediction(
            state.state_vector, log_weight=weights - logsumexp(weights), timestamp=state.timestamp
        )
    return ESSResampler().resample(mixed)


def _detections(scene: Scene, model: Any) -> Iterator[tuple[datetime, set[Any]]]:
    """The scans, as sets of detections at one time."""
    ends = np.searchsorted(scene.returns["scan"], np.arange(scene.scans + 1))
    for scan in range(scene.scans):
        now = _time(float(scene.truth["time"][0]) + scan * scene.radar.rotation)
        rows = scene.returns[ends[scan] : ends[scan + 1]]
        yield (
            now,
            {
                Detection(
                    StateVector([Bearing(math.pi / 2 - a), r / KM]), timestamp=now, measurement_model=model
                )
                for r, a in zip(rows["range"].tolist(), rows["azimuth"].tolist(), strict=True)
            },
        )


def _state(row: Any, parts: Parts) -> Any:
    """A given track's first state; it says nothing of a turn."""
    names = ("east", "v_east", "north", "v_north")
    size = parts.model.ndim_state
    mean = np.array([row[name] / KM for name in names] + [0.0])[:size, None]
    variance = [(row["sd_" + name] / KM) ** 2 for name in names] + [TURN_RATE**2]
    state = GaussianState(mean, np.diag(variance[:size]), timestamp=_time(float(row["time"])))
    return _cloud(state) if parts.particles else state


def _cloud(state: Any) -> Any:
    """Particles drawn from a Gaussian state."""
    mean, covar = np.ravel(state.state_vector).astype(float), np.asarray(state.covar, float)
    drawn = np.random.multivariate_normal(mean, covar, PARTICLES).T  # noqa: NPY002  its generator
    weights = np.full(PARTICLES, -math.log(PARTICLES))
    if isinstance(state, GaussianStateUpdate):
        return ParticleStateUpdate(
            StateVectors(drawn), state.hypothesis, log_weight=weights, timestamp=state.timestamp
        )
    return ParticleState(StateVectors(drawn), log_weight=weights, timestamp=state.timestamp)


def _rows(
    tracks: set[Any], numbers: dict[str, int], now: float, status: TrackStatus = TrackStatus.CONFIRMED
) -> Table:
    """The states of its tracks in the table that ours are in."""
    table = blank(TRACK, len(tracks))
    for row, track in zip(table, tracks, strict=True):
        row["track"] = numbers.setdefault(track.id, len(numbers))
        mean = np.ravel(track[-1].mean).astype(float)[list(_ORDER)]
        row["time"], row["status"] = now, status
        row["east"], row["north"], row["v_east"], row["v_north"] = mean * KM
    return table


def _time(seconds: float) -> datetime:
    return _EPOCH + timedelta(seconds=seconds)


def _seconds(time: datetime) -> float:
    return (time - _EPOCH).total_seconds()
