"""How long a frame of the scope takes, off-screen, 1024 × 1024.

    QT_QPA_PLATFORM=offscreen python benchmarks/frames.py

Two scenes made here, so that only the display is measured: `quiet` has 25 tracks, clutter and the
21,800 raw plots a turn of a radar with P_FA 6e-3; `crowd` has 1,000 tracks with labels and trails.
The clock of the scene goes on 1/60 s a frame; a frame is: take the sectors that came, light, develop,
paint. A third of a minute is left out at first, until trails and phosphor are full. Processor time is
what a frame takes when the machine has nothing else to do.
"""

import argparse
import os
import time
from collections.abc import Iterator

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QApplication

from radar_console.core.geometry import to_cartesian, to_polar
from radar_console.core.messages import CENTROID, PLOT, TRACK, Radar, Sector, Table, TrackStatus, blank
from radar_console.core.units import DEG, KM, TURN
from radar_console.display.picture import Picture
from radar_console.display.ppi import Ppi
from radar_console.display.view import View

RADAR = Radar("Benchmark", rotation=4.0, max_range=300 * KM, sd_range=50.0, sd_azimuth=0.1 * DEG)
SECTORS = 64
SCENES = {"quiet": (25, 870, 21_000), "crowd": (1000, 200, 0)}
"""Tracks, false centroids a turn, noise plots a turn."""

FRAME = 1.0 / 60.0
WARM_UP = 20.0


def sectors(tracks: int, clutter: int, noise: int, rng: np.random.Generator) -> Iterator[Sector]:
    """A radar that turns for ever over targets on straight courses."""
    distance = 290 * KM * np.sqrt(rng.uniform(0.01, 1.0, tracks))
    east, north = to_cartesian(distance, rng.uniform(0.0, TURN, tracks))
    v_east, v_north = to_cartesian(rng.uniform(80.0, 280.0, tracks), rng.uniform(0.0, TURN, tracks))
    step, period = TURN / SECTORS, RADAR.rotation / SECTORS
    count = 0
    while True:
        begin, start = count * step, count * period
        stop = start + period
        x, y = east + v_east * stop, north + v_north * stop
        azimuth = to_polar(x, y)[1]
        seen = np.flatnonzero((azimuth >= begin % TURN) & (azimuth < begin % TURN + step))
        table = blank(TRACK, len(seen))
        table["track"], table["time"] = seen, stop
        table["status"] = TrackStatus.CONFIRMED
        table["east"], table["north"] = x[seen], y[seen]
        table["v_east"], table["v_north"] = v_east[seen], v_north[seen]
        reports = _returns(CENTROID, rng.poisson(clutter / SECTORS), begin, step, rng)
        plots = _returns(PLOT, rng.poisson(noise / SECTORS) + 8 * len(reports), begin, step, rng)
        yield Sector(RADAR, start, stop, begin, begin + step, begin, (0.0, 0.0, 0.0), plots, reports, table)
        count += 1


def _returns(
    dtype: np.dtype[np.void], count: int, begin: float, step: float, rng: np.random.Generator
) -> Table:
    table = blank(dtype, count)
    table["azimuth"] = np.sort((begin % TURN) + rng.uniform(0.0, step, count))
    table["range"] = 290 * KM * np.sqrt(rng.uniform(0.0, 1.0, count))
    if "amplitude" in (dtype.names or ()):
        table["amplitude"] = 3.2 + rng.exponential(0.5, count)
    return table


def measure(scene: str, seconds: float) -> NDArray[np.float64]:
    """(frames, 2) wall time and processor time of each frame, s."""
    source = sectors(*SCENES[scene], np.random.default_rng(1))
    view, picture = View(), Picture()
    ppi = Ppi(view, picture)
    ppi.resize(1024, 1024)
    ppi.show()
    QApplication.processEvents()
    waiting = next(source)
    now, times = 0.0, []
    while now < WARM_UP + seconds:
        now += FRAME
        began = time.perf_counter(), time.thread_time()
        while waiting.stop <= now:
            picture.take(waiting)
            waiting = next(source)
        ppi.advance(FRAME)
        ppi.viewport().repaint()
        if now > WARM_UP:
            times.append((time.perf_counter() - began[0], time.thread_time() - began[1]))
    ppi.close()
    return np.array(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0, help="of the scene to measure")
    seconds = parser.parse_args().seconds
    app = QApplication([])
    print("scene   frames  ms: median    p99    max | processor: median    p99")
    for scene in SCENES:
        wall, busy = 1e3 * measure(scene, seconds).T
        p50, p99 = np.percentile(wall, [50, 99])
        b50, b99 = np.percentile(busy, [50, 99])
        print(f"{scene:7s} {len(wall):6d} {p50:11.1f} {p99:6.1f} {wall.max():6.1f} | {b50:17.1f} {b99:6.1f}")
    app.quit()


if __name__ == "__main__":
    main()
