"""GOSPA and OSPA: by hand, by brute force, as metrics, under motions of the plane."""

import datetime
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from radar_console.evaluation.assignment import match
from radar_console.evaluation.gospa import gospa
from radar_console.evaluation.ospa import averaged, ospa

C = 1000.0
# Sums of a few terms of at most c^p, and one root: a thousand roundings at most.
ROUNDING = 1e-12


coordinate = st.integers(-2500, 2500).map(float)
positions = st.lists(st.tuples(coordinate, coordinate), max_size=5).map(
    lambda rows: np.array(rows, float).reshape(-1, 2)
)
exponent = st.sampled_from([1.0, 1.5, 2.0, 4.0])
alphas = st.sampled_from([0.5, 1.0, 2.0])


def by_enumeration(x, y, c, p, alpha):
    """The definition, over all assignments of the smaller set."""
    if len(x) > len(y):
        x, y = y, x
    d = np.minimum(np.linalg.norm(x[:, None] - y[None, :], axis=2), c) ** p
    best = min(
        sum(d[i, j] for i, j in enumerate(chosen)) for chosen in itertools.permutations(range(len(y)), len(x))
    )
    return (best + c**p / alpha * (len(y) - len(x))) ** (1 / p)


@given(positions, positions, exponent, alphas)
def test_gospa_is_its_definition(x, y, p, alpha):
    assert float(gospa(x, y, C, p, alpha)) == pytest.approx(by_enumeration(x, y, C, p, alpha), rel=ROUNDING)


@given(positions, positions, exponent)
def test_ospa_is_its_definition(x, y, p):
    larger = max(len(x), len(y), 1)
    expected = by_enumeration(x, y, C, p, 1.0) / larger ** (1 / p)
    assert float(ospa(x, y, C, p)) == pytest.approx(expected, rel=ROUNDING)


@pytest.mark.parametrize("distance", [gospa, ospa])
@given(x=positions, y=positions, z=positions, p=exponent)
def test_axioms_of_a_metric(distance, x, y, z, p):
    def d(a, b):
        return float(distance(a, b, C, p))

    assert d(x, x) == 0.0
    assert d(x, y) == pytest.approx(d(y, x), rel=ROUNDING)
    assert d(x, z) <= (d(x, y) + d(y, z)) * (1 + ROUNDING)
    if sorted(map(tuple, x)) != sorted(map(tuple, y)):
        assert d(x, y) > 0.0


@pytest.mark.parametrize("distance", [gospa, ospa])
@given(
    x=positions, y=positions, turn=st.floats(-4, 4), shift=st.tuples(coordinate, coordinate), data=st.data()
)
def test_invariances(distance, x, y, turn, shift, data):
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = [
        data.draw(st.permutations(list(rows @ rotation.T + shift))) if len(rows) else rows for rows in (x, y)
    ]
    # Coordinates to 5 km, rounded: distances move by 1e-12 m, and their powers near 0 by little more.
    expected = float(distance(x, y, C))
    assert float(distance(*moved, C)) == pytest.approx(expected, abs=1e-6)


@given(positions, positions, exponent, alphas)
def test_parts_make_the_whole(x, y, p, alpha):
    whole = gospa(x, y, C, p, alpha)
    assert whole.value**p == pytest.approx(whole.location + whole.missed + whole.false, rel=ROUNDING)
    assert whole.assigned + whole.missed_count == len(x)
    assert whole.assigned + whole.false_count == len(y)
    if alpha == 2.0:
        assert whole.missed == pytest.approx(whole.missed_count * C**p / 2, rel=ROUNDING)
        assert whole.false == pytest.approx(whole.false_count * C**p / 2, rel=ROUNDING)
    mean = ospa(x, y, C, p)
    assert averaged(whole, C, p) == pytest.approx(mean, rel=ROUNDING)
    assert mean.value**p == pytest.approx(mean.location**p + mean.cardinality**p, rel=ROUNDING)


def test_gospa_by_hand():
    truth, estimates = [[0, 0], [9000, 0], [0, 9000]], [[30, 40], [0, 8880], [-7000, 0]]
    whole = gospa(truth, estimates, c=5000.0)
    assert (whole.location, whole.missed, whole.false) == pytest.approx((50**2 + 120**2, 12.5e6, 12.5e6))
    assert (whole.assigned, whole.missed_count, whole.false_count) == (2, 1, 1)
    assert whole.value == pytest.approx(np.sqrt(16900 + 25e6))
    # The least sum, not the least first pair: 60 + 60, where greed takes 20 + 140.
    assert gospa([[0], [80]], [[60], [140]], c=1000.0, p=1.0).value == pytest.approx(120)
    assert gospa([[0], [80]], [[60], [140]], c=100.0, p=1.0, alpha=1.0).value == pytest.approx(120)


