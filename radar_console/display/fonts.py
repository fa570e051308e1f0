"""Fonts with tabular figures; found wherever the program runs, also without any system font.

The one choice is DejaVu, so that a picture looks the same everywhere. Where the system lacks it, it
is taken from matplotlib, which comes with filterpy and brings it along.
"""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from PySide6.QtGui import QFont, QFontDatabase

MONO, SANS = "DejaVu Sans Mono", "DejaVu Sans"
_FILES = ("DejaVuSansMono.ttf", "DejaVuSansMono-Bold.ttf", "DejaVuSans.ttf", "DejaVuSans-Bold.ttf")

SMALL, LARGE = 11, 13
"""The two sizes of text, px."""


def font(size: int = SMALL, bold: bool = False, family: str = MONO) -> QFont:
    """A font of the house; `size` in px."""
    _load()
    result = QFont(family)
    result.setPixelSize(size)
    result.setBold(bold)
    result.setHintingPreference(QFont.HintingPreference.PreferVerticalHinting)
    fallback = QFont.StyleHint.Monospace if family == MONO else QFont.StyleHint.SansSerif
    result.setStyleHint(fallback)
    return result


@cache
def _load() -> None:
    """Make the fonts known to Qt, once, where the system does not."""
    missing = {MONO, SANS} - set(QFontDatabase.families())
    matplotlib = find_spec("matplotlib")
    if not missing or matplotlib is None or matplotlib.origin is None:
        return
    folder = Path(matplotlib.origin).parent / "mpl-data" / "fonts" / "ttf"
    for file in _FILES:
        QFontDatabase.addApplicationFont(str(folder / file))
