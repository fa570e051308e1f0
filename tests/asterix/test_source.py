"""A recorded radar becomes sectors; what is wrong in the recording is mended or counted."""

import itertools
import math

import numpy as np
import pytest
from asterix_bytes import block, mark, report, scene, write_ast, write_pcap

from radar_console.asterix.source import AsterixRecording
from radar_console.core.errors import InputError
from radar_console.core.geometry import wrap
from radar_console.core.messages import Radar, Site
from radar_console.core.units import DEG, NM

AZIMUTHS = (10.0, 95.0, 200.0, 355.0)


def centroids(source):
    return np.concatenate([s.centroids for s in source.sectors()])


def check_sectors(source):
    """The laws of the sector message; every centroid lies where the beam was."""
    sectors = list(source.sectors())
    delivered = -math.inf
    for before, after in itertools.pairwise(sectors):
        assert after.begin >= before.end
        assert after.start >= before.stop
    for sector in sectors:
        assert sector.stop >= sector.start
        angles = sector.begin + wrap(sector.centroids["azimuth"] - sector.begin)
        assert (angles >= min(delivered, sector.begin) - 1e-9).all()
        assert (angles <= sector.end + 1e-9).all()
        assert sector.complete <= sector.end
        delivered = sector.complete
    assert sectors[0].begin >= 0
    assert sectors[0].begin < 2 * math.pi


@pytest.mark.parametrize("marks", [True, False])
@pytest.mark.parametrize("write", [write_pcap, write_ast])
def test_a_steady_radar(tmp_path, marks, write):
    source = AsterixRecording(write(tmp_path / "a", scene(12, marks=marks)))
    assert source.radar.rotation == pytest.approx(4.0, abs=0.01)
    assert source.radar.name == "SAC 1 SIC 2"
    assert source.radar.max_range == 60 * NM
    assert source.skipped == {}
    found = centroids(source)
    assert len(found) == 48
    np.testing.assert_allclose(found["range"], 50 * NM)
    check_sectors(source)
    # Time and place of every report agree with the true beam: north at 1,000 s.
    true = 2 * math.pi * (found["time"] - 1000.0) / 4.0
    assert np.abs(wrap(found["azimuth"] - true)).max() < 0.5 * DEG
    for sector in source.sectors():
        assert abs(wrap(sector.end - 2 * math.pi * (sector.stop - 1000.0) / 4.0)) < 1.0 * DEG


def test_ordinals_number_the_reports_in_the_file(tmp_path):
    sent = scene(3)
    source = AsterixRecording(write_pcap(tmp_path / "a", sent))
    in_file = [data for _, data in sent if data[0] == 48]
    for row in centroids(source):
        theta = int.from_bytes(in_file[row["ordinal"]][12:14], "big")
        assert row["azimuth"] == pytest.approx(theta / 65536 * 2 * math.pi)


def test_items_become_fields(tmp_path):
    full = report(
        1008.5, 30.0, 45.0, i070=b"\x0f\xc0", i090=(-40 & 0x3FFF).to_bytes(2, "big"), i220=b"\x40\x61\x2a"
    )
    doubtful = report(1008.6, 30.0, 54.0, i070=b"\x8f\xc0", i090=b"\x44\xb0", descriptor=b"\x40")
    source = AsterixRecording(write_pcap(tmp_path / "a", [*scene(3), (1012.0, block(48, full, doubtful))]))
    rows = {round(row["azimuth"] / DEG): row for row in centroids(source)}
    assert rows[45]["mode_3a"] == 0o7700
    assert rows[45]["height"] == pytest.approx(-1000 * 0.3048)
    assert rows[45]["address"] == 0x40612A
    assert rows[54]["mode_3a"] == -1
    assert math.isnan(rows[54]["height"])
    assert rows[54]["address"] == -1


