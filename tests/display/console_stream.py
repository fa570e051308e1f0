"""A stream of sectors with tracks of known motion, for the tests of the console."""

import math
from collections.abc import Iterator

import numpy as np

from radar_console.core.geometry import to_polar
from radar_console.core.messages import (
    CENTROID,
    PLOT,
    TRACK,
    TRUTH,
    Radar,
    Sector,
    Site,
    Table,
    TrackStatus,
    blank,
)
from radar_console.core.units import DEG, KM, KMH, TURN

SECTORS = 64
ROTATION = 4.0


SITE = Site(20.0, 107.0)


def radar(site: Site | None = SITE) -> Radar:
    return Radar("Test radar", ROTATION, 300.0 * KM, 50.0, 0.1 * DEG, site=site)


class Stream:
    """Targets that fly straight, seen at every pass; the last one is never confirmed, one coasts."""

    def __init__(self, targets: int = 26, seed: int = 1, clutter: int = 6, spec: Radar | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.radar = spec or radar()
        self.rng, self.clutter, self.count = rng, clutter, targets
        azimuth = np.linspace(0.0, TURN, targets, endpoint=False)
        distance = self.radar.max_range * (0.2 + 0.65 * rng.random(targets))
        course = azimuth + math.pi + rng.uniform(-0.5, 0.5, targets)
        speed = rng.uniform(640, 900, targets) * KMH
        self.position = np.column_stack([distance * np.sin(azimuth), distance * np.cos(azimuth)])
        self.velocity = np.column_stack([speed * np.sin(course), speed * np.cos(course)])
        self.heights = np.full(targets, np.nan)
        self.codes = np.full(targets, -1)

    def truth(self, time: float) -> Table:
        rows = np.zeros(self.count, TRUTH)
        rows["time"], rows["target"] = time, np.arange(self.count)
        rows["east"], rows["north"] = (self.position + time * self.velocity).T
        rows["v_east"], rows["v_north"] = self.velocity.T
        rows["up"] = np.nan
        return rows

    def sectors(self, duration: float, start: float = 0.0) -> Iterator[Sector]:
        step = ROTATION / SECTORS
        for k in range(round(duration / step)):
            begin, end = TURN * k / SECTORS, TURN * (k + 1) / SECTORS
            t0, t1 = start + k * step, start + (k + 1) * step
            where = self.position + (t1 - start) * self.velocity
            distance, azimuth = to_polar(*where.T)
            seen = np.flatnonzero((azimuth >= begin % TURN) & (azimuth < begin % TURN + TURN / SECTORS))
            yield Sector(
                self.radar,
                t0,
                t1,
                begin,
                end,
                end,
                plots=self._plots(distance[seen], azimuth[seen], begin, t0),
                centroids=self._centroids(distance[seen], azimuth[seen], t0),
                tracks=self._tracks(seen, where, t0, t1, start),
            )

    def _plots(self, distance: np.ndarray, azimuth: np.ndarray, begin: float, time: float) -> Table:
        hits = 9
        around = np.tile((np.arange(hits) - hits // 2) * 0.15 * DEG, len(distance))
        false = self.rng.poisson(self.clutter)
        rows = blank(PLOT, len(around) + false)
        rows["time"] = time
        rows["range"] = np.concatenate(
            [np.repeat(distance, hits), self.radar.max_range * np.sqrt(self.rng.random(false))]
        )
        rows["azimuth"] = (
            np.concatenate(
                [np.repeat(azimuth, hits) + around, begin + self.rng.random(false) * TURN / SECTORS]
            )
            % TURN
        )
        rows["amplitude"] = np.concatenate([np.full(len(around), 12.0), np.full(false, 3.5)])
        return rows

    def _centroids(self, distance: np.ndarray, azimuth: np.ndarray, time: float) -> Table:
        rows = blank(CENTROID, len(distance))
        rows["time"], rows["range"], rows["azimuth"] = time, distance, azimuth
        rows["snr"], rows["sd_range"], rows["sd_azimuth"] = 20.0, 50.0, 0.1 * DEG
        return rows

    def _tracks(self, seen: np.ndarray, where: np.ndarray, t0: float, t1: float, start: float) -> Table:
        rows = blank(TRACK, len(seen))
        rows["track"] = 1000 + 7 * seen
        rows["time"] = t1
        rows["east"], rows["north"] = where[seen].T
        rows["v_east"], rows["v_north"] = self.velocity[seen].T
        rows["sd_east"], rows["sd_north"] = 21.0, 64.0
        rows["sd_v_east"], rows["sd_v_north"] = 3.0, 4.0
        rows["up"], rows["mode_3a"] = self.heights[seen], self.codes[seen]
        rows["born"], rows["plot_time"], rows["probability"] = start, t0, 0.91
        rows["hit"], rows["plot"] = True, 1
        old = t1 - start > 2 * ROTATION
        rows["status"] = TrackStatus.CONFIRMED if old else TrackStatus.TENTATIVE
        last = seen == self.count - 1
        rows["status"][last] = TrackStatus.TENTATIVE
        coasts = (seen == 5) & (t1 - start > 4 * ROTATION)
        rows["status"][coasts], rows["hit"][coasts] = TrackStatus.COASTING, False
        for name in ("plot_time", "probability"):
            rows[name][coasts] = np.nan
        return rows
