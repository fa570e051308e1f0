"""The tracker's laws: cuts, rotations, services, and what it does with bad input."""

import math

import numpy as np
import pytest
import scenes
from scenes import RADAR, Scene, ring, rows_of, swarm

from radar_console.core.messages import CENTROID, CentroidFlag, Sector, TrackStatus, blank
from radar_console.core.units import TURN
from radar_console.scenario import TrackerSettings
from radar_console.tracker import Tracker
from radar_console.tracker.records import N_TRACKS


def settings(**changes):
    return TrackerSettings(**({"particles": 200, "clutter_per_km2": 1e-4} | changes))


def run(sectors, radar=RADAR, seed=7, **changes):
    tracker = Tracker(settings(**changes), radar, seed)
    return rows_of(tracker(sectors)), tracker.counts


def same(a, b):
    return a.tobytes() == b.tobytes()


def held(rows):
    """Numbers of the tracks that were confirmed at some time."""
    return np.unique(rows["track"][rows["status"] == TrackStatus.CONFIRMED])


@pytest.fixture(scope="module")
def cluttered():
    return Scene(ring(), turns=12, clutter=100 / (math.pi * 300e3**2))


@pytest.mark.parametrize("pushes", [1, 16, 256])
def test_the_cut_of_the_stream_changes_no_bit(cluttered, pushes):
    reference, _ = run(cluttered.sectors(64), clutter_per_km2=None)
    assert len(held(reference)) >= 25
    assert same(run(cluttered.sectors(pushes), clutter_per_km2=None)[0], reference)


def test_random_cuts_change_no_bit(cluttered):
    reference, _ = run(cluttered.sectors(64), clutter_per_km2=None)
    rng = np.random.default_rng(5)
    end = TURN * cluttered.turns
    cuts = np.append(np.sort(rng.uniform(0, end, 900 * cluttered.turns)), end)
    assert same(run(cluttered.sectors(cuts=cuts), clutter_per_km2=None)[0], reference)


def test_the_same_seed_gives_the_same_bits_and_another_does_not(cluttered):
    reference, _ = run(cluttered.sectors())
    assert same(run(cluttered.sectors())[0], reference)
    assert not same(run(cluttered.sectors(), seed=8)[0], reference)


@pytest.mark.parametrize("angle", [0.1, 1.0, math.pi / 2, 3.0, 5.7])
def test_a_rotated_scene_gives_the_same_kalman_tracks(angle):
    """To 1e-9 m, the rounding of positions 3e5 m out over ten updates."""
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
    assert np.abs(b["east"] - (c * a["east"] + s * a["north"])).max() < 5.0


@pytest.mark.parametrize("bins", [64, 1024])
def test_another_number_of_bins_leaves_the_states_as_they_are(bins):
    scene = Scene(swarm(60, seed=4), turns=8)
    a, counts = run(scene.sectors(), wait_deg=120.0)
    b, _ = run(scene.sectors(), wait_deg=120.0, bins=bins)
    assert counts.forced == 0
    a, b = (np.sort(rows[rows["hit"]], order=["track", "plot"]) for rows in (a, b))
    assert np.array_equal(a["plot"], b["plot"])
    assert np.array_equal(a["east"], b["east"])


def service_count(rows, track):
    return int((rows["track"] == track).sum())


JITTER = [4.0 * factor for factor in (1.0, 0.8, 1.2, 1.1, 0.9) * 4]
DOUBLING = [4.0, 8.0, 4.0, 2.0, 4.0, 8.0, 4.0, 2.0] * 3
STALL = [4.0] * 8 + [24.0] + [4.0] * 8


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
    scene = Scene(np.array([target]), p_d=1.0, turn_times=times, noise=0.2)
    radar = scene.radar
    rows, counts = run(scene.sectors(), radar, p_d=0.95, process_noise_m2ps3=4.0)
    assert counts.lost == 0
    assert counts.confirmed == 1
    track = held(rows)[0]
    met = [a for a, _, _ in scene.illuminations()]
    since = rows["born"][rows["track"] == track][0]
    expected = sum(scene.time_of(a) >= since - 1e-3 for a in met)
    assert abs(service_count(rows, track) - expected) <= 1


def first_confirmed(rows, track):
    """Time of the pass at which a track was confirmed; inf if it never was."""
    own = rows[(rows["track"] == track) & (rows["status"] == TrackStatus.CONFIRMED)]
    return own["time"].min() if len(own) else math.inf


def test_confirmed_tracks_use_no_plot_twice():
    """They may share a plot, but not for more than one in all. Young tracks only try it on."""
    scene = Scene(swarm(150, seed=2, max_range=60e3), turns=8, clutter=400 / (math.pi * 300e3**2))
    rows, _ = run(scene.sectors())
    established = [first_confirmed(rows, track) < rows["time"][k] for k, track in enumerate(rows["track"])]
    assigned = rows[np.array(established) & (rows["probability"] > 0.5)]
    plots, times = np.unique(assigned["plot"], return_counts=True)
    assert len(plots) > 500
    assert times.max() == 1


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
    targets = set()
    for track in held(rows):
        mine = rows[(rows["track"] == track) & (rows["plot"] >= 0)]
        origin = scene.origin[mine["plot"]]
        if np.mean(origin >= 0) > 0.5:
            targets.add(int(np.bincount(origin[origin >= 0]).argmax()))
    assert targets == set(range(25))
    assert len(held(rows)) <= 26


def test_crossing_targets_keep_two_tracks():
    scene = Scene(np.array([(0.0, 80e3, 150.0, 0.0), (12e3, 80.5e3, -150.0, 0.0)]), turns=20, p_d=0.95)
    _, counts = run(scene.sectors(), particles=500)
    assert counts.confirmed == 2
    assert counts.lost == 0


