"""Errors that the user can mend. Everything else is a defect and keeps its traceback."""

from collections.abc import Sequence
from pathlib import Path


class RadarConsoleError(Exception):
    """The user's to mend: a command prints the sentence and exits with code 2."""


class InputError(RadarConsoleError):
    """A file, or a place in it, is not what was expected.

    Parameters
    ----------
    file : the file named by the user
    place : where in it, such as ``line 12, azimuth_deg``; empty for the file as a whole
    expected : a sentence: what was found and what was expected
    """

    def __init__(self, file: str | Path, place: str, expected: str) -> None:
        self.file, self.place, self.expected = Path(file), place, expected
        super().__init__(": ".join(part for part in (str(file), place, expected) if part))


class ScenarioError(RadarConsoleError):
    """A scenario file has problems; all of them, each ``(path of the key, what is wrong)``."""

    def __init__(self, file: str | Path, problems: Sequence[tuple[str, str]]) -> None:
        self.file, self.problems = Path(file), tuple(problems)
        lines = [f"{path}: {what}" if path else what for path, what in self.problems]
        count = "1 problem" if len(lines) == 1 else f"{len(lines)} problems"
        super().__init__(f"{file}: {count}\n" + "\n".join(f"  {line}" for line in lines))
