"""Raw returns: what every pulse of a turn finds above the threshold, cell by cell."""

from collections.abc import Iterator
from itertools import count

import numpy as np
from numpy.typing import NDArray

from radar_console.core.messages import PLOT, Table, blank
from radar_console.core.units import DEG, KM, TURN
from radar_console.scenario import Clutter
from radar_console.simulator import detection
from radar_console.simulator.clutter import Land, Places, false_targets, points
from radar_console.simulator.detection import Cells, Voltages
from radar_console.simulator.scene import Numbers, Scene

Array = NDArray[np.floating]


class RawReturns:
    """The plots of turn after turn.

    What a turn holds does not depend on how it is cut into sectors, and a target under the beam at
    north keeps its fluctuation from one turn to the next.
    """

    def __init__(
        self,
        scene: Scene,
        clutter: Clutter,
        land: Land,
        receiver: np.random.Generator,
        echoes: np.random.Generator,
        chance: np.random.Generator,
    ) -> None:
        """`receiver` draws the noise, `echoes` the fluctuation, and `chance` the clutter."""
        self.scene, self.clutter, self.land = scene, clutter, land
        self._receiver, self._echoes, self._chance = receiver, echoes, chance
        radar = scene.radar
        self.cells = cell_count(radar.max_range_km, radar.cell_m)
        self._lit = detection.LIT * radar.beam_width_deg * DEG
        self._last_lit = np.full(len(scene.targets), np.iinfo(np.int64).min // 2)
        self._strength = np.ones(len(scene.targets))

    def turns(self) -> Iterator[Table]:
        """PLOT tables, one a turn, in the order of pulse and cell; ordinals run on."""
        ordinal = 0
        before, now = self._draw(-1), self._draw(0)
        for turn in count():
            after = self._draw(turn + 1)
            plots = self._turn(turn, (before, now, after))
            plots["ordinal"] = np.arange(ordinal, ordinal + len(plots))
            ordinal += len(plots)
            before, now = now, after
            yield plots

    def _turn(self, turn: int, scatterers: "tuple[tuple[Places, Array], ...]") -> Table:
        antenna, p_fa = self.scene.antenna, self.scene.radar.p_fa
        start = turn * antenna.pulses * self.cells
        echoes = [
            self._target_echoes(turn),
            *(self._false_echoes(turn, places, strength) for places, strength in scatterers),
            (start + self.land.cells, self.land.voltage),
        ]
        stream = np.concatenate([cells for cells, _ in echoes])
        voltage = np.concatenate([volts for _, volts in echoes])
        seen, amplitude = detection.receive(stream, voltage, self._receiver)
        alarms, level = detection.false_alarms(p_fa, antenna.pulses * self.cells, self._receiver)
        stream, amplitude = detection.merge(seen, amplitude, start + alarms, level)
        stream, amplitude = self._with_single_returns(turn, stream, amplitude)
        above = amplitude >= detection.threshold(p_fa)
        return self._plots(stream[above], amplitude[above])

    def _target_echoes(self, turn: int) -> tuple[Cells, Voltages]:
        target, pulse = self.scene.near_beam(turn, self._lit)
        offset, distance = self.scene.offset(target, pulse)
        lit = np.abs(offset) <= self._lit
        target, pulse, offset, distance = target[lit], pulse[lit], offset[lit], distance[lit]
        power = self.scene.targets.gain[target] * self._fluctuation(target, pulse)
        return self._echoes_of(pulse, distance, offset, power)

    def _fluctuation(self, target: Numbers, pulse: Numbers) -> Array:
        """Power factor of pairs sorted by target and pulse, drawn when a target's passage begins.

        A passage begins with a pulse that lights a target that has been dark for a lit width.
        """
        if self.scene.radar.fluctuation == "swerling0" or len(target) == 0:
            return np.ones(len(target))
        first = np.diff(target, prepend=-1) > 0
        last = np.append(first[1:], True)
        previous = np.where(first, self._last_lit[target], np.roll(pulse, 1))
        begins = pulse - previous > self._lit / self.scene.antenna.step
        part = first | begins  # a passage, or the rest of one that came over north
        strengths = self._strength[target[part]]
        strengths[begins[part]] = self._echoes.standard_exponential(np.count_nonzero(begins))
        strength: Array = strengths[np.cumsum(part) - 1]
        self._strength[target[last]], self._last_lit[target[last]] = strength[last], pulse[last]
        return strength

    def _draw(self, turn: int) -> tuple[Places, Array]:
        """The false targets of a turn, and the power factors of their only passage."""
        places = false_targets(self.clutter, self.scene, turn, self._chance)
        swerling1 = self.scene.radar.fluctuation == "swerling1"
        size = len(places.pulse)
        return places, self._chance.standard_exponential(size) if swerling1 else np.ones(size)

    def _false_echoes(self, turn: int, places: Places, strength: Array) -> tuple[Cells, Voltages]:
        antenna = self.scene.antenna
        half = self._lit / antenna.step
        window = np.arange(int(2.0 * half) + 1)
        pulse = np.ceil(places.pulse - half).astype(np.int64)[:, None] + window
        offset = (pulse - places.pulse[:, None]) * antenna.step
        here = (np.abs(offset) <= self._lit) & (pulse // antenna.pulses == turn)
        distance, power = (np.broadcast_to(a[:, None], pulse.shape) for a in (places.distance, strength))
        return self._echoes_of(pulse[here], distance[here], offset[here], power[here])

    def _echoes_of(
        self, pulse: Numbers, distance: Array, offset: Array, gain: Array
    ) -> tuple[Cells, Voltages]:
        """The voltages of echoes off the beam's axis by `offset`, with the phase of their range."""
        radar = self.scene.radar
        power = gain * detection.snr(distance, radar.snr_db, radar.snr_range_km * KM, radar.stc_range_km * KM)
        power *= detection.two_way_gain(offset, radar.beam_width_deg * DEG)
        phase = -2.0 * TURN * distance / radar.wavelength_m
        voltage = np.sqrt(power) * np.exp(1j * phase)
        return detection.spread(pulse, distance, voltage, radar.cell_m, self.cells)

    def _with_single_returns(self, turn: int, stream: Cells, amplitude: Array) -> tuple[Cells, Array]:
        """Add clutter of single returns, as strong as false alarms; a cell keeps the strongest."""
        radar = self.scene.radar
        places = points(self.clutter, self.scene, turn, self._chance)
        if len(places.pulse) == 0:
            return stream, amplitude
        cell = np.minimum((places.distance / radar.cell_m).astype(np.int64), self.cells - 1)
        single = np.floor(places.pulse).astype(np.int64) * self.cells + cell
        stream = np.append(stream, single)
        level = np.append(amplitude, detection.exceeding(radar.p_fa, len(single), self._chance))
        order = np.lexsort((-level, stream))
        stream, level = stream[order], level[order]
        first = np.diff(stream, prepend=-1) > 0
        return stream[first], level[first]

    def _plots(self, stream: Cells, amplitude: Array) -> Table:
        antenna = self.scene.antenna
        plots = blank(PLOT, len(stream))
        plots["pulse"], plots["cell"] = np.divmod(stream, self.cells)
        plots["time"] = antenna.time(plots["pulse"])
        plots["range"] = (plots["cell"] + 0.5) * self.scene.radar.cell_m
        plots["azimuth"] = antenna.azimuth(plots["pulse"])
        plots["amplitude"] = amplitude
        return plots


def cell_count(max_range_km: float, cell_m: float) -> int:
    """Whole range cells in the instrumented range; the tolerance is for ratios like 6 km / 0.1 m."""
    return int(max_range_km * KM / cell_m * (1.0 + 1e-12))
