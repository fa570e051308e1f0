"""Times of day become one time that runs on."""

import numpy as np
import pytest

from radar_console.asterix.clock import steady, unwrap_days

UNKNOWN = np.full(4, np.nan)


def test_times_run_on_across_midnight_and_back_again():
    # A late report from before midnight comes behind one from after it.
    times = unwrap_days(np.array([86399.0, 0.5, 86399.9, 1.0]), UNKNOWN)
    assert times.tolist() == [86399.0, 86400.5, 86399.9, 86401.0]


def test_captures_tell_how_many_days_passed():
    times = unwrap_days(np.array([100.0, 200.0]), np.array([0.0, 3 * 86400.0 + 100]))
    assert times.tolist() == [100.0, 3 * 86400.0 + 200]


def test_a_stray_time_is_not_kept():
    times = np.array([0.0, 1.0, 2.0, 500.0, 4.0, 1.5, 6.0, 7.0])
    mended, kept, jumps = steady(times, 0.5, 10.0)
    assert kept.tolist() == [True, True, True, False, True, False, True, True]
    assert jumps == 0
    np.testing.assert_array_equal(mended[kept], times[kept])


def test_a_stray_first_time_is_not_kept():
    _, kept, _ = steady(np.array([900.0, 1.0, 2.0, 3.0, 4.0]), 0.5, 10.0)
    assert kept.tolist() == [False, True, True, True, True]


def test_a_clock_that_is_set_back_goes_on_from_where_it_was():
    times = np.concatenate((np.arange(10.0), np.arange(3.0, 13.0)))
    mended, kept, jumps = steady(times, 0.5, 50.0)
    assert kept.all()
    assert jumps == 1
    np.testing.assert_allclose(mended, np.arange(20.0))


def test_a_hole_is_a_hole():
    times = np.concatenate((np.arange(10.0), np.arange(500.0, 510.0)))
    mended, kept, jumps = steady(times, 0.5, 50.0)
    assert kept.all()
    assert jumps == 0
    np.testing.assert_array_equal(mended, times)


@pytest.mark.parametrize("times", [[], [5.0], [5.0, 1.0]])
def test_short_series(times):
    mended, kept, _ = steady(np.array(times, float), 0.5, 10.0)
    assert len(mended) == len(kept) == len(times)
    assert len(times) == 0 or kept.any()
