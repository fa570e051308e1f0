"""The stream of clusters equals the connected components of everything at once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from radar_console.core.messages import NO_PLOTS, PLOT, Table, blank
from radar_console.plots.clusters import StreamingClusters

Cut = tuple[tuple[int, ...], ...]


def table(places: list[tuple[int, int]]) -> Table:
    """Plots at (pulse, cell), numbered in the order given."""
    plots = blank(PLOT, len(places))
    plots["ordinal"] = np.arange(len(places))
    plots["pulse"], plots["cell"] = np.array(places, int).reshape(-1, 2).T
    plots["amplitude"] = 3.0
    return plots


def components(plots: Table, gap: int) -> set[frozenset[int]]:
    """The same by the plain definition: every pair is looked at."""
    pulse, cell = plots["pulse"], plots["cell"]
    near = (abs(pulse[:, None] - pulse) <= gap) & (abs(cell[:, None] - cell) <= 1)
    _, label = connected_components(coo_array(near), directed=False)
    return {frozenset(plots["ordinal"][label == k].tolist()) for k in np.unique(label)}


def streamed(plots: Table, gap: int, borders: list[int], longest: int = 10**6) -> list[tuple[bool, Cut]]:
    """Clusters of the plots given in sectors that end before the pulses `borders`."""
    clusters = StreamingClusters(8, gap, longest)
    result = []
    for begin, end in zip([0, *borders], borders, strict=False):
        sector = plots[(plots["pulse"] >= begin) & (plots["pulse"] < end)]
        result.append(clusters.push(sector, end))
        assert clusters.oldest <= end
    assert clusters.late == 0
    result.append(clusters.flush())
    return sorted(
        (bool(cut), tuple(sorted(c.plots["ordinal"][a:b].tolist())))
        for c in result
        for a, b, cut in zip(c.bounds, c.bounds[1:], c.cut, strict=False)
    )


places = st.lists(st.tuples(st.integers(0, 60), st.integers(0, 12)), max_size=120, unique=True)


@given(places, st.integers(1, 4), st.integers(1, 30))
@settings(max_examples=300)
def test_stream_equals_connected_components(places: list[tuple[int, int]], gap: int, step: int) -> None:
    plots = table(places)
    clusters = streamed(plots, gap, [*range(step, 61 + step, step)])
    assert {frozenset(members) for _, members in clusters} == components(plots, gap)
    assert sum(len(members) for _, members in clusters) == len(plots)
    assert not any(cut for cut, _ in clusters)


@pytest.mark.parametrize("pulses", [1, 25, 57, 450, 3600])
def test_noise_of_two_turns_in_sectors_of_any_size(pulses: int) -> None:
    rng = np.random.default_rng(1)
    hit = rng.random((3600, 16)) < 0.1
    plots = table([(int(p), int(c)) for p, c in np.argwhere(hit)])
    clusters = streamed(plots, 2, [*range(pulses, 3600 + pulses, pulses)])
    expected = components(plots, 2)
    assert {frozenset(members) for _, members in clusters} == expected
    assert max(map(len, expected)) > 10  # otherwise nothing was joined across a border


@given(places, st.integers(1, 3), st.integers(1, 30), st.integers(4, 12))
@settings(max_examples=200)
def test_long_clusters_are_cut_alike_in_any_sectors(
    places: list[tuple[int, int]], gap: int, step: int, longest: int
) -> None:
    plots = table(places)
    whole = streamed(plots, gap, [61], longest)
    assert streamed(plots, gap, [*range(step, 61 + step, step)], longest) == whole
    span = {members: np.ptp(plots["pulse"][list(members)]) + 1 for _, members in whole}
    assert all(pulses <= longest for pulses in span.values())
    merged = components(plots, gap)
    for cut, members in whole:
        assert cut == (frozenset(members) not in merged)


def test_a_cluster_closes_when_the_gap_has_passed() -> None:
    clusters = StreamingClusters(8, gap=2, longest=40)
    assert len(clusters.push(table([(10, 3)]), 11)) == 0
    assert clusters.oldest == 10
    assert len(clusters.push(NO_PLOTS, 12)) == 0  # pulse 12 could still join
    closed = clusters.push(NO_PLOTS, 13)
    assert closed.plots["pulse"].tolist() == [10]
    assert clusters.oldest == 13


def test_plots_come_in_any_order_within_a_sector_and_late_ones_are_counted() -> None:
    clusters = StreamingClusters(2, gap=2, longest=40)
    assert len(clusters.push(table([(5, 900), (4, 900), (3, 900)]), 6)) == 0  # beyond the cells announced
    closed = clusters.push(table([(4, 901), (6, 900)]), 30)
    assert closed.plots["pulse"].tolist() == [3, 4, 5, 6]
    assert clusters.late == 1


def test_small_clusters_are_dropped_and_counted() -> None:
    clusters = StreamingClusters(20, gap=2, longest=40, min_hits=2)
    clusters.push(table([(1, 3), (1, 9), (2, 9), (3, 10), (3, 15), (4, 15)]), 1)
    closed = clusters.flush()
    assert closed.bounds.tolist() == [0, 3, 5]
    assert closed.plots["ordinal"].tolist() == [1, 2, 3, 4, 5]
    assert clusters.too_small == 1


def test_impossible_values_are_refused() -> None:
    with pytest.raises(ValueError, match="range cell -1"):
        StreamingClusters(8, 2, 40).push(table([(1, -1)]), 2)
    with pytest.raises(ValueError, match="longest"):
        StreamingClusters(8, 2, 2)
