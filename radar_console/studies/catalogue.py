"""Which studies there are. A study is a module of this folder with

- a docstring: the first line is its title, the rest names paper, table, parameters, published values and
  running time;
- `RUNS`, how many runs it makes unless told otherwise;
- `run(work: Work) -> list[Finding]`, which leaves its figures in `work.folder`.
"""

import ast
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from radar_console.core.errors import RadarConsoleError
from radar_console.studies.findings import Finding
from radar_console.studies.work import Work

NAMES = (
    "seven-targets",
    "twenty-five",
    "filter-rmse",
    "crossing",
    "resampling",
    "ospa-clutter",
    "complexity",
    "arpa",
)


class Study(NamedTuple):
    """A study, imported."""

    name: str
    title: str
    about: str
    runs: int
    run: Callable[[Work], list[Finding]]


def about(name: str) -> str:
    """The docstring of a study, read without importing what the study needs."""
    file = Path(__file__).with_name(f"{_module(name)}.py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))
    assert text, f"{file.name} has no docstring"
    return text


def title(name: str) -> str:
    """The first line of a study's docstring, without its full stop."""
    return about(name).splitlines()[0].rstrip(".")


def load(name: str) -> Study:
    """Import a study by its name.

    Raises
    ------
    RadarConsoleError   there is none of this name
    """
    if name not in NAMES:
        near = get_close_matches(name, NAMES, 1)
        hint = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(NAMES)}"
        raise RadarConsoleError(f"study {name}: no such study; {hint}")
    module = import_module(f"radar_console.studies.{_module(name)}")
    return Study(name, title(name), about(name), module.RUNS, module.run)


def _module(name: str) -> str:
    return name.replace("-", "_")
