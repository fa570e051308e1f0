"""Scenes for comparing trackers: returns with their origin, and the truth, independent of any tracker.

Each scene comes in two kinds.

- *Snapshot* (`swept=False`): all targets of a scan are measured at the scan's own instant. That is what
  trackers expect that take a set of detections and one time. Ours is fed by the beam; `sectors` gives it
  the same scans from a beam that makes its turn within the millisecond before the instant and then stands
  still until the next. In a millisecond a target moves by less than a third of a metre, so both trackers
  see the same thing. The turn starts at an azimuth that no target crosses, where there is one: a target
  that crosses the seam against the beam would be left out of one turn.
- *Swept* (`swept=True`): each target is measured when the beam crosses it. That is how a radar works.

Handing swept scenes to the others with a time on each detection was turned down: their joint association
mixes what it predicts to different times into one state.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from radar_console.core.geometry import to_cartesian, to_polar, wrap
from radar_console.core.messages import CENTROID, TRACK, TRUTH, Radar, Sector, Table, TrackStatus, blank
from radar_console.core.units import DEG, KM, KMH, TURN
from radar_console.estimation.gaussian import Array

PERIOD = 4.0  # s, of a scan
QUICK_TURN = 1e-3  # s, of the beam in a snapshot
_SEAM = 1e-6  # rad past a bin's edge, so that a whole turn of bins is complete when the turn is
_BINS = 256
G = 9.80665  # m/s²
_SPEED = 250.0  # m/s, of manoeuvring targets
_LEG = 40.0, 80.0  # s, straight flight between manoeuvres

RETURN = np.dtype(
    [
        ("scan", "i4"),
        ("time", "f8"),  # s
        ("angle", "f8"),  # rad, unwrapped from the start of scan 0; swept scenes only
        ("range", "f8"),  # m
        ("azimuth", "f8"),  # rad, [0, 2π)
        ("target", "i4"),  # -1 false
    ]
)
"""A detection, and what it comes from."""


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Motion in straight pieces.

    Attributes
    ----------
    step : s, length of a piece
    state : (pieces, n, 4) east, north, v_east, v_north at the start of each piece; the last goes on
    """

    step: float
    state: Array

    def at(self, time: Array) -> Array:
        """States (..., n, 4) at times (..., n) or (..., 1), s."""
        time = np.broadcast_to(time, (*np.shape(time)[:-1], self.state.shape[1]))
        piece = np.clip((time / self.step).astype(int), 0, len(self.state) - 1)
        found: Array = self.state[piece, np.arange(self.state.shape[1])].copy()
        found[..., :2] += (time - piece * self.step)[..., None] * found[..., 2:]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Scans of a scene.

    Attributes
    ----------
    name : of the scene
    scans : how many
    returns : RETURN, by scan
    truth : TRUTH, at the instants of the scans
    radar : the sensor
    p_d : detection probability
    clutter : false returns per m² and scan, where the targets are
    swept : each return has the time at which the beam was there
    """

    name: str
    scans: int
    returns: Table
    truth: Table
    radar: Radar
    p_d: float
    clutter: float
    swept: bool


# False returns (e, n) of a scan, m, around targets (n, 4); the generator is passed in.
Clutter = Callable[[np.random.Generator, Array], Array]


def ring25(seed: int, swept: bool = False, scans: int = 121, area_km2: float = math.pi * 15.0**2) -> Scene:
    """Experiment E2: 13 targets at 250 km and 12 at 150 km fly at the radar, each in a disc of clutter.

    Around each target there are on average 5 false returns a scan in a disc of `area_km2`; 15 km² makes
    the dense reading of the experiment.
    """
    outer = to_cartesian(250.0 * KM, 27.7 * DEG * np.arange(13))
    inner = to_cartesian(150.0 * KM, 30.0 * DEG * np.arange(12))
    position = np.concatenate([np.stack(outer, axis=1), np.stack(inner, axis=1)])
    speed = 800.0 * KMH
    heading = np.arctan2(position[:, 0], position[:, 1]) + math.pi
    start = np.concatenate([position, speed * _direction(heading)], axis=1)
    radius = math.sqrt(area_km2 / math.pi) * KM

    def clutter(rng: np.random.Generator, targets: Array) -> Array:
        count = rng.poisson(5.0, len(targets))
        return np.repeat(targets[:, :2], count, axis=0) + _disc(rng, radius, int(count.sum()))

    name = "ring25" if area_km2 > 100.0 else "dense E2"
    density = 5.0 / (area_km2 * KM**2)
    return _scene(name, seed, Paths(PERIOD, start[None]), scans, swept, clutter, density, 0.1 * DEG)


def dense(seed: int, swept: bool = False, scans: int = 121) -> Scene:
    """E2 with 5 false returns in 15 km² around each target."""
    return ring25(seed, swept, scans, area_km2=15.0)


def crossing2(seed: int, swept: bool = False, scans: int = 211) -> Scene:
    """Experiment E4: two targets cross in discs of 3 km with 6.7 false returns per km²."""
    east, north = to_cartesian(200.0 * KM, np.array([150.0, 180.0]) * DEG)
    speed = np.array([[630.0], [810.0]]) * KMH
    velocity = speed * _direction(np.array([330.0, 26.0]) * DEG)
    start = np.concatenate([np.stack([east, north], axis=1), velocity], axis=1)
    radius, density = 3.0 * KM, 6.7 / KM**2

    def clutter(rng: np.random.Generator, targets: Array) -> Array:
        """The union of the discs, at one density where they overlap, too."""
        count = rng.poisson(density * math.pi * radius**2, 2)
        first, second = (targets[k, :2] + _disc(rng, radius, int(count[k])) for k in (0, 1))
        outside = np.linalg.norm(second - targets[0, :2], axis=1) > radius
        return np.concatenate([first, second[outside]])

    return _scene("crossing2", seed, Paths(PERIOD, start[None]), scans, swept, clutter, density, 0.03 * DEG)


def formation(count: int, seed: int, swept: bool = False, scans: int = 40) -> Scene:
    """Targets abreast, 1 km apart at 150 km, fly at the radar in 2 false returns per km²."""
    start = np.zeros((count, 4))
    start[:, 0] = (np.arange(count) - (count - 1) / 2) * KM
    start[:, 1], start[:, 3] = 150.0 * KM, -200.0
    margin, density = 3.0 * KM, 2.0 / KM**2

    def clutter(rng: np.random.Generator, targets: Array) -> Array:
        low, high = targets[:, :2].min(axis=0) - margin, targets[:, :2].max(axis=0) + margin
        return rng.uniform(low, high, (int(rng.poisson(density * np.prod(high - low))), 2))

    paths = Paths(PERIOD, start[None])
    return _scene(f"formation{count}", seed, paths, scans, swept, clutter, density, 0.1 * DEG)


def swarm(count: int, seed: int, swept: bool = False, scans: int = 60, false: int = 1000) -> Scene:
    """Targets within 200 km on random courses, now and then turning; `false` returns a scan.

    Before each scan interval one target in twenty changes: half of them fly straight, half turn at
    0.5 to 3 °/s. Who comes within 3 % of the edge is sent back to the radar.
    """
    rng = np.random.default_rng((seed, count, 1))
    reach, pieces = 200.0 * KM, 8  # a scan interval
    step = PERIOD / pieces
    position, speed = _disc(rng, 0.9 * reach, count), rng.uniform(100.0, 300.0, count)
    heading, turn = rng.uniform(0.0, TURN, count), np.zeros(count)
    states = np.empty((scans * pieces, count, 4))
    for k in range(scans * pieces):
        states[k] = np.concatenate([position, speed[:, None] * _direction(heading)], axis=1)
        if k % pieces == 0:
            rate = rng.uniform(0.5, 3.0, count) * DEG * rng.choice((-1.0, 1.0), count)
            chosen = np.where(rng.random(count) < 0.5, 0.0, rate)
            turn = np.where(rng.random(count) < 0.05, chosen, turn)
            outside = np.hypot(*position.T) > 0.97 * reach
            heading = np.where(outside, np.arctan2(-position[:, 0], -position[:, 1]), heading)
            turn = np.where(outside, 0.0, turn)
        position = position + step * states[k, :, 2:]
        heading = heading + step * turn

    def clutter(rng: np.random.Generator, targets: Array) -> Array:
        return _disc(rng, reach, false)

    density = false / (math.pi * reach**2)
    return _scene(f"swarm{count}", seed, Paths(step, states), scans, swept, clutter, density, 0.1 * DEG)


def turns(seed: int, swept: bool = False, scans: int = 60, count: int = 20) -> Scene:
    """Targets at 250 m/s that turn by 30 to 180° at 3 g, between 40 and 80 s of straight flight."""
    rate = 3.0 * G / _SPEED

    def turn(rng: np.random.Generator) -> tuple[float, float, float]:
        return rng.uniform(30.0, 180.0) * DEG / rate, rate * rng.choice((-1.0, 1.0)), 0.0

    return _manoeuvring("turns", seed, swept, scans, count, turn)


def sprints(seed: int, swept: bool = False, scans: int = 60, count: int = 20) -> Scene:
    """Targets at 250 m/s that change to 100 or 400 m/s by 15 m/s² for 10 s, and next time back again."""

    def sprint(rng: np.random.Generator) -> tuple[float, float, float]:
        return 10.0, 0.0, rng.choice((-15.0, 15.0))

    return _manoeuvring("sprints", seed, swept, scans, count, sprint)


# Duration s, rate of turn rad/s, and acceleration m/s² of a target's next manoeuvre.
Manoeuvre = Callable[[np.random.Generator], tuple[float, float, float]]


def _manoeuvring(name: str, seed: int, swept: bool, scans: int, count: int, draw: Manoeuvre) -> Scene:
    """Targets on random courses from 60 to 150 km away, each in a disc of ring25's light clutter.

    A manoeuvre follows each 40 to 80 s of straight flight; every other acceleration takes back the one
    before it. The targets move in pieces of a quarter of a second.
    """
    rng = np.random.default_rng((seed, count, 3))
    pieces, step = 16 * scans, PERIOD / 16
    turning, pulling = np.zeros((pieces, count)), np.zeros((pieces, count))
    for target in range(count):
        start, back = round(rng.uniform(*_LEG) / step), 0.0
        while start < pieces:
            duration, rate, pull = draw(rng)
            pull = -back if back else pull
            back = 0.0 if back else pull
            stop = start + round(duration / step)
            turning[start:stop, target], pulling[start:stop, target] = rate, pull
            start = stop + round(rng.uniform(*_LEG) / step)
    # A piece's velocity is that of its middle.
    heading = rng.uniform(0.0, TURN, count) + step * (np.cumsum(turning, axis=0) - 0.5 * turning)
    speed = _SPEED + step * (np.cumsum(pulling, axis=0) - 0.5 * pulling)
    velocity = speed[..., None] * _direction(heading)
    first = to_cartesian(rng.uniform(60.0, 150.0, count) * KM, rng.uniform(0.0, TURN, count))
    position = np.stack(first, axis=1) + step * (np.cumsum(velocity, axis=0) - velocity)
    radius = 15.0 * KM

    def clutter(rng: np.random.Generator, targets: Array) -> Array:
        false = rng.poisson(5.0, count)
        return np.repeat(targets[:, :2], false, axis=0) + _disc(rng, radius, int(false.sum()))

    paths = Paths(step, np.concatenate([position, velocity], axis=2))
    density = 5.0 / (math.pi * radius**2)
    return _scene(name, seed, paths, scans, swept, clutter, density, 0.1 * DEG)


def _scene(
    name: str, seed: int, paths: Paths, scans: int, swept: bool, clutter: Clutter, density: float,
    sd_azimuth: float,
) -> Scene:  # fmt: skip
    rng = np.random.default_rng((seed, paths.state.shape[1]))
    radar = Radar(name, PERIOD, 300.0 * KM, sd_range=50.0, sd_azimuth=sd_azimuth)
    p_d = 0.9
    crossing = _crossings(paths, scans) if swept else PERIOD * np.arange(scans)[:, None]
    states = paths.at(crossing)
    parts = []
    for scan in range(scans):
        seen = np.flatnonzero(rng.random(states.shape[1]) < p_d)
        measured, azimuth = to_polar(states[scan, seen, 0], states[scan, seen, 1])
        false_range, false_azimuth = to_polar(*clutter(rng, states[scan]).T)
        part = np.zeros(len(seen) + len(false_range), RETURN)
        part["scan"] = scan
        part["target"] = -1
        part["target"][: len(seen)] = seen
        part["range"][: len(seen)] = np.abs(measured + radar.sd_range * rng.standard_normal(len(seen)))
        part["range"][len(seen) :] = false_range
        # Angles of the beam: where a target's measured azimuth crosses north, so does its time.
        angle = azimuth + sd_azimuth * rng.standard_normal(len(seen))
        part["angle"] = TURN * scan + np.concatenate([angle, false_azimuth])
        part["azimuth"] = np.mod(part["angle"], TURN)
        part["time"] = part["angle"] / TURN * PERIOD if swept else PERIOD * scan
        order = np.argsort(part["angle"]) if swept else rng.permutation(len(part))
        parts.append(part[order])
    returns = np.concatenate(parts)
    if swept:
        returns = returns[np.argsort(returns["angle"], kind="stable")]
    return Scene(name, scans, returns, _truth(paths, scans), radar, p_d, density, swept)


def _crossings(paths: Paths, scans: int) -> Array:
    """Times (scans, n) at which the beam, at north at time 0, crosses each target in each turn, s.

    A fixed point: the beam is at the azimuth where the target is then. It contracts while the target's
    bearing moves slower than the beam, that is beyond 200 m from the radar; nearer, the time is rough.
    """
    turn = np.arange(scans)[:, None]
    time = (turn + 0.5) * PERIOD
    for _ in range(8):
        east, north = np.moveaxis(paths.at(time)[..., :2], -1, 0)
        time = (turn + np.mod(np.arctan2(east, north), TURN) / TURN) * PERIOD
    return time


def _truth(paths: Paths, scans: int) -> Table:
    """Where the targets are at the instants of the scans."""
    times = PERIOD * np.arange(scans)
    states = paths.at(times[:, None])
    table = blank(TRUTH, states.shape[0] * states.shape[1])
    table["time"] = np.repeat(times, states.shape[1])
    table["target"] = np.tile(np.arange(states.shape[1]), scans)
    for k, name in enumerate(("east", "north", "v_east", "v_north")):
        table[name] = states[..., k].ravel()
    return table


def given_tracks(scene: Scene, seed: int, sd_position: float = 100.0, sd_velocity: float = 10.0) -> Table:
    """Confirmed tracks (TRACK) at the first instant: the truth, and Gaussian errors.

    Parameters
    ----------
    seed : of the errors
    sd_position, sd_velocity : their standard deviations in each axis, m and m/s
    """
    rng = np.random.default_rng((seed, 2))
    truth = scene.truth[scene.truth["time"] == scene.truth["time"][0]]
    tracks = blank(TRACK, len(truth))
    tracks["track"], tracks["time"], tracks["status"] = truth["target"], truth["time"], TrackStatus.CONFIRMED
    tracks["hit"], tracks["born"] = True, truth["time"]
    for name, sd in (("east", sd_position), ("north", sd_position), ("v_east", sd_velocity),
                     ("v_north", sd_velocity)):  # fmt: skip
        tracks[name] = truth[name] + sd * rng.standard_normal(len(truth))
        tracks["sd_" + name] = sd
    return tracks


def sectors(scene: Scene, pushes: int = 1) -> list[list[Sector]]:
    """For each scan the sectors that our tracker gets: `pushes` for the turn, after the wait for it.

    The first sector of all brings nothing: it says where the beam is at the start.
    """
    seam = 0.0 if scene.swept else quiet_azimuth(scene)
    returns, scans = scene.returns, scene.scans
    angle = (
        returns["angle"] if scene.swept else TURN * returns["scan"] + np.mod(returns["azimuth"] - seam, TURN)
    )
    order = np.argsort(angle, kind="stable")
    returns, angle = returns[order], angle[order]
    edges = TURN * np.arange(scans * pushes + 1) / pushes
    turn = PERIOD if scene.swept else QUICK_TURN
    # Snapshot: the turn ends at the instant of its scan. Swept: turn k goes from instant k to k + 1.
    start = PERIOD * np.arange(scans) - (0.0 if scene.swept else turn)
    centroids = _centroids(returns, scene)
    if not scene.swept:
        centroids["time"] = start[returns["scan"]] + (angle / TURN - returns["scan"]) * turn
    cuts = np.searchsorted(angle, edges)
    cuts[0], cuts[-1] = 0, len(angle)  # measured past the first or the last north
    result = []
    stop = float(start[0])
    for scan in range(scans):
        now, beam = max(float(start[scan]), stop), seam + TURN * scan
        part = [Sector(scene.radar, stop, now, beam, beam, beam)]
        for k in range(pushes):
            low, high = seam + edges[scan * pushes + k], seam + edges[scan * pushes + k + 1]
            rows = centroids[cuts[scan * pushes + k] : cuts[scan * pushes + k + 1]]
            before, stop = stop if k else now, now + turn * (k + 1) / pushes
            part.append(Sector(scene.radar, before, stop, low, high, high, centroids=rows))
        result.append(part)
    return result


def _centroids(returns: Table, scene: Scene) -> Table:
    """What our tracker takes; the first numbers are left to tracks that are given."""
    table = blank(CENTROID, len(returns))
    table["ordinal"] = np.arange(len(returns)) + len(np.unique(scene.truth["target"]))
    for name in ("time", "range", "azimuth"):
        table[name] = returns[name]
    table["sd_range"], table["sd_azimuth"] = scene.radar.sd_range, scene.radar.sd_azimuth
    return table


def quiet_azimuth(scene: Scene) -> float:
    """The bin's edge, rad, that lies farthest from every azimuth at which a target ever is."""
    azimuth = np.unique(to_polar(scene.truth["east"], scene.truth["north"])[1])
    edges = TURN * np.arange(_BINS) / _BINS
    above = azimuth[np.searchsorted(azimuth, edges) % len(azimuth)]
    below = azimuth[np.searchsorted(azimuth, edges) - 1]
    away = np.minimum(np.abs(wrap(above - edges)), np.abs(wrap(edges - below)))
    return float(edges[np.argmax(away)]) + _SEAM


def _disc(rng: np.random.Generator, radius: float, count: int) -> Array:
    """Points (count, 2), even over a disc about 0."""
    east, north = to_cartesian(radius * np.sqrt(rng.random(count)), rng.uniform(0.0, TURN, count))
    return np.stack([east, north], axis=1)


def _direction(heading: Array) -> Array:
    """Unit vectors (..., 2)."""
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)
