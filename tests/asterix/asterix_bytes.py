"""Small ASTERIX recordings for tests: records, blocks, and the files that carry them."""

import math
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path

import dpkt
import numpy as np

from radar_console.asterix.records import CAT_034, CAT_048, Uap

DAY_START = 1_700_006_400  # a UTC midnight


def record(uap: Uap, items: dict[str, bytes]) -> bytes:
    """FSPEC and items, in the order of the profile."""
    names = [name for name, _ in uap]
    last = max(names.index(name) for name in items)
    fspec = bytearray(last // 7 + 1)
    for name in items:
        fspec[names.index(name) // 7] |= 0x80 >> names.index(name) % 7
    for i in range(len(fspec) - 1):
        fspec[i] |= 1
    return bytes(fspec) + b"".join(items[name] for name in names if name in items)


def block(category: int, *records: bytes) -> bytes:
    body = b"".join(records)
    return bytes([category]) + (3 + len(body)).to_bytes(2, "big") + body


def time_of_day(time: float) -> bytes:
    return (round(time * 128) % (86400 * 128)).to_bytes(3, "big")


def report(
    time: float | None,
    rho_nm: float = 50.0,
    theta_deg: float = 90.0,
    radar: tuple[int, int] = (1, 2),
    descriptor: bytes = b"\x40",
    **items: bytes,
) -> bytes:
    """A CAT-048 record; `items` by name, such as ``i070=...``, add to it; an empty one takes away."""
    all_items = {
        "010": bytes(radar),
        "140": time_of_day(time) if time is not None else b"",
        "020": descriptor,
        "040": round(rho_nm * 256).to_bytes(2, "big")
        + (round(theta_deg / 360 * 65536) % 65536).to_bytes(2, "big"),
    } | {name.removeprefix("i"): value for name, value in items.items()}
    return record(CAT_048, {name: value for name, value in all_items.items() if value})


def mark(time: float, sector: int | None, radar: tuple[int, int] = (1, 2), **items: bytes) -> bytes:
    """A CAT-034 record: the north marker (sector None) or a sector message."""
    all_items = {"010": bytes(radar), "000": b"\x01" if sector is None else b"\x02", "030": time_of_day(time)}
    if sector is not None:
        all_items["020"] = bytes([sector])
    return record(CAT_034, all_items | {name.removeprefix("i"): value for name, value in items.items()})


def scene(
    turns: int,
    azimuths_deg: Iterable[float] = (10.0, 95.0, 200.0, 355.0),
    rotation: float = 4.0,
    start: float = 1000.0,
    marks: bool = True,
    delay: float = 0.2,
) -> list[tuple[float, bytes]]:
    """Datagrams (time of arrival, block) of a radar whose beam is north at `start`.

    Reports arrive `delay` seconds after the beam; times are multiples of 1/128 s.
    """
    sent: list[tuple[float, bytes]] = []
    for turn in range(turns):
        for azimuth in azimuths_deg:
            at = start + (turn + azimuth / 360.0) * rotation
            sent.append((at + delay, block(48, report(at, theta_deg=azimuth))))
        if marks:
            north = start + turn * rotation
            sent.append((north, block(34, mark(north, None))))
            for sector in range(0, 256, 8):
                at = north + sector / 256.0 * rotation
                sent.append((at, block(34, mark(at, sector))))
    return sorted(sent, key=lambda item: item[0])


def udp(payload: bytes, port: int = 8600) -> dpkt.ip.IP:
    datagram = dpkt.udp.UDP(sport=port, dport=port, data=payload, ulen=8 + len(payload))
    return dpkt.ip.IP(src=b"\x0a\0\0\1", dst=b"\xef\0\0\1", p=17, data=datagram)


def ethernet(payload: bytes) -> bytes:
    return bytes(dpkt.ethernet.Ethernet(data=udp(payload), type=0x0800))


def pcap_bytes(datagrams: Iterable[tuple[float, bytes]]) -> bytes:
    """A pcap file of UDP datagrams captured at seconds after `DAY_START`."""
    file = BytesIO()
    writer = dpkt.pcap.Writer(file)
    for time, payload in datagrams:
        writer.writepkt(ethernet(payload), ts=DAY_START + time)
    return file.getvalue()


def write_pcap(file: Path, datagrams: Iterable[tuple[float, bytes]]) -> Path:
    file.write_bytes(pcap_bytes(datagrams))
    return file


def write_ast(file: Path, datagrams: Iterable[tuple[float, bytes]]) -> Path:
    file.write_bytes(b"".join(payload for _, payload in datagrams))
    return file


def turn_angle(angle: float) -> float:
    """An angle in [0, 2π)."""
    return float(np.mod(angle, math.tau))