def test_reports_that_are_no_detection_are_counted_and_keep_their_number(tmp_path):
    odd = [
        report(1001.0, theta_deg=90.0, descriptor=b"\x50"),
        report(1001.0, theta_deg=90.0, descriptor=b"\x41\x80"),
        report(1001.0, theta_deg=90.0, descriptor=b"\x42"),
        report(1001.0, theta_deg=90.0, descriptor=b"\x00"),
        report(1001.0, i040=b""),
        report(None, theta_deg=90.0),
        report(1001.0, theta_deg=90.0, i140=b"\xff\xff\xff"),
    ]
    source = AsterixRecording(write_pcap(tmp_path / "a", [(999.0, block(48, *odd)), *scene(3)]))
    assert source.skipped == {
        "simulated reports (SIM)": 1,
        "test target reports (TST)": 1,
        "field monitor reports (RAB)": 1,
        "reports without a detection (TYP 0)": 1,
        "reports without a measured position": 1,
        "reports without a valid time of day": 2,
    }
    assert sorted(centroids(source)["ordinal"].tolist()) == list(range(7, 19))


def test_across_midnight(tmp_path):
    source = AsterixRecording(write_pcap(tmp_path / "a", scene(12, start=86400 - 22)))
    found = centroids(source)
    assert len(found) == 48
    assert found["time"].min() > 86370
    assert found["time"].max() == pytest.approx(86400 - 22 + 11 * 4 + 355 / 360 * 4, abs=0.01)
    assert source.duration < 50
    check_sectors(source)


@pytest.mark.parametrize("marks", [True, False])
def test_a_clock_set_back_loses_nothing(tmp_path, marks):
    sent = scene(12, marks=marks) + scene(12, start=400.0, marks=marks)
    source = AsterixRecording(write_ast(tmp_path / "a", sent))
    assert source.noted == {"times of day set back (later times moved on)": 1}
    check_sectors(source)
    found = centroids(source)
    # Without marks the antenna's phase jumps where the clock does: reports there may not fit.
    assert len(found) + sum(source.skipped.values()) == 96
    assert len(found) >= (96 if marks else 80)


def test_a_report_with_a_wrong_time_is_counted_and_the_others_kept(tmp_path):
    sent = scene(12)
    sent.insert(200, (1020.0, block(48, report(3000.0, theta_deg=180.0))))
    sent.insert(201, (1020.0, block(48, report(1016.1, theta_deg=250.0))))
    source = AsterixRecording(write_pcap(tmp_path / "a", sent))
    assert source.skipped == {
        "reports with a stray time of day": 1,
        "reports whose time of day does not fit their azimuth": 1,
    }
    assert len(centroids(source)) == 48
    assert source.duration < 60
    check_sectors(source)


def test_a_late_report_is_put_in_its_place(tmp_path):
    sent = scene(12)
    late = next(i for i, (_, data) in enumerate(sent) if data[0] == 48)
    sent.insert(late + 60, sent.pop(late))
    source = AsterixRecording(write_pcap(tmp_path / "a", sent))
    assert len(centroids(source)) == 48
    assert source.noted == {"reports more than 0.5 s behind an earlier one (kept, put in order)": 1}
    check_sectors(source)


def test_stray_marks_do_not_turn_the_beam(tmp_path):
    sent = scene(12)
    sent.insert(150, (1010.0, block(34, mark(2500.0, 8))))
    sent.insert(250, (sent[250][0], block(34, mark(sent[250][0], 60))))
    source = AsterixRecording(write_pcap(tmp_path / "a", sent))
    assert source.skipped == {
        "antenna marks with a stray time of day": 1,
        "antenna marks that do not fit their neighbours": 1,
    }
    assert len(centroids(source)) == 48
    check_sectors(source)


def test_several_radars_need_a_choice(tmp_path):
    other = [(t + 0.01, block(48, report(t, radar=(1, 9)))) for t in (1000.0, 1004.0)]
    marks_only = [(1000.0, block(34, mark(1000.0, 0, radar=(7, 7))))]
    sent = sorted(scene(6) + other + marks_only, key=lambda item: item[0])
    file = write_pcap(tmp_path / "a", sent)
    with pytest.raises(
        InputError, match=r"2 radars; expected a choice \(--radar SAC/SIC\): 1/2 \(24\), 1/9 \(2\)"
    ):
        AsterixRecording(file)
    with pytest.raises(InputError, match="no target reports of radar 7/7; expected one of 1/2"):
        AsterixRecording(file, (7, 7))
    source = AsterixRecording(file, (1, 2))
    assert len(centroids(source)) == 24
    assert source.skipped == {"reports of radar 1/9": 2, "CAT-034 messages of radar 7/7": 1}


