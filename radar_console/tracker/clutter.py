"""The density of false centroids: a map over range and azimuth, estimated live.

Every centroid counts with the part of it that no confirmed track has used. The map forgets with a
time constant of `1 / (1 - MEMORY)` turns. A cell's estimate is the mean of a gamma posterior, whose
prior is the mean over the whole coverage, itself with the prior of one false centroid a turn.
"""

import math
from typing import Any

import numpy as np
from numba import njit

RINGS, COLUMNS = 32, 64
MEMORY = 0.9
PRIOR_TURNS = 0.5

MAP = np.dtype(
    [
        ("count", "f8", (RINGS, COLUMNS)),  # forgetful sums over turns
        ("fresh", "f8", (RINGS, COLUMNS)),  # of this turn
        ("turns", "f8", (COLUMNS,)),  # forgetful number of turns
        ("total", "f8"),
        ("exposure", "f8"),  # column-turns
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
