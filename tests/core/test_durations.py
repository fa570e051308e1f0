"""Durations in bins against all of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.core.durations import Durations

BIN = 0.005  # width of a bin, relative


@given(st.lists(st.floats(1e-6, 1e4), min_size=1, max_size=200), st.floats(0.0, 1.0))
def test_quantiles_are_those_of_the_values_within_a_bin(values: list[float], q: float) -> None:
    found = Durations(values)
    exact = float(np.quantile(values, q, method="inverted_cdf"))
    assert found.quantile(q) == pytest.approx(exact, rel=BIN)
    assert found.longest == max(values)
    assert len(found) == len(values)


def test_values_one_by_one_are_the_same_as_together() -> None:
    values = np.random.default_rng(1).lognormal(size=1000)
    single = Durations()
    for value in values:
        single.add(float(value))
    assert single.quantile(0.99) == Durations(values).quantile(0.99)


def test_nothing_has_no_quantile_and_instants_take_no_time() -> None:
    assert math.isnan(Durations().quantile(0.5))
    assert math.isnan(Durations().longest)
    instants = Durations([0.0, 0.0, 1.0])
    assert instants.quantile(0.5) == 0.0
    assert instants.longest == 1.0


def test_no_numbers_are_left_out_and_no_duration_is_too_long() -> None:
    found = Durations([math.nan, math.inf, 1e9])
    assert len(found) == 1
    assert found.longest == 1e9
