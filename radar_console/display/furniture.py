"""What stands still on the scope: the disc, the map, rings, spokes, bearings, the title."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter

from radar_console.core.units import DEG
from radar_console.display import fonts, strokes
from radar_console.display.palette import Colour, Palette, mix
from radar_console.display.projection import Projection
from radar_console.display.strokes import Pixels
from radar_console.display.view import View

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, top, width, height, px."""
Boxes = list[Box]
Map = Mapping[str, Sequence[NDArray[np.floating]]]

MAP_STYLES: dict[str, tuple[str, strokes.Dash]] = {
    "coast": ("coast", strokes.SOLID),
    "border": ("border", (7.0, 4.0)),
    "user": ("own_map", strokes.SOLID),
}
"""Name in the palette and dash of each layer of a map; layers of other names look like the user's."""

TITLE: Box = (0.0, 0.0, 280.0, 56.0)
"""Kept free for the title, px."""

_MOST_RINGS = 100
_TICK, _LONG_TICK = 5.0, 9.0  # px
_BEARING_OUT = 25.0  # px from the rim to the middle of a bearing's figures
_GAP = 3.0  # px, at least, between two texts
_INSET = 18.0  # px from the edge of the screen, where a spoke leaves it


class Lines:
    """One layer of the map: polylines one after the other in one array, m."""

    def __init__(self, polylines: Sequence[NDArray[np.floating]]) -> None:
        lines = [line for line in polylines if len(line) > 1]
        self.points = np.concatenate([np.empty((0, 2)), *lines])
        self.marks = np.concatenate([np.empty((0, 2)), *(line for line in polylines if len(line) == 1)])
        self.starts = np.zeros(len(self.points), bool)
        self.starts[np.cumsum([0, *(len(line) for line in lines)])[:-1]] = True

    def draw(
        self, pixels: Pixels, on: Projection, radar: tuple[float, float], hue: Colour, dash: strokes.Dash
    ) -> None:
        """Draw as it lies about a radar, m east and north; a single point is a small cross."""
        x, y = on.to_screen(self.points[:, 0] - radar[0], self.points[:, 1] - radar[1])
        strokes.draw(pixels, x, y, self.starts, packed(hue), np.ones(len(x)), dash)
        x, y = on.to_screen(self.marks[:, 0] - radar[0], self.marks[:, 1] - radar[1])
        for dx, dy in ((4.0, 0.0), (0.0, 4.0)):
            pairs(pixels, x - dx, y - dy, x + dx, y + dy, hue, 1.0)


def packed(hue: Colour) -> int:
    """0xRRGGBB"""
    return hue[0] << 16 | hue[1] << 8 | hue[2]


def qcolor(hue: Colour, opacity: float = 1.0) -> QColor:
    """The same colour for Qt."""
    return QColor(*hue, round(255 * opacity))


def pairs(
    pixels: Pixels, x0: Floats, y0: Floats, x1: Floats, y1: Floats, hue: Colour, opacity: float
) -> None:
    """Separate lines from (n,) x0, y0 to x1, y1."""
    x, y = np.stack([x0, x1], axis=1).ravel(), np.stack([y0, y1], axis=1).ravel()
    starts = np.tile(np.array([True, False]), len(x0))
    strokes.draw(pixels, x, y, starts, packed(hue), np.full(len(x), opacity))


