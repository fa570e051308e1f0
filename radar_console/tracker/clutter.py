"""The density of false centroids, estimated live: a map, and what lay around each one lately.

Every centroid counts with the part of it that no confirmed track has used. The map over range and
azimuth forgets with a time constant of `1 / (1 - MEMORY)` turns; a cell's estimate is the mean of a
gamma posterior, whose prior is the mean over the whole coverage, itself with the prior of one false
centroid a turn. Clutter can be far smaller than a cell, and move: so the centroids of the last two
turns within reach of a place are counted, and that count sharpens the map's estimate as another
gamma posterior, with the map's as its prior.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.tracker.records import N_PAST, N_POOL, World

RINGS, COLUMNS = 32, 64
MEMORY = 0.9
PRIOR_TURNS = 0.5
LOCAL_PRIOR = 0.5  # centroids that the map's estimate is worth
LOCAL_TURNS = 2
_TURN = 2.0 * math.pi
_LEAST_DENSITY = 1e-15  # m⁻²

MAP = np.dtype(
    [
        ("count", "f8", (RINGS, COLUMNS)),  # forgetful sums over turns
        ("fresh", "f8", (RINGS, COLUMNS)),  # of this turn
        ("turns", "f8", (COLUMNS,)),  # forgetful number of turns
        ("total", "f8"),
        ("exposure", "f8"),  # column-turns
        ("first", "f8"),  # unwrapped angle at which the stream began
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
def turn_to(clutter: Any, phi: float) -> None:
    """Take over the columns that the beam has left behind by the unwrapped angle `phi`."""
    now = math.floor(phi / (2.0 * math.pi) * COLUMNS)
    clutter.last = max(clutter.last, now - COLUMNS)
    while clutter.last < now:
        column = clutter.last % COLUMNS
        clutter.last += 1
        clutter.exposure += 1.0 - (1.0 - MEMORY) * clutter.turns[column]
        clutter.turns[column] = MEMORY * clutter.turns[column] + 1.0
        for ring in range(RINGS):
            fresh = clutter.fresh[ring, column]
            clutter.total += fresh - (1.0 - MEMORY) * clutter.count[ring, column]
            clutter.count[ring, column] = MEMORY * clutter.count[ring, column] + fresh
            clutter.fresh[ring, column] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def estimate(clutter: Any, e: float, n: float, max_range: float) -> float:
    """False centroids per m² and turn at a position relative to the sensor."""
    wedge = math.pi / COLUMNS  # half the angle of a column: the area is half the angle times r²
    mean = (max(clutter.total, 0.0) + 1.0) / (wedge * max_range * max_range * (clutter.exposure + COLUMNS))
    ring, column = place(e, n, max_range)
    width = max_range / RINGS
    area = wedge * width * width * (2.0 * ring + 1.0)
    count = max(clutter.count[ring, column], 0.0)
    density: float = (count + PRIOR_TURNS * mean * area) / (area * (clutter.turns[column] + PRIOR_TURNS))
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def survey(plot: Any, beam: Any, w: World) -> None:
    """Count what lay around the place of a plot in the last turns."""
    par, past = w.par, w.past
    de, dn = plot.e - beam.e, plot.n - beam.n
    r = math.hypot(de, dn)
    rho = radius(r, par)
    half = math.asin(rho / r) if rho < r else math.pi
    near, turns = 0.0, 0
    for k in range(1, LOCAL_TURNS + 1):
        middle = plot.phi - k * _TURN
        if middle < w.clutter.first:
            break
        turns += 1
        i = _first_from(past, w.size[N_PAST], middle - half)
        while i < w.size[N_PAST] and past[i].phi <= middle + half:
            e, n = past[i].e - plot.e, past[i].n - plot.n
            if e * e + n * n <= rho * rho:
                near += past[i].weight
            i += 1
    plot.near, plot.exposure = near, turns * math.pi * rho * rho
    plot.base = par.clutter
    if math.isnan(plot.base):
        plot.base = estimate(w.clutter, de, dn, par.max_range)
    plot.base = max(plot.base, _LEAST_DENSITY)


@njit(cache=True, nogil=True, error_model="numpy")
def radius(r: float, par: Any) -> float:
    """How far around a place at range `r` other centroids are counted: as far as a target moves in a turn."""
    reach: float = par.max_speed * par.turn + math.hypot(par.sd_range, r * par.sd_azimuth)
    return reach


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
def false_density(plot: Any, own: float, par: Any) -> float:
    """λ, m⁻² and turn, at a plot, for a track that `own` of the centroids around it belong to."""
    if not math.isnan(par.clutter):
        return float(plot.base)
    density: float = (max(plot.near - own, 0.0) + LOCAL_PRIOR) / (plot.exposure + LOCAL_PRIOR / plot.base)
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def own(track: Any, par: Any) -> float:
    """How many of the centroids that were counted around a young track's next plot are its own."""
    known = float(track.history & 1)
    if track.history & 2:
        known += 2.0 * math.hypot(track.x[2], track.x[3]) < par.max_speed
    return known


@njit(cache=True, nogil=True, error_model="numpy")
def remember(plot: Any, w: World) -> None:
    """Keep a plot for the counts of the next turns; `w.past` has room."""
    place = w.size[N_PAST]
    past = w.past[place]
    past.phi, past.e, past.n, past.weight = plot.phi, plot.e, plot.n, 0.0 if plot.extended else 1.0
    plot.past = place
    w.size[N_PAST] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def forget(phi: float, w: World) -> None:
    """Drop what the counts need no more, once it is the better part of what is kept."""
    size, oldest = w.size, phi - (LOCAL_TURNS + 0.5) * _TURN
    drop = _first_from(w.past, size[N_PAST], oldest)
    for p in range(size[N_POOL]):
        drop = min(drop, w.pool[p].past)
    if drop < 256 or 2 * drop < size[N_PAST]:
        return
    left = size[N_PAST] - drop
    for i in range(left):
        w.past[i] = w.past[i + drop]
    for p in range(size[N_POOL]):
        w.pool[p].past -= drop
    size[N_PAST] = left
