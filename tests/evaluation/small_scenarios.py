"""A scenario of a second's work: two aircraft, centroids, a small filter."""

from pathlib import Path

from radar_console import scenario

SMALL = """
title = "Two in the open"
seed = 5
duration_s = 80
[radar]
returns = "centroids"
max_range_km = 100
sectors = 16
[[clutter.disc]]
radius_km = 5
mean = 0.5
[[target]]
range_km = 60
azimuth_deg = 30
heading_deg = 200
speed_kmh = 800
[[target]]
range_km = 40
azimuth_deg = 120
heading_deg = 300
speed_kmh = 500
[tracker]
filter = "kalman"
confirm_score = 2.0
"""


def small_file(folder: Path) -> Path:
    file = folder / "small.toml"
    file.write_text(SMALL, encoding="utf-8")
    return file


def small_raw(folder: Path) -> dict:
    return scenario.read_toml(small_file(folder))
