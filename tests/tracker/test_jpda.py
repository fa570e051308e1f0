"""The association's probabilities, against the sum over all feasible events."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radar_console.tracker.association import elimination, grouping, jpda, pairs


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


@settings(max_examples=200, derandomize=True)
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


def partition(weights, forced=(-1, -1)):
    """Sum over all events by a dictionary of taken plots; with `forced`, only those with that pair."""
    tracks, columns = weights.shape
    last = {j: max(np.flatnonzero(weights[:, j]), default=-1) for j in range(1, columns)}
    states = {frozenset(): 1.0}
    for t in range(tracks):
        following = {}
        for taken, weight in states.items():
            for j in np.flatnonzero(weights[t]):
                if j in taken or (t == forced[0] and j != forced[1]):
                    continue
                now = frozenset(c for c in taken | ({j} if j else set()) if last[c] > t)
                following[now] = following.get(now, 0.0) + weight * weights[t, j]
        states = following
    return sum(states.values())


@pytest.mark.parametrize(
    ("tracks", "plots", "reach"),
    [(8, 9, 9), (9, 5, 5), (5, 10, 10), (16, 16, 3), (30, 12, 2), (12, 30, 4)],
)
def test_wide_and_long_clusters(tracks, plots, reach):
    """All-gated, and bands in mixed order, where columns come and go at all positions of the tables."""
    rng = np.random.default_rng(tracks)
    place = np.linspace(0, plots, tracks)
    weights = np.exp(rng.normal(size=(tracks, plots + 1)))
    weights[:, 1:] *= np.abs(np.arange(plots) + 0.5 - place[:, None]) < reach
    weights[:, 0] = 0.1
    mixed = rng.permutation(tracks)
    found = np.empty_like(weights)
    found[mixed] = jpda.marginals(weights[mixed])
    whole = partition(weights)
    for t, j in rng.permutation(np.argwhere(weights > 0))[:20]:
        assert found[t, j] == pytest.approx(partition(weights, (t, j)) / whole, abs=1e-12)


def test_the_sparse_call_agrees_with_the_dense():
    likelihood = random_cluster(3, 30, 40, 0.08, 2.0)
    row, col = np.nonzero(likelihood[:, 1:])
    found = jpda.sparse(likelihood[:, 0].copy(), 40, row, col, likelihood[:, 1:][row, col])
    dense = jpda.marginals(likelihood)
    assert np.array_equal(found.p_miss, dense[:, 0])
    assert np.array_equal(found.p, dense[row, col + 1])
    assert not found.approximate.any()


@pytest.mark.parametrize(
    ("row", "col", "w"),
    [
        ([1, 0], [0, 0], [1.0, 1.0]),
        ([0, 2], [0, 0], [1.0, 1.0]),
        ([0, 1], [0, 3], [1.0, 1.0]),
        ([0, 1], [-1, 0], [1.0, 1.0]),
        ([0, 1], [0, 0], [1.0, np.nan]),
        ([0, 1], [0, 0], [1.0]),
    ],
)
def test_impossible_pairs_are_refused(row, col, w):
    with pytest.raises(ValueError, match="pairs in range"):
        jpda.sparse(np.full(2, 0.1), 3, np.array(row), np.array(col), np.array(w))


def test_the_budget_is_that_of_the_call():
    """Clusters are summed exactly while it lasts, the rest is approximated and says so."""
    rng = np.random.default_rng(1)
    many, size = 30, 8
    row = np.repeat(np.arange(many * size), size)
    col = np.repeat(np.arange(many), size * size) * size + np.tile(np.arange(size), many * size)
    w, miss = np.exp(rng.normal(size=row.size)), np.full(many * size, 0.1)
    whole = jpda.sparse(miss, many * size, row, col, w)
    assert not whole.approximate.any()
    part = jpda.sparse(miss, many * size, row, col, w, budget=1e5)
    exact = ~part.approximate
    assert 0 < np.count_nonzero(exact) < many * size
    assert np.array_equal(part.p_miss[exact], whole.p_miss[exact])
    assert np.all(part.approximate.reshape(many, size).any(axis=1) == part.approximate[::size])


@pytest.mark.parametrize("more", [0, 1])
def test_of_very_many_pairs_none_is_summed_exactly(more):
    many = jpda.MOST_PAIRS // 4 + more
    row, col = (
        np.repeat(np.arange(2 * many), 2),
        np.repeat(np.arange(many), 4) * 2 + np.tile([0, 1], 2 * many),
    )
    found = jpda.sparse(np.full(2 * many, 0.1), 2 * many, row, col, np.ones(4 * many))
    assert np.all(found.approximate == (more > 0))
    # The plots are alike: each track has both, or none, with the same probability.
    assert np.ptp(found.p_miss) <= 1e-12
    assert np.abs(found.p_miss + found.p[::2] + found.p[1::2] - 1.0).max() <= 1e-12


@pytest.mark.parametrize("shape", [(300, 500), (500, 300), (40, 40)])
def test_what_is_too_wide_is_approximated(shape):
    """A crowd: every row is a probability, no plot is used twice, and plots alike are treated alike."""
    rng = np.random.default_rng(1)
    likelihood = np.tile(np.exp(rng.normal(size=shape[0]))[:, None], (1, shape[1] + 1))
    likelihood[:, 0] = 0.1
    found = jpda.marginals(likelihood)
    assert np.abs(found.sum(axis=1) - 1).max() <= 1e-12
    assert found[:, 1:].sum(axis=0).max() <= 1 + 1e-12
    assert np.ptp(found[:, 1:], axis=1).max() <= 1e-12


def test_a_plot_of_one_track_is_a_part_of_its_miss():
    """Folding it and summing over it are the same; what it takes stays in proportion to the miss."""
    likelihood = np.array([[0.1, 2.0, 0.7, 0.3], [0.2, 3.0, 0.0, 0.0]])
    found = jpda.marginals(likelihood)
    assert np.abs(found - enumerate_events(likelihood)).max() <= 1e-15
    assert found[0, 2:] / found[0, 0] == pytest.approx(likelihood[0, 2:] / 0.1)


def test_a_pair_that_is_given_twice_counts_twice():
    row, col, w = np.array([0, 0, 1]), np.array([0, 0, 0]), np.array([1.0, 2.0, 1.0])
    found = jpda.sparse(np.array([0.5, 0.5]), 1, row, col, w)
    once = enumerate_events(np.array([[0.5, 3.0], [0.5, 1.0]]))
    assert found.p_miss == pytest.approx(once[:, 0])
    assert found.p[:2].sum() == pytest.approx(once[0, 1])
    alone = jpda.sparse(np.array([0.5]), 1, row[:2], col[:2], w[:2])
    assert alone.p == pytest.approx([2 / 7, 4 / 7])
    assert not alone.approximate.any()


@pytest.mark.parametrize(("tracks", "plots"), [(25, 25), (30, 70), (80, 26)])
def test_a_full_matrix_is_approximated_as_its_pairs_are(tracks: int, plots: int) -> None:
    rng = np.random.default_rng(tracks)
    likelihood = np.concatenate([np.full((tracks, 1), 0.1), rng.gamma(0.3, size=(tracks, plots))], axis=1)
    likelihood[0, 1:] *= 1e200  # a miss that is as good as impossible
    row, col = np.repeat(np.arange(tracks), plots), np.tile(np.arange(plots), tracks)
    pairs = jpda.sparse(likelihood[:, 0].copy(), plots, row, col, likelihood[:, 1:].ravel().copy())
    assert pairs.approximate.all()
    found = jpda.marginals(likelihood)
    # Sums in another order: rounding, and what the sweeps make of it.
    np.testing.assert_allclose(found[:, 1:].ravel(), pairs.p, atol=1e-9)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-12)
    assert found[:, 1:].sum(axis=0).max() <= 1.0 + 1e-12


@pytest.mark.parametrize("own", [False, True])
def test_clusters_that_are_approximated_do_not_know_of_each_other(own: bool) -> None:
    """Many in one call, with and without plots of one track among them, are what each is alone."""
    rng = np.random.default_rng(5)
    many, tracks, plots = 12, 5, 6
    single = [random_cluster(seed, tracks, plots, 1.0, 1.0) for seed in range(many)]
    if own:
        for one in single[::3]:
            one[1:, 2] = 0.0
    whole = np.zeros((many * tracks, many * plots + 1))
    mixed = rng.permutation(many * tracks)
    for n, one in enumerate(single):
        rows = mixed[n * tracks : (n + 1) * tracks]
        whole[rows, 0] = one[:, 0]
        whole[rows, 1 + n * plots : 1 + (n + 1) * plots] = one[:, 1:]
    found = jpda.marginals(whole, budget=0)
    for n, one in enumerate(single):
        rows = mixed[n * tracks : (n + 1) * tracks]
        alone = jpda.marginals(one, budget=0)
        np.testing.assert_allclose(found[rows, 0], alone[:, 0], atol=1e-9)
        np.testing.assert_allclose(found[rows, 1 + n * plots : 1 + (n + 1) * plots], alone[:, 1:], atol=1e-9)


@pytest.mark.parametrize("columns", [1, 127, 128, 129, 300])
def test_a_dense_row_is_read_to_its_end(columns: int) -> None:
    """Rows of all lengths about those of a block, empty blocks, weights of -0 and at both ends."""
    likelihood = random_cluster(7, 40, columns, 0.02, 1.0)
    likelihood[:2, 1] = likelihood[2:4, -1] = 3.0
    likelihood[5, likelihood[5] == 0] = -0.0
    row, col = np.nonzero(likelihood[:, 1:])
    pairs = jpda.sparse(likelihood[:, 0].copy(), columns, row, col, likelihood[:, 1:][row, col])
    found = jpda.marginals(likelihood)
    assert np.array_equal(found[row, col + 1], pairs.p)
    assert np.array_equal(found[:, 0], pairs.p_miss)
    likelihood[-1, -1] = np.nan
    with pytest.raises(ValueError, match="finite"):
        jpda.marginals(likelihood)


@pytest.mark.parametrize("shape", [(1, 40), (40, 40)])
def test_pairs_in_arrays_of_any_kind(shape: tuple[int, int]) -> None:
    """Views of a table and read-only arrays give what plain ones give; all stay as they were."""
    rng = np.random.default_rng(2)
    table = np.argwhere(rng.random(shape) < 0.2)
    row, col, w = table[:, 0].copy(), table[:, 1].copy(), rng.gamma(1.0, size=len(table))
    miss = np.full(shape[0], 0.1)
    plain = jpda.sparse(miss, shape[1], row, col, w)
    given = (row.copy(), col.copy(), w.copy())
    for array in (miss, row, col, w):
        array.flags.writeable = False
    for r, c in ((table[:, 0], table[:, 1]), (row, col)):
        found = jpda.sparse(miss, shape[1], r, c, w)
        assert np.array_equal(found.p, plain.p)
        assert np.array_equal(found.p_miss, plain.p_miss)
    assert all(np.array_equal(a, b) for a, b in zip((row, col, w), given, strict=True))


def test_a_cluster_is_not_charged_for_the_search_of_the_one_before():
    """Three hundred pairs of tracks after a crowd of twelve: what the crowd's second plan took is its own."""
    rng = np.random.default_rng(0)
    sizes = [(12, 14)] + [(2, 2)] * 300
    tracks, columns = np.cumsum([(0, 0), *sizes], axis=0).T
    blocks = [
        np.indices(size).reshape(2, -1) + np.array([[t], [c]])
        for size, t, c in zip(sizes, tracks[:-1], columns[:-1], strict=True)
    ]
    row, col = np.concatenate(blocks, axis=1)
    w = rng.uniform(0.5, 2.0, len(row))
    miss = np.full(tracks[-1], 0.1)
    assert not jpda.sparse(miss, columns[-1], row, col, w, 1e6).approximate.any()
    approximate = jpda.sparse(miss, columns[-1], row, col, w, 2e5).approximate
    assert approximate[:12].all()
    assert not approximate[12:].any()


