"""The laws of tracks that are updated as the beam passes."""

import math
from collections import Counter

import numpy as np
import pytest
from scenes import (
    FILTERS,
    RADAR,
    Scene,
    held,
    ring,
    run,
    same,
    settings,
    sound,
    swarm,
    with_values,
)

from radar_console.core.messages import Sector
from radar_console.core.units import TURN
from radar_console.tracker import Tracker, gating, stage
from radar_console.tracker.records import BEAM, CONFIRMED, N_EDGES, N_MEMBERS, N_TRACKS


@pytest.fixture(scope="module")
def cluttered():
    """Targets some of which share plots, in clutter."""
    targets = np.concatenate([ring(13), swarm(20, seed=6, max_range=25e3)])
    return Scene(targets, turns=7, clutter=100 / (math.pi * 300e3**2), sensor=(7.0, -3.0))


def cuts(scene, kind):
    """Sectors with so many equal pushes a turn, or cut anywhere.

    A sector says where the radar is at its end, so an empty one says first where it began.
    """
    yield Sector(scene.radar, 0.0, 0.0, 0.0, 0.0, 0.0)
    if kind != "random":
        yield from scene.sectors(kind)
        return
    end = TURN * scene.turns
    where = np.random.default_rng(5).uniform(0, end, 900 * scene.turns)
    yield from scene.sectors(cuts=np.append(np.sort(where), end))


@pytest.mark.parametrize("name", FILTERS)
def test_the_cut_of_the_stream_changes_no_bit(cluttered, name):
    """Law 1."""
    reference, counts = run(cuts(cluttered, 64), clutter_per_km2=None, **FILTERS[name])
    assert len(held(reference)) >= 25
    assert sound(reference)
    for kind in (1, 16, 256, "random"):
        rows, again = run(cuts(cluttered, kind), clutter_per_km2=None, **FILTERS[name])
        assert same(rows, reference), kind
        assert again == counts


@pytest.mark.parametrize("angle", [0.1, 1.0, math.pi / 2, 3.0, 5.7])
def test_a_rotated_scene_gives_the_same_kalman_tracks(angle):
    """Law 2: to 1e-9 m, the rounding of positions 3e5 m out over ten updates."""
    scene = Scene(swarm(40, seed=3), turns=10, p_d=0.9)
    tentative = {"confirm_hits": 62, "confirm_passes": 62, "wait_deg": 90.0}  # never confirmed
    a, _ = run(scene.sectors(), **tentative)
    b, _ = run(scene.sectors(rotate=angle), **tentative)
    a, b = (np.sort(rows, order=["track", "plot", "status"]) for rows in (a[a["hit"]], b[b["hit"]]))
    assert len(a) == len(b) > 250
    for name in ("track", "plot", "status"):
        assert np.array_equal(a[name], b[name])
    c, s = math.cos(angle), math.sin(angle)
    assert np.abs(b["east"] - (c * a["east"] + s * a["north"])).max() < 1e-9
    assert np.abs(b["north"] - (c * a["north"] - s * a["east"])).max() < 1e-9


@pytest.mark.parametrize("angle", [1.0, 4.0])
def test_a_rotated_scene_gives_the_same_particle_tracks(angle):
    """The noise turns with the track; what is left is the rounding of single precision, 1e-7 of the
    spread of the cloud (1 km), through the resampling: far below the noise of the measurement."""
    scene = Scene(ring(), turns=10, p_d=1.0)
    a, _ = run(scene.sectors(), wait_deg=90.0)
    b, _ = run(scene.sectors(rotate=angle), wait_deg=90.0)
    # The rotated stream ends elsewhere in the last turn.
    a, b = (np.sort(rows[rows["hit"] & (rows["time"] < 35)], order=["track", "plot"]) for rows in (a, b))
    assert np.array_equal(a["plot"], b["plot"])
    assert np.array_equal(a["status"], b["status"])
    c, s = math.cos(angle), math.sin(angle)
    apart = np.abs(b["east"] - (c * a["east"] + s * a["north"]))
    # Whether copies are parted is a threshold, which rounding can decide: then other noise is drawn, and
    # the track goes on elsewhere within its error (the beam's is 440 m at 250 km).
    assert np.mean(apart < 0.1) > 0.95
    assert apart.max() < 3.0 * 440.0


@pytest.mark.parametrize("bins", [64, 1024])
def test_another_number_of_bins_leaves_the_states_as_they_are(bins):
    """Law 6, without forced closes."""
    scene = Scene(swarm(60, seed=4), turns=8)
    a, counts = run(scene.sectors(), wait_deg=120.0)
    b, _ = run(scene.sectors(), wait_deg=120.0, bins=bins)
    assert counts.forced == 0
    a, b = (np.sort(rows[rows["hit"]], order=["track", "plot"]) for rows in (a, b))
    assert np.array_equal(a["plot"], b["plot"])
    assert np.array_equal(a["east"], b["east"])


JITTER = [4.0 * factor for factor in (1.0, 0.8, 1.2, 1.1, 0.9) * 4]
DOUBLING = [4.0, 8.0, 4.0, 2.0, 4.0, 8.0, 4.0, 2.0] * 3
STALL = [4.0] * 8 + [24.0] + [4.0] * 8


