"""How two ships, or any two that keep course and speed, pass each other: relative motion, CPA and TCPA.

Every function broadcasts over leading axes, so one own ship stands against any number of tracks.

Source: Bole, Wall, Norris, Radar and ARPA Manual, 3rd ed. 2014 (relative motion triangle, CPA and TCPA).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from radar_console.core.geometry import to_polar

Array = NDArray[np.floating]


class Encounter(NamedTuple):
    """What an own ship sees of a target; each (...).

    Attributes
    ----------
    distance : range, m
    bearing : rad in [0, 2π), clockwise from north
    course, speed : of the relative motion, rad in [0, 2π) and m/s
    cpa : distance at the closest point of approach, m
    tcpa : time to it, s, negative where it has passed; NaN where nothing moves
    """

    distance: Array
    bearing: Array
    course: Array
    speed: Array
    cpa: Array
    tcpa: Array


def encounter(own: ArrayLike, own_velocity: ArrayLike, target: ArrayLike, velocity: ArrayLike) -> Encounter:
    """The encounter of own ship with targets, if all keep course and speed.

    Parameters
    ----------
    own, target : (..., 2) m, east and north
    own_velocity, velocity : (..., 2) m/s, over ground

    Example: `encounter((0, 0), (0, 5), (0, 10e3), (0, -5))` is a meeting head on: relative course π,
    relative speed 10 m/s, CPA 0 m, TCPA 1000 s.
    """
    place = np.asarray(target, float) - np.asarray(own, float)
    motion = np.asarray(velocity, float) - np.asarray(own_velocity, float)
    place, motion = np.broadcast_arrays(place, motion)
    distance, bearing = to_polar(place[..., 0], place[..., 1])
    course, speed = course_and_speed(motion)
    cpa, tcpa = closest_approach(place, motion)
    return Encounter(distance, bearing, course, speed, cpa, tcpa)


def course_and_speed(velocity: ArrayLike) -> tuple[Array, Array]:
    """Course, rad in [0, 2π) clockwise from north, and speed, m/s, of velocities (..., 2), east and north."""
    v = np.asarray(velocity, float)
    speed, course = to_polar(v[..., 0], v[..., 1])
    return course, speed


def closest_approach(place: ArrayLike, motion: ArrayLike) -> tuple[Array, Array]:
    """CPA, m, and TCPA, s, of relative positions (..., 2), m, and velocities (..., 2), m/s.

    The distance |p + v t| is least at t = −p·v / v·v, and is |p × v| / |v| then. Without relative motion it
    stays |p| for ever, and no time is the closest: TCPA is NaN.
    """
    p, v = np.asarray(place, float), np.asarray(motion, float)
    speed = np.hypot(v[..., 0], v[..., 1])
    moves = speed > 0.0
    # By unit vectors: squares of tiny speeds would vanish.
    u = v / np.where(moves, speed, 1.0)[..., None]
    along = p[..., 0] * u[..., 0] + p[..., 1] * u[..., 1]
    across = np.abs(p[..., 0] * u[..., 1] - p[..., 1] * u[..., 0])
    tcpa = np.divide(-along, speed, out=np.full(np.broadcast(along, speed).shape, np.nan), where=moves)
    return np.where(moves, across, np.hypot(p[..., 0], p[..., 1])), tcpa
