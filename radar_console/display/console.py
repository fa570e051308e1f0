"""The way in for the commands: the live window, and the picture that is rendered off-screen.

Qt is imported when one of them is called, not before.
"""

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from radar_console.core.errors import InputError
from radar_console.core.messages import Radar, Sector, Table
from radar_console.display.feed import Controls, Feed, Health
from radar_console.display.options import Options

if TYPE_CHECKING:
    from radar_console.display.window import ConsoleWindow

__all__ = ["Options", "render", "run", "screenshot"]

SIZE = (1680, 1000)


@dataclass
class _Still:
    """Controls and health of a playback that no one touches."""

    rate: float = 1.0
    paused: bool = False
    depth: int = 0
    sectors_dropped: int = 0
    returns_dropped: int = 0
    skipped: Mapping[str, int] = field(default_factory=dict)


def run(radar: Radar, feed: Feed, controls: Controls, health: Health, options: Options) -> int:
    """Show the console until it is closed; the exit code.

    Raises
    ------
    InputError   the user's map can't be used
    """
    from PySide6.QtWidgets import QApplication

    from radar_console.display.window import ConsoleWindow, load_map, settings_file

    if options.user_map is not None:
        load_map(radar, options)  # an error of the user's is said before a window opens
    application = QApplication.instance() or QApplication(["radar-console"])
    window = ConsoleWindow(radar, feed, controls, health, options, settings_file())
    # The frame timer gives the interpreter a chance to run this, so that Ctrl+C works.
    before = signal.signal(signal.SIGINT, lambda *_: window.close())
    try:
        window.show()
        window.start()
        return int(application.exec())
    finally:
        signal.signal(signal.SIGINT, before)


def screenshot(
    radar: Radar,
    sectors: Iterable[Sector],
    truth: Callable[[float], Table] | None,
    options: Options,
    file: Path,
    after_s: float | None = None,
    size: tuple[int, int] = SIZE,
    progress: Callable[[float], None] | None = None,
    rate: float = 1.0,
    health: Health | None = None,
) -> None:
    """Render the console as it is `after_s` seconds into the data (None: at its end) to a PNG file.

    Parameters
    ----------
    truth : where the targets are at a time, s
    size : of the picture, px
    progress : called with the data time of every sector, s
    rate : of the playback, for the status bar
    health : of the chain that delivers the sectors

    Raises
    ------
    InputError   the file can't be written, or the user's map can't be used
    """
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtWidgets import QApplication

    from radar_console.display.window import ConsoleWindow

    application = QApplication.instance() or QApplication(["radar-console"])
    still = _Still(rate)
    window = ConsoleWindow(radar, Feed(), still, health or still, options)
    render(window, sectors, truth, after_s, size, progress)
    image = window.grab().toImage()
    window.deleteLater()
    application.processEvents()
    if not image.save(str(file), "PNG"):  # type: ignore[call-overload]
        raise InputError(file, "", "can't be written; expected a folder that exists and is open to you")


def render(
    window: "ConsoleWindow",
    sectors: Iterable[Sector],
    truth: Callable[[float], Table] | None = None,
    after_s: float | None = None,
    size: tuple[int, int] = SIZE,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Let a window take sectors one by one, its afterglow ageing by data time, until `after_s`."""
    from radar_console.display.window import load_map

    window.resize(*size)
    window.splitter.setSizes([size[0] - panel_width(size[0]), panel_width(size[0])])
    window.scope.set_map(load_map(window.radar, window.options))
    # Only what still glows at the end needs to be painted on the way; the rest is just taken in.
    lead = max(8.0 * window.view.afterglow_s, 1.25 * window.radar.rotation)
    waiting: deque[Sector] = deque()
    first: float | None = None
    last = 0.0
    for sector in sectors:
        first = sector.start if first is None else first
        last = sector.stop
        waiting.append(sector)
        while waiting[0].stop < last - lead:
            early = waiting.popleft()
            window.take(early)
            window.picture.advance(early.stop - early.start)
        if progress is not None:
            progress(last)
        if after_s is not None and last - first >= after_s:
            break
    for sector in waiting:
        window.take(sector)
        window.scope.advance(sector.stop - sector.start)
    window.arrived = time.monotonic()
    if truth is not None and first is not None:
        window.picture.take_truth(truth(last))
    _select_first(window)
    window.still()


def panel_width(width: int) -> int:
    """Of the side panel in a window of this width, px."""
    return min(max(round(0.36 * width), 520), 620)


def _select_first(window: "ConsoleWindow") -> None:
    """Show the details of the longest confirmed track, so that the picture explains itself."""
    confirmed = window.picture.tracks[window.picture.numbers > 0]
    if len(confirmed):
        window.view.selected = int(confirmed["track"][confirmed["born"].argmin()])
