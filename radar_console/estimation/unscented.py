"""The unscented Kalman filter [1]: the density is carried through the models by 2n + 1 points.

The points are the first axis of their array, so that the models broadcast over them as over any other; a
state needs all the leading axes that its models have. Their
scaling keeps them one standard deviation times √n from the mean and all weights positive: covariances
stay positive too, and nothing is lost by cancellation. Differences of measurements are taken from the
central point's and wrapped there, so azimuths may lie on either side of north.

[1] Julier, Uhlmann, Unscented filtering and nonlinear estimation, Proc. IEEE 92(3), 2004; scaled as in
    Van der Merwe, Sigma-point Kalman filters, 2004, with α = 1, β = 2, κ = 0.
"""

from functools import lru_cache

import numpy as np

from radar_console.estimation.gaussian import Array, Gaussian, apply, log_density, root
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion

ALPHA, BETA, KAPPA = 1.0, 2.0, 0.0


@lru_cache
def weights(n: int) -> tuple[Array, Array]:
    """Weights (2n + 1,) of the points for the mean, and for the covariance."""
    # Imported here: it takes half a second, and the console starts without it.
    from filterpy.kalman import MerweScaledSigmaPoints

    points = MerweScaledSigmaPoints(n, ALPHA, BETA, KAPPA)
    return np.asarray(points.Wm), np.asarray(points.Wc)


def sigma_points(state: Gaussian) -> Array:
    """The points (2n + 1, ..., n): the mean, then one to either side along each column of a root of P."""
    n = state.mean.shape[-1]
    spread = np.moveaxis(ALPHA * np.sqrt(n + KAPPA) * root(state.cov), -1, 0)
    return np.concatenate([state.mean[None], state.mean + spread, state.mean - spread])


def predict(state: Gaussian, motion: Motion) -> Gaussian:
    """Propagate through x' = f(x) + w."""
    moved = motion.f(sigma_points(state))
    mean_weights, cov_weights = weights(state.mean.shape[-1])
    shift = moved - moved[0]
    mean = np.tensordot(mean_weights, shift, 1)
    shift = shift - mean
    return Gaussian(moved[0] + mean, _product(cov_weights, shift, shift) + motion.Q)


def innovation(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Array, Array]:
    """ν (..., m), what `z` (..., m) adds to the prediction, and its covariance S (..., m, m)."""
    nu, S, _ = _innovation(state, z, sensing)
    return nu, S


def update(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Gaussian, Array]:
    """Condition on z = h(x) + v; also the log-likelihood of z."""
    nu, S, cross = _innovation(state, z, sensing)
    K = np.linalg.solve(S, cross.mT).mT
    cov = state.cov - K @ S @ K.mT
    return Gaussian(state.mean + apply(K, nu), 0.5 * (cov + cov.mT)), log_density(nu, S)


def _innovation(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Array, Array, Array]:
    """ν, S, and the covariance (..., n, m) of state and measurement."""
    points = sigma_points(state)
    seen = sensing.h(points)
    mean_weights, cov_weights = weights(state.mean.shape[-1])
    shift = sensing.residual(seen, seen[0])
    mean = np.tensordot(mean_weights, shift, 1)
    shift = shift - mean
    S = _product(cov_weights, shift, shift) + sensing.R
    cross = _product(cov_weights, points - state.mean, shift)
    return sensing.residual(z, seen[0] + mean), S, cross


def _product(weights: Array, a: Array, b: Array) -> Array:
    """Σ w a bᵀ over the points: (..., n, m)."""
    result: Array = np.einsum("k,k...i,k...j->...ij", weights, a, b)
    return result
