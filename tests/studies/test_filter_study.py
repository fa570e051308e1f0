"""The filter study: its trajectories, its runs, and small versions of the whole."""

import json

import filterpy.kalman
import numpy as np
import pytest

from radar_console.core.units import G0
from radar_console.studies import filter_rmse, filter_runs, resampling, trajectories
from radar_console.studies.filter_runs import CASES, GRID, Case, measure
from radar_console.studies.work import Work, generator


def test_trajectories_are_those_of_the_description():
    """E3REC takes 1,103 s between 50 and 114 km; after a turn the course has changed by a t / v."""
    path = trajectories.path(trajectories.E3REC, 1.0)
    distance = np.hypot(*path.T) / 1e3
    assert len(path) == 1104
    assert distance.min() == pytest.approx(50.0, abs=1.0)
    assert distance.max() == pytest.approx(114.0, abs=0.5)
    after = path[163] - path[162]
    turned = np.degrees(3 * G0 * 12.0 / 250.0)
    assert np.degrees(np.arctan2(*after)) % 360 == pytest.approx((150.0 + turned) % 360, abs=1e-6)
    assert trajectories.duration(trajectories.FIGHTER) == 560.0
    assert trajectories.duration(trajectories.AIRLINER) == 600.0


def test_random_trajectories_alternate_and_keep_their_laws():
    rng = np.random.default_rng(1)
    straight, bent, turns = [], [], 0
    for _ in range(100):
        target = trajectories.random_target(rng)
        assert trajectories.duration(target) == pytest.approx(trajectories.RANDOM_S)
        assert [leg.kind == "straight" for leg in target.legs] == [
            k % 2 == 0 for k in range(len(target.legs))
        ]
        whole = target.legs[:-1]  # the last one is cut
        straight += [leg.duration_s for leg in whole if leg.kind == "straight"]
        bent += [leg.duration_s for leg in whole if leg.kind != "straight"]
        turns += sum(leg.kind == "turn" for leg in whole)
        speed = np.hypot(*np.diff(trajectories.path(target, 1.0), axis=0).T)
        assert 149.0 < speed.min()
        assert speed.max() < 301.0
    assert 10.0 <= min(straight) <= max(straight) <= 200.0
    assert 6.0 <= min(bent) <= max(bent) <= 60.0
    assert 16.0 < np.mean(bent) < 20.5  # 18.3 and five standard errors
    assert 0.6 < turns / len(bent) < 0.8


@pytest.mark.parametrize("case", [CASES[0], Case("E3REC", polar=(50.0, 0.1))])
def test_a_run_is_measured_alike_alone_and_among_others(case):
    every, one = measure(case, range(3), 5), measure(case, range(2, 3), 5)
    assert np.array_equal(every.z[:, 2:], one.z)
    assert np.array_equal(every.truth[:, 2:], one.truth)


def test_the_kalman_filters_are_filterpys_for_one_covariance_and_for_one_a_measurement():
    for case in (Case("E3REC"), Case("E3REC", polar=(50.0, 0.1))):
        seen = measure(case, range(2), 6)
        found = filter_runs.kalman_filters(seen, case.T, np.array([3.0, 10.0]))
        first = filter_runs.start(seen, case.T)
        f = filterpy.kalman.KalmanFilter(4, 2)
        F, Q = filter_runs.motion.constant_velocity(case.T, 10.0**2, piecewise=True)
        f.x, f.P, f.F, f.Q, f.H = first.mean[1].copy(), first.cov[1].copy(), F, Q, np.eye(2, 4)
        R = np.broadcast_to(seen.R, (*seen.z.shape, 2))
        for k in range(2, 40):
            f.predict()
            f.update(seen.z[k, 1], R=R[k, 1])
            assert np.allclose(found[k - 2, 1, 1], f.x[:2], rtol=0, atol=1e-6)


def test_ekf_and_ukf_are_the_kalman_filter():
    found = filter_runs.linear_case(range(3), 7)
    assert found["ekf"].max() < 1e-8
    assert found["ukf"].max() < 1e-8


