"""The laws of all associators, and each against its plainest form."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from radar_console.tracker.association import gnn, jpda
from radar_console.tracker.association.choose import GNN, JPDA, KINDS, NN, PDA, SET_JPDA, associate

every_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
many = settings(max_examples=50, derandomize=True)
ROUNDING = 1e-12  # some hundred operations on numbers of at most 1


def solved(kind, weights, budget=jpda.BUDGET):
    """The dense answer of any associator to dense weights (tracks, plots + 1)."""
    weights = np.asarray(weights, float)
    row, col = np.nonzero(weights[:, 1:])
    w = weights[:, 1:][row, col]
    p, p_miss = np.full(len(row), np.nan), np.full(len(weights), np.nan)
    approximate = np.ones(len(weights), bool)
    miss = weights[:, 0].copy()
    associate(kind, miss, weights.shape[1] - 1, row, col, w, budget, p, p_miss, approximate)
    result = np.zeros_like(weights)
    result[:, 0] = p_miss
    result[row, col + 1] = p
    assert not (approximate.any() and budget > 0)
    return result


@st.composite
def problems(draw, most_tracks=6, most_plots=7):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    tracks, plots = draw(st.integers(1, most_tracks)), draw(st.integers(1, most_plots))
    weights = np.exp(draw(st.floats(0.1, 5.0)) * rng.normal(size=(tracks, plots + 1)))
    weights[:, 1:] *= rng.random((tracks, plots)) < draw(st.floats(0.1, 1.0))
    weights[:, 0] = rng.uniform(0.01, 1.0, tracks)
    return weights, rng


def assert_feasible(kind, found, weights):
    assert np.all(np.isfinite(found))
    assert np.all(found >= 0)
    assert np.abs(found.sum(axis=1) - 1).max(initial=0) <= ROUNDING
    assert np.all(found[:, 1:][weights[:, 1:] == 0] == 0)
    if kind != PDA:
        assert found[:, 1:].sum(axis=0).max(initial=0) <= 1 + ROUNDING
    if kind in (NN, GNN):
        assert np.all((found == 0) | (found == 1))


@every_kind
@many
@given(problem=problems())
def test_probabilities_are_feasible(kind, problem):
    weights, _ = problem
    assert_feasible(kind, solved(kind, weights), weights)


@every_kind
@many
@given(problem=problems())
def test_order_of_tracks_and_plots_does_not_matter(kind, problem):
    weights, rng = problem
    tracks = rng.permutation(len(weights))
    plots = np.concatenate([[0], 1 + rng.permutation(weights.shape[1] - 1)])
    apart = solved(kind, weights[tracks][:, plots]) - solved(kind, weights)[tracks][:, plots]
    assert np.abs(apart).max() <= ROUNDING


@every_kind
@many
@given(a=problems(4, 4), b=problems(4, 4))
def test_clusters_are_independent(kind, a, b):
    a, b = a[0], b[0]
    (m, n), (k, more) = a.shape, b.shape
    both = np.zeros((m + k, n + more - 1))
    both[:m, :n], both[m:, 0], both[m:, n:] = a, b[:, 0], b[:, 1:]
    found = solved(kind, both)
    assert np.abs(found[:m, :n] - solved(kind, a)).max() <= ROUNDING
    assert np.abs(found[m:, n:] - solved(kind, b)[:, 1:]).max(initial=0) <= ROUNDING


@every_kind
@many
@given(problem=problems(), exponent=st.floats(-50, 50))
def test_scale_of_a_track_does_not_matter(kind, problem, exponent):
    weights, rng = problem
    scaled = weights.copy()
    scaled[rng.integers(len(weights))] *= 10.0**exponent
    assert np.abs(solved(kind, scaled) - solved(kind, weights)).max() <= ROUNDING


@every_kind
@many
@given(problem=problems())
def test_a_plot_that_nobody_gates_changes_nothing(kind, problem):
    weights, rng = problem
    at = rng.integers(1, weights.shape[1] + 1)
    found = solved(kind, np.insert(weights, at, 0.0, axis=1))
    assert np.array_equal(found, np.insert(solved(kind, weights), at, 0.0, axis=1))


@every_kind
@many
@given(problem=problems())
def test_certain_detection(kind, problem):
    """P_D P_G = 1: a miss has weight 0; a track for which no plot is left goes without all the same."""
    weights, _ = problem
    weights[:, 0] = 0.0
    found = solved(kind, weights)
    assert_feasible(kind, found, weights)
    assert np.all(found[~weights.any(axis=1), 0] == 1)
    if kind == PDA:
        assert np.all(found[weights.any(axis=1), 0] <= 1e-29)


@every_kind
def test_certain_detection_leaves_nobody_out(kind):
    """The first track's best plot is the only one of the second; nearest neighbour is greedy."""
    found = solved(kind, [[0.0, 5.0, 1.0], [0.0, 3.0, 0.0]])
    expected = {
        NN: [[0, 1, 0], [1, 0, 0]],
        GNN: [[0, 0, 1], [0, 1, 0]],
        PDA: [[0, 5 / 6, 1 / 6], [0, 1, 0]],
        JPDA: [[0, 0, 1], [0, 1, 0]],
        SET_JPDA: [[0, 0, 1], [0, 1, 0]],
    }
    assert found == pytest.approx(np.array(expected[kind]), abs=1e-12)


