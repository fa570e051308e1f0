"""A tracker at work on a simulated scene, given its tracks at the start."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from radar_console.core.messages import NO_CENTROIDS, TRACK, Sector, Table, TrackStatus, blank
from radar_console.core.units import KM, TURN
from radar_console.estimation.gaussian import Array
from radar_console.scenario import (
    Clutter,
    DiscClutter,
    RadarSettings,
    Scenario,
    Target,
    TrackerSettings,
)
from radar_console.simulator.radar import Simulator
from radar_console.tracker import Tracker

GIVEN = 10**9
"""The track given of target k has the number GIVEN + k, which is no plot's."""
T = 4.0
"""Time of a turn, s."""
_DISC = 3.0  # km, radius of the clutter around each target
_SECTORS = 4  # of a turn: the fewest, as tracks do not depend on them
_FIRST = TURN * (1.0 + 1e-9)  # rad, the end of the first turn
_LEAST_DENSITY = 1e-3  # per km², that a tracker without clutter is told
_GATE = 0.9999  # the probability of it: that of the figures in docs/studies.md


class Scene(NamedTuple):
    """Targets on straight courses in discs of clutter, 3 km about each, of one density.

    Attributes
    ----------
    state : (n, 4) at time 0: east, north, m, and their rates, m/s
    scans : turns of the antenna
    sd : standard deviation of a position in each axis, m; in azimuth it is that at `distance`
    distance : from the radar, m
    density : false centroids a scan, per km²
    """

    state: Array
    scans: int
    sd: float
    distance: float
    density: float


def simulator(scene: Scene, rng: Generator) -> Simulator:
    """The scene, played; detections and errors of the targets do not depend on the clutter's density."""
    targets = [
        Target(
            east_km=east / KM,
            north_km=north / KM,
            speed_mps=float(np.hypot(v_east, v_north)),
            heading_deg=float(np.degrees(np.arctan2(v_east, v_north)) % 360.0),
        )
        for east, north, v_east, v_north in scene.state.tolist()
    ]
    radar = RadarSettings(
        rotation_s=T,
        sectors=_SECTORS,
        returns="centroids",
        p_d=0.9,
        sd_range_m=scene.sd,
        sd_azimuth_deg=float(np.degrees(scene.sd / scene.distance)),
    )
    around = DiscClutter(radius_km=_DISC, density_per_km2=scene.density)
    scenario = Scenario(
        title="Study",
        duration_s=scene.scans * T,
        radar=radar,
        target=tuple(targets),
        clutter=Clutter(disc=(around,)),
    )
    return Simulator(scenario, rng)


class Played(NamedTuple):
    """A scene that was played once, for any number of trackers.

    Attributes
    ----------
    scene : what was played
    sectors : whole; those of the first turn without centroids
    given : TRACK, of the targets at the end of the first turn
    truth : TRUTH, at the end of every turn
    """

    scene: Scene
    sectors: list[Sector]
    given: Table
    truth: Table


def play(scene: Scene, rng: Generator) -> Played:
    """Play a scene; the tracks given are off by 2 `sd` in each axis and 10 m/s."""
    source = simulator(scene, rng)
    sectors = [
        sector.adding(centroids=NO_CENTROIDS) if sector.end < _FIRST else sector
        for sector in source.sectors()
    ]
    truth = np.concatenate([source.truth(T * turn) for turn in range(1, scene.scans + 1)])
    first = truth[truth["time"] == T]
    return Played(scene, sectors, given_tracks(first, scene.sd, rng), truth)


def follow(played: Played, settings: Mapping[str, Any], initiation: bool, seed: int) -> Table:
    """All rows of a tracker's tracks: TRACK. It gets those given at the end of the first turn.

    Parameters
    ----------
    settings : of [tracker], where they are not the default; it knows the density of the clutter
    initiation : tracks may start; else there is room for those given, and for no others
    seed : of the tracker
    """
    scene, given = played.scene, played.given
    known: dict[str, Any] = {"clutter_per_km2": max(scene.density, _LEAST_DENSITY), "gate_probability": _GATE}
    room = {} if initiation else {"max_tracks": len(given)}
    radar = played.sectors[0].radar
    tracker = Tracker(TrackerSettings(**(known | room | dict(settings))), radar, seed, threads=1)
    turn = sum(sector.end < _FIRST for sector in played.sectors)
    for sector in played.sectors[:turn]:
        tracker.push(sector)
    tracker.adopt(given)
    rows = [given, *(tracker.push(sector).tracks for sector in played.sectors[turn:])]
    last = tracker.flush()
    return np.concatenate(rows if last is None else [*rows, last.tracks])


def given_tracks(truth: Table, sd: float, rng: Generator, sd_velocity: float = 10.0) -> Table:
    """Confirmed tracks at the truth's instant, with errors of 2 `sd`, m, and `sd_velocity`, m/s."""
    tracks = blank(TRACK, len(truth))
    tracks["track"], tracks["time"] = GIVEN + truth["target"], truth["time"]
    tracks["status"], tracks["hit"], tracks["born"] = TrackStatus.CONFIRMED, True, truth["time"]
    deviations = {"east": 2 * sd, "north": 2 * sd, "v_east": sd_velocity, "v_north": sd_velocity}
    for name, deviation in deviations.items():
        tracks[name] = truth[name] + deviation * rng.standard_normal(len(truth))
        tracks["sd_" + name] = deviation
    return tracks
