"""Every associator, gate, filter and likelihood from end to end, and tracks that are taken over."""

import numpy as np
import pytest
from scenes import FILTERS, RADAR, Scene, held, nothing, of_track, ring, run, settings, sound, target_of

from radar_console.core.messages import NO_TRACKS, TRACK, TrackStatus, blank
from radar_console.tracker import Tracker


@pytest.fixture(scope="module")
def calm():
    return Scene(ring(), turns=10, p_d=0.95)


def holds_all(rows, counts, scene, count):
    assert sound(rows)
    assert counts.lost == 0
    assert sorted(target_of(rows, scene, track) for track in held(rows)) == list(range(count))


@pytest.mark.parametrize("associator", ["nn", "gnn", "pda", "jpda", "set-jpda"])
@pytest.mark.parametrize("gate", ["ellipse", "rectangle"])
@pytest.mark.parametrize("likelihood", ["filter", "gaussian"])
def test_every_associator_and_gate_holds_a_simple_scene(calm, associator, gate, likelihood):
    rows, counts = run(calm.sectors(), associator=associator, gate=gate, likelihood=likelihood)
    holds_all(rows, counts, calm, 25)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("associator", ["gnn", "jpda", "set-jpda"])
def test_every_filter_holds_two_that_fly_side_by_side(name, associator):
    targets = np.array([(-10e3, 60e3, 150.0, 0.0), (-10e3, 61.5e3, 150.0, 0.0)])
    scene = Scene(targets, turns=25, p_d=0.95)
    rows, counts = run(scene.sectors(), associator=associator, **FILTERS[name])
    holds_all(rows, counts, scene, 2)
    for track in held(rows):
        last = of_track(rows, track)[-1]
        target = scene.targets[target_of(rows, scene, track)]
        east, north = target[:2] + last["time"] * target[2:]
        assert abs(last["north"] - north) < 4.0 * last["sd_north"]
        assert abs(last["east"] - east) < 4.0 * last["sd_east"]


@pytest.mark.parametrize("models", [("cv",), ("ca",), ("singer",), ("cv", "ca"), ("cv", "ct", "singer")])
def test_every_motion_model_holds_a_simple_scene(calm, models):
    name = "imm" if len(models) > 1 else "kalman"
    for chosen in (name, "particle"):
        rows, counts = run(calm.sectors(), filter=chosen, models=models)
        holds_all(rows, counts, calm, 25)


def given_tracks(scene, t, numbers=None):
    """The truth at a time as tracks to adopt."""
    tracks = blank(TRACK, len(scene.targets))
    tracks["track"] = np.arange(len(tracks)) + 100_000 if numbers is None else numbers
    tracks["time"] = tracks["born"] = t
    tracks["east"], tracks["north"] = (scene.targets[:, :2] + t * scene.targets[:, 2:]).T
    tracks["v_east"], tracks["v_north"] = scene.targets[:, 2:].T
    tracks["sd_east"] = tracks["sd_north"] = 200.0
    tracks["sd_v_east"] = tracks["sd_v_north"] = 20.0
    return tracks


@pytest.mark.parametrize("name", FILTERS)
def test_adopted_tracks_go_on_as_confirmed_ones(calm, name):
    """They have all plots of their targets, so no others start."""
    tracker, rows = Tracker(settings(**FILTERS[name]), RADAR, 7, 1), [NO_TRACKS]
    for k, sector in enumerate(calm.sectors()):
        if k == 0:
            tracker.push(sector.adding(centroids=sector.centroids[:0]))
            tracker.adopt(given_tracks(calm, sector.stop))
            continue
        rows.append(tracker.push(sector).tracks)
    rows = np.concatenate(rows)
    assert sound(rows)
    assert tracker.counts.lost == tracker.counts.confirmed == 0
    assert held(rows).tolist() == (100_000 + np.arange(25)).tolist()
    for k in range(25):
        own = of_track(rows, 100_000 + k)
        assert np.all(calm.origin[own["plot"][own["hit"]]] == k)
        assert len(own) >= 9
        assert np.all(own["status"] != TrackStatus.DELETED)


def test_adopted_tracks_without_plots_coast_and_end():
    tracker = Tracker(settings(), RADAR, 7, 1)
    scene = Scene(ring())
    tracker.push(nothing(0, 1)[0])
    tracker.adopt(given_tracks(scene, 4.0))
    rows = np.concatenate([tracker.push(sector).tracks for sector in nothing(1, 10)])
    assert sound(rows)
    assert tracker.counts.lost == 25
    assert (rows["status"] == TrackStatus.COASTING).sum() == 25 * (settings().delete_misses - 1)


def test_many_are_adopted_and_none():
    targets = np.zeros((500, 4))
    targets[:, 0], targets[:, 1] = np.linspace(-2e5, 2e5, 500), 1e5
    tracker = Tracker(settings(), RADAR, 7, 1)
    tracker.push(nothing(0, 1)[0])
    tracker.adopt(blank(TRACK, 0))
    tracker.adopt(given_tracks(Scene(targets), 4.0))
    rows = tracker.push(nothing(1, 2)[0]).tracks
    assert len(np.unique(rows["track"])) > 480  # some gates wait for the beam across the turn's end


def test_tracks_are_adopted_where_a_beam_is():
    tracker = Tracker(settings(), RADAR, 7, 1)
    with pytest.raises(ValueError, match="sector"):
        tracker.adopt(blank(TRACK, 1))
