"""Targets move as their legs say, and a scenario that can't be flown is refused with its reasons."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radar_console import scenario
from radar_console.core.errors import ScenarioError
from radar_console.core.geometry import LocalFrame, to_polar
from radar_console.core.messages import Site
from radar_console.core.units import DEG, G0
from radar_console.simulator.radar import Simulator

STRAIGHT = {"kind": "straight", "duration_s": 50.0}


def simulator(**tables: Any) -> Simulator:
    raw = {"title": "test", "duration_s": 300.0} | tables
    return Simulator(scenario.parse(raw, Path("test.toml")), np.random.default_rng(1), "test.toml")


def flying(*legs: dict[str, Any], **keys: Any) -> Simulator:
    target = {"east_km": 10.0, "north_km": 20.0, "heading_deg": 30.0, "speed_mps": 200.0}
    return simulator(target=[target | {"legs": list(legs)} | keys])


def state(sim: Simulator, t: float, target: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity, east and north."""
    row = sim.truth(t)[target]
    return np.array([row["east"], row["north"]]), np.array([row["v_east"], row["v_north"]])


P0 = np.array([10e3, 20e3])
V0 = 200.0 * np.array([np.sin(30 * DEG), np.cos(30 * DEG)])


def test_straight_is_p_plus_v_t() -> None:
    position, velocity = state(flying(), 123.0)
    np.testing.assert_allclose(position, P0 + 123.0 * V0, rtol=1e-12)
    np.testing.assert_allclose(velocity, V0, rtol=1e-12)


@pytest.mark.parametrize("a", [2.0, -2.0])
def test_acceleration_along_the_course(a: float) -> None:
    sim = flying({"kind": "accelerate", "acceleration_mps2": a, "duration_s": 60.0})
    position, velocity = state(sim, 45.0)
    np.testing.assert_allclose(position, P0 + 45.0 * V0 + 0.5 * a * 45.0**2 * V0 / 200.0, rtol=1e-12)
    np.testing.assert_allclose(velocity, V0 + a * 45.0 * V0 / 200.0, rtol=1e-12)


@pytest.mark.parametrize("direction", ["left", "right"])
def test_turn_is_the_published_matrix(direction: str) -> None:
    """Δp = t [[sw, −cw], [cw, sw]] v turns counter-clockwise for positive θ in axes x, y: to the left."""
    sim = flying({"kind": "turn", "acceleration_g": 1.5, "direction": direction, "duration_s": 100.0})
    t = 40.0
    theta = (1.0 if direction == "left" else -1.0) * 1.5 * G0 / 200.0 * t
    sw, cw = np.sin(theta) / theta, (1.0 - np.cos(theta)) / theta
    rotation = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    position, velocity = state(sim, t)
    np.testing.assert_allclose(position, P0 + t * np.array([[sw, -cw], [cw, sw]]) @ V0, rtol=1e-12)
    np.testing.assert_allclose(velocity, rotation @ V0, rtol=1e-11)


def test_right_is_clockwise_from_north() -> None:
    turn = {"kind": "turn", "acceleration_g": 1.0, "direction": "right", "duration_s": 10.0}
    position, velocity = state(flying(turn, heading_deg=0.0), 10.0)
    assert position[0] > P0[0]
    assert velocity[0] > 0.0


def test_a_vanishing_turn_is_the_straight_line() -> None:
    gentle = {"kind": "turn", "acceleration_g": 1e-14, "direction": "left", "duration_s": 100.0}
    # a t²/2 is 5e-10 m off the line after 100 s
    np.testing.assert_allclose(state(flying(gentle), 100.0)[0], P0 + 100.0 * V0, atol=1e-9)


def test_a_full_circle_ends_where_it_began() -> None:
    period = 2.0 * np.pi * 200.0 / (2.0 * G0)
    circle = {"kind": "turn", "acceleration_g": 2.0, "direction": "right", "duration_s": period}
    position, velocity = state(flying(circle), period)
    np.testing.assert_allclose(position, P0, atol=1e-8)
    np.testing.assert_allclose(velocity, V0, atol=1e-10)


