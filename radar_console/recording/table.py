"""A plot table (CSV) as a source of sectors.

Rows are target reports, or, with the columns pulse, cell and amplitude, raw returns that still go
through clustering. The beam is inferred from the rows' times and azimuths. Where all rows of a
scan carry one time, nothing tells when the beam was where. Then a scan is two sectors: the beam is
south at that time, so that every azimuth lies within half a turn of the beam and belongs to its own
scan; the eastern half comes at that time, the western half on the way to the next scan. The plots
keep the time that they have. (In the Autoferry recordings they are, measured along the course of the
boats, 1.8 s older than it, and a turn takes 1.68 s.)
"""

import difflib
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radar_console.core.errors import InputError
from radar_console.core.geometry import Array, unwrap_near, wrap
from radar_console.core.messages import CENTROID, PLOT, Radar, Sector, Table, blank
from radar_console.core.rotation import (
    Encoder,
    encoder_of_marks,
    encoder_of_reports,
    infer_rotation,
    rotation_of_marks,
)
from radar_console.core.sweep import SECTORS, cut, first_turn, stated
from radar_console.core.units import DEG, KM, TURN
from radar_console.recording.columns import Columns, read_columns

REQUIRED = ("time_s", "range_m", "azimuth_deg")
RAW = ("pulse", "cell", "amplitude")
SENSOR = ("sensor_east_m", "sensor_north_m")
OPTIONAL = (
    "elevation_deg",
    "snr_db",
    "doppler_mps",
    "scan",
    *SENSOR,
    "height_m",
    "sd_range_m",
    "sd_azimuth_deg",
    "mode_3a",
    *RAW,
)
NEEDED_IF_PRESENT = (*REQUIRED, *SENSOR, *RAW, "scan")
NOT_NEGATIVE = ("time_s", "range_m", "pulse", "cell", "scan")
POSITIVE = ("sd_range_m", "sd_azimuth_deg", "amplitude")
WHOLE = ("pulse", "cell", "scan")
MOST = {"cell": 1_000_000, "pulse": 2**53, "scan": 2**53}

# Where nobody states them.
SD_RANGE, SD_RANGE_PART = 50.0, 1.0 / 200.0  # m; at most so much, and at most this part of the largest range
SD_AZIMUTH = 0.5 * DEG
OFF_PULSE = 1.0 * DEG  # an azimuth may be so far from its pulse's
SAME_BEAM = 5.0 * DEG  # rows of one pulse are nearer to one another in azimuth


