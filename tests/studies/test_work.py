"""Parts of a study: the same by any number of workers, kept over a kill, never half written."""

from pathlib import Path

import numpy as np
import pytest

from radar_console.core.errors import RadarConsoleError
from radar_console.studies import work
from radar_console.studies.work import Part, Work, chunks, generator

MADE = Path("made")


def draw(seed: int, runs: range) -> dict[str, np.ndarray]:
    """A part that leaves a mark when it is made."""
    with MADE.open("a", encoding="utf-8") as file:
        file.write(f"{runs.start}\n")
    return {"values": np.array([generator(seed, run).random() for run in runs])}


def fail(seed: int, runs: range) -> dict[str, np.ndarray]:
    raise ValueError(f"run {runs.start}")


def parts(runs=7, function=draw, seed=3):
    return [Part(function, (seed, each)) for each in chunks(runs, 2)]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def made():
    return sorted(MADE.read_text(encoding="utf-8").split()) if MADE.exists() else []


def test_any_number_of_workers_gives_the_same_in_the_same_order():
    one = Work(Path("one"), 7, 3, jobs=1).do("", parts())
    two = Work(Path("two"), 7, 3, jobs=2).do("", parts())
    for a, b in zip(one, two, strict=True):
        assert np.array_equal(a["values"], b["values"])
    assert np.concatenate([each["values"] for each in one]).tolist() == [
        generator(3, run).random() for run in range(7)
    ]


def test_finished_parts_are_not_made_again():
    whole = parts()
    bench = Work(Path("kept"), 7, 3)
    bench.do("", whole[:2])
    assert made() == ["0", "2"]
    bench.do("", whole)
    assert made() == ["0", "2", "4", "6"]
    bench.do("", parts(seed=4)[:1])
    assert made() == ["0", "0", "2", "4", "6"]


def test_what_was_finished_before_a_failure_is_kept():
    mixed = [*parts(function=fail)[2:], *parts()[:2]]
    with pytest.raises(RadarConsoleError, match=r"2 of 4 parts failed.*\n.*ValueError: run 4"):
        Work(Path("kept"), 7, 3).do("", mixed)
    Work(Path("kept"), 7, 3).do("", parts())
    assert made() == ["0", "2", "4", "6"]


def test_a_part_whose_writing_fails_is_not_taken_for_finished(monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(work.np, "savez", full)
    with pytest.raises(OSError, match="No space"):
        Work(Path("kept"), 7, 3).do("", parts())
    assert not list(Path("kept").rglob("*.npz"))


def test_more_runs_use_what_fewer_left():
    Work(Path("kept"), 4, 3).do("", parts(4))
    Work(Path("kept"), 7, 3).do("", parts(7))
    assert made() == ["0", "2", "4", "6"]
