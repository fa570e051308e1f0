"""The table of tracks: a model over the picture's array, with its own stable sort and its filter."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, QRect, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from radar_console.core.geometry import Array, to_polar
from radar_console.core.messages import TRACK, Table, TrackStatus, empty
from radar_console.display import fonts, quantities
from radar_console.display.palette import NIGHT, Palette, mix
from radar_console.display.picture import Picture, name
from radar_console.display.view import RangeUnit, SpeedUnit, View

Index = QModelIndex | QPersistentModelIndex
Floats = NDArray[np.float64]

TRACK_NAME, STATUS, RANGE, BEARING, SPEED, COURSE, AGE, HEIGHT, CODE = range(9)
INDENT = 10
"""The mark of the selected row stands so far left of the text, px."""

NARROW = 500
"""Below this width of the table, px, the columns of recordings give way."""

_WIDTHS = {
    TRACK_NAME: 16,
    STATUS: 25,
    RANGE: 23,
    BEARING: 20,
    SPEED: 26,
    COURSE: 19,
    AGE: 17,
    HEIGHT: 22,
    CODE: 16,
}
_LEFT_ALIGNED = (TRACK_NAME, STATUS)
_WORDS = {status: status.name.lower() for status in TrackStatus}
_ROOT = QModelIndex()


def kinematics(rows: Table, position: tuple[float, float, float]) -> tuple[Array, Array, Array, Array]:
    """Ground range, m, and bearing, rad, from the radar; speed, m/s, and course, rad."""
    distance, azimuth = to_polar(rows["east"] - position[0], rows["north"] - position[1])
    speed, course = to_polar(rows["v_east"], rows["v_north"])
    return distance, azimuth, speed, np.where(speed > 0.0, course, np.nan)


class TrackModel(QAbstractTableModel):
    """The live tracks, in the order of the chosen column; equal rows keep the order of their names.

    Call `update_from` two to four times a second; only the cells that can be seen are written as text.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.palette = NIGHT
        self.filter = ""
        self._column, self._descending = TRACK_NAME, False
        self._units = RangeUnit.KM, SpeedUnit.KMH
        self._rows: Table = empty(TRACK)
        self._numbers = np.zeros(0, np.int64)
        self._values: Floats = np.zeros((0, CODE + 1))

    # What is known

    def update_from(self, picture: Picture, view: View) -> None:
        """Show the tracks as they are now."""
        units = view.range_unit, view.speed_unit
        if units != self._units:
            self._units = units
            self.headerDataChanged.emit(Qt.Orientation.Horizontal, 0, CODE)
        rows, numbers = picture.tracks, picture.numbers
        values = self._columns(rows, numbers, picture)
        order = self._order(rows, values)
        if self.filter:
            found = [self._matches(rows[i], int(numbers[i])) for i in order]
            order = order[np.array(found, bool)]
        self._show(rows[order], numbers[order], values[order])

    @property
    def tracks(self) -> list[int]:
        """The numbers of the tracks, row by row."""
        tracks: list[int] = self._rows["track"].tolist()
        return tracks

    def row_of(self, track: int | None) -> int | None:
        """The row that shows `track`."""
        if track is None:
            return None
        found = np.flatnonzero(self._rows["track"] == track)
        return int(found[0]) if len(found) else None

    def has(self, column: int) -> bool:
        """Whether any track has a value there."""
        return bool(np.isfinite(self._values[:, column]).any())

    def _columns(self, rows: Table, numbers: NDArray[np.int64], picture: Picture) -> Floats:
        """(tracks, columns) in SI and radians; what the table is sorted by."""
        values = np.full((len(rows), CODE + 1), np.nan)
        values[:, TRACK_NAME] = np.where(numbers > 0, numbers, np.inf)
        values[:, STATUS] = rows["status"]
        values[:, [RANGE, BEARING, SPEED, COURSE]] = np.column_stack(kinematics(rows, picture.position))
        values[:, AGE] = picture.time - rows["born"]
        values[:, HEIGHT] = rows["up"]
        values[:, CODE] = np.where(rows["mode_3a"] >= 0, rows["mode_3a"], np.nan)
        return values

    def _order(self, rows: Table, values: Floats) -> NDArray[np.int64]:
        """By name, tentative ones by birth, then stably by the chosen column; unknown values last."""
        by_name = np.lexsort([rows["track"], values[:, TRACK_NAME]])
        key = values[by_name, self._column]
        order: NDArray[np.int64] = by_name[np.argsort(-key if self._descending else key, kind="stable")]
        return order

    def _matches(self, row: Any, number: int) -> bool:
        code = f"{int(row['mode_3a']):04o}" if row["mode_3a"] >= 0 else ""
        text = f"{name(number)} {_WORDS[TrackStatus(int(row['status']))]} {code}".casefold()
        return all(word in text for word in self.filter.casefold().split())

    def _show(self, rows: Table, numbers: NDArray[np.int64], values: Floats) -> None:
        before, after = len(self._rows), len(rows)
        old_rows, old_values = self._rows, self._values
        if after > before:
            self.beginInsertRows(_ROOT, before, after - 1)
        elif after < before:
            self.beginRemoveRows(_ROOT, after, before - 1)
        self._rows, self._numbers, self._values = rows, numbers, values
        if after > before:
            self.endInsertRows()
        elif after < before:
            self.endRemoveRows()
        both = min(before, after)
        self._tell_changes(old_rows[:both], old_values[:both])

    def _tell_changes(self, rows: Table, values: Floats) -> None:
        """Only what looks otherwise now is painted again: few rows, and once a second the ages."""
        count = len(rows)
        same = (values == self._values[:count]) | (np.isnan(values) & np.isnan(self._values[:count]))
        same[:, AGE] = rows["track"] == self._rows["track"][:count]
        changed = np.flatnonzero(~same.all(axis=1))
        if len(changed) > count // 2:
            self.dataChanged.emit(self.index(0, 0), self.index(count - 1, CODE))
            return
        for row in changed.tolist():
            self.dataChanged.emit(self.index(row, 0), self.index(row, CODE))
        if (np.floor(values[:, AGE]) != np.floor(self._values[:count, AGE])).any():
            self.dataChanged.emit(self.index(0, AGE), self.index(count - 1, AGE))

    # What Qt asks

    def rowCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else CODE + 1

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        row, column = index.row(), index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return self.text(row, column)
        return alignment(column) if role == Qt.ItemDataRole.TextAlignmentRole else None

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation is not Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return self._titles()[section]
        return alignment(section) if role == Qt.ItemDataRole.TextAlignmentRole else None

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Takes effect with the next `update_from`."""
        self._column, self._descending = column, order == Qt.SortOrder.DescendingOrder

    def _titles(self) -> list[str]:
        range_unit, speed_unit = self._units
        return [
            self.tr("Track"),
            self.tr("Status"),
            f"{self.tr('Range')} {range_unit}",
            self.tr("Bearing"),
            f"{self.tr('Speed')} {speed_unit}",
            self.tr("Course"),
            self.tr("Age"),
            f"{self.tr('Height')} m",
            self.tr("Code"),
        ]

    def text(self, row: int, column: int) -> str:
        """What the cell says."""
        value = float(self._values[row, column])
        range_unit, speed_unit = self._units
        match column:
            case 0:
                return name(int(self._numbers[row])) if self._numbers[row] else quantities.NONE
            case 1:
                return self.tr(_WORDS[TrackStatus(int(value))])
            case 2:
                return quantities.significant(value / range_unit.metres)
            case 3 | 5:
                return quantities.bearing(value)
            case 4:
                return quantities.significant(value / speed_unit.metres_per_second)
            case 6:
                return quantities.duration(value)
            case 7:
                return quantities.count(value) if np.isfinite(value) else quantities.NONE
            case _:
                return f"{int(value):04o}" if np.isfinite(value) else quantities.NONE

    def colour(self, row: int, column: int) -> QColor:
        """What the cell is written in."""
        status = TrackStatus(int(self._rows["status"][row]))
        if status is TrackStatus.TENTATIVE:
            return QColor(*self.palette.dim)
        if status is TrackStatus.COASTING and column == STATUS:
            return QColor(*self.palette.warning)
        return QColor(*(self.palette.bright if column == TRACK_NAME else self.palette.text))


def alignment(column: int) -> Qt.AlignmentFlag:
    side = Qt.AlignmentFlag.AlignLeft if column in _LEFT_ALIGNED else Qt.AlignmentFlag.AlignRight
    return side | Qt.AlignmentFlag.AlignVCenter


class _Cells(QStyledItemDelegate):
    """Paints a cell by hand: through the style sheet it takes ten times as long.

    The selected row has a bar at its left, besides its background.
    """

    def __init__(self, model: TrackModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model
        self.selected: int | None = None
        self._font = fonts.font()
        self.set_colours(NIGHT)

    def set_colours(self, palette: Palette) -> None:
        self._row, self._mark = QColor(*mix(palette.panel, palette.track, 0.12)), QColor(*palette.track)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        row, column = index.row(), index.column()
        rect: QRect = option.rect
        if row == self.selected:
            painter.fillRect(rect, self._row)
            if column == TRACK_NAME:
                painter.fillRect(QRect(rect.left(), rect.top(), 3, rect.height()), self._mark)
        painter.setFont(self._font)
        painter.setPen(self._model.colour(row, column))
        left = INDENT if column in _LEFT_ALIGNED else 0
        painter.drawText(rect.adjusted(left, 0, -2, 0), alignment(column), self._model.text(row, column))


class TrackTable(QWidget):
    """The heading with the counts, the filter, and the table.

    Signals
    -------
    picked : the operator chose a row; the number of its track
    changed : the operator chose a column or a filter; the table wants an update
    """

    picked = Signal(object)
    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.model = TrackModel(self)
        self.counts = QLabel()
        self.counts.setObjectName("figures")
        self.filter = QLineEdit()
        self.filter.setPlaceholderText(self.tr("filter: name, status, code"))
        self.filter.setClearButtonEnabled(False)
        self.table = self._table()
        self._following = False
        self._selected: int | None = None
        self._lay_out()
        self._show_handle(0, 0)
        self.filter.textChanged.connect(self._on_filter)
        self.table.selectionModel().currentRowChanged.connect(self._on_row)
        self.table.horizontalHeader().sortIndicatorChanged.connect(lambda *_: self.changed.emit())

    def set_colours(self, palette: Palette) -> None:
        self.model.palette = palette
        self._cells.set_colours(palette)
        self.table.viewport().update()

    def update_from(self, picture: Picture, view: View) -> None:
        """Show the tracks as they are now, and the selection of the view."""
        self._following = True
        self.model.update_from(picture, view)
        for column in (HEIGHT, CODE):
            hidden = self.table.viewport().width() < NARROW or not self.model.has(column)
            if hidden != self.table.isColumnHidden(column):
                self.table.setColumnHidden(column, hidden)
                self._share_width()
        self._follow(view.selected)
        self._following = False
        self.counts.setText(self._count(picture))

    def neighbour(self, track: int | None, direction: int) -> int | None:
        """The track of the next row (+1) or of the one before (−1), from the end on again."""
        tracks = self.model.tracks
        if not tracks:
            return None
        row = self.model.row_of(track)
        if row is None:
            return tracks[0 if direction > 0 else -1]
        return tracks[(row + direction) % len(tracks)]

    def _follow(self, selected: int | None) -> None:
        row = self.model.row_of(selected)
        if row != self._cells.selected:
            self._cells.selected = row
            self.table.viewport().update()
        if row is None:
            self.table.clearSelection()
            self.table.setCurrentIndex(_ROOT)
        elif self.table.currentIndex().row() != row or not self.table.selectionModel().hasSelection():
            self.table.selectRow(row)
        if row is not None and selected != self._selected:
            self.table.scrollTo(self.model.index(row, 0))
        self._selected = selected

    def _count(self, picture: Picture) -> str:
        status = picture.tracks["status"]
        counts = [(int((status == kind).sum()), kind) for kind in (1, 2, 0)]
        shown = [
            f"{count} {self.tr(_WORDS[TrackStatus(kind)])}"
            for count, kind in counts
            if count or kind == TrackStatus.CONFIRMED
        ]
        return "   ".join(shown)

    def _on_filter(self, text: str) -> None:
        self.model.filter = text
        self.changed.emit()

    def _on_row(self, current: QModelIndex) -> None:
        if not self._following and current.isValid():
            self.picked.emit(self.model.tracks[current.row()])

    def _table(self) -> QTableView:
        table = QTableView()
        table.setModel(self.model)
        self._cells = _Cells(self.model, table)
        table.setItemDelegate(self._cells)
        table.setFont(fonts.font())
        table.setShowGrid(False)
        table.setWordWrap(False)
        table.setSortingEnabled(True)
        table.sortByColumn(TRACK_NAME, Qt.SortOrder.AscendingOrder)
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        table.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        table.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # Always there, so that the columns keep their width; its handle shows only when it is needed.
        table.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        table.verticalScrollBar().rangeChanged.connect(self._show_handle)
        table.setTabKeyNavigation(False)
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(22)
        table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        header.setHighlightSections(False)
        header.setSectionsClickable(True)
        header.setFont(fonts.font(family=fonts.SANS))
        header.setMinimumSectionSize(40)
        return table

    def _show_handle(self, low: int, high: int) -> None:
        bar = self.table.verticalScrollBar()
        bar.setProperty("idle", high <= low)
        bar.style().unpolish(bar)
        bar.style().polish(bar)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._share_width()

    def _share_width(self) -> None:
        """Each column its part of the width, by the longest text that it may hold."""
        shown = [column for column in _WIDTHS if not self.table.isColumnHidden(column)]
        width = self.table.viewport().width() / sum(_WIDTHS[column] for column in shown)
        edges = [0, *(round(width * sum(_WIDTHS[c] for c in shown[: k + 1])) for k in range(len(shown)))]
        for column, begin, end in zip(shown, edges, edges[1:], strict=False):
            self.table.setColumnWidth(column, end - begin)

    def _lay_out(self) -> None:
        title = QLabel(self.tr("TRACKS"))
        title.setObjectName("heading")
        top = QHBoxLayout()
        top.setContentsMargins(INDENT, 0, INDENT, 0)
        top.addWidget(title)
        top.addStretch()
        top.addWidget(self.counts)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addLayout(top)
        search = QHBoxLayout()
        search.setContentsMargins(INDENT, 0, INDENT, 0)
        search.addWidget(self.filter)
        layout.addLayout(search)
        layout.addWidget(self.table, 1)