def test_legs_join_and_velocity_is_the_derivative_of_position() -> None:
    sim = flying(
        STRAIGHT,
        {"kind": "turn", "acceleration_g": 1.0, "direction": "left", "duration_s": 20.0},
        {"kind": "accelerate", "acceleration_mps2": 1.0, "duration_s": 30.0},
        {"kind": "turn", "acceleration_g": 0.5, "direction": "right", "duration_s": 40.0},
    )
    for border in (50.0, 70.0, 100.0, 140.0):
        before, after = state(sim, border - 1e-9), state(sim, border + 1e-9)
        np.testing.assert_allclose(after[0], before[0], atol=1e-6)  # 2e-9 s of flight
        np.testing.assert_allclose(after[1], before[1], atol=1e-6)
    for t in (25.0, 60.0, 85.0, 120.0, 200.0):
        difference = (state(sim, t + 0.01)[0] - state(sim, t - 0.01)[0]) / 0.02
        # the third derivative is at most v ω² = 0.5 m/s³: h²/6 of it is 1e-5
        np.testing.assert_allclose(difference, state(sim, t)[1], atol=2e-5)


def test_after_its_last_leg_a_target_flies_on_straight() -> None:
    sim = flying({"kind": "turn", "acceleration_g": 1.0, "direction": "left", "duration_s": 20.0})
    position, velocity = state(sim, 20.0)
    np.testing.assert_allclose(state(sim, 120.0)[0], position + 100.0 * velocity, rtol=1e-12)
    np.testing.assert_allclose(state(sim, 120.0)[1], velocity, rtol=1e-12)


def test_three_kinds_of_start_are_one_place() -> None:
    frame = LocalFrame(Site(50.0, 10.0))
    latitude, longitude = frame.to_wgs84(30e3, -40e3)
    motion = {"heading_deg": 0.0, "speed_kt": 0.0}
    sim = simulator(
        radar={"latitude_deg": 50.0, "longitude_deg": 10.0},
        target=[
            motion | {"east_km": 30.0, "north_km": -40.0},
            motion | {"range_km": 50.0, "azimuth_deg": float(np.arctan2(30.0, -40.0) / DEG)},
            motion | {"latitude_deg": float(latitude), "longitude_deg": float(longitude)},
        ],
    )
    truth = sim.truth(0.0)
    np.testing.assert_allclose(truth["east"], 30e3, atol=1e-3)  # the projection's own accuracy
    np.testing.assert_allclose(truth["north"], -40e3, atol=1e-3)


def test_height_climbs_from_the_start_and_counts_from_the_site() -> None:
    sim = simulator(
        radar={"height_m": 100.0},
        target=[
            {"range_km": 50.0, "azimuth_deg": 0.0, "heading_deg": 90.0, "speed_mps": 100.0, "start_s": 10.0}
            | {"height_m": 1100.0, "climb_mps": 5.0},
            {"range_km": 50.0, "azimuth_deg": 0.0, "heading_deg": 90.0, "speed_mps": 100.0},
        ],
    )
    truth = sim.truth(30.0)
    assert truth["up"][0] == pytest.approx(1100.0 - 100.0 + 5.0 * 20.0)
    assert truth["v_up"][0] == 5.0
    assert np.isnan(truth["up"][1])
    assert np.isnan(truth["v_up"][1])
    # the range of the start is the slant range: the ground range is shorter
    assert np.hypot(sim.truth(10.0)["east"][0], sim.truth(10.0)["north"][0]) < 50e3


def test_targets_live_from_start_to_end() -> None:
    one = {"east_km": 10.0, "north_km": 20.0, "heading_deg": 0.0, "speed_mps": 0.0}
    sim = simulator(target=[one | {"start_s": 10.0, "end_s": 20.0}, one])
    assert [sim.truth(t)["target"].tolist() for t in (9.9, 10.0, 19.9, 20.0)] == [[1], [0, 1], [0, 1], [1]]


