"""The density of false centroids, estimated live, against the one that is there."""

import math

import numpy as np
import pytest
from scenes import Scene, held, one_turn, ring, run, settings, swarm, table_of

from radar_console.core.messages import Radar
from radar_console.core.units import TURN
from radar_console.tracker import Tracker
from radar_console.tracker.records import N_TRACKS

COAST = Radar("coast", rotation=4.0, max_range=60e3, sd_range=50.0, sd_azimuth=math.radians(0.1))


def after(scene, **changes):
    """The tracker after the scene, with its clutter estimated."""
    tracker = Tracker(settings(clutter_per_km2=None, particles=20, **changes), scene.radar, 7, 1)
    for sector in scene.sectors():
        tracker.push(sector)
    return tracker


def everywhere(tracker):
    """The estimate over the whole coverage, m⁻²."""
    clutter = tracker._world.clutter
    return float(clutter["all_near"] / clutter["all_area"])


@pytest.mark.parametrize("count", [300, 1000, 3000])
def test_uniform_clutter(count):
    """Within 15 %: the estimate rests on the neighbours of some thousand centroids."""
    density = count / (math.pi * 60e3**2)
    tracker = after(Scene(np.zeros((0, 4)), turns=10, clutter=density, radar=COAST))
    assert everywhere(tracker) == pytest.approx(density, rel=0.15)


def test_targets_are_no_clutter():
    """Targets far apart have no neighbours: the estimate is nothing but its prior."""
    tracker = after(Scene(ring(), turns=12))
    assert everywhere(tracker) == 0.0
    assert tracker.counts.confirmed == 25


def test_the_map_tells_where_the_clutter_is():
    """Ten times as much in the east as in the west: each half has its own estimate."""
    density, rng = 2000 / (math.pi * 60e3**2), np.random.default_rng(3)
    tracker = Tracker(settings(clutter_per_km2=None, particles=20), COAST, 7, 1)
    for turn in range(12):
        azimuth = np.concatenate([rng.uniform(0.0, math.pi, 1000), rng.uniform(math.pi, TURN, 100)])
        distance = 60e3 * np.sqrt(rng.random(1100))
        table = table_of(4.0 * turn + azimuth / TURN * 4.0, distance, azimuth, 1100 * turn)
        tracker.push(one_turn(table, turn, COAST))
    clutter = tracker._world.clutter
    half = clutter["near"].shape[1] // 2
    east = clutter["near"][:, :half].sum() / clutter["area"][:, :half].sum()
    west = clutter["near"][:, half:].sum() / clutter["area"][:, half:].sum()
    assert east == pytest.approx(density, rel=0.15)
    assert west == pytest.approx(density / 10, rel=0.5)  # some 30 neighbours


@pytest.mark.parametrize("mean", [5.0, 20.0])
def test_a_patch_that_moves_with_a_target(mean):
    """What a track met on its way says how dense it is there, though the map has not seen it yet."""
    scene = Scene(np.array([(-20e3, 60e3, 250.0, 0.0)]), turns=25, disc=(3e3, mean))
    tracker = after(scene)
    world = tracker._world
    tracks = world.tracks[: world.books.size[N_TRACKS]]
    place = scene.targets[0, :2] + scene.edges[-1] * scene.targets[0, 2:]
    near = tracks[np.hypot(*(tracks["x"][:, :2] - place).T) < 3e3]
    longest = near[np.argmax(near["hits"])]
    density = mean / (math.pi * 3e3**2)
    assert longest["hits"] > 10
    # It lies anywhere in the patch, so a part of what it counts in is outside.
    assert density / 4 < longest["near"] / longest["exposure"] < 2 * density


@pytest.mark.parametrize("count", [100, 1000])
@pytest.mark.parametrize("initiation", ["auto", "branching"])
def test_clutter_alone_makes_no_track(count, initiation):
    scene = Scene(np.zeros((0, 4)), turns=15, clutter=count / (math.pi * 300e3**2))
    rows, counts = run(scene.sectors(), clutter_per_km2=None, initiation=initiation, particles=20)
    assert len(held(rows)) <= 1  # of ten thousand tracks that were started
    assert counts.centroids > 10 * count


def test_a_known_density_is_taken_as_it_is():
    """With the true density given, the estimate finds the same targets."""
    scene = Scene(swarm(20, seed=3), turns=10, clutter=300 / (math.pi * 300e3**2))
    told, _ = run(scene.sectors(), clutter_per_km2=300e6 / (math.pi * 300e3**2))
    found, _ = run(scene.sectors(), clutter_per_km2=None)
    assert held(found).tolist() == held(told).tolist()
