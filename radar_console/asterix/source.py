"""An ASTERIX recording as a source of sectors.

The recording is read as a whole, and every report is put where its azimuth and time say that the
beam was. So no report comes late: `complete` of a sector is its end. The beam comes from CAT-034
north markers and sector messages; without them it is inferred from the reports' times and
azimuths. Times are seconds since UTC midnight of the first record's day and run on past 86,400.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radar_console.asterix import reports
from radar_console.asterix.clock import steady, unwrap_days
from radar_console.asterix.reports import TICKS, Contents
from radar_console.core.errors import InputError
from radar_console.core.geometry import Array, unwrap_near, wrap
from radar_console.core.messages import CENTROID, Radar, Sector, Table, blank
from radar_console.core.rotation import (
    SHORTEST_TURN,
    Encoder,
    encoder_of_marks,
    encoder_of_reports,
    infer_rotation,
    rotation_of_marks,
)
from radar_console.core.sweep import LONGEST_SILENCE, cut, first_turn, stated
from radar_console.core.units import DAY, DEG, FLIGHT_LEVEL, NM, TURN

# Where nobody states them: a monopulse secondary radar. On a recorded one the third differences of
# range gave 2.5 m and of azimuth 0.04°; the range has room for what a flat model gets wrong.
SD_RANGE = 50.0  # m
SD_AZIMUTH = 0.05 * DEG

BACK = 0.5  # s; antenna marks that step back further are a clock set back
LATE = 30.0  # s; reports of a recording without marks may be out of order by so much
OFF_CLOCK = 2.0  # turns that a report may lie before or after the marks around it in the file
OFF_BEAM = 90.0 * DEG  # a report's azimuth may be so far from the beam at its time
SCALES = (5, 10, 20, 40, 60, 80, 100, 120, 150, 200, 250, 300, 400, 512)  # NM, of a display

_NO_DETECTION, _SIMULATED, _TEST_TARGET, _RAB = 0xE0, 0x10, 0x80, 0x02


@dataclass(frozen=True, slots=True, eq=False)
class _Beam:
    """The antenna, and the times that go with it."""

    encoder: Encoder
    source: str  # where the rotation comes from
    marks: Array  # unwrapped angles of the marks


class AsterixRecording:
    """A recorded radar; implements `pipeline.Source`.

    A centroid's `ordinal` is the number, from 0, of its report among all CAT-048 target reports of
    this radar in the file, in the order of the file and whether or not they are used; the second
    copy of a report that came twice has no number.

    Parameters
    ----------
    file : pcap, pcapng, IOSS final or bare ASTERIX
    sac_sic : which radar; needed where several have target reports
    radar, given : what a configuration states, and its keys such as ``radar.sd_range_m``; the rest is
        measured

    Raises
    ------
    InputError   the file is of another kind, holds no target reports of the radar, or several radars
        and none is chosen, or the rotation can't be told

    Attributes
    ----------
    radar, duration, skipped : of `pipeline.Source`; `skipped` is complete from the start
    noted : what was mended or is worth knowing, counted; nothing of it was lost
    epoch : UTC midnight of the first record's day; None if the file keeps no capture times
    """

    epoch: datetime | None

    def __init__(
        self,
        file: Path,
        sac_sic: tuple[int, int] | None = None,
        radar: Radar | None = None,
        given: frozenset[str] = frozenset(),
    ) -> None:
        self.file = file
        self._contents = reports.read(file)
        self.skipped: dict[str, int] = self._contents.skipped
        self.noted: Counter[str] = Counter()
        self.sac_sic = _choose(file, self._contents, sac_sic)
        self._station = self._contents.stations[self.sac_sic]
        for key, other in self._contents.stations.items():
            if key != self.sac_sic:
                self._skip(f"reports of radar {_name(key)}", len(other.reports))
                self._skip(f"CAT-034 messages of radar {_name(key)}", len(other.marks) + other.others.total())
        for reason, count in self._station.others.items():
            self._skip(reason, count)

        known = stated(radar, given)
        table, ordinal = self._usable(self._station.report_table())
        marks = self._station.mark_table()
        timed = (marks["time_of_day"] >= 0) & (marks["time_of_day"] < DAY * TICKS)
        self._skip("antenna marks without a time of day", int(np.sum(~timed)))
        time, self._beam, fits = self._timed(table, marks[timed], known.get("rotation"))
        table, ordinal, time = table[fits], ordinal[fits], time[fits]

        measured = Radar(
            name=_name(self.sac_sic, "SAC {} SIC {}"),
            rotation=self._beam.encoder.rotation,
            max_range=_round_scale(float(table["rho"].max()) / 256.0) * NM if len(table) else 100.0 * NM,
            sd_range=SD_RANGE,
            sd_azimuth=SD_AZIMUTH,
            site=self._station.site,
        )
        self.radar = replace(measured, **known)
        self._centroids = _centroids(table, ordinal, time, self.radar)
        self._place()

    def sectors(self) -> Iterator[Sector]:
        """Every sector from the beginning; 64 a turn."""
        return cut(self.radar, self._encoder, self._centroids, self._angle, self._active)

    def facts(self) -> list[tuple[str, str]]:
        """Label and value, for the user."""
        table, contents = self._centroids, self._contents
        codes = np.unique(table["mode_3a"][table["mode_3a"] >= 0])
        facts = [
            ("format", contents.format),
            ("records", ", ".join(f"CAT-{c:03d} {n:,}" for c, n in sorted(contents.records.items()))),
            *(
                (f"radar {_name(key)}", f"{len(s.reports):,} target reports, {len(s.marks):,} antenna marks")
                for key, s in sorted(contents.stations.items())
            ),
            ("chosen", self.radar.name),
            ("date", f"{self.epoch:%Y-%m-%d} UTC" if self.epoch else "not stated"),
            ("time", f"{_clock(self._span[0])} to {_clock(self._span[1])}, {self.duration:,.0f} s"),
            ("rotation", f"{self.radar.rotation:.3f} s, from {self._beam.source}"),
            ("north marks", f"{self._station.norths:,}"),
            ("reports used", f"{len(table):,}"),
        ]
        if len(table):
            low, high = table["range"].min() / NM, table["range"].max() / NM
            facts.append(("range", f"{low:.1f} to {high:.1f} NM, scale {self.radar.max_range / NM:.0f} NM"))
        site = self.radar.site
        facts += [
            ("codes", f"{len(codes)} Mode 3/A"),
            ("site", f"{site.latitude_deg:.5f}, {site.longitude_deg:.5f}" if site else "not stated"),
        ]
        facts += [("noted", f"{count:,} {what}") for what, count in sorted(self.noted.items())]
        return facts + [("skipped", f"{count:,} {why}") for why, count in sorted(self.skipped.items())]

    def _skip(self, reason: str, count: int) -> None:
        if count:
            self.skipped[reason] = self.skipped.get(reason, 0) + count

    def _usable(self, table: Table) -> tuple[Table, NDArray[np.int64]]:
        """The reports that are a live detection with a time and a place, and their ordinals."""
        ordinal = np.arange(len(table))
        known, first = table["descriptor"] >= 0, table["descriptor"]
        reasons = [
            ("simulated reports (SIM)", known & (first & _SIMULATED > 0)),
            ("test target reports (TST)", table["test"]),
            ("field monitor reports (RAB)", known & (first & _RAB > 0)),
            ("reports without a detection (TYP 0)", known & (first & _NO_DETECTION == 0)),
            ("reports without a measured position", table["rho"] < 0),
            (
                "reports without a valid time of day",
                (table["time_of_day"] < 0) | (table["time_of_day"] >= DAY * TICKS),
            ),
        ]
        keep = np.ones(len(table), bool)
        for reason, bad in reasons:
            self._skip(reason, int(np.sum(bad & keep)))
            keep &= ~bad
        return table[keep], ordinal[keep]

    def _timed(
        self, table: Table, marks: Table, rotation: float | None
    ) -> tuple[Array, _Beam, NDArray[np.bool_]]:
        """The reports' unwrapped times, the beam, and which reports fit it."""
        both = np.concatenate((marks["sequence"], table["sequence"]))
        if not len(both):
            raise InputError(self.file, "", f"radar {_name(self.sac_sic)} has no usable target reports")
        order = np.argsort(both)
        day_time = np.concatenate((marks["time_of_day"], table["time_of_day"])) / TICKS
        captured = np.concatenate((marks["captured"], table["captured"]))
        unwrapped = np.empty(len(both))
        unwrapped[order] = unwrap_days(day_time[order], captured[order])
        self.epoch = _epoch(captured, unwrapped)
        mark_time, time = unwrapped[: len(marks)], unwrapped[len(marks) :]
        azimuth = table["theta"] / 65536.0 * TURN
        if len(marks) >= 2:
            return self._timed_by_marks(table, time, azimuth, marks, mark_time, rotation)

        steadied, kept, jumps = steady(time, LATE, LATE * LONGEST_SILENCE)
        self._note("times of day set back (later times moved on)", jumps)
        self._note_late(steadied[kept])
        self._skip("reports with a stray time of day", int(np.sum(~kept)))
        rotation, source = self._rotation(rotation, None, steadied[kept], azimuth[kept])
        encoder = encoder_of_reports(steadied[kept], azimuth[kept], rotation)
        fits = kept & (np.abs(wrap(azimuth - encoder.angle_at(steadied))) <= OFF_BEAM)
        self._skip("reports whose time of day does not fit their azimuth", int(np.sum(kept & ~fits)))
        return steadied, _Beam(encoder, source, np.empty(0)), fits

    def _timed_by_marks(
        self,
        table: Table,
        time: Array,
        azimuth: Array,
        marks: Table,
        mark_time: Array,
        rotation: float | None,
    ) -> tuple[Array, _Beam, NDArray[np.bool_]]:
        mark_azimuth = marks["sector"] / 256.0 * TURN
        guess = rotation or rotation_of_marks(mark_time, mark_azimuth) or self._station.period or 10.0
        steadied, kept, jumps = steady(mark_time, BACK, LONGEST_SILENCE * guess)
        self._note("times of day set back (later times moved on)", jumps)
        self._skip("antenna marks with a stray time of day", int(np.sum(~kept)))
        # A report follows the clock of the mark before it in the file.
        sequence, moved = marks["sequence"][kept], (steadied - mark_time)[kept]
        before = np.maximum(np.searchsorted(sequence, table["sequence"]) - 1, 0)
        time = np.asarray(time + moved[before])
        mark_time, mark_azimuth = steadied[kept], mark_azimuth[kept]
        rotation, source = self._rotation(rotation, rotation_of_marks(mark_time, mark_azimuth), time, azimuth)
        encoder, strays = encoder_of_marks(mark_time, mark_azimuth, rotation)
        self._skip("antenna marks that do not fit their neighbours", strays)

        after = np.minimum(before + 1, len(mark_time) - 1)
        lateness = np.median(time - mark_time[before]) if len(time) else 0.0
        clock = time - lateness
        room = OFF_CLOCK * rotation
        # Where marks are missing, the clock is only known to lie between those around the hole.
        on_clock = (clock >= mark_time[before] - room) & (
            (clock <= mark_time[after] + room) | (before == after) | (table["sequence"] < sequence[0])
        )
        self._skip("reports with a stray time of day", int(np.sum(~on_clock)))
        off = wrap(azimuth - encoder.angle_at(time))
        usual = float(np.median(off[on_clock])) if on_clock.any() else 0.0
        fits = on_clock & (np.abs(wrap(off - usual)) <= OFF_BEAM)
        self._skip("reports whose time of day does not fit their azimuth", int(np.sum(on_clock & ~fits)))
        self._note_late(time[fits])
        return time, _Beam(encoder, source, encoder.angle_at(mark_time)), fits

    def _rotation(
        self, given: float | None, marked: float | None, time: Array, azimuth: Array
    ) -> tuple[float, str]:
        """The time of one turn, s, and where it comes from."""
        if given is not None:
            return given, "the configuration"
        if marked is not None:
            return marked, "north and sector marks"
        if self._station.period is not None and self._station.period >= SHORTEST_TURN:
            return self._station.period, "the stated rotation period (I034/041)"
        inferred = infer_rotation(time, azimuth)
        if inferred is None:
            raise InputError(
                self.file,
                f"radar {_name(self.sac_sic)}",
                "the rotation can't be told from its marks nor from the reports' times and azimuths; "
                "expected rotation_s in the [radar] table of a configuration",
            )
        return inferred, "times and azimuths of the reports"

    def _note(self, what: str, count: int) -> None:
        if count:
            self.noted[what] += count

    def _note_late(self, time: Array) -> None:
        if len(time):
            late = int(np.sum(time < np.maximum.accumulate(time) - BACK))
            self._note("reports more than 0.5 s behind an earlier one (kept, put in order)", late)

    def _place(self) -> None:
        """Give every report its unwrapped angle, counting turns from the first activity."""
        encoder = self._beam.encoder
        angle = unwrap_near(self._centroids["azimuth"], encoder.angle_at(self._centroids["time"]))
        active = np.concatenate((self._beam.marks, angle))
        turns = first_turn(encoder, active)
        self._encoder = encoder.shifted(turns)
        self._angle, self._active = angle + turns * TURN, active + turns * TURN
        first, last = self._encoder.time_at(np.array([self._active.min(), self._active.max()])).tolist()
        self._span, self.duration = (first, last), last - first


