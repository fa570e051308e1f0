"""The cheat sheet: every action with its keys, made from the registry."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from radar_console.display.actions import Action, grouped

COLUMNS = (("Range", "Playback", "Tracks"), ("Layers",), ("Look", "Window"))


class Help(QWidget):
    """A panel over the middle of the window."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._over = parent
        self.setObjectName("help")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        columns = QHBoxLayout(self)
        columns.setContentsMargins(32, 28, 32, 28)
        columns.setSpacing(40)
        groups = {members[0].group: (heading, members) for heading, members in grouped()}
        for names in COLUMNS:
            column = QVBoxLayout()
            column.setSpacing(10)
            for group in names:
                self._add(column, *groups[group])
            column.addStretch()
            columns.addLayout(column)
        self.hide()

    def place(self) -> None:
        """In the middle of the parent."""
        self.adjustSize()
        rect = self.rect()
        rect.moveCenter(self._over.rect().center())
        self.move(rect.topLeft())

    def _add(self, column: QVBoxLayout, heading: str, members: list[Action]) -> None:
        title = QLabel(heading.upper())
        title.setObjectName("heading")
        grid = QGridLayout()
        grid.setHorizontalSpacing(16)
        grid.setVerticalSpacing(6)
        grid.setColumnMinimumWidth(0, 64)
        grid.setColumnStretch(1, 1)
        for line, action in enumerate(members):
            key = QLabel(shown(action))
            key.setObjectName("key")
            grid.addWidget(key, line, 0)
            grid.addWidget(QLabel(action.label), line, 1)
            if action.pointer:
                pointer = QLabel(action.pointer)
                pointer.setObjectName("caption")
                grid.addWidget(pointer, line, 2)
        column.addWidget(title)
        column.addLayout(grid)
        column.addSpacing(10)


def shown(action: Action) -> str:
    """The first key, as this system writes it."""
    return QKeySequence(action.keys[0]).toString(QKeySequence.SequenceFormat.NativeText)
