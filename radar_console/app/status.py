"""A line of text that says how far a run, or many runs are: redrawn on a terminal, now and then elsewhere."""

import math
import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from radar_console.evaluation.monte_carlo import Progress as RunProgress

REDRAW_S = 0.1
LINE_S = 5.0
NOTHING = RunProgress(0, 0, 0, 0.0)


class StatusLine:
    """Progress through `duration` seconds of data, on standard error.

    Use as a context; call it with the data time and what to say.
    """

    def __init__(self, title: str, duration: float) -> None:
        self._title, self._duration = title, duration
        self._console = Console(file=sys.stderr)
        self._first: float | None = None
        self._began = self._shown = 0.0
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[text]}"),
            TimeRemainingColumn(),
            console=self._console,
            auto_refresh=False,
            disable=not self._console.is_terminal,
        )

    def __enter__(self) -> "StatusLine":
        self._began = self._shown = time.monotonic()
        total = self._duration if math.isfinite(self._duration) else None
        self._task = self._progress.add_task(self._title, total=total, text="")
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None and math.isfinite(self._duration):
            self._progress.update(self._task, completed=self._duration)
        self._progress.refresh()
        self._progress.stop()

    def __call__(self, data_time: float, text: str) -> None:
        """Say it, unless it was said a moment ago."""
        if self._first is None:
            self._first = data_time
        now = time.monotonic()
        on_terminal = self._console.is_terminal
        if now - self._shown < (REDRAW_S if on_terminal else LINE_S):
            return
        self._shown = now
        done = data_time - self._first
        text = f"{clock(data_time)}  ×{done / max(now - self._began, 1e-9):.0f}  {text}"
        if on_terminal:
            self._progress.update(self._task, completed=done, text=text)
            self._progress.refresh()
        else:
            self._console.print(f"{self._title}: {text}", highlight=False)


class RunLine:
    """Progress of many runs with the time that is left, on standard error; use as a context."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._console = Console(file=sys.stderr)
        self._shown = -math.inf
        self._first: RunProgress | None = None
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[text]}"),
            console=self._console,
            auto_refresh=False,
            disable=not self._console.is_terminal,
        )

    def __enter__(self) -> "RunLine":
        self._task = self._progress.add_task(self._title, total=None, text="")
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def __call__(self, progress: RunProgress) -> None:
        """Say it: on a terminal each time, elsewhere unless it was said a moment ago."""
        done, total, failed, elapsed = progress
        if not total:
            return
        if done and self._first is None:
            self._first = progress
        # The start of the workers is no part of the rate.
        start = self._first if self._first is not None and done > self._first.done else NOTHING
        rate = (done - start.done) / max(elapsed - start.elapsed, 1e-9)
        left = f"{clock((total - done) / rate)} left" if rate else "starting"
        text = f"{60.0 * rate:.3g} a minute, {left}" + (f", {failed} failed" if failed else "")
        if self._console.is_terminal:
            self._progress.update(self._task, completed=done, total=total, text=text)
            self._progress.refresh()
            return
        now = time.monotonic()
        if now - self._shown >= LINE_S or done == total:
            self._shown = now
            self._console.print(f"{self._title}: {done:,} of {total:,} runs, {text}", highlight=False)


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss."""
    whole = int(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
