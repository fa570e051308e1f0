"""The beam's angle over time, from marks of the antenna or from the reports themselves.

A report's time is when the beam crossed it, so its azimuth less ω·t is the same for all reports of
a steady antenna: that phase, averaged as a unit vector, gives both the rate and the beam's angle.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radar_console.core.geometry import Array, unwrap_near, wrap
from radar_console.core.units import DEG, TURN

SHORTEST_TURN, LONGEST_TURN = 0.4, 20.0  # s, of the antennas that are looked for
STRAY = 30.0 * DEG  # a mark this far from its neighbours' phase is wrong
NEIGHBOURS = 2.5  # turns to either side over which a phase is averaged
LEAST_COHERENCE = 0.25  # mean cosine between two reports' phases; 0 where time and azimuth are unrelated


@dataclass(frozen=True, slots=True, eq=False)
class Encoder:
    """The unwrapped beam angle, linear between knots, at the nominal rate outside them.

    Attributes
    ----------
    time : (n,) s, strictly increasing
    angle : (n,) rad, strictly increasing; a multiple of 2π is north
    rotation : nominal time of one turn, s
    """

    time: Array
    angle: Array
    rotation: float

    def angle_at(self, time: Array) -> Array:
        """Beam angle, rad, at times, s."""
        rate = TURN / self.rotation
        before, after = np.minimum(time - self.time[0], 0.0), np.maximum(time - self.time[-1], 0.0)
        angle: Array = np.interp(time, self.time, self.angle) + rate * (before + after)
        return angle

    def time_at(self, angle: Array) -> Array:
        """Times, s, at beam angles, rad; the inverse of `angle_at`."""
        rate = TURN / self.rotation
        before, after = np.minimum(angle - self.angle[0], 0.0), np.maximum(angle - self.angle[-1], 0.0)
        time: Array = np.interp(angle, self.angle, self.time) + (before + after) / rate
        return time

    def shifted(self, turns: int) -> "Encoder":
        """The same encoder, counting its turns from another north."""
        return Encoder(self.time, self.angle + turns * TURN, self.rotation)


def rotation_of_marks(time: Array, azimuth: Array) -> float | None:
    """Median time between successive marks of one azimuth, s.

    Where no azimuth comes twice, less than a turn was recorded: it is told from the median rate
    between successive marks. None where there are not two marks.

    Parameters
    ----------
    time : (n,) s
    azimuth : (n,) rad; equal marks must be equal numbers
    """
    order = np.lexsort((time, azimuth))
    same = np.diff(azimuth[order]) == 0.0
    turns = np.diff(time[order])[same]
    turns = turns[turns >= SHORTEST_TURN]
    if len(turns):
        return float(np.median(turns))
    order = np.argsort(time, kind="stable")
    steps, passed = np.mod(np.diff(azimuth[order]), TURN), np.diff(time[order])
    part = steps[(steps > 0.0) & (passed > 0.0)] / passed[(steps > 0.0) & (passed > 0.0)]
    return TURN / float(np.median(part)) if len(part) else None


def encoder_of_marks(time: Array, azimuth: Array, rotation: float) -> tuple[Encoder, int]:
    """The encoder through antenna marks, and how many marks did not fit their neighbours.

    Parameters
    ----------
    time : (n,) s, n ≥ 1
    azimuth : (n,) rad, the beam at that time
    rotation : time of one turn, s
    """
    order = np.argsort(time, kind="stable")
    time, azimuth = time[order], azimuth[order]
    stray = np.abs(wrap(azimuth - _steady(time, azimuth, rotation))) > STRAY
    if stray.all():
        stray[:] = False
    time, azimuth = time[~stray], azimuth[~stray]
    angle = unwrap_near(azimuth, _steady(time, azimuth, rotation))
    # North comes twice, as the north marker and as sector 0.
    knots = _increasing(time, angle)
    return Encoder(time[knots], angle[knots], rotation), int(stray.sum())


def encoder_of_reports(time: Array, azimuth: Array, rotation: float) -> Encoder:
    """The encoder that the reports' own times and azimuths imply, averaged over a few turns.

    Parameters
    ----------
    time : (n,) s, n ≥ 1, when the beam crossed the report
    azimuth : (n,) rad
    rotation : time of one turn, s
    """
    order = np.argsort(time, kind="stable")
    time, azimuth = time[order], azimuth[order]
    steady = _steady(time, azimuth, rotation)
    if time[-1] - time[0] > 2.0 * rotation:  # a stated rotation is nominal; the mean rate is better
        centred = time - time.mean()
        rate = float(centred @ (steady - steady.mean()) / (centred @ centred))
        steady = _steady(time, azimuth, TURN / rate)
    # A knot every eighth of a turn: nearer ones would follow the noise of single reports.
    _, first = np.unique(np.floor(8.0 * (time - time[0]) / rotation), return_index=True)
    knots = first[_increasing(time[first], steady[first])]
    return Encoder(time[knots], steady[knots], rotation)


def infer_rotation(time: Array, azimuth: Array) -> float | None:
    """The time of one turn, s, from reports alone; None where time and azimuth do not tell.

    The rate is sought at which the phases az − ω·t agree best within windows of a minute, among
    turns of 0.4 s to 20 s. With few targets every multiple of the rate agrees as well: the slowest
    is taken. The drift of the phase from window to window then refines it.

    Parameters
    ----------
    time : (n,) s
    azimuth : (n,) rad
    """
    order = np.argsort(time, kind="stable")
    time, azimuth = time[order], azimuth[order]
    if len(time) >= 4:
        # Ten minutes tell enough, or so many reports; of dense ones some.
        count = max(int(np.searchsorted(time, time[0] + 600.0)), 1000)
        some = slice(0, count, -(-min(count, len(time)) // 5000))
        time, azimuth = time[some] - time[0], azimuth[some]
    if len(time) < 4 or time[-1] < 2.0 * SHORTEST_TURN:
        return None
    longest = min(LONGEST_TURN, float(time[-1]) / 2.0)
    window = 3.0 * longest
    starts = np.unique(np.floor(time / window), return_index=True)[1]
    counts = np.diff(np.append(starts, len(time)))
    pairs = float(np.sum(counts * (counts - 1.0)))
    if pairs == 0.0:
        return None
    rates = np.arange(TURN / longest, TURN / SHORTEST_TURN, TURN / window / 4.0)
    sums = np.stack([_window_sums(time, azimuth, rate, starts) for rate in rates])
    coherence = (np.sum(np.abs(sums) ** 2, axis=1) - len(time)) / pairs
    best = coherence.max()
    if best < LEAST_COHERENCE:
        return None
    padded = np.concatenate(([-1.0], coherence, [-1.0]))
    peak = (coherence >= padded[:-2]) & (coherence >= padded[2:]) & (coherence >= 0.9 * best)
    rate = float(rates[np.argmax(peak)])
    for _ in range(2):
        rate += _drift(time, azimuth, rate, starts)
    return TURN / rate


def _window_sums(
    time: Array, azimuth: Array, rate: float, starts: NDArray[np.intp]
) -> NDArray[np.complex128]:
    sums: NDArray[np.complex128] = np.add.reduceat(np.exp(1j * (azimuth - rate * time)), starts)
    return sums


def _drift(time: Array, azimuth: Array, rate: float, starts: NDArray[np.intp]) -> float:
    """How much faster the beam is than `rate`, rad/s: the slope of the phase."""
    sums = _window_sums(time, azimuth, rate, starts)
    phase = np.repeat(np.unwrap(np.angle(sums)), np.diff(np.append(starts, len(time))))
    unwrapped = unwrap_near(azimuth - rate * time, phase)
    centred = time - time.mean()
    return float(centred @ (unwrapped - unwrapped.mean()) / (centred @ centred))


def _steady(time: Array, azimuth: Array, rotation: float) -> Array:
    """The unwrapped angle of the beam at the times, (n,), averaged over the neighbours.

    Smoothed twice, what was left over once more: that takes out the lean which a rate that is
    slightly wrong gives a mean over neighbours that lie more to one side.
    """
    rate = TURN / rotation
    once = np.unwrap(_smooth(time, azimuth - rate * time, rotation)) + rate * time
    return once + _smooth(time, azimuth - once, rotation)


def _smooth(time: Array, phase: Array, rotation: float) -> Array:
    """The phase's mean direction over the neighbours in time, in (−π, π]."""
    total = np.concatenate(([0.0], np.cumsum(np.exp(1j * phase))))
    first = np.searchsorted(time, time - NEIGHBOURS * rotation, side="left")
    last = np.searchsorted(time, time + NEIGHBOURS * rotation, side="right")
    smooth: Array = np.angle(total[last] - total[first])
    return smooth


def _increasing(time: Array, angle: Array) -> NDArray[np.intp]:
    """Which knots to keep so that both time and angle strictly increase; the first always."""
    kept = []
    last_time = last_angle = -np.inf
    for i, (t, a) in enumerate(zip(time.tolist(), angle.tolist(), strict=True)):
        if t > last_time and a > last_angle:
            kept.append(i)
            last_time, last_angle = t, a
    return np.array(kept, dtype=np.intp)
