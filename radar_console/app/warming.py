"""Compile ahead what is compiled, so that no run waits for it, and the first start says what it does."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

from numba.core import event

from radar_console import tracker
from radar_console.tracker.sweep import sweep

DATA_S = 24.0  # six turns: tracks are confirmed and drawn, so every kernel has run
COMMAND = (sys.executable, "-m", "radar_console", "warm-up", "--count")
_ABOUT = 580  # kernels, when last counted


def warm_up() -> None:
    """Run the start of the demo through the whole chain into a picture; numba keeps what it compiled.

    What the demo does not use of the tracker, adopted tracks and its threads, comes first.
    """
    from radar_console.app import console
    from radar_console.app.opening import open_source

    tracker.warm_up()
    with TemporaryDirectory() as folder:
        console.screenshot(open_source(None), Path(folder) / "picture.png", DATA_S, (800, 600), None)


def is_cold() -> bool:
    """The tracker was never compiled here."""
    cache = Path(str(cast(Any, sweep).stats.cache_path))
    return not any(cache.glob("sweep.sweep-*.nbi"))


def ensure_warm(say: Callable[[str], None]) -> None:
    """On a first start, compile in a process of its own, so that a window stays alive; `say` how far it is.

    Where that fails, everything is compiled when it is first needed: later, but all the same.
    """
    if not is_cold():
        return
    say(_progress(0))
    quiet = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    with subprocess.Popen(
        COMMAND, env=quiet, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if line.strip().isdigit():
                say(_progress(int(line)))
    say("")


def _progress(done: int) -> str:
    return f"First start: compiling the kernels, {done} of about {_ABOUT}. This takes a few minutes, once."


class Counter(event.Listener):
    """Counts the kernels that numba compiles, not those that it finds compiled; `each` hears the count."""

    def __init__(self, each: Callable[[int], None]) -> None:
        self._each = each
        self.done = 0
        event.register("numba:compile", self)  # type: ignore[no-untyped-call]

    def on_start(self, event: Any) -> None:
        """A kernel's compilation begins."""

    def on_end(self, event: Any) -> None:
        """A kernel is compiled."""
        self.done += 1
        self._each(self.done)