def _choose(file: Path, contents: Contents, wanted: tuple[int, int] | None) -> tuple[int, int]:
    """The radar to read: the one wanted, or the only one that has target reports."""
    with_reports = {key: len(s.reports) for key, s in contents.stations.items() if s.reports}
    listed = ", ".join(
        f"{_name(key)} ({count:,})" for key, count in sorted(with_reports.items(), key=lambda item: -item[1])
    )
    if not with_reports:
        found = ", ".join(
            f"{count:,} {why}" for why, count in contents.skipped.most_common() if "bytes" not in why
        )
        raise InputError(
            file,
            "",
            f"a {contents.format} file without target reports; expected CAT-048 records"
            + (f", found {found}" if found else ""),
        )
    if wanted is not None:
        if wanted not in with_reports:
            raise InputError(
                file, "", f"no target reports of radar {_name(wanted)}; expected one of {listed}"
            )
        return wanted
    if len(with_reports) > 1:
        raise InputError(
            file,
            "",
            f"target reports of {len(with_reports)} radars; expected a choice (--radar SAC/SIC): {listed}",
        )
    return next(iter(with_reports))


def _epoch(captured: Array, time: Array) -> datetime | None:
    """The midnight from which `time` counts, by the capture times since 1970 (of at least half of all)."""
    dated = captured > DAY  # a format that keeps the time of day only does not know its date
    if 2 * np.sum(dated) < len(captured) or not len(captured):
        return None
    days = round(float(np.median(captured[dated] - time[dated])) / DAY)
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=days)


