"""Returns without pulses: one Gaussian measurement for each detected target, and points of clutter."""

from collections.abc import Iterator
from itertools import count

import numpy as np
from numpy.typing import NDArray

from radar_console.core.messages import CENTROID, Table, blank
from radar_console.core.units import DEG, TURN
from radar_console.scenario import Clutter
from radar_console.simulator.clutter import Places, false_targets, points
from radar_console.simulator.scene import Scene

Array = NDArray[np.floating]


class Measurements:
    """The centroids of turn after turn.

    A measurement's time is when the beam points at its measured azimuth, and it is delivered then:
    below the beam's angle nothing is still to come. (The beam covers a standard deviation of the
    azimuth in about a millisecond, in which no target moves noticeably.)
    """

    def __init__(
        self,
        scene: Scene,
        clutter: Clutter,
        land: tuple[Places, Array],
        receiver: np.random.Generator,
        chance: np.random.Generator,
    ) -> None:
        """`receiver` draws detections and errors, `chance` the clutter; `land` as from `land_points`."""
        self.scene, self.clutter, self.land = scene, clutter, land
        self._receiver, self._chance = receiver, chance

    def turns(self) -> Iterator[Table]:
        """CENTROID tables, one a turn, in the order of time; ordinals run on.

        A turn ahead is measured too: an error in azimuth may carry a measurement back across north.
        """
        ordinal = 0
        waiting = self._turn(0)
        for turn in count():
            both = np.concatenate([waiting, self._turn(turn + 1)])
            antenna = self.scene.antenna
            due = both["time"] < antenna.time((turn + 1) * antenna.pulses)
            centroids, waiting = both[due], both[~due]
            # In turn 0 an error may point before the beam's first direction: never looked at.
            centroids = centroids[centroids["time"] >= 0.0]
            centroids = centroids[np.argsort(centroids["time"], kind="stable")]
            centroids["ordinal"] = np.arange(ordinal, ordinal + len(centroids))
            ordinal += len(centroids)
            yield centroids

    def _turn(self, turn: int) -> Table:
        """Measurements of what the beam crosses in a turn; unordered."""
        parts = [self._targets(turn), self._land(turn)]
        for draw in (false_targets, points):
            places = draw(self.clutter, self.scene, turn, self._chance)
            parts.append(self._centroids(places.pulse, places.distance))
        return np.concatenate(parts)

    def _targets(self, turn: int) -> Table:
        target, pulse = self.scene.crossings(turn)
        detected = self._receiver.random(len(target)) < self.scene.radar.p_d
        target, pulse = target[detected], pulse[detected]
        return self._measured(pulse, self.scene.slant(target, self.scene.antenna.time(pulse)))

    def _land(self, turn: int) -> Table:
        places, p_d = self.land
        detected = self._receiver.random(len(p_d)) < p_d
        pulse = places.pulse[detected] + turn * self.scene.antenna.pulses
        return self._measured(pulse, places.distance[detected])

    def _measured(self, pulse: Array, distance: Array) -> Table:
        """With errors; one that would make the range negative is reflected."""
        radar, step = self.scene.radar, self.scene.antenna.step
        errors = self._receiver.standard_normal((len(pulse), 2))
        return self._centroids(
            pulse + errors[:, 0] * radar.sd_azimuth_deg * DEG / step,
            np.abs(distance + errors[:, 1] * radar.sd_range_m),
        )

    def _centroids(self, pulse: Array, distance: Array) -> Table:
        radar, antenna = self.scene.radar, self.scene.antenna
        table = blank(CENTROID, len(pulse))
        table["time"] = antenna.time(pulse)
        table["range"] = distance
        table["azimuth"] = TURN * (pulse % antenna.pulses) / antenna.pulses
        table["sd_range"], table["sd_azimuth"] = radar.sd_range_m, radar.sd_azimuth_deg * DEG
        return table
