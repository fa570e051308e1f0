"""The console on a source: live in a window, or off-screen into a picture."""

import logging
import math
import os
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path

from radar_console.app.headless import brief, check_writable
from radar_console.app.status import StatusLine
from radar_console.chain import Chain, Opened
from radar_console.core.errors import RadarConsoleError
from radar_console.core.messages import Sector
from radar_console.core.units import KM
from radar_console.display.feed import Feed
from radar_console.display.options import Options
from radar_console.pipeline import Pace, Policy

log = logging.getLogger(__name__)


class Health:
    """How a chain fares, for the console's status bar."""

    def __init__(self, chain: Chain) -> None:
        self._chain = chain

    @property
    def depth(self) -> int:
        """Sectors that wait in the queues."""
        return self._chain.gauge.depth

    @property
    def sectors_dropped(self) -> int:
        """Sectors that the queues lost."""
        return self._chain.gauge.sectors_dropped

    @property
    def returns_dropped(self) -> int:
        """Their plots and centroids."""
        return self._chain.gauge.returns_dropped

    @property
    def skipped(self) -> Mapping[str, int]:
        """What source and stages could not use, by reason."""
        return self._chain.skipped


def display_missing() -> bool:
    """Whether Qt would find no screen to open a window on."""
    needs_server = sys.platform.startswith(("linux", "freebsd"))
    chosen = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return needs_server and not any(os.environ.get(name) for name in chosen)


def options_of(opened: Opened, user_map: Path | None) -> Options:
    """How the console starts on this source."""
    display, radar = opened.settings.display, opened.source.radar
    tracker = opened.settings.tracker
    particles = f" {tracker.particles}" if tracker.filter == "particle" else ""
    subtitle = f"{opened.kind} · seed {opened.seed}" if opened.kind == "simulation" else opened.kind
    return Options(
        title=opened.title,
        subtitle=f"{subtitle} · {radar.name} · north up",
        tracker_name=f"{tracker.filter}{particles} · {tracker.associator.upper()}",
        range_m=display.range_km * KM if display.range_km else radar.max_range,
        afterglow_s=radar.rotation if display.afterglow_s is None else display.afterglow_s,
        trail_s=display.trail_s,
        vector_s=display.vector_s,
        speed_unit=display.speed_unit,
        range_unit=display.range_unit,
        epoch=getattr(opened.source, "epoch", None),
        user_map=user_map,
    )


def run(opened: Opened, speed: float, user_map: Path | None) -> int:
    """Open the window and stay until it is closed; the exit code."""
    from radar_console.app.warming import ensure_warm
    from radar_console.display import console

    chain, feed, pace = Chain(opened), Feed(), Pace(speed)
    closed = threading.Event()

    def pump() -> None:
        try:
            ensure_warm(feed.say)
            chain.prime()
            with closing(chain.run(threads=True, pace=pace, policy=Policy.DROP)) as sectors:
                for sector in sectors:
                    feed.put(sector)
                    if opened.truth is not None:
                        feed.put_truth(opened.truth(sector.stop))
                    if closed.is_set():
                        return
            feed.finish()
        except RadarConsoleError as error:
            feed.fail(str(error))
        except Exception as error:
            log.exception("the chain stopped")
            feed.fail(f"stopped by a defect: {error!r}")

    thread = threading.Thread(target=pump, name="pump", daemon=True)
    thread.start()
    code = console.run(opened.source.radar, feed, pace, Health(chain), options_of(opened, user_map))
    closed.set()
    pace.paused, pace.rate = False, math.inf  # a thread that waits for the clock goes on at once
    thread.join(2.0)
    return code


def screenshot(
    opened: Opened,
    file: Path,
    after: float | None,
    size: tuple[int, int],
    user_map: Path | None,
    speed: float = 1.0,
) -> None:
    """Run `after` seconds of data, or all, as fast as they come, and write a picture of the console.

    `speed` is what the status bar says of the playback; nothing waits for a clock here.
    """
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from radar_console.display import console

    check_writable(file)
    chain = Chain(opened)
    with StatusLine(opened.title, _shown(opened, after)) as status:

        def sectors() -> Iterator[Sector]:
            for sector in chain.run():
                yield sector
                status(sector.stop, brief(chain.tally))

        console.screenshot(
            opened.source.radar,
            sectors(),
            opened.truth,
            options_of(opened, user_map),
            file,
            after,
            size,
            rate=speed,
            health=Health(chain),
        )


def _shown(opened: Opened, after: float | None) -> float:
    return opened.source.duration if after is None else min(after, opened.source.duration)