def pairs_of(blocks):
    """The sparse problem of several dense ones side by side: miss, columns, row, col, w."""
    shapes = np.array([(0, 0), *((len(b), b.shape[1] - 1) for b in blocks)])
    tracks, columns = np.cumsum(shapes, axis=0).T
    places = [np.nonzero(b[:, 1:]) for b in blocks]
    row = np.concatenate([r + t for (r, _), t in zip(places, tracks, strict=False)])
    col = np.concatenate([c + k for (_, c), k in zip(places, columns, strict=False)])
    w = np.concatenate([b[:, 1:][place] for b, place in zip(blocks, places, strict=True)])
    return np.concatenate([b[:, 0] for b in blocks]), int(columns[-1]), row, col, w


def shuffled(problem, rng):
    """The same problem in another order of tracks and plots; each track's new place, each pair's old one."""
    miss, columns, row, col, w = problem
    track, plot = rng.permutation(len(miss)), rng.permutation(columns)
    order = np.argsort(track[row], kind="stable")
    mixed = np.empty_like(miss)
    mixed[track] = miss
    return (mixed, columns, track[row][order], plot[col][order], w[order]), track, order


@settings(max_examples=200, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([0.0, 1.0, 6.0, 60.0]), st.booleans())
def test_two_tracks_are_what_the_enumeration_says(seed, plots, spread, all_shared):
    """Up to four common plots the sum is written out, with and without plots of one track besides."""
    likelihood = random_cluster(seed, 2, plots, 1.0 if all_shared else 0.7, spread)
    found = jpda.marginals(likelihood)
    assert np.abs(found - enumerate_events(likelihood)).max() <= 1e-12


