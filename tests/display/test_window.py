"""The console's window: what keys and clicks do, and what the panel and the bar say."""

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from console_stream import ROTATION, Stream, radar
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from radar_console.core.errors import InputError
from radar_console.core.messages import TrackStatus
from radar_console.display import actions, console, tracktable
from radar_console.display.actions import ACTIONS
from radar_console.display.feed import Feed
from radar_console.display.options import Options
from radar_console.display.palette import PALETTES
from radar_console.display.view import Layer
from radar_console.display.window import ConsoleWindow


class Playback:
    """Controls and health that a test can turn."""

    def __init__(self) -> None:
        self.rate = 1.0
        self.paused = False
        self.depth = 0
        self.sectors_dropped = 0
        self.returns_dropped = 0
        self.skipped: dict[str, int] = {}


@pytest.fixture
def playback() -> Playback:
    return Playback()


@pytest.fixture
def window(qtbot: QtBot, playback: Playback) -> Iterator[ConsoleWindow]:
    """A window that has seen 26 tracks for six turns; its timers stand still."""
    stream = Stream()
    made = ConsoleWindow(
        stream.radar,
        Feed(),
        playback,
        playback,
        Options("Test", "synthetic", epoch=datetime(2026, 11, 22, 14)),
    )
    qtbot.addWidget(made)
    made.resize(1400, 900)
    made.show()
    for sector in stream.sectors(6 * ROTATION):
        made.take(sector)
    made.still()
    yield made
    made.close()


def column(window: ConsoleWindow, number: int) -> list[str]:
    model = window.table.model
    return [model.text(row, number) for row in range(model.rowCount())]


def press(qtbot: QtBot, window: ConsoleWindow, name: str) -> None:
    """What a person does to start an action: its first key."""
    action = next(action for action in window.actions() if action.objectName() == name)
    sequence = action.shortcuts()[0]
    combination = sequence[0]
    qtbot.keyClick(window.scope, combination.key(), combination.keyboardModifiers())


# ---- The table


def test_the_table_holds_every_track_once_confirmed_ones_by_name(window: ConsoleWindow) -> None:
    names = column(window, tracktable.TRACK_NAME)
    assert names == [f"T{k:03d}" for k in range(1, 26)] + ["–"]
    assert window.table.counts.text().split("   ") == ["24 confirmed", "1 coasting", "1 tentative"]


def test_figures_are_those_of_the_tracks(window: ConsoleWindow) -> None:
    row = 3
    track = window.picture.tracks[window.picture.row_of(window.table.model.tracks[row])]
    east, north = float(track["east"]), float(track["north"])
    assert column(window, tracktable.RANGE)[row] == f"{np.hypot(east, north) / 1000:.3g}"
    assert column(window, tracktable.BEARING)[row] == f"{np.degrees(np.arctan2(east, north)) % 360:03.0f}°"
    speed = np.hypot(track["v_east"], track["v_north"]) * 3.6
    assert column(window, tracktable.SPEED)[row] == f"{speed:.3g}"
    assert column(window, tracktable.AGE)[row] == "00:24"


def test_columns_without_a_value_are_hidden(window: ConsoleWindow) -> None:
    assert window.table.table.isColumnHidden(tracktable.HEIGHT)
    assert window.table.table.isColumnHidden(tracktable.CODE)


def test_a_click_on_the_header_sorts_and_another_reverses(qtbot: QtBot, window: ConsoleWindow) -> None:
    header = window.table.table.horizontalHeader()
    middle = header.sectionViewportPosition(tracktable.RANGE) + header.sectionSize(tracktable.RANGE) // 2
    for reverse in (False, True):
        qtbot.mouseClick(header.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(middle, 8))
        ranges = [float(text) for text in column(window, tracktable.RANGE)]
        assert ranges == sorted(ranges, reverse=reverse)


