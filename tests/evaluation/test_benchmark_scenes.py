"""The scenes of the benchmarks are what they say, and our tracker gets the scans that the others get."""

import json
from itertools import pairwise

import numpy as np
import pytest

from benchmarks import report, scenes, tracking
from radar_console.core.geometry import to_polar, wrap
from radar_console.core.messages import TRACK, blank
from radar_console.core.units import KM, TURN

MAKERS = {
    "ring25": lambda **kw: scenes.ring25(scans=40, **kw),
    "dense": lambda **kw: scenes.dense(scans=40, **kw),
    "crossing2": lambda **kw: scenes.crossing2(scans=40, **kw),
    "formation": lambda **kw: scenes.formation(8, **kw),
    "swarm": lambda **kw: scenes.swarm(200, scans=20, **kw),
}
every = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS.keys())
both = pytest.mark.parametrize("swept", [False, True])


def truth_at(scene):
    """Positions (scans, n, 2) and velocities (scans, n, 2)."""
    shape = scene.scans, -1
    return (
        np.stack([scene.truth[a].reshape(shape), scene.truth[b].reshape(shape)], axis=2)
        for a, b in (("east", "north"), ("v_east", "v_north"))
    )


@every
@both
def test_same_seed_same_scene(make, swept):
    one, two, other = make(seed=3, swept=swept), make(seed=3, swept=swept), make(seed=4, swept=swept)
    assert one.returns.tobytes() == two.returns.tobytes()
    assert one.truth.tobytes() == two.truth.tobytes()
    assert one.returns.tobytes() != other.returns.tobytes()


@every
@both
def test_detections_and_their_noise(make, swept):
    """Chance bounds are four standard errors; manoeuvres within a scan move a target by up to 80 m."""
    scene = make(seed=1, swept=swept)
    position, velocity = truth_at(scene)
    seen = scene.returns[scene.returns["target"] >= 0]
    count = position.shape[0] * position.shape[1]
    assert len(seen) / count == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / count))
    lag = seen["time"] - scenes.PERIOD * seen["scan"]
    e, n = (position[seen["scan"], seen["target"]] + lag[:, None] * velocity[seen["scan"], seen["target"]]).T
    distance, azimuth = to_polar(e, n)
    error = np.stack(
        [
            (seen["range"] - distance) / scene.radar.sd_range,
            wrap(seen["azimuth"] - azimuth) / scene.radar.sd_azimuth,
        ]
    )
    if swept and len(np.unique(scene.truth["target"])) == 200:
        return  # they turn within the scan, so the truth between its instants is not a straight line
    assert np.abs(error.mean(axis=1)).max() < 4 / np.sqrt(len(seen))
    assert error.std(axis=1) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / len(seen)))
    if swept:
        np.testing.assert_allclose(seen["angle"] / TURN, seen["time"] / scenes.PERIOD, rtol=1e-15)
        np.testing.assert_allclose(wrap(seen["angle"] - seen["azimuth"]), 0.0, atol=1e-12)
    else:
        assert not lag.any()


@pytest.mark.parametrize(
    ("make", "false"),
    [
        (MAKERS["ring25"], 25 * 5.0),
        (MAKERS["dense"], 25 * 5.0),
        (MAKERS["formation"], 2.0 * (7 + 6) * 6),
        (MAKERS["swarm"], 1000.0),
    ],
)
def test_false_returns_a_scan(make, false):
    scene = make(seed=2)
    count = np.count_nonzero(scene.returns["target"] < 0) / scene.scans
    assert count == pytest.approx(false, abs=4 * np.sqrt(false / scene.scans))


def test_clutter_of_the_crossing_is_of_one_density_where_the_discs_overlap():
    """At the crossing the two discs of 3 km are nearly one."""
    scene = scenes.crossing2(seed=1)
    position, _ = truth_at(scene)
    gap = np.linalg.norm(position[:, 0] - position[:, 1], axis=1)
    together, apart = np.flatnonzero(gap < 600.0), np.flatnonzero(gap > 6000.0)
    false = scene.returns[scene.returns["target"] < 0]
    count = np.bincount(false["scan"], minlength=scene.scans)
    disc = 6.7 * np.pi * 3.0**2
    assert count[apart].mean() == pytest.approx(2 * disc, abs=4 * np.sqrt(2 * disc / len(apart)))
    assert len(together) > 0
    # The union of two discs so near is at most 13 % larger than one.
    assert 0.9 * disc < count[together].mean() < 1.35 * disc


