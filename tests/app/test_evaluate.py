"""`radar-console evaluate`: from a scenario to figures, interrupted, resumed, and asked for what can't be."""

import csv
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from radar_console.evaluation import scenario_run
from radar_console.evaluation.scoring import METRICS

Command = Callable[..., int]
ROOT = Path(__file__).parents[2]
QUICK = ("--jobs", 1, "--set", "radar.returns=centroids", "--set", "tracker.filter=kalman,extended")


@pytest.fixture
def no_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only one test reads it; drawing it takes longer than the runs."""
    monkeypatch.setattr("radar_console.app.evaluating.Evaluation._report", lambda *_: None)


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def timeless(folder: Path) -> list[dict[str, str]]:
    """All but times, which no seed fixes."""
    return [{**row, "tracker_ms_per_turn": ""} for row in rows_of(folder)]


def test_from_a_scenario_to_a_report(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = small.parent / "out"
    assert command("evaluate", small, "--runs", 3, *QUICK, "-o", folder) == 0
    said = capsys.readouterr()
    assert "6 runs" in said.err
    assert "(2) radar.returns=centroids, tracker.filter=extended" in said.out
    assert re.search(r"GOSPA, m +[\d,.]+ \[", said.out)
    rows = rows_of(folder)
    assert [(row["seed"], row["tracker.filter"]) for row in rows] == [
        (seed, name) for name in ("kalman", "extended") for seed in "345"
    ]
    assert {metric.name for metric in METRICS} < rows[0].keys()
    page = (folder / "report.html").read_text(encoding="utf-8")
    # Self-contained: nothing is fetched, nothing runs. The addresses left are names of XML spaces.
    assert not re.findall(r'(?:src|href)="(?!#)', page.replace('xlink:href="#', ""))
    assert "<script" not in page
    assert page.count("<svg") == 2
    for part in ("Differences to <code>radar.returns=centroids, tracker.filter=kalman</code>", "Wilson"):
        assert part in page


@pytest.mark.usefixtures("no_report")
def test_more_runs_and_runs_again(command: Command, small: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("evaluate", small, "--runs", 2, *QUICK, "-o", "out") == 0
    rows = rows_of(small.parent / "out")
    assert command("evaluate", small, "--runs", 3, *QUICK, "-o", "out") == 0
    assert "2 runs" in capsys.readouterr().err
    assert [row for row in rows_of(small.parent / "out") if row["seed"] != "5"] == rows
    assert command("evaluate", small, *QUICK, "-o", "out", "--rerun", "4,6") == 0
    assert "4 runs" in capsys.readouterr().err
    assert len(rows_of(small.parent / "out")) == 8


@pytest.mark.usefixtures("no_report")
def test_killed_and_gone_on_with(command: Command, small: Path) -> None:
    """Two processes at work are killed with their parent; the same command does the other runs, once."""
    arguments = ["evaluate", small, "--runs", 5, *QUICK]
    command_line = [
        sys.executable,
        "-m",
        "radar_console",
        *map(str, arguments),
        "--jobs",
        "2",
        "-o",
        "killed",
    ]
    killed = subprocess.Popen(
        command_line,
        cwd=small.parent,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    file = small.parent / "killed" / "results.csv"
    until = time.monotonic() + 60.0
    while not file.exists() or file.read_bytes().count(b"\n") < 4:
        assert killed.poll() is None
        assert time.monotonic() < until
        time.sleep(0.01)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    before = timeless(file.parent)
    assert 3 <= len(before) < 10
    assert command(*arguments, "-o", "killed") == 0
    assert command(*arguments, "-o", "whole") == 0
    assert timeless(small.parent / "killed") == timeless(small.parent / "whole")
    assert len(rows_of(file.parent)) == 10
    assert all(row in timeless(file.parent) for row in before)


def test_a_run_that_fails_does_not_end_the_others(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = scenario_run.ScenarioRun.opened

    def unlucky(run, setting, seed):  # type: ignore[no-untyped-def]
        if seed == 137:
            raise ZeroDivisionError("something <odd>")
        return opened(run, setting, seed)

    monkeypatch.setattr(scenario_run.ScenarioRun, "opened", unlucky)
    arguments = ("evaluate", small, "--seed", 136, "--runs", 3, *QUICK, "-o", "out")
    assert command(*arguments) == 1
    said = capsys.readouterr().err
    assert "2 of 6 runs failed" in said
    assert "seed 137" in said
    assert "something <odd>" in said
    assert "--rerun 137" in said
    page = (small.parent / "out" / "report.html").read_text(encoding="utf-8")
    assert "ZeroDivisionError: something &lt;odd&gt;" in page
    monkeypatch.setattr(scenario_run.ScenarioRun, "opened", opened)
    assert command(*arguments, "--rerun", 137) == 0
    assert not any(row["error"] for row in rows_of(small.parent / "out"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--set", "tracker.fliter=kalman"], "tracker.fliter: unknown key, did you mean filter?"),
        (["--set", "tracker.filter=kalmann"], "tracker.filter: input should be 'particle', 'kalman'"),
        (["--set", "tracker.filter"], "expected KEY=VALUE"),
        (["--set", "radar.max_range_km=70"], "target[2]"),
        (["--rerun", "one"], "--rerun one: expected seeds"),
        (["--dask", "tcp://127.0.0.1:9"], "--dask tcp://127.0.0.1:9: no scheduler answers there"),
        (["-o", "small.toml"], "can't be made"),
        (["--tracks", "t.csv"], "expected a SCENARIO, or --tracks and --truth"),
    ],
)
def test_what_the_user_can_mend(
    command: Command,
    small: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    said: str,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("radar_console.evaluation.workers.ANSWER_S", 0.5)
    assert command("evaluate", small, "--jobs", 1, *arguments) == 2
    assert said in capsys.readouterr().err
    left = {file.name for file in small.parent.iterdir()} - {"small-evaluation"}
    assert left == {"small.toml"}
    assert not (small.parent / "small-evaluation" / "report.html").exists()


@pytest.mark.usefixtures("no_report")
def test_another_scenario_does_not_go_into_the_same_folder(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("evaluate", small, "--runs", 1, *QUICK) == 0
    text = small.read_text(encoding="utf-8")
    small.write_text(text.replace("Three", "The three"), encoding="utf-8")
    assert command("evaluate", small, "--runs", 1, *QUICK) == 0  # a title changes no run
    small.write_text(text.replace("speed_kmh = 500", "speed_kmh = 501"), encoding="utf-8")
    capsys.readouterr()
    assert command("evaluate", small, "--runs", 1, *QUICK) == 2
    assert "scenario.target[1].speed_kmh was 500, is 501" in capsys.readouterr().err


@pytest.mark.usefixtures("no_report")
def test_anyone_s_tracks(command: Command, small: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The files of a run score as the run does, but for the rounding of centimetres and milliseconds."""
    assert command("evaluate", small, "--runs", 1, "--jobs", 1) == 0
    (run,) = rows_of(small.parent / "small-evaluation")
    assert command("track", small, "-o", "t.csv") == 0
    assert command("simulate", small, "-o", "p.csv", "--truth", "truth.csv") == 0
    capsys.readouterr()
    assert command("evaluate", "--tracks", "t.csv", "--truth", "truth.csv", "-o", "figures.csv") == 0
    assert "RMSE of position" in capsys.readouterr().out
    with (small.parent / "figures.csv").open(newline="") as file:
        figures = {row["metric"]: row["value"] for row in csv.DictReader(file)}
    assert list(figures) == [metric.name for metric in METRICS]
    for name, value in figures.items():
        if value or run[name]:
            assert float(value) == pytest.approx(float(run[name]), rel=1e-3, abs=0.02), name


def test_tracks_with_a_bad_row(command: Command, small: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (small.parent / "t.csv").write_text("time_s,track,east_m,north_m\n0,1,2,far\n")
    (small.parent / "truth.csv").write_text("time_s,target,east_m,north_m\n0,1,2,3\n")
    assert command("evaluate", "--tracks", "t.csv", "--truth", "truth.csv") == 2
    assert "t.csv: line 2, north_m: expected a number" in capsys.readouterr().err
