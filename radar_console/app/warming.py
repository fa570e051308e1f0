"""Compile ahead what is compiled, so that no run waits for it."""

from pathlib import Path
from tempfile import TemporaryDirectory

from radar_console import tracker
from radar_console.app import console
from radar_console.app.opening import open_source

DATA_S = 24.0  # six turns: tracks are confirmed and drawn, so every kernel has run


def warm_up() -> None:
    """Run the start of the demo through the whole chain into a picture; numba keeps what it compiled.

    What the demo does not use of the tracker, adopted tracks and its threads, comes first.
    """
    tracker.warm_up()
    with TemporaryDirectory() as folder:
        console.screenshot(open_source(None), Path(folder) / "picture.png", DATA_S, (800, 600), None)
