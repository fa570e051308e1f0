"""The scenarios that come with the project load, play, and show what they promise."""

from pathlib import Path

import numpy as np
import pytest

from radar_console import scenario
from radar_console.core.units import DEG
from radar_console.simulator.radar import Simulator

FOLDER = Path(__file__).parents[2] / "scenarios"
FILES = sorted(FOLDER.glob("*.toml"))
Paths = dict[str, np.ndarray]


def simulator(name: str) -> Simulator:
    settings = scenario.load(FOLDER / f"{name}.toml")
    return Simulator(settings, np.random.default_rng(settings.seed), f"{name}.toml")


def paths(sim: Simulator, step: float = 1.0) -> Paths:
    """(times, 2) east and north of each target."""
    truth = [sim.truth(float(t)) for t in np.arange(0.0, sim.duration, step)]
    return {
        name: np.array([(rows["east"][i], rows["north"][i]) for rows in truth])
        for i, name in enumerate(sim.names)
    }


def closest(paths: Paths, a: str, b: str) -> tuple[float, int]:
    """Distance, m, and time step of the closest approach."""
    distance = np.hypot(*(paths[a] - paths[b]).T)
    return float(distance.min()), int(distance.argmin())


def test_all_are_here() -> None:
    assert {file.stem for file in FILES} == {
        "seven-targets",
        "twenty-five",
        "twenty-five-dense",
        "crossing-pair",
        "harbour",
        "stress",
        "arpa-1",
        "arpa-2",
        "arpa-3",
        "arpa-4",
    }


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.stem))
def test_they_load_and_play(file: Path) -> None:
    settings = scenario.load(file)
    sim = Simulator(settings, np.random.default_rng(settings.seed), file)
    assert settings.title
    assert settings.description
    turn = settings.radar.sectors
    sectors = [sector for sector, _ in zip(sim.sectors(), range(2 * turn), strict=False)]
    returns = sum(len(sector.plots) + len(sector.centroids) for sector in sectors)
    # In two turns most targets give a return in each, of raw ones several.
    assert returns >= len(sim.names) * (3 if settings.radar.returns == "raw" else 1)
    assert len(sim.truth(0.0)) == len(sim.names)


@pytest.mark.parametrize("name", ["twenty-five", "twenty-five-dense"])
def test_twenty_five_all_head_for_the_radar(name: str) -> None:
    sim = simulator(name)
    truth = sim.truth(0.0)
    assert len(truth) == 25
    distance = np.hypot(truth["east"], truth["north"])
    np.testing.assert_allclose(distance, [250e3] * 13 + [150e3] * 12)
    speed = np.hypot(truth["v_east"], truth["v_north"])
    np.testing.assert_allclose(speed, 800.0 / 3.6)
    # the closing speed is the whole speed
    closing = (truth["east"] * truth["v_east"] + truth["north"] * truth["v_north"]) / distance
    np.testing.assert_allclose(closing, -speed, rtol=1e-9)


def test_the_pair_crosses_after_nine_minutes() -> None:
    sim = simulator("crossing-pair")
    tracks = paths(sim)
    distance, step = closest(tracks, "1", "2")
    assert distance == pytest.approx(420.0, abs=5.0)
    assert step == pytest.approx(537, abs=1)
    assert np.hypot(*tracks["1"][step]) == pytest.approx(106e3, abs=500.0)
    assert np.arctan2(*tracks["1"][step]) == pytest.approx(150.0 * DEG, abs=0.5 * DEG)


def test_the_seven_cross_and_fly_close_together() -> None:
    tracks = paths(simulator("seven-targets"))
    for a, b in (("1", "2"), ("1", "6"), ("3", "4"), ("5", "7")):
        assert closest(tracks, a, b)[0] < 1000.0
    assert closest(tracks, "2", "3")[0] < 2000.0
    together = np.hypot(*(tracks["3"] - tracks["4"])[:300].T)
    np.testing.assert_allclose(together, 2500.0, atol=1.0)
