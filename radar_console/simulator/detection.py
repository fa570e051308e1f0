"""The receiver: echoes spread over range cells, noise, and the threshold.

A cell's voltage is the complex sum of the echoes in it and of complex Gaussian noise of power 1, so
amplitudes are in units of the rms noise. In a cell of noise alone the power is exponential with mean
1; with a Swerling I echo of mean power SNR it is exponential with mean 1 + SNR. The threshold on the
power is −ln P_FA, and so a single pulse has P_D = P_FA^(1/(1 + SNR)).

Source: Skolnik, Introduction to Radar Systems, 3rd ed. 2001, ch. 2; Richards, Fundamentals of Radar
Signal Processing, 2nd ed. 2014, §6.3.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]
Voltages = NDArray[np.complexfloating]
Cells = NDArray[np.int64]

LIT = 2.0
"""A target is lit within so many beam widths of the axis; the two-way pattern is −96 dB there."""


def threshold(p_fa: float) -> float:
    """The least amplitude that is a detection, in units of the rms noise."""
    return float(np.sqrt(-np.log(p_fa)))


def two_way_gain(offset: ArrayLike, beam_width: float) -> Array:
    """Power of the two-way Gaussian pattern, 1 on the axis; `beam_width` one way at 3 dB, rad."""
    return np.asarray(np.exp2(-8.0 * (np.asarray(offset, float) / beam_width) ** 2))


def snr(distance: ArrayLike, reference_db: float, reference_range: float, stc_range: float) -> Array:
    """Single-pulse peak SNR, a power ratio, by the R⁻⁴ law; below `stc_range`, m, it stays as there."""
    r = np.maximum(np.asarray(distance, float), stc_range)
    return np.asarray(10.0 ** (reference_db / 10.0) * (np.maximum(r, 1.0) / reference_range) ** -4)


def spread(
    pulse: NDArray[np.int64], distance: Array, voltage: Voltages, cell: float, cells: int
) -> tuple[Cells, Voltages]:
    """Share echoes out to the range cells, with a triangular response two cells wide.

    Parameters
    ----------
    pulse, distance, voltage : (k,) of each echo; m
    cell : length of a cell, m
    cells : number of cells in a pulse

    Returns
    -------
    The number of the cell in the stream of all pulses' cells, pulse · cells + cell, and the voltage
    there; two for each echo, fewer at the ends of the range.
    """
    place = distance / cell - 0.5  # in cells, from the centre of cell 0
    lower = np.floor(place).astype(np.int64)
    part = place - lower
    number = np.concatenate([lower, lower + 1])
    share = np.concatenate([voltage * (1.0 - part), voltage * part])
    inside = (number >= 0) & (number < cells)
    stream = np.concatenate([pulse, pulse]) * cells + number
    return stream[inside], share[inside]


def receive(stream: Cells, voltage: Voltages, rng: np.random.Generator) -> tuple[Cells, Array]:
    """Add up the echoes of each cell, and noise; each cell once, in order, with its amplitude."""
    if len(stream) == 0:
        return stream, np.empty(0)
    order = np.argsort(stream, kind="stable")
    first = np.flatnonzero(np.diff(stream[order], prepend=-1))
    noise = rng.normal(scale=np.sqrt(0.5), size=(len(first), 2))
    total = np.add.reduceat(voltage[order], first) + noise[:, 0] + 1j * noise[:, 1]
    return stream[order][first], np.abs(total)


def false_alarms(p_fa: float, count: int, rng: np.random.Generator) -> tuple[Cells, Array]:
    """Which of `count` cells of noise alone cross the threshold, and with what amplitude.

    Exact without visiting the cells: the gaps of a Bernoulli process are geometric, and the excess of
    an exponential power over a threshold is exponential again.
    """
    batch = int(count * p_fa + 6.0 * np.sqrt(count * p_fa)) + 16
    found = np.empty(0, np.int64)
    last = -1
    while last < count:
        gaps = np.minimum(rng.geometric(p_fa, batch), count + 1)
        found = np.concatenate([found, last + np.cumsum(gaps)])
        last = int(found[-1])
    found = found[found < count]
    return found, exceeding(p_fa, len(found), rng)


def exceeding(p_fa: float, count: int, rng: np.random.Generator) -> Array:
    """Amplitudes of noise, given that it crosses the threshold."""
    amplitude: Array = np.sqrt(-np.log(p_fa) + rng.standard_exponential(count))
    return amplitude


def merge(seen: Cells, amplitude: Array, alarms: Cells, alarm_amplitude: Array) -> tuple[Cells, Array]:
    """Cells that echoes reach together with false alarms elsewhere, in the order of the stream.

    `seen` is sorted; an alarm in one of its cells is no alarm, for that cell's noise is in `amplitude`.
    """
    alone = ~contains(seen, alarms)
    stream = np.concatenate([seen, alarms[alone]])
    level = np.concatenate([amplitude, alarm_amplitude[alone]])
    order = np.argsort(stream, kind="stable")
    return stream[order], level[order]


def contains(cells: Cells, which: Cells) -> NDArray[np.bool_]:
    """Which of `which` are among the sorted `cells`."""
    if len(cells) == 0:
        return np.zeros(len(which), bool)
    place = np.minimum(np.searchsorted(cells, which), len(cells) - 1)
    found: NDArray[np.bool_] = cells[place] == which
    return found