@pytest.mark.parametrize("order", Qt.SortOrder)
def test_equal_rows_keep_the_order_of_their_names(window: ConsoleWindow, order: Qt.SortOrder) -> None:
    window.table.table.sortByColumn(tracktable.AGE, order)
    assert column(window, tracktable.TRACK_NAME) == [f"T{k:03d}" for k in range(1, 26)] + ["–"]


def test_the_filter_wants_every_word(qtbot: QtBot, window: ConsoleWindow) -> None:
    press(qtbot, window, "filter")
    assert window.table.filter.hasFocus()
    qtbot.keyClicks(window.table.filter, "conf t01")
    assert column(window, tracktable.TRACK_NAME) == [f"T{k:03d}" for k in range(10, 20)]
    qtbot.keyClick(window.table.filter, Qt.Key.Key_Escape)
    assert window.table.filter.text() == ""
    assert len(column(window, 0)) == 26


# ---- Selection


def test_a_click_on_the_scope_selects_in_the_table(qtbot: QtBot, window: ConsoleWindow) -> None:
    track = window.picture.tracks[7]
    x, y = window.scope.projection.to_screen(track["east"], track["north"])
    qtbot.mouseClick(
        window.scope.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(round(float(x)), round(float(y)))
    )
    assert window.view.selected == track["track"]
    row = window.table.table.currentIndex().row()
    assert window.table.model.tracks[row] == track["track"]
    assert window.details.name.text() == window.picture.name_of(int(track["track"]))


def test_a_click_on_a_row_selects_on_the_scope(qtbot: QtBot, window: ConsoleWindow) -> None:
    table = window.table.table
    place = table.visualRect(window.table.model.index(4, 1)).center()
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert window.view.selected == window.table.model.tracks[4]
    assert window.details.values["range"].text() == f"{column(window, tracktable.RANGE)[4]} km"


def test_the_selection_stays_with_its_track_when_rows_move(window: ConsoleWindow) -> None:
    window.select(window.table.model.tracks[2])
    window.table.table.sortByColumn(tracktable.SPEED, Qt.SortOrder.DescendingOrder)
    row = window.table.table.currentIndex().row()
    assert window.table.model.tracks[row] == window.view.selected


def test_next_and_previous_go_round(qtbot: QtBot, window: ConsoleWindow) -> None:
    tracks = window.table.model.tracks
    seen = []
    for _ in range(3):
        press(qtbot, window, "next_track")
        seen.append(window.view.selected)
    assert seen == tracks[:3]
    for _ in range(3):
        press(qtbot, window, "previous_track")
    assert window.view.selected == tracks[-1]


def test_escape_undoes_one_thing_at_a_time(qtbot: QtBot, window: ConsoleWindow) -> None:
    press(qtbot, window, "next_track")
    press(qtbot, window, "help")
    assert window.help.isVisible()
    press(qtbot, window, "deselect")
    assert not window.help.isVisible()
    assert window.view.selected is not None
    press(qtbot, window, "deselect")
    assert window.view.selected is None
    assert not window.table.table.selectionModel().hasSelection()


def test_a_track_that_ends_stays_in_the_details_as_lost(window: ConsoleWindow) -> None:
    track = window.table.model.tracks[0]
    window.select(track)
    last = window.picture.tracks[window.picture.row_of(track)].copy().reshape(1)
    last["status"] = TrackStatus.DELETED
    sector = next(Stream().sectors(1.0, start=window.picture.time))
    window.take(sector.adding(tracks=last))
    window.refresh()
    assert track not in window.table.model.tracks
    assert window.details.name.text() == "T001"
    assert "lost" in window.details.state.text()


# ---- Keys


def test_no_key_has_two_meanings() -> None:
    keys = [key for action in ACTIONS for key in action.keys]
    assert len(keys) == len(set(keys))
    assert len({action.name for action in ACTIONS}) == len(ACTIONS)