class PlotTable:
    """A plot table; implements `pipeline.Source`.

    The ordinal of a plot is the number, from 0, of its row below the header, used or not; blank
    lines have no number.

    Parameters
    ----------
    file : CSV with the columns time_s, range_m, azimuth_deg, and any of elevation_deg, snr_db,
        doppler_mps, scan, sensor_east_m, sensor_north_m, height_m, sd_range_m, sd_azimuth_deg,
        mode_3a (octal), pulse, cell, amplitude; others are ignored and noted
    radar, given : what a configuration states, and its keys such as ``radar.rotation_s``; the rest is
        measured

    Raises
    ------
    InputError   the file is of another kind, lacks a column, has no good row, or the rotation can't
        be told

    Attributes
    ----------
    radar, duration, skipped : of `pipeline.Source`; `skipped` is complete from the start
    noted : what was mended or ignored, counted
    """

    def __init__(self, file: Path, radar: Radar | None = None, given: frozenset[str] = frozenset()) -> None:
        self.file = file
        self.skipped: dict[str, int] = {}
        self.noted: Counter[str] = Counter()
        columns = read_columns(file, REQUIRED, OPTIONAL)
        self._note_columns(columns)
        good = self._good(columns)
        self._rows = len(good)
        ordinal = np.flatnonzero(good)
        values = {name: column[good] for name, column in columns.values.items()}
        order = np.argsort(values["time_s"], kind="stable")
        back = int(np.sum(values["time_s"] < np.maximum.accumulate(values["time_s"])))
        self._note("rows before an earlier row's time (put in order)", back)
        self._values = {name: column[order] for name, column in values.items()}
        self._ordinal = ordinal[order]
        self._raw = all(name in values for name in RAW)

        known = stated(radar, given)
        time, azimuth = self._values["time_s"], self._values["azimuth_deg"] * DEG
        self._stamps: Array | None = None
        rotation, self._told = self._rotation(known.get("rotation"), time, azimuth)
        far = float(self._values["range_m"].max())
        measured = Radar(
            name=file.stem,
            rotation=rotation,
            max_range=_round_up(far),
            sd_range=max(min(SD_RANGE, far * SD_RANGE_PART), 0.1),
            sd_azimuth=SD_AZIMUTH,
        )
        self.radar = replace(measured, **known)
        self._table = self._plots() if self._raw else self._centroids()
        self._encoder, self._angle, self._active = self._beam(time, azimuth)
        self._span = (float(time[0]), float(time[-1]))
        self.duration = self._span[1] - self._span[0]

    def has_pulses(self, pulses_per_turn: int) -> bool:
        """Whether the pulses' numbers go with their azimuths at so many pulses a turn; True of reports."""
        if not self._raw:
            return True
        beam = self._table["pulse"] * (TURN / pulses_per_turn)
        return float(np.median(np.abs(wrap(self._table["azimuth"] - beam)))) < OFF_PULSE

    def sectors(self) -> Iterator[Sector]:
        """Every sector from the beginning: 64 a turn, or two where all of a scan has one time."""
        moving = self._position_at if SENSOR[0] in self._values and SENSOR[1] in self._values else None
        count = SECTORS if self._stamps is None else 2
        return cut(self.radar, self._encoder, self._table, self._angle, self._active, moving, count)

    def facts(self) -> list[tuple[str, str]]:
        """Label and value, for the user."""
        values = self._values
        scans = "" if self._stamps is None else f", {len(self._stamps):,} scans with one time each"
        facts = [
            ("format", "plot table of raw returns" if self._raw else "plot table of target reports"),
            ("rows", f"{self._rows:,}, {len(self._table):,} used"),
            ("columns", ", ".join(values)),
            ("time", f"{self._span[0]:,.3f} to {self._span[1]:,.3f} s, {self.duration:,.1f} s{scans}"),
            ("rotation", f"{self.radar.rotation:.3f} s, from {self._told}"),
            ("range", f"{values['range_m'].min() / KM:.3f} to {values['range_m'].max() / KM:.3f} km"),
        ]
        if "mode_3a" in values:
            codes = self._table["mode_3a"]
            facts.append(("codes", f"{len(np.unique(codes[codes >= 0]))} Mode 3/A"))
        facts += [("noted", f"{count:,} {what}") for what, count in sorted(self.noted.items())]
        return facts + [("skipped", f"{count:,} {why}") for why, count in sorted(self.skipped.items())]

    def _note(self, what: str, count: int) -> None:
        if count:
            self.noted[what] += count

    def _note_columns(self, columns: Columns) -> None:
        for name in columns.others:
            close = difflib.get_close_matches(name, (*REQUIRED, *OPTIONAL), n=1)
            hint = f", did you mean {close[0]}?" if close else ""
            self._note(f"column {name or '(without a name)'} ignored{hint}", 1)

    def _good(self, columns: Columns) -> NDArray[np.bool_]:
        """Which rows can be used; the others are counted by reason."""
        good = np.ones(len(columns.lines), bool)

        def drop(bad: NDArray[np.bool_], reason: str) -> None:
            first = np.flatnonzero(bad & good)
            if len(first):
                self.skipped[f"{reason} (first in line {columns.lines[first[0]]})"] = len(first)
                good[first] = False

        drop(columns.misshapen, "rows with another number of fields than the header")
        for name, value in columns.values.items():
            drop(columns.unreadable[name], f"{name}: not a number")
            if name in NEEDED_IF_PRESENT:
                drop(~np.isfinite(value), f"{name}: empty, NaN or infinite")
            else:
                drop(np.isinf(value), f"{name}: infinite")
            if name in NOT_NEGATIVE:
                drop(value < 0.0, f"{name}: negative")
            if name in POSITIVE:
                drop(value <= 0.0, f"{name}: not positive")
            if name in MOST:
                drop(value > MOST[name], f"{name}: above {MOST[name]:,}")
            if name in WHOLE:
                drop(value != np.floor(value), f"{name}: not a whole number")
        azimuth = columns.values["azimuth_deg"]
        drop((azimuth < 0.0) | (azimuth >= 360.0), "azimuth_deg: outside 0 to 360")
        if "elevation_deg" in columns.values:
            drop(np.abs(columns.values["elevation_deg"]) > 90.0, "elevation_deg: outside -90 to 90")
        if "mode_3a" in columns.values:
            drop(_octal(columns.values["mode_3a"]) < -1, "mode_3a: not four octal digits")
        if not good.any():
            found = "; ".join(f"{count:,} × {why}" for why, count in self.skipped.items())
            raise InputError(
                self.file, "", f"no good row; expected plots below the header{found and ', found '}{found}"
            )
        return good

    def _rotation(self, given: float | None, time: Array, azimuth: Array) -> tuple[float, str]:
        """The time of one turn and where it comes from; finds out whether a scan has one time."""
        # Rows that share a time share a pulse, unless a whole scan was given that time.
        apart = np.abs(wrap(np.diff(azimuth)))[np.diff(time) == 0.0]
        stamped = len(apart) > 0.2 * len(time) and float(np.median(apart)) > SAME_BEAM
        inferred = None if stamped else infer_rotation(time, azimuth)
        if self._raw and inferred is None:
            _, pulses = np.unique(self._values["pulse"], return_index=True)
            inferred = rotation_of_marks(time[pulses], azimuth[pulses])
        if stamped or (inferred is None and given is None and "scan" in self._values):
            self._stamps = np.unique(time) if stamped else self._scan_ends(time)
            steps = np.diff(self._stamps)
            if given is None and not len(steps):
                raise self._unknown_rotation()
            return (
                (given, "the configuration") if given else (float(np.median(steps)), "the times of the scans")
            )
        if given is not None:
            return given, "the configuration"
        if inferred is None:
            raise self._unknown_rotation()
        return inferred, "times and azimuths"

    def _unknown_rotation(self) -> InputError:
        return InputError(
            self.file,
            "",
            "the rotation can't be told from the rows' times and azimuths; "
            "expected rotation_s in the [radar] table of a configuration",
        )

    def _scan_ends(self, time: Array) -> Array:
        """The last time of each scan, by its number; a scan must end before the next one ends."""
        scan = self._values["scan"]
        numbers = np.unique(scan)
        ends = np.array([time[scan == number].max() for number in numbers])
        return ends[np.concatenate(([True], np.diff(ends) > 0.0))]

    def _beam(self, time: Array, azimuth: Array) -> tuple[Encoder, Array, Array]:
        """The encoder, the unwrapped angle of every row, and the angles where the beam was seen."""
        if self._stamps is not None:
            steps = np.maximum(np.round(np.diff(self._stamps) / self.radar.rotation), 1.0)
            turn = np.concatenate(([0.0], np.cumsum(steps)))
            north = turn * TURN
            # As `cut` computes the edges of its sectors, so that one lies at the very time of the scan.
            encoder = Encoder(self._stamps, (2.0 * turn + 1.0) * (TURN / 2.0), self.radar.rotation)
            scan = np.minimum(np.searchsorted(self._stamps, time), len(north) - 1)
            return encoder, north[scan] + azimuth, np.concatenate((north, encoder.angle))
        if self._raw:
            _, pulses = np.unique(self._values["pulse"], return_index=True)
            encoder, _ = encoder_of_marks(time[pulses], azimuth[pulses], self.radar.rotation)
        else:
            encoder = encoder_of_reports(time, azimuth, self.radar.rotation)
        angle = unwrap_near(azimuth, encoder.angle_at(time))
        turns = first_turn(encoder, angle)
        angle = angle + turns * TURN
        return encoder.shifted(turns), angle, angle

    def _position_at(self, time: Array) -> Array:
        """Where the sensor is, (n, 3) m, between the rows' own positions."""
        position = np.zeros((len(time), 3))
        for axis, name in enumerate(SENSOR):
            if name in self._values:
                position[:, axis] = np.interp(time, self._values["time_s"], self._values[name])
        return position

    def _fill(self, rows: Table, **fields: str) -> Table:
        """Copy columns that exist into the fields of the same meaning; degrees become radians."""
        for field, name in fields.items():
            if name in self._values:
                rows[field] = self._values[name] * (DEG if name.endswith("_deg") else 1.0)
        rows["ordinal"] = self._ordinal
        return rows

    def _plots(self) -> Table:
        return self._fill(
            blank(PLOT, len(self._ordinal)),
            time="time_s",
            range="range_m",
            azimuth="azimuth_deg",
            elevation="elevation_deg",
            doppler="doppler_mps",
            pulse="pulse",
            cell="cell",
            amplitude="amplitude",
        )

    def _centroids(self) -> Table:
        rows = blank(CENTROID, len(self._ordinal))
        rows = self._fill(
            rows,
            time="time_s",
            range="range_m",
            azimuth="azimuth_deg",
            elevation="elevation_deg",
            doppler="doppler_mps",
            snr="snr_db",
            height="height_m",
            sd_range="sd_range_m",
            sd_azimuth="sd_azimuth_deg",
        )
        rows["sd_range"] = np.where(np.isnan(rows["sd_range"]), self.radar.sd_range, rows["sd_range"])
        rows["sd_azimuth"] = np.where(np.isnan(rows["sd_azimuth"]), self.radar.sd_azimuth, rows["sd_azimuth"])
        if "mode_3a" in self._values:
            rows["mode_3a"] = _octal(self._values["mode_3a"])
        return rows


def _octal(code: Array) -> NDArray[np.int64]:
    """The number that four octal digits, read as a decimal, stand for; -1 unknown, -2 wrong."""
    known = np.isfinite(code) & (code >= 0) & (code <= 7777) & (code == np.floor(code))
    digits = np.where(known, code, 0).astype(np.int64)[..., None] // np.array([1000, 100, 10, 1]) % 10
    number = digits @ np.array([512, 64, 8, 1])
    wrong = (digits > 7).any(axis=-1) | (~known & ~np.isnan(code))
    return np.where(wrong, -2, np.where(known, number, -1))


def _round_up(distance: float) -> float:
    """The next of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(distance, 1.0)))
    return float(next(m for m in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if m * power >= distance) * power)
