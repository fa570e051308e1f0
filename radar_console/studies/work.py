"""The work of a study: parts that any number of workers share, each kept as it is finished.

A part is a function of this package and its arguments, and gives named arrays. It is kept in the study's
folder under a digest of function, arguments and source: after a kill the same command goes on where it was,
and after a change of the code that it uses a part is done anew. What a part draws depends on its arguments
only, so one worker finds what ten do.
"""

import hashlib
import os
import reprlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from radar_console.core.errors import RadarConsoleError
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.workers import Task, inline, processes

Arrays = dict[str, Array]
_PACKAGE = __name__.partition(".")[0]
LINE_S = 10.0  # between lines of progress where there is no terminal


class Part(NamedTuple):
    """`function(*arguments)`, which another process can be told; `weight` is its share of the time."""

    function: Callable[..., Arrays]
    arguments: tuple[Any, ...]
    weight: float = 1.0


def generator(*words: int) -> Generator:
    """A generator that the seed and what is drawn decide: `generator(seed, case, run)`."""
    return default_rng(SeedSequence(words))


def chunks(runs: int, size: int) -> list[range]:
    """The runs 0 … `runs` in pieces of `size`, the last one shorter; they do not depend on the workers."""
    return [range(first, min(first + size, runs)) for first in range(0, runs, size)]


@dataclass
class Work:
    """What a study gets.

    Attributes
    ----------
    folder : for its figures; finished parts are in `parts/` below it
    runs, seed : as asked for
    jobs : processes that share the parts
    figures : names of the files that the study has drawn, in order
    """

    folder: Path
    runs: int
    seed: int
    jobs: int = 1
    figures: list[str] = field(default_factory=list)

    def do(self, title: str, parts: Sequence[Part]) -> list[Arrays]:
        """The results of all parts, in their order; what is kept is not done again."""
        files = [self.folder / "parts" / f"{_digest(part)}.npz" for part in parts]
        missing = {k: part for k, part in enumerate(parts) if not files[k].exists()}
        if missing:
            files[0].parent.mkdir(parents=True, exist_ok=True)
            with _Bar(title, sum(part.weight for part in parts)) as bar:
                bar.advance(sum(part.weight for k, part in enumerate(parts) if k not in missing))
                for k, arrays in self._results(missing):
                    _keep(files[k], arrays)
                    bar.advance(parts[k].weight)
        return [_kept(file) for file in files]

    def _results(self, parts: Mapping[int, Part]) -> Iterator[tuple[int, Arrays]]:
        """Number and result of each part, as they are finished; those that fail do not end the others."""
        # The longest first: none is left alone at the end.
        order = sorted(parts, key=lambda k: -parts[k].weight)
        tasks = [Task(k, {"part": parts[k]}, 0) for k in order]
        alone = self.jobs == 1 or len(parts) == 1
        failed = []
        for task, outcome in (inline if alone else processes(self.jobs))(_make, tasks):
            if outcome.error:
                failed.append(f"{_name(parts[task.number])}: {outcome.error}")
            else:
                yield task.number, cast(Arrays, outcome.figures)
        if failed:
            what = f"{len(failed)} of {len(tasks)} parts failed; the others are kept"
            raise RadarConsoleError("\n  ".join([what, *failed]))


def _make(task: Mapping[str, Any], _: int) -> Any:
    part: Part = task["part"]
    return part.function(*part.arguments)


def _name(part: Part) -> str:
    return f"{part.function.__name__}{reprlib.repr(part.arguments)}"  # a scenario is long


def _digest(part: Part) -> str:
    name = f"{part.function.__module__}.{part.function.__qualname__}"
    source = _source(part.function.__module__)
    return hashlib.sha256(repr((source, name, part.arguments)).encode()).hexdigest()[:24]


@lru_cache
def _source(module: str) -> str:
    """A digest of the code of a module and of what it uses of this package, directly or not."""
    used = {__name__}  # how work is shared out changes no result
    _collect(module, used)
    used.remove(__name__)
    every = hashlib.sha256()
    for name in sorted(used):
        every.update(Path(str(sys.modules[name].__file__)).read_bytes())
    return every.hexdigest()


def _collect(module: str, used: set[str]) -> None:
    used.add(module)
    for value in vars(sys.modules[module]).values():
        name = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
        if isinstance(name, str) and name.startswith(_PACKAGE) and name not in used:
            _collect(name, used)


def _keep(file: Path, arrays: Arrays) -> None:
    """Whole or not at all: a kill in the middle leaves nothing that looks finished."""
    unfinished = file.with_name(f"{file.stem}.{os.getpid()}.unfinished")
    with unfinished.open("wb") as out:
        np.savez(out, **arrays)  # type: ignore[arg-type]
    unfinished.replace(file)


def _kept(file: Path) -> Arrays:
    with np.load(file) as arrays:
        return {name: arrays[name] for name in arrays.files}


class _Bar:
    """Progress with the time left on a terminal, now and then a line elsewhere; on standard error."""

    def __init__(self, title: str, total: float) -> None:
        console = Console(file=sys.stderr)
        self._title, self._total, self._done = title, total, 0.0
        self._began = self._said = time.monotonic()
        self._quiet = not console.is_terminal
        self._kept: float | None = None
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self._progress = Progress(*columns, console=console, disable=self._quiet)
        self._task = self._progress.add_task(title, total=round(total))

    def __enter__(self) -> "_Bar":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def advance(self, weight: float) -> None:
        """So much more of the work is done; the first call says what was kept from before."""
        self._done += weight
        if self._kept is None:
            self._kept = self._done
        self._progress.update(self._task, completed=round(self._done))
        now = time.monotonic()
        if self._quiet and now - self._said >= LINE_S and self._done > self._kept:
            self._said = now
            left = (now - self._began) * (self._total - self._done) / (self._done - self._kept)
            share = self._done / self._total
            print(f"{self._title}: {share:.0%}, about {left:.0f} s left", file=sys.stderr, flush=True)