def _name(key: tuple[int, int], form: str = "{}/{}") -> str:
    return form.format(*key)


def _clock(time: float) -> str:
    days, rest = divmod(time, DAY)
    hours, rest = divmod(rest, 3600.0)
    minutes, seconds = divmod(rest, 60.0)
    text = f"{hours:02.0f}:{minutes:02.0f}:{int(seconds):02d}"
    return text + (f" (+{days:.0f} d)" if days else "")


def _round_scale(range_nm: float) -> float:
    return float(next((scale for scale in SCALES if scale >= range_nm), SCALES[-1]))


def _centroids(table: Table, ordinal: NDArray[np.int64], time: Array, radar: Radar) -> Table:
    """Reports as centroids.

    A code or flight level counts only when it is validated and not garbled. The flight level's
    pressure altitude is taken as the height.
    """
    rows = blank(CENTROID, len(table))
    rows["ordinal"] = ordinal
    rows["time"] = time
    rows["range"] = table["rho"] / 256.0 * NM
    rows["azimuth"] = table["theta"] / 65536.0 * TURN
    level = table["level"]
    quarter = (level & 0x3FFF) - ((level & 0x2000) << 1)
    rows["height"] = np.where((level >= 0) & (level & 0xC000 == 0), quarter / 4.0 * FLIGHT_LEVEL, np.nan)
    rows["sd_range"] = radar.sd_range
    rows["sd_azimuth"] = radar.sd_azimuth
    code = table["mode_3a"]
    rows["mode_3a"] = np.where((code >= 0) & (code & 0xC000 == 0), code & 0x0FFF, -1)
    rows["address"] = table["address"]
    return rows
