"""What the operator chose last time: a small JSON file that can be read, mended or deleted.

A file that can't be understood is set aside under another name; the console starts as new.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Settings:
    """What is kept from one start to the next.

    Attributes
    ----------
    palette : name of a palette
    hidden_layers : those that are switched off
    label_detail : 1 … 3
    window : width and height, px
    panel : width of the side panel, px
    """

    palette: str = "night"
    hidden_layers: tuple[str, ...] = ()
    label_detail: int = 2
    window: tuple[int, int] = (1680, 1000)
    panel: int = 600


def load(file: Path) -> tuple[Settings, str]:
    """The settings, and a sentence if the file had to be set aside."""
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        return Settings(), ""
    except (OSError, UnicodeDecodeError) as error:
        return Settings(), _set_aside(file, str(error))
    try:
        return _parsed(json.loads(text)), ""
    except ValueError as error:
        return Settings(), _set_aside(file, str(error))


def save(settings: Settings, file: Path) -> str:
    """Write them; a sentence if that failed."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(asdict(settings), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        return f"{file}: the settings can't be written: {error.strerror}"
    return ""


def _parsed(raw: Any) -> Settings:
    """Raises ValueError with what is wrong."""
    if not isinstance(raw, Mapping):
        raise ValueError("expected an object")
    known = {field.name for field in fields(Settings)}
    chosen: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in raw.items()
    }
    settings = Settings(**{key: value for key, value in chosen.items() if key in known})
    for ok, key in (
        (isinstance(settings.palette, str), "palette"),
        (_all(settings.hidden_layers, str), "hidden_layers"),
        (settings.label_detail in (1, 2, 3), "label_detail"),
        (_all(settings.window, int) and len(settings.window) == 2 and min(settings.window) > 0, "window"),
        (isinstance(settings.panel, int) and settings.panel > 0, "panel"),
    ):
        if not ok:
            raise ValueError(f"{key}: found {getattr(settings, key)!r}")
    return settings


def _all(values: object, kind: type) -> bool:
    return isinstance(values, tuple) and all(isinstance(value, kind) for value in values)


def _set_aside(file: Path, reason: str) -> str:
    aside = file.with_suffix(".bad")
    try:
        file.replace(aside)
    except OSError:
        return f"{file}: the settings can't be read ({reason}) and are ignored"
    return f"{file}: the settings can't be read ({reason}); set aside as {aside.name}"