@pytest.mark.parametrize("plots", [1, 2, 3, 4])
def test_two_tracks_cost_what_their_plan_costs(plots):
    """So that what is exact does not depend on how it is summed."""
    cluster = grouping.room(plots + 2, 2 * plots)
    every = pairs.Side(np.array([0, plots, 2 * plots]), np.tile(np.arange(plots), 2), np.ones(2 * plots))
    claims, number = np.full(plots, 2, np.uint8), np.zeros(plots, np.int32)
    assert grouping.gather(np.arange(2), every, claims, number, cluster) == plots
    work = elimination.work(plots + 2, 2 * plots)
    cost, _, looked = elimination.plan(np.arange(2), cluster.tracks, cluster.plots, 1e9, 1e9, work)
    assert elimination.price_of_two(plots) == (cost, looked)


def test_many_small_clusters_in_any_order():
    """More plots than fit a cache, clusters of all small shapes mixed: each is what the enumeration says."""
    rng = np.random.default_rng(9)
    kinds = [random_cluster(seed, *rng.integers(1, 5, 2), 0.8, 2.0) for seed in range(40)]
    kinds.append(
        random_cluster(1, 30, 1, 1.0, 1.0)
    )  # many tracks, one plot: more tracks than half of the pairs
    which = rng.integers(0, len(kinds), 8000)
    problem, track, order = shuffled(pairs_of([kinds[k] for k in which]), rng)
    assert problem[1] > grouping.FAR
    found = jpda.sparse(*problem, budget=1e9)
    assert not found.approximate.any()
    exact = {k: enumerate_events(kinds[k]) for k in range(40)}
    star = kinds[40][:, 1] / kinds[40][:, 0]
    share = star / (1.0 + star.sum())  # one plot, one event for each track
    exact[40] = np.stack([1.0 - share, share], axis=1)
    p_miss = np.concatenate([exact[k][:, 0] for k in which])
    p = np.concatenate([exact[k][:, 1:][kinds[k][:, 1:] > 0] for k in which])
    assert np.abs(found.p_miss[track] - p_miss).max() <= 1e-12
    assert np.abs(found.p - p[order]).max() <= 1e-12


