"""The plan position indicator: north-up scope of range and azimuth, painted in three storeys.

`base` stands still (disc, map, grid); `under` adds the trails; each frame the phosphor is developed
over it, and the overlay of tracks is laid on top. The base is drawn when the view changes, trails and
overlay ten times a second, the phosphor at every frame: only the sweep needs that.
"""

import math
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QImage, QMouseEvent, QPainter, QPen, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget

from radar_console.core.geometry import to_polar
from radar_console.core.messages import TrackStatus
from radar_console.core.units import TURN
from radar_console.display import strokes
from radar_console.display.furniture import (
    MAP_STYLES,
    TITLE,
    Lines,
    Map,
    draw_disc,
    draw_figures,
    draw_grid,
    draw_title,
    packed,
    qcolor,
)
from radar_console.display.overlay import Overlay
from radar_console.display.palette import PALETTES, Palette, mix
from radar_console.display.phosphor import FAINTEST, Phosphor
from radar_console.display.picture import Picture
from radar_console.display.projection import Projection
from radar_console.display.strokes import Pixels
from radar_console.display.sweep import Sweep
from radar_console.display.view import Layer, View

OVERLAY_PERIOD = 0.1
"""Trails, vectors, symbols and labels are painted so often, s of wall time."""

_BEAM_PARTS = 6.0  # a plot is drawn this part of the beam's width wide: neighbours just touch
_PICK = 16.0  # px; a click takes the nearest track within it
_DRAG = 4.0  # px; a mouse that moved less has clicked
_WHEEL_STEP = 120  # Qt's angle of one notch
_NO_COVERAGE = 1e9  # m; before the radar is known the scope has no edge


