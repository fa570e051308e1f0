"""Everything the operator can do, with its key: menus, shortcuts and the cheat sheet are made from it.

To add an action, add a line to `ACTIONS`; then run `python -m radar_console.display.actions` and put
what it prints into `docs/console.md` (a test compares them).
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication

from radar_console.display.view import Layer

if TYPE_CHECKING:
    from radar_console.display.window import ConsoleWindow

AFTERGLOWS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
TRAILS = (0.0, 30.0, 60.0, 120.0, 180.0, 300.0, 600.0)
VECTORS = (0.0, 30.0, 60.0, 120.0, 180.0, 300.0, 600.0)
RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
LABEL_DETAILS = (1, 2, 3)

_CONTEXT = "Actions"


@dataclass(frozen=True, slots=True)
class Action:
    """One thing the operator can do.

    Attributes
    ----------
    name : of the action, stable; the settings and the tests use it
    group, text : as the cheat sheet shows them, before translation
    keys : Qt key sequences in their portable form; the first is the one that is shown
    run : does it to a window
    pointer : what the mouse does for the same; empty if nothing
    """

    name: str
    group: str
    text: str
    keys: tuple[str, ...]
    run: "Callable[[ConsoleWindow], None]"
    pointer: str = ""

    @property
    def label(self) -> str:
        return QCoreApplication.translate(_CONTEXT, self.text)

    @property
    def heading(self) -> str:
        return QCoreApplication.translate(_CONTEXT, self.group)


def step(ladder: Sequence[float], value: float, direction: int) -> float:
    """The next rung above (+1) or below (−1) `value`; the last rung stays."""
    if direction > 0:
        return ladder[min(bisect_right(ladder, value), len(ladder) - 1)]
    return ladder[max(bisect_left(ladder, value) - 1, 0)]


def QT_TRANSLATE_NOOP(context: str, text: str) -> str:
    """Marks a text for Qt's tools, which look for this name; Qt's own function is typed as an object."""
    return text


def _layer(key: str, layer: Layer, text: str) -> Action:
    return Action(f"layer_{layer}", _LAYERS, text, (key,), lambda window: window.toggle_layer(layer))


_RANGE = QT_TRANSLATE_NOOP("Actions", "Range")
_PLAYBACK = QT_TRANSLATE_NOOP("Actions", "Playback")
_TRACKS = QT_TRANSLATE_NOOP("Actions", "Tracks")
_LAYERS = QT_TRANSLATE_NOOP("Actions", "Layers")
_LOOK = QT_TRANSLATE_NOOP("Actions", "Look")
_WINDOW = QT_TRANSLATE_NOOP("Actions", "Window")

ACTIONS: tuple[Action, ...] = (
    Action(
        "range_in",
        _RANGE,
        QT_TRANSLATE_NOOP("Actions", "smaller range scale"),
        ("+", "="),
        lambda window: window.zoom(-1),
        "wheel",
    ),
    Action(
        "range_out",
        _RANGE,
        QT_TRANSLATE_NOOP("Actions", "larger range scale"),
        ("-",),
        lambda window: window.zoom(+1),
        "wheel",
    ),
    Action(
        "centre",
        _RANGE,
        QT_TRANSLATE_NOOP("Actions", "radar in the centre"),
        ("C", "Home"),
        lambda window: window.reset_centre(),
        "drag moves it",
    ),
    Action(
        "fit",
        _RANGE,
        QT_TRANSLATE_NOOP("Actions", "whole coverage"),
        ("0",),
        lambda window: window.fit(),
    ),
    Action(
        "pause",
        _PLAYBACK,
        QT_TRANSLATE_NOOP("Actions", "pause, go on"),
        ("Space",),
        lambda window: window.toggle_pause(),
    ),
    Action(
        "faster",
        _PLAYBACK,
        QT_TRANSLATE_NOOP("Actions", "faster"),
        (".", ">"),
        lambda window: window.change_rate(+1),
    ),
    Action(
        "slower",
        _PLAYBACK,
        QT_TRANSLATE_NOOP("Actions", "slower"),
        (",", "<"),
        lambda window: window.change_rate(-1),
    ),
    Action(
        "real_time",
        _PLAYBACK,
        QT_TRANSLATE_NOOP("Actions", "real time"),
        ("R",),
        lambda window: window.set_rate(1.0),
    ),
    Action(
        "next_track",
        _TRACKS,
        QT_TRANSLATE_NOOP("Actions", "next track of the table"),
        ("N",),
        lambda window: window.select_neighbour(+1),
        "click a track or its row",
    ),
    Action(
        "previous_track",
        _TRACKS,
        QT_TRANSLATE_NOOP("Actions", "previous track of the table"),
        ("Shift+N",),
        lambda window: window.select_neighbour(-1),
    ),
    Action(
        "deselect",
        _TRACKS,
        QT_TRANSLATE_NOOP("Actions", "select none; leave help, filter, full screen"),
        ("Esc",),
        lambda window: window.escape(),
        "click beside the tracks",
    ),
    Action(
        "filter",
        _TRACKS,
        QT_TRANSLATE_NOOP("Actions", "filter the table"),
        ("/", "Ctrl+F"),
        lambda window: window.focus_filter(),
    ),
    Action(
        "labels",
        _TRACKS,
        QT_TRANSLATE_NOOP("Actions", "label detail: name, speed, course and height"),
        ("L",),
        lambda window: window.next_label_detail(),
    ),
    _layer("1", Layer.PLOTS, QT_TRANSLATE_NOOP("Actions", "plots and their afterglow")),
    _layer("2", Layer.CENTROIDS, QT_TRANSLATE_NOOP("Actions", "centroids")),
    _layer("3", Layer.TRACKS, QT_TRANSLATE_NOOP("Actions", "tracks")),
    _layer("4", Layer.TRAILS, QT_TRANSLATE_NOOP("Actions", "trails")),
    _layer("5", Layer.VECTORS, QT_TRANSLATE_NOOP("Actions", "speed vectors")),
    _layer("6", Layer.LABELS, QT_TRANSLATE_NOOP("Actions", "labels")),
    _layer("7", Layer.TRUTH, QT_TRANSLATE_NOOP("Actions", "truth of a simulation")),
    _layer("8", Layer.MAP, QT_TRANSLATE_NOOP("Actions", "map")),
    _layer("9", Layer.GRID, QT_TRANSLATE_NOOP("Actions", "range rings and bearings")),
    _layer("W", Layer.SWEEP, QT_TRANSLATE_NOOP("Actions", "sweep")),
    Action(
        "afterglow_longer",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "longer afterglow"),
        ("G",),
        lambda window: window.change_afterglow(+1),
    ),
    Action(
        "afterglow_shorter",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "shorter afterglow, then off"),
        ("Shift+G",),
        lambda window: window.change_afterglow(-1),
    ),
    Action(
        "trail_longer",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "longer trails"),
        ("T",),
        lambda window: window.change_trail(+1),
    ),
    Action(
        "trail_shorter",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "shorter trails, then off"),
        ("Shift+T",),
        lambda window: window.change_trail(-1),
    ),
    Action(
        "vector_longer",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "longer speed vectors"),
        ("V",),
        lambda window: window.change_vector(+1),
    ),
    Action(
        "vector_shorter",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "shorter speed vectors, then off"),
        ("Shift+V",),
        lambda window: window.change_vector(-1),
    ),
    Action(
        "palette",
        _LOOK,
        QT_TRANSLATE_NOOP("Actions", "next palette"),
        ("P",),
        lambda window: window.next_palette(),
    ),
    Action(
        "screenshot",
        _WINDOW,
        QT_TRANSLATE_NOOP("Actions", "picture of the window to a file"),
        ("S",),
        lambda window: window.save_picture(),
    ),
    Action(
        "full_screen",
        _WINDOW,
        QT_TRANSLATE_NOOP("Actions", "full screen"),
        ("F11", "F"),
        lambda window: window.toggle_full_screen(),
    ),
    Action(
        "help",
        _WINDOW,
        QT_TRANSLATE_NOOP("Actions", "this list of keys"),
        ("?", "F1"),
        lambda window: window.toggle_help(),
    ),
    Action(
        "quit",
        _WINDOW,
        QT_TRANSLATE_NOOP("Actions", "quit"),
        ("Ctrl+Q",),
        lambda window: window.quit(),
    ),
)


def grouped(actions: Iterable[Action] = ACTIONS) -> list[tuple[str, list[Action]]]:
    """The headings in their order, each with its actions."""
    return [(heading, list(members)) for heading, members in groupby(actions, lambda action: action.heading)]


def markdown() -> str:
    """The table of keys, for the operator's page."""
    rows = ["| | key | also | mouse |", "|---|---|---|---|"]
    for heading, members in grouped():
        rows.append(f"| **{heading}** | | | |")
        for action in members:
            first, *others = (f"`{key}`" for key in action.keys)
            rows.append(f"| {action.label} | {first} | {', '.join(others)} | {action.pointer} |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(markdown(), end="")
