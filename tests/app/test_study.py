"""The command `study`: its list, a run from parts to table, and what a user gets wrong."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from radar_console.evaluation import intervals
from radar_console.studies import catalogue
from radar_console.studies.catalogue import Study
from radar_console.studies.findings import Finding, found
from radar_console.studies.work import Part, Work, generator

Command = Callable[..., int]


def draw(seed: int, run: int) -> dict[str, np.ndarray]:
    return {"value": generator(seed, run).standard_normal(1)}


def mean_of_normals(work: Work) -> list[Finding]:
    parts = work.do("small", [Part(draw, (work.seed, run)) for run in range(work.runs)])
    values = np.concatenate([part["value"] for part in parts])
    return [found("mean", "m", intervals.mean(values), "near zero", 0.5)]


def interrupted(work: Work) -> list[Finding]:
    raise KeyboardInterrupt


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the place of every study."""
    study = Study("small", "A small study", "A small study.", 40, mean_of_normals)
    monkeypatch.setattr(catalogue, "load", lambda name: study)


def test_the_list(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("study", "--list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(catalogue.NAMES)
    assert all(len(line) < 100 for line in lines)


@pytest.mark.usefixtures("small")
def test_table_and_results(command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("study", "small", "--seed", 4, "--jobs", 1) == 0
    said = capsys.readouterr()
    assert "near zero" in said.out
    assert "results.json are in out/small" in said.err
    first = (tmp_path / "out" / "small" / "results.json").read_bytes()
    (row,) = json.loads(first)
    assert (row["published"], row["runs"], row["unit"]) == (0.5, 40, "m")
    assert row["ci_low"] < row["ours"] < row["ci_high"]
    assert "--runs 40 --seed 4" in (tmp_path / "out" / "small" / "report.md").read_text(encoding="utf-8")
    assert command("study", "small", "--seed", 4, "--jobs", 2, "-o", "other") == 0
    assert (tmp_path / "other" / "results.json").read_bytes() == first


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["study"], "which one? Expected a name"),
        (["study", "filter-rsme"], "study filter-rsme: no such study; did you mean filter-rmse?"),
        (["study", "filter-rmse", "-o", "taken"], "taken: is a file; expected a folder"),
        (["study", "filter-rmse", "-o", "taken/below"], "taken/below: can't be made"),
        (["study", "filter-rmse", "--runs", "1"], "greater than or equal to 2"),
    ],
)
def test_what_a_user_gets_wrong(
    command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    (tmp_path / "taken").write_text("", encoding="utf-8")
    assert command(*arguments) == 2
    message = capsys.readouterr().err
    assert said in message
    assert "Traceback" not in message


@pytest.mark.usefixtures("small")
def test_a_full_disk_is_a_sentence(
    command: Command, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    assert command("study", "small", "--jobs", 1) == 2
    assert "can't be written: No space left on device" in capsys.readouterr().err


def test_an_interruption_says_what_is_left(
    command: Command, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study = Study("small", "A small study", "A small study.", 40, interrupted)
    monkeypatch.setattr(catalogue, "load", lambda name: study)
    assert command("study", "small") == 130
    assert "finished parts are in out/small; the same command goes on from there" in capsys.readouterr().err
