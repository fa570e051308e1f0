"""Datagrams out of a recording: pcap, pcapng, the IOSS "final" format, or bare ASTERIX blocks.

What a file is, is told by its content, never by its name. The pcap formats are read here and not
by a library because a file that was cut off, or that has several interfaces, must still give every
whole datagram and a count of the rest.
"""

import struct
from collections import Counter
from dataclasses import dataclass, field
from math import nan
from pathlib import Path

from radar_console.asterix.blocks import is_asterix
from radar_console.core.errors import InputError

EXPECTED = "expected a network capture (pcap, pcapng) or bare ASTERIX blocks"
LARGEST_PACKET = 1 << 18  # bytes; libpcap's own limit

_PCAP = {  # magic number as it lies in the file → byte order, ticks a second
    b"\xd4\xc3\xb2\xa1": ("<", 1e6),
    b"\xa1\xb2\xc3\xd4": (">", 1e6),
    b"\x4d\x3c\xb2\xa1": ("<", 1e9),
    b"\xa1\xb2\x3c\x4d": (">", 1e9),
}
_PCAPNG = b"\x0a\x0d\x0d\x0a"
_FINAL_END = b"\xa5\xa5\xa5\xa5"


@dataclass(frozen=True, slots=True)
class Datagram:
    """What one datagram carried.

    Attributes
    ----------
    time : capture time, s since 1970 (of "final": of the day); NaN where the file has none
    data : the payload
    cut : bytes are missing at its end
    """

    time: float
    data: bytes
    cut: bool = False


@dataclass(slots=True)
class Frames:
    """A recording's datagrams in the order of the file.

    Attributes
    ----------
    format : what the file is
    datagrams : in the order of the file
    skipped : what carried none, counted by reason
    """

    format: str
    datagrams: list[Datagram] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)


