"""From the plane to the screen and back; north is up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from radar_console.display.view import View

Floats = NDArray[np.float64]

MARGIN = 44.0
"""Between the rim of the scope and the edge of the window, where bearings are written, px."""


@dataclass(frozen=True, slots=True)
class Projection:
    """Pixels of a plane.

    Attributes
    ----------
    scale : px per m
    x0, y0 : where the radar is on the screen, px; y grows downwards
    width, height : of the screen, px
    """

    scale: float
    x0: float
    y0: float
    width: float
    height: float

    @classmethod
    def of(cls, view: View, width: float, height: float) -> "Projection":
        """The scope in the middle of a window of this size."""
        scale = max(0.5 * min(width, height) - MARGIN, 1.0) / view.range_m
        x0 = 0.5 * width - view.centre[0] * scale
        y0 = 0.5 * height + view.centre[1] * scale
        return cls(scale, x0, y0, width, height)

    def scaled(self, factor: float) -> "Projection":
        """The same picture with `factor` times the pixels."""
        return Projection(
            self.scale * factor,
            self.x0 * factor,
            self.y0 * factor,
            self.width * factor,
            self.height * factor,
        )

    def to_screen(self, east: ArrayLike, north: ArrayLike) -> tuple[Floats, Floats]:
        """Pixels of points that lie metres east and north of the radar."""
        x = self.x0 + np.asarray(east, float) * self.scale
        y = self.y0 - np.asarray(north, float) * self.scale
        return x, y

    def to_ground(self, x: float, y: float) -> tuple[float, float]:
        """Metres east and north of the radar of a pixel."""
        return (x - self.x0) / self.scale, (self.y0 - y) / self.scale

    @property
    def reach(self) -> float:
        """Distance of the radar from the farthest corner of the screen, m."""
        dx = max(abs(self.x0), abs(self.width - self.x0))
        dy = max(abs(self.y0), abs(self.height - self.y0))
        return float(np.hypot(dx, dy)) / self.scale