@pytest.mark.parametrize("layer", Layer)
def test_every_layer_has_its_switch(qtbot: QtBot, window: ConsoleWindow, layer: Layer) -> None:
    press(qtbot, window, f"layer_{layer}")
    assert not window.view.shows(layer)
    press(qtbot, window, f"layer_{layer}")
    assert window.view.shows(layer)


@pytest.mark.parametrize(
    ("longer", "shorter", "field"),
    [
        ("afterglow_longer", "afterglow_shorter", "afterglow_s"),
        ("trail_longer", "trail_shorter", "trail_s"),
        ("vector_longer", "vector_shorter", "vector_s"),
        ("range_out", "range_in", "range_m"),
    ],
)
def test_lengths_step_up_and_down(
    qtbot: QtBot, window: ConsoleWindow, longer: str, shorter: str, field: str
) -> None:
    before = getattr(window.view, field)
    press(qtbot, window, longer)
    assert getattr(window.view, field) > before
    press(qtbot, window, shorter)
    assert getattr(window.view, field) == before
    press(qtbot, window, shorter)
    assert getattr(window.view, field) < before


def test_pause_and_speed(qtbot: QtBot, window: ConsoleWindow, playback: Playback) -> None:
    press(qtbot, window, "pause")
    assert playback.paused
    assert "paused" in window.status.rate.text()
    assert window.banner.isVisible()
    press(qtbot, window, "pause")
    assert not playback.paused
    assert not window.banner.isVisible()
    press(qtbot, window, "faster")
    assert (playback.rate, window.status.rate.text()) == (2.0, "×2")
    press(qtbot, window, "slower")
    press(qtbot, window, "slower")
    assert playback.rate == 0.5
    press(qtbot, window, "real_time")
    assert playback.rate == 1.0


def test_a_paused_picture_does_not_age(window: ConsoleWindow, playback: Playback) -> None:
    playback.paused = True
    window.tick()
    before = window.picture.clock
    window.tick()
    assert window.picture.clock == before


def test_palettes_reach_the_whole_window(qtbot: QtBot, window: ConsoleWindow) -> None:
    sheet = window.styleSheet()
    for _ in PALETTES:
        press(qtbot, window, "palette")
    assert window.styleSheet() == sheet
    press(qtbot, window, "palette")
    assert window.styleSheet() != sheet


def test_the_centre_comes_back(qtbot: QtBot, window: ConsoleWindow) -> None:
    window.view.pan(50e3, -20e3)
    press(qtbot, window, "centre")
    assert window.view.centre == (0.0, 0.0)


def test_letters_typed_into_the_filter_are_no_keys(qtbot: QtBot, window: ConsoleWindow) -> None:
    window.focus_filter()
    qtbot.keyClicks(window.table.filter, "p s+")
    assert window.table.filter.text() == "p s+"


def test_the_page_lists_the_keys_of_the_registry() -> None:
    page = Path(__file__).parents[2] / "docs" / "console.md"
    assert actions.markdown() in page.read_text(encoding="utf-8")


# ---- The bar


def test_drops_of_the_queues_and_of_the_feed_are_shown(window: ConsoleWindow, playback: Playback) -> None:
    assert window.status.drops.text() == "dropped 0"
    playback.sectors_dropped, playback.returns_dropped = 2, 1000
    small = Feed(capacity=1)
    window.feed = small
    for sector in Stream(clutter=0).sectors(0.2):
        small.put(sector)
    window.refresh()
    assert window.status.drops.text().startswith(f"▲ dropped {2 + small.sectors_dropped} sectors")
    assert window.status.drops.property("state") == "alarm"
    assert window.status.drops.isVisible()


def test_what_could_not_be_used_is_counted_with_its_reasons(
    window: ConsoleWindow, playback: Playback
) -> None:
    assert not window.status.skipped.isVisible()
    playback.skipped = {"trailer bytes": 1200, "young tracks beyond max_tracks": 3}
    window.refresh()
    assert window.status.skipped.isVisible()
    assert window.status.skipped.text() == "skipped 1\u2009203"
    assert window.status.skipped.toolTip().splitlines()[1] == "3  young tracks beyond max_tracks"


