"""What moves with the tracks: speed vectors, symbols, labels, truth, lost tracks; one batch of each."""

import math
from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen, QPixmap, QStaticText

from radar_console.core.geometry import to_polar
from radar_console.core.messages import Table, TrackStatus
from radar_console.core.units import FLIGHT_LEVEL
from radar_console.display import fonts, labels
from radar_console.display.furniture import qcolor
from radar_console.display.palette import Palette, mix
from radar_console.display.picture import Picture, name
from radar_console.display.projection import Projection
from radar_console.display.quantities import bearing, significant
from radar_console.display.view import Layer, SpeedUnit, View

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Boxes = list[tuple[float, float, float, float]]

SYMBOL, CROWDED_SYMBOL = 6.5, 5.0
"""Radius of a track's symbol, px; and in a crowd."""

CROWD = 250
"""More tracks on the screen than these are a crowd."""

_TILE = 20  # px, of a symbol's pixmap
_BRACKET = 12.0  # px, from the symbol's middle to the bracket
_MARGIN = 60.0  # px beyond the edge where a track may still reach into the screen
_PAD = 2.0  # px about a label's text


@dataclass(frozen=True, slots=True)
class Shown:
    """The tracks on the screen, in the order in which labels are placed.

    Attributes
    ----------
    rows : (n,) TRACK
    numbers : (n,) short numbers
    x, y : (n,) px
    tip_x, tip_y : (n,) ends of the speed vectors, px
    """

    rows: Table
    numbers: Integers
    x: Floats
    y: Floats
    tip_x: Floats
    tip_y: Floats

    @classmethod
    def of(cls, picture: Picture, view: View, on: Projection) -> "Shown":
        rows, numbers = picture.tracks, picture.numbers
        x, y = on.to_screen(rows["east"] - picture.position[0], rows["north"] - picture.position[1])
        inside = (np.abs(x - 0.5 * on.width) < 0.5 * on.width + _MARGIN) & (
            np.abs(y - 0.5 * on.height) < 0.5 * on.height + _MARGIN
        )
        selected = rows["track"] == (-1 if view.selected is None else view.selected)
        # The selected one chooses first, then the oldest: who comes new finds its place around them.
        order = np.lexsort((rows["track"], rows["status"] == TrackStatus.TENTATIVE, ~selected))
        order = order[inside[order]]
        rows, numbers, x, y = rows[order], numbers[order], x[order], y[order]
        ahead = view.vector_s * on.scale
        return cls(rows, numbers, x, y, x + rows["v_east"] * ahead, y - rows["v_north"] * ahead)


LIVED_TURNS = 12
"""A track that lived for fewer turns leaves no mark: M of N, and its last misses, take ten."""


