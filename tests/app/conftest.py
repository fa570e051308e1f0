"""A small scenario, and the command line called as a user calls it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from radar_console.app import main

SMALL = """
title = "Three in the open"
seed = 3
duration_s = 48
[radar]
rotation_s = 4
max_range_km = 100
[[target]]
range_km = 60
azimuth_deg = 358.5      # crosses north
heading_deg = 90
speed_kmh = 800
[[target]]
range_km = 40
azimuth_deg = 120
heading_deg = 300
speed_kmh = 500
[[target]]
range_km = 80
azimuth_deg = 240
heading_deg = 60
speed_kmh = 900
"""

Command = Callable[..., int]


@pytest.fixture
def small(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SMALL, encoding="utf-8")
    return file


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Command:
    """Run `radar-console` with these arguments in a folder of its own; the exit code."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> int:
        monkeypatch.setattr("sys.argv", ["radar-console", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_:
            main()
        return int(exit_.value.code or 0)

    return run
