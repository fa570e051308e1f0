"""Streams of centroids for the tracker's tests: straight targets, noise, clutter, any cut."""

import math
from dataclasses import dataclass, field

import numpy as np

from radar_console.core.geometry import wrap
from radar_console.core.messages import CENTROID, NO_TRACKS, Radar, Sector, TrackStatus, blank
from radar_console.core.units import TURN
from radar_console.scenario import TrackerSettings
from radar_console.tracker import Tracker

RADAR = Radar("test", rotation=4.0, max_range=300e3, sd_range=50.0, sd_azimuth=math.radians(0.1))

LAG = math.radians(1.5)  # of the watermark behind the beam


@dataclass
class Scene:
    """Targets (n, 4): east, north, v_east, v_north at time 0; clutter as a density in m⁻²."""

    targets: np.ndarray
    turns: int = 20
    p_d: float = 0.9
    clutter: float = 0.0
    disc: tuple[float, float] = (0.0, 0.0)  # radius m, mean number around each target and turn
    radar: Radar = RADAR
    seed: int = 1
    noise: float = 1.0
    turn_times: list[float] = field(default_factory=list)  # of each turn, s; the radar's if empty
    sensor: tuple[float, float] = (0.0, 0.0)  # m/s: its sectors say that the radar moves

    def __post_init__(self):
        times = self.turn_times or [self.radar.rotation] * self.turns
        self.turns = len(times)
        self.edges = np.concatenate([[0.0], np.cumsum(times)])
        self.angles = TURN * np.arange(self.turns + 1)

    def time_of(self, angle):
        return np.interp(angle, self.angles, self.edges)

    def truth(self, t):
        """(n, 2) positions at times t, a scalar or (n,)."""
        return self.targets[:, :2] + np.asarray(t).reshape(-1, 1) * self.targets[:, 2:]

    def illuminations(self, finest=20000):
        """Unwrapped angle, time and target of each meeting of the beam with a target."""
        angle = np.linspace(0, self.angles[-1], self.turns * finest // 20 + 1)
        t = self.time_of(angle)
        found = []
        for k, target in enumerate(self.targets):
            e, n = target[0] + t * target[2], target[1] + t * target[3]
            phase = np.unwrap(np.arctan2(e, n))
            lead = angle - phase  # the beam meets the target where this passes a multiple of a turn
            number = np.floor(lead / TURN)
            at = np.flatnonzero(np.diff(number) > 0)
            part = (number[at + 1] * TURN - lead[at]) / (lead[at + 1] - lead[at])
            found += [(angle[i] + f * (angle[1] - angle[0]), k) for i, f in zip(at, part, strict=True)]
        return [(a, float(self.time_of(a)), k) for a, k in sorted(found)]

    def centroids(self):
        """Table CENTROID and its unwrapped angles, in the order of the angles."""
        rng = np.random.default_rng(self.seed)
        rows = []  # angle, time, range, azimuth, target
        for a, t, k in self.illuminations():
            if rng.random() >= self.p_d:
                continue
            e, n = self.targets[k, :2] + t * self.targets[k, 2:]
            s_r, s_a = self.noise * self.radar.sd_range, self.noise * self.radar.sd_azimuth
            r, azimuth = math.hypot(e, n) + s_r * rng.normal(), math.atan2(e, n) + s_a * rng.normal()
            rows.append((a, t, abs(r), azimuth, k))
        for turn in range(self.turns):
            count = rng.poisson(self.clutter * math.pi * self.radar.max_range**2)
            r = self.radar.max_range * np.sqrt(rng.random(count))
            a = TURN * (turn + rng.random(count))
            rows += [(x, float(self.time_of(x)), y, x, -1) for x, y in zip(a, r, strict=True)]
            radius, mean = self.disc
            middle = self.truth(self.edges[turn] + 0.5 * (self.edges[turn + 1] - self.edges[turn]))
            for centre in middle if mean else []:
                for _ in range(rng.poisson(mean)):
                    d, b = radius * math.sqrt(rng.random()), TURN * rng.random()
                    e, n = centre[0] + d * math.sin(b), centre[1] + d * math.cos(b)
                    x = TURN * turn + math.atan2(e, n) % TURN
                    rows.append((x, float(self.time_of(x)), math.hypot(e, n), x, -1))
        rows.sort()
        table = blank(CENTROID, len(rows))
        table["ordinal"] = np.arange(len(rows))
        for name, column in (("time", 1), ("range", 2), ("azimuth", 3)):
            table[name] = [row[column] for row in rows]
        table["azimuth"] %= TURN
        table["sd_range"], table["sd_azimuth"] = self.radar.sd_range, self.radar.sd_azimuth
        angles = np.array([row[0] for row in rows])
        angles += wrap(table["azimuth"] - angles)
        self.origin = np.array([row[4] for row in rows], int)
        return table, angles

    def sectors(self, pushes=64, cuts=None, lag=LAG, rotate=0.0):
        """Sectors cut at `pushes` equal angles a turn, or at the unwrapped angles `cuts`."""
        table, angles = self.centroids()
        table["azimuth"] = (table["azimuth"] + rotate) % TURN
        if cuts is None:
            cuts = TURN * np.arange(1, pushes * self.turns + 1) / pushes
        begin = 0.0
        for end in cuts:
            complete = max(end - lag, 0.0) if end < self.angles[-1] else end
            # A centroid appears a lag after the beam has met it: with the sector that ends there.
            low = max(begin - lag, 0.0) if begin > 0 else -math.inf
            part = (angles >= low) & (angles < (complete if end < self.angles[-1] else math.inf))
            stop = float(self.time_of(end))
            yield Sector(
                self.radar, float(self.time_of(begin)), stop, begin + rotate, float(end) + rotate,
                complete + rotate, (self.sensor[0] * stop, self.sensor[1] * stop, 0.0),
                centroids=table[part],
            )  # fmt: skip
            begin = float(end)


def ring(count=25, speed=222.2):
    """The published scene: 13 targets at 250 km and 12 at 150 km, all on their way to the radar."""
    outer = [(250e3, math.radians(27.7) * k) for k in range(13)]
    inner = [(150e3, math.radians(30.0) * k) for k in range(12)]
    polar = (outer + inner)[:count]
    return np.array(
        [(r * math.sin(a), r * math.cos(a), -speed * math.sin(a), -speed * math.cos(a)) for r, a in polar]
    )


def swarm(count, seed=0, max_range=250e3, speed=(100.0, 300.0)):
    """Targets all over the coverage, on random courses."""
    rng = np.random.default_rng(seed)
    r, a = max_range * np.sqrt(rng.random(count)), TURN * rng.random(count)
    v, b = rng.uniform(*speed, count), TURN * rng.random(count)
    return np.stack([r * np.sin(a), r * np.cos(a), v * np.sin(b), v * np.cos(b)], axis=1)


def rows_of(sectors):
    """All track rows of a stream."""
    return np.concatenate([NO_TRACKS, *(sector.tracks for sector in sectors)])


def settings(**changes):
    """The tracker's, with few particles and a known, thin clutter."""
    return TrackerSettings(**({"particles": 100, "clutter_per_km2": 1e-4} | changes))


def run(sectors, radar=RADAR, seed=7, threads=1, **changes):
    """All track rows of a stream, and the tracker's counts."""
    tracker = Tracker(settings(**changes), radar, seed, threads)
    return rows_of(tracker(sectors)), tracker.counts


def same(a, b):
    return a.tobytes() == b.tobytes()


def held(rows):
    """Numbers of the tracks that were confirmed at some time."""
    return np.unique(rows["track"][rows["status"] == TrackStatus.CONFIRMED])


def of_track(rows, track):
    return rows[rows["track"] == track]


def target_of(rows, scene, track):
    """The target that most plots of a track are from; -1 if it is clutter."""
    mine = of_track(rows, track)
    origin = scene.origin[mine["plot"][mine["plot"] >= 0]]
    if not len(origin) or np.mean(origin >= 0) <= 0.5:
        return -1
    return int(np.bincount(origin[origin >= 0]).argmax())


def swaps(rows, scene):
    """How many tracks end with another target's plots than they were confirmed with, five each."""
    count = 0
    for track in held(rows):
        mine = of_track(rows, track)
        origin = scene.origin[mine["plot"][mine["hit"] & (mine["status"] == TrackStatus.CONFIRMED)]]
        origin = origin[origin >= 0]
        count += np.bincount(origin[:5]).argmax() != np.bincount(origin[-5:]).argmax()
    return count


def one_turn(table, turn=0, radar=RADAR, **changes):
    """A sector of a whole turn of 4 s."""
    values = {"start": 4.0 * turn, "stop": 4.0 * turn + 4.0, "begin": TURN * turn, "end": TURN * (turn + 1)}
    values |= {"complete": values["end"]} | changes
    return Sector(radar, **values, centroids=table)


def table_of(time, distance, azimuth, first=0, **values):
    """Centroids that say nothing but where and when, and `values`; numbered from `first`."""
    time, distance, azimuth = np.broadcast_arrays(*(np.asarray(v, float) for v in (time, distance, azimuth)))
    table = blank(CENTROID, time.size)
    table["time"], table["range"], table["azimuth"] = time.ravel(), distance.ravel(), azimuth.ravel()
    table["ordinal"] = first + np.arange(time.size)
    return with_values(table, values)


def with_values(table, values):
    """A copy of the table with some columns replaced."""
    table = table.copy()
    for name, value in values.items():
        table[name] = value
    return table


def nothing(first, last):
    """Turns without a centroid."""
    return [one_turn(table_of([], [], []), turn) for turn in range(first, last)]


STATE_COLUMNS = ("time", "east", "north", "v_east", "v_north")
SD_COLUMNS = ("sd_east", "sd_north", "sd_v_east", "sd_v_north")


def sound(rows):
    """Every row has a state and its deviations, and the probability of a plot is one."""
    numbers = all(np.isfinite(rows[name]).all() for name in STATE_COLUMNS + SD_COLUMNS)
    deviations = all((rows[name] >= 0.0).all() for name in SD_COLUMNS)
    seen = rows["plot"] >= 0
    probability = rows["probability"][seen]
    certain = bool(np.all((probability >= 0.0) & (probability <= 1.0 + 1e-9)))
    return numbers and deviations and certain and bool(np.isnan(rows["probability"][~seen]).all())


FILTERS = {
    "kalman": {"filter": "kalman"},
    "extended": {"filter": "extended"},
    "unscented": {"filter": "unscented"},
    "imm": {"filter": "imm"},
    "adapted": {"filter": "particle"},
    "optimal": {"filter": "particle", "proposal": "optimal"},
    "prior": {"filter": "particle", "proposal": "prior"},
    "two models": {"filter": "particle", "models": ("cv", "ct")},
}