def one_turn(table, turn=0, radar=RADAR, **changes):
    values = {"start": 4.0 * turn, "stop": 4.0 * turn + 4.0, "begin": TURN * turn, "end": TURN * (turn + 1)}
    values |= {"complete": values["end"]} | changes
    return Sector(radar, **values, centroids=table)


def table_of(time, distance, azimuth, first=0):
    time, distance, azimuth = np.broadcast_arrays(*(np.asarray(v, float) for v in (time, distance, azimuth)))
    table = blank(CENTROID, time.size)
    table["time"], table["range"], table["azimuth"] = time.ravel(), distance.ravel(), azimuth.ravel()
    table["ordinal"] = first + np.arange(time.size)
    return table


def finite(rows):
    return all(
        np.isfinite(rows[name]).all() for name in ("time", "east", "north", "v_east", "v_north", "sd_east")
    )


def test_nothing_at_all():
    assert len(run([])[0]) == 0
    assert len(run([one_turn(table_of([], [], []), turn) for turn in range(3)])[0]) == 0


def test_one_plot():
    rows, counts = run(
        [one_turn(table_of(1.0, 1e4, 1.5))] + [one_turn(table_of([], [], []), k) for k in range(1, 7)]
    )
    assert counts.started == counts.deleted == 1
    assert finite(rows)


def test_identical_plots():
    turns = [one_turn(table_of(4.0 * k + np.full(20, 1.0), 5e4, 1.5, 20 * k), k) for k in range(10)]
    rows, counts = run(turns)
    assert finite(rows)
    assert counts.confirmed >= 1


def test_a_target_at_the_radar():
    turns = [one_turn(table_of(4.0 * k + 1.0, 0.0, 1.5, k), k) for k in range(10)]
    rows, _ = run(turns)
    assert finite(rows)
    assert len(rows) > 5


def test_five_thousand_plots_in_a_turn():
    rng = np.random.default_rng(1)
    turns = []
    for k in range(3):
        azimuth = TURN * rng.random(5000)
        time = 4.0 * k + azimuth / TURN * 4.0
        turns.append(one_turn(table_of(time, 3e5 * np.sqrt(rng.random(5000)), azimuth, 5000 * k), k))
    rows, counts = run(turns)
    assert finite(rows)
    assert counts.started > 5000


@pytest.mark.parametrize("times", [np.zeros(12), -4.0 * np.arange(12), 4.0 * (np.arange(12) % 5)])
def test_time_that_stands_still_or_goes_back(times):
    turns = [
        one_turn(table_of(t + 1.0, [5e4, 8e4], [1.0, 1.5], 2 * k), k, start=t, stop=t)
        for k, t in enumerate(times)
    ]
    rows, counts = run(turns)
    assert finite(rows)
    assert counts.clock_back == int((np.diff(times) < 0).sum())


def test_a_beam_that_goes_back():
    turns = [
        one_turn(table_of(4.0 * k + 1.0, 5e4, 1.5, k), k % 5, start=4.0 * k, stop=4.0 * k + 4)
        for k in range(12)
    ]
    rows, counts = run(turns)
    assert finite(rows)
    assert counts.beam_back > 0


def test_a_long_gap():
    scene = Scene(np.array([(50e3, 50e3, -100.0, 80.0)]), turns=10, p_d=1.0)
    sectors = list(scene.sectors())
    later = [
        Sector(
            s.radar,
            s.start + 4e6,
            s.stop + 4e6,
            s.begin + 1e6 * TURN,
            s.end + 1e6 * TURN,
            s.complete + 1e6 * TURN,
        )
        for s in sectors
    ]
    rows, _ = run(sectors + later)
    assert finite(rows)


def test_bad_centroids_are_counted():
    table = table_of(1.0, [1e4, np.nan, 2e4, -5.0, 3e4], [1.0, 1.0, np.nan, 1.0, 1.5])
    _, counts = run([one_turn(table)])
    assert counts.centroids == 5
    assert counts.invalid == 3
    assert counts.started == 2


def test_a_centroid_below_the_watermark_is_late():
    first = one_turn(table_of(3.9, 1e4, 6.2))
    late = one_turn(table_of(3.0, 2e4, 4.5, 5), 1, stop=4.1, end=TURN * 1.01, complete=TURN * 1.01)
    _, counts = run([first, late])
    assert counts.late == 1
    assert counts.started == 1


def test_a_moving_radar():
    """Own ship at 15 m/s past a fixed mark: its track stands still."""
    mark, rng = np.array([2000.0, 5000.0]), np.random.default_rng(0)
    radar = scenes.Radar("ship", 2.5, 10e3, 3.0, math.radians(0.3))
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
    assert finite(rows)


def with_values(table, values):
    table = table.copy()
    for name, value in values.items():
        table[name] = value
    return table


@pytest.mark.parametrize("bins", [1, 16, 256])
def test_every_track_that_was_not_ended_is_still_in_the_table(bins):
    """Ends of several tracks in one bin must not take a live one with them."""
    scene = Scene(swarm(40, seed=3, max_range=60e3), turns=25, clutter=150 / (math.pi * 60e3**2))
    settings = TrackerSettings(particles=50, bins=bins)
    tracker = Tracker(settings, scene.radar, 1)
    rows = [tracker.push(sector).tracks for sector in scene.sectors()]
    last = {row["track"]: row["status"] for table in rows for row in table}
    alive = {track for track, status in last.items() if status != TrackStatus.DELETED}
    table = tracker._world.tracks[: tracker._world.books.size[N_TRACKS]]
    heard = table["voiced"] & ~table["dead"]
    assert {int(track) for track in table["id"][heard]} == alive
    assert len(last) > len(alive) > 40
