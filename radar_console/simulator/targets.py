"""Targets as sequences of legs: straight, accelerating, or a coordinated turn.

On every leg the path bends at a constant rate ω and the speed grows at a constant rate a, one of the
two being zero. With θ = ω τ after the time τ, positive to the right, the displacement is the chord

    Δp = (v τ + a τ²/2) · sinc(θ/2) · (sin(h + θ/2), cos(h + θ/2)),   sinc(x) = sin(x)/x,

east and north, for the course h and the speed v at the leg's start: the rotation matrix of the
coordinated turn by the half-angle identities, without its cancellation as θ → 0.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radar_console.core.geometry import LocalFrame, ground_range, to_cartesian
from radar_console.core.messages import TRUTH, Table, blank
from radar_console.core.units import DEG, G0, KM, KMH, KT
from radar_console.scenario import Accelerate, Leg, RadarSettings, Swarm, Target, Turn

Array = NDArray[np.floating]
Problems = list[tuple[str, str]]


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """n targets with up to m legs each; unused legs begin at infinity.

    Attributes
    ----------
    begin : (n, m) when a leg begins, s
    east, north : (n, m) position there, m in the frame of the radar's site
    speed, course : (n, m) m/s, rad
    acceleration, turn_rate : (n, m) m/s², rad/s to the right
    height, climb : (n,) m above sea level at the first leg's begin, NaN in a flat world; m/s
    start, end : (n,) lifetime, start ≤ t < end, s
    gain : (n,) echo power relative to the radar's reference target
    """

    begin: Array
    east: Array
    north: Array
    speed: Array
    course: Array
    acceleration: Array
    turn_rate: Array
    height: Array
    climb: Array
    start: Array
    end: Array
    gain: Array

    def __len__(self) -> int:
        return len(self.start)

    @property
    def top_speed(self) -> Array:
        """(n,) never exceeded, m/s; every leg's end is the next one's start."""
        top: Array = np.max(self.speed, axis=1, initial=0.0)
        return top

    def alive(self, target: NDArray[np.int64], time: Array) -> NDArray[np.bool_]:
        """Which of the pairs (target, time) lie in the target's lifetime."""
        alive: NDArray[np.bool_] = (self.start[target] <= time) & (time < self.end[target])
        return alive

    def positions(self, target: NDArray[np.int64], time: Array) -> tuple[Array, Array, Array]:
        """East, north and height, m, of pairs (target, time), each (k,)."""
        leg, tau = self._leg(target, time)
        speed, theta = self.speed[target, leg], self.turn_rate[target, leg] * tau
        path = tau * (speed + 0.5 * self.acceleration[target, leg] * tau)
        chord, bearing = path * np.sinc(theta / (2.0 * np.pi)), self.course[target, leg] + 0.5 * theta
        east = self.east[target, leg] + chord * np.sin(bearing)
        north = self.north[target, leg] + chord * np.cos(bearing)
        return east, north, self.height[target] + self.climb[target] * (time - self.start[target])

    def velocities(self, target: NDArray[np.int64], time: Array) -> tuple[Array, Array, Array]:
        """East, north and up, m/s, of pairs (target, time), each (k,); up is NaN in a flat world."""
        leg, tau = self._leg(target, time)
        speed = self.speed[target, leg] + self.acceleration[target, leg] * tau
        course = self.course[target, leg] + self.turn_rate[target, leg] * tau
        up = np.where(np.isnan(self.height[target]), np.nan, self.climb[target])
        return speed * np.sin(course), speed * np.cos(course), up

    def truth(self, time: float, site_height: float) -> Table:
        """The targets alive at `time`: TRUTH, up counted from the site."""
        every = np.arange(len(self))
        target = every[self.alive(every, np.full(len(self), time))]
        at = np.full(len(target), time)
        table = blank(TRUTH, len(target))
        table["time"], table["target"] = at, target
        table["east"], table["north"], height = self.positions(target, at)
        table["up"] = height - site_height
        table["v_east"], table["v_north"], table["v_up"] = self.velocities(target, at)
        return table

    def _leg(self, target: NDArray[np.int64], time: Array) -> tuple[NDArray[np.int64], Array]:
        """Which leg a target is on, and for how long, s."""
        leg = np.zeros(len(target), np.int64)
        for later in range(1, self.begin.shape[1]):
            leg += time >= self.begin[target, later]
        return leg, time - self.begin[target, leg]


