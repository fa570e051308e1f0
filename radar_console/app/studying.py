"""The command `study`: what there is, and one of them from its runs to its table."""

import os
from pathlib import Path

from rich.console import Console
from rich.table import Table

from radar_console.core.errors import InputError
from radar_console.studies import catalogue, findings
from radar_console.studies.findings import Finding
from radar_console.studies.work import Work

_WIDE = 170  # characters of a table that goes to a file


def listed() -> list[tuple[str, str]]:
    """Name and title of every study."""
    return [(name, catalogue.title(name)) for name in catalogue.NAMES]


def study(name: str, runs: int | None, seed: int, jobs: int | None, output: Path | None) -> Path:
    """Run a study, print its table, write its files; the folder that they are in.

    Raises
    ------
    RadarConsoleError   no such study, or no place for its files
    """
    chosen = catalogue.load(name)
    runs = chosen.runs if runs is None else runs
    folder = folder_of(name, output)
    _prepare(folder)
    work = Work(folder, runs, seed, jobs or os.cpu_count() or 1)
    try:
        found = chosen.run(work)
        command = f"radar-console study {name} --runs {runs} --seed {seed}"
        findings.write(folder, chosen.title, chosen.about, command, found, work.figures)
    except OSError as error:
        if error.strerror is None:
            raise
        raise InputError(error.filename or folder, "", f"can't be written: {error.strerror}") from error
    _print(chosen.title, found)
    return folder


def folder_of(name: str, output: Path | None) -> Path:
    """Where the files of a study go."""
    return Path("out") / name if output is None else output


def _prepare(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "", "is a file; expected a folder for the study's files")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, "", f"can't be made: {error.strerror}") from error
    if not os.access(folder, os.W_OK):
        raise InputError(folder, "", "can't be written: permission denied")


def _print(title: str, found: list[Finding]) -> None:
    console = Console()
    if not console.is_terminal:
        console.width = _WIDE
    table = Table(title=title, title_justify="left", title_style="bold")
    for column in findings.COLUMNS:
        words = column in ("quantity", "verdict")
        table.add_column(column, justify="left" if words else "right", no_wrap=not words)
    for row in findings.rows(found):
        table.add_row(*row)
    console.print(table)
