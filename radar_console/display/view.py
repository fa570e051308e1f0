"""How the operator looks at the picture: plain state, no Qt.

Whoever draws compares `revision` with the one it drew last; every change of a field raises it.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from radar_console.core.units import KM, KMH, KT, NM


class Layer(StrEnum):
    """What can be switched on and off."""

    PLOTS = "plots"
    CENTROIDS = "centroids"
    TRACKS = "tracks"
    TRAILS = "trails"
    VECTORS = "vectors"
    LABELS = "labels"
    TRUTH = "truth"
    MAP = "map"
    GRID = "grid"
    SWEEP = "sweep"


class RangeUnit(StrEnum):
    KM = "km"
    NM = "NM"

    @property
    def metres(self) -> float:
        return KM if self is RangeUnit.KM else NM


class SpeedUnit(StrEnum):
    KMH = "km/h"
    KN = "kn"
    MPS = "m/s"

    @property
    def metres_per_second(self) -> float:
        return {SpeedUnit.KMH: KMH, SpeedUnit.KN: KT, SpeedUnit.MPS: 1.0}[self]


SCALES: dict[RangeUnit, tuple[float, ...]] = {
    RangeUnit.KM: (
        *(0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 75.0),
        *(100.0, 150.0, 200.0, 300.0, 400.0, 500.0),
    ),
    # The marine scales of IMO MSC.192(79), then those of air traffic.
    RangeUnit.NM: (
        *(0.25, 0.5, 0.75, 1.5, 3.0, 6.0, 12.0, 24.0),
        *(48.0, 60.0, 120.0, 180.0, 240.0, 300.0),
    ),
}
"""Range scales, in their unit: from the centre of the scope to its rim."""

_RING_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
_MOST_RINGS = 6


def ring_spacing(scale: float) -> float:
    """The finest round spacing that parts `scale` into at most six equal steps, in its unit.

    A scale that no round spacing parts evenly gets the next coarser one, and a last narrow ring.
    """
    if not scale > 0:
        raise ValueError(f"a range scale must be positive, found {scale}")
    decade = 10.0 ** math.floor(math.log10(scale / _MOST_RINGS))
    candidates = [step * decade * power for power in (1.0, 10.0) for step in _RING_STEPS]
    enough = [step for step in candidates if scale / step <= _MOST_RINGS + 1e-9]
    even = [step for step in enough if abs(scale / step - round(scale / step)) < 1e-9]
    return even[0] if even else enough[0]


@dataclass
class View:
    """What the scope shows, and how.

    Attributes
    ----------
    range_m : from the middle of the scope to its rim, m
    centre : the point in the middle of the scope, m east and north of the radar
    layers : those that are shown
    afterglow_s : time constant of the phosphor's decay in wall time; 0 is off
    trail_s, vector_s : length of trails and of speed vectors, s of data time
    range_unit, speed_unit : units on the screen
    palette : a name in `palette.PALETTES`
    selected : number of the selected track (`track` of TRACK); None: none
    label_detail : 1 name, 2 and speed, 3 and course and height
    revision : raised by every change
    """

    range_m: float = 300.0 * KM
    centre: tuple[float, float] = (0.0, 0.0)
    layers: frozenset[Layer] = field(default_factory=lambda: frozenset(Layer))
    afterglow_s: float = 4.0
    trail_s: float = 60.0
    vector_s: float = 60.0
    range_unit: RangeUnit = RangeUnit.KM
    speed_unit: SpeedUnit = SpeedUnit.KMH
    palette: str = "night"
    selected: int | None = None
    label_detail: int = 2
    revision: int = 0

    def __setattr__(self, name: str, value: Any) -> None:
        changed = getattr(self, name, _UNSET) != value
        super().__setattr__(name, value)
        if changed and name != "revision":
            super().__setattr__("revision", getattr(self, "revision", 0) + 1)

    def shows(self, layer: Layer) -> bool:
        return layer in self.layers

    def toggle(self, layer: Layer) -> None:
        """Switch a layer on or off."""
        self.layers = self.layers ^ {layer}

    def show(self, layers: Iterable[Layer]) -> None:
        """Show exactly these layers."""
        self.layers = frozenset(layers)

    @property
    def scale(self) -> float:
        """The range scale in the unit of the screen."""
        return self.range_m / self.range_unit.metres

    @property
    def ring_spacing_m(self) -> float:
        return ring_spacing(round(self.scale, 9)) * self.range_unit.metres

    def zoom_in(self, about: tuple[float, float] | None = None) -> None:
        """To the next smaller scale; `about` (m east, north of the radar) stays where it is."""
        scales = SCALES[self.range_unit]
        place = bisect_left(scales, self.scale * (1.0 - 1e-9))
        self._zoom(scales[max(place - 1, 0)], about)

    def zoom_out(self, about: tuple[float, float] | None = None) -> None:
        """To the next larger scale; `about` (m east, north of the radar) stays where it is."""
        scales = SCALES[self.range_unit]
        place = bisect_right(scales, self.scale * (1.0 + 1e-9))
        self._zoom(scales[min(place, len(scales) - 1)], about)

    def fit(self, range_m: float) -> None:
        """The smallest scale that holds `range_m`, centred on the radar."""
        scales = SCALES[self.range_unit]
        place = bisect_left(scales, range_m / self.range_unit.metres * (1.0 - 1e-9))
        self.range_m = scales[min(place, len(scales) - 1)] * self.range_unit.metres
        self.reset_centre()

    def pan(self, east: float, north: float) -> None:
        """Move the middle of the scope by metres east and north."""
        self.centre = (self.centre[0] + east, self.centre[1] + north)

    def reset_centre(self) -> None:
        """The radar in the middle of the scope."""
        self.centre = (0.0, 0.0)

    def _zoom(self, scale: float, about: tuple[float, float] | None) -> None:
        metres = scale * self.range_unit.metres
        if about is not None:
            ratio = metres / self.range_m
            self.centre = (
                about[0] + (self.centre[0] - about[0]) * ratio,
                about[1] + (self.centre[1] - about[1]) * ratio,
            )
        self.range_m = metres


_UNSET = object()