class Overlay:
    """Paints the tracks; remembers where labels were and the texts that it has laid out.

    Attributes
    ----------
    hidden : labels that found no place, the last time
    """

    def __init__(self) -> None:
        self.hidden = 0
        self._lines = pg.Qt.internals.PrimitiveArray(QLineF, 4)
        self._texts: dict[tuple[str, bool], QStaticText] = {}
        self._placed: dict[int, int] = {}
        self._written: dict[int, tuple[tuple[float, int], tuple[str, ...]]] = {}
        self._written_for: tuple[int, SpeedUnit] | None = None
        self._symbols = QPixmap()
        self._symbols_for: tuple[Palette, float, float] | None = None
        self._radius = SYMBOL

    def paint(
        self,
        painter: QPainter,
        on: Projection,
        view: View,
        picture: Picture,
        palette: Palette,
        occupied: Boxes,
        detail: int,
    ) -> None:
        """Paint everything on a device whose pixels are those of `on`.

        `occupied` are boxes that labels should stay clear of; `detail` is that of the labels, which
        may be less than the operator's when the machine is short of time.
        """
        self.hidden = 0
        if view.shows(Layer.TRUTH):
            self._paint_truth(painter, on, picture, palette)
        if not view.shows(Layer.TRACKS):
            return
        shown = Shown.of(picture, view, on)
        known = np.count_nonzero(shown.rows["status"] != TrackStatus.TENTATIVE)
        self._radius = SYMBOL if known <= CROWD else CROWDED_SYMBOL
        self._paint_lost(painter, on, picture, palette)
        if view.shows(Layer.VECTORS):
            self._paint_vectors(painter, shown, palette)
        self._paint_symbols(painter, shown, palette)
        self._paint_bracket(painter, shown, view, palette)
        if view.shows(Layer.LABELS):
            self._paint_labels(painter, on, view, shown, palette, occupied, detail)
            self._paint_hidden(painter, on, palette)

    def _paint_truth(self, painter: QPainter, on: Projection, picture: Picture, palette: Palette) -> None:
        truth = picture.truth
        x, y = on.to_screen(truth["east"] - picture.position[0], truth["north"] - picture.position[1])
        painter.setPen(QPen(qcolor(palette.truth), 2.6, c=Qt.PenCapStyle.RoundCap))
        self._draw_lines(painter, x, y, x + 0.01, y)

    def _paint_lost(self, painter: QPainter, on: Projection, picture: Picture, palette: Palette) -> None:
        """A cross where a track was last, with its name."""
        rotation = picture.radar.rotation if picture.radar else 0.0
        # Those that lived for less were false: their end is no news.
        lived = ~(picture.lost["time"] - picture.lost["born"] < LIVED_TURNS * rotation)
        lost, numbers = picture.lost[lived], picture.lost_numbers[lived]
        x, y = on.to_screen(lost["east"] - picture.position[0], lost["north"] - picture.position[1])
        painter.setPen(QPen(qcolor(palette.alarm), 1.6))
        for side in (1.0, -1.0):
            self._draw_lines(painter, x - 5.0, y - 5.0 * side, x + 5.0, y + 5.0 * side)
        painter.setFont(fonts.font(fonts.SMALL))
        for k in range(len(lost)):
            text = self._text(f"{name(int(numbers[k]))} lost", False)
            painter.drawStaticText(QPointF(round(x[k] + 9.0), round(y[k] - 7.0)), text)

    def _paint_vectors(self, painter: QPainter, shown: Shown, palette: Palette) -> None:
        """From the rim of the symbol to where the track will be; dashed where it coasts.

        A tentative track has none: its first guess of a velocity says little, and clutter makes many.
        """
        dx, dy = shown.tip_x - shown.x, shown.tip_y - shown.y
        length = np.hypot(dx, dy)
        status = shown.rows["status"]
        painter.setPen(Qt.PenStyle.NoPen)
        for state, hue, style in (
            (TrackStatus.CONFIRMED, palette.track, Qt.PenStyle.SolidLine),
            (TrackStatus.COASTING, palette.coasting, Qt.PenStyle.DashLine),
        ):
            kept = (status == state) & (length > self._radius)
            part = self._radius / length[kept]
            painter.setPen(QPen(qcolor(hue, 0.9), 1.3, style))
            self._draw_lines(
                painter,
                shown.x[kept] + dx[kept] * part,
                shown.y[kept] + dy[kept] * part,
                shown.tip_x[kept],
                shown.tip_y[kept],
            )

    def _paint_symbols(self, painter: QPainter, shown: Shown, palette: Palette) -> None:
        """One pixmap holds the symbol of each status side by side."""
        ratio = painter.device().devicePixelRatioF()
        state = (palette, ratio, self._radius)
        if self._symbols_for != state:
            self._symbols, self._symbols_for = _symbol_tiles(*state), state
        count = len(shown.x)
        if count == 0:
            return
        fragments = pg.Qt.internals.PrimitiveArray(QPainter.PixmapFragment, 10)
        fragments.resize(count)
        table = fragments.ndarray()
        table[:, 0] = np.floor(shown.x * ratio) / ratio
        table[:, 1] = np.floor(shown.y * ratio) / ratio
        table[:, 2] = shown.rows["status"].astype(float) * _TILE * ratio
        table[:, 3] = 0.0
        table[:, 4:6] = _TILE * ratio
        table[:, 6:8] = 1.0 / ratio
        table[:, 8:] = (0.0, 1.0)
        first, amount = fragments.drawargs()
        painter.drawPixmapFragments(first, amount, self._symbols)

    def _paint_bracket(self, painter: QPainter, shown: Shown, view: View, palette: Palette) -> None:
        """Four corners about the selected track."""
        chosen = np.flatnonzero(shown.rows["track"] == view.selected) if view.selected is not None else ()
        for k in chosen:
            x, y = np.floor(shown.x[k]) + 0.5, np.floor(shown.y[k]) + 0.5
            corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]) * _BRACKET
            painter.setPen(QPen(qcolor(palette.selection), 1.6))
            for inward in ((0.55, 1.0), (1.0, 0.55)):
                ends = corners * inward
                self._draw_lines(
                    painter, x + corners[:, 0], y + corners[:, 1], x + ends[:, 0], y + ends[:, 1]
                )

    def _paint_labels(
        self,
        painter: QPainter,
        on: Projection,
        view: View,
        shown: Shown,
        palette: Palette,
        occupied: Boxes,
        detail: int,
    ) -> None:
        board = labels.board(on.width, on.height)
        known = shown.rows["status"] != TrackStatus.TENTATIVE
        labels.mark_symbols(board, shown.x[~known], shown.y[~known], 4.0, faint=True)
        x, y = shown.x[known], shown.y[known]
        labels.mark_symbols(board, x, y)
        if view.shows(Layer.VECTORS):
            labels.mark_lines(board, x, y, shown.tip_x[known], shown.tip_y[known])
        for box in occupied:
            labels.mark_box(board, *box)
        titled = shown.numbers > 0
        if view.selected is not None:
            titled = titled | (shown.rows["track"] == view.selected)
        kept = np.flatnonzero(titled)
        rows, x, y = shown.rows[kept], shown.x[kept], shown.y[kept]
        texts = self._write(rows, shown.numbers[kept], view, detail)
        metrics = QFontMetricsF(fonts.font(fonts.SMALL, bold=True))
        advance, line = metrics.horizontalAdvance("0"), metrics.height()
        sizes = _sizes(texts, advance, line)
        way = np.stack([rows["v_east"], -rows["v_north"]], axis=1)
        speed = np.hypot(way[:, 0], way[:, 1])
        way = way / np.maximum(speed, 1e-9)[:, None]
        previous = np.array([self._placed.get(t, labels.HIDDEN) for t in rows["track"].tolist()], np.int64)
        insist = (rows["track"] == (-1 if view.selected is None else view.selected)).astype(np.int64)
        place, level, left, top = labels.place(board, x, y, way, sizes, previous, insist)
        self._placed = dict(zip(rows["track"].tolist(), place.tolist(), strict=True))
        visible = np.flatnonzero(place != labels.HIDDEN)
        self.hidden = len(place) - len(visible)
        size = sizes[np.arange(len(place)), level]
        self._paint_grounds(painter, left[visible], top[visible], size[visible], palette)
        self._paint_leaders(
            painter, x[visible], y[visible], left[visible], top[visible], size[visible], palette
        )
        self._paint_texts(painter, texts, visible, level, left + _PAD, top + _PAD, line, insist, palette)

    def _paint_hidden(self, painter: QPainter, on: Projection, palette: Palette) -> None:
        """Bottom right: what density has taken away."""
        if self.hidden:
            text = f"{self.hidden} labels hidden" if self.hidden > 1 else "1 label hidden"
            painter.setFont(fonts.font(fonts.SMALL))
            painter.setPen(qcolor(palette.dim))
            box = QRectF(0.0, 0.0, on.width - 20.0, on.height - 16.0)
            painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom, text)

    def _paint_grounds(
        self, painter: QPainter, left: Floats, top: Floats, size: Floats, palette: Palette
    ) -> None:
        """Dim what lies below the text, so that it can be read over echoes."""
        if len(left) == 0:
            return
        boxes = pg.Qt.internals.PrimitiveArray(QRectF, 4)
        boxes.resize(len(left))
        table = boxes.ndarray()
        table[:, 0], table[:, 1] = np.round(left), np.round(top)
        table[:, 2:] = np.round(size)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(qcolor(palette.scope, 0.35))
        painter.drawRects(*boxes.drawargs())

    def _paint_leaders(
        self,
        painter: QPainter,
        x: Floats,
        y: Floats,
        left: Floats,
        top: Floats,
        size: Floats,
        palette: Palette,
    ) -> None:
        """From the rim of the symbol to the nearest point of the label."""
        end_x = np.clip(x, left, left + size[:, 0])
        end_y = np.clip(y, top, top + size[:, 1])
        dx, dy = end_x - x, end_y - y
        length = np.maximum(np.hypot(dx, dy), 1e-9)
        long = length > self._radius + 2.0
        part = self._radius / length
        painter.setPen(QPen(qcolor(mix(palette.scope, palette.track, 0.5)), 1.0))
        self._draw_lines(painter, (x + dx * part)[long], (y + dy * part)[long], end_x[long], end_y[long])

    def _paint_texts(
        self,
        painter: QPainter,
        texts: list[tuple[str, ...]],
        visible: Integers,
        level: Integers,
        left: Floats,
        top: Floats,
        line: float,
        strong: Integers,
        palette: Palette,
    ) -> None:
        """The names, then the lines below them: two passes, since a change of font costs most."""
        places = np.round(np.stack([left, top], axis=1)).tolist()
        painter.setFont(fonts.font(fonts.SMALL, bold=True))
        for chosen, hue in ((0, palette.text), (1, palette.bright)):
            painter.setPen(qcolor(hue))
            for k in visible[strong[visible] == chosen].tolist():
                painter.drawStaticText(QPointF(*places[k]), self._text(texts[k][0], True))
        painter.setFont(fonts.font(fonts.SMALL))
        painter.setPen(qcolor(palette.dim))
        for k in visible[level[visible] == 0].tolist():
            x, y = places[k]
            for number, text in enumerate(texts[k][1:], 1):
                painter.drawStaticText(QPointF(x, round(y + number * line)), self._text(text, False))

    def _write(self, rows: Table, numbers: Integers, view: View, detail: int) -> list[tuple[str, ...]]:
        """The labels' lines; a label is written anew only when its track has been updated."""
        state = (detail, view.speed_unit)
        if state != self._written_for:
            self._written, self._written_for = {}, state
        known, self._written = self._written, {}
        stamps = zip(rows["time"].tolist(), numbers.tolist(), strict=True)
        for k, (track, stamp) in enumerate(zip(rows["track"].tolist(), stamps, strict=True)):
            entry = known.get(track)
            if entry is None or entry[0] != stamp:
                speed, course = to_polar(rows["v_east"][k], rows["v_north"][k])
                height = float(rows["up"][k])
                entry = (stamp, label_text(stamp[1], float(speed), float(course), height, view, detail))
            self._written[track] = entry
        return [text for _, text in self._written.values()]

    def _text(self, text: str, bold: bool) -> QStaticText:
        """The text, laid out once."""
        known = self._texts.get((text, bold))
        if known is None:
            if len(self._texts) > 8000:
                self._texts.clear()
            known = QStaticText(text)
            known.setTextFormat(Qt.TextFormat.PlainText)
            known.setPerformanceHint(QStaticText.PerformanceHint.AggressiveCaching)
            known.prepare(font=fonts.font(fonts.SMALL, bold=bold))
            self._texts[text, bold] = known
        return known

    def _draw_lines(self, painter: QPainter, x0: Floats, y0: Floats, x1: Floats, y1: Floats) -> None:
        """(n,) separate lines in one call."""
        if len(x0) == 0:
            return
        self._lines.resize(len(x0))
        table = self._lines.ndarray()
        table[:, 0], table[:, 1], table[:, 2], table[:, 3] = x0, y0, x1, y1
        painter.drawLines(*self._lines.drawargs())


