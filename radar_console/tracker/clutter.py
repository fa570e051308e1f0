"""The density of false centroids, estimated live, where there are centroids.

For each centroid those are counted that the beam met around it just before: a target gives one
centroid a turn, so they are others. Their mean over an area is the density of clutter as a track
there meets it, however small and quick the patches are that clutter comes in. Three such means
sharpen each other, each the prior of the next: over the whole coverage; over the cells of a map of
range and azimuth, which forgets with a time constant of `1 / (1 - MEMORY)` turns; and over what a
track met on its way. Each is the mean of a gamma posterior.
"""

import math
from typing import Any

import numpy as np

from radar_console.tracker.kernels import bare, inlined
from radar_console.tracker.records import N_PAST, World

RINGS, COLUMNS = 32, 64
MEMORY = 0.9  # of the map, for a turn
TRACK_MEMORY = 0.9  # of a track, for a pass
# Counts that a prior is worth: of nothing, of the coverage, and of the cell.
FIRST_PRIOR, CELL_PRIOR, TRACK_PRIOR = 0.3, 0.5, 6.0
_LEAST_DENSITY = 1e-15  # m⁻²

MAP = np.dtype(
    [
        ("near", "f8", (RINGS, COLUMNS)),  # neighbours of the centroids, forgetful sums over turns
        ("area", "f8", (RINGS, COLUMNS)),  # m² where they were counted
        ("all_near", "f8"),  # the sums of these
        ("all_area", "f8"),
        ("last", "i8"),  # unwrapped number of the column that was last entered
    ]
)


def empty_map() -> Any:
    """A map (1,) that has seen nothing."""
    return np.zeros(1, MAP)


@bare
def place(e: float, n: float, max_range: float) -> tuple[int, int]:
    """Ring and column of a position relative to the sensor."""
    ring = min(int(math.sqrt(e * e + n * n) / max_range * RINGS), RINGS - 1)
    column = math.floor(math.atan2(e, n) / (2.0 * math.pi) * COLUMNS) % COLUMNS
    return ring, column


@inlined
def turn_to(clutter: Any, phi: float) -> None:
    """Forget a part of each column that the beam enters on its way to the unwrapped angle `phi`."""
    now = math.floor(phi / (2.0 * math.pi) * COLUMNS)
    clutter.last = max(clutter.last, now - COLUMNS)
    while clutter.last < now:
        clutter.last += 1
        column = clutter.last % COLUMNS
        for ring in range(RINGS):
            clutter.all_near -= (1.0 - MEMORY) * clutter.near[ring, column]
            clutter.all_area -= (1.0 - MEMORY) * clutter.area[ring, column]
            clutter.near[ring, column] *= MEMORY
            clutter.area[ring, column] *= MEMORY


@bare
def survey(plot: Any, beam: Any, w: World) -> None:
    """Count what the beam met around a plot just before it; and keep the plot for those to come."""
    par, past, size, clutter = w.par, w.past, w.books.size, w.clutter
    de, dn = plot.e - beam.e, plot.n - beam.n
    r = math.sqrt(de * de + dn * dn)
    rho = 0.5 * par.max_speed * par.turn + math.sqrt(par.sd_range**2 + (r * par.sd_azimuth) ** 2)
    half = math.asin(rho / r) if rho < r else math.pi
    plot.near, plot.exposure = 0.0, 0.5 * math.pi * rho * rho
    i = _first_from(past, size[N_PAST], plot.phi - half)
    while i < size[N_PAST]:
        e, n = past[i].e - plot.e, past[i].n - plot.n
        plot.near += e * e + n * n <= rho * rho
        i += 1
    plot.base = par.clutter
    if math.isnan(plot.base):
        everywhere = max(clutter.all_near, 0.0) + FIRST_PRIOR
        everywhere /= max(clutter.all_area, 0.0) + plot.exposure
        ring, column = place(de, dn, par.max_range)
        plot.base = (clutter.near[ring, column] + CELL_PRIOR) / (
            clutter.area[ring, column] + CELL_PRIOR / everywhere
        )
        if not plot.extended:
            clutter.near[ring, column] += plot.near
            clutter.area[ring, column] += plot.exposure
            clutter.all_near += plot.near
            clutter.all_area += plot.exposure
    plot.base = max(plot.base, _LEAST_DENSITY)
    if not plot.extended:
        newest = past[size[N_PAST]]
        newest.phi, newest.e, newest.n = plot.phi, plot.e, plot.n
        size[N_PAST] += 1


@bare
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


@bare
def density_at(plot: Any, near: float, exposure: float, par: Any) -> float:
    """λ, m⁻² and turn, at a plot, for a track that met `near` others in `exposure` m² and turns."""
    if not math.isnan(par.clutter):
        return float(plot.base)
    density: float = (near + plot.near + TRACK_PRIOR) / (exposure + plot.exposure + TRACK_PRIOR / plot.base)
    return density


@bare
def doubted(track: Any, plot: Any, par: Any) -> float:
    """λ, m⁻² and turn, for a track that has yet to prove itself: no less than the mean of the cell.

    At the edge of a patch half of what is counted lies outside, and a false track there would live
    on clutter that looks half as dense as it is.
    """
    return max(density_at(plot, track.near, track.exposure, par), float(plot.base))


@bare
def gather(track: Any, plot: Any) -> None:
    """Add what lay around a track's plot to what the track has met."""
    track.near = TRACK_MEMORY * (track.near + plot.near)
    track.exposure = TRACK_MEMORY * (track.exposure + plot.exposure)


@inlined
def forget(phi: float, w: World) -> None:
    """Drop what the counts need no more, once it is the better part of what is kept."""
    drop, size = _first_from(w.past, w.books.size[N_PAST], phi - math.pi), w.books.size
    if drop < 256 or 2 * drop < size[N_PAST]:
        return
    left = size[N_PAST] - drop
    for i in range(left):
        w.past[i] = w.past[i + drop]
    size[N_PAST] = left
