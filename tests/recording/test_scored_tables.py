"""Tables of tracks and of truth are read as they were written, and a row that can't be used is named."""

from pathlib import Path

import numpy as np
import pytest

from radar_console.core.errors import InputError
from radar_console.core.messages import TRACK, TRUTH, Radar, Sector, TrackStatus, blank
from radar_console.recording.scored import read_tracks, read_truth
from radar_console.recording.writing import TrackWriter, TruthWriter

NAMES = ("east", "north", "v_east", "v_north")


def random_table(dtype, number, rows):
    rng = np.random.default_rng(1)
    table = blank(dtype, rows)
    table["time"] = np.arange(rows) / 2
    table[number] = np.arange(rows) % 3
    for name in NAMES:
        table[name] = rng.uniform(-1e5, 1e5, rows)
    return table


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """To the decimals that are written: 0.5 cm, and half a millimetre of truth."""
    tracks, truth = random_table(TRACK, "track", 8), random_table(TRUTH, "target", 9)
    tracks["status"] = np.arange(8) % 4
    with TrackWriter(tmp_path / "t.csv") as out:
        out.write(Sector(Radar("", 4.0, 3e5, 50.0, 0.001), 0.0, 4.0, 0.0, 1.0, 1.0, tracks=tracks))
    with TruthWriter(tmp_path / "truth.csv") as out:
        out.write(truth)
    found = read_tracks(tmp_path / "t.csv")
    for name in ("time", "track", "status"):
        np.testing.assert_array_equal(found[name], tracks[name])
    seen = read_truth(tmp_path / "truth.csv")
    for name in ("time", "target"):
        np.testing.assert_array_equal(seen[name], truth[name])
    for name in NAMES:
        np.testing.assert_allclose(found[name], tracks[name], atol=5.1e-3)
        np.testing.assert_allclose(seen[name], truth[name], atol=5.1e-4)


def test_the_least_that_tracks_of_others_have(tmp_path: Path) -> None:
    file = tmp_path / "t.csv"
    file.write_text("time_s,track,east_m,north_m,quality\n0,1,10,20,a\n1,1,11,21,b\n0.5,2,0,0,c\n")
    found = np.sort(read_tracks(file), order=["track", "time"])
    assert found["status"].tolist() == [1, 1, TrackStatus.DELETED, 1, TrackStatus.DELETED]
    assert found["time"].tolist() == [0.0, 1.0, 1.001, 0.5, 0.501]
    assert not found["v_east"].any()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,track,east_m\n0,1,2\n", "line 1: no column north_m"),
        ("time_s,track,east_m,north_m\n", "line 2: no rows; expected tracks below"),
        ("time_s,track,east_m,north_m\n0,1,2,3\n1,1,nan,3\n", "line 3, east_m: expected a number"),
        ("time_s,track,east_m,north_m\n0,1,2,3\n1,1,x,3\n", "line 3, east_m: expected a number"),
        ("time_s,track,east_m,north_m\n0,1,2,\n", "line 2, north_m: expected a number"),
        ("time_s,track,east_m,north_m\n0,1.5,2,3\n", "line 2, track: expected a whole number"),
        ("time_s,track,east_m,north_m\n0,1e17,2,3\n", "line 2, track: expected a whole number"),
        ("time_s,track,east_m,north_m\n0,1,2,3,4\n", "line 2: has another number of fields"),
        ("time_s,track,status,east_m,north_m\n0,1,firm,2,3\n", "line 2, status: expected tentative or"),
        ("time_s,track,east_m,north_m,v_east_mps\n0,1,2,3,4\n", "line 1: has v_east_mps alone"),
    ],
)  # fmt: skip
def test_rows_that_can_not_be_used_are_named(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "t.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        read_tracks(file)


def test_truth_that_is_in_two_places(tmp_path: Path) -> None:
    file = tmp_path / "truth.csv"
    file.write_text("time_s,target,east_m,north_m\n0,1,2,3\n1,1,2,3\n1,2,2,3\n1,1,2,4\n")
    with pytest.raises(InputError, match="target 1 at 1 s comes twice"):
        read_truth(file)
