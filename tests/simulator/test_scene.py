"""What the beam may see is found without looking at every pulse."""

from pathlib import Path

import numpy as np
import pytest

from radar_console import scenario
from radar_console.core.units import DEG
from radar_console.simulator.antenna import Antenna
from radar_console.simulator.scene import Scene
from radar_console.simulator.targets import build

TARGETS = [
    {"range_km": 0.05, "azimuth_deg": 10.0, "heading_deg": 20.0, "speed_mps": 300.0},
    {"range_km": 0.7, "azimuth_deg": 180.0, "heading_deg": 90.0, "speed_mps": 300.0},
    {"range_km": 3.0, "azimuth_deg": 359.0, "heading_deg": 90.0, "speed_mps": 300.0},
    {"range_km": 3.0, "azimuth_deg": 90.0, "heading_deg": 0.0, "speed_mps": 300.0},
    {"range_km": 200.0, "azimuth_deg": 0.0, "heading_deg": 90.0, "speed_mps": 600.0},
    {"range_km": 50.0, "azimuth_deg": 270.0, "heading_deg": 0.0, "speed_mps": 0.0, "end_s": 7.0},
    {"range_km": 9.0, "azimuth_deg": 45.0, "heading_deg": 315.0, "speed_mps": 50.0}
    | {"legs": [{"kind": "accelerate", "acceleration_mps2": 30.0, "duration_s": 20.0}]},
]


@pytest.mark.parametrize("speed_kt", [0.0, 50.0])
@pytest.mark.parametrize("turn", [0, 1, 4])
def test_no_lit_pulse_is_missed(turn: int, speed_kt: float) -> None:
    settings = scenario.parse(
        {"title": "", "duration_s": 60.0, "radar": {"speed_kt": speed_kt}, "target": TARGETS}, Path("t.toml")
    )
    targets, _ = build(settings.target, (), settings.radar, 60.0, np.random.default_rng(0))
    scene = Scene(settings.radar, Antenna(4.0, 1800, 64), targets)
    half_width = 3.0 * DEG

    target, pulse = np.divmod(np.arange(len(targets) * 1800), 1800)
    pulse += turn * 1800
    offset, _ = scene.offset(target, pulse)
    lit = (np.abs(offset) <= half_width) & targets.alive(target, scene.antenna.time(pulse))
    near_target, near_pulse = scene.near_beam(turn, half_width)
    near = list(zip(near_target.tolist(), near_pulse.tolist(), strict=True))
    assert near == sorted(set(near))  # by target and pulse, each pair once
    assert set(zip(target[lit].tolist(), pulse[lit].tolist(), strict=True)) <= set(near)
    far = near_target == 4
    assert np.count_nonzero(far) < 50  # 30 lit pulses, and the way of half a turn on each side