def test_drops_stay_visible_in_a_narrow_window(window: ConsoleWindow, playback: Playback) -> None:
    playback.sectors_dropped = 5
    window.resize(760, 600)
    window.refresh()
    bar = window.status
    assert bar.drops.isVisible()
    assert bar.drops.geometry().right() <= bar.width()
    assert not bar.tracker.isVisible()


def test_the_bar_says_date_rotation_and_scale(window: ConsoleWindow) -> None:
    assert window.status.moment.text() == "2026-11-22 14:00:24"
    assert window.status.rotation.text() == "15.0 rpm"
    assert window.status.scale.text() == "range 300 km"


def test_the_cursor_reads_range_bearing_and_place(qtbot: QtBot, window: ConsoleWindow) -> None:
    x, y = window.scope.projection.to_screen(30e3, 40e3)
    point = QPoint(round(float(x)), round(float(y)))
    qtbot.mouseMove(window.scope.viewport(), point)
    text = window.status.cursor_field.text()
    # A pixel of this window is about 0.8 km.
    distance, bearing = text.split()[0], text.split()[2]
    assert float(distance) == pytest.approx(50.0, abs=1.0)
    assert float(bearing.rstrip("°")) == pytest.approx(36.9, abs=1.0)
    assert "20.3" in text
    assert "107.2" in text or "107.3" in text


def test_a_stalled_encoder_is_an_alarm(window: ConsoleWindow) -> None:
    window.picture.advance(10.0)
    window.refresh()
    assert window.status.rotation.property("state") == "alarm"
    assert "stalled" in window.banner.text()
    assert window.banner.isVisible()


def test_a_failure_is_shown_and_the_end_is_said(window: ConsoleWindow) -> None:
    window.feed.finish()
    window.refresh()
    assert window.banner.text() == "end of the data"
    window.feed.fail("flight.pcap: cut off in block 17")
    window.refresh()
    assert "flight.pcap: cut off in block 17" in window.banner.text()
    assert window.banner.property("state") == "alarm"


def test_the_feed_is_drained_at_a_tick(window: ConsoleWindow) -> None:
    before = window.picture.sectors
    for sector in Stream().sectors(1.0, start=24.0):
        window.feed.put(sector)
    window.tick()
    assert window.feed.depth == 0
    assert window.picture.sectors == before + 16


# ---- Pictures


def test_a_picture_has_the_size_and_is_not_blank(qtbot: QtBot, tmp_path: Path) -> None:
    stream, file = Stream(), tmp_path / "picture.png"
    seen: list[float] = []
    console.screenshot(
        stream.radar,
        stream.sectors(60.0),
        stream.truth,
        Options("Test"),
        file,
        after_s=12.0,
        size=(1000, 700),
        progress=seen.append,
    )
    image = QImage(str(file))
    assert (image.width(), image.height()) == (1000, 700)
    assert len({image.pixel(x, y) for x in range(0, 1000, 7) for y in range(0, 700, 7)}) > 50
    assert seen[-1] == pytest.approx(12.0)


def test_a_picture_that_cannot_be_written_is_the_users_error(qtbot: QtBot, tmp_path: Path) -> None:
    stream = Stream()
    with pytest.raises(InputError, match="can't be written"):
        console.screenshot(
            stream.radar,
            stream.sectors(1.0),
            None,
            Options("Test"),
            tmp_path / "no" / "a.png",
            size=(800, 600),
        )


def test_a_map_without_a_site_is_the_users_error(qtbot: QtBot, tmp_path: Path) -> None:
    stream = Stream(spec=radar(site=None))
    with pytest.raises(InputError, match="latitude"):
        console.screenshot(
            stream.radar,
            stream.sectors(1.0),
            None,
            Options("Test", user_map=tmp_path / "own.geojson"),
            tmp_path / "a.png",
        )
