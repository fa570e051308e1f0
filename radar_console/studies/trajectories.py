"""The trajectories of the filter study: three made by hand and any number drawn by lot.

The paper shows its trajectory as a picture only. E3REC is a reconstruction of it, FIGHTER and AIRLINER are
what aircraft of the two kinds do, RANDOM favours no filter: straights and manoeuvres come by lot.
"""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from radar_console.core.units import DEG
from radar_console.estimation.gaussian import Array
from radar_console.scenario import Accelerate, Leg, RadarSettings, Straight, Target, Turn
from radar_console.simulator import targets

RANDOM_S = 560.0
"""Length of a trajectory drawn by lot, s."""
_SPEED = (150.0, 300.0)  # m/s
_STRAIGHT, _MANOEUVRE = (70.0, 10.0, 200.0), (18.0, 6.0, 60.0)  # mean, least and most, s
_TURNS, _MOST_G = 0.7, 3.0


def _cv(seconds: float) -> Leg:
    return Straight(kind="straight", duration_s=seconds)


def _g(g: float, direction: str, seconds: float) -> Leg:
    side = "right" if direction == "R" else "left"
    return Turn.model_validate(
        {"kind": "turn", "acceleration_g": g, "direction": side, "duration_s": seconds}
    )


def _a(acceleration: float, seconds: float) -> Leg:
    return Accelerate(kind="accelerate", acceleration_mps2=acceleration, duration_s=seconds)


def _target(east: float, north: float, heading: float, speed: float, *legs: Leg) -> Target:
    return Target(east_km=east, north_km=north, heading_deg=heading, speed_mps=speed, legs=legs)


# fmt: off
E3REC = _target(
    30.0, 110.0, 150.0, 250.0,
    _cv(150), _g(3, "R", 12), _cv(150), _g(2, "L", 25), _cv(120), _a(2.5, 20), _cv(150), _g(3, "R", 16),
    _cv(150), _a(-5, 20), _cv(120), _g(3, "L", 10), _g(3, "R", 10), _cv(150),
)
FIGHTER = _target(
    -40.0, 110.0, 150.0, 250.0,
    _cv(80), _g(2, "R", 20), _cv(60), _g(3, "L", 28), _a(1.25, 40), _cv(60), _g(1, "R", 60), _a(-2.5, 40),
    _cv(60), _g(3, "L", 12), _g(3, "R", 12), _cv(88),
)
AIRLINER = _target(
    -40.0, 110.0, 150.0, 220.0,
    _cv(100), _g(0.4, "R", 60), _cv(80), _a(-1, 60), _g(0.4, "L", 80), _cv(80), _a(1.5, 40), _cv(100),
)
# fmt: on
BY_HAND = {"E3REC": E3REC, "FIGHTER": FIGHTER, "AIRLINER": AIRLINER}


def duration(target: Target) -> float:
    """s, of all its legs."""
    return sum(leg.duration_s for leg in target.legs)


def path(target: Target, T: float) -> Array:
    """Positions (scans, 2), m, east and north, every `T` s from the first leg's start to the last's end."""
    built, problems = targets.build([target], [], RadarSettings(), duration(target), np.random.default_rng(0))
    assert not problems, problems
    time = np.arange(0.0, duration(target) + 1e-9, T)
    east, north, _ = built.positions(np.zeros(len(time), np.int64), time)
    return np.stack([east, north], axis=-1)


def random_target(rng: Generator) -> Target:
    """Straights and manoeuvres in turn for `RANDOM_S` s.

    Straights last exponentially long with mean 70 s (clipped to 10 to 200 s), manoeuvres 18 s (6 to 60 s).
    Of the manoeuvres 70 % are turns with a centripetal acceleration uniform in ±3 g, the rest change to a
    new speed, uniform in 150 to 300 m/s.
    """
    start = speed = float(rng.uniform(*_SPEED))
    legs: list[Leg] = []
    left = RANDOM_S
    draws: tuple[Callable[[], Leg], ...] = (
        lambda: _cv(_duration(rng, _STRAIGHT)),
        lambda: _manoeuvre(rng, speed),
    )
    while left > 0.0:
        leg = draws[len(legs) % 2]()
        # The speed after the whole leg: the last one is cut, and nothing follows it.
        speed += leg.acceleration_mps2 * leg.duration_s if isinstance(leg, Accelerate) else 0.0
        legs.append(leg.model_copy(update={"duration_s": min(leg.duration_s, left)}))
        left -= leg.duration_s
    east, north = rng.uniform(-100.0, 100.0, 2)
    return _target(float(east), float(north), float(rng.uniform(0.0, 360.0)), start, *legs)


def _duration(rng: Generator, law: tuple[float, float, float]) -> float:
    mean, least, most = law
    return float(np.clip(rng.exponential(mean), least, most))


def _manoeuvre(rng: Generator, speed: float) -> Leg:
    seconds = _duration(rng, _MANOEUVRE)
    if rng.random() < _TURNS:
        g = float(rng.uniform(-_MOST_G, _MOST_G))
        return _g(max(abs(g), 1e-6), "R" if g > 0 else "L", seconds)
    return _a((float(rng.uniform(*_SPEED)) - speed) / seconds, seconds)


def polar_noise(place: Array, sd_range: float, sd_azimuth_deg: float, rng: Generator) -> tuple[Array, Array]:
    """Measured range, m, and azimuth, rad, of positions (..., 2)."""
    distance = np.hypot(place[..., 0], place[..., 1]) + sd_range * rng.standard_normal(place.shape[:-1])
    azimuth = np.arctan2(place[..., 0], place[..., 1])
    return distance, azimuth + sd_azimuth_deg * DEG * rng.standard_normal(place.shape[:-1])
