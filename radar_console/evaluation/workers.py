"""Who carries out runs: this process, processes of this machine, or a Dask cluster.

All three take a function of (setting, seed) and tasks, and yield each task with its outcome as it is
done, in any order. The function must be importable where it is called. What it returns depends on
setting and seed alone, so the numbers are the same whoever does the work. A run that fails does not
end the others. A worker that dies is replaced and its run done again, up to `TRIES` times.
"""

import logging
import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any, NamedTuple

from radar_console.core.errors import RadarConsoleError

TRIES = 3
ANSWER_S = 10.0  # how long a scheduler has to answer, and its first worker to be there

Run = Callable[[Mapping[str, Any], int], Mapping[str, float]]
"""Figures of a run under a setting with a seed."""


class Task(NamedTuple):
    """A run to do: the setting and its number, and the seed."""

    number: int
    setting: Mapping[str, Any]
    seed: int


class Outcome(NamedTuple):
    """What came of it: the figures, or why there are none."""

    figures: Mapping[str, float]
    error: str = ""


Work = Generator[tuple[Task, Outcome]]
Workers = Callable[[Run, Sequence[Task]], Work]


def attempt(run: Run, setting: Mapping[str, Any], seed: int) -> Outcome:
    """A run, and in place of its figures what went wrong, and where."""
    try:
        return Outcome(dict(run(setting, seed)))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return Outcome({}, f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})")


def inline(run: Run, tasks: Iterable[Task]) -> Work:
    """One after the other, here."""
    for task in tasks:
        yield task, attempt(run, task.setting, task.seed)


def processes(count: int) -> Workers:
    """So many processes of this machine, each with one run at a time."""

    def work(run: Run, tasks: Sequence[Task]) -> Work:
        waiting = [(task, 1) for task in reversed(tasks)]
        idle = [_process() for _ in range(min(count, len(tasks)))]
        busy: dict[Future[Outcome], tuple[ProcessPoolExecutor, Task, int]] = {}
        try:
            while waiting or busy:
                while waiting and idle:
                    task, tries = waiting.pop()
                    process = idle.pop()
                    busy[process.submit(attempt, run, task.setting, task.seed)] = process, task, tries
                for done in wait(busy, return_when=FIRST_COMPLETED).done:
                    process, task, tries = busy.pop(done)
                    try:
                        outcome = done.result()
                    except BrokenProcessPool:
                        process.shutdown(wait=False)
                        idle.append(_process())
                        if tries < TRIES:
                            waiting.append((task, tries + 1))
                            continue
                        outcome = Outcome({}, f"the process that ran it died, {TRIES} times")
                    else:
                        idle.append(process)
                    yield task, outcome
        finally:
            for process in [*idle, *(process for process, _, _ in busy.values())]:
                _end(process)

    return work


def _process() -> ProcessPoolExecutor:
    """A pool of one, so that it is known whose run killed it. Threads forbid a fork."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_prepare)


def _prepare() -> None:
    """In a new process: Ctrl+C is the parent's to handle, and nobody outlives the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _end(process: ProcessPoolExecutor) -> None:
    """Stop it now, also in the middle of a run."""
    children = list((getattr(process, "_processes", None) or {}).values())
    process.shutdown(wait=False, cancel_futures=True)
    for child in children:
        with suppress(OSError):
            child.terminate()


def dask(address: str) -> Workers:
    """The workers of a Dask cluster; `address` is its scheduler's, such as ``tcp://10.0.0.7:8786``.

    They need this package in the same version. Dask itself does the run of a dead worker again, on
    another one, until as many have died over it as its setting `allowed-failures` says.
    """

    def work(run: Run, tasks: Sequence[Task]) -> Work:
        try:
            import distributed
        except ImportError:
            raise RadarConsoleError(
                "--dask: needs the package distributed; in the project's folder: pip install '.[cluster]'"
            ) from None
        for name in ("distributed", "distributed.client", "distributed.utils", "distributed.core"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what the user must know is said below
        try:
            client = distributed.Client(address, timeout=ANSWER_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise RadarConsoleError(
                f"--dask {address}: no scheduler answers there ({error}); `dask scheduler` starts one"
            ) from None
        with client:
            _greet(client, address)
            futures = {
                client.submit(attempt, run, task.setting, task.seed, pure=False, retries=0): task
                for task in tasks
            }
            done = distributed.as_completed(futures, loop=client.loop, with_results=True, raise_errors=False)
            try:
                for future, result in done:
                    task = futures.pop(future)
                    yield task, _outcome(result, future.status, address)
                    future.release()
            finally:
                with suppress(Exception):
                    client.cancel(list(futures))

    return work


def _outcome(result: Any, status: str, address: str) -> Outcome:
    if isinstance(result, Outcome):
        return result
    if status in ("cancelled", "lost"):
        raise RadarConsoleError(f"--dask {address}: the scheduler went away; the same command goes on later")
    error = result[1] if isinstance(result, tuple) else result
    return Outcome({}, f"{type(error).__name__}: {error}")


def _greet(client: Any, address: str) -> None:
    """See that there are workers, and that they can do the work."""
    try:
        client.wait_for_workers(1, timeout=ANSWER_S)
    except TimeoutError:
        raise RadarConsoleError(
            f"--dask {address}: the scheduler has no workers; `dask worker {address}` starts one"
        ) from None
    try:
        versions = client.run(_version)
    except Exception as error:
        raise RadarConsoleError(
            f"--dask {address}: a worker does not have this package ({error}); expected it on every one"
        ) from None
    own = _version()
    other = {name: version for name, version in versions.items() if version != own}
    if other:
        name, version = next(iter(other.items()))
        raise RadarConsoleError(
            f"--dask {address}: worker {name} has version {version}; expected {own}, as here, on every one"
        )


def _version() -> str:
    from importlib.metadata import version

    return version("radar-console")
