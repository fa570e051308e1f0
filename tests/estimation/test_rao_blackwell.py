"""The particle filter of regimes: the Kalman filter where there is one regime, and laws of its parts."""

import filterpy.kalman
import numpy as np
import pytest

from radar_console.core.units import G0
from radar_console.estimation import kalman, motion, rao_blackwell
from radar_console.estimation.gaussian import Gaussian
from radar_console.estimation.rao_blackwell import SPEED, STRAIGHT, TURN, Regimes

T, SD = 4.0, 100.0
R = SD**2 * np.eye(2)


def start_of(runs):
    cov = np.diag([SD, SD, 40.0, 40.0]) ** 2
    return Gaussian(np.tile([1e4, -2e4, 200.0, 50.0], (runs, 1)), np.tile(cov, (runs, 1, 1)))


def straight_flights(rng, runs=5, scans=30):
    """Measurements (scans, runs, 2) along the mean of `start_of`."""
    time = T * np.arange(1, scans + 1)[:, None, None]
    mean = start_of(runs).mean
    return mean[:, :2] + time * mean[:, 2:] + SD * rng.standard_normal((scans, runs, 2))


def turning(rng, runs=5):
    """Ten scans straight, then ten of a turn with 2 g to the right: truth and measurements."""
    truth, x = [], start_of(1).mean[0]
    state = np.append(x, 0.0)
    for k in range(20):
        state[4] = 2 * G0 / np.hypot(*x[2:]) if k >= 10 else 0.0
        state = motion.coordinated_turn(T, 0.0, 0.0).f(state)
        truth.append(state[:2].copy())
    truth = np.array(truth)[:, None]
    return truth, truth + SD * rng.standard_normal((20, runs, 2))


def test_with_one_regime_it_is_the_kalman_filter():
    """Ours batched, and filterpy's one at a time; the closed form's rounding, hence 1e-9 of a metre."""
    z, state = straight_flights(np.random.default_rng(1)), start_of(5)
    regimes = Regimes(noise=(2.0, 0.0, 0.0))
    found = rao_blackwell.estimate(z, R, T, state, 1, regimes=regimes, particles=7, branches=0)
    F, Q = motion.constant_velocity(T, 2.0**2, piecewise=True)
    oracle = filterpy.kalman.KalmanFilter(4, 2)
    oracle.x, oracle.P, oracle.F, oracle.Q = state.mean[0].copy(), state.cov[0].copy(), F, Q
    oracle.H, oracle.R = np.eye(2, 4), R
    for k in range(len(z)):
        state, _ = kalman.update(kalman.predict(state, F, Q), z[k], np.eye(2, 4), R)
        assert np.allclose(found.mean[k], state.mean, rtol=0, atol=1e-8)
        oracle.predict()
        oracle.update(z[k, 0])
        assert np.allclose(found.mean[k, 0], oracle.x, rtol=0, atol=1e-8)
    assert np.all(found.probability == [1.0, 0.0, 0.0])


def test_manoeuvres_that_hardly_ever_come_change_nothing():
    """With a straight of 10¹² s on average, branches carry no weight: to 1 mm of the Kalman filter."""
    z, state = straight_flights(np.random.default_rng(2)), start_of(5)
    rare = Regimes(mean=(1e12, 18.0, 18.0), noise=(2.0, 0.1, 0.1))
    found = rao_blackwell.estimate(z, R, T, state, 1, regimes=rare, particles=50, branches=25)
    plain = rao_blackwell.estimate(z, R, T, state, 1, regimes=rare, branches=0)
    assert np.allclose(found.mean, plain.mean, rtol=0, atol=1e-3)


def test_a_run_alone_is_as_in_a_stack():
    _, z = turning(np.random.default_rng(3))
    stack = rao_blackwell.estimate(z, R, T, start_of(5), 4, [3, 1, 4, 15, 9], particles=40, branches=20)
    for k, number in enumerate([3, 1, 4, 15, 9]):
        one = rao_blackwell.estimate(
            z[:, k : k + 1], R, T, start_of(1), 4, [number], particles=40, branches=20
        )
        assert np.array_equal(one.mean[:, 0], stack.mean[:, k])
        assert np.array_equal(one.probability[:, 0], stack.probability[:, k])


def test_a_turn_is_known_as_a_turn_and_followed():
    """40 runs: at its end the turn is believed, and the position is better known than by one measurement."""
    truth, z = turning(np.random.default_rng(5), runs=40)
    found = rao_blackwell.estimate(z, R, T, start_of(40), 6)
    assert np.allclose(found.probability.sum(axis=-1), 1.0, rtol=0, atol=1e-12)
    # At any moment a manoeuvre may have begun, one scan in fifteen.
    assert np.mean(found.probability[8, :, STRAIGHT]) > 0.8
    # And end: half a scan in three.
    assert np.mean(found.probability[16:, :, TURN]) > 0.6
    error = np.sqrt(np.mean(np.sum((found.mean[16:, :, :2] - truth[16:]) ** 2, axis=-1)))
    assert error < SD * np.sqrt(2)


@pytest.mark.parametrize("regime", [STRAIGHT, TURN, SPEED])
@pytest.mark.parametrize("a", [-25.0, 1e-6, 8.0])
def test_jacobians_are_the_differences_of_the_motion(regime, a):
    x = np.array([100.0, -50.0, 180.0, -70.0, a if regime != STRAIGHT else 0.0])
    blocks = [np.empty((2, 2)), np.empty((2, 2)), np.empty(2), np.empty(2)]

    def moved(x):
        y = x.copy()
        rao_blackwell._bend(y, regime, 2.5, *blocks)
        return y

    moved(x)
    A, B, b, d = (block.copy() for block in blocks)
    F = np.eye(5)
    F[:2, 2:4], F[2:4, 2:4], F[:2, 4], F[2:4, 4] = A, B, b, d
    for j in range(4 if regime == STRAIGHT else 5):
        h = np.zeros(5)
        h[j] = 1e-3
        assert np.allclose((moved(x + h) - moved(x - h)) / 2e-3, F[:, j], rtol=0, atol=1e-5)


def test_selection_keeps_the_heavy_and_is_right_on_average():
    """Expected weights are the weights [2, (9)]; 4,000 selections, within 5 of their standard errors."""
    rng = np.random.default_rng(7)
    weights = rng.random(30) ** 6
    weights /= weights.sum()
    total, chosen = np.zeros(30), np.zeros(10, np.int64)
    for start in rng.random(4000):
        kept = weights.copy()
        count = rao_blackwell._select(kept, 10, start, chosen)
        assert count in (9, 10)
        total[chosen[:count]] += kept[chosen[:count]]
    heaviest = np.argsort(weights)[-3:]
    assert np.allclose(total[heaviest] / 4000, weights[heaviest], rtol=1e-12)
    assert np.all(np.abs(total / 4000 - weights) < 5 * np.sqrt(0.1 * weights / 4000))


@pytest.mark.parametrize("count", [1, 7, 100])
def test_selection_never_keeps_more_than_there_is_room_for(count):
    """Equal weights, a single one, and tiny ones before heavy ones: where rounding counts."""
    for weights in (np.full(150, 1 / 150), np.eye(150)[140], np.repeat([1e-18, 0.02], [100, 50])):
        for start in np.linspace(0.0, 1.0, 30, endpoint=False):
            kept, chosen = weights.copy(), np.full(count + 1, -1)
            found = rao_blackwell._select(kept, count, start, chosen)
            assert 1 <= found <= count
            assert chosen[count] == -1
            assert len(set(chosen[:found])) == found
            if weights[140] > 1.0 / count:
                assert 140 in chosen[:found]