def read(file: Path) -> Frames:
    """Read a whole recording.

    Raises
    ------
    InputError   the file can't be read, is empty, or is of another kind
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(file, "", f"can't be read: {error.strerror}") from error
    if not data:
        raise InputError(file, "", f"is empty; {EXPECTED}")
    if data[:4] in _PCAP:
        return _pcap(data, file)
    if data[:4] == _PCAPNG:
        return _pcapng(data, file)
    if _is_final(data):
        return _final(data)
    if is_asterix(data):
        return Frames("ASTERIX blocks", [Datagram(nan, data, cut=True)])
    raise InputError(file, "byte 0", f"starts with {data[:4].hex(' ')}; {EXPECTED}")


def _pcap(data: bytes, file: Path) -> Frames:
    frames = Frames("pcap")
    order, ticks = _PCAP[data[:4]]
    if len(data) < 24:
        raise InputError(file, f"byte {len(data)}", "cut off inside the header; expected a pcap file")
    link = struct.unpack_from(order + "I", data, 20)[0] & 0xFFFF
    header = struct.Struct(order + "4I")
    at, packets = 24, 0
    while at + 16 <= len(data):
        seconds, fraction, size, original = header.unpack_from(data, at)
        if size > LARGEST_PACKET:
            frames.skipped["bytes after a broken packet header"] += len(data) - at
            return _checked(frames, packets, file)
        packet = data[at + 16 : at + 16 + size]
        whole = len(packet) == size and size >= original
        _add(frames, link, seconds + fraction / ticks, packet, whole)
        at += 16 + size
        packets += 1
    if at < len(data):
        frames.skipped["bytes of a cut-off packet header"] += len(data) - at
    return _checked(frames, packets, file)


def _pcapng(data: bytes, file: Path) -> Frames:
    """Blocks of type, length, body, length; see draft-ietf-opsawg-pcapng."""
    frames = Frames("pcapng")
    order, at, packets = "<", 0, 0
    interfaces: list[tuple[int, float, float]] = []  # link type, ticks a second, offset s
    while at + 12 <= len(data):
        if data[at : at + 4] == _PCAPNG:
            order = "<" if data[at + 8 : at + 12] == b"\x4d\x3c\x2b\x1a" else ">"
            interfaces = []
        kind, size = struct.unpack_from(order + "2I", data, at)
        if size < 12 or size % 4:
            frames.skipped["bytes after a broken block header"] += len(data) - at
            return _checked(frames, packets, file)
        body = data[at + 8 : min(at + size - 4, len(data))]
        if kind == 1 and len(body) >= 8:
            interfaces.append(_interface(body, order))
        elif kind in (2, 3, 6):
            packets += 1
            _add_pcapng(frames, kind, body, order, interfaces, at + size <= len(data))
        at += size
    if at < len(data):
        frames.skipped["bytes of a cut-off block header"] += len(data) - at
    return _checked(frames, packets, file)


def _interface(body: bytes, order: str) -> tuple[int, float, float]:
    link = struct.unpack_from(order + "H", body)[0]
    ticks, offset, at = 1e6, 0.0, 8
    while at + 4 <= len(body):
        code, size = struct.unpack_from(order + "2H", body, at)
        value = body[at + 4 : at + 4 + size]
        if code == 0:
            break
        if code == 9 and len(value) == 1:  # if_tsresol: a power of 2 or of 10
            ticks = float((2 if value[0] & 0x80 else 10) ** (value[0] & 0x7F))
        if code == 14 and len(value) == 8:  # if_tsoffset
            offset = float(struct.unpack(order + "q", value)[0])
        at += 4 + size + -size % 4
    return link, ticks, offset


def _add_pcapng(
    frames: Frames,
    kind: int,
    body: bytes,
    order: str,
    interfaces: list[tuple[int, float, float]],
    whole: bool,
) -> None:
    """Add an enhanced (6), simple (3) or obsolete (2) packet block."""
    header = 4 if kind == 3 else 20
    if len(body) < header:
        frames.skipped["packets cut off before their data"] += 1
        return
    fields = struct.unpack_from(order + ("I" if kind == 3 else "5I"), body)
    number = 0 if kind == 3 else fields[0] if kind == 6 else struct.unpack_from(order + "H", body)[0]
    if number >= len(interfaces):
        frames.skipped["packets of an undeclared interface"] += 1
        return
    link, ticks, offset = interfaces[number]
    time = nan if kind == 3 else offset + (fields[1] << 32 | fields[2]) / ticks
    original = fields[0] if kind == 3 else fields[4]
    size = original if kind == 3 else fields[3]
    packet = body[header : header + size]
    _add(frames, link, time, packet, whole and len(packet) >= original)


def _checked(frames: Frames, packets: int, file: Path) -> Frames:
    if not packets:
        raise InputError(
            file, "", f"a {frames.format} file without packets; expected ASTERIX in UDP datagrams"
        )
    return frames


def _is_final(data: bytes) -> bool:
    size = int.from_bytes(data[:2], "big")
    return size >= 12 and data[size - 4 : size] == _FINAL_END


def _final(data: bytes) -> Frames:
    """Frames of length (2 bytes), error, line, day, time in 10 ms (3), ASTERIX, end mark (4)."""
    frames = Frames("final")
    at = 0
    while at + 12 <= len(data):
        size = int.from_bytes(data[at : at + 2], "big")
        if size < 12:
            break
        whole = data[at + size - 4 : at + size] == _FINAL_END
        if not whole and at + size <= len(data):
            break
        time = int.from_bytes(data[at + 5 : at + 8], "big") / 100.0
        frames.datagrams.append(Datagram(time, data[at + 8 : at + size - 4], cut=not whole))
        at += size
    if at < len(data):
        frames.skipped["bytes after the last whole frame"] += len(data) - at
    return frames


def _add(frames: Frames, link: int, time: float, packet: bytes, whole: bool) -> None:
    """Add the UDP payload of a packet, or count why there is none."""
    ip = _ip_offset(link, packet)
    if isinstance(ip, str):
        frames.skipped[ip] += 1
        return
    udp = _udp(packet, ip)
    if isinstance(udp, str):
        reason = udp if whole or udp.startswith("packets") else "packets cut off before their data"
        frames.skipped[reason] += 1
        return
    start, stop = udp
    if not whole and start >= len(packet):
        frames.skipped["packets cut off before their data"] += 1
        return
    frames.datagrams.append(Datagram(time, packet[start:stop], cut=stop > len(packet)))


def _ip_offset(link: int, packet: bytes) -> int | str:
    """Where the IP header begins, or why there is none; LINKTYPE numbers are tcpdump's."""
    if link in (12, 14, 101, 228, 229):  # raw IP
        return 0
    if link in (0, 108):  # BSD loopback: 4 bytes of address family
        return 4
    if link == 1:
        at = 12
        kind = packet[at : at + 2]
        while kind in (b"\x81\x00", b"\x88\xa8", b"\x91\x00"):  # VLAN tags
            at += 4
            kind = packet[at : at + 2]
        at += 2
    elif link == 113:  # Linux cooked
        kind, at = packet[14:16], 16
    elif link == 276:  # Linux cooked, version 2
        kind, at = packet[0:2], 20
    else:
        return f"packets of link type {link}"
    return at if kind in (b"\x08\x00", b"\x86\xdd") else "packets other than IP"


def _udp(packet: bytes, at: int) -> tuple[int, int] | str:
    """Where the UDP payload at an IP header begins and ends, or why there is none."""
    version = packet[at] >> 4 if at < len(packet) else 0
    if version == 4 and at + 20 <= len(packet):
        protocol, fragment = packet[at + 9], int.from_bytes(packet[at + 6 : at + 8], "big") & 0x3FFF
        at += 4 * (packet[at] & 15)
    elif version == 6 and at + 40 <= len(packet):
        protocol, fragment = packet[at + 6], 0
        at += 40
        while protocol in (0, 43, 60) and at + 8 <= len(packet):  # extension headers
            protocol, at = packet[at], at + 8 * (packet[at + 1] + 1)
        fragment = int(protocol == 44)
    else:
        return "IP packets with a broken header"
    if fragment:
        return "packets that are IP fragments"
    if protocol != 17:
        return "packets other than UDP"
    size = int.from_bytes(packet[at + 4 : at + 6], "big")
    if at + 8 > len(packet) or size < 8:
        return "UDP datagrams with a broken header"
    return at + 8, at + size
