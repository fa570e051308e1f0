"""Root mean squared errors, whole and by component [1].

[1] Li, Zhao, Evaluation of estimation algorithms, part I: incomprehensive measures of performance,
    IEEE Transactions on Aerospace and Electronic Systems 42 (4), 2006.
"""

from typing import NamedTuple

import numpy as np

from radar_console.estimation.gaussian import Array


class Rmse(NamedTuple):
    """√(mean |e|²) and its components: value² is the sum of their squares.

    Attributes
    ----------
    value : (...), in the unit of the errors
    components : (..., d)
    """

    value: Array
    components: Array


def rmse(truth: Array, estimate: Array) -> Rmse:
    """RMSE over the second last axis; `truth`, `estimate` (..., n, d), NaN of no pairs at all.

    With the runs on that axis it is the error at each instant, over the runs; with runs and instants both on
    it, one figure for all.

    Example: errors of (3, 0) and (0, 4) m have components √(9/2) and √(16/2) m, and together √(25/2) m.
    """
    square = np.square(np.asarray(truth, float) - np.asarray(estimate, float))
    if not square.shape[-2]:
        components = np.full((*square.shape[:-2], square.shape[-1]), np.nan)
        return Rmse(components.sum(axis=-1), components)
    mean = square.mean(axis=-2)
    return Rmse(np.sqrt(mean.sum(axis=-1)), np.sqrt(mean))
