"""The extended Kalman filter [1, §10.3]: models linearised about the mean.

With linear models it is the Kalman filter. Every function broadcasts over leading axes.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
"""

import numpy as np

from radar_console.estimation.gaussian import Array, Gaussian, apply, log_density
from radar_console.estimation.measurement import Sensing
from radar_console.estimation.motion import Motion


def predict(state: Gaussian, motion: Motion) -> Gaussian:
    """Propagate through x' = f(x) + w  [1, (10.3.2-4), (10.3.2-6)]."""
    F = motion.jacobian(state.mean)
    return Gaussian(motion.f(state.mean), F @ state.cov @ F.mT + motion.Q)


def innovation(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Array, Array]:
    """ν (..., m), what `z` (..., m) adds to the prediction, and its covariance S (..., m, m)."""
    H = sensing.jacobian(state.mean)
    return sensing.residual(z, sensing.h(state.mean)), H @ state.cov @ H.mT + sensing.R


def update(state: Gaussian, z: Array, sensing: Sensing) -> tuple[Gaussian, Array]:
    """Condition on z = h(x) + v; also the log-likelihood of z.

    The covariance is in Joseph's form [1, (5.2.3-18)]: symmetric and positive definite.
    """
    H = sensing.jacobian(state.mean)
    nu, S = innovation(state, z, sensing)
    K = np.linalg.solve(S, H @ state.cov).mT
    A = np.eye(state.mean.shape[-1]) - K @ H
    cov = A @ state.cov @ A.mT + K @ sensing.R @ K.mT
    return Gaussian(state.mean + apply(K, nu), cov), log_density(nu, S)
