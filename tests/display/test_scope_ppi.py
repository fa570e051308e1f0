"""Facts about pixels: what is known lights the right place in the right way, and goes again."""

import math
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QWheelEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from radar_console.core.messages import (
    CENTROID,
    PLOT,
    TRACK,
    TRUTH,
    Radar,
    Sector,
    Site,
    Table,
    TrackStatus,
    blank,
)
from radar_console.core.units import KM, TURN
from radar_console.display.palette import NIGHT, OKABE_ITO, Colour
from radar_console.display.picture import STALLED_AFTER, Picture
from radar_console.display.ppi import Ppi
from radar_console.display.view import Layer, View

# The beam is so wide that a plot at 30 km covers whole pixels and shines in full.
RADAR = Radar(
    "Test",
    rotation=4.0,
    max_range=100 * KM,
    sd_range=50.0,
    sd_azimuth=0.002,
    beam_width=0.3,
    site=Site(54.0, 10.0),
)
SIDE = 600
QUIET = {Layer.PLOTS, Layer.CENTROIDS, Layer.TRACKS}


class Bench:
    """A scope and the antenna that feeds it: sixteen sectors a turn of 4 s."""

    def __init__(self, qtbot: QtBot, layers: set[Layer] = QUIET, **view: Any) -> None:
        self.view = View(range_m=100 * KM, **view)
        self.view.show(layers)
        self.picture = Picture()
        self.ppi = Ppi(self.view, self.picture)
        self.ppi.resize(SIDE, SIDE)
        qtbot.addWidget(self.ppi)
        self.ppi.show()
        self.count = 0

    def turn(self, **tables: Any) -> None:
        """One more sector, shown at once."""
        step, k = TURN / 16, self.count
        self.picture.take(
            Sector(RADAR, k * 0.25, (k + 1) * 0.25, k * step, (k + 1) * step, k * step, **tables)
        )
        self.count += 1
        self.ppi.refresh()

    def pixels(self) -> NDArray[np.float64]:
        """(height, width, 3) red, green, blue as grabbed."""
        image = self.ppi.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
        packed = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)
        return packed[:, :, 2::-1].astype(float)

    def at(self, east: float, north: float) -> tuple[int, int]:
        """Row and column of a place."""
        x, y = self.ppi.projection.to_screen(east, north)
        return int(y), int(x)


def plots(*places: tuple[float, float], amplitude: float = 1000.0) -> Table:
    """Strong plots at range m and azimuth rad."""
    table = blank(PLOT, len(places))
    table["range"], table["azimuth"] = np.array(places).T
    table["amplitude"] = amplitude
    return table


def track(number: int, east: float, north: float, **fields: float) -> Table:
    table = blank(TRACK, 1)
    table["track"], table["status"] = number, TrackStatus.CONFIRMED
    table["east"], table["north"], table["v_east"], table["v_north"] = east, north, 0.0, 0.0
    for name, value in fields.items():
        table[name] = value
    return table


def middle_of_light(pixels: NDArray[np.float64], dark: NDArray[np.float64]) -> tuple[int, int]:
    """Row and column about which the light lies that has been added."""
    added = np.abs(pixels - dark).sum(axis=2)
    rows, columns = np.indices(added.shape) + 0.5
    return int((rows * added).sum() / added.sum()), int((columns * added).sum() / added.sum())


def nearest_to(pixels: NDArray[np.float64], hue: Colour, tolerance: float = 40.0) -> NDArray[np.int64]:
    """(n, 2) rows and columns whose colour is about `hue`."""
    return np.argwhere(np.abs(pixels - np.array(hue)).max(axis=2) < tolerance)


@pytest.mark.parametrize("degrees", [0, 45, 90, 200, 355])
def test_a_plot_lights_the_pixel_of_its_range_and_azimuth(qtbot: QtBot, degrees: int) -> None:
    bench = Bench(qtbot)
    azimuth = math.radians(degrees)
    for _ in range(16):
        bench.turn()
    dark = bench.pixels()
    bench.turn(plots=plots((60 * KM, azimuth)))
    for _ in range(15):
        bench.turn()
    row, column = middle_of_light(bench.pixels(), dark)
    expected = bench.at(60 * KM * math.sin(azimuth), 60 * KM * math.cos(azimuth))
    assert abs(row - expected[0]) <= 1
    assert abs(column - expected[1]) <= 1


