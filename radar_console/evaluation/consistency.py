"""Whether a filter's errors are as large as it claims [1, §5.4].

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.floating]


def nees(truth: Array, mean: Array, cov: Array) -> Array:
    """Normalised estimation error squared (...); `truth`, `mean` (..., n), `cov` (..., n, n)  [1, (5.4.2-1)].

    For a consistent filter it is n on average.
    """
    return _normalised(truth - mean, cov)


def nis(nu: Array, S: Array) -> Array:
    """Normalised innovation squared (...); `nu` (..., m), `S` (..., m, m)  [1, (5.4.2-2)].

    For a consistent filter it is m on average.
    """
    return _normalised(nu, S)


def chi_square_band(runs: int, dimension: int, confidence: float = 0.95) -> tuple[float, float]:
    """Where the mean over independent runs of NEES or NIS lies with this probability  [1, (5.4.2-6)]."""
    tail = 0.5 * (1.0 - confidence)
    whole = chi2(runs * dimension)
    return float(whole.ppf(tail)) / runs, float(whole.ppf(1.0 - tail)) / runs


def _normalised(error: Array, cov: Array) -> Array:
    result: Array = np.sum(error * np.linalg.solve(cov, error[..., None])[..., 0], axis=-1)
    return result
