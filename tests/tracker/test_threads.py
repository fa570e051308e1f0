"""The number of threads has no influence on the tracks, not in one bit."""

import math

import numpy as np
import pytest
from scenes import FILTERS, RADAR, Scene, held, run, same, settings, swarm

from radar_console.tracker import Tracker, stage


@pytest.fixture(scope="module")
def crowd():
    """Targets that share plots, so that bins have clusters of several members."""
    return Scene(swarm(60, seed=3, max_range=50e3), turns=7, clutter=100 / (math.pi * 300e3**2))


@pytest.mark.parametrize("name", FILTERS)
def test_the_number_of_threads_changes_no_bit(monkeypatch, crowd, name):
    reference, counts = run(crowd.sectors(), clutter_per_km2=None, **FILTERS[name])
    assert len(held(reference)) >= 40
    monkeypatch.setattr(stage, "_MANY_TRACKS", 1)
    monkeypatch.setattr(stage, "_LEAST_SHARE", 1)
    for threads in (2, 3):
        rows, again = run(crowd.sectors(), threads=threads, clutter_per_km2=None, **FILTERS[name])
        assert same(rows, reference), threads
        assert again == counts


def test_threads_and_whole_turns(monkeypatch, crowd):
    """One push a turn gives each bin's members to the threads like many small ones."""
    reference, _ = run(crowd.sectors(64))
    monkeypatch.setattr(stage, "_MANY_TRACKS", 1)
    assert same(run(crowd.sectors(1), threads=3)[0], reference)


def test_threads_start_with_many_tracks():
    """As the tracker comes: below a hundred confirmed tracks there are none, above there are."""
    azimuth = 2 * math.pi * np.arange(130) / 130
    targets = np.stack([8e4 * np.sin(azimuth), 8e4 * np.cos(azimuth), 0 * azimuth, 0 * azimuth], axis=1)
    for count, expected in ((90, False), (130, True)):
        scene = Scene(targets[:count], turns=5, p_d=1.0)
        tracker = Tracker(settings(particles=20), RADAR, 7, threads=2)
        for sector in scene.sectors():
            tracker.push(sector)
        assert tracker.counts.confirmed >= count
        assert (tracker._pool is not None) == expected


def test_the_same_seed_gives_the_same_bits_and_another_does_not(crowd):
    reference, _ = run(crowd.sectors())
    assert same(run(crowd.sectors())[0], reference)
    assert not same(run(crowd.sectors(), seed=8)[0], reference)
