"""The one message of the chain, the sector, and the tables that it carries.

A *sector* says: the beam turned from one angle to another between two times, from this radar at
this position, and these are its returns. Stages add to it: plots in, centroids in, tracks in.
Tables are NumPy structured arrays and are made read-only when a sector is built. Inside, units are
SI and radians; time is float seconds since the recording's midnight or the simulation's start;
x is east, y north, azimuth clockwise from north.
"""

from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.void]

PLOT = np.dtype(
    [
        ("ordinal", "i8"),  # the number of the plot in its source, from 0
        ("time", "f8"),  # s
        ("pulse", "i8"),  # number of the pulse since the start; never wraps
        ("cell", "i4"),  # number of the range cell
        ("range", "f8"),  # slant range, m
        ("azimuth", "f8"),  # rad, [0, 2π)
        ("elevation", "f8"),  # rad above the horizon; NaN unknown
        ("doppler", "f8"),  # range rate, m/s, positive away; NaN unknown
        ("amplitude", "f8"),  # in units of the rms noise
    ]
)
"""A raw return: one pulse's threshold crossing in one range cell."""

CENTROID = np.dtype(
    [
        ("ordinal", "i8"),  # the input plot's ordinal; of a cluster, its strongest plot's
        ("time", "f8"),  # s, when the beam's axis crossed it
        ("range", "f8"),  # slant range, m
        ("azimuth", "f8"),  # rad, [0, 2π)
        ("elevation", "f8"),  # rad; NaN unknown
        ("doppler", "f8"),  # m/s, positive away; NaN unknown
        ("height", "f8"),  # m above sea level; NaN unknown
        ("snr", "f8"),  # dB; NaN unknown
        ("sd_range", "f8"),  # m, claimed standard deviation
        ("sd_azimuth", "f8"),  # rad
        ("sd_elevation", "f8"),  # rad; NaN unknown
        ("sd_doppler", "f8"),  # m/s; NaN unknown
        ("hits", "i4"),  # plots in the cluster; 0 where the source does not say
        ("flags", "u4"),  # CentroidFlag
        ("mode_3a", "i4"),  # Mode 3/A code as its number (0o7700 is 4032); -1 none
        ("address", "i4"),  # Mode S 24-bit address; -1 none
    ]
)
"""The centre of a cluster of plots; what an ASTERIX CAT-048 target report already is."""

TRACK = np.dtype(
    [
        ("track", "i8"),  # number of the track: the ordinal of its first plot
        ("time", "f8"),  # s, of the state
        ("status", "u1"),  # TrackStatus after this update
        ("hit", "?"),  # the pass was a hit; a missed pass is reported too
        ("east", "f8"),  # m, in the frame of the sector
        ("north", "f8"),
        ("up", "f8"),  # m; NaN unknown
        ("v_east", "f8"),  # m/s
        ("v_north", "f8"),
        ("v_up", "f8"),  # NaN unknown
        ("sd_east", "f8"),  # m
        ("sd_north", "f8"),
        ("sd_up", "f8"),  # NaN unknown
        ("sd_v_east", "f8"),  # m/s
        ("sd_v_north", "f8"),
        ("sd_v_up", "f8"),  # NaN unknown
        ("plot", "i8"),  # ordinal of the plot with the highest association probability; -1 none
        ("plot_time", "f8"),  # s, when the beam saw that plot; NaN none
        ("probability", "f8"),  # that probability; NaN none
        ("born", "f8"),  # s, time of the track's first plot
        ("approximate", "?"),  # the association was past the exact algorithm's budget
        ("mode_3a", "i4"),  # last Mode 3/A code heard; -1 none
    ]
)
"""What the tracker believes: a row for each track at each of its passes."""

TRUTH = np.dtype(
    [
        ("time", "f8"),  # s
        ("target", "i4"),  # number of the target, from 0
        ("east", "f8"),  # m
        ("north", "f8"),
        ("up", "f8"),  # m; NaN in a two-dimensional world
        ("v_east", "f8"),  # m/s
        ("v_north", "f8"),
        ("v_up", "f8"),
    ]
)
"""Where the simulator's targets are; it travels beside the sectors, never in them."""


class TrackStatus(IntEnum):
    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2
    DELETED = 3


class CentroidFlag(IntFlag):
    EXTENDED = 1  # wider than a target can be: land, or weather
    SPLIT = 2  # a cluster was cut at a valley between two peaks
    MERGED = 4  # possibly two targets that could not be parted


@dataclass(frozen=True, slots=True)
class Site:
    """A place on WGS84: degrees, and metres above sea level."""

    latitude_deg: float
    longitude_deg: float
    height: float = 0.0


@dataclass(frozen=True, slots=True)
class Radar:
    """What is known of a radar before it turns.

    Attributes
    ----------
    name : what the screen calls it
    rotation : nominal time of one turn, s
    max_range : instrumented range, m
    sd_range, sd_azimuth : measurement standard deviations where a report claims none, m and rad
    beam_width : one-way 3 dB width, rad
    site : the origin of the local frame on the earth; None if unknown
    """

    name: str
    rotation: float
    max_range: float
    sd_range: float
    sd_azimuth: float
    beam_width: float = 0.02617993877991494
    site: Site | None = None


def empty(dtype: np.dtype[Any]) -> Table:
    """A read-only table without rows."""
    table: Table = np.empty(0, dtype)
    table.flags.writeable = False
    return table


NO_PLOTS, NO_CENTROIDS, NO_TRACKS = empty(PLOT), empty(CENTROID), empty(TRACK)


@dataclass(frozen=True, slots=True, eq=False)
class Sector:
    """The beam turned from `begin` to `end` between `start` and `stop`; these are its returns.

    Attributes
    ----------
    radar : the sensor
    start, stop : s; `stop` is the data time at which this message exists
    begin, end : unwrapped beam angle, rad, never decreasing; 2πk is north for the k-th time
    position : (3,) of the sensor at `stop`, m east, north, up in the frame of `radar.site`
    complete : unwrapped beam angle below which every centroid has been delivered, with this
        message or an earlier one; at most `end`
    plots, centroids, tracks : tables PLOT, CENTROID, TRACK
    """

    radar: Radar
    start: float
    stop: float
    begin: float
    end: float
    complete: float
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    plots: Table = field(default_factory=lambda: NO_PLOTS)
    centroids: Table = field(default_factory=lambda: NO_CENTROIDS)
    tracks: Table = field(default_factory=lambda: NO_TRACKS)

    def __post_init__(self) -> None:
        for table in (self.plots, self.centroids, self.tracks):
            table.flags.writeable = False

    def adding(self, **changes: Any) -> "Sector":
        """The same sector with some fields replaced."""
        return replace(self, **changes)


def blank(dtype: np.dtype[Any], count: int) -> Table:
    """A writable table of `count` rows where floats are NaN, codes and plots -1, the rest 0."""
    table: Table = np.zeros(count, dtype)
    for name in dtype.names or ():
        if dtype[name].kind == "f":
            table[name] = np.nan
        elif name in ("mode_3a", "address", "plot"):
            table[name] = -1
    return table
