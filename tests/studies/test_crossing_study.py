"""The studies of trackers at a crossing and in clutter: geometry, laws, outcomes, and the whole in small."""

import numpy as np
import pytest

from radar_console.core.messages import TRACK, TRUTH, TrackStatus, blank
from radar_console.studies import (
    clutter_runs,
    crossing,
    crossing_figures,
    crossing_runs,
    ospa_clutter,
    tracked,
)
from radar_console.studies.crossing_runs import Cell
from radar_console.studies.tracked import GIVEN
from radar_console.studies.work import Work, generator


def test_the_targets_pass_where_the_paper_says():
    """Nine minutes after their start, 105 km away, in azimuth 150°; but they miss each other by 415 m."""
    time = np.arange(500.0, 580.0, 0.1)
    states = np.array([crossing_runs.published(t) for t in time])
    apart = np.hypot(*(states[:, 1, :2] - states[:, 0, :2]).T)
    closest = states[np.argmin(apart), 0, :2]
    assert apart.min() == pytest.approx(415.0, abs=1.0)
    assert time[np.argmin(apart)] == pytest.approx(crossing_runs.MEETING, abs=1.0)
    assert np.hypot(*closest) == pytest.approx(106e3, abs=1e3)
    assert np.degrees(np.arctan2(*closest)) == pytest.approx(150.0, abs=0.2)


def test_moved_targets_meet_or_stay_apart():
    time = np.arange(0.0, crossing_runs.BEFORE + crossing_runs.AFTER, 0.05)

    def closest(where):
        state = crossing_runs.scene(Cell(50.0, 0.0, where=where)).state
        place = state[:, None, :2] + time[:, None] * state[:, None, 2:]
        return np.hypot(*(place[1] - place[0]).T).min()

    assert closest("published") == pytest.approx(415.0, abs=1.0)
    assert closest("meeting") < 5.0
    assert closest("apart") > 15e3


def test_the_targets_plots_do_not_depend_on_the_clutter():
    def plots(density):
        played = tracked.play(crossing_runs.scene(Cell(50.0, density)), generator(3, 0))
        rows = np.concatenate([sector.centroids for sector in played.sectors])
        return set(zip(rows["range"], rows["azimuth"], strict=True)), played

    bare, without = plots(0.0)
    among, with_clutter = plots(2.0)
    assert bare < among
    assert 80 < len(bare) <= 100  # of 49 scans without the first, two targets, P_D 0.9
    assert without.given.tobytes() == with_clutter.given.tobytes()


def test_far_apart_without_clutter_nothing_happens():
    """Whatever the tracker: no swap, no loss, no third track, both kept."""
    for initiation in (False, True):
        cell = Cell(50.0, 0.0, initiation, "apart")
        found = crossing_runs.play(cell, tuple(crossing_runs.TRACKERS), range(1), 1)
        assert found["kept"].all()
        assert not (found["swap"] | found["lost"] | found["extra"] | found["early"]).any()


def test_runs_are_the_same_alone_and_among_others():
    cell = Cell(50.0, 6.7)
    every, one = (crossing_runs.play(cell, ("GNN", "JPDA"), runs, 1) for runs in (range(2), range(1, 2)))
    assert all(np.array_equal(every[event][:, 1:], one[event]) for event in every)


def story(*places):
    """Tables of two targets at (0, 0) and (10 km, 0), and of tracks that stand where `places` say, in km."""
    times = 4.0 * np.arange(1, 51)
    truth, tracks = blank(TRUTH, 100), blank(TRACK, 50 * len(places))
    truth["time"], truth["target"] = np.repeat(times, 2), np.tile([0, 1], 50)
    truth["east"], truth["north"], truth["v_east"], truth["v_north"] = np.tile([0.0, 1e4], 50), 0.0, 0.0, 0.0
    tracks["time"], tracks["status"] = np.tile(times, len(places)), TrackStatus.CONFIRMED
    tracks["track"] = np.repeat([GIVEN, GIVEN + 1, 7][: len(places)], 50)
    tracks["east"] = np.concatenate([np.broadcast_to(1e3 * np.asarray(place), 50) for place in places])
    tracks["north"] = tracks["v_east"] = tracks["v_north"] = 0.0
    return tracks, truth


GONE = np.where(np.arange(50) < 25, 0.0, 5.0)


@pytest.mark.parametrize(
    ("places", "events"),
    [
        ((0.0, 10.0), {"kept"}),
        ((0.2, 10.5), {"kept"}),
        ((10.0, 0.0), {"swap", "early"}),
        ((10.0, 10.0), {"swap", "lost", "early"}),
        ((GONE, 10.0), {"lost"}),
        ((5.0, 10.0), {"lost", "early"}),
        ((GONE, 10.0, 0.0), {"lost", "extra"}),
    ],
)
def test_outcomes(places, events):
    found = crossing_runs.outcome(*story(*places))
    assert {event for event, happened in found.items() if happened} == events


@pytest.fixture
def small(monkeypatch, tmp_path):
    monkeypatch.setattr(crossing, "SIGMAS", (50.0,))
    monkeypatch.setattr(crossing, "DENSITIES", (0.1, 1.0))
    monkeypatch.setattr(crossing, "PAPER", 1.0)
    monkeypatch.setattr(crossing_figures, "_SHOWN", Cell(50.0, 1.0))
    monkeypatch.setattr(ospa_clutter, "DENSITIES", (0.0, 1.0))
    monkeypatch.setattr(clutter_runs, "TARGETS", 3)
    monkeypatch.setattr(clutter_runs, "SCANS", 15)
    return tmp_path


def test_the_crossing_in_small(small):
    work = Work(small, 4, 1)
    found = {each.quantity: each for each in crossing.run(work)}
    kept = found["both tracks kept, JPDA, σ = 50 m, 1/km²"]
    assert kept.published == 1.0
    assert kept.verdict == "as published of one run"
    assert found["extra track, GNN, σ = 50 m, 1/km²"].runs == 4
    for tracker in ("GNN", "JPDA"):
        assert found[f"swap, {tracker}, σ = 50 m, 0.1/km²"].ours == 0.0
        assert 0.4 < found[f"swap, {tracker}, σ = 50 m, 0.1/km²"].ci_high < 0.6
    apart = found["lost target, GNN − JPDA, σ = 50 m, 1/km²"]
    assert apart.ci_low < apart.ours < apart.ci_high
    assert work.figures == ["crossing-probabilities.png", "crossing-tracks.png"]
    assert all(5_000 < (small / name).stat().st_size < 150_000 for name in work.figures)


def test_gospa_against_clutter_in_small(small):
    work = Work(small, 2, 1)
    found = {each.quantity: each for each in ospa_clutter.run(work)}
    for tracker in clutter_runs.TRACKERS:
        parts = [found[f"its {part} part, {tracker}, 1/km²"].ours for part in ("location", "missed", "false")]
        assert found[f"GOSPA, {tracker}, 1/km²"].ours == pytest.approx(
            np.hypot(np.hypot(*parts[:2]), parts[2])
        )
        assert found[f"lost targets a run, {tracker}, 0/km²"].ours == 0.0
        assert found[f"false tracks a run, {tracker}, 0/km²"].ours == 0.0
        located = found[f"its location part, {tracker}, 0/km²"].ours
        assert found[f"GOSPA, {tracker}, 0/km²"].ours == located < 200.0
    assert found["GOSPA, JPDA / GNN, 0/km²"].ours == pytest.approx(1.0, abs=0.05)
    assert work.figures == ["ospa-clutter.png"]
