"""The sweep that is shown: it follows the encoder smoothly, and stands still when that does."""

from radar_console.core.units import TURN

_LEAP = 0.5 * TURN
"""A larger step is a jump in the data or a fast replay, which is shown as it comes, rad."""

_LONGEST = 0.6  # s; a longer wait was a pause, not the time of a sector
_WEIGHT = 0.3  # of the newest interval in their running mean


class Sweep:
    """Sectors come in steps of some degrees; between two of them the shown beam moves evenly.

    It runs through a sector in the time that the last ones took to come, so it is one sector late and
    never ahead of the encoder.

    Attributes
    ----------
    angle : unwrapped, rad
    """

    def __init__(self) -> None:
        self.angle = 0.0
        self._target = 0.0
        self._waited = 0.0
        self._interval = 0.0

    def jump(self, beam: float) -> None:
        """To the encoder at once."""
        self.angle = self._target = beam
        self._waited = 0.0

    def follow(self, beam: float, wall: float) -> None:
        """Wall time went on by `wall` s; the encoder is at `beam`, rad."""
        self._waited += wall
        if beam != self._target:
            weight = _WEIGHT if self._interval else 1.0
            self._interval += weight * (min(self._waited, _LONGEST) - self._interval)
            self._target, self._waited = beam, 0.0
        gap = beam - self.angle
        if not 0.0 <= gap < _LEAP:
            self.angle = beam
            return
        left = self._interval - self._waited
        self.angle += gap if left <= wall else gap * wall / left
