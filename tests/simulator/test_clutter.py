"""Clutter has the numbers and the places that its settings say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radar_console import scenario
from radar_console.core.geometry import to_cartesian
from radar_console.core.units import DEG
from radar_console.simulator import clutter
from radar_console.simulator.antenna import Antenna
from radar_console.simulator.scene import Scene
from radar_console.simulator.targets import build

SIGMAS = 5.0
TURNS = 400
FAR = {"range_km": 150.0, "azimuth_deg": 40.0, "heading_deg": 220.0, "speed_mps": 200.0}


def settings(**tables: Any) -> scenario.Scenario:
    return scenario.parse({"title": "test", "duration_s": 300.0} | tables, Path("test.toml"))


def drawn(**tables: Any) -> tuple[Scene, list[clutter.Places]]:
    """The false targets of many turns."""
    world = settings(**tables)
    rng = np.random.default_rng(7)
    targets, problems = build(world.target, world.swarm, world.radar, 300.0, rng)
    assert not problems
    scene = Scene(world.radar, Antenna(4.0, 1800, 64), targets)
    return scene, [clutter.false_targets(world.clutter, scene, turn, rng) for turn in range(TURNS)]


def is_poisson(counts: list[int], mean: float) -> bool:
    """Mean and dispersion: Σ(n − mean)²/mean is χ² with as many degrees of freedom as turns."""
    total = abs(sum(counts) - mean * len(counts)) <= SIGMAS * np.sqrt(mean * len(counts))
    chi2 = sum((n - mean) ** 2 / mean for n in counts)
    # the variance of a term is 2 + 1/mean
    return bool(total and abs(chi2 - len(counts)) <= SIGMAS * np.sqrt(len(counts) * (2.0 + 1.0 / mean)))


def test_a_disc_is_poisson_about_its_target() -> None:
    scene, turns = drawn(target=[FAR], clutter={"disc": [{"radius_km": 15.0, "mean": 5.0}]})
    assert is_poisson([len(places.pulse) for places in turns], 5.0)
    inner = 0
    for turn, places in enumerate(turns):
        time = scene.antenna.time(places.pulse)
        target_east, target_north, _ = scene.relative(np.zeros(len(time), np.int64), time)
        east, north = to_cartesian(places.distance, scene.antenna.angle(places.pulse))
        away = np.hypot(east - target_east, north - target_north)
        # the beam needs 0.07 s from the centre to the rim, 13 m of flight
        assert np.all(away <= 15e3 + 20.0)
        assert np.all(places.pulse // 1800 == turn)
        inner += np.count_nonzero(away <= 15e3 / np.sqrt(2.0))
    total = sum(len(places.pulse) for places in turns)
    assert abs(inner - total / 2) <= SIGMAS * np.sqrt(total) / 2  # half the area, half the number


@pytest.mark.parametrize(
    ("disc", "expected"),
    [
        ({"mean": 5.0}, 10.0),  # a number for each disc: it adds up
        ({"density_per_km2": 5.0 / (np.pi * 15.0**2)}, 5.0),  # a density over the union
    ],
)
def test_where_discs_overlap(disc: dict[str, float], expected: float) -> None:
    _, turns = drawn(target=[FAR, FAR], clutter={"disc": [{"radius_km": 15.0} | disc]})
    assert is_poisson([len(places.pulse) for places in turns], expected)


def test_density_over_two_overlapping_discs() -> None:
    """Two discs of radius r, their centres r apart: the union is (4π/3 + √3/2) r²."""
    r, density = 10.0, 0.02
    apart = FAR | {"azimuth_deg": float(40.0 + 2.0 * np.arcsin(r / 2.0 / 150.0) / DEG)}
    # parallel courses keep them apart by r
    _, turns = drawn(
        target=[FAR, apart],
        clutter={"disc": [{"radius_km": r, "density_per_km2": density}]},
    )
    area = (4.0 * np.pi / 3.0 + np.sqrt(3.0) / 2.0) * r**2
    # the beam reaches the second 0.04 s later: 8 m of 10 km, far below what the counts resolve
    assert is_poisson([len(places.pulse) for places in turns], density * area)


def test_no_clutter_around_those_who_are_gone() -> None:
    _, turns = drawn(target=[FAR | {"end_s": 40.0}], clutter={"disc": [{"radius_km": 15.0, "mean": 20.0}]})
    assert all(len(places.pulse) for places in turns[:10])
    assert not any(len(places.pulse) for places in turns[10:])


def test_uniform_by_area() -> None:
    density = 1e-4
    _, turns = drawn(clutter={"uniform": [{"density_per_km2": density}]})
    assert is_poisson([len(places.pulse) for places in turns], density * np.pi * 300.0**2)
    distance = np.concatenate([places.distance for places in turns])
    inner = np.count_nonzero(distance < 300e3 / np.sqrt(2.0))
    assert abs(inner - len(distance) / 2) <= SIGMAS * np.sqrt(len(distance)) / 2


def test_uniform_by_cell() -> None:
    _, turns = drawn(clutter={"uniform": [{"per_cell": 1e-4}]})
    assert is_poisson([len(places.pulse) for places in turns], 1e-4 * 2000 * 240)
    distance = np.concatenate([places.distance for places in turns])
    inner = np.count_nonzero(distance < 150e3)
    assert abs(inner - len(distance) / 2) <= SIGMAS * np.sqrt(len(distance)) / 2


PATCH = {"from_range_km": 30.0, "to_range_km": 33.0, "from_azimuth_deg": 350.0, "to_azimuth_deg": 20.0}


def land(**keys: float) -> clutter.Land:
    world = settings(clutter={"land": [PATCH | keys]})
    antenna = Antenna(4.0, 1800, 64)
    return clutter.land_cells(world.clutter.land, world.radar, antenna, 2000, np.random.default_rng(8))


def test_land_covers_its_patch_across_north() -> None:
    pulses, cells = np.divmod(land().cells, 2000)
    azimuth = pulses * 0.2
    assert set(cells.tolist()) == set(range(200, 220))
    assert np.all((azimuth >= 350.0 - 1e-9) | (azimuth <= 20.0 + 1e-9))
    assert np.all(np.diff(land().cells) > 0)
    assert len(pulses) == 150 * 20


def test_land_has_its_mean_strength_and_the_beam_smooths_it() -> None:
    patch = land(from_azimuth_deg=0.0, to_azimuth_deg=360.0, snr_db=20.0)
    voltage = patch.voltage.reshape(1800, 20)
    # A look is independent from the next one after about a beam of 7.5 pulses: 240 × 20 of them.
    assert np.mean(np.abs(voltage) ** 2) == pytest.approx(100.0, rel=SIGMAS / np.sqrt(240 * 20))
    next_pulse = np.vdot(voltage[:-1], voltage[1:]).real / np.vdot(voltage, voltage).real
    # The autocorrelation of the Gaussian pattern: exp(−ln 2 · 2 · (0.2/1.5)²) after one pulse.
    assert next_pulse == pytest.approx(0.9757, abs=0.005)
    other_range = np.vdot(voltage[:, :-1], voltage[:, 1:]).real / np.vdot(voltage, voltage).real
    assert abs(other_range) < SIGMAS / np.sqrt(240 * 19)


def test_land_as_points_for_centroids() -> None:
    world = settings(clutter={"land": [PATCH]})
    places, p_d = clutter.land_points(
        world.clutter.land, world.radar, Antenna(4.0, 1800, 64), np.random.default_rng(9)
    )
    assert len(places.pulse) == len(p_d) == 20 * 20  # 20 cells of 150 m, 20 beams of 1.5°
    azimuth = places.pulse * 0.2
    assert np.all((azimuth > 350.0) | (azimuth < 20.0))
    assert np.all((places.distance > 30e3) & (places.distance < 33e3))
    assert np.all((p_d >= 0.0) & (p_d <= 1.0))
