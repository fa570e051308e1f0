"""A grid of settings × seeded runs: each run has the same seed under every setting, so that they pair."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import NamedTuple

from radar_console.evaluation.results import Results, Row
from radar_console.evaluation.workers import Run, Task, Workers, inline


class Progress(NamedTuple):
    """How far the runs are.

    Attributes
    ----------
    done : runs of those that are to do now, failed ones too
    total : that are to do now
    failed : of those done
    elapsed : s
    """

    done: int
    total: int
    failed: int
    elapsed: float


def carry_out(
    run: Run,
    seeds: Sequence[int],
    results: Results,
    workers: Workers = inline,
    watch: Callable[[Progress], None] = lambda _: None,
) -> Progress:
    """Do the runs of these seeds that `results`, which is open, does not hold yet, under all its settings.

    A run that fails is recorded with its error, and the rest goes on. In the end the rows are in order.

    Parameters
    ----------
    run : figures from a setting and a seed; it must be importable by the workers
    workers : see `evaluation.workers`
    watch : told at the start and after each run

    Raises
    ------
    RadarConsoleError   results can't be written, or a cluster is not there; what is done is kept
    """
    tasks = [Task(k, results.settings[k], seed) for k, seed in results.missing(seeds)]
    began = time.monotonic()
    progress = Progress(0, len(tasks), 0, 0.0)
    watch(progress)
    if tasks:
        with closing(workers(run, tasks)) as work:
            for task, outcome in work:
                results.add(Row(task.number, task.seed, outcome.figures, outcome.error))
                progress = Progress(
                    progress.done + 1,
                    len(tasks),
                    progress.failed + bool(outcome.error),
                    time.monotonic() - began,
                )
                watch(progress)
    results.sort()
    return progress
