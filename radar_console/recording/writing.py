"""Write tracks, plots and truth as CSV, sector by sector.

Decimals are fixed, so that the same result gives the same bytes. A value that is not known is an
empty field.
"""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from radar_console.core.errors import InputError
from radar_console.core.geometry import to_polar
from radar_console.core.messages import Sector, Table, TrackStatus
from radar_console.core.units import DEG

TRACK_COLUMNS = (
    "time_s,track,status,east_m,north_m,up_m,v_east_mps,v_north_mps,v_up_mps,sd_east_m,sd_north_m,"
    "range_m,azimuth_deg,plot,probability"
)
RAW_COLUMNS = "time_s,range_m,azimuth_deg,elevation_deg,doppler_mps,pulse,cell,amplitude"
REPORT_COLUMNS = (
    "time_s,range_m,azimuth_deg,elevation_deg,snr_db,doppler_mps,height_m,sd_range_m,sd_azimuth_deg,mode_3a"
)
TRUTH_COLUMNS = "time_s,target,east_m,north_m,up_m,v_east_mps,v_north_mps,v_up_mps"
SENSOR_COLUMNS = "sensor_east_m,sensor_north_m"

_STATUS = {status.value: status.name.lower() for status in TrackStatus}


class _CsvWriter:
    """A file that is open for rows; use it in a `with` statement.

    Raises
    ------
    InputError   the file can't be written
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        if not file.parent.is_dir():
            raise InputError(file, "", f"can't be written: there is no folder {file.parent}")
        try:
            self._out = file.open("w", encoding="utf-8", newline="\n")
        except OSError as error:
            raise InputError(file, "", f"can't be written: {error.strerror}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write what is left and close the file."""
        self._text(self._out.close)

    def _rows(self, columns: Iterable[list[str]]) -> None:
        lines = map(",".join, zip(*columns, strict=True))
        text = "\n".join(lines)
        if text:
            self._text(self._out.write, text + "\n")

    def _text(self, action: Callable[..., Any], *text: str) -> None:
        try:
            action(*text)
        except OSError as error:  # the disk is full
            raise InputError(self.file, "", f"can't be written: {error.strerror}") from error


class TrackWriter(_CsvWriter):
    """`tracks.csv`: a row for each track at each of its updates, and at each missed one."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._text(self._out.write, TRACK_COLUMNS + "\n")

    def write(self, sector: Sector) -> None:
        """Write the tracks of a sector; range and azimuth are along the ground, from the sensor."""
        t = sector.tracks
        if not len(t):
            return
        east, north, _ = sector.position
        distance, azimuth = to_polar(t["east"] - east, t["north"] - north)
        self._rows(
            (
                _decimals(t["time"], 4),
                _whole(t["track"]),
                [_STATUS[status] for status in t["status"].tolist()],
                *(_decimals(t[name], 2) for name in ("east", "north", "up")),
                *(_decimals(t[name], 3) for name in ("v_east", "v_north", "v_up")),
                *(_decimals(t[name], 2) for name in ("sd_east", "sd_north")),
                _decimals(distance, 2),
                _degrees(azimuth, 5),
                _whole(t["plot"], t["plot"] >= 0),
                _decimals(t["probability"], 5),
            )
        )


class PlotWriter(_CsvWriter):
    """A plot table that `PlotTable` reads: raw returns, or target reports.

    Which of the two, and whether the sensor's position is written, is told by the first sector that
    has rows or a position off the origin.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._raw: bool | None = None
        self._moving = False

    def write(self, sector: Sector) -> None:
        """Write the plots of a sector, or else its centroids.

        Raises
        ------
        InputError   the file can't be written
        ValueError   raw returns after target reports, or the other way round, or a sensor that
            begins to move
        """
        raw = len(sector.plots) > 0
        table = sector.plots if raw else sector.centroids
        if not len(table):
            return
        moving = sector.position[:2] != (0.0, 0.0)
        if self._raw is None:
            self._begin(raw, moving)
        if raw != self._raw or (moving and not self._moving):
            raise ValueError("one plot table holds one kind of plots, with or without the sensor's position")
        columns = _raw_columns(table) if raw else _report_columns(table)
        if self._moving:
            columns += [[f"{value:.3f}"] * len(table) for value in sector.position[:2]]
        self._rows(columns)

    def close(self) -> None:
        if self._raw is None:
            self._begin(False, False)  # no plots at all: a header is still a table
        super().close()

    def _begin(self, raw: bool, moving: bool) -> None:
        self._raw, self._moving = raw, moving
        header = RAW_COLUMNS if raw else REPORT_COLUMNS
        self._text(self._out.write, header + ("," + SENSOR_COLUMNS if moving else "") + "\n")


class TruthWriter(_CsvWriter):
    """Where the targets are: a row for each of them at each time."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._text(self._out.write, TRUTH_COLUMNS + "\n")

    def write(self, truth: Table) -> None:
        """Write a table TRUTH."""
        names = ("east", "north", "up", "v_east", "v_north", "v_up")
        columns = (_decimals(truth[name], 3) for name in names)
        self._rows((_decimals(truth["time"], 3), _whole(truth["target"]), *columns))


def _raw_columns(t: Table) -> list[list[str]]:
    return [
        _decimals(t["time"], 6),
        _decimals(t["range"], 3),
        _degrees(t["azimuth"], 6),
        _decimals(t["elevation"] / DEG, 5),
        _decimals(t["doppler"], 3),
        _whole(t["pulse"]),
        _whole(t["cell"]),
        _decimals(t["amplitude"], 5),
    ]


def _report_columns(t: Table) -> list[list[str]]:
    return [
        _decimals(t["time"], 6),
        _decimals(t["range"], 3),
        _degrees(t["azimuth"], 6),
        _decimals(t["elevation"] / DEG, 5),
        _decimals(t["snr"], 2),
        _decimals(t["doppler"], 3),
        _decimals(t["height"], 2),
        _decimals(t["sd_range"], 3),
        _decimals(t["sd_azimuth"] / DEG, 6),
        [f"{code:04o}" if code >= 0 else "" for code in t["mode_3a"].tolist()],
    ]


def _decimals(values: ArrayLike, places: int) -> list[str]:
    """Fixed decimals; empty where NaN; never a negative zero."""
    rounded = np.round(np.asarray(values, float), places) + 0.0
    if np.isnan(rounded).all():
        return [""] * len(rounded)
    form = f"%.{places}f"
    return ["" if math.isnan(v) else form % v for v in rounded.tolist()]


def _degrees(azimuth: ArrayLike, places: int) -> list[str]:
    """Degrees in [0, 360) also after rounding."""
    degrees = np.round(np.asarray(azimuth, float) / DEG, places)
    return _decimals(np.where(degrees >= 360.0, 0.0, degrees), places)


def _whole(values: ArrayLike, shown: ArrayLike = True) -> list[str]:
    numbers = np.asarray(values).tolist()
    if np.all(shown):
        return list(map(str, numbers))
    return [str(n) if s else "" for n, s in zip(numbers, np.asarray(shown).tolist(), strict=True)]
