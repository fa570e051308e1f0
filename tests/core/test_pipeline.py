"""Stages inline and threaded: the same sectors; nothing lost silently."""

import threading
import time
from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from radar_console import pipeline
from radar_console.core.messages import PLOT, Radar, Sector, blank
from radar_console.pipeline import Gauge, Pace, Policy

RADAR = Radar("r", 4.0, 300e3, 50.0, 1e-3)


def sectors(count: int, step: float = 0.1) -> Iterator[Sector]:
    for k in range(count):
        yield Sector(RADAR, k * step, (k + 1) * step, k * 0.1, (k + 1) * 0.1, 0.0, plots=blank(PLOT, 2))


def marking(mark: float) -> pipeline.Stage:
    def stage(stream: Iterable[Sector]) -> Iterator[Sector]:
        for sector in stream:
            yield sector.adding(complete=sector.complete + mark)

    return stage


def summary(stream: Iterable[Sector]) -> list[tuple[float, float]]:
    return [(sector.stop, sector.complete) for sector in stream]


def test_threaded_is_inline() -> None:
    stages = marking(1.0), marking(10.0)
    inline = summary(pipeline.inline(sectors(500), *stages))
    assert summary(pipeline.threaded(sectors(500), *stages, depth=3)) == inline
    assert len(inline) == 500
    assert inline[0][1] == 11.0


def test_a_failing_stage_fails_the_consumer() -> None:
    def failing(stream: Iterable[Sector]) -> Iterator[Sector]:
        for k, sector in enumerate(stream):
            if k == 3:
                raise ValueError("the fourth")
            yield sector

    seen = []
    with pytest.raises(ValueError, match="the fourth"):
        seen.extend(pipeline.threaded(sectors(10), failing, marking(1.0)))
    assert not seen or len(seen) <= 3


def test_closing_ends_the_threads() -> None:
    before = threading.active_count()
    stream = pipeline.threaded(sectors(10**9), marking(1.0), depth=2)
    next(stream)
    stream.close()
    deadline = time.monotonic() + 10.0
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before


def test_a_slow_consumer_costs_counted_sectors_and_never_the_source() -> None:
    gauge = Gauge()
    emitted = threading.Event()

    def source() -> Iterator[Sector]:
        yield from sectors(200)
        emitted.set()

    stream = pipeline.threaded(source(), depth=8, policy=Policy.DROP, gauge=gauge)
    first = next(stream)
    assert emitted.wait(10.0)  # although nobody takes anything
    rest = list(stream)
    assert 1 + len(rest) + gauge.sectors_dropped == 200
    assert gauge.sectors_dropped > 0
    assert gauge.returns_dropped == 2 * gauge.sectors_dropped
    assert first.stop < rest[0].stop


def test_pace_keeps_order_and_content_and_follows_the_rate() -> None:
    began = time.monotonic()
    paced = summary(Pace(rate=20.0)(sectors(41)))
    assert paced == summary(sectors(41))
    # 40 steps of 0.1 s at ×20: sleeping can't be shorter, whatever the machine does.
    assert time.monotonic() - began >= 40 * 0.1 / 20.0 * 0.95


def test_a_paused_pace_waits() -> None:
    pace = Pace(rate=1e9, paused=True)
    seen: list[Sector] = []
    thread = threading.Thread(target=lambda: seen.extend(pace(sectors(5))), daemon=True)
    thread.start()
    thread.join(0.2)
    assert not seen
    pace.paused = False
    thread.join(10.0)
    assert np.allclose([s.stop for s in seen], [0.1, 0.2, 0.3, 0.4, 0.5])
