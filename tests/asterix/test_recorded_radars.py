"""Real recordings; skipped where they are missing."""

import itertools
import shutil
import subprocess
from collections import Counter

import numpy as np
import pytest
from asterix_bytes import DAY_START, write_pcap

from radar_console.asterix import frames, reports
from radar_console.asterix.blocks import blocks
from radar_console.asterix.records import CAT_034, CAT_048, Reader
from radar_console.asterix.source import AsterixRecording
from radar_console.core.errors import InputError
from radar_console.core.geometry import wrap
from radar_console.core.units import DEG, NM


@pytest.fixture(scope="module")
def secondary(recording):
    return recording("asterix/260429.pcap")


@pytest.fixture(scope="module")
def several(recording):
    return recording("asterix/cat_034_048.pcap")


def test_an_hour_of_a_secondary_radar(secondary):
    source = AsterixRecording(secondary)
    facts = dict(source.facts())
    assert facts["records"] == "CAT-034 16,366, CAT-048 3,541"
    assert facts["north marks"] == "495"
    assert source.radar.rotation == pytest.approx(7.633, abs=0.001)
    assert source.skipped == {}
    found = np.concatenate([s.centroids for s in source.sectors()])
    assert sorted(found["ordinal"].tolist()) == list(range(3541))
    assert found["range"].min() > 54 * NM
    assert found["range"].max() < 256 * NM
    for before, after in itertools.pairwise(source.sectors()):
        assert after.begin == before.end
        assert after.start == before.stop


def test_the_beam_of_the_marks_is_where_the_reports_are(secondary):
    source = AsterixRecording(secondary)
    off = [
        wrap(s.centroids["azimuth"] - np.interp(s.centroids["time"], [s.start, s.stop], [s.begin, s.end]))
        for s in source.sectors()
        if len(s.centroids)
    ]
    # Time in 1/128 s is 0.37° of this antenna, of the mark and of the report.
    assert np.quantile(np.abs(np.concatenate(off)), 0.99) < 0.75 * DEG


def test_without_its_marks_the_same_rotation_and_beam(secondary, tmp_path):
    whole = AsterixRecording(secondary)
    kept = [(d.time - DAY_START, d.data) for d in frames.read(secondary).datagrams if d.data[0] == 48]
    alone = AsterixRecording(write_pcap(tmp_path / "a.pcap", kept))
    assert alone.radar.rotation == pytest.approx(7.633, abs=0.05)
    assert alone.skipped == {}
    ours = np.concatenate([s.centroids for s in alone.sectors()])
    theirs = np.concatenate([s.centroids for s in whole.sectors()])
    assert np.sort(ours, order="ordinal").tobytes() == np.sort(theirs, order="ordinal").tobytes()
    # The same turn for every report: the two sequences differ only where two are nearly abreast.
    assert np.abs(np.argsort(ours["ordinal"]) - np.argsort(theirs["ordinal"])).max() <= 2


def test_seven_radars_that_come_twice(several):
    contents = reports.read(several)
    assert len(contents.stations) == 7
    assert contents.copies == 81
    assert contents.records.total() == 81
    with pytest.raises(InputError, match="target reports of 7 radars"):
        AsterixRecording(several)
    source = AsterixRecording(several, (25, 12))
    assert sum(len(s.centroids) for s in source.sectors()) == 19
    assert source.radar.site is not None


def test_system_tracks_are_no_target_reports(recording):
    with pytest.raises(InputError, match="expected CAT-048 records, found 10,503 blocks of CAT-062"):
        AsterixRecording(recording("asterix/fds260429.pcap"))


@pytest.mark.parametrize(("name", "every"), [("asterix/260429.pcap", 20), ("asterix/cat_034_048.pcap", 1)])
def test_every_item_is_that_of_libasterix(recording, name, every):
    from asterix import base, generated

    theirs = {34: generated.Cat_034_1_29.cv_uap.cv_record, 48: generated.Cat_048_1_32.cv_uap.cv_record}
    profiles = {34: CAT_034, 48: CAT_048}
    readers = {category: Reader(uap) for category, uap in profiles.items()}
    compared = 0
    for datagram in frames.read(recording(name)).datagrams[::every]:
        for category, at, end in blocks(datagram.data, False, Counter()):
            rest = base.Bits.from_bytes(datagram.data[at:end])
            for found in readers[category].records(datagram.data, at, end):
                expected, rest = theirs[category].parse(base.ParsingMode.StrictParsing, rest)
                for item, _ in profiles[category]:
                    value = expected.get_item(item)
                    assert found.get(item) == (None if value is None else value.unparse().to_bytes())
                compared += 1
            assert len(rest) == 0
    assert compared >= 162


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
def test_positions_and_times_are_those_of_tshark(secondary):
    fields = ["asterix.048_040_RHO", "asterix.048_040_THETA", "asterix.048_140_VALUE"]
    out = subprocess.run(
        [
            "tshark",
            "-r",
            str(secondary),
            "-d",
            "udp.port==4001,asterix",
            "-Y",
            "asterix.category==48",
            "-T",
            "fields",
        ]
        + [word for field in fields for word in ("-e", field)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    expected = np.array([line.split("\t") for line in out.splitlines()], float)
    table = reports.read(secondary).stations[226, 232].report_table()
    np.testing.assert_allclose(table["rho"] / 256, expected[:, 0], atol=1e-6)
    np.testing.assert_allclose(table["theta"] * 360 / 65536, expected[:, 1], atol=1e-6)
    np.testing.assert_allclose(table["time_of_day"] / 128, expected[:, 2], atol=1e-6)
