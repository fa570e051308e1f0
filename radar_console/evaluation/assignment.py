"""The cheapest one-to-one assignment between two sets of points, up to a cut-off distance.

Pairs at the cut-off or beyond are no pairs, so only points that are linked by nearer pairs compete:
each connected component of those is solved by itself, and most have one point on either side.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from radar_console.estimation.gaussian import Array

Index = NDArray[np.intp]


def points(values: ArrayLike, name: str) -> Array:
    """A set of points as a float array (n, d); an empty one of any shape is (0, 0).

    Raises
    ------
    ValueError         not two-dimensional, or a coordinate is no number
    """
    array = np.asarray(values, float)
    if array.size == 0:
        return np.empty((0, 0))
    if array.ndim != 2:
        raise ValueError(f"{name} must be (n, d), not {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has a coordinate that is no number")
    return array


def match(first: Array, second: Array, c: float, p: float = 2.0) -> tuple[Index, Index, Array]:
    """The one-to-one pairs, nearer than `c`, that minimise Σ min(d, c)^p over all assignments.

    Parameters
    ----------
    first : (n, d) m
    second : (m, d) m
    c : cut-off distance, m
    p : exponent, ≥ 1

    Returns
    -------
    (pairs,) rows of `first`, in rising order, (pairs,) rows of `second`, and (pairs,) distances, m
    """
    i, j, distance = _near(first, second, c)
    label = _components(i, j, len(first), len(second))
    order = np.argsort(label, kind="stable")
    i, j, distance, label = i[order], j[order], distance[order], label[order]
    lone = np.bincount(label)[label] == 1
    edges = np.flatnonzero(~lone)
    starts = np.flatnonzero(np.diff(label[edges]) != 0) + 1
    parts = np.split(edges, starts) if len(edges) else []
    solved = [part[_cheapest(i[part], j[part], distance[part], c, p)] for part in parts]
    pairs = np.concatenate([np.flatnonzero(lone), *solved])
    pairs = pairs[np.argsort(i[pairs])]
    return i[pairs], j[pairs], distance[pairs]


def _near(first: Array, second: Array, c: float) -> tuple[Index, Index, Array]:
    """All pairs nearer than `c`: rows of either set, and distances."""
    if not len(first) or not len(second):
        return np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0)
    found = KDTree(first).sparse_distance_matrix(KDTree(second), c, output_type="ndarray")
    i, j = found["i"], found["j"]
    distance = np.linalg.norm(first[i] - second[j], axis=1)
    inside = distance < c
    return i[inside], j[inside], distance[inside]


def _components(i: Index, j: Index, n: int, m: int) -> NDArray[np.int32]:
    """Of each pair, the number of the connected component that it belongs to."""
    graph = coo_array((np.ones(len(i)), (i, n + j)), shape=(n + m, n + m))
    label: NDArray[np.int32] = connected_components(graph, directed=False)[1]
    return label[i]


def _cheapest(i: Index, j: Index, distance: Array, c: float, p: float) -> Index:
    """Which of a component's pairs are assigned."""
    rows, row = np.unique(i, return_inverse=True)
    columns, column = np.unique(j, return_inverse=True)
    cost, pair = np.ones((len(rows), len(columns))), np.full((len(rows), len(columns)), -1)
    cost[row, column] = (distance / c) ** p  # relative to the cut-off: no power overflows
    pair[row, column] = np.arange(len(i))
    solved = pair[linear_sum_assignment(cost)]
    assigned: Index = solved[solved >= 0]
    return assigned
