"""RMSE by hand, against the plainest form, and under what must not change it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.evaluation.rmse import rmse


def test_by_hand():
    found = rmse(np.zeros((2, 2)), np.array([[3.0, 0.0], [0.0, 4.0]]))
    assert found.components == pytest.approx([np.sqrt(9 / 2), np.sqrt(16 / 2)])
    assert found.value == pytest.approx(np.sqrt(25 / 2))


@given(st.integers(0, 2**32 - 1), st.floats(-4.0, 4.0))
def test_a_stack_its_parts_and_turns_of_the_plane(seed, turn):
    rng = np.random.default_rng(seed)
    truth, estimate = rng.normal(size=(2, 3, 7, 2))
    found = rmse(truth, estimate)
    for k in range(3):
        errors = [np.hypot(*(t - e)) for t, e in zip(truth[k], estimate[k], strict=True)]
        assert found.value[k] == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-12)
        np.testing.assert_array_equal(rmse(truth[k], estimate[k]).components, found.components[k])
    np.testing.assert_allclose(np.square(found.components).sum(axis=1), found.value**2, rtol=1e-12)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    shift = rng.normal(size=2)
    moved = rmse(truth @ rotation.T + shift, estimate @ rotation.T + shift)
    np.testing.assert_allclose(moved.value, found.value, rtol=1e-12)
    np.testing.assert_allclose(rmse(3.0 * truth, 3.0 * estimate).value, 3.0 * found.value, rtol=1e-12)


def test_no_pairs_have_no_error():
    found = rmse(np.empty((0, 2)), np.empty((0, 2)))
    assert np.isnan(found.value)
    assert np.isnan(found.components).all()
