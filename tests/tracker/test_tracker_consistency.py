"""Confirmed tracks of the whole tracker believe what is so: their NIS, in a world of their own model."""

import math

import numpy as np
import pytest
from scenes import RADAR, one_turn, settings, table_of

from radar_console.core.units import TURN
from radar_console.estimation.measurement import convert
from radar_console.estimation.motion import constant_velocity
from radar_console.tracker import Tracker, gating
from radar_console.tracker.records import CONFIRMED, N_TRACKS

Q, TARGETS, TURNS, FIRST = 5.0, 20, 24, 10


MATCHED = {
    "particles": 1000,
    "process_noise_m2ps3": Q,
    "outliers": 0.0,
    "p_d": 0.999,
    "clutter_per_km2": 1e-6,
}


def flights(rng):
    """Times and positions (turns, 2) where the beam meets targets of nearly constant velocity."""
    for k in range(TARGETS):
        azimuth = TURN * (k + 0.5) / TARGETS
        r, speed, course = rng.uniform(60e3, 90e3), rng.uniform(50.0, 100.0), rng.uniform(0.0, TURN)
        x = np.array([r * math.sin(azimuth), r * math.cos(azimuth)])
        x = np.append(x, [speed * math.sin(course), speed * math.cos(course)])
        t, times, places = 4.0 * azimuth / TURN, [], []
        for turn in range(TURNS):
            due = t
            for _ in range(4 if turn else 0):  # the time at which the beam is where the target then is
                east, north = x[:2] + (due - t) * x[2:]
                due = 4.0 * (turn + math.atan2(east, north) % TURN / TURN)
            if due > t:
                F, noise = constant_velocity(due - t, Q)
                x = F @ x + np.linalg.cholesky(noise) @ rng.normal(size=4)
            t = due
            times.append(t)
            places.append(x[:2].copy())
        yield np.array(times), np.array(places)


def nis_of(seed, **changes):
    """(passes,) normalised innovations squared of all confirmed tracks, from pass `FIRST` on."""
    rng = np.random.default_rng(seed)
    tracker = Tracker(settings(**(MATCHED | changes)), RADAR, seed, 1)
    found, paths = [], list(flights(rng))
    for turn in range(TURNS):
        rows = []
        for number, (times, places) in enumerate(paths):
            east, north = places[turn]
            distance = math.hypot(east, north) + RADAR.sd_range * rng.normal()
            azimuth = math.atan2(east, north) + RADAR.sd_azimuth * rng.normal()
            rows.append((times[turn], distance, azimuth % TURN, number))
        time, distance, azimuth, number = np.array(sorted(rows)).T
        world = tracker._world
        tracks = world.tracks[: world.books.size[N_TRACKS]]
        tracks = tracks[tracks["level"] == CONFIRMED]
        for t, r, a in zip(time, distance, azimuth, strict=True) if turn >= FIRST else ():
            e, n, ee, en, nn = convert(r, a, RADAR.sd_range, RADAR.sd_azimuth)
            track = tracks[np.argmin(np.hypot(tracks["x"][:, 0] - e, tracks["x"][:, 1] - n))]
            x, y, p_ee, p_en, p_nn = gating.predicted(track, t - track["t"])
            S = np.array([[p_ee + ee, p_en + en], [p_en + en, p_nn + nn]])
            nu = np.array([e - x, n - y])
            found.append(nu @ np.linalg.solve(S, nu))
        tracker.push(one_turn(table_of(time, distance, azimuth, TARGETS * turn), turn))
    assert tracker.counts.confirmed == TARGETS
    assert tracker.counts.lost == 0
    return np.array(found)


@pytest.mark.parametrize(
    "changes",
    [
        {"filter": "kalman"},
        {"filter": "extended"},
        {"filter": "unscented"},
        {"filter": "imm", "models": ("cv",)},
        {"filter": "particle"},
        {"filter": "particle", "proposal": "optimal"},
    ],
    ids=["kalman", "extended", "unscented", "imm", "adapted", "optimal"],
)
def test_innovations_are_what_the_tracks_expect(changes):
    """The mean lies in the 95 % band of χ² with two degrees of freedom for each plot."""
    nis = nis_of(1, **changes)
    assert len(nis) == TARGETS * (TURNS - FIRST)
    assert nis.mean() == pytest.approx(2.0, abs=1.96 * 2.0 / math.sqrt(len(nis)))
