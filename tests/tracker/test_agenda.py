"""The calendar of the tracks: nobody is forgotten, and resting loses nothing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import Scene, ring, rows_of, settings, swarm

from radar_console.core.units import TURN
from radar_console.scenario import TrackerSettings
from radar_console.tracker import Tracker, agenda, gating
from radar_console.tracker.records import BEAM, N_TRACKS

BINS, TRACKS = 8, 6
WIDTH = TURN / BINS


def books():
    """Of an empty tracker with few bins, that has room for a few tracks, and they are new."""
    tracker = Tracker(TrackerSettings(bins=BINS), Scene(ring(1)).radar, 1)
    found = tracker._world.books
    found.size[N_TRACKS] = TRACKS
    for index in range(TRACKS):
        agenda.enter(index, found)
    return found


def torn(found, number, time):
    """Go on to a bin; whom it has to look at."""
    beam = np.zeros(1, BEAM)
    beam["phi"], beam["t"] = number * WIDTH, time
    index, result = agenda.turn_page(beam[0], WIDTH, found), []
    while index >= 0:
        result.append(index)
        index = agenda.tear(index, found)
    return result


@given(data=st.data())
def test_each_track_is_called_when_its_angle_or_its_time_has_come(data):
    found = books()
    due = dict.fromkeys(range(TRACKS), (0, math.inf))  # bin and time
    now = 0.0
    for number in range(3 * BINS):
        now += data.draw(st.sampled_from([0.0, 0.1, 3.0]))
        called = torn(found, number, now)
        # Who rests for a turn or more is called a turn too early.
        expected = [k for k, (when, time) in due.items() if (when - number) % BINS == 0 or time <= now]
        assert sorted(called) == sorted(expected)
        for index in called:
            choice = data.draw(st.sampled_from(["at once", "rest", "gone"]))
            if choice == "rest":
                angle, time = (
                    number * WIDTH + data.draw(st.floats(0.01, 7.0)),
                    now + data.draw(st.floats(0.05, 5.0)),
                )
                agenda.rest(index, angle, time, WIDTH, found)
                due[index] = max(math.ceil(angle / WIDTH), number + 1), time
            elif choice == "at once":
                agenda.at_once(index, found)
                due[index] = number + 1, math.inf
            else:
                del due[index]
                found.agenda[index]["time"] = math.inf
        free = set(range(TRACKS)) - due.keys()
        if free and due and data.draw(st.booleans()):
            source, target = max(due), min(free)
            agenda.move(source, target, found)
            found.agenda[source]["bin"], found.agenda[source]["time"] = -1, math.inf
            due[target] = due.pop(source)
        elif due and data.draw(st.booleans()):
            dead = min(due)
            agenda.leave(dead, found)
            found.agenda[dead]["time"] = math.inf
            del due[dead]


TURNS = [4.0, 8.0, 4.0, 2.0, 4.0, 30.0, 4.0, 3.0]


@pytest.mark.parametrize("times", [[], TURNS])
def test_to_rest_loses_nothing(times):
    """Beside a tracker that looks at every track in every bin; beam and radar go as they like."""
    targets = np.concatenate([ring(13), swarm(20, seed=6, max_range=25e3)])
    scene = Scene(
        targets, turns=8, turn_times=times, clutter=300 / (math.pi * 300e3**2), sensor=(60.0, -30.0)
    )
    sectors = list(scene.sectors(256))
    resting, restless = (Tracker(settings(filter="kalman"), scene.radar, 1) for _ in range(2))
    rows = []
    for sector in sectors:
        restless._world.books.agenda["time"] = restless._world.books.alarm[:] = -math.inf
        rows.append(restless.push(sector))
    a, b = rows_of([resting.push(sector) for sector in sectors]), rows_of(rows)
    a, b = (np.sort(each, order=["track", "plot", "time"]) for each in (a, b))
    assert len(a) == len(b) > 1000
    for name in ("track", "status", "plot"):
        assert np.array_equal(a[name], b[name])
    # They are in another order, and so are the sums of their association: rounding.
    assert np.allclose(a["east"], b["east"], rtol=0.0, atol=1e-6)


@given(y=st.floats(-1e6, 1e6), x=st.floats(-1e6, 1e6))
def test_the_arctangent_is_the_librarys(y, x):
    assert gating.arctangent(y, x) == pytest.approx(math.atan2(y, x), rel=1e-14, abs=1e-300)


@given(q=st.floats(0.0, 1.0))
def test_the_arcsine_is_no_less_than_the_librarys(q):
    assert -1e-17 <= gating.arcsine(q) - math.asin(q) <= 2e-9
