"""The density of false centroids, estimated live: a map, and what lay around each one lately.

Every centroid counts with the part of it that no confirmed track has used. The map over range and
azimuth forgets with a time constant of `1 / (1 - MEMORY)` turns; a cell's estimate is the mean of a
gamma posterior, whose prior is the mean over the whole coverage, itself with the prior of one false
centroid a turn. Clutter can be far smaller than a cell, and move. So
what lay around each centroid is counted, too: behind it in this turn, and all around it in the turn
before; a young track adds up what it met on its way. The count sharpens the map's estimate, as a
mixture of gamma posteriors: the place may have as much clutter as its cell, or many times more.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.tracker.records import CONFIRMED, N_PAST, N_POOL, STARTER, World

RINGS, COLUMNS = 32, 64
MEMORY = 0.9
PRIOR_TURNS = 0.5
MULTIPLES = ((1.0, 0.8), (8.0, 0.15), (64.0, 0.05))  # of the map's density, and their probabilities
TRACK_MEMORY = 0.9
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
    """Count what lay around the place of a plot lately, and keep the plot for those to come.

    Of this turn only what the beam has met before it, a half of the disc, so that nothing depends
    on how far the beam has got since.
    """
    par, past, size = w.par, w.past, w.size
    de, dn = plot.e - beam.e, plot.n - beam.n
    r = math.hypot(de, dn)
    rho = radius(r, par)
    half = math.asin(rho / r) if rho < r else math.pi
    area = math.pi * rho * rho
    plot.near = _count(plot, plot.phi - half, plot.phi, rho, w)
    plot.exposure = 0.5 * area
    plot.near_before = plot.exposure_before = 0.0
    if plot.phi - _TURN >= w.clutter.first:
        middle = plot.phi - _TURN
        plot.near_before = _count(plot, middle - half, middle + half, rho, w)
        plot.exposure_before = area
    plot.base = par.clutter
    if math.isnan(plot.base):
        plot.base = estimate(w.clutter, de, dn, par.max_range)
    plot.base = max(plot.base, _LEAST_DENSITY)
    place = size[N_PAST]
    past[place].phi, past[place].e, past[place].n = plot.phi, plot.e, plot.n
    past[place].weight = 0.0 if plot.extended else 1.0
    plot.past = place
    size[N_PAST] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _count(plot: Any, begin: float, end: float, rho: float, w: World) -> float:
    """Past centroids between two angles, within `rho` of a plot."""
    past, near, i = w.past, 0.0, _first_from(w.past, w.size[N_PAST], begin)
    while i < w.size[N_PAST] and past[i].phi <= end:
        e, n = past[i].e - plot.e, past[i].n - plot.n
        if e * e + n * n <= rho * rho:
            near += past[i].weight
        i += 1
    return near


@njit(cache=True, nogil=True, error_model="numpy")
def radius(r: float, par: Any) -> float:
    """How far around a place at range `r` other centroids count: what a target moves in half a turn."""
    reach: float = 0.5 * par.max_speed * par.turn + math.hypot(par.sd_range, r * par.sd_azimuth)
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
def false_density(track: Any, plot: Any, par: Any) -> float:
    """λ, m⁻² and turn, at a plot in the gate of a track."""
    if not math.isnan(par.clutter):
        return float(plot.base)
    near = track.near + plot.near + max(plot.near_before - _own(track, plot, par), 0.0)
    return _sharpened(plot.base, near, track.exposure + plot.exposure + plot.exposure_before)


@njit(cache=True, nogil=True, error_model="numpy")
def density_at(plot: Any, par: Any) -> float:
    """λ, m⁻² and turn, at a plot that is nobody's."""
    if not math.isnan(par.clutter):
        return float(plot.base)
    return _sharpened(plot.base, plot.near + plot.near_before, plot.exposure + plot.exposure_before)


@njit(cache=True, nogil=True, error_model="numpy")
def _sharpened(base: float, near: float, exposure: float) -> float:
    """The posterior mean, having counted `near` in `exposure` m² and turns.

    The prior is a mixture of exponentials with means that are multiples of `base`; n then has a
    geometric distribution under each of them.
    """
    total, mean = 0.0, 0.0
    for multiple, probability in MULTIPLES:
        x = multiple * base * exposure
        weight = probability / (1.0 + x)
        if near > 0.0:
            weight *= math.exp(near * math.log(x / (1.0 + x))) if x > 0.0 else 0.0
        total += weight
        mean += weight * (near + 1.0) / (exposure + 1.0 / (multiple * base))
    density: float = mean / total if total > 0.0 else (near + 1.0) / exposure
    return max(density, _LEAST_DENSITY)


@njit(cache=True, nogil=True, error_model="numpy")
def _own(track: Any, plot: Any, par: Any) -> float:
    """1 if the plot of the track's last pass is among those around `plot`.

    What a confirmed track has used does not count as clutter to begin with.
    """
    if not track.history & 1 or track.level == CONFIRMED:
        return 0.0
    if track.level == STARTER:
        moved = math.hypot(plot.e - track.x[0], plot.n - track.x[1])
    else:
        moved = math.hypot(track.x[2], track.x[3]) * par.turn
    return 1.0 if moved < radius(math.hypot(plot.e - plot.s_e, plot.n - plot.s_n), par) else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def gather(track: Any, plot: Any, par: Any) -> None:
    """Add what lay around a track's plot a turn ago to what the track has met; before it is served."""
    near = max(plot.near_before - _own(track, plot, par), 0.0)
    track.near = TRACK_MEMORY * (track.near + near)
    track.exposure = TRACK_MEMORY * (track.exposure + plot.exposure_before)


@njit(cache=True, nogil=True, error_model="numpy")
def forget(phi: float, w: World) -> None:
    """Drop what the counts need no more, once it is the better part of what is kept."""
    size, oldest = w.size, phi - (1.5) * _TURN
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
