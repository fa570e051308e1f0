"""The antenna: which way every pulse looks, when, and where a turn is cut into sectors.

Pulses are counted from the start and never wrap. A turn holds a whole number of them, so pulse k
looks the same way as pulse k plus a turn's; pulse 0 looks north at time 0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from radar_console.core.units import TURN

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Antenna:
    """A steadily turning antenna.

    Attributes
    ----------
    rotation : time of one turn, s
    pulses : pulses a turn
    sectors : messages a turn, at most `pulses`
    """

    rotation: float
    pulses: int
    sectors: int

    @property
    def step(self) -> float:
        """Angle from pulse to pulse, rad."""
        return TURN / self.pulses

    def angle(self, pulse: ArrayLike) -> Array:
        """Unwrapped beam angle, rad, at a pulse, which may be fractional."""
        return TURN * np.asarray(pulse, float) / self.pulses

    def time(self, pulse: ArrayLike) -> Array:
        """When a pulse is sent, s."""
        return self.rotation * np.asarray(pulse, float) / self.pulses

    def azimuth(self, pulse: NDArray[np.integer]) -> Array:
        """Where a pulse looks, rad in [0, 2π); the same bits at every turn."""
        azimuth: Array = TURN * (pulse % self.pulses) / self.pulses
        return azimuth

    def edge(self, sector: int) -> int:
        """The first pulse of a sector; sectors are counted from the start and never wrap."""
        return sector * self.pulses // self.sectors
