"""The console's window: the scope, the panel beside it, the bar below, and the timers that drive them."""

import logging
import math
import threading
import time
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, QStandardPaths, Qt, QTimer
from PySide6.QtGui import QAction, QCloseEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import QFileDialog, QFrame, QLabel, QMainWindow, QSplitter, QVBoxLayout, QWidget

from radar_console.core.errors import InputError
from radar_console.core.geometry import LocalFrame
from radar_console.core.messages import Radar, Sector
from radar_console.display import actions, maps, quantities, settings, style
from radar_console.display.actions import ACTIONS, Action
from radar_console.display.details import Details
from radar_console.display.feed import Controls, Feed, Health
from radar_console.display.governor import Governor
from radar_console.display.help import Help
from radar_console.display.logbook import Logbook
from radar_console.display.options import Options
from radar_console.display.palette import PALETTES
from radar_console.display.picture import Picture
from radar_console.display.ppi import Ppi
from radar_console.display.statusbar import Status, StatusBar
from radar_console.display.tracktable import INDENT, TrackTable
from radar_console.display.view import Layer, RangeUnit, SpeedUnit, View

log = logging.getLogger(__name__)

SLOW_MS = 333  # tables and figures
MESSAGE_MS = 2500
LONGEST_STEP = 0.25  # s of wall time that a late frame may advance the afterglow by
MAP_REACH = 2.0  # of the instrumented range: what an off-centre view can show
NARROWEST_PANEL = 520  # px
WIDEST_PANEL = 0.42  # of the window
_PANEL_MARGIN = 24