def draw_disc(painter: QPainter, on: Projection, view: View, palette: Palette) -> None:
    """The scope's ground, inside the rim."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(qcolor(palette.scope))
    rim = view.range_m * on.scale
    painter.drawEllipse(QPointF(on.x0, on.y0), rim, rim)


def draw_grid(
    pixels: Pixels, on: Projection, view: View, palette: Palette, coverage: float, ratio: float
) -> None:
    """Rings and spokes about the radar, the rim with its ticks.

    Parameters
    ----------
    on : projection to the pixels of the device
    coverage : instrumented range, m; rings beyond the rim go as far
    ratio : pixels of the device in one of the widget
    """
    for radius in ring_radii(on, view, coverage):
        is_rim = abs(radius - view.range_m) < 1e-6 * radius
        x, y = strokes.circle(on.x0, on.y0, radius * on.scale)
        hue = mix(palette.ring, palette.ring_text, 0.25) if is_rim else palette.ring
        strokes.draw(pixels, x, y, np.zeros(len(x), bool), packed(hue), np.ones(len(x)))
    rim = view.range_m * on.scale
    first = min(view.ring_spacing_m, view.range_m) * on.scale
    end = max(view.range_m, min(on.reach, coverage)) * on.scale
    spokes = np.radians(np.arange(0.0, 360.0, 30.0))
    _rays(pixels, on, spokes, first, end, palette.ring)
    ticks = np.radians(np.arange(0.0, 360.0, 10.0))
    _rays(pixels, on, ticks, rim, rim + _TICK * ratio, mix(palette.ring, palette.ring_text, 0.5))
    _rays(pixels, on, spokes, rim, rim + _LONG_TICK * ratio, palette.ring_text)


def draw_figures(painter: QPainter, on: Projection, view: View, palette: Palette, coverage: float) -> Boxes:
    """Bearings outside the rim and ranges along a spoke; returns their boxes, px."""
    boxes: Boxes = []
    painter.setPen(qcolor(palette.ring_text))
    painter.setFont(fonts.font(fonts.LARGE))
    metrics = QFontMetricsF(painter.font())
    for degrees in range(0, 360, 30):
        place = _bearing_place(on, degrees * DEG, view.range_m * on.scale + _BEARING_OUT)
        if place is None:
            continue
        text = f"{degrees:03d}"
        width, height = metrics.horizontalAdvance(text), metrics.capHeight()
        box = (place[0] - 0.5 * width, place[1] - 0.5 * height, width, height)
        if not _touches(box, TITLE):
            painter.drawText(QPointF(round(box[0]), round(box[1] + height)), text)
            boxes.append(box)
    painter.setFont(fonts.font(fonts.SMALL))
    metrics = QFontMetricsF(painter.font())
    spoke, ranges = _readable_spoke(on, view, coverage)
    for radius in ranges:
        text = f"{round(radius / view.range_unit.metres, 6):g} {view.range_unit}"
        x, y = _at(on, spoke, radius * on.scale)
        box = (float(x) + 5.0, float(y) + 3.0, metrics.horizontalAdvance(text), metrics.height())
        if not any(_touches(box, other) for other in (*boxes, TITLE)):
            painter.drawText(QPointF(round(box[0]), round(box[1] + metrics.ascent())), text)
            boxes.append(box)
    return boxes


def _touches(one: Box, other: Box) -> bool:
    """Two boxes overlap, or nearly."""
    near = all(one[k] < other[k] + other[k + 2] + _GAP for k in (0, 1))
    return near and all(other[k] < one[k] + one[k + 2] + _GAP for k in (0, 1))


def draw_title(painter: QPainter, palette: Palette, title: str, subtitle: str) -> None:
    """Top left: what is shown, and where it comes from."""
    painter.setFont(fonts.font(fonts.LARGE, bold=True, family=fonts.SANS))
    painter.setPen(qcolor(palette.bright))
    painter.drawText(QPointF(20.0, 30.0), title)
    painter.setFont(fonts.font(fonts.SMALL, family=fonts.SANS))
    painter.setPen(qcolor(palette.dim))
    painter.drawText(QPointF(20.0, 48.0), subtitle)


def ring_radii(on: Projection, view: View, coverage: float) -> Floats:
    """Radii of the rings, m: to the rim, and beyond it as far as screen and coverage go."""
    step = view.ring_spacing_m
    edge = min(on.reach, coverage)
    count = math.floor(max(view.range_m, edge) / step + 1e-9)
    low = 0 if count <= _MOST_RINGS else count - _MOST_RINGS
    radii = step * np.arange(low + 1, count + 1)
    extra = [radius for radius in (view.range_m, coverage) if radius <= max(edge, view.range_m)]
    return np.unique(np.round(np.concatenate([radii, extra]), 3))


def _rays(pixels: Pixels, on: Projection, azimuth: Floats, begin: float, end: float, hue: Colour) -> None:
    (x0, y0), (x1, y1) = _at(on, azimuth, begin), _at(on, azimuth, end)
    pairs(pixels, x0, y0, x1, y1, hue, 1.0)


def _at(on: Projection, azimuth: Floats | float, radius: float) -> tuple[Floats, Floats]:
    """The pixel at an azimuth and a distance, px, from the radar."""
    return on.x0 + radius * np.sin(azimuth), on.y0 - radius * np.cos(azimuth)


def _readable_spoke(on: Projection, view: View, coverage: float) -> tuple[float, Floats]:
    """The spoke on which clearly most ring figures are on the screen, else north; and their radii, m."""
    radii = ring_radii(on, view, coverage)
    radii = radii[np.abs(radii / view.ring_spacing_m - np.round(radii / view.ring_spacing_m)) < 1e-6]
    best, seen = 0.0, radii[:0]  # north comes first, and is left only for a much better one
    for degrees in (0, 330, 30, 300, 60, 270, 90, 240, 120, 210, 150, 180):
        x, y = _at(on, degrees * DEG, 1.0)
        x, y = on.x0 + (x - on.x0) * radii * on.scale, on.y0 + (y - on.y0) * radii * on.scale
        inside = (x > 4.0) & (x < on.width - 70.0) & (y > 4.0) & (y < on.height - 24.0)
        if inside.sum() > len(seen) * (1.0 if best else 1.6):
            best, seen = degrees * DEG, radii[inside]
    return best, seen


def _bearing_place(on: Projection, azimuth: float, radius: float) -> tuple[float, float] | None:
    """Where a bearing is written: outside the rim, or where its spoke leaves the screen."""
    way = (math.sin(azimuth), -math.cos(azimuth))
    enter, leave = 0.0, radius
    for start, step, size in ((on.x0, way[0], on.width), (on.y0, way[1], on.height)):
        low, high = _INSET - start, size - _INSET - start
        if abs(step) < 1e-9:
            if not low <= 0.0 <= high:
                return None
            continue
        near, far = sorted((low / step, high / step))
        enter, leave = max(enter, near), min(leave, far)
    if leave <= enter or leave < 60.0:
        return None
    return on.x0 + way[0] * leave, on.y0 + way[1] * leave
