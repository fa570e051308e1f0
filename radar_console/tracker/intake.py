"""What the tracker takes from a sector: centroids as positions in the plane, in the order of the beam."""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.core.geometry import MEAN_RADIUS
from radar_console.core.messages import CentroidFlag
from radar_console.estimation.gaussian import Array
from radar_console.estimation.measurement import convert

_convert = convert
_TURN = 2.0 * math.pi
_EXTENDED = int(CentroidFlag.EXTENDED)
_GRID = 2.0**20  # per s and per m: interpolated values are rounded, so that no cut shows in them
_SD_HEIGHT = 30.0  # m, of a reported height
HUGE = 1e12  # s, rad and m: no time, angle or position of a sensor
_FARTHEST = 1e8  # m: no radar's range
_OVERHEAD = 1e3  # m, beyond its range, that a target may be above the radar, by the errors of both
_WIDEST = 1.0  # rad: an azimuth that is less certain says nothing
_REFRACTION = 4.0 / 3.0  # of the earth's radius, for the path of a beam


@njit(cache=True, nogil=True, error_model="numpy")
def bracket(x: float, known: Array) -> tuple[int, float]:
    """The last of `known` (n,) that is not above `x`, and the part of the way to the next one.

    They never decrease. Before the first it is the first, beyond the last the last, and no part of a way.
    """
    last = known.size - 1
    if x <= known[0]:
        return 0, 0.0
    if x >= known[last]:
        return last, 0.0
    hi = np.searchsorted(known, x, side="right")
    x0, x1 = known[hi - 1], known[hi]
    return int(hi) - 1, (x - x0) / (x1 - x0) if x1 > x0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def between(values: Array, lower: int, part: float) -> float:
    """Part of the way from one value to the next."""
    value: float = values[lower]
    return value + part * (values[lower + 1] - value) if part > 0.0 else value


@njit(cache=True, nogil=True, error_model="numpy")
def rounded(x: float) -> float:
    """`x` on a grid of 2^-20."""
    return float(np.floor(x * _GRID + 0.5) / _GRID)


@njit(cache=True, nogil=True, error_model="numpy")
def bins(log: Array, known: int, seen: Any, first: int, width: float, beams: Any) -> None:
    """Fill `beams` (n,), a BEAM table, with the bins of `width` rad that begin at `first` times it.

    `log` (5, m): time, angle, east, north, up of the sectors' edges, of which `known` are filled;
    `seen` (m,): the radar looked between the edge before and this one.
    """
    time, angle, east, north = log[0, :known], log[1, :known], log[2, :known], log[3, :known]
    lower, part = bracket(first * width, angle)
    before = rounded(between(time, lower, part))
    for k in range(beams.size):
        beam, end = beams[k], (first + k + 1) * width
        lower, part = bracket(end, angle)
        beam.phi, beam.t = end, rounded(between(time, lower, part))
        beam.e, beam.n = rounded(between(east, lower, part)), rounded(between(north, lower, part))
        beam.step, before = beam.t - before, beam.t
        middle = np.searchsorted(angle, end - 0.5 * width)
        beam.seen = seen[min(middle, known - 1)]


