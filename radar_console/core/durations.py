"""How long things took, in a fixed amount of memory: a console may run for weeks."""

import math
from collections.abc import Iterable

import numpy as np

from radar_console.core.geometry import Array

_SHORTEST, _LONGEST = 1e-6, 1e5  # s
_PER_E = 200  # bins for a factor of e: half a percent each
_BINS = math.ceil(_PER_E * math.log(_LONGEST / _SHORTEST))


class Durations:
    """A histogram of durations with bins half a percent wide.

    What is shorter than a microsecond counts as nothing; the longest is kept exactly.
    """

    def __init__(self, values: Iterable[float] = ()) -> None:
        self._counts = np.zeros(_BINS + 1, np.int64)
        self._longest = math.nan
        self.add(np.fromiter(values, float))

    def __len__(self) -> int:
        return int(self._counts.sum())

    def add(self, values: Array | float) -> None:
        """Count durations (n,) or one, s; what is no number is left out."""
        known = np.atleast_1d(np.asarray(values, float))
        known = known[np.isfinite(known)]
        if not known.size:
            return
        place = np.floor(_PER_E * np.log(np.maximum(known, _SHORTEST) / _SHORTEST)).astype(np.int64)
        place = np.where(known < _SHORTEST, 0, np.clip(place + 1, 1, _BINS))
        np.add.at(self._counts, place, 1)
        self._longest = float(np.fmax(self._longest, known.max()))

    @property
    def longest(self) -> float:
        """s; NaN of nothing."""
        return self._longest

    def quantile(self, q: float) -> float:
        """The duration, s, that a part `q` does not exceed, within half a percent; NaN of nothing."""
        total = len(self)
        if not total:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), max(math.ceil(q * total), 1)))
        if place == 0:
            return 0.0
        return min(_SHORTEST * math.exp((place - 0.5) / _PER_E), self._longest)
