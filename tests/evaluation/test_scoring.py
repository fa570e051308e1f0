"""The figures of a run: by hand, against the metrics they stand for, and from a scenario."""

from pathlib import Path

import numpy as np
import pytest
from small_scenarios import small_raw

from radar_console.core.messages import TRACK, TRUTH, TrackStatus, blank
from radar_console.evaluation.gospa import gospa
from radar_console.evaluation.ospa import ospa
from radar_console.evaluation.sampling import snapshots
from radar_console.evaluation.scenario_run import RUN_METRICS, ScenarioRun, follow, truth_of
from radar_console.evaluation.scoring import METRICS, Scoring, score


def table_of(dtype, rows):
    """(time, number, east) at rest; confirmed."""
    table = blank(dtype, len(rows))
    for name in ("north", "v_east", "v_north"):
        table[name] = 0.0
    table["time"], table[dtype.names[0 if dtype is TRACK else 1]], table["east"] = np.array(rows, float).T
    if dtype is TRACK:
        table["status"] = TrackStatus.CONFIRMED
    return table


def test_every_column_is_explained():
    page = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text(encoding="utf-8")
    assert [metric.name for metric in RUN_METRICS if f"`{metric.name}`" not in page] == []


def test_by_hand():
    """Ten seconds; target 0 is held 30 m off from 2 on, target 1 never; a track is 9 km from all."""
    truth = table_of(TRUTH, [(t, k, 2e4 * k) for t in range(10) for k in (0, 1)])
    tracks = table_of(TRACK, [(2, 1, 30.0), (5, 2, -9e3)])
    found = score(truth, tracks, Scoring(cut_off=1000.0, gate=500.0, tail=4.0))
    assert set(found) == {metric.name for metric in METRICS}
    half = 1000.0**2 / 2
    squares = 2 * [2 * half] + 3 * [30.0**2 + half] + 5 * [30.0**2 + half + half]
    assert found["gospa_m"] == pytest.approx(np.mean(np.sqrt(squares)))
    assert found["gospa_rms_m"] == pytest.approx(np.sqrt(np.mean(squares)))
    assert found["gospa_location_m"] == pytest.approx(np.sqrt(0.8 * 30.0**2))
    assert found["gospa_missed_m"] == pytest.approx(np.sqrt((2 * 2 + 8) / 10 * half))
    assert found["gospa_false_m"] == pytest.approx(np.sqrt(0.5 * half))
    assert (found["rmse_position_m"], found["rmse_east_m"], found["rmse_north_m"]) == (30.0, 30.0, 0.0)
    assert (found["targets"], found["held"], found["lost"]) == (2, 1, 0)
    assert (found["time_to_confirm_s"], found["continuity"]) == (2.0, 0.4)
    assert (found["longest_segment"], found["completeness"]) == (0.4, 0.4)
    assert (found["tracks"], found["false_tracks"], found["duplicate_tracks"]) == (2, 1, 0)
    assert (found["purity"], found["ambiguity"], found["spuriousness"]) == (1.0, 1.0, 5 / 13)
    assert (found["swaps"], found["fragments"], found["number_changes_per_h"]) == (0, 0, 0)


def test_nothing_to_score():
    truth = table_of(TRUTH, [(t, 0, 0.0) for t in range(3)])
    found = score(truth, np.empty(0, TRACK))
    assert (found["held"], found["tracks"], found["completeness"]) == (0, 0, 0)
    assert found["gospa_m"] == pytest.approx(5000.0 / np.sqrt(2))
    for name in ("time_to_confirm_s", "rmse_position_m", "purity", "ambiguity", "number_changes_per_h"):
        assert np.isnan(found[name]), name


def test_a_run_of_a_scenario(tmp_path):
    run = ScenarioRun(small_raw(tmp_path), tmp_path / "small.toml")
    found = run({"tracker.p_d": 0.8}, 7)
    assert list(found) == [metric.name for metric in RUN_METRICS]
    again = run({"tracker.p_d": 0.8}, 7)
    other = run({"tracker.p_d": 0.8}, 8)
    for name in ("gospa_m", "rmse_velocity_mps", "rmse_east_m"):
        assert again[name] == found[name] != other[name]
    assert found["held"] == found["targets"] == 2
    assert 0.0 < found["tracker_ms_per_turn"] < 1000.0

    from radar_console.chain import Chain

    opened = run.opened({"tracker.p_d": 0.8}, 7)
    pictures = list(snapshots(truth_of(opened, 1.0), follow(Chain(opened))))
    assert len(pictures) == 81
    for name, distance in (("gospa_m", gospa), ("ospa_m", ospa)):
        plain = np.mean([float(distance(now.truth, now.estimate, 5000.0)) for now in pictures])
        assert found[name] == pytest.approx(plain, rel=1e-12)