@njit(cache=True, nogil=True, error_model="numpy")
def take(
    table: Any, log: Array, known: int, closed: float, above_sea: float, heights: bool, par: Any, plots: Any
) -> tuple[int, int, int]:
    """Fill `plots`, a PENDING table, from `table`, CENTROID.

    Returns how many there are, how many are late, and how many claims were left out that cannot be
    (heights out of reach, deviations that are none); what has no place or time is left out, too.

    Parameters
    ----------
    log : (5, m)  time, angle, east, north, up of the sectors' edges, of which `known` are filled
    closed : unwrapped angle below which every bin is done
    above_sea : of the frame's origin, m
    heights : whether heights are tracked
    """
    time, angles = log[0, :known], log[1, :known]
    east, north, up = log[2, :known], log[3, :known], log[4, :known]
    n, late, claims = 0, 0, 0
    newest = angles[known - 1]
    for k in range(table.size):
        row = table[k]
        t, r, azimuth = row.time, row.range, row.azimuth
        if not (abs(t) <= HUGE and math.isfinite(azimuth) and 0.0 <= r <= _FARTHEST):  # nor if one is NaN
            continue
        lower, part = bracket(t, time)
        angle = between(angles, lower, part)
        # The watermark bounds what a time can say: nothing below it is delivered any more. What is
        # so late that the nearest turn would be one ahead is taken at its word.
        if angle >= closed - 0.5 * _TURN:
            angle = min(max(angle, closed), newest)
        phi = azimuth + _TURN * math.ceil((angle - azimuth) / _TURN - 0.5)
        if phi < closed:
            late += 1
            continue
        plot = plots[n]
        n += 1
        plot.phi, plot.t, plot.ordinal = phi, t, row.ordinal
        plot.s_e, plot.s_n = rounded(between(east, lower, part)), rounded(between(north, lower, part))
        sensor_height = above_sea + rounded(between(up, lower, part))
        claims += _height(plot, row, sensor_height)
        plot.range = _ground_range(r, plot.up, sensor_height)
        if not heights:
            plot.up = np.nan
        plot.sd_range = row.sd_range if 0.0 < row.sd_range <= _FARTHEST else par.sd_range
        plot.sd_azimuth = row.sd_azimuth if 0.0 < row.sd_azimuth <= _WIDEST else par.sd_azimuth
        claims += plot.sd_range != row.sd_range and not math.isnan(row.sd_range)
        claims += plot.sd_azimuth != row.sd_azimuth and not math.isnan(row.sd_azimuth)
        de, dn, plot.ee, plot.en, plot.nn = _convert(plot.range, azimuth, plot.sd_range, plot.sd_azimuth)
        plot.e, plot.n = de + plot.s_e, dn + plot.s_n
        plot.doppler, plot.sd_doppler = row.doppler, row.sd_doppler
        plot.mode_3a, plot.address = row.mode_3a, row.address
        plot.extended = row.flags & _EXTENDED != 0
        plot.weight = 1.0
        plot.awaited, plot.mark, plot.head = False, -1, -1
    return n, late, claims


@njit(cache=True, nogil=True, error_model="numpy")
def _height(plot: Any, row: Any, sensor_height: float) -> int:
    """The reported height, or that of the elevation over a round earth; NaN without either.

    1 if a height was reported that is farther above or below the radar than the target is away.
    """
    plot.up, plot.uu = row.height, _SD_HEIGHT * _SD_HEIGHT
    wrong = not math.isnan(plot.up) and not abs(plot.up - sensor_height) <= row.range + _OVERHEAD
    if wrong:
        plot.up = np.nan
    if math.isnan(plot.up) and math.isfinite(row.elevation):
        r, sine = row.range, math.sin(row.elevation)
        level = r * math.cos(row.elevation)
        plot.up = sensor_height + r * sine + level * level / (2.0 * _REFRACTION * MEAN_RADIUS)
        if row.sd_elevation > 0.0:
            plot.uu = max((level * row.sd_elevation) ** 2, 1.0)
    return int(wrong)


@njit(cache=True, nogil=True, error_model="numpy")
def _ground_range(s: float, h: float, h0: float) -> float:
    """See `geometry.ground_range`, which is its oracle."""
    if math.isnan(h):
        return s
    half_chord_2 = max(s * s - (h - h0) ** 2, 0.0) / (4.0 * (MEAN_RADIUS + h0) * (MEAN_RADIUS + h))
    return 2.0 * MEAN_RADIUS * math.asin(math.sqrt(min(half_chord_2, 1.0)))


@njit(cache=True, nogil=True, error_model="numpy")
def merge(waiting: Any, fresh: Any, queue: Any) -> None:
    """Fill `queue` with both, in the order of angle, range and number; `waiting` has it already."""
    n = fresh.size
    phi = np.empty(n)
    for k in range(n):
        phi[k] = fresh[k].phi
    order = np.argsort(phi, kind="mergesort")
    for k in range(1, n):  # those at one angle
        i = k
        while i > 0 and _before(fresh[order[i]], fresh[order[i - 1]]):
            order[i], order[i - 1] = order[i - 1], order[i]
            i -= 1
    i = j = 0
    for k in range(queue.size):
        if j == n or (i < waiting.size and not _before(fresh[order[j]], waiting[i])):
            queue[k] = waiting[i]
            i += 1
        else:
            queue[k] = fresh[order[j]]
            j += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _before(a: Any, b: Any) -> bool:
    if a.phi != b.phi:
        return bool(a.phi < b.phi)
    if a.range != b.range:
        return bool(a.range < b.range)
    return bool(a.ordinal < b.ordinal)
