"""The receiver's laws: pattern, cells, noise, threshold, false alarms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.simulator import detection

SIGMAS = 5.0  # a seeded draw beyond it would be one in a million


def within(count: float, trials: int, p: float) -> bool:
    return bool(abs(count - trials * p) <= SIGMAS * np.sqrt(trials * p * (1.0 - p)))


def test_two_way_pattern_is_a_quarter_at_half_the_one_way_beam_width() -> None:
    np.testing.assert_allclose(detection.two_way_gain([-0.5, 0.0, 0.5, 1.0], 1.0), [0.25, 1.0, 0.25, 2**-8])


def test_echoes_fall_with_the_fourth_power_of_range_down_to_the_stc_range() -> None:
    ratio = detection.snr([500e3, 250e3, 125e3, 50e3, 10e3, 0.0], 19.0, 250e3, 50e3)
    decibels = 10.0 * np.log10(ratio)
    near = 19.0 + 40.0 * np.log10(5.0)
    np.testing.assert_allclose(
        decibels, [19.0 - 40 * np.log10(2), 19.0, 19.0 + 40 * np.log10(2), near, near, near]
    )


def test_triangular_response_over_two_cells() -> None:
    distance = np.array([1050.0, 1125.0, 1100.0])
    stream, voltage = detection.spread(np.array([0, 1, 2]), distance, np.ones(3, complex), 100.0, 50)
    found = {int(s): float(abs(v)) for s, v in zip(stream, voltage, strict=True) if v}
    # cell 10 is from 1,000 to 1,100 m, its centre at 1,050
    assert found == pytest.approx({10: 1.0, 60: 0.25, 61: 0.75, 110: 0.5, 111: 0.5})


def test_cells_end_with_the_range() -> None:
    stream, _ = detection.spread(np.array([3, 3]), np.array([10.0, 4990.0]), np.ones(2, complex), 100.0, 50)
    assert sorted(stream.tolist()) == [150, 199]


def test_threshold_holds_the_false_alarm_rate() -> None:
    p_fa, cells = 6e-3, 1_000_000
    stream, amplitude = detection.receive(
        np.arange(cells), np.zeros(cells, complex), np.random.default_rng(1)
    )
    assert np.array_equal(stream, np.arange(cells))
    assert within(np.count_nonzero(amplitude >= detection.threshold(p_fa)), cells, p_fa)
    assert np.mean(amplitude**2) == pytest.approx(1.0, abs=SIGMAS / np.sqrt(cells))


@pytest.mark.parametrize(("p_fa", "snr_db"), [(6e-3, 19.0), (1e-3, 10.0), (1e-6, 20.0)])
def test_single_pulse_detection_of_swerling_one(p_fa: float, snr_db: float) -> None:
    """P_D = P_FA^(1/(1 + SNR))."""
    pulses, rng = 200_000, np.random.default_rng(2)
    snr = 10.0 ** (snr_db / 10.0)
    voltage = np.sqrt(snr * rng.standard_exponential(pulses)) * np.exp(0.3j)
    _, amplitude = detection.receive(np.arange(pulses), voltage, rng)
    detected = np.count_nonzero(amplitude >= detection.threshold(p_fa))
    assert within(detected, pulses, p_fa ** (1.0 / (1.0 + snr)))


def test_echoes_in_a_cell_add_with_their_phases() -> None:
    stream = np.array([5, 3, 5, 3])
    voltage = 1e6 * np.array([1.0, 1.0, -1.0, 1.0], complex)
    cells, amplitude = detection.receive(stream, voltage, np.random.default_rng(3))
    assert cells.tolist() == [3, 5]
    assert amplitude[0] == pytest.approx(2e6, abs=10.0)  # noise is of amplitude 1
    assert amplitude[1] < 10.0


def test_false_alarms_are_those_of_visiting_every_cell() -> None:
    p_fa, cells = 6e-3, 3_600_000
    where, amplitude = detection.false_alarms(p_fa, cells, np.random.default_rng(4))
    assert within(len(where), cells, p_fa)
    assert np.all(np.diff(where) > 0)
    assert where[0] >= 0
    assert where[-1] < cells
    # a uniform place: the thirds of the stream hold a third each
    for third in np.histogram(where, bins=3, range=(0, cells))[0]:
        assert within(third, len(where), 1 / 3)
    # neighbours alarm independently: P(next cell too) is P_FA again
    assert within(np.count_nonzero(np.diff(where) == 1), len(where), p_fa)
    # the power's excess over the threshold is exponential with mean 1
    excess = amplitude**2 - detection.threshold(p_fa) ** 2
    assert excess.min() >= 0.0
    assert excess.mean() == pytest.approx(1.0, abs=SIGMAS / np.sqrt(len(excess)))
    assert within(np.count_nonzero(excess > 2.0), len(excess), np.exp(-2.0))


@pytest.mark.parametrize("p_fa", [1e-300, 1e-12, 0.5, 0.999999])
def test_extreme_false_alarm_rates(p_fa: float) -> None:
    where, _ = detection.false_alarms(p_fa, 10_000, np.random.default_rng(5))
    assert np.all(np.diff(where) > 0)
    assert within(len(where), 10_000, p_fa)


@given(st.sets(st.integers(0, 40)), st.sets(st.integers(0, 40)))
def test_merging_keeps_each_cell_once(seen: set[int], alarms: set[int]) -> None:
    def cells(members: set[int]) -> np.ndarray:
        return np.array(sorted(members), np.int64)

    stream, level = detection.merge(
        cells(seen), np.full(len(seen), 1.0), cells(alarms), np.full(len(alarms), 2.0)
    )
    assert stream.tolist() == sorted(seen | alarms)
    assert level.tolist() == [1.0 if cell in seen else 2.0 for cell in sorted(seen | alarms)]
