"""The association's probabilities, against the sum over all feasible events."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radar_console.tracker.association import jpda


def enumerate_events(likelihood):
    """Every feasible event, in the plainest form."""
    tracks, columns = likelihood.shape
    result = np.zeros_like(likelihood)

    def visit(t, taken, weight, choice):
        if weight == 0:
            return
        if t == tracks:
            for track, j in enumerate(choice):
                result[track, j] += weight
            return
        for j in range(columns):
            if j == 0 or j not in taken:
                visit(t + 1, taken | {j} if j else taken, weight * likelihood[t, j], [*choice, j])

    visit(0, frozenset(), 1.0, [])
    return result / result.sum(axis=1, keepdims=True)


def random_cluster(seed, tracks, plots, density, spread):
    rng = np.random.default_rng(seed)
    likelihood = np.exp(spread * rng.normal(size=(tracks, plots + 1)))
    likelihood[:, 1:] *= rng.random((tracks, plots)) < density
    likelihood[:, 0] = rng.uniform(0.01, 1.0, tracks)
    return likelihood


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 5),
    st.integers(0, 6),
    st.floats(0.1, 1.0),
    st.floats(0.0, 6.0),
)
def test_exact_marginals_are_those_of_the_enumeration(seed, tracks, plots, density, spread):
    likelihood = random_cluster(seed, tracks, plots, density, spread)
    found = jpda.marginals(likelihood)
    assert np.abs(found - enumerate_events(likelihood)).max() <= 1e-12
    assert np.abs(found.sum(axis=1) - 1).max() <= 1e-12
    assert np.all(found[likelihood == 0] == 0)


@pytest.mark.parametrize("seed", range(20))
def test_the_side_that_is_eliminated_does_not_matter(seed):
    """Long chains, wide one way: summed over tracks, and over measurements, by transposition."""
    likelihood = random_cluster(seed, 6, 4, 0.6, 2.0)
    assert np.abs(jpda.marginals(likelihood) - enumerate_events(likelihood)).max() <= 1e-12


def test_belief_propagation_is_close():
    """Mean error over 100 clusters; its largest errors belong to tight formations."""
    errors = []
    for seed in range(100):
        likelihood = random_cluster(seed, 5, 6, 0.5, 2.0)
        found = jpda.marginals(likelihood, budget=0)
        assert np.abs(found.sum(axis=1) - 1).max() <= 1e-12
        errors.append(np.abs(found - enumerate_events(likelihood)).max())
    assert np.median(errors) < 0.03
    assert max(errors) < 0.25


def test_on_a_tree_belief_propagation_is_exact():
    likelihood = np.array([[0.1, 3.0, 2.0, 0.0], [0.2, 0.0, 5.0, 1.0]])
    found = jpda.marginals(likelihood, budget=0)
    assert np.abs(found - enumerate_events(likelihood)).max() <= 1e-8


def test_certain_detection():
    """P_D P_G = 1: each track must have its plot; with too few plots a track goes without."""
    pair = jpda.marginals(np.array([[0.0, 1.0, 2.0], [0.0, 3.0, 4.0]]))
    assert np.abs(pair - enumerate_events(np.array([[0.0, 1.0, 2.0], [0.0, 3.0, 4.0]]))).max() <= 1e-12
    crowd = jpda.marginals(np.array([[0.0, 1.0], [0.0, 3.0]]))
    assert crowd == pytest.approx(np.array([[0.5, 0.5], [0.5, 0.5]]))
    alone = jpda.marginals(np.array([[0.0, 0.0], [0.0, 3.0]]))
    assert alone == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0]]))


def test_extreme_weights_stay_finite():
    likelihood = np.array([[1e-4, 1e300, 1e-300], [1e-4, 1e-300, 1e300], [1e-4, 1e300, 1e300]])
    for budget in (jpda.BUDGET, 0):
        found = jpda.marginals(likelihood, budget)
        assert np.all(np.isfinite(found))
        assert np.abs(found.sum(axis=1) - 1).max() <= 1e-12


@pytest.mark.parametrize("shape", [(0, 1), (0, 4), (3, 1)])
def test_nothing_to_associate(shape):
    found = jpda.marginals(np.ones(shape))
    assert found.shape == shape
    assert np.all(found[:, 0] == 1)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_impossible_weights_are_refused(bad):
    with pytest.raises(ValueError, match="finite"):
        jpda.marginals(np.array([[0.1, bad]]))
