"""Results of runs in a folder: `results.csv`, a row for each run under each setting, and what they are of.

A row is written whole and at once to the disk when its run is done, so a run that was killed leaves
at most a last line that is torn; that is cut off, and its run is done again. `experiment.json` says what
the rows are of; a folder that holds other runs is refused.
"""

import csv
import io
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from radar_console.core.errors import InputError
from radar_console.estimation.gaussian import Array
from radar_console.evaluation.grid import Setting, text_of

FORMAT = 1
ERROR_LENGTH = 500  # characters of an error that are kept


class Row(NamedTuple):
    """What a run gave.

    Attributes
    ----------
    setting : its number
    seed : of the run
    figures : by metric; those that are missing are NaN
    error : why it failed; empty where it did not
    """

    setting: int
    seed: int
    figures: Mapping[str, float]
    error: str = ""


class Results:
    """The results in a folder, open for more; use it in a `with` statement.

    Parameters
    ----------
    folder : made where it is missing
    experiment : what else tells these runs from others, such as the scenario: anything that JSON holds
    settings : what is compared, each with the same keys
    metrics : the names of the figures

    Raises
    ------
    InputError   the folder can't be written, holds another experiment or is in use, or a row in it is none
    """

    def __init__(
        self,
        folder: Path,
        experiment: Mapping[str, Any],
        settings: Sequence[Setting],
        metrics: Sequence[str],
    ) -> None:
        self.folder, self.settings, self.metrics = folder, list(settings), list(metrics)
        self.file, self._about = folder / "results.csv", folder / "experiment.json"
        self._keys = list(settings[0])
        self._number = {self._texts(setting): k for k, setting in enumerate(settings)}
        if len(self._number) < len(settings):
            raise ValueError("two settings read alike")
        self._header = ["seed", *self._keys, *self.metrics, "error"]
        self._rows: dict[tuple[int, int], Row] = {}
        self._experiment = json.loads(json.dumps(dict(experiment), default=str))
        self._experiment |= {
            "format": FORMAT,
            "metrics": self.metrics,
            "settings": [dict(zip(self._keys, self._texts(setting), strict=True)) for setting in settings],
        }

    def __enter__(self) -> Self:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(self.folder, "", f"can't be made: {error.strerror}") from error
        self._check_experiment()
        self._out = _open(self.file)
        try:
            self._lock()
            self._read()
        except BaseException:
            os.close(self._out)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._out)

    @property
    def rows(self) -> list[Row]:
        """All rows by setting and seed."""
        return [self._rows[key] for key in sorted(self._rows)]

    @property
    def failed(self) -> list[Row]:
        """The runs that failed."""
        return [row for row in self.rows if row.error]

    @property
    def seeds(self) -> list[int]:
        """Of all runs that are there, under any setting."""
        return sorted({seed for _, seed in self._rows})

    def missing(self, seeds: Iterable[int]) -> list[tuple[int, int]]:
        """Setting and seed of the runs that are not there yet; those of a seed together."""
        numbers = range(len(self.settings))
        return [(k, seed) for seed in seeds for k in numbers if (k, seed) not in self._rows]

    def figures(self, metric: str) -> Array:
        """(settings, seeds), in their orders; NaN where a run failed, is missing or has no such figure."""
        place = {seed: i for i, seed in enumerate(self.seeds)}
        values = np.full((len(self.settings), len(place)), np.nan)
        for (setting, seed), row in self._rows.items():
            values[setting, place[seed]] = row.figures.get(metric, math.nan)
        return values

    def add(self, row: Row) -> None:
        """Take a run, and write it through to the disk.

        Raises
        ------
        InputError   it can't be written; the rows before it stay as they are
        """
        strange = row.figures.keys() - set(self.metrics)
        if strange or (row.setting, row.seed) in self._rows:
            raise ValueError(f"a run that is there, or figures that are not known: {row}")
        end = os.lseek(self._out, 0, os.SEEK_END)
        try:
            _write(self._out, self._line(row))
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._out, end)
            raise InputError(
                self.file,
                "",
                f"can't be written: {error.strerror}; the {len(self._rows):,} runs before are kept, and the "
                "same command goes on from there",
            ) from error
        self._rows[row.setting, row.seed] = row._replace(error=_one_line(row.error))

    def forget(self, seeds: Iterable[int]) -> None:
        """Drop the runs of these seeds, to do them again."""
        gone = set(seeds)
        if any(seed in gone for _, seed in self._rows):
            self._rows = {key: row for key, row in self._rows.items() if key[1] not in gone}
            self._rewrite()

    def sort(self) -> None:
        """Bring the file into the order of settings and seeds, whoever was done first."""
        if list(self._rows) != sorted(self._rows):
            self._rows = dict(sorted(self._rows.items()))
            self._rewrite()

    def _check_experiment(self) -> None:
        text = json.dumps(self._experiment, indent=2, ensure_ascii=False) + "\n"
        if self._about.exists():
            try:
                there = json.loads(self._about.read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                raise InputError(
                    self._about, "", f"can't be read: {error}; expected another folder"
                ) from error
            change = _difference(there, self._experiment)
            if change:
                raise InputError(
                    self.folder,
                    "",
                    f"holds runs of another experiment: {change}; expected another folder, -o",
                )
        elif self.file.exists():
            what = f"has {self.file.name} but no {self._about.name} that says of what"
            raise InputError(self.folder, "", f"{what}; expected another folder, -o")
        else:
            self._replace(self._about, text)

    def _lock(self) -> None:
        """Two commands at once would do every run twice."""
        try:
            import fcntl
        except ImportError:  # Windows
            return
        try:
            fcntl.flock(self._out, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(self.folder, "", "another command is writing its runs here") from None

    def _read(self) -> None:
        """Take the rows that are there; cut off the last one where it is torn."""
        text = self.file.read_bytes()
        whole = text.rfind(b"\n") + 1
        if whole < len(text):
            os.ftruncate(self._out, whole)
        if not whole:
            self._safely(_write, self._out, _csv_line(self._header))
            return
        lines = list(csv.reader(io.StringIO(text[:whole].decode("utf-8", "replace"), newline="")))
        if lines[0] != self._header:
            raise InputError(
                self.file, "line 1", "is not the header of these runs; expected another folder, -o"
            )
        for number, fields in enumerate(lines[1:], start=2):
            row = self._row(fields, number)
            if (row.setting, row.seed) in self._rows:
                raise InputError(self.file, f"line {number}", "has a run that is above already")
            self._rows[row.setting, row.seed] = row

    def _row(self, fields: list[str], line: int) -> Row:
        n = len(self._keys)
        try:
            seed, texts, values, error = fields[0], fields[1 : n + 1], fields[n + 1 : -1], fields[-1]
            figures = {
                name: float(value) if value else math.nan
                for name, value in zip(self.metrics, values, strict=True)
            }
            return Row(self._number[tuple(texts)], int(seed), figures, error)
        except (ValueError, KeyError, IndexError):
            raise InputError(
                self.file,
                f"line {line}",
                f"is no run of these; expected {len(self._header)} fields as in line 1",
            ) from None

    def _line(self, row: Row) -> bytes:
        values = [row.figures.get(name, math.nan) for name in self.metrics]
        texts = ["" if math.isnan(value) else repr(float(value)).removesuffix(".0") for value in values]
        setting = self._texts(self.settings[row.setting])
        return _csv_line([str(row.seed), *setting, *texts, _one_line(row.error)])

    def _texts(self, setting: Setting) -> tuple[str, ...]:
        return tuple(text_of(setting[key]) for key in self._keys)

    def _rewrite(self) -> None:
        body = b"".join([_csv_line(self._header), *(self._line(row) for row in self._rows.values())])
        os.close(self._out)  # some systems replace no file that is open
        try:
            self._replace(self.file, body.decode())
        finally:
            self._out = _open(self.file)
        self._lock()

    def _replace(self, file: Path, text: str) -> None:
        """Write a file so that it is either the old one or the new one, whole."""
        fresh = file.with_suffix(".part")

        def write() -> None:
            with fresh.open("w", encoding="utf-8", newline="") as out:
                out.write(text)
                out.flush()
                os.fsync(out.fileno())
            fresh.replace(file)

        self._safely(write)

    def _safely(self, action: Callable[..., None], *arguments: Any) -> None:
        try:
            action(*arguments)
        except OSError as error:
            raise InputError(self.folder, "", f"can't be written: {error.strerror}") from error


def _open(file: Path) -> int:
    try:
        return os.open(file, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), 0o666)
    except OSError as error:
        raise InputError(file, "", f"can't be written: {error.strerror}") from error


def _write(out: int, line: bytes) -> None:
    """All of it, through to the disk."""
    while line:
        line = line[os.write(out, line) :]
    os.fsync(out)


def _csv_line(fields: Iterable[str]) -> bytes:
    out = io.StringIO(newline="")
    csv.writer(out, lineterminator="\n").writerow(fields)
    return out.getvalue().encode("utf-8", "backslashreplace")


def _one_line(text: str) -> str:
    return " ".join(text.split())[:ERROR_LENGTH]


def _difference(there: Any, here: Any, path: str = "") -> str:
    """The first difference between two trees of JSON, in words; empty where there is none."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys([*here, *there]):
            inner = f"{path}.{key}" if path else str(key)
            if key not in there or key not in here:
                return f"{inner} is {'not ' if key not in here else ''}given now" + (
                    " and was not" if key not in there else ""
                )
            said = _difference(there[key], here[key], inner)
            if said:
                return said
        return ""
    if isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        pairs = enumerate(zip(there, here, strict=True))
        return next((said for i, (a, b) in pairs if (said := _difference(a, b, f"{path}[{i}]"))), "")
    return "" if there == here else f"{path} was {_shown(there)}, is {_shown(here)}"


def _shown(value: Any) -> str:
    if isinstance(value, list) and all(isinstance(item, dict) for item in value):
        return f"{len(value)} with {', '.join(dict.fromkeys(key for item in value for key in item))}"
    text = text_of(value)
    return text if len(text) <= 60 else text[:57] + "…"