def test_crossings_lie_on_the_curve():
    curve = 100.0 + 50.0 * np.abs(np.log10(GRID / 5.0))
    low, high = filter_rmse.crossings(GRID, curve, 130.0)
    assert low * high == pytest.approx(25.0, rel=1e-2)
    assert high == pytest.approx(5.0 * 10**0.6, rel=1e-2)
    assert filter_rmse.crossings(GRID, curve, 500.0) == []


def test_the_bootstrap_filters_steering_is_a_turn_and_a_change_of_speed():
    """To a quarter turn with the arc's chord; to v t + a t²/2 along the course."""
    rng = np.random.default_rng(8)
    x, none = np.array([[0.0, 0.0, 0.0, 200.0]]), np.zeros(1)
    quarter = filter_runs._steer(x, none + 200.0 * np.pi / 2 / 10.0, none, none, 10.0, rng)
    radius = 200.0 * 10.0 / (np.pi / 2)
    assert np.allclose(quarter, [[radius, radius, 200.0, 0.0]], rtol=0, atol=1e-9)
    faster = filter_runs._steer(x, none, none + 5.0, none, 10.0, rng)
    assert np.allclose(faster, [[0.0, 2250.0, 0.0, 250.0]], rtol=0, atol=1e-9)


@pytest.fixture
def small(monkeypatch, tmp_path):
    """Two cases, small clouds."""
    monkeypatch.setattr(filter_rmse, "CASES", (Case("RANDOM"), Case("E3REC")))
    monkeypatch.setattr(filter_rmse, "_FRAGILE", (Case("FIGHTER"),))
    monkeypatch.setattr(filter_rmse, "_PARTICLES", 50)
    monkeypatch.setattr(filter_runs, "MATCHED_COUNTS", (100, 1_000))
    monkeypatch.setattr(filter_runs, "BOOTSTRAP", (500,))
    monkeypatch.setattr(resampling, "COUNTS", (100, 1_000))
    return tmp_path


def test_the_study_in_small(small):
    """What holds at any size: both opponents everywhere, and the order of the filters on E3REC."""
    work = Work(small, 6, 1)
    found = {each.quantity: each for each in filter_rmse.run(work)}
    assert next(iter(found)) == "RBPF / best KF, RANDOM 4 s (headline)"
    for name in ("RANDOM 4 s", "E3REC 4 s"):
        for filter in ("IMM", "RBPF"):
            best, nominal = found[f"{filter} / best KF, {name}"], found[f"{filter} / KF σ_a = 3, {name}"]
            assert nominal.ours < best.ours < 1.0
            assert best.ci_low < best.ours < best.ci_high
    assert found["RBPF / IMM, E3REC 4 s"].ci_high < 1.0
    assert found["largest |UKF − KF|, E3REC 4 s"].ours < 1e-8
    assert found["EKF, σ_a = 3, E3REC 4 s"].published == 186.366
    assert sum("186.366" in quantity for quantity in found) == 1
    assert sum("135.357" in quantity for quantity in found) >= 1
    assert [file.name for file in small.glob("*.png")]
    assert all((small / name).stat().st_size > 5_000 for name in work.figures)


def test_resampling_in_small(small):
    work = Work(small, 6, 1)
    found = {each.quantity: each.ours for each in resampling.run(work)}
    assert len(found) == 5 * 2 * 4
    for scheme in ("systematic", "stratified", "residual"):
        assert found[f"scatter of the mean, {scheme}, N = 1,000"] < 0.8
        assert found[f"RMSE / KF, {scheme}, N = 1,000"] < 1.2
    # Variance of multinomial sampling: N times that of a mean is the spread itself.
    assert found["scatter of the mean, multinomial, N = 1,000"] == pytest.approx(1.0, abs=0.1)
    assert json.dumps(found)


def test_generators_of_different_words_differ():
    assert generator(1, 2, 3).random() != generator(1, 2, 4).random()