def test_courses():
    ring, velocity = truth_at(scenes.ring25(1, scans=2))
    assert np.hypot(*ring[0].T) / KM == pytest.approx([250.0] * 13 + [150.0] * 12)
    inward = -(ring[0] * velocity[0]).sum(axis=1) / np.hypot(*ring[0].T)
    assert inward == pytest.approx(np.full(25, 800 / 3.6))
    pair, _ = truth_at(scenes.crossing2(1))
    assert np.linalg.norm(pair[:, 0] - pair[:, 1], axis=1).min() < 500.0
    many, velocity = truth_at(scenes.swarm(500, 1, scans=60))
    speed = np.linalg.norm(velocity, axis=2)
    assert np.ptp(speed, axis=0).max() < 1e-9  # they turn at constant speed
    assert speed.min() >= 100.0
    assert speed.max() <= 300.0
    assert np.linalg.norm(many, axis=2).max() < 200.0 * KM


@every
@both
@pytest.mark.parametrize("pushes", [1, 16])
def test_our_tracker_gets_every_return_once_and_in_its_own_scan(make, swept, pushes):
    scene = make(seed=5, swept=swept)
    parts = scenes.sectors(scene, pushes)
    assert len(parts) == scene.scans
    got = [np.concatenate([sector.centroids for sector in part]) for part in parts]
    rows = np.concatenate(got)
    assert len(rows) == len(np.unique(rows["ordinal"])) == len(scene.returns)
    assert sorted(rows["range"].tolist()) == sorted(scene.returns["range"].tolist())
    if not swept:
        for scan, centroids in enumerate(got):
            own = scene.returns[scene.returns["scan"] == scan]
            assert sorted(centroids["azimuth"].tolist()) == sorted(own["azimuth"].tolist())
            late = scenes.PERIOD * scan - centroids["time"]
            # Times of some hundred seconds are rounded to 1e-13 s.
            assert (late >= -1e-12).all()
            assert (late <= scenes.QUICK_TURN + 1e-12).all()


@every
@both
def test_the_beam_goes_forward_and_is_at_each_return_at_its_time(make, swept):
    sectors = [sector for part in scenes.sectors(make(seed=6, swept=swept), 16) for sector in part]
    for before, after in pairwise(sectors):
        assert after.start == before.stop
        assert after.begin == before.end
    knots = np.array([(sector.stop, sector.end) for sector in sectors])
    rows = np.concatenate([sector.centroids for sector in sectors])
    inside = (rows["time"] >= knots[0, 0]) & (rows["time"] <= knots[-1, 0])
    beam = np.interp(rows["time"][inside], *knots.T)
    # 1e-13 s of the rounding of times; in the quick turn the beam makes 6283 rad/s.
    np.testing.assert_allclose(wrap(beam - rows["azimuth"][inside]), 0.0, atol=2e-9 if swept else 2e-8)


def test_no_target_crosses_the_seam_where_that_can_be():
    for make in (MAKERS["ring25"], MAKERS["crossing2"], MAKERS["formation"]):
        scene = make(seed=1)
        azimuth = to_polar(scene.truth["east"], scene.truth["north"])[1]
        assert np.abs(wrap(azimuth - scenes.quiet_azimuth(scene))).min() > 20 * scene.radar.sd_azimuth


def test_given_tracks_err_as_they_say():
    scene = scenes.swarm(500, 1, scans=1)
    tracks = scenes.given_tracks(scene, seed=1, sd_position=100.0, sd_velocity=10.0)
    assert tracks["track"].tolist() == list(range(500))
    for name, sd in (("east", 100.0), ("north", 100.0), ("v_east", 10.0), ("v_north", 10.0)):
        error = tracks[name] - scene.truth[name]
        assert error.std() == pytest.approx(sd, rel=4 * np.sqrt(0.5 / 500))
        assert (tracks["sd_" + name] == sd).all()


def test_a_perfect_run_scores_perfectly():
    scene = scenes.formation(3, seed=1, scans=20)
    rows = blank(TRACK, len(scene.truth))
    for name in ("time", "east", "north", "v_east", "v_north"):
        rows[name] = scene.truth[name]
    rows["track"], rows["status"] = scene.truth["target"], 1
    run = tracking.Run(rows, np.full(20, 2e-3), np.full(20, 3e-3))
    score = tracking.score(scene, run)
    assert (score.gospa_mean, score.gospa_median) == (0.0, 0.0)
    assert (score.targets, score.confirmed, score.scans_to_confirm) == (3, 3, 0.0)
    assert (score.swaps, score.lost, score.false, score.duplicate) == (0, 0, 0, 0)
    assert (score.cpu_ms, score.wall_ms) == pytest.approx((2.0, 3.0))


