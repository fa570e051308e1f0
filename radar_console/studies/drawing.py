"""How figures of studies look: one style for all, and where they are written."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from radar_console.studies.work import Work

# Okabe and Ito's colours, which the colour-blind tell apart too.
BLUE, RED, GREEN, ORANGE, PURPLE, SKY = "#0072B2", "#C4501B", "#009E73", "#E69F00", "#A05A8C", "#56B4E9"
INK, GREY, PALE = "#2B2F33", "#7A828A", "#E6E9EC"
ORDER = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY)

STYLE: Any = {
    "figure.dpi": 110,
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "text.color": INK,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.prop_cycle": cycler("color", ORDER),
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "xtick.color": INK,
    "ytick.color": INK,
    "lines.linewidth": 1.6,
    "lines.markersize": 5,
    "legend.frameon": False,
    "savefig.facecolor": "white",
}


@contextmanager
def figure(
    work: Work, name: str, columns: int = 1, rows: int = 1, **more: Any
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure with axes side by side, row after row, written to `name`.png at the end.

    Parameters
    ----------
    columns, rows : how many axes
    more : for `Figure.subplots`; `size` (width, height) in inches
    """
    size = more.pop("size", (8.6, 4.2))
    with mpl.rc_context(STYLE):
        drawn = Figure(figsize=size)
        axes = drawn.subplots(rows, columns, squeeze=False, **more).ravel().tolist()
        yield drawn, axes
        drawn.savefig(work.folder / f"{name}.png", metadata={"Software": None})
    work.figures.append(f"{name}.png")
