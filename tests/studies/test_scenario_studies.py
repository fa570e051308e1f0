"""Studies of scenarios that come along: meetings and accuracies by hand, and small versions of the whole."""

import json
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from radar_console import scenario
from radar_console.app import studying
from radar_console.core.units import DEG, KT, NM
from radar_console.evaluation.intervals import Interval
from radar_console.evaluation.sampling import Snapshot
from radar_console.evaluation.scenario_run import ScenarioRun
from radar_console.scenario import RadarSettings
from radar_console.studies import arpa, arpa_runs, scenario_runs, seven_targets, twenty_five
from radar_console.studies.arpa_runs import TIMES
from radar_console.studies.seven_targets import Meeting, kept, meetings
from radar_console.studies.work import Work

SCENES = {
    # own speed, kn; range, NM, and bearing, °; relative course, ° and speed, kn, of the resolution
    "arpa-1": (10, 8, 0, 180, 20),
    "arpa-2": (10, 1, 0, 90, 10),
    "arpa-3": (5, 8, 45, 225, 20),
    "arpa-4": (25, 8, 45, 225, 20),
}
WHOLE = scenario_runs.shipped


def shorter(monkeypatch, seconds):
    """The same scenarios, of `seconds` only."""

    def cut(name):
        raw = deepcopy(dict(WHOLE(name).raw)) | {"duration_s": seconds}
        return ScenarioRun(raw, Path(f"{name}.toml"))

    monkeypatch.setattr(scenario_runs, "shipped", cut)


def read(folder):
    rows = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return {row["quantity"]: row for row in rows}


def test_meetings_are_found_and_widened():
    """Two targets pass at 100 m/s each, 1 km apart abeam, at 150 s; the third is far off."""
    t = np.arange(301.0)
    at = np.zeros((301, 3, 2))
    at[:, 0, 0], at[:, 1, 0] = -100.0 * (t - 150.0), 100.0 * (t - 150.0)
    at[:, 1, 1] = 1000.0
    at[:, 2] = 1e5
    # 3 km apart while |200 (t − 150)| < √(3000² − 1000²) = 2828 m: within 14.1 s
    assert meetings(at) == [Meeting(0, 1, 136 - 5, 165 + 20, 150, 1000.0)]


def test_targets_that_begin_together_are_judged_from_when_tracks_have_settled():
    at = np.zeros((200, 2, 2))
    at[:, 1, 0] = np.where(np.arange(200) < 100, 2500.0, 9000.0)
    (meeting,) = meetings(at)
    assert (meeting.before, meeting.after) == (40, 120)


def test_kept_means_the_same_track_on_both_sides():
    holder = np.full((10, 2, 5), 7, np.int64)
    holder[:, 1] = 8
    holder[9, :, 1] = [8, 7]  # swapped
    holder[9, 1, 2] = scenario_runs.NOBODY  # lost
    holder[0, 0, 3] = holder[9, 0, 3] = scenario_runs.NOBODY  # never held
    holder[4, :, 4] = [8, 7]  # in between nothing is asked
    assert kept(holder, Meeting(0, 1, 0, 9, 4, 0.0)).tolist() == [True, False, False, False, True]


def test_holders_are_the_tracks_that_are_nearest_together():
    target, track = np.array([3, 5]), np.array([11, 12, 13])
    still = np.zeros((3, 2))
    now = Snapshot(
        0.0,
        target,
        np.array([[0.0, 0.0], [100.0, 0.0]]),
        still[:2],
        track,
        np.array([[90.0, 0.0], [5000.0, 0.0], [0.0, 30.0]]),
        still,
    )
    nothing = Snapshot(1.0, target[:1], np.zeros((1, 2)), still[:1], track[:0], still[:0], still[:0])
    holder, distance = scenario_runs.holders([now, nothing], target, 2000.0)
    assert holder.tolist() == [[13, 11], [scenario_runs.NOBODY] * 2]
    assert distance[0].tolist() == [30.0, 10.0]
    assert np.isnan(distance[1]).all()


def test_seven_targets_in_small(tmp_path, monkeypatch):
    shorter(monkeypatch, 262.0)
    work = Work(tmp_path, 2, 1)
    rows = {each.quantity: each for each in seven_targets.run(work)}
    assert work.figures == [f"seven-targets-{name}.png" for name in ("each", "whole", "kept")]
    assert all((tmp_path / name).stat().st_size < 150_000 for name in work.figures)
    assert rows["all 2 meetings of a run kept"].ours == 1.0
    assert rows["runs with a lost target"].ours == 0.0
    assert rows["continuity of target 7"].ours > 0.9


