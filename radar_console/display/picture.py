"""What the display knows of the world, kept up to date by sectors: plain arrays, no Qt."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from radar_console.core.geometry import ground_range, unwrap_near
from radar_console.core.messages import TRACK, TRUTH, Radar, Sector, Table, TrackStatus, empty
from radar_console.core.units import TURN

Floats = NDArray[np.float32]
Integers = NDArray[np.int64]

TRAIL_POINTS = 256
"""Past positions kept of each track."""

LOST_KEPT = 60.0
"""How long the last position of a lost track stays, s of data time."""

SILENT_TURNS = 10
"""A track that was not reported for so many turns is over."""

STALLED_AFTER = 1.5
"""An encoder that has not moved for so long is stalled, s of wall time."""

PLOT_HIT, CENTROID_HIT = 0, 1


class History:
    """The last hits of the radar, polar, in a ring: what the phosphor is painted from.

    Attributes
    ----------
    count : hits taken so far; hit number k lies in row k % capacity
    azimuth, range : (capacity,) rad and ground range m, from where the radar then was
    east, north : (capacity,) where the radar then was, m
    beam : (capacity,) unwrapped azimuth, rad
    lit : (capacity,) the picture's clock when the hit came, s of wall time
    strength : (capacity,) brightness in 0 … 1
    kind : (capacity,) PLOT_HIT or CENTROID_HIT
    """

    def __init__(self, capacity: int = 1 << 18) -> None:
        self.capacity = capacity
        self.count = 0
        self.azimuth = np.zeros(capacity)
        self.range = np.zeros(capacity)
        self.east = np.zeros(capacity)
        self.north = np.zeros(capacity)
        self.beam = np.zeros(capacity)
        self.lit = np.zeros(capacity)
        self.strength = np.zeros(capacity)
        self.kind = np.zeros(capacity, np.uint8)

    @property
    def oldest(self) -> int:
        """Number of the oldest hit that is still kept."""
        return max(self.count - self.capacity, 0)

    def rows(self, first: int, last: int) -> Integers:
        """Rows of the hits with numbers `first` … `last` - 1, as far as they are kept."""
        return np.arange(max(first, self.oldest), last) % self.capacity


class Picture:
    """The tracks, the returns and the antenna, as the sectors so far tell them.

    Attributes
    ----------
    radar : the sensor; None before the first sector
    time : data time of the newest sector, s; NaN before the first
    beam : unwrapped encoder angle, rad
    position : (3,) of the sensor, m east, north, up
    history : the returns, for the phosphor
    cell_depth : how deep a range cell is, m, as the plots tell it; NaN before two have come
    truth : the newest row of each simulated target, TRUTH
    clock : wall time that the picture has lived, s; advanced by `advance`
    waited : wall time since the encoder last moved, s
    revision : raised by everything that is taken
    sectors, plots, centroids : how many were taken
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget everything: another source, or a jump in a recording."""
        self.radar: Radar | None = None
        self.time = float("nan")
        self.beam = 0.0
        self.position = (0.0, 0.0, 0.0)
        self.history = History()
        self.cell_depth = float("nan")
        self.truth: Table = empty(TRUTH)
        self.clock = 0.0
        self.waited = 0.0
        self.revision = getattr(self, "revision", 0) + 1
        self.sectors = self.plots = self.centroids = 0
        self._turn: deque[tuple[float, float]] = deque()
        self._message = 0.0  # s that the last sector took
        self._lost: Table = np.empty(0, TRACK)
        self._lost_numbers: Integers = np.empty(0, np.int64)
        self._count = 0
        self._last_number = 0
        self._tracks: Table = np.zeros(64, TRACK)
        self._numbers: Integers = np.zeros(64, np.int64)
        self._trails: Floats = np.full((64, TRAIL_POINTS, 3), np.nan, np.float32)

    @property
    def tracks(self) -> Table:
        """The newest row of each live track, TRACK; the order changes when tracks end."""
        return self._tracks[: self._count]

    @property
    def numbers(self) -> Integers:
        """(tracks,) short number on the screen, in the order of confirmation; 0 before it."""
        return self._numbers[: self._count]

    @property
    def trails(self) -> Floats:
        """(tracks, TRAIL_POINTS, 3) past positions: m east, m north, s; newest last, NaN before birth."""
        return self._trails[: self._count]

    @property
    def lost(self) -> Table:
        """The last row of each confirmed track that ended less than LOST_KEPT ago, TRACK."""
        return self._lost

    @property
    def lost_numbers(self) -> Integers:
        """(lost,) their short numbers."""
        return self._lost_numbers

    @property
    def rotation(self) -> float:
        """Measured time of the last full turn, s; NaN before it."""
        if len(self._turn) < 2:
            return float("nan")
        (start, begin), (stop, end) = self._turn[0], self._turn[-1]
        turned = end - begin
        return TURN * (stop - start) / turned if turned >= TURN * (1.0 - 1e-9) else float("nan")

    @property
    def stalled(self) -> bool:
        """The encoder has stopped: it is late by more than its last two messages took."""
        return self.waited > max(STALLED_AFTER, 2.0 * self._message)

    def row_of(self, track: int) -> int | None:
        """The row of `track` in `tracks`; None if it is not alive."""
        found = np.flatnonzero(self.tracks["track"] == track)
        return int(found[0]) if len(found) else None

    def name_of(self, track: int) -> str:
        """What the screen calls a track: ``T016``, or ``tentative`` before it is confirmed."""
        row = self.row_of(track)
        if row is not None:
            return name(int(self.numbers[row]))
        found = np.flatnonzero(self._lost["track"] == track)
        return name(int(self._lost_numbers[found[-1]])) if len(found) else ""

    def advance(self, wall: float) -> None:
        """Wall time went on by `wall` s."""
        self.clock += wall
        self.waited += wall

    def take(self, sector: Sector) -> None:
        """Bring the picture up to `sector`."""
        if sector.end > self.beam or self.radar is None:
            self.waited = 0.0
        self.radar, self.time, self.beam = sector.radar, sector.stop, sector.end
        self.position = sector.position
        self.sectors += 1
        self.plots += len(sector.plots)
        self.centroids += len(sector.centroids)
        self.revision += 1
        self._measure_turn(sector)
        self._take_hits(sector)
        self._take_tracks(sector.tracks)
        self._forget(sector.radar.rotation)
        kept = self._lost["time"] > self.time - LOST_KEPT
        self._lost, self._lost_numbers = self._lost[kept], self._lost_numbers[kept]

    def take_truth(self, truth: Table) -> None:
        """Bring the simulated targets up to `truth`, TRUTH; of several rows of one the last counts."""
        _, last = np.unique(truth["target"][::-1], return_index=True)
        self.truth = truth[::-1][last]
        self.revision += 1

    def _forget(self, rotation: float) -> None:
        """End tracks of which nothing was heard for turns: the row that ended them was dropped."""
        silent = np.flatnonzero(self.tracks["time"] < self.time - SILENT_TURNS * rotation)
        if len(silent):
            self._lose(self.tracks[silent], silent)
            self._remove(silent)

    def _measure_turn(self, sector: Sector) -> None:
        if sector.end <= sector.begin:
            return  # what was still to come at the end of a stream
        self._message = sector.stop - sector.start
        if self._turn and sector.stop <= self._turn[-1][0]:
            self._turn.clear()
        if not self._turn:
            self._turn.append((sector.start, sector.begin))
        self._turn.append((sector.stop, sector.end))
        while len(self._turn) > 2 and sector.end - self._turn[1][1] >= TURN * (1.0 - 1e-9):
            self._turn.popleft()

    def _measure_cell(self, plots: Table) -> None:
        """From the nearest and the farthest plot of a sector."""
        if len(plots):
            cells = int(np.ptp(plots["cell"]))
            self.cell_depth = float(np.ptp(plots["range"])) / cells if cells else self.cell_depth

    def _take_hits(self, sector: Sector) -> None:
        plots, centroids = sector.plots, sector.centroids
        added = len(plots) + len(centroids)
        if added == 0:
            return
        self._measure_cell(plots)
        h = self.history
        rows = np.arange(h.count, h.count + added) % h.capacity
        azimuth = np.concatenate([plots["azimuth"], centroids["azimuth"]])
        level = np.where(np.isnan(plots["elevation"]), 1.0, np.cos(plots["elevation"]))
        site = sector.radar.site
        above_sea = sector.position[2] + (site.height if site else 0.0)
        below = ground_range(centroids["range"], centroids["height"], above_sea)
        h.azimuth[rows] = azimuth
        h.range[rows] = np.concatenate([plots["range"] * level, below])
        h.east[rows], h.north[rows] = sector.position[:2]
        h.beam[rows] = unwrap_near(azimuth, 0.5 * (sector.begin + sector.end))
        h.lit[rows] = self.clock
        h.strength[rows] = np.concatenate([_brightness(plots["amplitude"]), np.ones(len(centroids))])
        h.kind[rows] = np.repeat(np.array([PLOT_HIT, CENTROID_HIT], np.uint8), [len(plots), len(centroids)])
        h.count += added

    def _take_tracks(self, rows: Table) -> None:
        while len(rows):
            _, first = np.unique(rows["track"], return_index=True)
            first.sort()
            self._take_once(rows[first])
            rows = np.delete(rows, first)

    def _take_once(self, rows: Table) -> None:
        """Rows of tracks that are all different."""
        place = self._places(rows["track"])
        # A single plot has no velocity yet, and is not shown: in clutter nearly all come to nothing.
        single = (rows["status"] == TrackStatus.TENTATIVE) & (rows["v_east"] == 0) & (rows["v_north"] == 0)
        born = (place < 0) & (rows["status"] != TrackStatus.DELETED) & ~single
        place[born] = self._append(int(born.sum()))
        rows, place = rows[place >= 0], place[place >= 0]
        ended = rows["status"] == TrackStatus.DELETED
        self._lose(rows[ended], place[ended])
        self._tracks[place] = rows
        self._trails[place, :-1] = self._trails[place, 1:]
        self._trails[place, -1, 0] = rows["east"]
        self._trails[place, -1, 1] = rows["north"]
        self._trails[place, -1, 2] = rows["time"]
        unnumbered = (rows["status"] == TrackStatus.CONFIRMED) & (self._numbers[place] == 0)
        fresh = place[unnumbered]
        self._numbers[fresh] = self._last_number + 1 + np.arange(len(fresh))
        self._last_number += len(fresh)
        self._remove(place[ended])

    def _places(self, tracks: Integers) -> Integers:
        """Where each track lies; -1 if it is not alive."""
        if self._count == 0:
            return np.full(len(tracks), -1)
        known = self._tracks["track"][: self._count]
        order = np.argsort(known)
        near = order[np.minimum(np.searchsorted(known, tracks, sorter=order), self._count - 1)]
        return np.where(known[near] == tracks, near, -1)

    def _append(self, added: int) -> Integers:
        """Make room for `added` tracks; where they lie."""
        place = np.arange(self._count, self._count + added)
        self._count += added
        while self._count > len(self._tracks):
            self._tracks = np.concatenate([self._tracks, np.zeros_like(self._tracks)])
            self._numbers = np.concatenate([self._numbers, np.zeros_like(self._numbers)])
            self._trails = np.concatenate([self._trails, np.full_like(self._trails, np.nan)])
        self._numbers[place] = 0
        self._trails[place] = np.nan
        return place

    def _lose(self, rows: Table, place: Integers) -> None:
        """Keep the last row of those that had been confirmed."""
        known = self._numbers[place] > 0
        self._lost = np.concatenate([self._lost, rows[known]])
        self._lost_numbers = np.concatenate([self._lost_numbers, self._numbers[place[known]]])

    def _remove(self, place: Integers) -> None:
        """Fill the gaps with the last tracks, so that the live ones stay together."""
        left = self._count - len(place)
        gaps = place[place < left]
        movers = np.setdiff1d(np.arange(left, self._count), place)
        for store in (self._tracks, self._numbers, self._trails):
            store[gaps] = store[movers]
        self._count = left


def name(number: int) -> str:
    """What the screen calls the track with this short number."""
    return f"T{number:03d}" if number else "tentative"


def _brightness(amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """From the detection threshold (about 10 dB over the noise) to clear echoes (30 dB), in 0.2 … 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        decibel = 20.0 * np.log10(amplitude)
    return np.nan_to_num(np.clip(0.2 + 0.8 * (decibel - 10.0) / 20.0, 0.2, 1.0), nan=1.0)
