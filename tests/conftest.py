"""What all tests share."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

# How long an example takes says nothing about the code, on machines that have other work.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

# Before anything imports Qt: tests never open a window.
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

RECORDINGS = Path(os.environ.get("RADAR_CONSOLE_DATA", Path(__file__).parents[2] / "shared" / "data"))


@pytest.fixture(scope="session")
def recording() -> Callable[[str], Path]:
    """Path of a recorded file by its name, such as ``asterix/260429.pcap``; skips where it is missing.

    The recordings are real radar data and no part of the project.
    """

    def find(name: str) -> Path:
        file = RECORDINGS / name
        if not file.is_file():
            pytest.skip(f"no recording {name}: set RADAR_CONSOLE_DATA to the folder that holds it")
        return file

    return find