def label_text(
    number: int, speed: float, course: float, height: float, view: View, detail: int
) -> tuple[str, ...]:
    """The lines of a label: name; speed, m/s; course, rad, and flight level of a height, m."""
    title = name(number)
    if detail == 1:
        return (title,)
    pace = f"{significant(speed / view.speed_unit.metres_per_second)} {view.speed_unit}"
    if detail == 2:
        return title, pace
    level = "" if math.isnan(height) else f" FL{max(round(height / FLIGHT_LEVEL), 0):03d}"
    return title, pace, bearing(course) + level


def _sizes(texts: list[tuple[str, ...]], advance: float, line: float) -> Floats:
    """(n, 2, 2) width and height, px, of labels in full and of their names alone."""
    counts = np.array([(max(map(len, text)), len(text), len(text[0]), 1) for text in texts], float)
    return counts.reshape(-1, 2, 2) * (advance, line) + 2.0 * _PAD


def _symbol_tiles(palette: Palette, ratio: float, radius: float) -> QPixmap:
    """Symbols by status, side by side: tentative small and dim, confirmed full, coasting dashed."""
    tiles = QPixmap(round(_TILE * 4 * ratio), round(_TILE * ratio))
    tiles.fill(QColor(0, 0, 0, 0))
    painter = QPainter(tiles)
    painter.scale(ratio, ratio)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    middle = 0.5 * _TILE
    dashes = QPen(qcolor(palette.coasting), 1.6)
    dashes.setDashPattern([2.2, 1.9])
    for status, pen, part in (
        (TrackStatus.TENTATIVE, QPen(qcolor(palette.tentative, 0.8), 1.0), 0.5),
        (TrackStatus.CONFIRMED, QPen(qcolor(palette.track), 1.6), 1.0),
        (TrackStatus.COASTING, dashes, 1.0),
    ):
        painter.setPen(pen)
        at = QPointF(_TILE * int(status) + middle + 0.5, middle + 0.5)
        painter.drawEllipse(at, radius * part, radius * part)
    painter.end()
    return tiles
