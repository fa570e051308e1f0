"""What is given up when the console can't keep up: frame rate, trails, labels, in this order; latency never.

Knows no clock and no Qt: it is told how long every frame took.
"""

import math

INTERVALS_MS = (16, 33, 33, 33, 66)
ECONOMY = (0, 0, 1, 2, 2)
WORDS = ("", "", "half trails", "half trails, short labels", "half trails, short labels, 15 fps")
BUSY, IDLE = 0.7, 0.3  # of the interval of a frame, spent on work: step down, step up
PATIENCE_DOWN, PATIENCE_UP = 1.0, 8.0  # s that this must last
LATE = 1.6  # of the interval: frames that come so late mean that the machine is busy elsewhere
SMOOTHING_S = 0.5


class Governor:
    """Levels from 0, everything, to 4.

    Attributes
    ----------
    level : how much is given up
    """

    def __init__(self) -> None:
        self.level = 0
        self._work = 0.0
        self._elapsed = math.nan
        self._busy = self._idle = 0.0

    def note(self, work: float, elapsed: float) -> None:
        """A frame took `work` s and came `elapsed` s after the one before."""
        if elapsed <= 0.0:
            return
        if math.isnan(self._elapsed):
            self._elapsed = elapsed
        part = 1.0 - math.exp(-elapsed / SMOOTHING_S)
        self._work += part * (work - self._work)
        self._elapsed += part * (elapsed - self._elapsed)
        late = 1000.0 * self._elapsed > LATE * self.interval_ms
        load = 1000.0 * self._work / self.interval_ms
        self._busy = self._busy + elapsed if load > BUSY or late else 0.0
        # Going up one level must not be too much at once.
        above = INTERVALS_MS[max(self.level - 1, 0)]
        self._idle = self._idle + elapsed if 1000.0 * self._work < IDLE * above and not late else 0.0
        if self._busy > PATIENCE_DOWN and self.level < len(INTERVALS_MS) - 1:
            self._change(+1)
        elif self._idle > PATIENCE_UP and self.level > 0:
            self._change(-1)

    @property
    def interval_ms(self) -> int:
        """Between two frames."""
        return INTERVALS_MS[self.level]

    @property
    def economy(self) -> int:
        """As the scope understands it: 1 half the trails, 2 labels with the name alone."""
        return ECONOMY[self.level]

    @property
    def reduced(self) -> str:
        """What is given up, in words; empty if nothing that matters."""
        return WORDS[self.level]

    @property
    def fps(self) -> float:
        """Frames a second, smoothed; NaN before the second frame."""
        return 1.0 / self._elapsed

    def _change(self, step: int) -> None:
        self.level += step
        self._busy = self._idle = 0.0
