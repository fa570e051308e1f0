"""The density of false centroids, estimated live: a map, and what lay around each one lately.

Every centroid counts with the part of it that no confirmed track has used. The map over range and
azimuth forgets with a time constant of `1 / (1 - MEMORY)` turns; a cell's estimate is the mean of a
gamma posterior, whose prior is the mean density at a centroid: where one is, others are likelier
than elsewhere. Clutter can be far smaller than a cell, and move. So
for each centroid those are counted that the beam met around it just before: a target gives one
centroid a turn, so they are others. The mean of these counts over the centroids of a cell says how
dense clutter is where there is any, and what a track met on its way how dense it is around the track.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.tracker.records import N_PAST, World

RINGS, COLUMNS = 32, 64
MEMORY = 0.9
PRIOR = 1.0  # count that the density at the centroids of the whole coverage is worth
CROWD_PRIOR = 0.5  # counts that the map's density is worth, as a guess of the density at centroids
LOCAL_PRIOR = 2.0  # counts that the density at the centroids of the cell is worth, as a guess for a track
TRACK_MEMORY = 0.9
_LEAST_DENSITY = 1e-15  # m⁻²

MAP = np.dtype(
    [
        ("count", "f8", (RINGS, COLUMNS)),  # forgetful sums over turns
        ("fresh", "f8", (RINGS, COLUMNS)),  # of this turn
        ("near", "f8", (RINGS, COLUMNS)),  # neighbours of the centroids, forgetful sums
        ("area", "f8", (RINGS, COLUMNS)),  # m² where they were counted
        ("fresh_near", "f8", (RINGS, COLUMNS)),  # of this turn
        ("fresh_area", "f8", (RINGS, COLUMNS)),
        ("turns", "f8", (COLUMNS,)),  # forgetful number of turns
        ("pairs", "f8"),  # centroids with another one in their cell and turn, forgetful sum
        ("pairs_area", "f8"),  # m², over the centroids the areas of their cells
        ("last", "i8"),  # unwrapped number of the column that was last entered
    ]
)


def empty_map() -> Any:
    """A map (1,) that has seen nothing."""
    return np.zeros(1, MAP)


@njit(cache=True, nogil=True, error_model="numpy")
def place(e: float, n: float, max_range: float) -> tuple[int, int]:
    """Ring and column of a position relative to the sensor."""
    ring = min(int(math.hypot(e, n) / max_range * RINGS), RINGS - 1)
    column = math.floor(math.atan2(e, n) / (2.0 * math.pi) * COLUMNS) % COLUMNS
    return ring, column


@njit(cache=True, nogil=True, error_model="numpy")
def turn_to(clutter: Any, phi: float, max_range: float) -> None:
    """Take over the columns that the beam has left behind by the unwrapped angle `phi`."""
    now = math.floor(phi / (2.0 * math.pi) * COLUMNS)
    clutter.last = max(clutter.last, now - COLUMNS)
    while clutter.last < now:
        column = clutter.last % COLUMNS
        clutter.last += 1
        forget = MEMORY ** (1.0 / COLUMNS)
        clutter.pairs *= forget
        clutter.pairs_area *= forget
        clutter.turns[column] = MEMORY * clutter.turns[column] + 1.0
        for ring in range(RINGS):
            fresh = clutter.fresh[ring, column]
            clutter.pairs += fresh * max(fresh - 1.0, 0.0)
            clutter.pairs_area += fresh * _area(ring, max_range)
            clutter.count[ring, column] = MEMORY * clutter.count[ring, column] + fresh
            clutter.fresh[ring, column] = 0.0
            clutter.near[ring, column] *= MEMORY
            clutter.near[ring, column] += clutter.fresh_near[ring, column]
            clutter.area[ring, column] *= MEMORY
            clutter.area[ring, column] += clutter.fresh_area[ring, column]
            clutter.fresh_near[ring, column] = clutter.fresh_area[ring, column] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _area(ring: int, max_range: float) -> float:
    """Of a cell, m²."""
    width = max_range / RINGS
    return math.pi / COLUMNS * width * width * (2.0 * ring + 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def estimate(clutter: Any, e: float, n: float, max_range: float) -> float:
    """False centroids per m² and turn at a position relative to the sensor, where there is a centroid."""
    whole = math.pi * max_range * max_range  # with one centroid a turn in it, before any was seen
    cell = whole / (RINGS * COLUMNS)
    crowd = (max(clutter.pairs, 0.0) + cell / whole) / (max(clutter.pairs_area, 0.0) + cell)
    ring, column = place(e, n, max_range)
    area = _area(ring, max_range)
    count = max(clutter.count[ring, column], 0.0)
    density: float = (count + PRIOR) / (area * clutter.turns[column] + PRIOR / crowd)
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def survey(plot: Any, beam: Any, w: World) -> None:
    """Count what the beam met around a plot just before it; and keep the plot for those to come."""
    par, past, size, clutter = w.par, w.past, w.size, w.clutter
    de, dn = plot.e - beam.e, plot.n - beam.n
    r = math.hypot(de, dn)
    rho = 0.5 * par.max_speed * par.turn + math.hypot(par.sd_range, r * par.sd_azimuth)
    half = math.asin(rho / r) if rho < r else math.pi
    plot.near, plot.exposure = 0.0, 0.5 * math.pi * rho * rho
    i = _first_from(past, size[N_PAST], plot.phi - half)
    while i < size[N_PAST]:
        e, n = past[i].e - plot.e, past[i].n - plot.n
        plot.near += e * e + n * n <= rho * rho
        i += 1
    plot.base = par.clutter
    if math.isnan(plot.base):
        density = max(estimate(clutter, de, dn, par.max_range), _LEAST_DENSITY)
        ring, column = place(de, dn, par.max_range)
        near = clutter.near[ring, column] + clutter.fresh_near[ring, column] + CROWD_PRIOR
        area = clutter.area[ring, column] + clutter.fresh_area[ring, column] + CROWD_PRIOR / density
        plot.base = near / area
        if not plot.extended:
            clutter.fresh_near[ring, column] += plot.near
            clutter.fresh_area[ring, column] += plot.exposure
    plot.base = max(plot.base, _LEAST_DENSITY)
    if not plot.extended:
        newest = past[size[N_PAST]]
        newest.phi, newest.e, newest.n = plot.phi, plot.e, plot.n
        size[N_PAST] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _first_from(past: Any, stop: int, phi: float) -> int:
    """The first of the past centroids, in the order of their angles, that is not below `phi`."""
    lo, hi = 0, stop
    while lo < hi:
        middle = (lo + hi) // 2
        if past[middle].phi < phi:
            lo = middle + 1
        else:
            hi = middle
    return lo


@njit(cache=True, nogil=True, error_model="numpy")
def density_at(plot: Any, near: float, exposure: float, par: Any) -> float:
    """λ, m⁻² and turn, at a plot, for a track that met `near` others in `exposure` m² and turns."""
    if not math.isnan(par.clutter):
        return float(plot.base)
    density: float = (near + plot.near + LOCAL_PRIOR) / (exposure + plot.exposure + LOCAL_PRIOR / plot.base)
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def gather(track: Any, plot: Any) -> None:
    """Add what lay around a track's plot to what the track has met."""
    track.near = TRACK_MEMORY * (track.near + plot.near)
    track.exposure = TRACK_MEMORY * (track.exposure + plot.exposure)


@njit(cache=True, nogil=True, error_model="numpy")
def forget(phi: float, w: World) -> None:
    """Drop what the counts need no more, once it is the better part of what is kept."""
    drop, size = _first_from(w.past, w.size[N_PAST], phi - math.pi), w.size
    if drop < 256 or 2 * drop < size[N_PAST]:
        return
    left = size[N_PAST] - drop
    for i in range(left):
        w.past[i] = w.past[i + drop]
    size[N_PAST] = left
