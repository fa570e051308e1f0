"""What a user writes after --set, and what it makes of a scenario."""

from pathlib import Path

import pytest

from radar_console.core.errors import RadarConsoleError, ScenarioError
from radar_console.evaluation.grid import grid, label, option, text_of, varied

FILE = Path("small.toml")
RAW = {
    "title": "Small",
    "duration_s": 60,
    "target": [
        {"range_km": 10, "azimuth_deg": 0, "heading_deg": 90, "speed_kmh": 100},
        {"range_km": 20, "azimuth_deg": 0, "heading_deg": 90, "speed_kmh": 100,
         "legs": [{"kind": "straight", "duration_s": 10}]},
    ],
    "clutter": {"disc": [{"radius_km": 2, "mean": 5}, {"radius_km": 3, "mean": 1}],
                "uniform": [{"per_cell": 0.1}]},
}  # fmt: skip


def problem(setting):
    with pytest.raises(ScenarioError) as caught:
        varied(RAW, setting, FILE)
    ((path, what),) = caught.value.problems
    return path, what


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("k=kalman,particle", ["kalman", "particle"]),
        ("k=1, 5,2.5,true", [1, 5, 2.5, True]),
        ("k=[cv],[cv, ct]", [["cv"], ["cv", "ct"]]),
        ("k=\"a,b\",'c'", ["a,b", "c"]),
        ("k=[],[1,2]", [[], [1, 2]]),
    ],
)
def test_values(text, values):
    assert option(text) == ("k", values)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tracker.filter", "expected KEY=VALUE"),
        ("tracker.filter=", "expected KEY=VALUE"),
        ("tracker.filter=kalman,", "expected KEY=VALUE"),
        ("=1", "expected KEY=VALUE"),
        ("a b=1", "expected KEY=VALUE"),
        ("k=1,2,1", "1 comes twice"),
    ],
)
def test_what_is_no_option_is_refused(text, said):
    with pytest.raises(RadarConsoleError, match=f"--set .*{said}"):
        option(text)


def test_all_combinations_in_order():
    settings = grid([option("a=1,2"), option("b=x,y,z")])
    assert [label(setting) for setting in settings] == [f"a={a}, b={b}" for a in (1, 2) for b in "xyz"]
    assert grid([]) == [{}]
    with pytest.raises(RadarConsoleError, match="a: comes twice"):
        grid([option("a=1"), option("a=2")])


def test_texts_of_values():
    assert [text_of(v) for v in ("imm", 1, 0.5, True, ["cv", "ct"], (1, 2))] == [
        "imm", "1", "0.5", "true", "[cv,ct]", "[1,2]",
    ]  # fmt: skip


def test_keys_are_set_and_the_scenario_of_the_file_stays():
    setting = {"tracker.filter": "kalman", "tracker.models": ["ca"], "duration_s": 30, "target[1].rcs_db": 3}
    changed = varied(RAW, setting, FILE)
    assert (changed.tracker.filter, changed.tracker.models, changed.duration_s) == ("kalman", ("ca",), 30)
    assert [target.rcs_db for target in changed.target] == [0, 3]
    assert varied(RAW, {}, FILE).duration_s == 60
    legs = varied(RAW, {"target[1].legs[0].duration_s": 7}, FILE).target[1].legs
    assert legs[0].duration_s == 7


def test_all_tables_of_an_array_and_what_excludes_the_key():
    changed = varied(RAW, {"clutter.disc.density_per_km2": 2, "target.speed_kt": 5}, FILE)
    assert [(disc.mean, disc.density_per_km2) for disc in changed.clutter.disc] == [(None, 2), (None, 2)]
    assert [(target.speed_kmh, target.speed_kt) for target in changed.target] == [(None, 5), (None, 5)]
    one = varied(RAW, {"clutter.disc[1].mean": 7}, FILE)
    assert [disc.mean for disc in one.clutter.disc] == [5, 7]


def test_the_name_of_an_array_may_be_left_out():
    changed = varied(RAW, {"clutter.density_per_km2": 2}, FILE).clutter
    assert [disc.density_per_km2 for disc in changed.disc] == [2, 2]
    assert (changed.uniform[0].density_per_km2, changed.uniform[0].per_cell) == (2, None)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("tracker.fliter", "unknown key, did you mean filter?"),
        ("traker.filter", "unknown key, did you mean tracker.filter?"),
        ("traker.fliter", "unknown key, did you mean tracker?"),
        ("filter", "unknown key, did you mean tracker.filter?"),
        ("clutter.snr_db", "did you mean radar.snr_db or clutter.land.snr_db?"),
        ("nonsense.at.all", "unknown key"),
        ("target[2].rcs_db", "the scenario has 2 of target"),
        ("clutter.land.snr_db", "the scenario has 0 of land"),
        ("target[0]", "expected a key of it"),
        ("title.length", "title is no table"),
        ("seed", "expected --seed"),
    ],
)
def test_keys_that_are_none(key, said):
    path, what = problem({key: 1})
    assert path == key
    assert said in what


def test_values_that_can_not_be():
    path, what = problem({"tracker.filter": "kalmann"})
    assert path == "tracker.filter"
    assert "'kalman'" in what
    with pytest.raises(ScenarioError, match=r"small.toml with tracker.confirm_hits=9"):
        varied(RAW, {"tracker.confirm_hits": 9}, FILE)
