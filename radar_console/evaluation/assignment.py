"""The cheapest one-to-one assignment between two sets of points, up to a cut-off distance.

Pairs at the cut-off or beyond are no pairs. Only the nearer ones, found with a tree, go into the
assignment, which is sparse: points that no chain of near pairs links never meet in it.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
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
    n, m = len(first), len(second)
    if not len(i):
        return i, j, distance
    # Each point of the first set may also take a place of its own, at the price of the cut-off.
    # Prices are relative to that, so that no power overflows, and not 0, which a sparse array drops.
    price = np.concatenate([np.maximum((distance / c) ** p, np.finfo(float).tiny), np.ones(n)])
    own = np.arange(n)
    graph = csr_array((price, (np.append(i, own), np.append(j, m + own))), shape=(n, m + n))
    row, column = min_weight_full_bipartite_matching(graph)
    i, j = (np.asarray(found[column < m], np.intp) for found in (row, column))
    return i, j, np.linalg.norm(first[i] - second[j], axis=1)


def _near(first: Array, second: Array, c: float) -> tuple[Index, Index, Array]:
    """All pairs nearer than `c`: rows of either set, and distances."""
    if not len(first) or not len(second):
        return np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0)
    found = KDTree(first).sparse_distance_matrix(KDTree(second), c, output_type="ndarray")
    i, j = found["i"], found["j"]
    distance = np.linalg.norm(first[i] - second[j], axis=1)
    inside = distance < c
    return i[inside], j[inside], distance[inside]
