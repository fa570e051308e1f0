"""Centroids of clusters: where a target is, how well that is known, and whether it is one.

A target answers with the shape of the beam in azimuth and of a range cell in range, so the centre
of its plots, weighted by amplitude² in azimuth and by amplitude in range, is where it is. Weak hits
at the rim say little and may be noise: below a part of the peak they do not weigh.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.core.messages import CENTROID, CentroidFlag, Table, blank
from radar_console.core.units import DEG, TURN
from radar_console.plots.clusters import Clusters
from radar_console.scenario import PlotSettings, RadarSettings

VALLEY = 0.55
"""Two peaks are parted where the way between them sinks below this part of the lower peak."""

RIM = 0.1
"""Hits weaker than this part of the peak do not count in the extent: over the limits of a target is
what is wide at its height, not what is strong. At −20 dB the two-way beam is 1.8 beam widths wide."""

MOST_PARTS = 3
"""A cluster over the limits of a target is parted into at most so many; else it is land."""

EXTENDED, SPLIT = np.uint32(CentroidFlag.EXTENDED), np.uint32(CentroidFlag.SPLIT)

# The columns that are averaged.
COLUMNS = ("pulse", "range", "time", "elevation", "doppler")
PULSE, TIME = 0, 2

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Resolution:
    """What the accuracy of a centroid is measured in.

    Attributes
    ----------
    pulse : angle between pulses, rad
    cell : length of a range cell, m
    beam : one-way 3 dB width, rad
    """

    pulse: float
    cell: float
    beam: float

    @classmethod
    def of(cls, radar: RadarSettings) -> "Resolution":
        return cls(TURN / pulses_per_turn(radar), radar.cell_m, radar.beam_width_deg * DEG)


def pulses_per_turn(radar: RadarSettings) -> int:
    """A turn has a whole number of pulses; pulse n is at the unwrapped angle 2πn / pulses_per_turn."""
    return max(round(radar.rotation_s * radar.prf_hz), 1)


def measure(clusters: Clusters, settings: PlotSettings, resolution: Resolution) -> Table:
    """The centroids of clusters.

    Parameters
    ----------
    clusters : each with at least `settings.min_hits` plots
    settings : edge, split, and the limits of a target
    resolution : of the radar

    Returns
    -------
    (n,) CENTROID, in the order of time; n is the number of clusters, more if some were parted
    """
    plots, bounds = clusters.plots, clusters.bounds
    pulse, cell, amplitude = (plots[name].copy() for name in ("pulse", "cell", "amplitude"))
    flags = np.zeros(len(plots), np.uint32)  # of the part, kept at its strongest plot
    peak = _parts(
        pulse,
        cell,
        amplitude,
        bounds,
        clusters.cut,
        settings.split,
        settings.gap_pulses,
        settings.min_hits,
        settings.land_pulses,
        settings.land_cells,
        flags,
    )
    order = np.argsort(peak, kind="stable")  # a part keeps the order of pulse and cell
    peaks, starts = np.unique(peak[order], return_index=True)
    values = np.stack([plots[name][order].astype(float) for name in COLUMNS], axis=1)
    starts = np.append(starts, len(order))
    centre = _centres(values, amplitude[order], starts, settings.edge)
    hits = np.diff(starts)

    table = blank(CENTROID, len(peaks))
    table["ordinal"] = plots["ordinal"][peaks]
    table["azimuth"] = _in_turn(centre[:, PULSE] * resolution.pulse)
    for column, name in enumerate(COLUMNS):
        if column != PULSE:
            table[name] = centre[:, column]
    strongest = amplitude[peaks]
    table["snr"] = 20.0 * np.log10(strongest)
    table["sd_range"], table["sd_azimuth"] = claimed_deviations(strongest, hits, resolution)
    table["hits"] = hits
    table["flags"] = flags[peaks]
    return table[np.lexsort((table["range"], table["time"]))]


def claimed_deviations(peak: Floats, hits: Ints, resolution: Resolution) -> tuple[Floats, Floats]:
    """Standard deviations of a centroid's range, m, and azimuth, rad.

    Parameters
    ----------
    peak : (...) amplitude of the strongest plot in units of the rms noise
    hits : (...) number of plots
    resolution : of the radar

    Measured for Swerling I with 7.5 pulses of 0.2° in a beam of 1.5° and cells of 150 m:

        σ_az² = 0.0081² + (0.91 peak^−0.99 hits^−0.41)²   degrees
        σ_r²  = 14.8² + (277 peak^−0.52 hits^−1.05)²      m

    Another radar's are taken to scale. Its hits are counted as that radar would have had them, 7.5 in
    a beam. The terms of noise grow with the beam and the cell, and sink with the square root of the
    pulses in a beam, which average them. The floors are what sampling leaves of a noiseless target:
    0.0405 of the angle between pulses, 0.0987 of a cell.
    """
    density = resolution.beam / resolution.pulse / 7.5
    n = hits / density
    noise_azimuth = (0.91 / 1.5) * resolution.beam * peak**-0.99 * n**-0.41 / math.sqrt(density)
    noise_range = (277.0 / 150.0) * resolution.cell * peak**-0.52 * n**-1.05 / math.sqrt(density)
    return (
        np.hypot((14.8 / 150.0) * resolution.cell, noise_range),
        np.hypot((0.0081 / 0.2) * resolution.pulse, noise_azimuth),
    )


def _in_turn(angle: Floats) -> Floats:
    """The angle in [0, 2π)."""
    azimuth = np.mod(angle, TURN)
    return np.where(azimuth >= TURN, 0.0, azimuth)


@njit(cache=True, nogil=True)
def _parts(
    pulse: Ints,
    cell: NDArray[np.int32],
    amplitude: Floats,
    bounds: Ints,
    cut: NDArray[np.bool_],
    split: bool,
    gap: int,
    min_hits: int,
    most_pulses: int,
    most_cells: int,
    flags: NDArray[np.uint32],
) -> Ints:
    """Of each plot, the strongest plot of its part of the cluster; `flags` is written there."""
    peak = np.empty(pulse.size, np.int64)
    for k in range(bounds.size - 1):
        a, b = bounds[k], bounds[k + 1]
        pulses, cells = _extent(pulse[a:b], cell[a:b], amplitude[a:b], RIM)
        large = cut[k] or pulses > most_pulses or cells > most_cells
        land = cut[k] or pulses > MOST_PARTS * most_pulses or cells > MOST_PARTS * most_cells
        if split and not land:
            part = _flood(pulse[a:b], cell[a:b], amplitude[a:b], gap, min_hits)
            peaks = np.unique(part)
            if peaks.size > 1 and (
                not large
                or _are_targets(pulse[a:b], cell[a:b], amplitude[a:b], part, peaks, most_pulses, most_cells)
            ):
                peak[a:b] = part + a
                flags[peaks + a] = SPLIT
                continue
        strongest = a + np.argmax(amplitude[a:b])
        peak[a:b] = strongest
        flags[strongest] = EXTENDED if large else 0
    return peak


@njit(cache=True, nogil=True)
def _extent(pulse: Ints, cell: NDArray[np.int32], amplitude: Floats, rim: float) -> tuple[int, int]:
    """How many pulses and cells the plots span that are not weaker than a part of the peak."""
    seen = amplitude >= rim * np.max(amplitude)
    pulse, cell = pulse[seen], cell[seen]
    return int(np.max(pulse) - np.min(pulse) + 1), int(np.max(cell) - np.min(cell) + 1)


@njit(cache=True, nogil=True)
def _are_targets(
    pulse: Ints,
    cell: NDArray[np.int32],
    amplitude: Floats,
    part: Ints,
    peaks: Ints,
    most_pulses: int,
    most_cells: int,
) -> bool:
    """The parts of a large cluster are few, and none is large itself."""
    if peaks.size > MOST_PARTS:
        return False
    for strongest in peaks:
        own = part == strongest
        pulses, cells = _extent(pulse[own], cell[own], amplitude[own], RIM)
        if pulses > most_pulses or cells > most_cells:
            return False
    return True


@njit(cache=True, nogil=True)
def _flood(pulse: Ints, cell: NDArray[np.int32], amplitude: Floats, gap: int, min_hits: int) -> Ints:
    """Part a cluster at its valleys; of each plot, the strongest one of its part.

    The plots surface in the order of their amplitude, as the water sinks. A plot next to none is a
    new peak; one next to a part joins it; one that joins two parts is the saddle between them. The
    parts stay apart if the saddle is below `VALLEY` of the lower peak and both have `min_hits`
    plots above it.

    Source: Chazal, Guibas, Oudot, Skraba, "Persistence-based clustering in Riemannian manifolds",
    J. ACM 60(6), 2013; with a ratio in place of their difference. Neighbours are those of the
    clustering, so a single faded pulse is no valley.
    """
    rows, columns = _extent(pulse, cell, amplitude, 0.0)
    row, column = pulse - np.min(pulse), cell - np.min(cell)
    above = np.full((rows, columns), -1)  # the plot that has surfaced there
    root = np.arange(pulse.size)
    hits = np.ones(pulse.size, np.int64)
    for plot in np.argsort(-amplitude, kind="mergesort"):
        here = plot
        for r in range(max(row[plot] - gap, 0), min(row[plot] + gap + 1, rows)):
            for c in range(max(column[plot] - 1, 0), min(column[plot] + 2, columns)):
                if above[r, c] < 0:
                    continue
                there = above[r, c]
                while root[there] != there:
                    there = root[there]
                if there == here:
                    continue
                high, low = there, here
                if amplitude[here] > amplitude[there]:
                    high, low = here, there
                valley = amplitude[plot] < VALLEY * amplitude[low]
                if low == plot or not (valley and min(hits[low], hits[high]) >= min_hits):
                    root[low] = high
                    hits[high] += hits[low]
                here = high
        if above[row[plot], column[plot]] < 0:
            above[row[plot], column[plot]] = plot
    for plot in range(pulse.size):
        top = root[plot]
        while root[top] != top:
            top = root[top]
        root[plot] = top
    return root


@njit(cache=True, nogil=True)
def _centres(values: Floats, amplitude: Floats, bounds: Ints, edge: float) -> Floats:
    """Weighted means of the columns pulse, range, time, elevation and doppler over each part.

    They are taken about the first plot's value, so that a large pulse number or time costs no digits;
    scalar sums, so that a part has the same centre whatever else is measured with it.
    """
    centre = np.full((bounds.size - 1, values.shape[1]), np.nan)
    for k in range(bounds.size - 1):
        a, b = bounds[k], bounds[k + 1]
        least = edge * np.max(amplitude[a:b])
        for column in range(values.shape[1]):
            squared = column in (PULSE, TIME)
            total, moment, origin = 0.0, 0.0, np.nan
            for i in range(a, b):
                if amplitude[i] < least or np.isnan(values[i, column]):
                    continue
                if np.isnan(origin):
                    origin = values[i, column]
                weight = amplitude[i] ** 2 if squared else amplitude[i]
                total += weight
                moment += weight * (values[i, column] - origin)
            if total > 0.0:
                centre[k, column] = origin + moment / total
    return centre
