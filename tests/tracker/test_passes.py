"""Passes of the beam: hits, misses, coasting, deletion, and what each reports."""

import math

import numpy as np
import pytest
from scenes import Scene, held, ring, run, settings, swarm, table_of, target_of

from radar_console.core.messages import CENTROID, CentroidFlag, Radar, Sector, TrackStatus, blank
from radar_console.core.units import TURN
from radar_console.tracker import Tracker
from radar_console.tracker.records import N_TRACKS


@pytest.fixture(scope="module")
def cluttered():
    return Scene(ring(), turns=12, clutter=100 / (math.pi * 300e3**2))


def test_every_row_is_a_pass_and_deletion_is_the_last(cluttered):
    rows, counts = run(cluttered.sectors())
    for track in np.unique(rows["track"]):
        mine = rows[rows["track"] == track]
        # A track that is merged into another ends at the time of its last pass.
        assert np.all(np.diff(mine["time"][:-1]) > 0)
        assert mine["time"][-1] >= mine["time"][:-1].max(initial=-math.inf)
        deleted = mine["status"] == TrackStatus.DELETED
        assert deleted.sum() <= 1
        assert not deleted[:-1].any()
    assert (rows["status"] == TrackStatus.DELETED).sum() == counts.deleted + counts.lost + counts.merged


def test_a_missed_pass_leaves_the_state_and_reports_it_predicted():
    scene = Scene(np.array([(50e3, 50e3, -100.0, 80.0)]), turns=14, p_d=1.0, noise=0.1)
    sectors = list(scene.sectors())
    quiet = [
        sector if sector.end < 8 * TURN else sector.adding(centroids=blank(CENTROID, 0)) for sector in sectors
    ]
    rows, counts = run(quiet)
    coasting = rows[rows["status"] == TrackStatus.COASTING]
    assert counts.lost == 1
    assert len(coasting) == settings().delete_misses - 1
    last = rows[rows["hit"]][-1]
    dt = coasting["time"] - last["time"]
    assert np.abs(dt - 4.0 * np.arange(1, 6)).max() < 0.1
    assert np.allclose(coasting["east"], last["east"] + dt * last["v_east"], rtol=0, atol=1e-6)
    assert np.all(np.diff(coasting["sd_east"]) > 0)
    assert np.all(coasting["plot"] == -1)
    assert np.all(np.isnan(coasting["probability"]))


def test_a_blanked_sector_is_no_miss():
    scene = Scene(np.array([(50e3, 50e3, -100.0, 80.0)]), turns=20, p_d=1.0, noise=0.1)
    shut = [s for s in scene.sectors() if not (math.radians(30) < s.begin % TURN < math.radians(60) and
            10 * TURN < s.begin < 18 * TURN)]  # fmt: skip
    rows, counts = run(shut)
    assert counts.lost == 0
    assert counts.blanked >= 7
    assert not np.any(rows["status"] == TrackStatus.COASTING)


def test_extended_centroids_start_no_track(cluttered):
    sectors = []
    for sector in cluttered.sectors():
        table = sector.centroids.copy()
        table["flags"] = CentroidFlag.EXTENDED
        sectors.append(sector.adding(centroids=table))
    rows, counts = run(sectors)
    assert len(rows) == 0
    assert counts.extended == counts.centroids > 0


def test_few_false_tracks_and_every_target_in_clutter():
    """The published scene with its clutter: all targets within ten turns, one false track at most."""
    scene = Scene(ring(), turns=20, clutter=40 / (math.pi * 300e3**2), disc=(15e3, 5.0))
    rows, counts = run(scene.sectors(), clutter_per_km2=None, max_speed_mps=350.0)
    assert counts.lost == 0
    assert {target_of(rows, scene, track) for track in held(rows)} >= set(range(25))
    assert len(held(rows)) <= 26


def test_crossing_targets_keep_two_tracks():
    scene = Scene(np.array([(0.0, 80e3, 150.0, 0.0), (12e3, 80.5e3, -150.0, 0.0)]), turns=20, p_d=0.95)
    _, counts = run(scene.sectors(), particles=500)
    assert counts.confirmed == 2
    assert counts.lost == 0


def test_a_moving_radar():
    """Own ship at 15 m/s past a fixed mark: its track stands still."""
    mark, rng = np.array([2000.0, 5000.0]), np.random.default_rng(0)
    radar = Radar("ship", 2.5, 10e3, 3.0, math.radians(0.3))
    sectors, t = [], 0.0
    for k in range(60 * 16):
        begin, end = TURN * k / 16, TURN * (k + 1) / 16
        start, stop = 2.5 * k / 16, 2.5 * (k + 1) / 16
        for _ in range(5):
            d = mark - (0.0, 15.0 * t)
            azimuth = math.atan2(*d) % TURN
            t = 2.5 * (k // 16 + azimuth / TURN)
        table = table_of([], [], [])
        if begin <= azimuth + TURN * (k // 16) < end:
            noisy = azimuth + radar.sd_azimuth * rng.normal()
            table = table_of(t, np.hypot(*d) + radar.sd_range * rng.normal(), noisy, k)
        position = (0.0, 15.0 * stop, 0.0)
        sectors.append(Sector(radar, start, stop, begin, end, max(end - 0.1, 0.0), position, centroids=table))
    rows, counts = run(sectors, radar, max_speed_mps=20.0, process_noise_m2ps3=0.01, clutter_per_km2=0.1)
    assert counts.confirmed == 1
    last = rows[rows["hit"]][-20:]
    assert np.abs(last["east"] - 2000.0).max() < 30.0
    assert np.abs(last["north"] - 5000.0).max() < 30.0
    assert np.hypot(last["v_east"], last["v_north"]).max() < 2.0


@pytest.mark.parametrize("bins", [1, 16, 256])
def test_every_track_that_was_not_ended_is_still_in_the_table(bins):
    """Ends of several tracks in one bin must not take a live one with them."""
    scene = Scene(swarm(40, seed=3, max_range=60e3), turns=8, clutter=80 / (math.pi * 60e3**2))
    tracker = Tracker(settings(particles=50, bins=bins, clutter_per_km2=None), scene.radar, 1)
    rows = [tracker.push(sector).tracks for sector in scene.sectors()]
    last = {row["track"]: row["status"] for table in rows for row in table}
    alive = {track for track, status in last.items() if status != TrackStatus.DELETED}
    table = tracker._world.tracks[: tracker._world.books.size[N_TRACKS]]
    heard = table["voiced"] & ~table["dead"]
    assert {int(track) for track in table["id"][heard]} == alive
    assert len(last) > len(alive) > 40