def test_one_radar_with_reports_needs_no_choice(tmp_path):
    marks_only = [(1000.0, block(34, mark(1000.0, 0, radar=(7, 7))))]
    assert AsterixRecording(write_pcap(tmp_path / "a", marks_only + scene(6))).sac_sic == (1, 2)


def test_a_stream_that_comes_twice_is_read_once(tmp_path):
    once = scene(6)
    twice = [item for item in once for _ in range(2)]
    source = AsterixRecording(write_pcap(tmp_path / "a", twice))
    assert source.skipped == {"records received a second time": len(once)}
    alone = AsterixRecording(write_pcap(tmp_path / "b", once))
    assert centroids(source).tobytes() == centroids(alone).tobytes()


def test_trailers_unknown_categories_and_broken_records_are_counted(tmp_path):
    sent = scene(6)
    sent[10] = (sent[10][0], sent[10][1] + b"\x00\x20\xf5")
    sent.insert(20, (1003.0, b"\x3e\x00\x10" + bytes(13)))
    sent.insert(30, (1004.0, b"\xf7\x00\x05ab"))
    sent.insert(40, (1005.0, block(48, report(1005.0, theta_deg=90.0), b"\xff\xff\xff\xff\xff\x00zz")))
    source = AsterixRecording(write_pcap(tmp_path / "a", sent))
    assert source.skipped == {
        "bytes after the last block of a datagram": 3,
        "blocks of CAT-062": 1,
        "bytes in blocks of CAT-062": 13,
        "blocks of CAT-247": 1,
        "bytes in blocks of CAT-247": 2,
        "CAT-048 records with an item that the category does not have": 1,
        "bytes after the last good CAT-048 record of a block": 8,
    }
    assert len(centroids(source)) == 25


def test_the_site_and_what_a_configuration_states(tmp_path):
    place = (
        (120).to_bytes(2, "big") + (1 << 21).to_bytes(3, "big") + (-(1 << 20)).to_bytes(3, "big", signed=True)
    )
    sent = [(1000.0, block(34, mark(1000.0, None, i120=place))), *scene(6)]
    file = write_pcap(tmp_path / "a", sent)
    assert AsterixRecording(file).radar.site == Site(45.0, -22.5, 120.0)
    stated = Radar("Tower", 4.5, 90e3, 10.0, 0.2 * DEG, site=Site(1.0, 2.0))
    source = AsterixRecording(file, radar=stated, given=frozenset({"radar.sd_range_m", "radar.latitude_deg"}))
    assert source.radar.site == Site(1.0, 2.0)
    assert source.radar.rotation == pytest.approx(4.0)
    assert set(centroids(source)["sd_range"]) == {10.0}


def test_no_target_reports_is_one_sentence(tmp_path):
    only_062 = [(t, b"\x3e\x00\x06abc") for t in range(5)]
    with pytest.raises(
        InputError, match="without target reports; expected CAT-048 records, found 5 blocks of CAT-062"
    ):
        AsterixRecording(write_pcap(tmp_path / "a", only_062))


def test_a_rotation_that_cannot_be_told_is_asked_for(tmp_path):
    file = write_pcap(tmp_path / "a", [(t, block(48, report(t))) for t in (1.0, 1.1, 1.2)])
    with pytest.raises(InputError, match="expected rotation_s"):
        AsterixRecording(file)
    stated = Radar("Tower", 4.0, 90e3, 10.0, 0.2 * DEG)
    assert len(centroids(AsterixRecording(file, radar=stated, given=frozenset({"radar.rotation_s"})))) == 3


def test_a_cut_off_file_keeps_its_whole_records(tmp_path):
    file = write_ast(tmp_path / "a.ast", scene(12))
    file.write_bytes(file.read_bytes()[:-5])
    source = AsterixRecording(file)
    assert source.skipped["blocks cut off by the end of the file or packet"] == 1
    assert len(centroids(source)) in (47, 48)


def test_the_facts_have_labels_and_values(tmp_path):
    facts = dict(AsterixRecording(write_pcap(tmp_path / "a", scene(12))).facts())
    assert facts["rotation"] == "4.000 s, from north and sector marks"
    assert facts["north marks"] == "12"
    assert facts["radar 1/2"] == "48 target reports, 396 antenna marks"
