"""The bar at the bottom: what time it is, what the screen shows, and how well the console keeps up.

Drops and ages are never hidden. Every field has a fixed width, so that nothing moves when a figure
gets a digit more.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from radar_console.display import fonts, quantities

OLD_S, TOO_OLD_S = 1.0, 3.0  # age of the newest data: a warning, an alarm
DEEP = 32  # waiting sectors: a warning
HEIGHT = 34
_MARGIN, _SPACING = 20, 26


@dataclass(frozen=True, slots=True)
class Status:
    """What the bar says.

    Attributes
    ----------
    moment : date and time of day, or data time
    rate, paused, finished : of the playback
    rotation_s : measured time of a turn; NaN unknown
    range_scale : such as ``300 km``
    cursor : range, bearing and place under the pointer; empty if it is elsewhere
    tracker : its name
    fps : frames painted a second
    age_s : wall time since the newest data came; NaN before any
    depth : sectors that wait, in all queues
    sectors_dropped, returns_dropped : lost because something was too slow
    skipped : what could not be used, counted by reason
    stalled : the encoder stands still
    reduced : what the governor has taken back; empty if nothing
    """

    moment: str
    rate: float
    paused: bool
    finished: bool
    rotation_s: float
    range_scale: str
    cursor: str
    tracker: str
    fps: float
    age_s: float
    depth: int
    sectors_dropped: int
    returns_dropped: int
    skipped: Mapping[str, int]
    stalled: bool
    reduced: str = ""


class StatusBar(QWidget):
    """Labels in a row; `show_status` writes them."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("status")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedHeight(HEIGHT)
        self.setMinimumWidth(1)  # a longer text must not push the window wider
        self.moment = self._field("+0:00:00")
        self.rate = self._field("×0.25")
        self.rotation = self._field("15.0 rpm")
        self.scale = self._field("range 0.75 NM")
        self.cursor_field = self._field("")
        self.reduced = self._field("")
        self.tracker = self._field("")
        self.fps = self._field("60 fps")
        self.age = self._field("data 0.05 s")
        self.depth_field = self._field("queue 64")
        self.skipped = self._field("")
        self.drops = self._field("")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(_MARGIN, 0, _MARGIN, 0)
        layout.setSpacing(_SPACING)
        for label in (self.moment, self.rate, self.rotation, self.scale, self.cursor_field):
            layout.addWidget(label)
        layout.addStretch(1)
        for label in (
            self.reduced,
            self.tracker,
            self.fps,
            self.age,
            self.depth_field,
            self.skipped,
            self.drops,
        ):
            layout.addWidget(label)

    def show_status(self, status: Status) -> None:
        """Write every field."""
        _write(self.moment, status.moment)
        state = self.tr("end") if status.finished else self.tr("paused") if status.paused else ""
        _write(self.rate, f"{quantities.factor(status.rate)} {state}".strip(), "warning" if state else "")
        self._show_rotation(status)
        _write(self.scale, f"{self.tr('range')} {status.range_scale}")
        _write(self.cursor_field, status.cursor)
        _write(self.reduced, status.reduced, "warning")
        _write(self.tracker, status.tracker)
        _write(self.fps, f"{status.fps:.0f} fps" if status.fps == status.fps else "", "dim")
        self._show_age(status)
        _write(
            self.depth_field,
            f"{self.tr('queue')} {status.depth}",
            "warning" if status.depth >= DEEP else "dim",
        )
        self._show_skipped(status)
        self._show_drops(status)
        self._fit()

    def _fit(self) -> None:
        """Where the window is narrow, what can be missed gives way; never what was lost."""
        fields = self.findChildren(QLabel)
        for label in fields:
            label.setVisible(bool(label.text()))
        shown = [label for label in fields if label.text()]
        needed = 2 * _MARGIN + sum(label.sizeHint().width() + _SPACING for label in shown)
        for label in (self.tracker, self.reduced, self.fps, self.cursor_field, self.scale, self.rotation):
            if needed <= self.width():
                break
            if label in shown and label.property("state") != "alarm":
                label.hide()
                needed -= label.sizeHint().width() + _SPACING

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def show_cursor(self, text: str) -> None:
        """Only the field of the cursor, which follows the pointer at once."""
        _write(self.cursor_field, text)
        self._fit()

    def _show_rotation(self, status: Status) -> None:
        if status.stalled:
            _write(self.rotation, self.tr("▲ STALLED"), "alarm")
        else:
            _write(self.rotation, f"{quantities.significant(60.0 / status.rotation_s)} rpm")

    def _show_age(self, status: Status) -> None:
        age = f"{status.age_s:.2f}" if status.age_s < 10.0 else f"{status.age_s:.0f}"
        if status.age_s != status.age_s:
            _write(self.age, self.tr("no data yet"), "warning")
        elif status.paused or status.finished:
            _write(self.age, f"{self.tr('data')} {age} s", "dim")
        else:
            level = "alarm" if status.age_s > TOO_OLD_S else "warning" if status.age_s > OLD_S else "good"
            mark = "▲ " if level == "alarm" else ""
            _write(self.age, f"{mark}{self.tr('data')} {age} s", level)

    def _show_skipped(self, status: Status) -> None:
        """How much could not be used; the reasons come when the pointer rests on it."""
        total = sum(status.skipped.values())
        _write(self.skipped, f"{self.tr('skipped')} {quantities.count(total)}" if total else "", "warning")
        reasons = "\n".join(f"{quantities.count(n)}  {reason}" for reason, n in status.skipped.items())
        if self.skipped.toolTip() != reasons:
            self.skipped.setToolTip(reasons)

    def _show_drops(self, status: Status) -> None:
        text = f"{self.tr('dropped')} {status.sectors_dropped}"
        if status.sectors_dropped:
            returns = quantities.count(status.returns_dropped)
            text = f"▲ {text} {self.tr('sectors')}, {returns} {self.tr('returns')}"
        _write(self.drops, text, "alarm" if status.sectors_dropped else "dim")

    def _field(self, widest: str) -> QLabel:
        label = QLabel()
        label.setFont(fonts.font())
        if widest:
            label.setMinimumWidth(label.fontMetrics().horizontalAdvance(widest))
        return label


def _write(label: QLabel, text: str, state: str = "") -> None:
    """Text, and the state that the style sheet colours; nothing is redrawn that has not changed."""
    if label.text() != text:
        label.setText(text)
    if label.property("state") != state:
        label.setProperty("state", state)
        label.style().unpolish(label)
        label.style().polish(label)
