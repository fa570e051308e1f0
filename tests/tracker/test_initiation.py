"""How tracks start, branch, are confirmed, given up, merged, and what goes when there are too many."""

import math

import numpy as np
import pytest
from scenes import (
    RADAR,
    Scene,
    held,
    of_track,
    one_turn,
    rows_of,
    run,
    same,
    settings,
    sound,
    swarm,
    table_of,
    target_of,
)

from radar_console.core.messages import Radar, TrackStatus
from radar_console.core.units import TURN
from radar_console.tracker import Tracker, agenda, clusters, youth
from radar_console.tracker.records import N_EDGES, N_TRACKS, PENDING, STATE, TENTATIVE

MODES = ["auto", "m-of-n", "score", "branching"]


def blinking(pattern):
    """A target at rest, seen ("1") or not ("0") in each turn."""
    return [
        one_turn(table_of(4.0 * k + 1.0, [5e4] if seen == "1" else [], 1.5, k), k)
        for k, seen in enumerate(pattern)
    ]


def confirmed_in(rows):
    """The turn in which the first track was confirmed; None if none was."""
    confirmed = rows[rows["status"] == TrackStatus.CONFIRMED]
    return int(confirmed["time"].min() // 4.0) if len(confirmed) else None


@pytest.mark.parametrize(
    ("pattern", "turn"), [("11111", 2), ("11001", 4), ("10101", 4), ("11000", None), ("10001", None)]
)
def test_three_of_five(pattern, turn):
    assert confirmed_in(run(blinking(pattern), initiation="m-of-n")[0]) == turn


@pytest.mark.parametrize(("hits", "passes", "turn"), [(3, 3, 2), (4, 5, 3), (5, 8, 4)])
def test_any_m_of_n(hits, passes, turn):
    found = run(blinking("1" * 10), initiation="m-of-n", confirm_hits=hits, confirm_passes=passes)[0]
    assert confirmed_in(found) == turn


def test_m_of_n_gives_up_as_soon_as_it_cannot_be_reached():
    rows, counts = run(blinking("110000000"), initiation="m-of-n")
    first = of_track(rows, 0)
    assert first["status"][-1] == TrackStatus.DELETED
    assert first["time"][-1] // 4.0 == 4  # two hits in five passes
    assert counts.confirmed == 0


def test_more_evidence_takes_longer():
    """At least three plots; then the higher the score that is asked for, the later."""
    turns = [
        confirmed_in(run(blinking("1" * 15), initiation="score", confirm_score=score)[0])
        for score in (-5.0, 6.9, 20.0, 40.0)
    ]
    assert turns[0] == 2
    assert turns == sorted(turns)
    assert turns[-1] > 4
    assert confirmed_in(run(blinking("1" * 15), initiation="score", confirm_score=1e6)[0]) is None


@pytest.mark.parametrize("p_d", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("initiation", ["score", "branching"])
def test_a_young_track_goes_when_its_score_has_fallen(p_d, initiation):
    """By 4.6 from its peak: each miss takes ln(1 - P_D P_G)."""
    rows, counts = run(blinking("11" + "0" * 12), initiation=initiation, p_d=p_d)
    assert counts.confirmed == 0
    track = of_track(rows, 0)
    misses = math.ceil(4.6 / -math.log(1.0 - p_d * 0.999999))
    assert len(track) == 2 + misses
    assert track["status"][-1] == TrackStatus.DELETED


@pytest.mark.parametrize("initiation", MODES)
@pytest.mark.parametrize("branch", [0, 1])
def test_an_ambiguous_second_plot_is_decided_later(branch, initiation):
    """Two plots may be the second of one starter: whichever goes on, its track has the first plot.

    The one flies east, the other west, both at 200 m/s; the turn after their common start both are
    there, then only one.
    """
    sectors, ordinal = [], 0
    for k in range(7):
        sides = [0] if k == 0 else [0, 1] if k == 1 else [branch]
        east = np.array([(-800.0, 800.0)[side] * k for side in sides])
        distance, azimuth = np.hypot(east, 5e4), np.arctan2(east, 5e4) + 1.0
        time = 4.0 * k + 4.0 * azimuth / (2 * math.pi)
        sectors.append(one_turn(table_of(time, distance, azimuth, ordinal), k))
        ordinal += len(sides)
    rows, _ = run(sectors, initiation=initiation)
    born_first = rows[(rows["status"] == TrackStatus.CONFIRMED) & (rows["born"] < 4.0)]
    assert len(np.unique(born_first["track"])) == 1
    last = born_first[-1]
    across = last["east"] * math.cos(1.0) - last["north"] * math.sin(1.0)
    assert across == pytest.approx((-800.0, 800.0)[branch] * 6, abs=4 * last["sd_east"])


@pytest.fixture(scope="module")
def crowd():
    return Scene(swarm(40, seed=3, max_range=60e3), turns=10, clutter=4000 / (math.pi * 300e3**2))


@pytest.mark.parametrize("initiation", MODES)
def test_numbers_are_unique_and_every_track_that_ends_says_so(crowd, initiation):
    tracker = Tracker(settings(initiation=initiation, clutter_per_km2=None), RADAR, 7, 1)
    tables = [tracker.push(sector).tracks for sector in crowd.sectors()]
    world = tracker._world
    tracks = world.tracks[: world.books.size[N_TRACKS]]
    heard = tracks["id"][tracks["voiced"]]
    assert len(heard) == len(set(heard.tolist()))
    rows = np.concatenate(tables)
    assert sound(rows)
    ended = rows["track"][rows["status"] == TrackStatus.DELETED]
    assert len(ended) == len(set(ended.tolist()))
    assert set(rows["track"].tolist()) - set(ended.tolist()) == set(heard.tolist())
    order = np.lexsort((np.arange(len(rows)), rows["track"]))
    of, status, time = rows["track"][order], rows["status"][order], rows["time"][order]
    same_track = of[1:] == of[:-1]
    # Nothing follows a track's end. When a number goes over to another branch in a pass, that branch's time
    # in the same pass may be a little earlier: it weighed the plots differently.
    assert not np.any(same_track & (status[:-1] == TrackStatus.DELETED))
    assert np.all(np.diff(time)[same_track] > -0.5 * RADAR.rotation)
    born = rows["born"][order]
    assert np.all((born[1:] == born[:-1])[same_track])
    counts = tracker.counts
    assert counts.deleted + counts.lost + counts.merged >= len(ended) - counts.capped
    assert len(ended) > 1000


@pytest.mark.parametrize("initiation", MODES)
def test_targets_are_found_by_every_initiation(initiation):
    scene = Scene(swarm(30, seed=3, max_range=200e3), turns=12, clutter=200 / (math.pi * 300e3**2))
    rows, counts = run(scene.sectors(), initiation=initiation, clutter_per_km2=None)
    assert {target_of(rows, scene, track) for track in held(rows)} >= set(range(30))
    if initiation != "m-of-n":  # which confirms a false track now and then
        assert counts.lost == 0
        assert len(held(rows)) == 30


@pytest.mark.parametrize("initiation", MODES)
def test_targets_first_seen_at_the_same_time(initiation):
    """Some recordings have one time for all plots of a turn: that makes nobody another one's branch."""
    turns = [one_turn(table_of(4.0 * k + 1.0, [5e4, 8e4, 3e4], [1.5, 3.0, 4.5], 3 * k), k) for k in range(12)]
    rows, counts = run(turns, initiation=initiation)
    assert counts.confirmed == 3
    first = [of_track(rows, track)["status"].tolist().index(TrackStatus.CONFIRMED) for track in (0, 1, 2)]
    assert first[0] == first[1] == first[2]


@pytest.mark.parametrize("initiation", MODES)
def test_tracks_with_the_same_plots_become_one(initiation):
    """A target that gives two plots a turn, side by side, ends up in no more than two tracks."""
    sectors = [
        one_turn(table_of(4.0 * k + 1.0, [5e4, 5e4 + 20.0], 1.5, 2 * k), k) for k in range(12)
    ]  # fmt: skip
    rows, counts = run(sectors, initiation=initiation)
    last = {row["track"]: row["status"] for row in rows}
    alive = [track for track, status in last.items() if status == TrackStatus.CONFIRMED]
    assert 1 <= len(alive) <= 2
    assert counts.merged + counts.deleted + counts.lost == sum(
        status == TrackStatus.DELETED for status in last.values()
    )
    assert counts.merged > 0


def test_capacity_takes_the_least_likely_young_tracks(crowd):
    """Confirmed tracks stay, there are never more than the capacity, and what went is counted.

    The clutter begins when the targets are confirmed: it would leave no room for their starts.
    """
    late_clutter = []
    for sector in crowd.sectors():
        table = sector.centroids
        keep = (crowd.origin[table["ordinal"]] >= 0) | (sector.begin > 6 * TURN)
        late_clutter.append(sector.adding(centroids=table[keep]))
    tracker = Tracker(settings(max_tracks=80, clutter_per_km2=None), RADAR, 7, 1)
    rows = []
    for sector in late_clutter:
        rows.append(tracker.push(sector).tracks)
        assert tracker._world.books.size[N_TRACKS] <= 80
    rows, counts = np.concatenate(rows), tracker.counts
    assert counts.capped > 1000
    assert counts.lost == 0
    assert {target_of(rows, crowd, track) for track in held(rows)} == set(range(40))


def test_what_goes_takes_its_plots_along(crowd):
    """A row that was freed and taken again has no plots of its former owner, who may have been anywhere."""
    tracker = Tracker(settings(max_tracks=200, clutter_per_km2=None), RADAR, 7, 1)
    joined = 0
    for sector in crowd.sectors(256):
        tracker.push(sector)
        world = tracker._world
        tracks = world.tracks[: world.books.size[N_TRACKS]]
        edges = world.edges[: world.books.size[N_EDGES]]
        joined += len(edges)
        assert (edges["track"] < len(tracks)).all()
        mine, plots = tracks[edges["track"]], world.pool[edges["plot"]]
        apart = np.hypot(plots["e"] - mine["x"][:, 0], plots["n"] - mine["x"][:, 1])
        # In six turns of 4 s nobody gets farther than 10 km; an azimuth errs by half of one.
        assert (apart < 15e3).all()
    assert tracker.counts.capped > 500
    assert joined > 100


def test_without_too_many_tracks_none_is_capped(crowd):
    assert run(crowd.sectors())[1].capped == 0


THICK = {"clutter_per_km2": None, "process_noise_m2ps3": 1.0, "particles": 50}


@pytest.fixture(scope="module")
def thicket():
    """A target whose gate has a false plot in it at almost every turn: 6.7 in each square kilometre.

    Half of a filter's plots would be false, and the mean of all of them follows none.
    """
    radar = Radar("fine", rotation=4.0, max_range=300e3, sd_range=50.0, sd_azimuth=math.radians(0.06))
    return Scene(
        np.array([(-15e3, 90e3, 150.0, 90.0)]), turns=70, disc=(1.5e3, 6.7 * math.pi * 1.5**2), radar=radar
    )


def test_a_target_in_a_thicket_is_found(thicket):
    """Its evidence is the sum over the ways through the plots; no false track comes with it.

    The likeliest plot is often a false one. The track is at the target: within 350 m, five deviations of a
    position among false plots.
    """
    rows, counts = run(thicket.sectors(16), **THICK)
    assert counts.confirmed == 1
    rows = rows[rows["status"] == TrackStatus.CONFIRMED]
    true = np.array([thicket.truth(time)[0] for time in rows["time"]])
    away = np.hypot(rows["east"] - true[:, 0], rows["north"] - true[:, 1])
    assert np.mean(away < 350.0) > 0.9


def test_branches_do_not_depend_on_the_cut(thicket):
    reference, counts = run(thicket.sectors(16), **THICK)
    for pushes in (1, 100):
        rows, again = run(thicket.sectors(pushes), **THICK)
        assert same(rows, reference)
        assert again == counts


@pytest.mark.parametrize("angle", [1.0, 4.0])
def test_branches_of_a_rotated_scene_are_the_same(thicket, angle):
    """Which of them go on, and what they become together, is no matter of their order."""
    # The map of clutter does not turn with the scene: its cells are fixed.
    never = THICK | {"confirm_score": 1e6, "clutter_per_km2": 6.7}
    scene = Scene(thicket.targets, turns=15, disc=thicket.disc, radar=thicket.radar)
    a, counts = run(scene.sectors(), **never)
    b, _ = run(scene.sectors(rotate=angle), **never)
    assert counts.merged > 100
    # The rotated stream ends elsewhere in the last turn.
    a, b = (np.sort(rows[rows["hit"] & (rows["time"] < 55)], order=["track", "plot"]) for rows in (a, b))
    assert np.array_equal(a["track"], b["track"])
    assert np.array_equal(a["plot"], b["plot"])
    c, s = math.cos(angle), math.sin(angle)
    assert np.abs(b["east"] - (c * a["east"] + s * a["north"])).max() < 1e-6
    assert np.abs(b["north"] - (c * a["north"] - s * a["east"])).max() < 1e-6


def test_branches_in_one_state_add_up():
    """The blend is the mixture of the two by its first two moments, and its likelihood their sum."""
    rng = np.random.default_rng(4)
    pair = np.zeros(2, STATE)
    for track in pair:
        root = rng.normal(size=(4, 4))
        track["x"], track["P"] = rng.normal(size=4), root @ root.T
    pair["score"] = 1.5, 0.2
    a, b = pair.copy()
    youth._blend(pair[0], pair[1])
    part = 1.0 / (1.0 + math.exp(1.3))
    mean = (1.0 - part) * a["x"] + part * b["x"]
    cov = sum(
        p * (track["P"] + np.outer(track["x"] - mean, track["x"] - mean))
        for p, track in ((1.0 - part, a), (part, b))
    )
    np.testing.assert_allclose(pair["x"][0], mean, rtol=1e-12)
    np.testing.assert_allclose(pair["P"][0], cov, rtol=1e-12)
    assert pair["score"][0] == pytest.approx(np.logaddexp(1.5, 0.2))


def test_the_distance_of_states():
    rng = np.random.default_rng(5)
    A, x, y, L = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=4), np.zeros((4, 4))
    P = A @ A.T
    youth._root(P, L)
    assert youth._distance(x, L, y) == pytest.approx((x - y) @ np.linalg.solve(P, x - y))


@pytest.mark.parametrize(("lead", "succeeds"), [(-50.0, False), (50.0, True)])
def test_a_branch_with_more_evidence_takes_over(lead, succeeds):
    """A confirmed track is thrown off its target, on which a branch from the same first plot still is.

    The branch waits while it has no more evidence; then it goes on under the track's number.
    """
    scene = Scene(np.array([(30e3, 80e3, 150.0, 90.0)]), turns=14, p_d=1.0)
    sectors = list(scene.sectors(1))
    tracker = Tracker(settings(), RADAR, 7, 1)
    rows = [tracker.push(sector).tracks for sector in sectors[:8]]
    world = tracker._world
    assert world.books.size[N_TRACKS] == 1
    track, branch = world.tracks[0], world.tracks[1]
    world.tracks[1] = track
    world.books.size[N_TRACKS] = 2
    agenda.enter(1, world.books)
    branch["level"], branch["slot"], branch["voiced"], branch["dense"] = TENTATIVE, -1, False, True
    branch["score"] = branch["peak"] = track["peak"] + lead
    for name in ("x", "anchor"):
        track[name][:2] += 20e3
    rows = np.concatenate([*rows, *(tracker.push(sector).tracks for sector in sectors[8:])])
    late = of_track(rows, 0)
    late = late[late["time"] > 32.0]
    away = [math.dist(scene.truth(row["time"])[0], (row["east"], row["north"])) for row in late]
    assert (np.array(away) < 500.0).all() == succeeds
    assert (late["status"] == TrackStatus.CONFIRMED).all() == succeeds
    assert (held(rows).tolist() == [0]) == succeeds
    assert tracker.counts.lost == 1


def test_evidence_that_is_needed_to_take_over():
    """Odds of a hundred to one, and none where the first plot is another one."""
    scene = Scene(np.array([(30e3, 80e3, 150.0, 90.0)]), turns=8, p_d=1.0)
    tracker = Tracker(settings(), RADAR, 7, 1)
    rows_of(tracker(scene.sectors(1)))
    world = tracker._world
    branch = world.tracks[:1].copy()[0]
    for lead, waits in ((4.5, True), (4.7, False)):
        branch["score"] = world.tracks[0]["peak"] + lead
        assert youth._is_known(branch, world) == waits
    branch["root"] += 1
    assert youth._is_known(branch, world)


@pytest.mark.parametrize(("dense", "base", "score"), [(False, 2.0, 1.0), (True, 1.0, 1.1), (True, 2.0, 2.2)])
def test_what_keeps_a_track_alive_in_dense_clutter(dense, base, score):
    """The plot's likelihood counts less by what its density may be higher: the cell's mean, and a tenth."""
    track, plot = np.zeros(1, STATE), np.zeros(1, PENDING)
    tracker = Tracker(settings(clutter_per_km2=None), RADAR, 7, 1)
    track["dense"], track["near"], track["exposure"] = dense, 30.0, 30e6
    plot["near"], plot["exposure"], plot["base"] = 1.0, 1e6, base * 1e-6
    if base > 1.0:  # so much prior that the track's own density stays one in a square kilometre
        track["near"], track["exposure"] = 3e6, 3e12
    got = clusters._proof(7.0, track[0], plot[0], tracker._world.par)
    assert got == pytest.approx(7.0 / score, rel=1e-5)
