"""Scenario files are strict, and tell every problem at once with its path."""

import json
from pathlib import Path

import pytest

from radar_console import scenario
from radar_console.core.errors import InputError, ScenarioError
from radar_console.core.units import KT

GOOD = """
title = "One"
duration_s = 60
[[target]]
range_km = 100
azimuth_deg = 45.0
heading_deg = 225
speed_kt = 300
legs = [
  { kind = "straight", duration_s = 10 },
  { kind = "turn", acceleration_g = 1, direction = "right", duration_s = 20 },
]
"""


def write(folder: Path, text: str) -> Path:
    file = folder / "s.toml"
    file.write_text(text, encoding="utf-8")
    return file


def problems(folder: Path, text: str) -> dict[str, str]:
    with pytest.raises(ScenarioError) as caught:
        scenario.load(write(folder, text))
    assert str(folder / "s.toml") in str(caught.value)
    return dict(caught.value.problems)


@pytest.mark.parametrize(("short", "name"), scenario.SHORT.items())
def test_filters_have_short_names(tmp_path: Path, short: str, name: str) -> None:
    text = GOOD + f'[tracker]\nfilter = "{short}"\n'
    assert scenario.load(write(tmp_path, text)).tracker.filter == name
    known = json.loads(scenario.json_schema())["$defs"]["TrackerSettings"]["properties"]["filter"]["enum"]
    assert {short, name} <= set(known)


def test_a_good_file(tmp_path: Path) -> None:
    loaded = scenario.load(write(tmp_path, GOOD))
    assert loaded.target[0].speed == pytest.approx(300 * KT)
    assert loaded.radar.message.max_range == 300e3
    assert [leg.kind for leg in loaded.target[0].legs] == ["straight", "turn"]


def test_all_problems_at_once_each_with_its_path(tmp_path: Path) -> None:
    found = problems(
        tmp_path,
        """
        title = 3
        [radar]
        rotatoin_s = 3
        p_fa = 2
        rotation_s = nan
        [[target]]
        range_km = 1
        azimuth_deg = 400
        heading_deg = 0
        speed_kt = 1
        [[target]]
        range_km = 1
        azimuth_deg = 1
        heading_deg = 0
        speeed_kt = 1
        legs = [{ kind = "turn", acceleration_g = 1, direction = "up", duration_s = 1 }, { kind = "loop" }]
        [clutter]
        [[clutter.disc]]
        radius_km = 1
        meen = 4
        """,
    )
    assert found["title"] == "input should be a valid string, found 3"
    assert found["duration_s"] == "missing"
    assert found["radar.rotatoin_s"] == "unknown key, did you mean rotation_s?"
    assert found["radar.p_fa"] == "input should be less than 1, found 2"
    assert "radar.rotation_s" in found
    assert found["target[0].azimuth_deg"].startswith("input should be less than 360")
    assert found["target[1].speeed_kt"] == "unknown key, did you mean speed_kt?"
    assert "'left' or 'right'" in found["target[1].legs[0].direction"]
    assert "'loop'" in found["target[1].legs[1]"]
    assert found["clutter.disc[0].meen"] == "unknown key, did you mean mean?"


@pytest.mark.parametrize(
    ("keys", "what"),
    [
        ("range_km = 1", "also needs azimuth_deg"),
        ("range_km = 1\nazimuth_deg = 1\neast_km = 1\nnorth_km = 1", "exactly one of"),
        ("", "exactly one of: range_km and azimuth_deg or latitude_deg and longitude_deg"),
    ],
)
def test_a_start_is_given_once_and_whole(tmp_path: Path, keys: str, what: str) -> None:
    text = f'title = "t"\nduration_s = 1\n[[target]]\nheading_deg = 0\nspeed_mps = 1\n{keys}\n'
    assert what in problems(tmp_path, text)["target[0]"]


def test_files_that_are_no_scenarios(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="can't be read"):
        scenario.load(tmp_path / "missing.toml")
    with pytest.raises(InputError, match=r"not valid TOML.*line 1"):
        scenario.load(write(tmp_path, "title = = 3"))
    (tmp_path / "s.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="byte 0"):
        scenario.load(tmp_path / "s.toml")


def test_a_configuration_takes_its_tables_from_a_scenario_and_knows_what_was_given(tmp_path: Path) -> None:
    settings, given = scenario.load_configuration(write(tmp_path, GOOD + "[radar]\nrotation_s = 7.5\n"))
    assert settings.radar.rotation_s == 7.5
    assert given == {"radar.rotation_s"}
    only, given = scenario.load_configuration(write(tmp_path, "[tracker]\np_d = 0.7\n"))
    assert only.tracker.p_d == 0.7
    assert given == {"tracker.p_d"}


def test_the_schema_names_every_key() -> None:
    schema = json.loads(scenario.json_schema())
    assert set(schema["properties"]) == set(scenario.Scenario.model_fields)
    assert "p_fa" in schema["$defs"]["RadarSettings"]["properties"]
    assert schema["additionalProperties"] is False
