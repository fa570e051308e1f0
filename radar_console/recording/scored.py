"""Read tables of tracks and of truth, such as `recording/writing.py` writes, to score the ones by the other.

A table that is scored is whole: a row that can't be used is an error, not left out.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radar_console.core.errors import InputError
from radar_console.core.messages import TRACK, TRUTH, Table, TrackStatus, blank
from radar_console.recording.columns import Columns, read_columns

POSITION = ("east_m", "north_m")
VELOCITY = ("v_east_mps", "v_north_mps")
END_S = 1e-3  # s; a track without status is held so long after its last row: at the instant of that row
_MOST = {"track": 2**53, "target": 2**31}
_STATUS = {status.name.lower(): float(status.value) for status in TrackStatus}


def read_tracks(file: Path) -> Table:
    """TRACK from columns time_s, track, east_m and north_m; status, v_east_mps, v_north_mps where they are.

    Without a status every row is of a confirmed track, which ends right after its last row. Without
    velocities tracks stay where they are between their rows.

    Raises
    ------
    InputError   the file can't be read, lacks a column, or has a row that can't be used
    """
    columns = _read(file, ("time_s", "track", *POSITION), ("status", *VELOCITY), "track", {"status": _STATUS})
    values = columns.values
    tracks = blank(TRACK, len(columns.lines))
    _fill(tracks, columns, "track")
    tracks["hit"] = True
    tracks["status"] = values.get("status", TrackStatus.CONFIRMED)
    return tracks if "status" in values else _ended(tracks)


def read_truth(file: Path) -> Table:
    """TRUTH from columns time_s, target, east_m and north_m; v_east_mps and v_north_mps where they are.

    Without velocities the errors of velocity mean nothing.

    Raises
    ------
    InputError   the file can't be read, lacks a column, or has a row that can't be used
    """
    columns = _read(file, ("time_s", "target", *POSITION), VELOCITY, "truth row", {})
    truth = blank(TRUTH, len(columns.lines))
    _fill(truth, columns, "target")
    _, first, count = np.unique(truth[["time", "target"]], return_index=True, return_counts=True)
    if (count > 1).any():
        row = truth[first[count > 1][0]]
        what = f"target {row['target']} at {row['time']:g} s comes twice; expected it once"
        raise InputError(file, "", what)
    return truth


def _read(
    file: Path,
    required: tuple[str, ...],
    optional: tuple[str, ...],
    kind: str,
    words: Mapping[str, Mapping[str, float]],
) -> Columns:
    columns = read_columns(file, required, optional, kind, words)
    _refuse(file, columns, columns.misshapen, "", "has another number of fields than the header")
    for name, values in columns.values.items():
        what = f"expected {' or '.join(words[name])}" if name in words else "expected a number"
        _refuse(file, columns, columns.unreadable[name] | ~np.isfinite(values), name, what)
        if name in _MOST:
            wrong = (values % 1.0 != 0.0) | (np.abs(values) >= _MOST[name])
            _refuse(file, columns, wrong, name, f"expected a whole number below {_MOST[name]:,}")
    given = [name for name in VELOCITY if name in columns.values]
    if len(given) == 1:
        raise InputError(
            file, "line 1", f"has {given[0]} alone; expected {' and '.join(VELOCITY)}, or neither"
        )
    return columns


def _refuse(file: Path, columns: Columns, wrong: NDArray[np.bool_], column: str, what: str) -> None:
    """The first row that is wrong, named."""
    if wrong.any():
        line = f"line {columns.lines[np.argmax(wrong)]}"
        raise InputError(file, f"{line}, {column}" if column else line, what)


def _fill(table: Table, columns: Columns, number: str) -> None:
    values = columns.values
    table["time"], table[number] = values["time_s"], values[number]
    for name, column in (("east", "east_m"), ("north", "north_m")):
        table[name] = values[column]
    for name, column in (("v_east", "v_east_mps"), ("v_north", "v_north_mps")):
        table[name] = values.get(column, 0.0)


def _ended(tracks: Table) -> Table:
    """The same tracks, each with one more row, that deletes it right after its last."""
    order = np.lexsort((tracks["time"], tracks["track"]))
    last = order[np.append(tracks["track"][order][1:] != tracks["track"][order][:-1], True)]
    ends = tracks[last]
    ends["status"] = TrackStatus.DELETED
    ends["time"] += END_S
    return np.concatenate([tracks, ends])
