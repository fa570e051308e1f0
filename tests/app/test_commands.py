"""What a user types, and what a user gets wrong: one clear sentence, exit code 2."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from radar_console.app.opening import scenarios

Command = Callable[..., int]


def test_every_command_has_help_with_an_example(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("", "console", "track", "simulate", "evaluate", "study", "info", "scenarios", "schema"):
        assert command(*([name] if name else []), "--help") == 0
        assert "Example" in capsys.readouterr().out


def test_the_scenarios_that_come_along(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("scenarios") == 0
    listed = capsys.readouterr().out
    assert set(scenarios()) == {line.split()[0] for line in listed.splitlines()}
    assert {"twenty-five", "seven-targets", "crossing-pair", "harbour", "stress"} <= set(scenarios())


def test_the_schema_is_json(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("schema") == 0
    assert "duration_s" in json.loads(capsys.readouterr().out)["required"]


def test_info_of_a_scenario(command: Command, small: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("info", small) == 0
    said = capsys.readouterr().out
    assert "Three in the open" in said
    assert "48.0 s" in said


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("missing.toml", None, "no such file; expected a scenario (.toml), an ASTERIX recording"),
        ("notes.txt", b"hello", "unknown kind of file; expected a scenario"),
        ("wrong.toml", b"title = 1\n", "wrong.toml: 2 problems"),
        ("empty.pcap", b"", "empty.pcap"),
        ("text.pcap", b"this is no capture file at all", "text.pcap"),
        ("empty.csv", b"", "empty.csv"),
        ("columns.csv", b"time_s,range_m\n1,2\n", "azimuth_deg"),
        ("nan.csv", b"time_s,range_m,azimuth_deg\n1,nan,3\n2,-5,4\n", "nan.csv"),
    ],
)
def test_a_source_of_another_kind(
    command: Command,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    content: bytes | None,
    said: str,
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    for arguments in (["info", name], ["track", name, "-o", "t.csv"], [name, "--screenshot", "p.png"]):
        assert command(*arguments) == 2
        message = capsys.readouterr().err
        assert said in message
        assert name in message
        assert "Traceback" not in message


def test_a_target_that_leaves_the_range(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small.write_text(small.read_text(encoding="utf-8").replace("max_range_km = 100", "max_range_km = 70"))
    assert command("track", small, "-o", "t.csv") == 2
    said = capsys.readouterr().err
    assert "target[2]" in said
    assert "70 km" in said


@pytest.mark.parametrize("folder", ["missing", "closed"])
def test_a_folder_that_can_not_be_written(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str], folder: str
) -> None:
    if folder == "closed":
        (small.parent / folder).mkdir(mode=0o500)
        if os.access(small.parent / folder, os.W_OK):
            pytest.skip("this user may write everywhere")
    for arguments in (
        ["track", small, "-o", f"{folder}/t.csv"],
        ["track", small, "-o", "t.csv", "--stats", f"{folder}/s.json"],
        ["simulate", small, "-o", f"{folder}/p.csv"],
        [small, "--screenshot", f"{folder}/p.png"],
    ):
        assert command(*arguments) == 2
        assert folder in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value"), [("--radar", "226"), ("--radar", "1/300"), ("--size", "10x10"), ("--size", "big")]
)
def test_options_say_what_they_expect(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str], option: str, value: str
) -> None:
    assert command("console", small, "--screenshot", "p.png", option, value) == 2
    assert f"{option} {value}: expected" in capsys.readouterr().err


def test_a_configuration_is_for_recordings(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("track", small, "-o", "t.csv", "--config", small) == 2
    assert "--config goes with a recording" in capsys.readouterr().err


def test_without_a_display_the_run_is_headless_and_leaves_a_picture(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert command(small) == 0
    said = capsys.readouterr()
    picture = small.parent / "radar-console.png"
    assert "No display" in said.err
    assert str(picture) in said.out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_file_is_not_read_and_written_by_one_command(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = small.read_bytes()
    assert command("track", small, "-o", small) == 2
    assert "small.toml: named twice" in capsys.readouterr().err
    assert small.read_bytes() == before
    assert command("track", small, "-o", "x", "--stats", "x") == 2
    assert command("simulate", small, "-o", "x", "--truth", "x") == 2


def test_raw_plots_want_the_settings_of_their_radar(
    command: Command, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small.write_text(small.read_text(encoding="utf-8").replace("rotation_s = 4", "rotation_s = 3"))
    assert command("simulate", small, "-o", "plots.csv") == 0
    assert command("track", "plots.csv", "-o", "t.csv") == 2
    assert "expected --config with the radar's rotation_s and prf_hz" in capsys.readouterr().err
    assert command("track", "plots.csv", "-o", "t.csv", "--config", small) == 0


def test_a_mistyped_scenario_is_guessed(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("info", "habour") == 2
    assert "did you mean harbour?" in capsys.readouterr().err