@every_kind
@pytest.mark.parametrize("shape", [(0, 1), (0, 4), (3, 1)])
def test_nothing_to_associate(kind, shape):
    found = solved(kind, np.ones(shape))
    assert found.shape == shape
    assert np.all(found[:, 0] == 1)


@every_kind
def test_tracks_without_plots(kind):
    weights = np.array([[0.1, 0, 0], [0.1, 2, 0], [0.0, 0, 0], [0.1, 3, 1], [0.1, 0, 0]])
    found = solved(kind, weights)
    assert_feasible(kind, found, weights)
    assert np.all(found[[0, 2, 4]] == [1, 0, 0])


@every_kind
@many
@given(problem=problems(), budget=st.sampled_from([jpda.BUDGET, 0.0]))
def test_huge_and_tiny_weights(kind, problem, budget):
    weights, rng = problem
    scale = 10.0 ** rng.uniform(-297, 297, weights.shape)
    weights = np.where(rng.random(weights.shape) < 0.5, weights, weights * scale)
    assert_feasible(kind, solved(kind, weights, budget), weights)


@every_kind
@pytest.mark.parametrize("weight", [1e-300, 5e-324, 1e300])
def test_scale_of_all_weights_does_not_matter(kind, weight):
    found = solved(kind, np.full((3, 3), weight))
    assert found == pytest.approx(solved(kind, np.ones((3, 3))), abs=1e-12)


@pytest.mark.parametrize("kind", [PDA, JPDA, SET_JPDA])
@many
@given(problem=problems())
def test_equal_plots_and_equal_tracks_share_alike(kind, problem):
    weights, _ = problem
    twice = np.concatenate([weights, weights[:, -1:]], axis=1)
    twice = np.concatenate([twice, twice[:1]])
    found = solved(kind, twice)
    assert np.abs(found[:, -1] - found[:, -2]).max() <= ROUNDING
    assert np.abs(found[0] - found[-1]).max() <= ROUNDING


@pytest.mark.parametrize("kind", [NN, GNN])
def test_equal_plots_and_equal_tracks_are_parted(kind):
    found = solved(kind, np.tile([0.1, 2.0, 2.0], (2, 1)))
    assert found[:, 0].tolist() == [0, 0]
    assert found[:, 1:].sum(axis=0).tolist() == [1, 1]


@many
@given(problem=problems())
def test_pda_is_each_track_by_itself(problem):
    weights, _ = problem
    assert np.abs(solved(PDA, weights) - weights / weights.sum(axis=1, keepdims=True)).max() <= ROUNDING


