"""Runs on a real Dask cluster on this machine: the same numbers, and a worker that is killed is survived."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from runs_to_do import METRICS, slow
from small_scenarios import small_raw

from radar_console.core.errors import RadarConsoleError
from radar_console.evaluation.monte_carlo import carry_out
from radar_console.evaluation.results import Results
from radar_console.evaluation.scenario_run import RUN_METRICS, ScenarioRun
from radar_console.evaluation.workers import dask, inline

distributed = pytest.importorskip("distributed")
HERE = Path(__file__).parent
PATIENCE = 60.0  # s; a busy machine starts its processes slowly


class Cluster:
    """A scheduler and workers of one thread; each a process that is ended at the latest with the test."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []
        file = folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--port", "0", "--scheduler-file", str(file))
        self.address = json.loads(waited_for(lambda: file.exists() and file.read_text()))["address"]

    def workers(self, count):
        """So many, all of them ready."""
        arguments = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder))
        started = [self.start("worker", self.address, *arguments) for _ in range(count)]
        with distributed.Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=PATIENCE)
        return started

    def start(self, *arguments):
        path = os.pathsep.join([str(HERE), str(HERE.parents[1])])
        with (self.folder / "dask.log").open("a") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments, "--host", "127.0.0.1", "--no-dashboard"],
                cwd=self.folder, stdout=log, stderr=log, env=os.environ | {"PYTHONPATH": path},
            )  # fmt: skip
        self.processes.append(process)
        return process

    def close(self):
        for process in self.processes:
            process.kill()
            process.wait()


def waited_for(condition):
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        if found := condition():
            return found
        time.sleep(0.05)
    raise TimeoutError


@pytest.fixture
def cluster(tmp_path):
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.close()


def test_a_worker_is_killed_midway_and_the_numbers_are_those_of_this_process(cluster, tmp_path):
    workers = cluster.workers(2)
    settings = [{"folder": str(tmp_path)}]
    killed = []

    def kill_one(progress):
        at_work = [process for process in workers if (tmp_path / f"{process.pid}.working").exists()]
        if not killed and progress.done >= 4 and len(at_work) == 2:
            at_work[0].send_signal(signal.SIGKILL)
            killed.append(progress.done)

    with Results(tmp_path / "far", {}, settings, METRICS) as results:
        progress = carry_out(slow, range(24), results, dask(cluster.address), kill_one)
    assert killed
    assert sum(process.poll() is None for process in workers) == 1
    assert (progress.done, progress.failed) == (24, 0)
    with Results(tmp_path / "near", {}, settings, METRICS) as results:
        carry_out(slow, range(24), results, inline)
    assert (tmp_path / "far" / "results.csv").read_bytes() == (tmp_path / "near" / "results.csv").read_bytes()


def test_a_scenario_on_a_cluster(cluster, tmp_path):
    cluster.workers(1)
    run = ScenarioRun(small_raw(tmp_path), tmp_path / "small.toml")
    metrics = [metric.name for metric in RUN_METRICS]
    rows = []
    for name, workers in (("far", dask(cluster.address)), ("near", inline)):
        with Results(tmp_path / name, {}, [{}], metrics) as results:
            carry_out(run, [5, 6], results, workers)
            # Times are no result of the seed; all else is.
            rows.append([{**row.figures, "tracker_ms_per_turn": 0.0} for row in results.rows])
    assert rows[0] == rows[1]


def test_a_cluster_without_workers(cluster, monkeypatch):
    monkeypatch.setattr("radar_console.evaluation.workers.ANSWER_S", 0.5)
    with pytest.raises(RadarConsoleError, match="the scheduler has no workers"):
        next(dask(cluster.address)(slow, []))


@pytest.mark.parametrize("address", [None, "nonsense", "tcp://"])
def test_no_scheduler(address, monkeypatch):
    monkeypatch.setattr("radar_console.evaluation.workers.ANSWER_S", 0.5)
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = address or f"tcp://127.0.0.1:{unused.getsockname()[1]}"
        with pytest.raises(RadarConsoleError, match=f"--dask {address}: no scheduler answers there"):
            next(dask(address)(slow, []))
