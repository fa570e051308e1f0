"""Datagrams come out of every kind of capture; what is cut off or foreign is said."""

import math
import struct
from io import BytesIO

import dpkt
import pytest
from asterix_bytes import DAY_START, block, ethernet, pcap_bytes, report, udp

from radar_console.asterix import frames
from radar_console.core.errors import InputError

PAYLOAD = block(48, report(10.0))


def read(tmp_path, data):
    file = tmp_path / "recording.any"
    file.write_bytes(data)
    return frames.read(file)


@pytest.mark.parametrize(
    ("magic", "order", "ticks"),
    [
        (0xA1B2C3D4, "<", 1e6),
        (0xA1B2C3D4, ">", 1e6),
        (0xA1B23C4D, "<", 1e9),
        (0xA1B23C4D, ">", 1e9),
    ],
)
def test_pcap_in_every_byte_order_and_resolution(tmp_path, magic, order, ticks):
    packet = ethernet(PAYLOAD)
    data = struct.pack(order + "IHHIIII", magic, 2, 4, 0, 0, 65535, 1)
    data += struct.pack(order + "4I", 100, int(0.25 * ticks), len(packet), len(packet)) + packet
    found = read(tmp_path, data)
    assert found.datagrams == [frames.Datagram(100.25, PAYLOAD)]


def test_pcapng(tmp_path):
    file = BytesIO()
    writer = dpkt.pcapng.Writer(file)
    for i in range(3):
        writer.writepkt(ethernet(PAYLOAD), ts=DAY_START + i)
    found = read(tmp_path, file.getvalue())
    assert found.format == "pcapng"
    assert [d.data for d in found.datagrams] == [PAYLOAD] * 3
    assert [d.time - DAY_START for d in found.datagrams] == [0, 1, 2]


def with_link(link, packet):
    return (
        struct.pack("<IHHIIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, link)
        + struct.pack("<4I", 1, 0, len(packet), len(packet))
        + packet
    )


IP = bytes(udp(PAYLOAD))
IP6 = bytes(
    dpkt.ip6.IP6(
        src=b"\1" * 16,
        dst=b"\2" * 16,
        nxt=17,
        plen=8 + len(PAYLOAD),
        data=dpkt.udp.UDP(dport=1, data=PAYLOAD, ulen=8 + len(PAYLOAD)),
    )
)
MAC = b"\1\2\3\4\5\6" * 2


@pytest.mark.parametrize(
    ("link", "packet"),
    [
        (1, MAC + b"\x08\x00" + IP),
        (1, MAC + b"\x81\x00\x00\x05\x08\x00" + IP),
        (1, MAC + b"\x88\xa8\x00\x05\x81\x00\x00\x05\x86\xdd" + IP6),
        (113, bytes(14) + b"\x08\x00" + IP),
        (276, b"\x08\x00" + bytes(18) + IP),
        (101, IP),
        (101, IP6),
        (0, b"\2\0\0\0" + IP),
    ],
)
def test_link_layers(tmp_path, link, packet):
    found = read(tmp_path, with_link(link, packet))
    assert [d.data for d in found.datagrams] == [PAYLOAD]
    assert not found.skipped


def test_bytes_after_the_datagram_are_padding_of_the_link(tmp_path):
    found = read(tmp_path, with_link(1, MAC + b"\x08\x00" + IP + bytes(20)))
    assert found.datagrams == [frames.Datagram(1.0, PAYLOAD)]


@pytest.mark.parametrize(
    ("link", "packet", "reason"),
    [
        (1, MAC + b"\x08\x06" + bytes(40), "packets other than IP"),
        (1, MAC + b"\x08\x00" + IP[:6] + b"\x20\x00" + IP[8:], "packets that are IP fragments"),
        (1, MAC + b"\x08\x00" + IP[:9] + b"\x06" + IP[10:], "packets other than UDP"),
        (147, bytes(60), "packets of link type 147"),
        (101, b"\x45" + bytes(10), "IP packets with a broken header"),
        (101, b"", "IP packets with a broken header"),
    ],
)
def test_foreign_packets_are_counted(tmp_path, link, packet, reason):
    found = read(tmp_path, with_link(link, packet))
    assert found.datagrams == []
    assert found.skipped == {reason: 1}


def test_a_file_cut_off_anywhere_keeps_the_whole_packets(tmp_path):
    data = pcap_bytes([(i, PAYLOAD) for i in range(3)])
    size = (len(data) - 24) // 3
    for end in range(25, len(data)):
        whole = (end - 24) // size
        try:
            found = read(tmp_path, data[:end])
        except InputError:
            assert whole == 0
            continue
        kept = [d for d in found.datagrams if not d.cut]
        assert [d.data for d in kept] == [PAYLOAD] * whole
        rest = (end - 24) % size
        assert (rest > 0) == (len(found.datagrams) > whole or found.skipped.total() > 0)


def test_a_broken_packet_header_ends_the_reading_and_is_counted(tmp_path):
    data = pcap_bytes([(0, PAYLOAD)]) + b"\xff" * 100
    found = read(tmp_path, data)
    assert len(found.datagrams) == 1
    assert found.skipped == {"bytes after a broken packet header": 100}


def test_bare_blocks(tmp_path):
    found = read(tmp_path, PAYLOAD * 4)
    assert found.format == "ASTERIX blocks"
    assert found.datagrams[0].data == PAYLOAD * 4
    assert math.isnan(found.datagrams[0].time)


def test_final_format(tmp_path):
    def frame(time):
        size = len(PAYLOAD) + 12
        head = size.to_bytes(2, "big") + b"\0\1\2" + round(time * 100).to_bytes(3, "big")
        return head + PAYLOAD + b"\xa5" * 4

    found = read(tmp_path, frame(10.0) + frame(11.5) + b"\0\1")
    assert found.datagrams == [frames.Datagram(10.0, PAYLOAD), frames.Datagram(11.5, PAYLOAD)]
    assert found.skipped == {"bytes after the last whole frame": 2}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"time_s,range_m,azimuth_deg\n1,2,3\n" * 10, "byte 0: starts with 74 69 6d 65"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "starts with 89 50 4e 47"),
        (b'"a","b"\n0.5,1\n' * 30, "starts with 22 61"),
        (b"\xd4\xc3\xb2\xa1\x02\x00", "cut off inside the header"),
        (b"\xd4\xc3\xb2\xa1" + bytes(20), "without packets"),
    ],
)
def test_another_kind_of_file_is_one_sentence(tmp_path, data, words):
    with pytest.raises(InputError, match=words) as error:
        read(tmp_path, data)
    assert "expected" in str(error.value)
    assert "recording.any" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="can't be read"):
        frames.read(tmp_path / "none.pcap")
