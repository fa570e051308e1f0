"""Motion models; the state of the plane is (east, north, v_east, v_north)."""

import numpy as np
from numpy.typing import ArrayLike

from radar_console.estimation.gaussian import Array


def constant_velocity(T: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
    """F and Q (..., 4, 4) of nearly constant velocity over `T` s, white acceleration `q` m²/s³.

    Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
    2001, (6.2.2-4) and (6.2.2-12).
    """
    T, q = np.broadcast_arrays(np.asarray(T, float), np.asarray(q, float))
    F = np.zeros((*T.shape, 4, 4))
    Q = np.zeros((*T.shape, 4, 4))
    for p, v in ((0, 2), (1, 3)):
        F[..., p, p] = F[..., v, v] = 1.0
        F[..., p, v] = T
        Q[..., p, p] = q * T**3 / 3
        Q[..., p, v] = Q[..., v, p] = q * T**2 / 2
        Q[..., v, v] = q * T
    return F, Q