class ConsoleWindow(QMainWindow):
    """The whole console.

    Parameters
    ----------
    radar : the sensor
    feed : where sectors come from
    controls, health : of the playback and of the pipeline's queues
    options : title, units, how it starts
    settings_file : where the operator's choices are kept; None keeps nothing
    """

    def __init__(
        self,
        radar: Radar,
        feed: Feed,
        controls: Controls,
        health: Health,
        options: Options,
        settings_file: Path | None = None,
    ) -> None:
        super().__init__()
        self.radar, self.feed, self.controls, self.health = radar, feed, controls, health
        self.options, self._settings_file = options, settings_file
        self.picture, self.logbook, self.governor = Picture(), Logbook(), Governor()
        self.frame = LocalFrame(radar.site) if radar.site is not None else None
        chosen, self._trouble = settings.load(settings_file) if settings_file else (settings.Settings(), "")
        self.view = _first_view(radar, options, chosen)
        self.arrived = math.nan
        self._swept = False
        self._last_tick = math.nan
        self._map: maps.Map | None = None
        self._cursor: tuple[float, float, float, float] | None = None
        self._build(chosen)
        self._connect()
        self.apply_palette()
        self.refresh()

    # ---- Building

    def _build(self, chosen: settings.Settings) -> None:
        self.setWindowTitle(f"{self.options.title} – Radar Console")
        self.scope = Ppi(self.view, self.picture)
        self.scope.set_title(self.options.title, self.options.subtitle)
        self.table, self.details, self.status = TrackTable(), Details(), StatusBar()
        self.splitter = QSplitter(Qt.Orientation.Horizontal)
        self.splitter.setHandleWidth(1)
        self.splitter.setChildrenCollapsible(False)
        self.splitter.addWidget(self.scope)
        self.splitter.addWidget(self._panel())
        self.splitter.setStretchFactor(0, 1)
        back = QWidget()
        back.setObjectName("back")
        layout = QVBoxLayout(back)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.splitter, 1)
        layout.addWidget(self.status)
        self.setCentralWidget(back)
        self._notes()
        self.help = Help(self)
        self.resize(*chosen.window)
        self.splitter.setSizes([max(chosen.window[0] - chosen.panel, 400), chosen.panel])

    def _panel(self) -> QWidget:
        panel = QWidget()
        panel.setObjectName("panel")
        panel.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        panel.setMinimumWidth(NARROWEST_PANEL)
        line = QFrame()
        line.setObjectName("line")
        line.setFixedHeight(1)
        layout = QVBoxLayout(panel)
        layout.setContentsMargins(_PANEL_MARGIN - INDENT, 20, _PANEL_MARGIN - INDENT, 20)
        layout.setSpacing(16)
        layout.addWidget(self.table, 1)
        layout.addWidget(line)
        layout.addWidget(self.details)
        return panel

    def _notes(self) -> None:
        """What is written over the scope: keys, and a banner when something is the matter."""
        self.hint = self._note("hint", "")
        self.banner = self._note("banner", "")
        self.banner.setWordWrap(True)
        self._message_over = QTimer(self, singleShot=True, interval=MESSAGE_MS)
        self._message_over.timeout.connect(self._show_hint)
        self._show_hint()

    def _note(self, name: str, text: str) -> QLabel:
        label = QLabel(text, self.scope)
        label.setObjectName(name)
        label.setTextFormat(Qt.TextFormat.PlainText)
        label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        return label

    def _connect(self) -> None:
        for action in ACTIONS:
            self.addAction(self._qt_action(action))
        self.scope.trackSelected.connect(self.select)
        self.scope.cursorMoved.connect(self._point)
        self.scope.cursorLeft.connect(self._point_nowhere)
        self.scope.installEventFilter(self)
        self.table.picked.connect(self.select)
        self.table.changed.connect(self._refresh_table)
        self.frames = QTimer(self)
        self.frames.setTimerType(Qt.TimerType.PreciseTimer)
        self.frames.timeout.connect(self.tick)
        self.slow = QTimer(self)
        self.slow.timeout.connect(self.refresh)

    def _qt_action(self, action: Action) -> QAction:
        qt = QAction(action.label, self)
        qt.setObjectName(action.name)
        qt.setShortcuts([QKeySequence(key) for key in action.keys])
        qt.triggered.connect(lambda: action.run(self))
        return qt

    # ---- Running

    def start(self) -> None:
        """Start the timers, and load the map beside them."""
        self.frames.start(self.governor.interval_ms)
        self.slow.start(SLOW_MS)
        threading.Thread(target=self._load_map, name="map", daemon=True).start()

    def tick(self) -> None:
        """A frame: take what waits, let the afterglow age, draw."""
        began = time.monotonic()
        elapsed = 0.0 if math.isnan(self._last_tick) else min(began - self._last_tick, LONGEST_STEP)
        self._last_tick = began
        batch = self.feed.take()
        if batch.sectors:
            self.arrived = batch.arrived
        running = not (self.controls.paused or self.feed.finished)
        for sector in batch.sectors:
            self.take(sector)
        if batch.truth is not None:
            self.picture.take_truth(batch.truth)
        self.scope.advance(elapsed if running else 0.0)
        if batch.sectors and not self._swept:
            self._swept = True
            self.scope.viewport().repaint()
            log.info("first sweep painted")
        self.governor.note(time.monotonic() - began, elapsed)

    def take(self, sector: Sector) -> None:
        """Bring the picture and the logbook up to a sector."""
        self.picture.take(sector)
        if len(sector.tracks):
            self.logbook.take(sector.tracks, sector.stop)

    def refresh(self) -> None:
        """Tables, figures and banners: three times a second."""
        self._govern()
        self._refresh_table()
        self.details.update_from(self.picture, self.view, self.logbook, self.frame)
        self.status.show_status(self._status())
        self._show_banner()
        if self._map is not None:
            self.scope.set_map(self._map)
            self._map = None

    def _refresh_table(self) -> None:
        self.table.update_from(self.picture, self.view)

    def _govern(self) -> None:
        if not self.frames.isActive():
            return
        if self.frames.interval() != self.governor.interval_ms:
            self.frames.setInterval(self.governor.interval_ms)
        self.scope.economy = self.governor.economy

    def _status(self) -> Status:
        feed, health = self.feed, self.health
        now = time.monotonic()
        return Status(
            moment=quantities.moment(self.picture.time, self.options.epoch),
            rate=self.controls.rate,
            paused=self.controls.paused,
            finished=feed.finished,
            rotation_s=self.picture.rotation,
            range_scale=f"{quantities.significant(self.view.scale)} {self.view.range_unit}",
            cursor=self._cursor_text(),
            tracker=self.options.tracker_name,
            fps=self.governor.fps,
            age_s=now - self.arrived,
            depth=health.depth + feed.depth,
            sectors_dropped=health.sectors_dropped + feed.sectors_dropped,
            returns_dropped=health.returns_dropped + feed.returns_dropped,
            skipped=health.skipped,
            stalled=self.picture.stalled,
            reduced=self.governor.reduced,
        )

    def _load_map(self) -> None:
        """In a thread of its own: the map is on the screen when it is ready."""
        try:
            self._map = load_map(self.radar, self.options)
        except InputError as error:
            self._trouble = str(error)

    # ---- What the actions do

    def zoom(self, direction: int) -> None:
        if direction < 0:
            self.view.zoom_in(self.view.centre)
        else:
            self.view.zoom_out(self.view.centre)
        self._show_view()

    def reset_centre(self) -> None:
        self.view.reset_centre()
        self._show_view()

    def fit(self) -> None:
        self.view.fit(self.radar.max_range)
        self._show_view()

    def toggle_pause(self) -> None:
        self.controls.paused = not self.controls.paused
        self.refresh()

    def change_rate(self, direction: int) -> None:
        self.set_rate(actions.step(actions.RATES, self.controls.rate, direction))

    def set_rate(self, rate: float) -> None:
        self.controls.rate = rate
        self.say(f"{self.tr('speed')} {quantities.factor(rate)}")
        self.refresh()

    def select(self, track: int | None) -> None:
        """Select a track, whoever asks for it: the scope, the table or a key."""
        self.view.selected = track
        self.scope.refresh()
        self._refresh_table()
        self.details.update_from(self.picture, self.view, self.logbook, self.frame)

    def select_neighbour(self, direction: int) -> None:
        track = self.table.neighbour(self.view.selected, direction)
        if track is not None:
            self.select(track)

    def escape(self) -> None:
        """The innermost thing first: help, filter, selection, full screen."""
        if self.help.isVisible():
            self.help.hide()
        elif self.table.filter.hasFocus() or self.table.filter.text():
            self.table.filter.clear()
            self.scope.setFocus()
        elif self.view.selected is not None:
            self.select(None)
        elif self.isFullScreen():
            self.showNormal()

    def focus_filter(self) -> None:
        self.table.filter.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.table.filter.selectAll()

    def next_label_detail(self) -> None:
        self.view.label_detail = self.view.label_detail % len(actions.LABEL_DETAILS) + 1
        self.say(f"{self.tr('label detail')} {self.view.label_detail}")

    def toggle_layer(self, layer: Layer) -> None:
        self.view.toggle(layer)
        self.say(f"{self.tr(layer)} {self.tr('on') if self.view.shows(layer) else self.tr('off')}")

    def change_afterglow(self, direction: int) -> None:
        self.view.afterglow_s = actions.step(actions.AFTERGLOWS, self.view.afterglow_s, direction)
        self._say_seconds(self.tr("afterglow"), self.view.afterglow_s)

    def change_trail(self, direction: int) -> None:
        self.view.trail_s = actions.step(actions.TRAILS, self.view.trail_s, direction)
        self._say_seconds(self.tr("trails"), self.view.trail_s)

    def change_vector(self, direction: int) -> None:
        self.view.vector_s = actions.step(actions.VECTORS, self.view.vector_s, direction)
        self._say_seconds(self.tr("speed vectors"), self.view.vector_s)

    def next_palette(self) -> None:
        names = list(PALETTES)
        self.view.palette = names[(names.index(self.view.palette) + 1) % len(names)]
        self.apply_palette()
        self.say(f"{self.tr('palette')} {self.view.palette}")

    def save_picture(self) -> None:
        """Ask for a file and write the window into it."""
        image = self.grab()
        proposal = f"radar-console-{datetime.now():%Y%m%d-%H%M%S}.png"
        file, _ = QFileDialog.getSaveFileName(
            self, self.tr("Picture of the window"), proposal, self.tr("Pictures (*.png)")
        )
        if file:
            written = image.save(file)
            self.say(f"{self.tr('written') if written else self.tr('can’t be written')}: {file}")

    def toggle_full_screen(self) -> None:
        if self.isFullScreen():
            self.showNormal()
        else:
            self.showFullScreen()

    def toggle_help(self) -> None:
        self.help.place()
        self.help.setVisible(not self.help.isVisible())
        self.help.raise_()

    def quit(self) -> None:
        self.close()

    def apply_palette(self) -> None:
        """Colours of the whole window, after the view's palette."""
        colours = PALETTES[self.view.palette]
        self.setStyleSheet(style.sheet(colours))
        self.table.set_colours(colours)
        self.details.set_colours(colours)
        self._place_notes()

    def still(self) -> None:
        """Bring everything up to date without timers, for a picture."""
        self.scope.refresh()
        self.refresh()

    # ---- What is written over the scope

    def say(self, text: str) -> None:
        """A word on what a key has done, for a moment, where the keys are."""
        self.scope.refresh()
        self.hint.setText(text)
        self._message_over.start()
        self._place_notes()

    def _say_seconds(self, what: str, seconds: float) -> None:
        self.say(f"{what} {seconds:g} s" if seconds else f"{what} {self.tr('off')}")

    def _show_hint(self) -> None:
        self.hint.setText(self.tr("? keys   Space pause   / filter   + − range"))
        self._place_notes()

    def _show_banner(self) -> None:
        text, state = self._matter()
        if (text, state) != (self.banner.text(), self.banner.property("state")):
            self.banner.setText(text)
            self.banner.setProperty("state", state)
            self.banner.style().unpolish(self.banner)
            self.banner.style().polish(self.banner)
        self.banner.setVisible(bool(text))
        self._place_notes()

    def _matter(self) -> tuple[str, str]:
        """The most urgent thing to know, and whether it is an alarm."""
        if self.feed.failure:
            return f"▲ {self.feed.failure}", "alarm"
        if self.picture.stalled and not self.feed.finished:
            return self.tr("▲ encoder stalled: the antenna does not turn"), "alarm"
        if self._trouble:
            return self._trouble, "alarm"
        if self.feed.notice:
            return self.feed.notice, ""
        if self.feed.finished:
            return self.tr("end of the data"), ""
        if self.controls.paused:
            return self.tr("paused – Space goes on"), ""
        return "", ""

    def _place_notes(self) -> None:
        """In the corners, which the disc leaves free."""
        width, height = self.scope.width(), self.scope.height()
        self.hint.adjustSize()
        self.hint.move(20, height - self.hint.height() - 14)
        if self.banner.text():
            wanted = self.banner.fontMetrics().horizontalAdvance(self.banner.text()) + 40
            self.banner.setFixedWidth(min(wanted, width // 3))
            self.banner.setFixedHeight(self.banner.heightForWidth(self.banner.width()))
        self.banner.move(width - self.banner.width() - 20, 16)

    # ---- The pointer

    def _point(self, distance: float, azimuth: float, east: float, north: float) -> None:
        self._cursor = (distance, azimuth, east, north)
        self.status.show_cursor(self._cursor_text())

    def _point_nowhere(self) -> None:
        self._cursor = None
        self.status.show_cursor("")

    def _cursor_text(self) -> str:
        if self._cursor is None:
            return ""
        distance, azimuth, east, north = self._cursor
        unit = self.view.range_unit
        text = f"{quantities.significant(distance / unit.metres)} {unit} {quantities.bearing(azimuth, 1)}"
        if self.frame is None:
            return text
        latitude, longitude = self.frame.to_wgs84(east, north)
        return f"{text}  {quantities.place(float(latitude), float(longitude))}"

    def _show_view(self) -> None:
        """The view has changed: the scope and the bar follow at once, also while paused."""
        self.scope.refresh()
        self.status.show_status(self._status())

    # ---- Qt

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.scope and event.type() == QEvent.Type.Resize:
            self._place_notes()
        return super().eventFilter(watched, event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.help.place()
        most = max(round(WIDEST_PANEL * self.width()), NARROWEST_PANEL)
        if self.splitter.sizes()[1] > most:
            self.splitter.setSizes([self.width() - most, most])

    def closeEvent(self, event: QCloseEvent) -> None:
        self.frames.stop()
        self.slow.stop()
        if self._settings_file is not None:
            trouble = settings.save(self._chosen(), self._settings_file)
            if trouble:
                log.warning(trouble)
        super().closeEvent(event)

    def _chosen(self) -> settings.Settings:
        hidden = sorted(layer.value for layer in Layer if not self.view.shows(layer))
        size = self.normalGeometry().size() if self.isFullScreen() else self.size()
        return settings.Settings(
            palette=self.view.palette,
            hidden_layers=tuple(hidden),
            label_detail=self.view.label_detail,
            window=(size.width(), size.height()),
            panel=self.splitter.sizes()[1],
        )


def load_map(radar: Radar, options: Options) -> maps.Map:
    """The world around the radar, and the user's map on top.

    Raises
    ------
    InputError   the user's map is wrong, or the radar's place is not known
    """
    if radar.site is None:
        if options.user_map is not None:
            expected = "a map needs the radar's latitude and longitude, which this source does not give"
            raise InputError(options.user_map, "", expected)
        return {}
    layers = maps.world(radar.site, MAP_REACH * radar.max_range)
    return layers if options.user_map is None else layers | maps.user(options.user_map, radar.site)


def settings_file() -> Path:
    """Where this system keeps the operator's choices."""
    folder = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericConfigLocation)
    return Path(folder) / "radar-console" / "console.json"


def _first_view(radar: Radar, options: Options, chosen: settings.Settings) -> View:
    """How the console looks at first: the scenario's wishes, then the operator's."""
    hidden = set(chosen.hidden_layers)
    return View(
        range_m=options.range_m or radar.max_range,
        layers=frozenset(layer for layer in Layer if layer.value not in hidden),
        afterglow_s=options.afterglow_s,
        trail_s=options.trail_s,
        vector_s=options.vector_s,
        range_unit=RangeUnit(options.range_unit),
        speed_unit=SpeedUnit(options.speed_unit),
        palette=chosen.palette if chosen.palette in PALETTES else next(iter(PALETTES)),
        label_detail=chosen.label_detail,
    )