def test_ospa_by_hand():
    mean = ospa([[0, 0], [1000, 0]], [[3, 4]], c=100.0, p=1.0)
    assert (mean.value, mean.location, mean.cardinality) == pytest.approx((52.5, 2.5, 50.0))
    assert ospa([[0, 0]], [[0, 500]], c=100.0).value == pytest.approx(100.0)


@pytest.mark.parametrize("distance", [gospa, ospa])
def test_empty_sets(distance):
    assert float(distance([], [], C)) == 0.0
    assert float(distance(np.empty((0, 2)), np.empty((0, 3)), C)) == 0.0
    one = float(distance([[1.0, 2.0]], [], C))
    assert one == float(distance([], [[1.0, 2.0]], C))
    assert one == pytest.approx(C / np.sqrt(2) if distance is gospa else C)


def test_a_pair_exactly_at_the_cut_off_is_no_pair_and_costs_the_same():
    whole = gospa([[0.0, 0.0]], [[C, 0.0]], C)
    assert (whole.assigned, whole.missed_count, whole.false_count) == (0, 1, 1)
    assert whole.value == C


@pytest.mark.parametrize(
    "bad",
    [
        {"c": 0.0},
        {"c": np.nan},
        {"c": C, "p": 0.5},
        {"c": C, "p": np.inf},
        {"c": C, "alpha": 0.0},
        {"c": C, "alpha": 2.5},
    ],
)
def test_parameters_out_of_range_are_refused(bad):
    with pytest.raises(ValueError, match="GOSPA needs"):
        gospa([[0.0, 0.0]], [[1.0, 0.0]], **bad)


def test_positions_that_are_none_are_refused():
    with pytest.raises(ValueError, match="truth has a coordinate"):
        gospa([[0.0, np.nan]], [[1.0, 0.0]], C)
    with pytest.raises(ValueError, match=r"estimates must be \(n, d\)"):
        gospa([[0.0, 0.0]], [1.0, 0.0], C)
    with pytest.raises(ValueError, match="2 coordinates and estimates 3"):
        gospa([[0.0, 0.0]], [[1.0, 0.0, 0.0]], C)


def test_large_powers():
    assert gospa([[0.0, 0.0]], [[3.0, 4.0]], 1e3, p=100.0).value == pytest.approx(5.0)
    with pytest.raises(OverflowError):
        gospa([[0.0, 0.0]], [[3.0, 4.0]], 1e6, p=200.0)


@given(st.integers(0, 2**32 - 1), st.sampled_from([50.0, 400.0, 3000.0]))
def test_the_sparse_assignment_is_the_whole_one(seed, c):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 3000, (rng.integers(0, 60), 2)), rng.uniform(0, 3000, (rng.integers(0, 60), 2))
    cost = np.minimum(np.linalg.norm(x[:, None] - y[None, :], axis=2), c) ** 2
    rows, columns = linear_sum_assignment(cost)
    i, j, distance = match(x, y, c)
    assert len(set(i.tolist())) == len(set(j.tolist())) == len(i)
    assert (np.diff(i) > 0).all()
    np.testing.assert_array_equal(distance, np.linalg.norm(x[i] - y[j], axis=1))
    total = (distance**2).sum() + c**2 * (min(len(x), len(y)) - len(i))
    assert total == pytest.approx(cost[rows, columns].sum(), rel=1e-12)


def test_gospa_is_that_of_stone_soup():
    """50 random cases; Stone Soup sums in another order, so up to a few roundings."""
    metrics = pytest.importorskip("stonesoup.metricgenerator.ospametric")
    states = pytest.importorskip("stonesoup.types.state")
    generator = metrics.GOSPAMetric(c=1000.0, p=2.0)
    now, rng = datetime.datetime(2020, 1, 1), np.random.default_rng(7)
    for _ in range(50):
        x, y = (rng.uniform(0, 5000, (rng.integers(0, 25), 2)) for _ in range(2))
        if not len(x) + len(y):
            continue
        theirs = generator.compute_gospa_metric(
            *([states.State(row[:, None], timestamp=now) for row in rows] for rows in (y, x))
        )[0].value
        ours = gospa(x, y, c=1000.0)
        assert ours.value == pytest.approx(float(theirs["distance"]), rel=1e-12)
        assert ours.location == pytest.approx(float(theirs["localisation"]), rel=1e-12)
        assert (ours.missed, ours.false) == pytest.approx((float(theirs["missed"]), float(theirs["false"])))