def test_twenty_five_in_small(tmp_path, monkeypatch):
    shorter(monkeypatch, 60.0)
    folder = studying.study("twenty-five", 2, 1, 1, tmp_path)
    rows = read(folder)
    thin, dense = twenty_five.READINGS.values()
    assert rows[f"targets held at some time, of 25, {thin}"]["ours"] > 23
    assert rows[f"continuity, {thin}"]["ours"] > rows[f"continuity, {dense}"]["ours"]
    assert rows[f"GOSPA, {thin}"]["ours"] < rows[f"GOSPA, {dense}"]["ours"]
    assert (folder / "twenty-five-clutter.png").stat().st_size < 150_000


def test_arpa_in_small(tmp_path, monkeypatch):
    monkeypatch.setattr(arpa, "SCENES", arpa.SCENES[:2])
    rows = read(studying.study("arpa", 2, 1, 1, tmp_path))
    assert rows["target tracked to the end, Kalman filter"]["ours"] == 1.0
    assert rows["arpa-1, 3 min: CPA"]["published"] == 0.5
    assert rows["arpa-1, 3 min: CPA"]["verdict"].startswith("pass")
    assert rows["accuracies that pass, Kalman filter"]["published"] == 15.0
    assert all((tmp_path / f"{name}.png").stat().st_size < 150_000 for name in ("arpa", "arpa-time"))


@pytest.mark.parametrize("name", SCENES)
def test_the_scenes_are_the_resolutions(name):
    own_kt, distance, bearing, course, speed = SCENES[name]
    settings = scenario.load(scenario.shipped()[name])
    radar, (target,) = settings.radar, settings.target
    assert (radar.course_deg, radar.speed_kt, radar.rotation_s) == (0.0, own_kt, 2.5)
    assert (target.range_km, target.azimuth_deg) == (pytest.approx(distance * NM / 1e3), bearing)
    heading = target.heading_deg * DEG
    relative = target.speed * np.array([np.sin(heading), np.cos(heading)]) - arpa_runs.own_velocity(radar)
    assert np.degrees(np.arctan2(*relative)) % 360 == pytest.approx(course, abs=1e-3)
    assert np.hypot(*relative) / KT == pytest.approx(speed, abs=1e-3)


def steady(runs):
    """Perfect estimates of a target 8 NM ahead that comes down at 20 kn."""
    state = np.zeros((len(TIMES), 4, runs))
    state[:, 1] = (8.0 * NM - 20.0 * KT * TIMES)[:, None]
    state[:, 3] = -20.0 * KT
    return state


def test_perfect_estimates_have_the_errors_of_gyro_and_log_only():
    scene, state = arpa.SCENES[0], steady(400)
    score = arpa.score(scene, {"estimate": state, "truth": state}, 1)
    assert all(each.max() == pytest.approx(0.0, abs=1e-9) for each in score.exact.values())
    for what in ("relative speed", "CPA", "TCPA"):
        assert score.within(what).max() == pytest.approx(0.0, abs=1e-9)
    # ±0.5 and a Gaussian of a quarter of it: 95 % are within 0.5 + 1.645 · 0.12; 400 runs know that to 0.02
    assert score.within("relative course") == pytest.approx(0.5 + 1.645 * 0.12, abs=0.05)
    assert score.within("true speed") == pytest.approx(0.5 + 1.645 * 0.2 / 3, abs=0.04)


def test_a_lost_target_is_the_largest_of_errors():
    state = steady(20)
    gone = state.copy()
    gone[-1, :, :2] = np.nan
    score = arpa.score(arpa.SCENES[0], {"estimate": gone, "truth": state}, 1)
    assert score.at(3, "CPA")[0].value == arpa.LOST
    assert score.within("CPA")[:-1].max() == pytest.approx(0.0, abs=1e-9)
    assert score.tracked.sum() == 18


def test_95_percent_of_runs():
    values = np.random.default_rng(1).permutation(np.arange(1.0, 101.0))
    assert arpa.most(values) == 95.0
    assert arpa.most(values[None, :3]).tolist() == [values[:3].max()]


@pytest.mark.parametrize(
    ("value", "low", "high", "says"),
    [
        (0.5, 0.4, 0.6, "pass"),
        (0.9, 0.8, 1.1, "pass, but the limit is in the interval"),
        (1.1, 0.9, 1.2, "fail, but the limit is in the interval"),
        (1.5, 1.2, 1.7, "fail"),
    ],
)
def test_pass_and_fail(value, low, high, says):
    assert arpa.judged(Interval(np.array(value), np.array(low), np.array(high), 50), 1.0) == says


def test_the_bound_is_that_of_a_straight_line_through_ranges():
    """Head on, the speed is the slope of n ranges: σ² 12 / (T² n (n² − 1))."""
    radar = RadarSettings(rotation_s=2.5, sd_range_m=38.0, sd_azimuth_deg=0.1, p_d=1.0)
    least = arpa_runs.bound(radar, np.array([0.0, 8.0 * NM, 0.0, -10.0]), 7.0)
    n = np.ceil((7.0 + TIMES) / 2.5)
    assert least.speed == pytest.approx(38.0 * np.sqrt(12.0 / (2.5**2 * n * (n**2 - 1))))
