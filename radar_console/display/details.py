"""What is known of the selected track: every figure with its unit, and the history of its speed."""

import math
from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from radar_console.core.geometry import LocalFrame
from radar_console.core.messages import Table, TrackStatus
from radar_console.display import fonts, quantities
from radar_console.display.logbook import ENTRY, Logbook
from radar_console.display.palette import NIGHT, Palette, mix
from radar_console.display.picture import Picture
from radar_console.display.tracktable import INDENT, kinematics
from radar_console.display.view import SpeedUnit, View

SPEED_HISTORY_S = 240.0

_FIELDS = (
    ("range", "bearing", "speed", "course", "height", "place"),
    ("position", "velocity", "probability", "hits", "updated", "code"),
)


class Details(QWidget):
    """The figures of one track in two columns, and below them its speed."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.name = QLabel()
        self.name.setObjectName("name")
        self.state = QLabel()
        self.state.setObjectName("figures")
        self.values: dict[str, QLabel] = {}
        self.speed = SpeedHistory()
        self._lay_out()

    def set_colours(self, palette: Palette) -> None:
        self.speed.colours = palette
        self.speed.update()

    def update_from(self, picture: Picture, view: View, logbook: Logbook, frame: LocalFrame | None) -> None:
        """Show the selected track, or that there is none."""
        row = picture.row_of(view.selected) if view.selected is not None else None
        self.name.setText(self._heading(picture, view))
        entries = logbook.of(view.selected) if view.selected is not None else np.empty(0, ENTRY)
        if row is None:
            self.state.setText(
                self.tr("click a track, or press N")
                if view.selected is None
                else self.tr("lost; last position marked")
            )
            for label in self.values.values():
                label.setText(quantities.NONE)
        else:
            track = picture.tracks[row : row + 1]
            status = TrackStatus(int(track["status"][0])).name.lower()
            age = quantities.duration(picture.time - float(track["born"][0]))
            self.state.setText(f"{self.tr(status)} · {self.tr('age')} {age}")
            for field, text in self._texts(track, picture, view, entries, frame).items():
                self.values[field].setText(text)
        self.speed.show_entries(entries, picture.time, view.speed_unit)

    def _heading(self, picture: Picture, view: View) -> str:
        if view.selected is None:
            return self.tr("No track selected")
        return picture.name_of(view.selected) or self.tr("tentative")

    def _texts(
        self, track: Table, picture: Picture, view: View, entries: Table, frame: LocalFrame | None
    ) -> dict[str, str]:
        distance, azimuth, speed, course = (float(value[0]) for value in kinematics(track, picture.position))
        one: Any = track[0]
        unit, speed_unit = view.range_unit, view.speed_unit
        spread = _spread(one) / speed_unit.metres_per_second
        texts = {
            "range": f"{quantities.significant(distance / unit.metres)} {unit}",
            "bearing": quantities.bearing(azimuth, 1),
            "speed": f"{quantities.significant(speed / speed_unit.metres_per_second)} {speed_unit}",
            "course": quantities.bearing(course, 1),
            "height": self._height(one),
            "place": self._place(one, frame),
            "position": f"± {_metres(one['sd_east'])} E  ± {_metres(one['sd_north'])} N",
            "velocity": f"± {quantities.significant(spread)} {speed_unit}",
            "code": f"{int(one['mode_3a']):04o}" if one["mode_3a"] >= 0 else self.tr("none"),
        }
        return texts | self._passes(entries, picture.time)

    def _passes(self, entries: Table, now: float) -> dict[str, str]:
        """Of the last passes: hits, the last plot and when it came."""
        hits = entries[entries["hit"]]
        if not len(hits):
            return {"hits": quantities.NONE, "probability": quantities.NONE, "updated": quantities.NONE}
        last = hits[-1]
        ago, latency = now - float(last["plot_time"]), float(last["latency"])
        probability = f"{float(last['probability']):.2f}"
        return {
            "hits": f"{len(hits)} {self.tr('of')} {len(entries)} {self.tr('passes')}",
            "probability": probability if math.isfinite(float(last["probability"])) else quantities.NONE,
            "updated": f"{ago:.1f} s {self.tr('ago')}, {self.tr('in')} {quantities.significant(latency)} s",
        }

    def _height(self, one: Any) -> str:
        if not math.isfinite(one["up"]):
            return self.tr("not measured")
        spread = f" ± {one['sd_up']:.0f}" if math.isfinite(one["sd_up"]) else ""
        return f"{quantities.count(one['up'])}{spread} m"

    def _place(self, one: Any, frame: LocalFrame | None) -> str:
        if frame is None:
            return self.tr("site unknown")
        latitude, longitude = frame.to_wgs84(one["east"], one["north"])
        return quantities.place(float(latitude), float(longitude))

    def _lay_out(self) -> None:
        captions = {
            "range": self.tr("Range"),
            "bearing": self.tr("Bearing"),
            "speed": self.tr("Speed"),
            "course": self.tr("Course"),
            "height": self.tr("Height"),
            "place": self.tr("Position"),
            "position": self.tr("σ position"),
            "velocity": self.tr("σ speed"),
            "probability": self.tr("Plot probability"),
            "hits": self.tr("Hits"),
            "updated": self.tr("Last plot"),
            "code": self.tr("Mode 3/A"),
        }
        top = QHBoxLayout()
        top.addWidget(self.name)
        top.addStretch()
        top.addWidget(self.state)
        grid = QGridLayout()
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(6)
        for side, fields in enumerate(_FIELDS):
            grid.setColumnMinimumWidth(2 * side, 60 if side == 0 else 92)
            grid.setColumnStretch(2 * side + 1, 1)
            for line, field in enumerate(fields):
                caption, value = QLabel(captions[field]), QLabel(quantities.NONE)
                caption.setObjectName("caption")
                value.setObjectName("value")
                value.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
                value.setFocusPolicy(Qt.FocusPolicy.NoFocus)
                self.values[field] = value
                grid.addWidget(caption, line, 2 * side)
                grid.addWidget(value, line, 2 * side + 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(INDENT, 0, INDENT, 0)
        layout.setSpacing(10)
        layout.addLayout(top)
        layout.addLayout(grid)
        layout.addWidget(self.speed)


class SpeedHistory(QWidget):
    """The speed of the selected track over the last minutes."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.colours = NIGHT
        self._entries: Table = np.empty(0, ENTRY)
        self._now = math.nan
        self._unit = SpeedUnit.KMH
        self.setFixedHeight(92)

    def show_entries(self, entries: Table, now: float, unit: SpeedUnit) -> None:
        self._entries, self._now, self._unit = entries[entries["time"] > now - SPEED_HISTORY_S], now, unit
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        colours = self.colours
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(*mix(colours.panel, colours.background, 0.6)))
        painter.setFont(fonts.font(family=fonts.SANS))
        painter.setPen(QColor(*colours.dim))
        inner = QRectF(self.rect()).adjusted(8, 6, -8, -6)
        painter.drawText(
            inner,
            Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop,
            f"{self.tr('Speed')}, {self._unit}",
        )
        painter.drawText(
            inner, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop, self.tr("last 4 min")
        )
        if len(self._entries) > 1:
            self._draw(painter, inner.adjusted(44, 22, 0, -4), colours)
        painter.end()

    def _draw(self, painter: QPainter, box: QRectF, colours: Palette) -> None:
        speed = self._entries["speed"] / self._unit.metres_per_second
        # The first passes of a track may show any speed; they must not flatten the rest.
        low, high = _round_span(*(float(value) for value in np.quantile(speed, [0.05, 0.95])))
        x = box.right() + (self._entries["time"] - self._now) / SPEED_HISTORY_S * box.width()
        y = box.bottom() - np.clip((speed - low) / (high - low), 0.0, 1.0) * box.height()
        painter.setPen(QPen(QColor(*colours.hairline), 1))
        for level in (box.top(), box.bottom()):
            painter.drawLine(QPointF(box.left(), level), QPointF(box.right(), level))
        painter.setFont(fonts.font())
        painter.setPen(QColor(*colours.dim))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for level, value in ((box.top(), high), (box.bottom(), low)):
            painter.drawText(QRectF(box.left() - 44, level - 8, 36, 16), right, f"{value:g}")
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(*colours.track), 1.4))
        painter.drawPolyline(QPolygonF([QPointF(*point) for point in zip(x, y, strict=True)]))


def _round_span(low: float, high: float) -> tuple[float, float]:
    """Round limits that hold low and high, never closer than a tenth of the value."""
    middle, span = 0.5 * (low + high), max(high - low, 0.1 * abs(high), 1e-3)
    step = 10.0 ** math.floor(math.log10(span))
    return (
        max(math.floor((middle - 0.5 * span) / step) * step, 0.0),
        math.ceil((middle + 0.5 * span) / step) * step,
    )


def _spread(one: Any) -> float:
    """Standard deviation of the speed, m/s, as if east and north were uncorrelated."""
    v, sd = np.array([one["v_east"], one["v_north"]]), np.array([one["sd_v_east"], one["sd_v_north"]])
    speed = float(np.hypot(*v))
    return float(np.hypot(*(v * sd)) / speed) if speed > 0.0 else float(sd.max())


def _metres(value: float) -> str:
    if not math.isfinite(value):
        return quantities.NONE
    if value >= 1000.0:
        return f"{value / 1000.0:.1f} km"
    return f"{value:.0f} m" if value >= 9.95 else f"{value:.1f} m"
