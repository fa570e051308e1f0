"""Gaussian densities, one or many: every function broadcasts over leading axes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Gaussian:
    """A Gaussian density, or a stack of them.

    Attributes
    ----------
    mean : (..., n)
    cov : (..., n, n)
    """

    mean: Array
    cov: Array

    def __getitem__(self, index: Any) -> "Gaussian":
        return Gaussian(self.mean[index], self.cov[index])


def collapse(weights: Array, parts: Gaussian) -> Gaussian:
    """Moment-match a mixture, `weights` (..., m) and `parts` (..., m, n), to one Gaussian."""
    mean = np.einsum("...m,...mi->...i", weights, parts.mean)
    spread = parts.mean - mean[..., None, :]
    cov = np.einsum("...m,...mij->...ij", weights, parts.cov)
    return Gaussian(mean, cov + np.einsum("...m,...mi,...mj->...ij", weights, spread, spread))


def log_density(nu: Array, S: Array) -> Array:
    """Log of N(nu; 0, S), `nu` (..., m) and `S` (..., m, m)."""
    d2 = np.sum(nu * np.linalg.solve(S, nu[..., None])[..., 0], axis=-1)
    log_density: Array = -0.5 * (d2 + np.linalg.slogdet(2 * np.pi * S).logabsdet)
    return log_density


def apply(matrix: Array, vector: Array) -> Array:
    """`matrix` (..., m, n) times `vector` (..., n), both with leading axes that broadcast: (..., m)."""
    result: Array = vector @ matrix.T if matrix.ndim == 2 else (matrix @ vector[..., None])[..., 0]
    return result


def root(cov: Array) -> Array:
    """A matrix L (..., n, n) with L Lᵀ = `cov`, also where `cov` is singular or nearly so.

    It is Cholesky's factor where there is one, else the symmetric root of the nearest matrix without
    negative eigenvalues. Each member of a stack is treated as if it were alone.
    """
    try:
        return np.linalg.cholesky(cov)
    except np.linalg.LinAlgError:
        if cov.ndim > 2:
            return np.stack([root(part) for part in cov])
    values, vectors = np.linalg.eigh(cov)
    result: Array = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return result