def service_count(rows, track):
    return int((rows["track"] == track).sum())


@pytest.mark.parametrize(
    "times", [[4.0] * 25, JITTER, DOUBLING, STALL], ids=["even", "jitter", "x2", "stall"]
)
@pytest.mark.parametrize(
    "target",
    [
        (-8e3, 60e3, 250.0, 0.0),  # across north
        (-6e3, 50.0, 220.0, 0.0),  # over the radar, 50 m beside it
        (-6e3, 300.0, 220.0, 0.0),
        (-6e3, 3000.0, 220.0, 0.0),
        (100e3, -80e3, 0.0, 240.0),
    ],
)
def test_a_track_is_served_once_for_every_time_the_beam_meets_its_target(target, times):
    """Law 3."""
    scene = Scene(np.array([target]), p_d=1.0, turn_times=times, noise=0.2)
    rows, counts = run(scene.sectors(), scene.radar, p_d=0.95, process_noise_m2ps3=4.0)
    assert counts.lost == 0
    assert counts.confirmed == 1
    track = held(rows)[0]
    met = [a for a, _, _ in scene.illuminations()]
    since = rows["born"][rows["track"] == track][0]
    expected = sum(scene.time_of(a) >= since - 1e-3 for a in met)
    assert abs(service_count(rows, track) - expected) <= 1


@pytest.mark.parametrize("times", [[4.0] * 25, JITTER, DOUBLING], ids=["even", "jitter", "x2"])
def test_a_track_right_over_the_radar_is_kept(times):
    """Law 3 where the bearing has no meaning for a moment."""
    scene = Scene(np.array([(-6e3, 0.0, 220.0, 0.0)]), p_d=1.0, turn_times=times, noise=0.2)
    rows, counts = run(scene.sectors(), p_d=0.95, process_noise_m2ps3=4.0)
    assert sound(rows)
    assert counts.lost == 0
    assert len(held(rows)) == 1


def test_after_its_service_a_track_is_a_turn_away():
    """Law 4: the beam's phase restarts near -2π, and what waits was gated after -π."""
    scene = Scene(swarm(40, seed=2, max_range=40e3), turns=8, clutter=100 / (math.pi * 300e3**2))
    tracker = Tracker(settings(), RADAR, 7, 1)
    served = waiting = 0
    for sector in scene.sectors(256, lag=0.0):
        rows = tracker.push(sector).tracks
        world = tracker._world
        beam = np.zeros(1, BEAM)[0]
        beam["phi"], beam["t"] = sector.complete, sector.stop
        tracks = world.tracks[: world.books.size[N_TRACKS]].copy()
        for edge in world.edges[: world.books.size[N_EDGES]]:
            track, plot = tracks[edge["track"]], world.pool[edge["plot"]]
            if edge["spent"]:
                continue
            assert track["rho"] - (beam["phi"] - plot["phi"]) >= -math.pi
            waiting += 1
        for track in tracks[np.isin(tracks["id"], rows["track"]) & (tracks["level"] == CONFIRMED)]:
            gating.look(track, beam, world.par)
            if 2 * track["half_width"] + world.par["wait"] + world.par["bin"] < TURN:
                assert -TURN - track["half_width"] < track["rho"] < -math.pi
                served += 1
    assert served > 100
    assert waiting > 100


@pytest.mark.parametrize("associator", ["jpda", "set-jpda", "pda", "gnn", "nn"])
def test_no_plot_is_used_for_more_than_one(monkeypatch, associator):
    """Law 5, over all the clusters that a plot has been in, forced closes included."""
    used = Counter()

    def spy(world):
        original(world)
        for member in world.members[: world.books.size[N_MEMBERS]]:
            assert member["used"] <= 1.0 + 1e-9
            if world.tracks[member["track"]]["swept"]:
                for pair in world.pairs[member["pairs"] : member["pairs"] + member["kept"]]:
                    used[int(world.pool[pair["plot"]]["ordinal"])] += float(pair["beta"])

    original = stage.associate
    monkeypatch.setattr(stage, "associate", spy)
    monkeypatch.setattr(stage, "_MANY_TRACKS", 0)
    scene = Scene(swarm(60, seed=2, max_range=20e3), turns=8)
    _, counts = run(scene.sectors(), threads=2, wait_deg=1.0, associator=associator)
    assert counts.forced > 10
    assert len(used) > 200
    assert max(used.values()) <= 1.0 + 1e-9  # the rounding of sums


def test_a_chain_of_shared_plots_is_closed_by_force():
    """Targets side by side around the whole turn: with no wait, clusters close on open members."""
    azimuth = TURN * np.arange(300) / 300
    targets = np.stack([8e4 * np.sin(azimuth), 8e4 * np.cos(azimuth), 0 * azimuth, 0 * azimuth], axis=1)
    scene = Scene(targets, turns=9, p_d=0.95)
    claimed = {"sd_range": 100.0, "sd_azimuth": math.radians(0.35)}  # wider than the noise is: gates overlap
    sectors = [sector.adding(centroids=with_values(sector.centroids, claimed)) for sector in scene.sectors()]
    rows, counts = run(sectors, wait_deg=2.0, max_speed_mps=50.0)
    assert counts.forced > 0
    assert counts.confirmed > 250
    assert sound(rows)
