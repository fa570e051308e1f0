"""The parts of the window that need no window: quantities, governor, logbook."""

import math
from datetime import datetime

import numpy as np
import pytest

from radar_console.core.messages import TRACK, TrackStatus, blank
from radar_console.display import actions, quantities
from radar_console.display.governor import Governor
from radar_console.display.logbook import Logbook


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0.00"),
        (7.214, "7.21"),
        (9.996, "10.0"),
        (54.96, "55.0"),
        (99.96, "100"),
        (1204.6, "1205"),
        (-3.0, "−3.00"),
        (math.nan, "–"),
    ],
)
def test_three_significant_digits(value: float, text: str) -> None:
    assert quantities.significant(value) == text


@pytest.mark.parametrize(
    ("degrees", "decimals", "text"),
    [(7.4, 0, "007°"), (359.6, 0, "000°"), (359.96, 1, "000.0°"), (7.26, 1, "007.3°"), (-90.0, 0, "270°")],
)
def test_bearings(degrees: float, decimals: int, text: str) -> None:
    assert quantities.bearing(math.radians(degrees), decimals) == text


def test_times_and_places() -> None:
    assert quantities.duration(59.9) == "00:59"
    assert quantities.duration(3725.0) == "1:02:05"
    assert quantities.moment(3725.0, None) == "+1:02:05"
    # A recording goes on past its midnight.
    assert quantities.moment(86401.0, datetime(2026, 4, 29)) == "2026-04-30 00:00:01"
    assert quantities.place(-33.8568, 151.2153) == "33.857° S 151.215° E"


def test_ladders_end_and_take_values_between_their_rungs() -> None:
    ladder = (0.0, 1.0, 2.0)
    assert actions.step(ladder, 1.5, +1) == 2.0
    assert actions.step(ladder, 1.5, -1) == 1.0
    assert actions.step(ladder, 2.0, +1) == 2.0
    assert actions.step(ladder, 0.0, -1) == 0.0


def run(governor: Governor, work: float, seconds: float) -> None:
    spent = 0.0
    while spent < seconds:
        elapsed = max(governor.interval_ms / 1000.0, work)
        governor.note(work, elapsed)
        spent += elapsed


def test_a_light_load_changes_nothing() -> None:
    governor = Governor()
    run(governor, 0.004, 30.0)
    assert (governor.level, governor.economy, governor.reduced) == (0, 0, "")
    assert governor.fps == pytest.approx(1000.0 / 16.0)


def test_frame_rate_goes_first_then_trails_then_labels_and_all_comes_back() -> None:
    governor = Governor()
    steps = [(governor.interval_ms, governor.economy)]
    for _ in range(60):
        run(governor, 0.060, 0.5)
        if steps[-1] != (governor.interval_ms, governor.economy):
            steps.append((governor.interval_ms, governor.economy))
    assert steps == [(16, 0), (33, 0), (33, 1), (33, 2), (66, 2)]
    run(governor, 0.001, 60.0)
    assert governor.level == 0


def test_the_logbook_keeps_the_newest_passes() -> None:
    book = Logbook(capacity=8)
    for k in range(10):
        rows = blank(TRACK, 2)
        rows["track"], rows["time"], rows["plot_time"] = (1, 2), k, k - 0.5
        rows["hit"] = (True, False)
        rows["status"] = TrackStatus.CONFIRMED
        rows["v_east"], rows["v_north"] = 3.0, 4.0
        book.take(rows, float(k))
    found = book.of(1)
    assert found["time"].tolist() == [6.0, 7.0, 8.0, 9.0]
    assert found["speed"].tolist() == [5.0] * 4
    assert found["latency"].tolist() == [0.5] * 4
    assert np.isnan(book.of(2)["latency"]).all()
    assert len(book.of(3)) == 0