@pytest.mark.parametrize("certain", [False, True])
def test_one_sweep_over_all_is_what_it_is_over_each(certain):
    """So many pairs that belief propagation goes over them once: the plain formulas of Williams and Lau.

    What plots hear is summed in single precision: an error of 1e-7 of that is one of 1e-7 of a probability.
    """
    rng = np.random.default_rng(11)
    tracks, plots, many = 3, 4, 60_000
    w = np.exp(rng.normal(size=(many, tracks, plots)))
    w[:, 0, 0] = 0.0
    w[:, 1:, 1] = 0.0  # a plot of the first track alone
    miss = np.full((many, tracks, 1), 1e-9 if certain else 0.1)
    problem = pairs_of(list(np.concatenate([miss, w], axis=2)))
    found = jpda.sparse(*problem, budget=16.0 * np.count_nonzero(w[:, :, [0, 2, 3]]))
    assert found.approximate.all()
    r = w / miss
    told = r / (1.0 + r.sum(axis=2, keepdims=True) - r)
    weight = r / (1.0 + told.sum(axis=1, keepdims=True) - told)
    p = weight / (1.0 + weight.sum(axis=2, keepdims=True))
    p /= np.maximum(p.sum(axis=1, keepdims=True), 1.0)
    # The first track's own plot takes its share of what the others leave.
    rest = 1.0 - p[:, 0, 2:].sum(axis=1)
    p[:, 0, 1] = rest * r[:, 0, 1] / (1.0 + r[:, 0, 1])
    np.testing.assert_allclose(found.p, p[w > 0], atol=5e-7)
    p_miss = 1.0 - p.sum(axis=2)
    np.testing.assert_allclose(found.p_miss.reshape(many, tracks), p_miss, atol=5e-7)


def test_a_hopeless_cluster_leaves_nothing_for_the_next():
    """What can't be afforded is not begun; what follows is approximated, as after a plan that failed."""
    rng = np.random.default_rng(4)
    n = 2000
    ring = np.zeros((n, n + 1))
    ring[:, 0] = 0.1
    for step in (0, 1, 7):
        ring[np.arange(n), 1 + (np.arange(n) + step) % n] = rng.uniform(0.5, 2.0, n)
    problem = pairs_of([ring, random_cluster(1, 2, 2, 1.0, 1.0)])
    left = 5e3
    found = jpda.sparse(*problem, budget=16.0 * len(problem[2]) + left)
    assert found.approximate.all()
