"""Read a CSV file into columns of floats, fast where it is clean, row by row where it is not."""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from radar_console.core.errors import InputError
from radar_console.core.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """The wanted columns of a file.

    Attributes
    ----------
    values : by name, (rows,); NaN where a field is empty or no number
    unreadable : by name, (rows,), where a field is not empty and no number
    misshapen : (rows,), rows with another number of fields than the header
    lines : (rows,), number of the line, from 1
    others : the columns that were not wanted
    """

    values: dict[str, Array]
    unreadable: dict[str, NDArray[np.bool_]]
    misshapen: NDArray[np.bool_]
    lines: NDArray[np.int64]
    others: tuple[str, ...]


def read_columns(
    file: Path,
    required: tuple[str, ...],
    optional: tuple[str, ...],
    kind: str = "plot",
    words: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> Columns:
    """Read the named columns.

    Parameters
    ----------
    kind : what the rows are, for errors
    words : by column, the words that stand for a number there

    Raises
    ------
    InputError   the file can't be read, is no text, or its header lacks or doubles a column
    """
    lines = _text(file, kind).splitlines()
    if not any(line.strip() for line in lines):
        raise InputError(file, "", f"is empty; expected a header with {', '.join(required)}")
    header = [name.strip() for name in next(csv.reader(lines[:1]), [])]
    missing = [name for name in required if name not in header]
    if missing:
        raise InputError(
            file,
            "line 1",
            f"no column {' nor '.join(missing)}; expected a header with {', '.join(required)}",
        )
    doubled = sorted({name for name in header if name and header.count(name) > 1})
    if doubled:
        raise InputError(file, "line 1", f"column {', '.join(doubled)} comes more than once; expected once")
    wanted = {name: header.index(name) for name in (*required, *optional) if name in header}
    others = tuple(name for name in header if name not in wanted)
    if len(lines) == 1:
        raise InputError(file, "line 2", f"no rows; expected {kind}s below the header")
    fast = _fast(lines[1:], wanted, len(header), words)
    if fast is not None:
        return _columns(fast, wanted, others)
    return _slow(lines[1:], wanted, others, len(header), words)


def _text(file: Path, kind: str) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(file, "", f"can't be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(
            file, f"byte {error.start}", f"not a text file; expected a table of {kind}s (CSV)"
        ) from error


def _fast(
    lines: list[str], wanted: dict[str, int], width: int, words: Mapping[str, Mapping[str, float]]
) -> Array | None:
    """All rows at once, (rows, width); None where a row needs a closer look."""
    if any(line.count(",") != width - 1 for line in lines):
        return None
    # An empty field is a number that is not known; ",," twice because matches do not overlap.
    body = "\n".join(lines).replace(",,", ",nan,").replace(",,", ",nan,").replace(",\n", ",nan\n")
    if body.endswith(","):
        body += "nan"
    try:
        values: Array = np.loadtxt(
            io.StringIO(body),
            delimiter=",",
            usecols=list(wanted.values()),
            ndmin=2,
            comments=None,
            converters={wanted[name]: known.__getitem__ for name, known in words.items() if name in wanted},
        )
    except (ValueError, KeyError):
        return None
    return values if len(values) == len(lines) else None


def _columns(values: Array, wanted: dict[str, int], others: tuple[str, ...]) -> Columns:
    nothing = np.zeros(len(values), bool)
    return Columns(
        values={name: values[:, i] for i, name in enumerate(wanted)},
        unreadable=dict.fromkeys(wanted, nothing),
        misshapen=nothing,
        lines=np.arange(len(values)) + 2,
        others=others,
    )


def _slow(
    lines: list[str],
    wanted: dict[str, int],
    others: tuple[str, ...],
    width: int,
    words: Mapping[str, Mapping[str, float]],
) -> Columns:
    known = [words.get(name) for name in wanted]
    reader = csv.reader(lines)
    values: list[list[float]] = []
    unreadable: list[list[bool]] = []
    misshapen: list[bool] = []
    numbers: list[int] = []
    while True:
        try:
            row = next(reader, None)
        except csv.Error:  # a field longer than any number
            row = [""]
        if row is None:
            break
        if not row:
            continue
        fields = [row[i].strip() if i < len(row) else "" for i in wanted.values()]
        read = [
            _number(text) if names is None else names.get(text)
            for text, names in zip(fields, known, strict=True)
        ]
        values.append([np.nan if number is None else number for number in read])
        unreadable.append([number is None for number in read])
        misshapen.append(len(row) != width)
        numbers.append(reader.line_num + 1)
    table = np.array(values, float).reshape(-1, len(wanted))
    bad = np.array(unreadable, bool).reshape(-1, len(wanted))
    return Columns(
        values={name: table[:, i] for i, name in enumerate(wanted)},
        unreadable={name: bad[:, i] for i, name in enumerate(wanted)},
        misshapen=np.array(misshapen, bool),
        lines=np.array(numbers, np.int64),
        others=others,
    )


def _number(text: str) -> float | None:
    if not text:
        return np.nan
    try:
        return float(text)
    except ValueError:
        return None
