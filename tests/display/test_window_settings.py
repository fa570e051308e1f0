"""What is kept from one start to the next, and what becomes of a file that can't be understood."""

from pathlib import Path

import pytest
from console_stream import radar
from pytestqt.qtbot import QtBot

from radar_console.display import settings
from radar_console.display.console import _Still
from radar_console.display.feed import Feed
from radar_console.display.options import Options
from radar_console.display.settings import Settings
from radar_console.display.view import Layer
from radar_console.display.window import ConsoleWindow


def test_without_a_file_the_settings_are_new(tmp_path: Path) -> None:
    assert settings.load(tmp_path / "console.json") == (Settings(), "")


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    file = tmp_path / "folder" / "console.json"
    chosen = Settings("okabe-ito", ("map", "truth"), 3, (1200, 800), 500)
    assert settings.save(chosen, file) == ""
    assert settings.load(file) == (chosen, "")


@pytest.mark.parametrize(
    "content",
    [
        b"{",
        b"\xff\xfe\x00",
        b"[1]",
        b'{"palette": 7}',
        b'{"window": [1]}',
        b'{"panel": "wide"}',
        b'{"label_detail": 9}',
    ],
)
def test_a_corrupt_file_is_set_aside_and_said(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "console.json"
    file.write_bytes(content)
    loaded, trouble = settings.load(file)
    assert loaded == Settings()
    assert str(file) in trouble
    assert not file.exists()
    assert (tmp_path / "console.bad").read_bytes() == content


def test_the_window_keeps_what_the_operator_chose(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "console.json"
    still = _Still()
    first = ConsoleWindow(radar(), Feed(), still, still, Options("Test"), file)
    qtbot.addWidget(first)
    first.view.toggle(Layer.MAP)
    first.view.label_detail = 3
    first.next_palette()
    first.close()
    second = ConsoleWindow(radar(), Feed(), still, still, Options("Test"), file)
    qtbot.addWidget(second)
    assert second.view.palette == first.view.palette
    assert second.view.label_detail == 3
    assert not second.view.shows(Layer.MAP)


def test_a_corrupt_file_does_not_keep_the_window_from_opening(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "console.json"
    file.write_text("no json")
    still = _Still()
    window = ConsoleWindow(radar(), Feed(), still, still, Options("Test"), file)
    qtbot.addWidget(window)
    assert "set aside" in window.banner.text()
