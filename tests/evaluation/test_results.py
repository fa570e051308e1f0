"""Results on disk: each run once and whole, whatever happens in between."""

import errno
import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from radar_console.core.errors import InputError
from radar_console.evaluation import results as module
from radar_console.evaluation.results import Results, Row

SETTINGS = [{"filter": "kalman", "models": ["cv", "ct"]}, {"filter": "imm", "models": []}]
METRICS = ["x", "y"]
ABOUT = {"scenario": {"title": "A", "duration_s": 60}, "seed": 1}


def opened(folder, about=ABOUT, compared=SETTINGS, metrics=METRICS):
    return Results(folder, about, compared, metrics)


ROWS = [
    Row(1, 7, {"x": 0.1 + 0.2, "y": np.nan}),
    Row(0, 7, {"x": -3.0, "y": 1e-300}),
    Row(0, 9, {"x": np.inf, "y": 2.0}),
    Row(1, 9, {}, 'it said "no",\nand  went'),
]


def fill(folder, rows=ROWS):
    with opened(folder) as results:
        for row in rows:
            results.add(row)


def test_what_is_written_is_read_to_the_last_bit(tmp_path):
    fill(tmp_path / "a" / "b")
    with opened(tmp_path / "a" / "b") as results:
        assert [row[:2] for row in results.rows] == [(0, 7), (0, 9), (1, 7), (1, 9)]
        assert results.seeds == [7, 9]
        np.testing.assert_array_equal(results.figures("x"), [[-3.0, np.inf], [0.1 + 0.2, np.nan]])
        np.testing.assert_array_equal(results.figures("y"), [[1e-300, 2.0], [np.nan, np.nan]])
        (failed,) = results.failed
        assert failed.error == 'it said "no", and went'
        assert results.missing([7, 8]) == [(0, 8), (1, 8)]
    lines = (tmp_path / "a" / "b" / "results.csv").read_text().splitlines()
    assert lines[0] == "seed,filter,models,x,y,error"
    assert lines[1] == "7,imm,[],0.30000000000000004,,"


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(data=st.data())
def test_cut_off_anywhere_it_goes_on_without_a_lost_or_doubled_run(tmp_path, data):
    """Whole rows stay, a torn one goes; doing what is missing gives the same file in the end."""
    folder = tmp_path / "cut"
    file = folder / "results.csv"
    file.unlink(missing_ok=True)
    fill(folder)
    with opened(folder) as results:
        results.sort()
    whole = file.read_bytes()
    cut = data.draw(st.integers(0, len(whole)))
    file.write_bytes(whole[:cut])
    with opened(folder) as results:
        kept = whole[:cut].count(b"\n") - 1
        assert len(results.rows) == max(kept, 0)
        todo = results.missing([7, 9])
        assert len(todo) == 4 - max(kept, 0)
        for row in ROWS:
            if row[:2] in todo:
                results.add(row)
        results.sort()
    assert file.read_bytes() == whole


def test_forgotten_runs_are_done_again(tmp_path):
    fill(tmp_path)
    with opened(tmp_path) as results:
        results.forget([9, 1000])
        assert results.missing([7, 9]) == [(0, 9), (1, 9)]
        results.add(Row(1, 9, {"x": 1.0, "y": 1.0}))
    with opened(tmp_path) as results:
        assert [row[:2] for row in results.rows] == [(0, 7), (1, 7), (1, 9)]
        assert not results.failed
    assert sorted(file.name for file in tmp_path.iterdir()) == ["experiment.json", "results.csv"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"about": ABOUT | {"seed": 2}}, "seed was 1, is 2"),
        ({"about": ABOUT | {"scenario": {"title": "A", "duration_s": 61}}}, "duration_s was 60, is 61"),
        ({"about": ABOUT | {"gate": 3}}, "gate is given now and was not"),
        ({"about": {"seed": 1}}, "scenario is not given now"),
        ({"compared": [SETTINGS[0], SETTINGS[1] | {"filter": "ukf"}]}, "filter was imm, is ukf"),
        ({"compared": SETTINGS[:1]}, "settings was 2 with filter, models, is 1 with filter, models"),
        ({"metrics": ["x"]}, "metrics was"),
    ],
)  # fmt: skip
def test_another_experiment_is_refused(tmp_path, change, said):
    fill(tmp_path)
    before = (tmp_path / "results.csv").read_bytes()
    with (
        pytest.raises(InputError, match=f"holds runs of another experiment: .*{said}"),
        opened(tmp_path, **change),
    ):
        pass
    assert (tmp_path / "results.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda text: text.replace("7,imm", "seven,imm"), "line 2: is no run of these"),
        (lambda text: text.replace("7,imm", "7,ukf"), "line 2: is no run of these"),
        (lambda text: text.replace("-3,", "-3"), "line 3: is no run of these"),
        (lambda text: text + text.splitlines()[1] + "\n", "line 6: has a run that is above"),
        (lambda text: "a" + text, "line 1: is not the header"),
    ],
)
def test_a_file_that_someone_changed(tmp_path, spoil, said):
    fill(tmp_path)
    file = tmp_path / "results.csv"
    file.write_text(spoil(file.read_text()))
    with pytest.raises(InputError, match=said), opened(tmp_path):
        pass


def test_results_without_what_they_are_of(tmp_path):
    (tmp_path / "results.csv").write_text("seed,x\n")
    with pytest.raises(InputError, match=r"no experiment\.json"), opened(tmp_path):
        pass


def test_a_full_disk_keeps_what_is_done(tmp_path, monkeypatch):
    """The disk takes the first half of the third row."""
    with opened(tmp_path) as results:
        results.add(ROWS[0])
        results.add(ROWS[1])
        write = os.write

        def full(out, line):
            write(out, line[: len(line) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(module.os, "write", full)
        with pytest.raises(InputError, match="No space left on device; the 2 runs before are kept"):
            results.add(ROWS[2])
        monkeypatch.undo()
        assert len(results.rows) == 2
        results.add(ROWS[2])
    with opened(tmp_path) as results:
        assert len(results.rows) == 3


def test_a_folder_that_can_not_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="can't be made"), opened(folder):
            pass


def test_two_commands_do_not_write_into_one_folder(tmp_path):
    pytest.importorskip("fcntl")
    with opened(tmp_path), pytest.raises(InputError, match="another command"), opened(tmp_path):
        pass
    with opened(tmp_path):
        pass


def test_what_a_program_may_not_do(tmp_path):
    with opened(tmp_path) as results:
        results.add(ROWS[0])
        for row in (ROWS[0], Row(0, 1, {"z": 1.0})):
            with pytest.raises(ValueError, match="is there, or figures"):
                results.add(row)
    with pytest.raises(ValueError, match="read alike"):
        Results(tmp_path, {}, [{"k": 1}, {"k": "1"}], METRICS)