# What a leg is made of, in the order of the attributes of Targets: begin, east, north, speed,
# course, acceleration, turn rate.
_LEG = 7
_Legs = list[tuple[float, ...]]


def build(
    targets: Sequence[Target],
    swarms: Sequence[Swarm],
    radar: RadarSettings,
    duration: float,
    rng: np.random.Generator,
) -> tuple[Targets, Problems]:
    """The targets of a scenario, swarms last, and everything that is wrong with them."""
    problems: Problems = []
    legs: list[_Legs] = []
    for number, target in enumerate(targets):
        legs.append(_legs(target, radar, f"target[{number}]", problems))
        if target.start_s >= duration:
            problems.append(
                (
                    f"target[{number}].start_s",
                    f"the target never appears, the scenario ends at {duration:g} s",
                )
            )
    height = [np.nan if target.height_m is None else target.height_m for target in targets]
    built = _stack(
        legs,
        np.array(height, float),
        climb=np.array([target.climb_mps for target in targets], float),
        start=np.array([target.start_s for target in targets], float),
        end=np.array([np.inf if target.end_s is None else target.end_s for target in targets], float),
        gain=np.array([10.0 ** (target.rcs_db / 10.0) for target in targets], float),
    )
    swarm_legs = [
        leg
        for number, swarm in enumerate(swarms)
        for leg in _swarm(swarm, radar, duration, rng, f"swarm[{number}]", problems)
    ]
    if swarm_legs:
        built = _stack([*legs, *swarm_legs], *_with_swarm(built, len(swarm_legs)))
    return built, problems


def leaving(
    targets: Targets,
    distance: Callable[[NDArray[np.int64], Array], Array],
    count: int,
    max_range: float,
    duration: float,
) -> Problems:
    """Which of the first `count` targets leave the instrumented range in their lifetime, and when.

    `distance` (target, time) is the slant range from the radar, m. Judged every second.
    """
    problems: Problems = []
    for number in range(count):
        last = min(targets.end[number], duration)
        time = np.append(np.arange(targets.start[number], last, 1.0), last)
        beyond = np.flatnonzero(distance(np.full(len(time), number), time) > max_range)
        if beyond.size == 0:
            continue
        first = time[beyond[0]]
        limit = f"the instrumented range of {max_range / KM:g} km"
        what = (
            f"starts beyond {limit}; move its start or increase radar.max_range_km"
            if beyond[0] == 0
            else f"leaves {limit} at {first:.0f} s; change its legs, or set end_s = {first - 1.0:.0f}"
        )
        problems.append((f"target[{number}]", what))
    return problems


def _legs(target: Target, radar: RadarSettings, path: str, problems: Problems) -> _Legs:
    """The legs of one target and the straight one after them."""
    east, north = _start(target, radar, path, problems)
    time, speed, course = target.start_s, target.speed, target.heading_deg * DEG
    legs: _Legs = []
    for number, leg in enumerate(target.legs):
        acceleration, turn_rate = _bend(leg, speed, f"{path}.legs[{number}]", problems)
        legs.append((time, east, north, speed, course, acceleration, turn_rate))
        one = _stack([legs[-1:]], *np.zeros((5, 1)))
        end = np.array([time + leg.duration_s])
        (east,), (north,), _ = one.positions(np.zeros(1, np.int64), end)
        time += leg.duration_s
        speed += acceleration * leg.duration_s
        course += turn_rate * leg.duration_s
    legs.append((time, east, north, speed, course, 0.0, 0.0))
    return legs


def _start(target: Target, radar: RadarSettings, path: str, problems: Problems) -> tuple[float, float]:
    """East and north, m; a start in polar coordinates is the slant range that the radar sees."""
    if target.range_km is not None and target.azimuth_deg is not None:
        height = np.nan if target.height_m is None else target.height_m
        ground = ground_range(target.range_km * KM, height, radar.height_m)
        east, north = to_cartesian(ground, target.azimuth_deg * DEG)
        return float(east), float(north)
    if target.latitude_deg is not None and target.longitude_deg is not None:
        site = radar.message.site
        if site is None:
            problems.append(
                (f"{path}.latitude_deg", "needs a radar on the map: radar.latitude_deg and longitude_deg")
            )
            return 0.0, 0.0
        east, north = LocalFrame(site).from_wgs84(target.latitude_deg, target.longitude_deg)
        return float(east), float(north)
    assert target.east_km is not None
    assert target.north_km is not None
    return target.east_km * KM, target.north_km * KM


