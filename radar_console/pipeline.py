"""Stages are iterators of sectors; this module runs them inline or each in its own thread.

Only a source looks at a clock. A queue between two threads is bounded, and its policy is explicit:
`block` makes the producer wait (headless work, where nothing may be lost), `drop` discards the
oldest waiting sector and counts it with its plots and centroids (a live source can't wait).
"""

import queue
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from radar_console.core.messages import Radar, Sector

Stage = Callable[[Iterable[Sector]], Iterator[Sector]]


class Source(Protocol):
    """Where sectors come from: a simulation, a recording, a live radar.

    Attributes
    ----------
    radar : the sensor
    duration : s of data; NaN if unknown
    skipped : records that could not be used, counted by reason; complete once `sectors` has ended
    """

    radar: Radar
    duration: float
    skipped: dict[str, int]

    def sectors(self) -> Iterator[Sector]:
        """Every sector from the beginning, in the order of time."""
        ...


class Policy(StrEnum):
    BLOCK = "block"
    DROP = "drop"


@dataclass(slots=True)
class Gauge:
    """What waits in the queues, and what they lost; read by the status bar."""

    queues: list["queue.Queue[object]"] = field(default_factory=list)
    sectors_dropped: int = 0
    returns_dropped: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def drop(self, sector: Sector) -> None:
        """Count a sector that was lost; from any thread."""
        with self._lock:
            self.sectors_dropped += 1
            self.returns_dropped += len(sector.plots) + len(sector.centroids)

    @property
    def depth(self) -> int:
        """Sectors waiting in all queues together."""
        return sum(q.qsize() for q in self.queues)


def inline(source: Iterable[Sector], *stages: Stage) -> Generator[Sector]:
    """Run every stage in the caller's thread: deterministic, for tests and Monte Carlo."""
    stream: Iterable[Sector] = source
    for stage in stages:
        stream = stage(stream)
    yield from stream


def threaded(
    source: Iterable[Sector],
    *stages: Stage,
    depth: int = 64,
    policy: Policy = Policy.BLOCK,
    gauge: Gauge | None = None,
) -> Generator[Sector]:
    """Run the source and every stage in threads of their own, joined by bounded queues.

    Closing the returned iterator stops the threads.
    """
    gauge = gauge if gauge is not None else Gauge()
    stopped = threading.Event()
    stream: Iterator[Sector] = _detach(source, depth, policy, gauge, stopped)
    for stage in stages:
        stream = _detach(stage(stream), depth, policy, gauge, stopped)
    try:
        yield from stream
    finally:
        stopped.set()


@dataclass(frozen=True, slots=True)
class _Failed:
    error: BaseException


_END = object()
_POLL = 0.1  # s; how soon a waiting thread notices that it should stop
_NAP = 0.02  # s; how soon a waiting pace notices a new rate


def _detach(
    stream: Iterable[Sector], depth: int, policy: Policy, gauge: Gauge, stopped: threading.Event
) -> Iterator[Sector]:
    """Iterate over `stream` in a thread; yield its sectors here."""
    q: queue.Queue[object] = queue.Queue(depth)
    gauge.queues.append(q)

    def pump() -> None:
        try:
            for sector in stream:
                if policy is Policy.DROP:
                    _put_newest(q, sector, gauge)
                else:
                    _put_waiting(q, sector, stopped)
                if stopped.is_set():
                    return
            _put_waiting(q, _END, stopped)
        except BaseException as error:  # carried to the consumer, where it is raised
            _put_waiting(q, _Failed(error), stopped)

    threading.Thread(target=pump, daemon=True).start()
    while not stopped.is_set():
        try:
            item = q.get(timeout=_POLL)
        except queue.Empty:
            continue
        if item is _END:
            return
        if isinstance(item, _Failed):
            raise item.error
        assert isinstance(item, Sector)
        yield item


def _put_waiting(q: "queue.Queue[object]", item: object, stopped: threading.Event) -> None:
    while not stopped.is_set():
        try:
            q.put(item, timeout=_POLL)
        except queue.Full:
            continue
        return


def _put_newest(q: "queue.Queue[object]", sector: Sector, gauge: Gauge) -> None:
    while True:
        try:
            q.put_nowait(sector)
        except queue.Full:
            try:
                oldest = q.get_nowait()
            except queue.Empty:
                continue
            if isinstance(oldest, Sector):
                gauge.drop(oldest)
            continue
        return


@dataclass(slots=True)
class Pace:
    """A stage that holds sectors back until their time: data time × `rate` follows the wall clock.

    `rate` and `paused` may be changed from another thread while it runs; `rate` inf is as fast as
    the sectors are consumed.
    """

    rate: float = 1.0
    paused: bool = False

    def __call__(self, sectors: Iterable[Sector]) -> Iterator[Sector]:
        last: float | None = None
        ahead = 0.0  # s of data that the next sector is still ahead of the clock
        looked = time.monotonic()
        for sector in sectors:
            ahead += 0.0 if last is None else max(sector.stop - last, 0.0)
            last = sector.stop
            while True:
                now = time.monotonic()
                ahead -= 0.0 if self.paused else (now - looked) * self.rate
                looked = now
                if not self.paused and ahead <= 0.0:
                    break
                time.sleep(_NAP if self.paused else min(ahead / self.rate, _NAP))
            ahead = max(ahead, -self.rate)  # after a stall, catch up at most a second
            yield sector
