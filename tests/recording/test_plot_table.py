"""Plot tables: read, written and read again; bad rows are counted by reason."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given as hypothesis_given
from hypothesis import settings
from hypothesis import strategies as st

from radar_console.core.errors import InputError
from radar_console.core.messages import CENTROID, PLOT, TRACK, TRUTH, Radar, Sector, TrackStatus, blank
from radar_console.core.units import DEG, TURN
from radar_console.recording.table import PlotTable
from radar_console.recording.writing import TRACK_COLUMNS, PlotWriter, TrackWriter, TruthWriter

RADAR = Radar("test", 4.0, 60e3, 30.0, 0.1 * DEG)
HEADER = "time_s,range_m,azimuth_deg\n"


def good_rows(turns=10, azimuths=(10.0, 100.0, 300.0), rotation=4.0):
    return [
        f"{(turn + azimuth / 360) * rotation:.4f},{10000 + 10 * turn},{azimuth}"
        for turn in range(turns)
        for azimuth in azimuths
    ]


def table(tmp_path, text, **settings):
    file = tmp_path / "plots.csv"
    file.write_text(text)
    return PlotTable(file, **settings)


def rows_of(source):
    return np.concatenate([s.centroids for s in source.sectors()])


def test_the_least_table(tmp_path):
    source = table(tmp_path, HEADER + "\n".join(good_rows()) + "\n")
    assert source.radar.rotation == pytest.approx(4.0, rel=1e-3)
    assert source.skipped == {}
    found = rows_of(source)
    assert found["ordinal"].tolist() == list(range(30))
    assert found["sd_range"][0] == source.radar.sd_range
    assert np.isnan(found["height"]).all()
    assert (found["mode_3a"] == -1).all()
    for before, after in itertools.pairwise(source.sectors()):
        assert before.end == after.begin


BAD = [
    ("1.0,nan,20", "range_m: empty, NaN or infinite"),
    ("1.0,inf,20", "range_m: empty, NaN or infinite"),
    ("1.0,,20", "range_m: empty, NaN or infinite"),
    ("1.0,-5,20", "range_m: negative"),
    ("-1.0,5,20", "time_s: negative"),
    ("1.0,5,360", "azimuth_deg: outside 0 to 360"),
    ("1.0,5,-0.1", "azimuth_deg: outside 0 to 360"),
    ("1.0,far,20", "range_m: not a number"),
    ("1.0,5", "rows with another number of fields than the header"),
    ("1.0,5,20,7", "rows with another number of fields than the header"),
    ('1.0,"5,0",20', "range_m: not a number"),
]


@pytest.mark.parametrize(("row", "reason"), BAD)
def test_a_bad_row_is_counted_with_its_line_and_the_others_kept(tmp_path, row, reason):
    rows = good_rows()
    rows[4:4] = [row, row]
    source = table(tmp_path, HEADER + "\n".join(rows) + "\n")
    assert source.skipped == {f"{reason} (first in line 6)": 2}
    found = rows_of(source)
    assert sorted(found["ordinal"].tolist()) == [0, 1, 2, 3, *range(6, 32)]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("sd_range_m", "0", "sd_range_m: not positive"),
        ("mode_3a", "7800", "mode_3a: not four octal digits"),
        ("elevation_deg", "91", "elevation_deg: outside -90 to 90"),
        ("scan", "1.5", "scan: not a whole number"),
        ("sensor_east_m", "", "sensor_east_m: empty, NaN or infinite"),
        ("snr_db", "loud", "snr_db: not a number"),
    ],
)
def test_bad_optional_values(tmp_path, name, value, reason):
    rows = [row + ",1" for row in good_rows()]
    rows[0] = good_rows()[0] + "," + value
    source = table(tmp_path, f"time_s,range_m,azimuth_deg,{name}\n" + "\n".join(rows))
    assert source.skipped == {f"{reason} (first in line 2)": 1}
    assert len(rows_of(source)) == 29


def test_unknown_optional_values_are_unknown(tmp_path):
    rows = [row + f",{'' if i % 2 else 12.5},{'nan' if i % 3 else 20}" for i, row in enumerate(good_rows())]
    found = rows_of(table(tmp_path, "time_s,range_m,azimuth_deg,snr_db,height_m\n" + "\n".join(rows)))
    assert np.isnan(found["snr"]).sum() == 15
    assert np.isnan(found["height"]).sum() == 20


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        (HEADER, "no rows"),
        ("time_s,range_km,azimuth_deg\n1,2,3\n", "line 1: no column range_m"),
        ("a,b\n1,2\n", "no column time_s nor range_m nor azimuth_deg"),
        ("time_s,time_s,range_m,azimuth_deg\n1,1,2,3\n", "column time_s comes more than once"),
        (
            HEADER + "1,-2,3\nx,2,3\n",
            r"no good row; .*found 1 × time_s: not a number \(first in line 3\); 1 × range_m",
        ),
        (HEADER + "1,2,3\n", "expected rotation_s"),
    ],
)
def test_what_is_no_plot_table_is_one_sentence(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as error:
        table(tmp_path, text)
    assert "plots.csv" in str(error.value)
    assert "expected" in str(error.value)


def test_a_binary_file_is_one_sentence(tmp_path):
    file = tmp_path / "plots.csv"
    file.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputError, match="byte 0: not a text file; expected"):
        PlotTable(file)


def test_other_columns_are_ignored_and_noted(tmp_path):
    rows = [row + ",7,note" for row in good_rows()]
    source = table(tmp_path, "time_s,range_m,azimuth_deg,elevation,weather\n" + "\n".join(rows))
    assert source.noted == {
        "column elevation ignored, did you mean elevation_deg?": 1,
        "column weather ignored": 1,
    }
    assert len(rows_of(source)) == 30


def test_rows_out_of_order_are_put_in_order(tmp_path):
    rows = good_rows()
    rows[5], rows[6] = rows[6], rows[5]
    source = table(tmp_path, HEADER + "\n".join(rows))
    assert source.noted == {"rows before an earlier row's time (put in order)": 1}
    found = rows_of(source)
    assert found["ordinal"].tolist()[4:8] == [4, 6, 5, 7]
    assert (np.diff(found["time"]) > 0).all()


@settings(max_examples=60)
@hypothesis_given(st.lists(st.text('0123456789.,-na"\n e', max_size=20), max_size=12))
def test_any_text_is_rows_or_a_reason(tmp_path_factory, junk):
    file = tmp_path_factory.mktemp("junk") / "plots.csv"
    file.write_text(HEADER + "\n".join([*good_rows(), *junk]))
    source = PlotTable(file)
    assert len(rows_of(source)) >= 29  # a quote may swallow the row before it


def test_scans_with_one_time_are_two_halves_of_a_turn(tmp_path):
    rng = np.random.default_rng(0)
    rows = [
        f"{2.5 * scan:.2f},{rng.uniform(50, 500):.1f},{rng.uniform(0, 359):.2f},{scan},{scan},{-2 * scan}"
        for scan in range(20)
        for _ in range(4)
        if scan != 7
    ]
    source = table(
        tmp_path, "time_s,range_m,azimuth_deg,scan,sensor_east_m,sensor_north_m\n" + "\n".join(rows)
    )
    assert source.radar.rotation == 2.5
    sectors = list(source.sectors())
    assert len(sectors) == 40
    for scan, (east, west) in enumerate(zip(sectors[::2], sectors[1::2], strict=True)):
        assert east.begin == pytest.approx(scan * TURN)
        assert west.end == pytest.approx((scan + 1) * TURN)
        # The beam is south at the time of the scan.
        assert east.end == west.begin == pytest.approx((scan + 0.5) * TURN)
        assert east.stop == west.start == pytest.approx(2.5 * scan)
        assert west.stop == pytest.approx(2.5 * (scan + 0.5))
        assert east.position == pytest.approx((scan, -2 * scan, 0.0))
        for half, sector in enumerate((east, west)):
            assert (np.floor(sector.centroids["azimuth"] / (TURN / 2)) == half).all()
            assert (sector.centroids["time"] <= sector.stop).all()
        assert len(east.centroids) + len(west.centroids) == (0 if scan == 7 else 4)


def raw_plots(turns=6, pulses=900, rotation=4.0):
    rng = np.random.default_rng(2)
    pulse = np.sort(rng.integers(0, turns * pulses, 4000))
    plots = blank(PLOT, len(pulse))
    plots["ordinal"] = np.arange(len(pulse))
    plots["pulse"], plots["cell"] = pulse, rng.integers(0, 400, len(pulse))
    plots["time"] = pulse * rotation / pulses
    plots["azimuth"] = np.mod(pulse * TURN / pulses, TURN)
    plots["range"], plots["amplitude"] = plots["cell"] * 150.0, rng.rayleigh(1.0, len(pulse))
    return plots[np.lexsort((plots["cell"], plots["pulse"]))]


def write_plots(file, sectors):
    with PlotWriter(file) as writer:
        for sector in sectors:
            writer.write(sector)
    return file


def sector_with(**tables):
    return Sector(RADAR, 0.0, 1.0, 0.0, 1.0, 1.0, **tables)


def test_raw_returns_are_written_and_read_again(tmp_path):
    plots = raw_plots()
    parts = [sector_with(plots=plots[i : i + 100].copy()) for i in range(0, len(plots), 100)]
    source = PlotTable(write_plots(tmp_path / "plots.csv", parts))
    assert source.radar.rotation == pytest.approx(4.0, rel=1e-6)
    sectors = list(source.sectors())
    assert all(len(s.centroids) == 0 for s in sectors)
    found = np.concatenate([s.plots for s in sectors])
    for name in ("pulse", "cell"):
        np.testing.assert_array_equal(found[name], plots[name])
    for name, decimals in (("time", 6), ("range", 3), ("amplitude", 5)):
        np.testing.assert_allclose(found[name], plots[name], atol=0.5001 * 10.0**-decimals)
    np.testing.assert_allclose(found["azimuth"], plots["azimuth"], atol=0.5001e-6 * DEG)
    assert found["ordinal"].tolist() == list(range(len(plots)))
    for sector in sectors:
        inside = np.mod(sector.plots["azimuth"] - sector.begin + 1e-6, TURN)
        assert (inside < sector.end - sector.begin + 2e-6).all()


def test_target_reports_are_written_and_read_again(tmp_path):
    reports = blank(CENTROID, 3)
    reports["time"] = [1.0, 2.0, 3.0]
    reports["range"], reports["azimuth"] = [1e3, 2e3, 3e3], [1.0, TURN - 1e-12, 3.0]
    reports["height"], reports["mode_3a"] = [100.0, np.nan, 300.0], [0o7700, -1, 0]
    reports["sd_range"], reports["sd_azimuth"] = 25.0, 0.002
    stated = {"radar": RADAR, "given": frozenset({"radar.rotation_s"})}
    source = PlotTable(write_plots(tmp_path / "plots.csv", [sector_with(centroids=reports)]), **stated)
    found = np.sort(rows_of(source), order="ordinal")
    assert found["mode_3a"].tolist() == [0o7700, -1, 0]
    np.testing.assert_array_equal(found["height"], reports["height"])
    np.testing.assert_allclose(found["azimuth"], [1.0, 0.0, 3.0], atol=1e-8)
    np.testing.assert_allclose(found["sd_azimuth"], 0.002, atol=1e-8)


def test_a_plot_table_holds_one_kind(tmp_path):
    with PlotWriter(tmp_path / "plots.csv") as writer:
        writer.write(sector_with(plots=raw_plots()[:1].copy()))
        with pytest.raises(ValueError, match="one kind"):
            writer.write(sector_with(centroids=blank(CENTROID, 1)))


def test_tracks_have_the_columns_of_the_contract(tmp_path):
    tracks = blank(TRACK, 2)
    tracks["track"], tracks["time"] = [3, 12], [61.03, 61.12346]
    tracks["status"] = [TrackStatus.CONFIRMED, TrackStatus.COASTING]
    tracks["east"], tracks["north"], tracks["up"] = [300.0, -1000.0], [400.0, 0.0], [np.nan, 1500.0]
    tracks["v_east"], tracks["v_north"] = [-0.0001, 20.0], [5.0, 0.0]
    tracks["sd_east"] = tracks["sd_north"] = 12.25
    tracks["plot"], tracks["probability"] = [77, -1], [0.98765432, np.nan]
    sector = Sector(RADAR, 0.0, 1.0, 0.0, 1.0, 1.0, position=(0.0, 800.0, 0.0), tracks=tracks)
    file = tmp_path / "tracks.csv"
    with TrackWriter(file) as writer:
        writer.write(sector_with())
        writer.write(sector)
    assert file.read_bytes().decode().split("\n") == [
        TRACK_COLUMNS,
        "61.0300,3,confirmed,300.00,400.00,,0.000,5.000,,12.25,12.25,500.00,143.13010,77,0.98765",
        "61.1235,12,coasting,-1000.00,0.00,1500.00,20.000,0.000,,12.25,12.25,1280.62,231.34019,,",
        "",
    ]


def test_truth(tmp_path):
    truth = blank(TRUTH, 1)
    truth["time"], truth["target"], truth["east"], truth["north"] = 2.0, 5, 10.0, -20.5
    truth["v_east"], truth["v_north"] = 1.0, 2.0
    with TruthWriter(tmp_path / "truth.csv") as writer:
        writer.write(truth)
    assert (tmp_path / "truth.csv").read_text() == (
        "time_s,target,east_m,north_m,up_m,v_east_mps,v_north_mps,v_up_mps\n"
        "2.000,5,10.000,-20.500,,1.000,2.000,\n"
    )


@pytest.mark.parametrize("writer", [TrackWriter, PlotWriter, TruthWriter])
def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path, writer):
    with pytest.raises(InputError, match="can't be written: there is no folder"):
        writer(tmp_path / "none" / "out.csv")
    with pytest.raises(InputError, match="can't be written: "):
        writer(tmp_path)


@pytest.mark.parametrize(
    ("scene", "scans", "rows"), [(2, 70, 437), (4, 59, 277), (16, 72, 285), (22, 50, 263)]
)
def test_recorded_harbour_scenes(recording, scene, scans, rows):
    source = PlotTable(recording(f"autoferry/scenario{scene}_plots.csv"))
    assert source.radar.rotation == pytest.approx(1.68, abs=0.005)
    assert source.skipped == {}
    sectors = list(source.sectors())
    assert len(sectors) == 2 * scans
    assert sum(len(s.centroids) for s in sectors) == rows
    for before, after in itertools.pairwise(sectors):
        assert after.begin == before.end
        assert after.start == before.stop
    assert all(math.isfinite(s.position[0]) and s.position[0] != 0.0 for s in sectors)
