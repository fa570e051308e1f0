"""Whole runs from the command line: what they write, and that they write the same again."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from radar_console.core.messages import Sector
from radar_console.recording.writing import TrackWriter

Command = Callable[..., int]

COLUMNS = [
    *("time_s", "track", "status", "east_m", "north_m", "up_m", "v_east_mps", "v_north_mps", "v_up_mps"),
    *("sd_east_m", "sd_north_m", "range_m", "azimuth_deg", "plot", "probability"),
]


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_inline_and_threaded_write_the_same_bytes_twice(command: Command, small: Path) -> None:
    written = []
    for k, extra in enumerate(([], [], ["--threaded"], ["--threaded"])):
        assert command("track", small, "-o", f"t{k}.csv", *extra) == 0
        written.append((small.parent / f"t{k}.csv").read_bytes())
    assert len(written[0]) > 1000
    assert written.count(written[0]) == 4


def test_another_seed_is_another_run(command: Command, small: Path) -> None:
    assert command("track", small, "-o", "a.csv") == 0
    assert command("track", small, "-o", "b.csv", "--seed", "4") == 0
    assert (small.parent / "a.csv").read_bytes() != (small.parent / "b.csv").read_bytes()


def test_tracks_and_figures(command: Command, small: Path) -> None:
    assert command("track", small, "-o", "t.csv", "--stats", "s.json") == 0
    tracks = rows(small.parent / "t.csv")
    assert list(tracks[0]) == COLUMNS
    assert {row["status"] for row in tracks} <= {"tentative", "confirmed", "coasting", "deleted"}
    confirmed = {row["track"] for row in tracks if row["status"] == "confirmed"}
    assert len(confirmed) == 3
    for row in tracks:
        assert (row["plot"] == "") == (row["probability"] == "")
        if row["plot"]:
            assert 0.0 < float(row["probability"]) <= 1.0
        east, north = float(row["east_m"]), float(row["north_m"])
        # Millidegrees at 100 km are metres: the file's own rounding bounds the two.
        assert np.hypot(east, north) == pytest.approx(float(row["range_m"]), abs=0.02)

    figures = json.loads((small.parent / "s.json").read_text(encoding="utf-8"))
    assert list(figures) == [
        *("scans", "plots", "centroids", "tracks_confirmed", "tracker_s_per_scan", "latency_s"),
        *("dropped", "skipped", "noted", "wall_s", "peak_rss_mb"),
    ]
    assert (figures["scans"], figures["tracks_confirmed"], figures["dropped"]) == (12, 3, 0)
    assert list(figures["latency_s"]) == ["median", "p99", "max"]
    assert 0.0 < figures["latency_s"]["median"] < figures["latency_s"]["max"] <= 4.0


def test_a_capacity_that_was_reached_is_said(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small.write_text(small.read_text(encoding="utf-8") + "[tracker]\nmax_tracks = 2\n", encoding="utf-8")
    assert command("track", small, "-o", "t.csv", "--stats", "s.json") == 0
    figures = json.loads((small.parent / "s.json").read_text(encoding="utf-8"))
    assert figures["skipped"]["young tracks beyond max_tracks"] > 0
    assert "young tracks beyond max_tracks" in capsys.readouterr().err


def test_a_plot_ordinal_leads_back_to_its_plot(command: Command, small: Path) -> None:
    """simulate → plots.csv → track: row `plot` of the plots is near the track that it updated."""
    assert command("simulate", small, "-o", "plots.csv", "--truth", "truth.csv") == 0
    assert command("track", "plots.csv", "-o", "t.csv", "--config", small) == 0
    plots = rows(small.parent / "plots.csv")
    updates = [row for row in rows(small.parent / "t.csv") if row["status"] == "confirmed" and row["plot"]]
    assert len(updates) > 15
    for row in updates:
        plot = plots[int(row["plot"])]
        assert abs(float(plot["range_m"]) - float(row["range_m"])) < 1000.0
    assert {row["target"] for row in rows(small.parent / "truth.csv")} == {"0", "1", "2"}


def test_raw_plots_from_a_file_give_the_tracks_of_the_simulation(command: Command, small: Path) -> None:
    assert command("simulate", small, "-o", "plots.csv") == 0
    assert command("track", "plots.csv", "-o", "replayed.csv", "--config", small) == 0
    assert command("track", small, "-o", "direct.csv") == 0
    ends = []
    for name in ("replayed.csv", "direct.csv"):
        last = {}
        for row in rows(small.parent / name):
            if row["status"] == "confirmed":
                last[row["track"]] = (float(row["east_m"]), float(row["north_m"]))
        ends.append(np.array(sorted(last.values())))
    assert ends[0].shape == ends[1].shape == (3, 2)
    # The file rounds what was measured, and another random stream moves the particles.
    assert np.abs(ends[0] - ends[1]).max() < 100.0


def test_an_interrupted_run_keeps_what_it_has_and_says_so(
    command: Command, small: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write = TrackWriter.write

    def interrupted(writer: TrackWriter, sector: Sector) -> None:
        if sector.stop > 24.0:
            raise KeyboardInterrupt
        write(writer, sector)

    monkeypatch.setattr(TrackWriter, "write", interrupted)
    assert command("track", small, "-o", "t.csv") == 130
    assert "interrupted; what was tracked until then is in t.csv" in capsys.readouterr().err
    assert 10.0 < float(rows(small.parent / "t.csv")[-1]["time_s"]) < 24.0
