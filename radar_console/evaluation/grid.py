"""Settings to compare: keys of a scenario with several values each, and the scenario with one of each."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from itertools import product
from pathlib import Path
from typing import Any, get_origin

from radar_console.core.errors import RadarConsoleError, ScenarioError
from radar_console.scenario import Scenario, Settings, parse, table_at, unknown_key

Setting = Mapping[str, Any]
"""One value for each key, such as ``{"tracker.filter": "kalman"}``."""

_STEP = re.compile(r"(\w+)(?:\[(\d+)\])?")


def option(text: str) -> tuple[str, list[Any]]:
    """Key and values of ``KEY=VALUE,VALUE``; values as in TOML, where words need no quotes.

    Raises
    ------
    RadarConsoleError   it is not of that form, or names a value twice

    Example: ``tracker.models=[cv],[cv,ct]`` is ``("tracker.models", [["cv"], ["cv", "ct"]])``.
    """
    key, _, right = text.partition("=")
    values = [_value(part) for part in _parts(right)]
    steps = key.strip().split(".")
    if not right.strip() or "" in values or not all(_STEP.fullmatch(step) for step in steps):
        raise RadarConsoleError(
            f"--set {text}: expected KEY=VALUE,VALUE…, such as tracker.filter=kalman,particle"
        )
    names = [text_of(value) for value in values]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise RadarConsoleError(f"--set {text}: {doubled} comes twice; expected each value once")
    return key.strip(), values


def grid(options: Sequence[tuple[str, Sequence[Any]]]) -> list[Setting]:
    """All combinations, the first key changing slowest; without options one setting without keys.

    Raises
    ------
    RadarConsoleError   a key comes twice
    """
    keys = [key for key, _ in options]
    doubled = next((key for key in keys if keys.count(key) > 1), None)
    if doubled is not None:
        raise RadarConsoleError(f"--set {doubled}: comes twice; expected all values of a key in one --set")
    return [dict(zip(keys, values, strict=True)) for values in product(*(values for _, values in options))]


def text_of(value: Any) -> str:
    """A value as the user would type it."""
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple):
        return "[" + ",".join(map(text_of, value)) + "]"
    return json.dumps(value, default=str)


def label(setting: Setting) -> str:
    """A setting in words, for tables and errors."""
    return ", ".join(f"{key}={text_of(value)}" for key, value in setting.items()) or "as it is"


def varied(raw: Mapping[str, Any], setting: Setting, file: Path) -> Scenario:
    """The scenario of `file`, whose TOML is `raw`, with some keys set.

    An array without an index means all its tables: ``target.rcs_db``, ``clutter.disc[0].mean``. The array's
    name may be left out: ``clutter.density_per_km2`` is set in every table of clutter that has such a
    key. What excludes the key goes: with a density, a disc has no mean.

    Raises
    ------
    ScenarioError      a key that is none, or a value that can't be
    """
    changed = deepcopy(dict(raw))
    for key, value in setting.items():
        steps = [(found[1], None if found[2] is None else int(found[2])) for found in _STEP.finditer(key)]
        try:
            _assign(changed, Scenario, steps, value)
        except _WrongKeyError as wrong:
            raise ScenarioError("--set", [(key, str(wrong))]) from None
    return parse(changed, Path(f"{file} with {label(setting)}") if setting else file)


class _WrongKeyError(Exception):
    """What is wrong with a key."""


def _assign(
    table: dict[str, Any], model: type[Settings] | None, steps: list[tuple[str, int | None]], value: Any
) -> None:
    (key, index), *rest = steps
    fields = model.model_fields if model is not None else {}
    if model is Scenario and key == "seed":
        raise _WrongKeyError("tells the runs apart; expected --seed for that of the first")
    if model is not None and key not in fields:
        below = [] if index is not None else list(_below(table, model, key))
        for inner_table, inner in below:
            _assign(inner_table, inner, steps, value)
        if not below:
            raise _WrongKeyError(_suggestion(key, model, rest))
    elif not rest:
        if index is not None:
            raise _WrongKeyError(f"an entry can't be replaced whole; expected a key of it, or {key} itself")
        for groups in model.alternatives if model is not None else ():
            if any(key in group for group in groups):
                for other in {name for group in groups if key not in group for name in group}:
                    table.pop(other, None)
        table[key] = value
    else:
        array = model is not None and get_origin(fields[key].annotation) is tuple
        inner_tables = table.setdefault(key, [] if array else {})
        entries = inner_tables if isinstance(inner_tables, list) else [inner_tables]
        chosen = entries if index is None else entries[index : index + 1]
        if not all(isinstance(entry, dict) for entry in chosen):
            raise _WrongKeyError(f"{key} is no table")
        if not chosen:
            raise _WrongKeyError(f"the scenario has {len(entries)} of {key}, counted from 0")
        for entry in chosen:
            _assign(entry, table_at(model, key) if model is not None else None, rest, value)


def _below(table: dict[str, Any], model: type[Settings], key: str) -> Iterator[tuple[Any, type[Settings]]]:
    """The tables in the arrays of a table that have such a key."""
    for name, field in model.model_fields.items():
        inner = table_at(model, name)
        if inner is not None and get_origin(field.annotation) is tuple and key in inner.model_fields:
            yield from ((entry, inner) for entry in table.get(name, []))


def _suggestion(key: str, model: type[Settings], rest: list[tuple[str, int | None]]) -> str:
    """The paths that end in this key, or else one of the same table that is near."""
    last = rest[-1][0] if rest else key
    ending = [path for path in _paths(Scenario) if path.rpartition(".")[2] == last][:3]
    if ending:
        return f"unknown key, did you mean {' or '.join(ending)}?"
    return unknown_key(key, model.model_fields)


def _paths(model: type[Settings], prefix: str = "") -> Iterator[str]:
    for key in model.model_fields:
        inner = table_at(model, key)
        if inner is None:
            yield prefix + key
        else:
            yield from _paths(inner, f"{prefix}{key}.")


def _parts(text: str) -> list[str]:
    """The text cut at the commas that are in no brackets and no quotes."""
    parts, depth, quote = [""], 0, ""
    for char in text:
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        else:
            depth += (char == "[") - (char == "]")
        if char == "," and not depth and not quote:
            parts.append("")
        else:
            parts[-1] += char
    return parts


def _value(text: str) -> Any:
    text = text.strip()
    try:
        found = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        if text.startswith("[") and text.endswith("]"):
            return [_value(part) for part in _parts(text[1:-1])]
        return text
    return found["value"] if len(found) == 1 else text