def _bend(leg: Leg, speed: float, path: str, problems: Problems) -> tuple[float, float]:
    """Acceleration, m/s², and turn rate, rad/s, of a leg that is entered at `speed`."""
    if isinstance(leg, Accelerate):
        if speed + leg.acceleration_mps2 * leg.duration_s < -1e-9 * speed:
            stop = -speed / leg.acceleration_mps2
            problems.append((f"{path}.duration_s", f"the target stands still after {stop:.1f} s of this leg"))
            return 0.0, 0.0
        return leg.acceleration_mps2, 0.0
    if isinstance(leg, Turn):
        if speed <= 0.0:
            problems.append((path, "a target that stands still can't turn"))
            return 0.0, 0.0
        side = 1.0 if leg.direction == "right" else -1.0
        return 0.0, side * leg.acceleration_g * G0 / speed
    return 0.0, 0.0


def _stack(
    legs: Sequence[_Legs], height: Array, climb: Array, start: Array, end: Array, gain: Array
) -> Targets:
    """Pad the legs of all targets to the same number."""
    most = max((len(one) for one in legs), default=1)
    table = np.zeros((_LEG, len(legs), most))
    table[0] = np.inf
    for target, one in enumerate(legs):
        table[:, target, : len(one)] = np.array(one).T
    begin, east, north, speed, course, acceleration, turn_rate = table
    return Targets(
        begin, east, north, speed, course, acceleration, turn_rate, height, climb, start, end, gain
    )


def _with_swarm(targets: Targets, count: int) -> tuple[Array, Array, Array, Array, Array]:
    """The attributes per target, with those of `count` members of swarms appended."""
    return (
        np.append(targets.height, np.full(count, np.nan)),
        np.append(targets.climb, np.zeros(count)),
        np.append(targets.start, np.zeros(count)),
        np.append(targets.end, np.full(count, np.inf)),
        np.append(targets.gain, np.ones(count)),
    )


_ATTEMPTS = 200


def _swarm(
    swarm: Swarm,
    radar: RadarSettings,
    duration: float,
    rng: np.random.Generator,
    path: str,
    problems: Problems,
) -> list[_Legs]:
    """One straight leg for every member; members that would leave the instrumented range are redrawn.

    Relative to the radar the path is straight, so its farthest point is one of its ends.
    """
    limit = radar.max_range_km * KM
    if swarm.max_range_km * KM > limit:
        problems.append((f"{path}.max_range_km", f"exceeds radar.max_range_km = {radar.max_range_km:g}"))
        return []
    own = np.array(to_cartesian(radar.speed_kt * KT, radar.course_deg * DEG)) * duration
    members = np.empty((0, 4))
    for _ in range(_ATTEMPTS):
        if len(members) >= swarm.count:
            break
        inner, outer = swarm.min_range_km * KM, swarm.max_range_km * KM
        distance = np.sqrt(rng.uniform(inner**2, outer**2, swarm.count))
        east, north = to_cartesian(distance, rng.uniform(0.0, 2.0 * np.pi, swarm.count))
        speed = rng.uniform(swarm.min_speed_kmh * KMH, swarm.max_speed_kmh * KMH, swarm.count)
        course = rng.uniform(0.0, 2.0 * np.pi, swarm.count)
        travel = np.array(to_cartesian(speed * duration, course))
        stays = np.hypot(east + travel[0] - own[0], north + travel[1] - own[1]) <= limit
        members = np.vstack([members, np.column_stack([east, north, speed, course])[stays]])
    if len(members) < swarm.count:
        problems.append(
            (path, "hardly any course stays in the instrumented range; lower max_speed_kmh or duration_s")
        )
        return []
    return [[(0.0, *member, 0.0, 0.0)] for member in members[: swarm.count].tolist()]