def test_north_is_up_and_east_is_right(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    north, east = bench.at(0.0, 50 * KM), bench.at(50 * KM, 0.0)
    middle = (SIDE // 2, SIDE // 2)
    assert north[0] < middle[0]
    assert north[1] == middle[1]
    assert east[1] > middle[1]
    assert east[0] == middle[0]


def test_afterglow_decays_with_its_time_constant_and_to_darkness(qtbot: QtBot) -> None:
    bench = Bench(qtbot, afterglow_s=2.0)
    dark = bench.pixels()
    bench.turn(plots=plots((60 * KM, 0.2)))
    glow = bench.ppi._phosphor._plots
    start = float(glow.max())
    bench.ppi.advance(2.0)
    # The raster is float32, whose relative step is 1.2e-7.
    assert float(glow.max()) == pytest.approx(start / math.e, rel=1e-6)
    for _ in range(20):
        bench.ppi.advance(1.0)
    assert float(glow.max()) == 0.0
    np.testing.assert_array_equal(bench.pixels(), dark)


def test_without_afterglow_a_plot_stays_until_the_beam_returns(qtbot: QtBot) -> None:
    bench = Bench(qtbot, afterglow_s=0.0)
    bench.turn(plots=plots((60 * KM, 0.2)))
    fresh = float(bench.ppi._phosphor._plots.max())
    assert fresh > 0.5
    for _ in range(15):
        bench.turn()
        bench.ppi.advance(0.25)
    assert float(bench.ppi._phosphor._plots.max()) == fresh
    bench.picture.take(Sector(RADAR, 4.0, 4.25, TURN, TURN + TURN / 16, TURN))
    for _ in range(40):
        bench.ppi.advance(0.05)
    assert float(bench.ppi._phosphor._plots.max()) == 0.0


@pytest.mark.parametrize("change", ["zoom", "pan", "resize"])
def test_a_change_of_view_keeps_the_history(qtbot: QtBot, change: str) -> None:
    bench = Bench(qtbot)
    bench.turn(plots=plots((30 * KM, 0.3)))
    bench.ppi.advance(1.0)
    before = float(bench.ppi._phosphor._plots.max())
    if change == "zoom":
        bench.view.zoom_in()
    elif change == "pan":
        bench.view.pan(5 * KM, 10 * KM)
    else:
        bench.ppi.resize(500, 400)
    bench.ppi.refresh()
    shown = bench.pixels()
    bench.view.toggle(Layer.PLOTS)
    bench.ppi.refresh()
    row, column = middle_of_light(shown, bench.pixels())
    bench.view.toggle(Layer.PLOTS)
    bench.ppi.refresh()
    expected = bench.at(30 * KM * math.sin(0.3), 30 * KM * math.cos(0.3))
    assert abs(row - expected[0]) <= 1
    assert abs(column - expected[1]) <= 2
    # A thin blip that lies between two rows of pixels gives each three quarters of its light.
    assert float(bench.ppi._phosphor._plots.max()) == pytest.approx(before, rel=0.26)


def test_a_palette_changes_the_glow_that_is_already_there(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    bench.turn(plots=plots((30 * KM, 0.3)))
    where = bench.at(30 * KM * math.sin(0.3), 30 * KM * math.cos(0.3))
    bench.view.palette = "okabe-ito"
    bench.ppi.refresh()
    assert tuple(bench.pixels()[where]) == pytest.approx(OKABE_ITO.phosphor[-1], abs=6)


@pytest.mark.parametrize(
    ("layer", "hue"),
    [
        (Layer.PLOTS, NIGHT.phosphor[-1]),
        (Layer.CENTROIDS, NIGHT.centroid),
        (Layer.TRACKS, NIGHT.track),
        (Layer.TRUTH, NIGHT.truth),
        (Layer.MAP, NIGHT.coast),
        (Layer.GRID, NIGHT.ring_text),
    ],
)
def test_every_layer_has_its_colour_and_its_switch(qtbot: QtBot, layer: Layer, hue: Colour) -> None:
    bench = Bench(qtbot, {layer})
    south = bench.ppi.projection.to_ground(0.0, 430.5)[1]  # through the middles of a row of pixels
    bench.ppi.set_map({"coast": [np.array([[-9e4, south], [9e4, south]])]})
    truth = blank(TRUTH, 1)
    truth["east"], truth["north"] = -20 * KM, 20 * KM
    bench.picture.take_truth(truth)
    centroid = blank(CENTROID, 1)
    centroid["range"], centroid["azimuth"] = 70 * KM, 0.2
    bench.turn(plots=plots((40 * KM, 0.3)), centroids=centroid, tracks=track(1, 30 * KM, -30 * KM))
    assert len(nearest_to(bench.pixels(), hue, 30.0)) > 0
    bench.view.toggle(layer)
    bench.ppi.refresh()
    assert len(nearest_to(bench.pixels(), hue, 30.0)) == 0


def test_labels_do_not_outlive_the_tracks(qtbot: QtBot) -> None:
    bench = Bench(qtbot, {Layer.TRACKS, Layer.LABELS, Layer.VECTORS, Layer.TRAILS})
    empty = bench.pixels()
    bench.turn(tracks=track(1, 30 * KM, 10 * KM, v_east=300.0))
    assert np.abs(bench.pixels() - empty).max() > 100
    bench.view.toggle(Layer.TRACKS)
    bench.ppi.refresh()
    np.testing.assert_array_equal(bench.pixels(), empty)


def test_a_tentative_track_is_a_quiet_symbol_without_label_vector_or_trail(qtbot: QtBot) -> None:
    bench = Bench(qtbot, {Layer.TRACKS, Layer.LABELS, Layer.VECTORS, Layer.TRAILS})
    dark = bench.pixels()
    for k in range(3):
        guess = track(1, 30 * KM + 5 * KM * k, 10 * KM, v_east=800.0, status=TrackStatus.TENTATIVE, time=k)
        bench.turn(tracks=guess)
    changed = np.argwhere(np.abs(bench.pixels() - dark).max(axis=2) > 3)
    assert 0 < np.ptp(changed, axis=0).max() <= 10
    assert len(nearest_to(bench.pixels(), NIGHT.track)) == 0


def test_the_bracket_stands_about_the_selected_track_alone(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    bench.turn(tracks=np.concatenate([track(1, 30 * KM, 10 * KM), track(2, -30 * KM, 10 * KM)]))
    before = bench.pixels()
    bench.view.selected = 2
    bench.ppi.refresh()
    changed = np.argwhere(np.abs(bench.pixels() - before).max(axis=2) > 60)
    row, column = bench.at(-30 * KM, 10 * KM)
    np.testing.assert_allclose(changed.mean(axis=0), [row, column], atol=1.0)
    assert np.abs(changed - [row, column]).max() <= 14


def test_a_click_selects_the_nearest_track_or_none(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    bench.turn(tracks=np.concatenate([track(7, 30 * KM, 10 * KM), track(9, 32 * KM, 10 * KM)]))
    chosen: list[int | None] = []
    bench.ppi.trackSelected.connect(chosen.append)
    for east, north in ((29.8 * KM, 10 * KM), (33 * KM, 10 * KM), (-50 * KM, 0.0)):
        row, column = bench.at(east, north)
        qtbot.mouseClick(bench.ppi.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(column, row))
    assert chosen == [7, 9, None]
    assert bench.view.selected is None


def test_a_drag_moves_the_picture_with_the_mouse_and_selects_nothing(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    chosen: list[int | None] = []
    bench.ppi.trackSelected.connect(chosen.append)
    port, button = bench.ppi.viewport(), Qt.MouseButton.LeftButton
    grabbed = bench.ppi.projection.to_ground(300, 300)
    qtbot.mousePress(port, button, pos=QPoint(300, 300))
    qtbot.mouseMove(port, QPoint(350, 280))
    qtbot.mouseRelease(port, button, pos=QPoint(350, 280))
    assert bench.ppi.projection.to_screen(*grabbed) == pytest.approx((350, 280), abs=1.0)
    assert chosen == []


def test_the_wheel_zooms_about_the_cursor(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    under = bench.ppi.projection.to_ground(400, 200)
    event = QWheelEvent(
        QPointF(400, 200),
        bench.ppi.mapToGlobal(QPointF(400, 200)),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    with qtbot.waitSignal(bench.ppi.viewChanged):
        QApplication.sendEvent(bench.ppi.viewport(), event)
    assert bench.view.range_m == 75 * KM
    assert bench.ppi.projection.to_ground(400, 200) == pytest.approx(under, abs=1e-6)


def test_the_cursor_reads_range_and_azimuth_from_a_moved_radar(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    bench.turn()
    bench.picture.position = (1000.0, -500.0, 0.0)
    row, column = bench.at(0.0, 50 * KM)
    with qtbot.waitSignal(bench.ppi.cursorMoved) as moved:
        qtbot.mouseMove(bench.ppi.viewport(), QPoint(column, row))
    distance, azimuth, east, north = moved.args
    pixel = 1.0 / bench.ppi.projection.scale
    assert distance == pytest.approx(50 * KM, abs=pixel)
    assert math.sin(azimuth) == pytest.approx(0.0, abs=pixel / (50 * KM))
    assert (east, north) == pytest.approx((1000.0, 49_500.0), abs=pixel)


def test_the_shown_beam_runs_evenly_never_ahead_and_stops_with_the_encoder(qtbot: QtBot) -> None:
    bench = Bench(qtbot, {Layer.SWEEP})
    shown = []
    step = TURN / 16
    for k in range(160):
        if k % 4 == 0:  # a sector every fourth frame
            n = bench.count
            bench.picture.take(Sector(RADAR, n * 0.25, (n + 1) * 0.25, n * step, (n + 1) * step, n * step))
            bench.count += 1
        bench.ppi.advance(0.0625)
        shown.append(bench.ppi._sweep.angle)
        assert shown[-1] <= bench.picture.beam
    # The mean interval is learnt: after 25 sectors what is left of the first guess is 0.7²⁵.
    np.testing.assert_allclose(np.diff(shown[100:]), step / 4, rtol=1e-3)
    for _ in range(30):
        bench.ppi.advance(0.0625)
    assert bench.ppi._sweep.angle == bench.picture.beam
    assert bench.picture.stalled == (30 * 0.0625 > STALLED_AFTER)
    assert len(nearest_to(bench.pixels(), NIGHT.alarm, 80.0)) > 50  # the beam says so, dashed


def test_only_the_wedge_behind_the_beam_is_tinted(qtbot: QtBot) -> None:
    bench = Bench(qtbot, {Layer.SWEEP})
    dark = bench.pixels()
    for _ in range(4):  # the beam points east
        bench.turn()
    tinted = np.abs(bench.pixels() - dark).max(axis=2) > 3.0
    behind, ahead = bench.at(50 * KM, 10 * KM), bench.at(50 * KM, -10 * KM)
    assert tinted[behind]
    assert not tinted[ahead]
    assert not tinted[bench.at(-50 * KM, 10 * KM)]


def test_a_dropped_sector_leaves_the_scope_running(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    bench.turn()
    bench.count += 40  # two turns and a half are missing
    bench.turn(plots=plots((60 * KM, (bench.count % 16 + 0.5) * TURN / 16)))
    assert float(bench.ppi._phosphor._plots.max()) > 0.9


def test_a_new_picture_starts_dark(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    dark = bench.pixels()
    bench.turn(plots=plots((60 * KM, 0.2)))
    bench.picture.clear()
    bench.ppi.refresh()
    np.testing.assert_array_equal(bench.pixels(), dark)


def test_a_dense_picture_hides_labels_and_says_how_many(qtbot: QtBot) -> None:
    bench = Bench(qtbot, {Layer.TRACKS, Layer.LABELS})
    rng = np.random.default_rng(3)
    crowd = [track(k, *rng.uniform(-9 * KM, 9 * KM, 2)) for k in range(100)]
    bench.turn(tracks=np.concatenate(crowd))
    assert 0 < bench.ppi.hidden_labels < 100
    few = bench.ppi.hidden_labels
    bench.view.label_detail = 1
    bench.view.range_m = 10 * KM
    bench.ppi.refresh()
    assert bench.ppi.hidden_labels < few


def test_repaints_do_not_leak_references_to_none(qtbot: QtBot) -> None:
    """PySide6 6.12.0 loses one with every call of a painter, and the process aborts at zero."""
    bench = Bench(qtbot, set(Layer))
    bench.turn(plots=plots((60 * KM, 0.2)), tracks=track(1, 30 * KM, 10 * KM, v_east=300.0))
    truth = blank(TRUTH, 1)
    truth["east"], truth["north"] = 20 * KM, 20 * KM
    bench.picture.take_truth(truth)

    def repaint(times: int) -> int:
        for _ in range(times):
            bench.ppi.advance(0.11)  # longer than the overlay's period: everything is painted
            bench.ppi.viewport().repaint()
        return sys.getrefcount(None)

    first = repaint(20)
    # One lost reference a repaint would be 1,000; caches may hold some more or less.
    assert abs(repaint(1000) - first) < 100
