"""How long a frame of the console takes, off-screen, on whole scenarios.

    python benchmarks/frames.py
    python benchmarks/frames.py stress --seconds 20

The chain runs first; then its sectors are shown at 60 frames a second of data time. A frame is: take
the sectors that came, light, develop, paint. A third of a minute is left out at first, until trails
and phosphor are full. `scope` is the scope alone, 1024 × 1024; `console` the whole window
about it, 1680 × 1024.
Processor time is what a frame takes when the machine has nothing else to do.
"""

import argparse
import os
import time
from collections.abc import Callable

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QApplication

from radar_console.app.console import Health, options_of
from radar_console.app.opening import open_source
from radar_console.chain import Chain
from radar_console.core.messages import Sector
from radar_console.display.feed import Feed
from radar_console.display.picture import Picture
from radar_console.display.ppi import Ppi
from radar_console.display.view import View
from radar_console.display.window import ConsoleWindow
from radar_console.pipeline import Pace

SCENES = ("twenty-five", "stress")
SIZE = 1024
WINDOW = (1680, SIZE)
FRAME = 1.0 / 60.0
WARM_UP = 20.0

Show = Callable[[list[Sector]], None]


def record(scene: str, seconds: float) -> tuple[Chain, list[Sector]]:
    """The start of a scenario, tracked, and the chain that did it."""
    chain, sectors = Chain(open_source(scene)), []
    for sector in chain.run():
        sectors.append(sector)
        if sector.stop > seconds:
            break
    return chain, sectors


def scope() -> Show:
    """The scope alone."""
    picture = Picture()
    ppi = Ppi(View(), picture)
    ppi.resize(SIZE, SIZE)
    ppi.show()

    def show(sectors: list[Sector]) -> None:
        for sector in sectors:
            picture.take(sector)
        ppi.advance(FRAME)
        ppi.viewport().repaint()

    return show


def console(chain: Chain) -> Show:
    """The whole window, as its timers drive it."""
    feed, opened = Feed(), chain.opened
    window = ConsoleWindow(opened.source.radar, feed, Pace(), Health(chain), options_of(opened, None))
    window.resize(*WINDOW)
    window.show()
    frames = 0

    def show(sectors: list[Sector]) -> None:
        nonlocal frames
        frames += 1
        for sector in sectors:
            feed.put(sector)
        window.tick()
        if frames % 20 == 0:
            window.refresh()
        QApplication.processEvents()  # paints what has changed, as the event loop does

    return show


def measure(show: Show, sectors: list[Sector], seconds: float) -> NDArray[np.float64]:
    """(frames, 2) wall time and processor time of each frame, s."""
    now, shown, times = 0.0, 0, []
    while now < WARM_UP + seconds:
        now += FRAME
        first = shown
        while shown < len(sectors) and sectors[shown].stop <= now:
            shown += 1
        began = time.perf_counter(), time.thread_time()
        show(sectors[first:shown])
        if now > WARM_UP:
            times.append((time.perf_counter() - began[0], time.thread_time() - began[1]))
    return np.array(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="scenarios (default: twenty-five, stress)")
    parser.add_argument("--seconds", type=float, default=10.0, help="of data to measure")
    arguments = parser.parse_args()
    app = QApplication([])
    print("scene         view     frames  ms: median    p99    max | processor: median    p99")
    for scene in arguments.scenes:
        chain, sectors = record(scene, WARM_UP + arguments.seconds + 1.0)
        for name, show in (("scope", scope()), ("console", console(chain))):
            QApplication.processEvents()
            wall, busy = 1e3 * measure(show, sectors, arguments.seconds).T
            p50, p99 = np.percentile(wall, [50, 99])
            b50, b99 = np.percentile(busy, [50, 99])
            print(
                f"{scene:13s} {name:8s} {len(wall):6d} {p50:11.1f} {p99:6.1f} {wall.max():6.1f} "
                f"| {b50:17.1f} {b99:6.1f}"
            )
    app.quit()


if __name__ == "__main__":
    main()