def test_names_number_the_nameless() -> None:
    one = {"east_km": 10.0, "north_km": 20.0, "heading_deg": 0.0, "speed_mps": 0.0}
    swarm = {"count": 1, "max_range_km": 100.0, "min_speed_kmh": 0.0, "max_speed_kmh": 100.0}
    sim = simulator(target=[one | {"name": "Ferry"}, one], swarm=[swarm])
    assert sim.names == ("Ferry", "2", "3")


SWARM = {
    "count": 400,
    "min_range_km": 50.0,
    "max_range_km": 290.0,
    "min_speed_kmh": 500.0,
    "max_speed_kmh": 1000.0,
}


def test_a_swarm_stays_in_the_instrumented_range_of_a_moving_radar() -> None:
    own = {"course_deg": 70.0, "speed_kt": 30.0}
    sim = simulator(swarm=[SWARM], radar=own)
    start = sim.truth(0.0)
    distance, _ = to_polar(start["east"], start["north"])
    speed = np.hypot(start["v_east"], start["v_north"]) * 3.6
    assert len(start) == 400
    assert distance.min() >= 50e3
    assert distance.max() <= 290e3
    assert speed.min() >= 500.0
    assert speed.max() <= 1000.0
    own_velocity = 30.0 * 1852.0 / 3600.0 * np.array([np.sin(70 * DEG), np.cos(70 * DEG)])
    for t in (100.0, 200.0, 299.9):
        truth = sim.truth(t)
        away = np.hypot(truth["east"] - own_velocity[0] * t, truth["north"] - own_velocity[1] * t)
        assert away.max() <= 300e3


def problems(**tables: Any) -> list[tuple[str, str]]:
    with pytest.raises(ScenarioError) as caught:
        simulator(**tables)
    assert str(caught.value).startswith("test.toml: ")
    return list(caught.value.problems)


def test_everything_wrong_is_said_at_once() -> None:
    fine = {"east_km": 0.0, "north_km": 250.0, "heading_deg": 180.0, "speed_mps": 200.0}
    found = dict(
        problems(
            target=[
                fine,
                fine | {"heading_deg": 0.0},
                {"latitude_deg": 50.0, "longitude_deg": 10.0, "heading_deg": 0.0, "speed_mps": 0.0},
                fine | {"start_s": 300.0},
                fine | {"north_km": 301.0},
                fine | {"legs": [{"kind": "accelerate", "acceleration_mps2": -4.0, "duration_s": 60.0}]},
                {"east_km": 0.0, "north_km": 9.0, "heading_deg": 0.0, "speed_mps": 0.0}
                | {"legs": [{"kind": "turn", "acceleration_g": 1.0, "direction": "left", "duration_s": 9.0}]},
            ],
            swarm=[SWARM | {"max_range_km": 301.0}, SWARM | {"max_speed_kmh": 1e6, "min_speed_kmh": 1e6}],
        )
    )
    assert set(found) == {
        "target[1]",
        "target[2].latitude_deg",
        "target[3].start_s",
        "target[4]",
        "target[5].legs[0].duration_s",
        "target[6].legs[0]",
        "swarm[0].max_range_km",
        "swarm[1]",
    }
    assert "at 251 s" in found["target[1]"]  # 50 km at 200 m/s are reached at 250 s
    assert "end_s = 250" in found["target[1]"]
    assert "starts beyond" in found["target[4]"]
    assert "after 50.0 s" in found["target[5].legs[0].duration_s"]


def test_a_target_that_ends_in_time_may_head_outward() -> None:
    out = {"east_km": 0.0, "north_km": 250.0, "heading_deg": 0.0, "speed_mps": 200.0, "end_s": 250.0}
    assert len(simulator(target=[out]).truth(249.0)) == 1


def test_the_range_counts_from_a_moving_radar() -> None:
    still = {"east_km": 0.0, "north_km": 295.0, "heading_deg": 0.0, "speed_mps": 0.0}
    [(path, what)] = problems(target=[still], radar={"course_deg": 180.0, "speed_kt": 50.0})
    assert path == "target[0]"
    assert "at 195 s" in what  # 5 km at 25.7 m/s take 194.4 s
