"""Cut a table of reports or raw returns into the sectors that a turning beam would have sent."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from radar_console.core.geometry import Array
from radar_console.core.messages import NO_CENTROIDS, NO_PLOTS, PLOT, Radar, Sector, Table
from radar_console.core.rotation import Encoder
from radar_console.core.units import TURN

SECTORS = 64  # messages a turn
LONGEST_SILENCE = 10  # turns without marks or reports; beyond it the beam is not taken to have turned

_KEYS = {
    "name": "name",
    "rotation_s": "rotation",
    "max_range_km": "max_range",
    "sd_range_m": "sd_range",
    "sd_azimuth_deg": "sd_azimuth",
    "beam_width_deg": "beam_width",
    "latitude_deg": "site",
    "longitude_deg": "site",
    "height_m": "site",
}


def stated(radar: Radar | None, given: frozenset[str]) -> dict[str, Any]:
    """The fields of `radar` that a configuration states itself, by name.

    Parameters
    ----------
    radar : the radar of the configuration; None is none
    given : the keys that the file really has, such as ``radar.rotation_s``
    """
    if radar is None:
        return {}
    names = {_KEYS[key] for key in (k.removeprefix("radar.") for k in given) if key in _KEYS}
    fields = {name: getattr(radar, name) for name in names}
    return {name: value for name, value in fields.items() if value is not None}


def first_turn(encoder: Encoder, angle: Array) -> int:
    """How many turns to add so that the smallest of the angles lies in [0, 2π)."""
    return -int(np.floor(angle.min() / TURN))


def cut(
    radar: Radar,
    encoder: Encoder,
    table: Table,
    angle: Array,
    active: Array,
    positions: Callable[[Array], Array] | None = None,
    sectors: int = SECTORS,
) -> Iterator[Sector]:
    """Yield so many sectors a turn, each with its rows of the table, in the order of angle.

    Where nothing happens for more than ten turns the recording has a hole: no sector is sent,
    because the beam was not watched.

    Parameters
    ----------
    radar : goes into every sector
    encoder : the beam
    table : CENTROID, or PLOT
    angle : (rows,) unwrapped angle of each row, rad
    active : (n,) angles, rad, at which the beam was seen, n ≥ 1; they bound the sectors
    positions : where the sensor is, (n, 3) m, at times (n,) s; None if it stands at the origin
    sectors : messages a turn
    """
    raw = table.dtype == PLOT
    order = np.lexsort((table["cell"], table["pulse"]) if raw else (table["range"], angle))
    table, angle = table[order], angle[order]
    step = TURN / sectors
    numbers = _sector_numbers(np.concatenate((active, angle)), sectors)
    # Of raw returns the pulses stay in their order, whatever the last bit of their angles says.
    edge_of = np.floor(np.maximum.accumulate(angle) / step)
    first = np.searchsorted(edge_of, numbers, side="left")
    last = np.searchsorted(edge_of, numbers, side="right")
    begin, end = numbers * step, (numbers + 1) * step
    start, stop = encoder.time_at(begin), encoder.time_at(end)
    where = positions(stop) if positions is not None else np.zeros((len(stop), 3))
    for i in range(len(numbers)):
        rows = table[first[i] : last[i]]
        yield Sector(
            radar,
            start=float(start[i]),
            stop=float(stop[i]),
            begin=float(begin[i]),
            end=float(end[i]),
            complete=float(end[i]),
            position=tuple(where[i].tolist()),
            plots=rows if raw else NO_PLOTS,
            centroids=NO_CENTROIDS if raw else rows,
        )


def _sector_numbers(active: Array, sectors: int) -> Array:
    """The numbers of the sectors between the first and the last activity, without the holes."""
    seen = np.unique(np.floor(active / (TURN / sectors)))
    numbers = np.arange(seen[0], seen[-1] + 1.0)
    following = seen[np.minimum(np.searchsorted(seen, numbers), len(seen) - 1)]
    preceding = seen[np.searchsorted(seen, numbers, side="right") - 1]
    watched: Array = numbers[following - preceding <= LONGEST_SILENCE * sectors]
    return watched
