"""What a recording says, radar by radar: CAT-048 target reports and CAT-034 antenna marks."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from radar_console.asterix import frames
from radar_console.asterix.blocks import blocks
from radar_console.asterix.records import CAT_034, CAT_048, Items, Reader
from radar_console.core.messages import Site, Table

TICKS = 128.0  # of a time of day, a second
_INCOMPLETE = "CAT-034 messages without a type or a sector"
REMEMBERED = 4096  # records among which the second copy of a record is looked for

# -1 stands where an item is missing.
REPORT = np.dtype(
    [
        ("captured", "f8"),  # s; NaN unknown
        ("sequence", "i8"),  # number of the record in the file
        ("time_of_day", "i8"),  # I048/140, 1/128 s
        ("descriptor", "i8"),  # I048/020, first byte
        ("test", "?"),  # I048/020 TST
        ("rho", "i8"),  # I048/040, 1/256 NM
        ("theta", "i8"),  # 1/65536 turn
        ("mode_3a", "i8"),  # I048/070, all 16 bits
        ("level", "i8"),  # I048/090, all 16 bits
        ("address", "i8"),  # I048/220
    ]
)
MARK = np.dtype(
    [
        ("captured", "f8"),
        ("sequence", "i8"),
        ("time_of_day", "i8"),  # I034/030, 1/128 s
        ("sector", "i8"),  # I034/020, 1/256 turn; of the north marker 0
    ]
)


@dataclass(slots=True)
class Station:
    """One radar of a recording.

    Attributes
    ----------
    reports, marks : rows REPORT and MARK, in the order of the file
    norths : how many of the marks are north markers
    others : CAT-034 messages that are no marks, by what they are
    period : the rotation time that the radar states, s (I034/041); None if it does not
    site : where it says it stands (I034/120)
    """

    reports: list[tuple[float, int, int, int, bool, int, int, int, int, int]] = field(default_factory=list)
    marks: list[tuple[float, int, int, int]] = field(default_factory=list)
    norths: int = 0
    others: Counter[str] = field(default_factory=Counter)
    period: float | None = None
    site: Site | None = None

    def report_table(self) -> Table:
        """The reports as a table REPORT."""
        return np.array(self.reports, REPORT)

    def mark_table(self) -> Table:
        """The marks as a table MARK."""
        return np.array(self.marks, MARK)


@dataclass(slots=True)
class Contents:
    """All that was read.

    Attributes
    ----------
    format : of the file
    stations : by (SAC, SIC)
    records : how many records were read, by category
    skipped : what could not be read or was not wanted, counted by reason
    copies : how many records were received a second time
    """

    format: str
    stations: dict[tuple[int, int], Station] = field(default_factory=dict)
    records: Counter[int] = field(default_factory=Counter)
    skipped: Counter[str] = field(default_factory=Counter)
    copies: int = 0


def read(file: Path) -> Contents:
    """Read a recording.

    Raises
    ------
    InputError   the file can't be read or holds no ASTERIX datagrams
    """
    found = frames.read(file)
    contents = Contents(found.format, skipped=found.skipped)
    readers = {34: Reader(CAT_034), 48: Reader(CAT_048)}
    recent: set[Copy] = set()
    older: set[Copy] = set()
    sequence = 0
    for datagram in found.datagrams:
        for category, at, end in blocks(datagram.data, datagram.cut, contents.skipped):
            reader = readers.get(category)
            if reader is None:
                contents.skipped[f"blocks of CAT-{category:03d}"] += 1
                contents.skipped[f"bytes in blocks of CAT-{category:03d}"] += end - at
                continue
            for items in reader.records(datagram.data, at, end):
                if isinstance(items, tuple):
                    reason, count = items
                    contents.skipped[f"CAT-{category:03d} {reason}"] += 1
                    contents.skipped[f"bytes after the last good CAT-{category:03d} record of a block"] += (
                        count
                    )
                    continue
                copy = (category, tuple(items.items()))
                if ("140" in items or "030" in items) and (copy in recent or copy in older):
                    contents.copies += 1
                    continue
                recent.add(copy)
                if len(recent) >= REMEMBERED:
                    older, recent = recent, set()
                contents.records[category] += 1
                _add(contents, category, items, sequence, datagram.time)
                sequence += 1
    if contents.copies:
        contents.skipped["records received a second time"] = contents.copies
    return contents


Copy = tuple[int, tuple[tuple[str, bytes], ...]]


def _add(contents: Contents, category: int, items: Items, sequence: int, captured: float) -> None:
    source = items.get("010")
    if source is None:
        contents.skipped[f"CAT-{category:03d} records without SAC/SIC"] += 1
        return
    station = contents.stations.setdefault((source[0], source[1]), Station())
    if category == 48:
        _add_report(station, items, sequence, captured)
    else:
        _add_message(station, items, sequence, captured)


def _add_report(station: Station, items: Items, sequence: int, captured: float) -> None:
    number = int.from_bytes
    get = items.get
    descriptor = get("020")
    position = get("040")
    time, code, level, address = get("140"), get("070"), get("090"), get("220")
    station.reports.append(
        (
            captured,
            sequence,
            -1 if time is None else number(time, "big"),
            -1 if descriptor is None else descriptor[0],
            descriptor is not None and len(descriptor) > 1 and descriptor[1] >= 0x80,
            -1 if position is None else number(position[:2], "big"),
            -1 if position is None else number(position[2:], "big"),
            -1 if code is None else number(code, "big"),
            -1 if level is None else number(level, "big"),
            -1 if address is None else number(address, "big"),
        )
    )


def _add_message(station: Station, items: Items, sequence: int, captured: float) -> None:
    kind = items["000"][0] if "000" in items else -1
    if "041" in items:
        station.period = int.from_bytes(items["041"], "big") / TICKS or station.period
    if "120" in items:
        station.site = _site(items["120"])
    time, sector = items.get("030"), items.get("020")
    if kind not in (1, 2) or (kind == 2 and sector is None):
        station.others[f"CAT-034 messages of type {kind}" if kind not in (-1, 2) else _INCOMPLETE] += 1
        return
    station.norths += kind == 1
    station.marks.append(
        (
            captured,
            sequence,
            -1 if time is None else int.from_bytes(time, "big"),
            sector[0] if kind == 2 and sector is not None else 0,
        )
    )


def _site(position: bytes) -> Site:
    """I034/120: height in m, latitude and longitude in 180/2²³ degrees, all signed."""
    step = 180.0 / (1 << 23)
    height, latitude, longitude = (
        int.from_bytes(position[a:b], "big", signed=True) for a, b in ((0, 2), (2, 5), (5, 8))
    )
    return Site(latitude * step, longitude * step, float(height))