class Ppi(pg.GraphicsView):
    """The scope.

    Attributes
    ----------
    view : how the operator looks; the scope follows its changes and makes some (wheel, drag, click)
    picture : what is known; the caller feeds it
    economy : 0 everything; 1 half the trails; 2 labels with the name alone. For a machine that is short
        of time

    Signals
    -------
    trackSelected(object) : number of the track that was clicked, or None
    cursorMoved(float, float, float, float) : range m, azimuth rad from the radar; east, north m in the
        frame of the sectors
    cursorLeft() : the mouse is elsewhere
    viewChanged() : the mouse has zoomed or panned
    """

    trackSelected = Signal(object)
    cursorMoved = Signal(float, float, float, float)
    cursorLeft = Signal()
    viewChanged = Signal()

    def __init__(self, view: View, picture: Picture, parent: QWidget | None = None) -> None:
        super().__init__(parent, useOpenGL=False, background=None)
        self.view = view
        self.picture = picture
        self.economy = 0
        self._map: dict[str, Lines] = {}
        self._title = ("", "")
        self._overlay = Overlay()
        self._sweep = Sweep()
        self._lit = 0
        self._history = picture.history
        self._overlay_age = math.inf
        self._drawn: tuple[Any, ...] = ()
        self._phosphor_drawn: tuple[Any, ...] = ()
        self._pressed: QPointF | None = None
        self._dragging = False
        self.setViewportUpdateMode(pg.GraphicsView.ViewportUpdateMode.NoViewportUpdate)
        self.setCacheMode(pg.GraphicsView.CacheModeFlag.CacheNone)
        self.setMinimumSize(240, 240)
        self._scope = _Scope(self)
        self.addItem(self._scope)
        self._allocate()

    # -- what the caller drives --------------------------------------------------------------------

    def set_map(self, layers: Map) -> None:
        """Show polylines (n, 2), m east and north in the frame of the sectors, by layer."""
        self._map = {name: Lines(polylines) for name, polylines in layers.items()}
        self._drawn = ()

    def set_title(self, title: str, subtitle: str = "") -> None:
        """Two lines, top left."""
        self._title = (title, subtitle)
        self._drawn = ()

    def advance(self, wall: float) -> None:
        """Wall time went on by `wall` s: let the glow decay, show what came, repaint."""
        self.picture.advance(wall)
        before = self._sweep.angle
        self._sweep.follow(self.picture.beam, wall)
        self._keep_up()
        self._light_new(before)
        self._overlay_age += wall
        if self._overlay_age >= OVERLAY_PERIOD:
            self._paint_overlay()
        self._develop(wall)
        self.viewport().update()

    def refresh(self) -> None:
        """Everything as it now is, without passage of time: after a change that should show at once."""
        before = self._sweep.angle
        self._sweep.jump(self.picture.beam)
        self._keep_up()
        self._light_new(before)
        self._paint_overlay()
        self._develop(0.0)
        self.viewport().update()

    def clear(self) -> None:
        """Forget the glow; done without being asked when the picture has been cleared."""
        self._lit = 0
        self._sweep.jump(self.picture.beam)
        self._phosphor.clear()
        self._drawn = ()

    @property
    def projection(self) -> Projection:
        """From metres about the radar to pixels of the widget."""
        return Projection.of(self.view, self.width(), self.height())

    @property
    def hidden_labels(self) -> int:
        """Labels that found no room."""
        return self._overlay.hidden

    def close(self) -> bool:
        """Close the widget as Qt does; pyqtgraph's own takes the viewport away first, which crashes."""
        return bool(QWidget.close(self))

    def sizeHint(self) -> QSize:
        return QSize(1024, 1024)

    # -- painting ----------------------------------------------------------------------------------

    @property
    def _palette(self) -> Palette:
        return PALETTES[self.view.palette]

    @property
    def _coverage(self) -> float:
        return self.picture.radar.max_range if self.picture.radar else _NO_COVERAGE

    def _allocate(self) -> None:
        """Images of the widget's size in pixels of the device."""
        ratio = self.devicePixelRatioF()
        width, height = max(round(self.width() * ratio), 1), max(round(self.height() * ratio), 1)
        self._base, self._base_pixels = _image(width, height, ratio)
        self._under = np.empty_like(self._base_pixels)
        self._tracks = QImage(width, height, QImage.Format.Format_ARGB32_Premultiplied)
        self._tracks.setDevicePixelRatio(ratio)
        self._phosphor = Phosphor(width, height, self._palette)
        self._frame = QImage(self._phosphor.pixels.data, width, height, 4 * width, QImage.Format.Format_RGB32)
        self._frame.setDevicePixelRatio(ratio)
        self._boxes: list[tuple[float, float, float, float]] = []
        self._drawn = ()

    def _keep_up(self) -> None:
        """Redraw what stands still if the view, the radar or its place has changed."""
        if self.devicePixelRatioF() != self._base.devicePixelRatioF():
            self._allocate()
        if self.picture.history is not self._history:  # the picture was cleared
            self._history = self.picture.history
            self.clear()
        state = (self.view.revision, self.picture.radar, self.picture.position[:2])
        if state == self._drawn:
            return
        fresh = self._phosphor_state()
        if not self._drawn or fresh != self._phosphor_drawn:
            self._phosphor_drawn = fresh
            self._phosphor.recolour(self._palette)
            self._phosphor.clear()
            self._relight()
        self._draw_base()
        self._drawn = state
        self._overlay_age = math.inf

    def _phosphor_state(self) -> tuple[Any, ...]:
        """What the glow depends on; a change of anything else leaves it as it is."""
        view = self.view
        kinds = (view.shows(Layer.PLOTS), view.shows(Layer.CENTROIDS))
        return (self.projection, self.picture.position[:2], kinds, view.afterglow_s, view.palette)

    def _draw_base(self) -> None:
        ratio = self._base.devicePixelRatioF()
        on, view, palette = self.projection, self.view, self._palette
        device = on.scaled(ratio)
        self._base.fill(qcolor(palette.background))
        painter = QPainter(self._base)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        draw_disc(painter, on, view, palette)
        painter.end()
        if view.shows(Layer.MAP):
            for name, lines in self._map.items():
                hue, dash = MAP_STYLES.get(name, MAP_STYLES["user"])
                lines.draw(self._base_pixels, device, self.picture.position[:2], getattr(palette, hue), dash)
        self._boxes = [TITLE]
        painter = QPainter(self._base)
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        if view.shows(Layer.GRID):
            draw_grid(self._base_pixels, device, view, palette, self._coverage, ratio)
            self._boxes += draw_figures(painter, on, view, palette, self._coverage)
        draw_title(painter, palette, *self._title)
        painter.end()

    def _paint_overlay(self) -> None:
        self._overlay_age = 0.0
        np.copyto(self._under, self._base_pixels)
        view = self.view
        if view.shows(Layer.TRACKS) and view.shows(Layer.TRAILS) and view.trail_s > 0:
            length = view.trail_s * (0.5 if self.economy else 1.0)
            _draw_trails(
                self._under,
                self.projection.scaled(self._base.devicePixelRatioF()),
                self.picture,
                length,
                self._palette,
            )
        self._tracks.fill(0)
        painter = QPainter(self._tracks)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        detail = 1 if self.economy > 1 else view.label_detail
        self._overlay.paint(painter, self.projection, view, self.picture, self._palette, self._boxes, detail)
        painter.end()

    def _light_new(self, before: float) -> None:
        """Light the hits that the shown sweep has passed since the last time."""
        history = self.picture.history
        if self.view.afterglow_s == 0:
            self._phosphor.erase(self._device, before, self._sweep.angle)
        rows = history.rows(self._lit, history.count)
        # A hit beyond the encoder itself waits for nothing: its source is not exact about azimuth.
        beam = history.beam[rows]
        ahead = np.flatnonzero((beam > self._sweep.angle) & (beam <= self.picture.beam))
        if len(ahead):
            rows = rows[: ahead[0]]
            self._lit = max(self._lit, history.oldest) + len(rows)
        else:
            self._lit = history.count
        self._light(rows, history.strength[rows])

    def _relight(self) -> None:
        """Light all that still glows, from the history: after a change of range, centre or palette."""
        history = self.picture.history
        rows = history.rows(0, self._lit)
        tau = self.view.afterglow_s
        if tau == 0:
            rows = rows[history.beam[rows] > self._sweep.angle - TURN]
            glow = history.strength[rows]
        else:
            glow = history.strength[rows] * np.exp((history.lit[rows] - self.picture.clock) / tau)
        kept = glow > FAINTEST
        self._light(rows[kept], glow[kept])

    def _light(self, rows: NDArray[np.int64], glow: NDArray[np.float64]) -> None:
        radar = self.picture.radar
        if radar is None or len(rows) == 0:
            return
        shown = np.array([self.view.shows(Layer.PLOTS), self.view.shows(Layer.CENTROIDS)])
        kept = shown[self.picture.history.kind[rows]]
        depth = self.picture.cell_depth
        blip = (radar.beam_width / _BEAM_PARTS, 2.0 * radar.sd_range if math.isnan(depth) else depth)
        ratio = self._base.devicePixelRatioF()
        self._phosphor.light(
            self._device, self.picture.history, rows[kept], glow[kept], self.picture.position, blip, ratio
        )

    def _develop(self, wall: float) -> None:
        tau = self.view.afterglow_s
        device = self._device
        self._phosphor.develop(
            self._under,
            math.exp(-wall / tau) if tau > 0 else 1.0,
            device,
            self._sweep.angle,
            self._coverage * device.scale,
            self.view.shows(Layer.SWEEP) and self.picture.radar is not None,
        )

    @property
    def _device(self) -> Projection:
        return self.projection.scaled(self._base.devicePixelRatioF())

    def paint_on(self, painter: QPainter) -> None:
        """The finished picture, the tracks and the sweep."""
        painter.drawImage(QPointF(0.0, 0.0), self._frame)
        if self.view.shows(Layer.SWEEP) and self.picture.radar is not None:
            self._paint_sweep(painter)
        painter.drawImage(QPointF(0.0, 0.0), self._tracks)

    def _paint_sweep(self, painter: QPainter) -> None:
        """The beam; dashed in the colour of alarms when the encoder stands still."""
        on, palette = self.projection, self._palette
        length = min(self._coverage, on.reach) * on.scale
        pen = QPen(qcolor(palette.sweep), 1.4)
        if self.picture.stalled:
            pen = QPen(qcolor(palette.alarm), 1.6, Qt.PenStyle.DashLine)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(pen)
        angle = self._sweep.angle
        tip = QPointF(on.x0 + length * math.sin(angle), on.y0 - length * math.cos(angle))
        painter.drawLine(QPointF(on.x0, on.y0), tip)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(qcolor(palette.ring_text))
        painter.drawEllipse(QPointF(on.x0, on.y0), 2.5, 2.5)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    # -- the mouse ---------------------------------------------------------------------------------

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        super().resizeEvent(event)
        if hasattr(self, "_scope"):
            self._scope.prepareGeometryChange()
            self._allocate()
            self.refresh()

    def wheelEvent(self, event: QWheelEvent) -> None:
        about = self.projection.to_ground(event.position().x(), event.position().y())
        notches = event.angleDelta().y() / _WHEEL_STEP
        for _ in range(max(1, round(abs(notches)))):
            if notches > 0:
                self.view.zoom_in(about)
            elif notches < 0:
                self.view.zoom_out(about)
        self._view_changed()
        event.accept()

    def _view_changed(self) -> None:
        self.refresh()
        self.viewChanged.emit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._pressed, self._dragging = event.position(), False

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pressed is not None:
            moved = event.position() - self._pressed
            self._dragging = self._dragging or math.hypot(moved.x(), moved.y()) > _DRAG
            if self._dragging:
                scale = self.projection.scale
                self.view.pan(-moved.x() / scale, moved.y() / scale)
                self._pressed = event.position()
                self._view_changed()
        east, north = self.projection.to_ground(event.position().x(), event.position().y())
        distance, azimuth = to_polar(east, north)
        position = self.picture.position
        self.cursorMoved.emit(float(distance), float(azimuth), east + position[0], north + position[1])

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or self._pressed is None:
            return
        if not self._dragging:
            self.view.selected = self.track_at(event.position().x(), event.position().y())
            self.refresh()
            self.trackSelected.emit(self.view.selected)
        self._pressed, self._dragging = None, False

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.mousePressEvent(event)

    def keyPressEvent(self, event: Any) -> None:
        event.ignore()  # keys belong to the window

    def leaveEvent(self, event: QEvent) -> None:
        self.cursorLeft.emit()

    def track_at(self, x: float, y: float) -> int | None:
        """Number of the track nearest to a pixel of the widget, within a click's reach; or None."""
        tracks, position = self.picture.tracks, self.picture.position
        if len(tracks) == 0 or not self.view.shows(Layer.TRACKS):
            return None
        px, py = self.projection.to_screen(tracks["east"] - position[0], tracks["north"] - position[1])
        distance = np.hypot(px - x, py - y)
        nearest = int(np.argmin(distance))
        return int(tracks["track"][nearest]) if distance[nearest] <= _PICK else None


