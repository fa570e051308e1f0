"""From the pump thread to the console: the feed, and what the console may ask of the pipeline.

Nothing here imports Qt. The pump puts every sector; a timer of the console takes all that wait. No
signal is sent per sector, so that a busy console is never flooded with events.
"""

import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple, Protocol

from radar_console.core.messages import Sector, Table


class Controls(Protocol):
    """What the operator may change of the playback."""

    rate: float
    paused: bool


class Health(Protocol):
    """What waits in the pipeline's queues, what they lost, and what could not be used."""

    @property
    def depth(self) -> int: ...
    @property
    def sectors_dropped(self) -> int: ...
    @property
    def returns_dropped(self) -> int: ...
    @property
    def skipped(self) -> Mapping[str, int]:
        """What source and stages could not use, counted by reason."""
        ...


class Batch(NamedTuple):
    """What waited in the feed.

    Attributes
    ----------
    sectors : in the order of time
    truth : the newest table TRUTH; None if none came since the last time
    arrived : monotonic time at which the newest sector was put, s; NaN without sectors
    """

    sectors: list[Sector]
    truth: Table | None
    arrived: float


class Feed:
    """Thread-safe and bounded: when full, the oldest sector is dropped and counted.

    Attributes
    ----------
    sectors_dropped, returns_dropped : lost here, because the console did not take them in time
    finished : no more sectors will come
    notice : what keeps the data waiting; empty if nothing does
    failure : the sentence to show when the source or a stage failed; empty otherwise
    """

    def __init__(self, capacity: int = 512) -> None:
        self._lock = threading.Lock()
        self._sectors: deque[tuple[float, Sector]] = deque()
        self._capacity = capacity
        self._truth: Table | None = None
        self.sectors_dropped = 0
        self.returns_dropped = 0
        self.finished = False
        self.notice = ""
        self.failure = ""

    def put(self, sector: Sector) -> None:
        """Never waits."""
        with self._lock:
            if len(self._sectors) >= self._capacity:
                _, oldest = self._sectors.popleft()
                self.sectors_dropped += 1
                self.returns_dropped += len(oldest.plots) + len(oldest.centroids)
            self._sectors.append((time.monotonic(), sector))

    def put_truth(self, truth: Table) -> None:
        """Only the newest table TRUTH is kept."""
        with self._lock:
            self._truth = truth

    def take(self) -> Batch:
        """Everything that waits; afterwards the feed is empty."""
        with self._lock:
            waiting, self._sectors = self._sectors, deque()
            truth, self._truth = self._truth, None
        arrived = waiting[-1][0] if waiting else float("nan")
        return Batch([sector for _, sector in waiting], truth, arrived)

    @property
    def depth(self) -> int:
        """Sectors waiting."""
        return len(self._sectors)

    @property
    def dropped(self) -> int:
        """Sectors lost here."""
        return self.sectors_dropped

    def finish(self) -> None:
        """The source has ended."""
        self.finished = True

    def say(self, notice: str) -> None:
        """Show what keeps the data waiting."""
        self.notice = notice

    def fail(self, message: str) -> None:
        """The source or a stage has failed."""
        self.failure = message
        self.finished = True