def test_results_are_continued_and_replaced(tmp_path):
    file = tmp_path / "out" / "results.json"
    results = report.Results(file)
    results.add("ring", "ours", 1, {"cpu_ms": 1.0, "initiation_ms": float("nan")})
    results.add("ring", "theirs", 1, {"cpu_ms": 9.0})
    again = report.Results(file)
    assert again.trackers("ring") == ["ours", "theirs"]
    again.forget("ring", "ours")
    again.add("ring", "ours", 2, {"cpu_ms": 2.0})
    runs = json.loads(file.read_text())["runs"]
    assert [(run["tracker"], run["seed"], run["cpu_ms"]) for run in runs] == [
        ("theirs", 1, 9.0),
        ("ours", 2, 2.0),
    ]
    assert not list(file.parent.glob("*.part"))


def test_tables_are_renewed_between_their_marks(tmp_path, capsys):
    file = tmp_path / "page.md"
    file.write_text("Before\n<!-- peers -->\nold\n<!-- end of peers -->\nAfter\n")
    full, empty = report.table(["a", "b"], [["1", "2"]]), report.table(["a"], [])
    report.publish({"peers": full, "steps": empty, "growth": full}, file)
    text = file.read_text()
    assert text.startswith(
        "Before\n<!-- peers -->\n\n| a | b |\n| --- | --- |\n| 1 | 2 |\n\n<!-- end of peers -->\nAfter"
    )
    assert "old" not in text
    assert "steps" not in text
    assert text.count("<!-- growth -->") == 1
    report.publish({"growth": full}, file)
    assert file.read_text() == text
    assert "| 1 | 2 |" in capsys.readouterr().out


class Recorder:
    """Stands in for the tracker: keeps what it is told."""

    def __init__(self, settings, radar, seed):
        self.told = []
        Recorder.last = self

    def push(self, sector):
        self.told.append(sector)
        return sector

    def flush(self):
        return None


class Adopting(Recorder):
    def adopt(self, tracks):
        self.told.append(tracks)


def test_given_tracks_are_adopted_between_the_first_scan_and_the_second(monkeypatch):
    scene = scenes.formation(2, seed=1, scans=3)
    given = scenes.given_tracks(scene, 1)
    monkeypatch.setattr(tracking, "Tracker", Adopting)
    run = tracking.track(scene, {}, given, 4, 1)
    told = Adopting.last.told
    assert [isinstance(each, np.ndarray) for each in told] == [False] * 5 + [True] + [False] * 10
    assert told[5] is given
    assert not any(len(sector.centroids) for sector in told[:5])
    assert told[4].stop == given["time"][0]
    assert sum(len(sector.centroids) for sector in told[6:]) == np.count_nonzero(scene.returns["scan"] > 0)
    assert len(run.cpu) == len(run.wall) == 3
    assert run.rows["track"].tolist() == [0, 1]


def test_a_tracker_that_cannot_adopt_is_skipped(monkeypatch):
    scene = scenes.formation(2, seed=1, scans=3)
    monkeypatch.setattr(tracking, "Tracker", Recorder)
    assert tracking.track(scene, {}, scenes.given_tracks(scene, 1), 1, 1) is None
    assert tracking.track(scene, {}, None, 1, 1) is not None


def test_turns_are_at_three_g():
    """Between scans a velocity changes by 3 g at most; the speed of a piece is exact."""
    _, velocity = truth_at(scenes.turns(seed=1))
    assert np.linalg.norm(velocity, axis=2) == pytest.approx(250.0)
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=2)
    chord = 2 * 250.0 * np.sin(3 * scenes.G / 250.0 * scenes.PERIOD / 2)
    assert change.max() == pytest.approx(chord)


def test_sprints_go_between_three_speeds():
    """Where two scans in a row have one speed, no acceleration was going on."""
    _, velocity = truth_at(scenes.sprints(seed=1))
    speed = np.linalg.norm(velocity, axis=2)
    assert np.abs(np.diff(speed, axis=0)).max() == pytest.approx(15.0 * scenes.PERIOD)
    steady = speed[1:][np.isclose(np.diff(speed, axis=0), 0.0)]
    assert set(np.round(steady).tolist()) == {100.0, 250.0, 400.0}