class _Scope(pg.GraphicsObject):
    """The one item of the scene: it fills the view."""

    def __init__(self, ppi: Ppi) -> None:
        super().__init__()
        self._ppi = ppi

    def boundingRect(self) -> QRectF:
        return QRectF(0.0, 0.0, self._ppi.width(), self._ppi.height())

    def paint(
        self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None
    ) -> None:
        self._ppi.paint_on(painter)


def _image(width: int, height: int, ratio: float) -> tuple[QImage, Pixels]:
    """An image and its pixels, which share the memory."""
    image = QImage(width, height, QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.bits(), np.uint32).reshape(height, -1)[:, :width]
    image.setDevicePixelRatio(ratio)
    return image, pixels


def _draw_trails(pixels: Pixels, on: Projection, picture: Picture, length: float, palette: Palette) -> None:
    """The trails of all tracks but the tentative ones, at once; they fade with age."""
    points = picture.trails[picture.tracks["status"] != TrackStatus.TENTATIVE]
    fresh = points[:, :, 2] > picture.time - length
    used = np.flatnonzero(fresh.any(axis=0))
    if len(used) == 0:
        return
    points, fresh = points[:, used[0] :], fresh[:, used[0] :]
    x, y = on.to_screen(points[:, :, 0] - picture.position[0], points[:, :, 1] - picture.position[1])
    x[~fresh] = np.nan
    age = np.where(fresh, (picture.time - points[:, :, 2]) / length, 1.0)
    starts = np.zeros(x.shape, bool)
    starts[:, 0] = True
    opacity = 0.9 * np.sqrt(1.0 - np.clip(age, 0.0, 1.0)) + 0.1
    hue = mix(palette.scope, palette.track, 0.8)
    strokes.draw(pixels, x.ravel(), y.ravel(), starts.ravel(), packed(hue), opacity.ravel())
