"""What stands before the radar: its targets as it sees them, from where it is itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radar_console.core.geometry import slant_range, to_cartesian, to_polar, wrap
from radar_console.core.units import DEG, KM, KT
from radar_console.scenario import RadarSettings
from radar_console.simulator.antenna import Antenna
from radar_console.simulator.targets import Targets

Array = NDArray[np.floating]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Targets, and the radar that watches them."""

    radar: RadarSettings
    antenna: Antenna
    targets: Targets

    @property
    def max_range(self) -> float:
        """m"""
        return self.radar.max_range_km * KM

    def own_position(self, time: Array | float) -> tuple[Array, Array]:
        """East and north of the radar, m; it starts at its site."""
        return to_cartesian(np.asarray(time) * self.radar.speed_kt * KT, self.radar.course_deg * DEG)

    def relative(self, target: Numbers, time: Array) -> tuple[Array, Array, Array]:
        """East and north of pairs (target, time) from the radar, and their height, m."""
        east, north, height = self.targets.positions(target, time)
        own_east, own_north = self.own_position(time)
        return east - own_east, north - own_north, height

    def polar(self, target: Numbers, time: Array) -> tuple[Array, Array]:
        """Slant range, m, and azimuth, rad, of pairs (target, time)."""
        east, north, height = self.relative(target, time)
        ground, azimuth = to_polar(east, north)
        return slant_range(ground, height, self.radar.height_m), azimuth

    def slant(self, target: Numbers, time: Array) -> Array:
        """Slant range, m, of pairs (target, time)."""
        return self.polar(target, time)[0]

    def offset(self, target: Numbers, pulse: Numbers) -> tuple[Array, Array]:
        """Beam axis minus azimuth, rad in (−π, π], and slant range, of pairs (target, pulse)."""
        distance, azimuth = self.polar(target, self.antenna.time(pulse))
        return wrap(self.antenna.azimuth(pulse) - azimuth), distance

    def near_beam(self, turn: int, half_width: float) -> tuple[Numbers, Numbers]:
        """Pairs (target, pulse) of a turn that may be within `half_width`, rad, of the beam's axis.

        A superset, by target and pulse, around the azimuth in the middle of the turn: until the turn's
        ends a target moves by at most its speed times half a turn, and its azimuth by at most the
        angle under which that distance is seen. Near the radar, all pulses may see it.
        """
        antenna = self.antenna
        every = np.arange(len(self.targets))
        middle = np.full(len(every), antenna.time((turn + 0.5) * antenna.pulses))
        east, north, _ = self.relative(every, middle)
        ground, azimuth = to_polar(east, north)
        travel = (self.targets.top_speed + self.radar.speed_kt * KT) * 0.5 * antenna.rotation
        shift = np.where(
            ground > travel, np.arcsin(np.minimum(travel / np.maximum(ground, 1e-3), 1.0)), np.pi
        )
        half = np.ceil((half_width + shift) / antenna.step).astype(np.int64) + 1
        first = np.floor(azimuth / antenna.step).astype(np.int64) - half
        count = np.minimum(2 * half + 2, antenna.pulses)
        target = np.repeat(every, count)
        within = np.arange(len(target)) - np.repeat(np.cumsum(count) - count, count)
        pulse = turn * antenna.pulses + (np.repeat(first, count) + within) % antenna.pulses
        order = np.argsort(target * antenna.pulses + pulse % antenna.pulses)
        target, pulse = target[order], pulse[order]
        alive = self.targets.alive(target, antenna.time(pulse))
        return target[alive], pulse[alive]

    def crossings(self, turn: int) -> tuple[Numbers, Array]:
        """When the beam's axis sweeps over targets in a turn: pairs (target, pulse), pulse fractional.

        A target near the radar may be crossed twice in a turn, or not at all.
        """
        target, pulse = self.near_beam(turn, self.antenna.step)
        before, _ = self.offset(target, pulse)
        after, _ = self.offset(target, pulse + 1)
        crossed = (before <= 0.0) & (after > 0.0) & (after - before < np.pi)
        target, pulse, before, after = target[crossed], pulse[crossed], before[crossed], after[crossed]
        return target, pulse + before / (before - after)