@many
@given(problem=problems())
def test_nearest_neighbour_takes_the_likeliest_pair_first(problem):
    weights, _ = problem
    ratio = weights[:, 1:] / weights[:, :1]
    expected = np.zeros_like(weights)
    while ratio.max() > 0:
        t, j = np.unravel_index(np.argmax(ratio), ratio.shape)
        expected[t, j + 1] = 1
        ratio[t], ratio[:, j] = 0, 0
    expected[:, 0] = expected.sum(axis=1) == 0
    assert np.array_equal(solved(NN, weights), expected)


def least_cost(weights):
    """The likeliest event by scipy: each track has a miss of its own; scipy knows no forbidden pair."""
    tracks = len(weights)
    forbidden = 1e6
    cost = np.full((tracks, weights.shape[1] - 1 + tracks), forbidden)
    gated = weights[:, 1:] > 0
    cost[:, :-tracks][gated] = -np.log((weights[:, 1:] / weights[:, :1])[gated])
    cost[np.arange(tracks), weights.shape[1] - 1 + np.arange(tracks)] = 0.0
    row, col = linear_sum_assignment(cost)
    result = np.zeros_like(weights)
    result[row, np.where(col < weights.shape[1] - 1, col + 1, 0)] = 1
    return result


@settings(max_examples=200, derandomize=True)
@given(problem=problems(12, 14))
def test_gnn_is_the_likeliest_event(problem):
    weights, _ = problem
    assert np.array_equal(solved(GNN, weights), least_cost(weights))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("tracks", "plots", "gated"), [(300, 400, 3.0), (200, 100, 8.0), (60, 80, 80.0)])
def test_gnn_of_large_problems_against_scipy(tracks, plots, gated, seed):
    rng = np.random.default_rng(seed)
    row, col = np.nonzero(rng.random((tracks, plots)) < gated / plots)
    cost = rng.normal(-2.0, 2.0, len(row))
    chosen = gnn.assign(tracks, plots, row, col, cost)
    used = col[chosen[chosen >= 0]]
    assert len(set(used)) == len(used)
    assert np.array_equal(row[chosen[chosen >= 0]], np.flatnonzero(chosen >= 0))
    shift = 100.0  # scipy takes a cost of 0 as no pair; a constant for each track changes nothing
    misses = np.arange(tracks)
    graph = csr_array(
        (
            np.concatenate([cost, np.zeros(tracks)]) + shift,
            (np.concatenate([row, misses]), np.concatenate([col, plots + misses])),
        )
    )
    theirs = graph[min_weight_full_bipartite_matching(graph)].sum() - shift * tracks
    assert cost[chosen[chosen >= 0]].sum() == pytest.approx(theirs, rel=1e-12)


def test_gnn_prefers_a_miss_to_an_unlikely_plot():
    assert solved(GNN, [[0.5, 0.4]]).tolist() == [[1, 0]]
    assert solved(GNN, [[0.5, 0.6]]).tolist() == [[0, 1]]
    assert solved(NN, [[0.5, 0.4]]).tolist() == [[0, 1]]


@pytest.mark.parametrize("kind", [NN, GNN, PDA, JPDA])
def test_of_a_single_track_and_plot(kind):
    expected = {NN: 1.0, GNN: 1.0, PDA: 0.75, JPDA: 0.75}
    assert solved(kind, [[0.5, 1.5]])[0, 1] == pytest.approx(expected[kind])


@pytest.mark.parametrize("kind", [NN, GNN])
def test_a_crowd_over_few_plots(kind):
    """Every plot of a crowd is used once, the rest is missed."""
    rng = np.random.default_rng(1)
    weights = np.exp(rng.normal(3.0, 1.0, (40, 6)))
    weights[:, 0] = 0.1
    found = solved(kind, weights)
    assert found[:, 1:].sum(axis=0).tolist() == [1] * 5
    assert math.isclose(found[:, 0].sum(), 35)
