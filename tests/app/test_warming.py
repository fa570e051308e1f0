"""The first start: what is compiled, is compiled beside, and said."""

import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core import event

from radar_console.app import warming


def test_a_first_start_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "is_cold", lambda: True)
    monkeypatch.setattr(warming, "COMMAND", (sys.executable, "-c", "print(1)\nprint('noise')\nprint(2)"))
    said: list[str] = []
    warming.ensure_warm(said.append)
    assert [text.split(",")[1].split()[0] for text in said[:-1]] == ["0", "1", "2"]
    assert said[-1] == ""


def test_a_start_that_finds_everything_compiled_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "is_cold", lambda: False)
    warming.ensure_warm(lambda text: pytest.fail(text))


def test_it_is_cold_where_the_cache_is_empty(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Stats:
        cache_path = str(tmp_path)

    class Kernel:
        stats = Stats

    monkeypatch.setattr(warming, "sweep", Kernel)
    assert warming.is_cold()
    (tmp_path / "sweep.sweep-46.py311.nbi").touch()
    assert not warming.is_cold()


def test_only_what_is_compiled_counts() -> None:
    counted: list[int] = []
    counter = warming.Counter(counted.append)

    @njit
    def double(x):  # type: ignore[no-untyped-def]
        return 2.0 * x

    double(np.ones(2))
    first = counter.done
    double(np.ones(3))
    event.unregister("numba:compile", counter)
    assert counter.done == first > 0
    assert counted == list(range(1, first + 1))
