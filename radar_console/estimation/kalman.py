"""The Kalman filter [1, §5.2], one or many: every function broadcasts over leading axes.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
"""

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array, Gaussian, log_density


def predict(state: Gaussian, F: Array, Q: Array) -> Gaussian:
    """Propagate through x' = F x + w, w ~ N(0, Q)  [1, (5.2.3-2), (5.2.3-5)]."""
    return Gaussian(_apply(F, state.mean), F @ state.cov @ F.mT + Q)


def update(state: Gaussian, z: Array, H: Array, R: Array) -> tuple[Gaussian, Array]:
    """Condition on z = H x + v, v ~ N(0, R); also the log-likelihood of z.

    The covariance is in Joseph's form [1, (5.2.3-18)]: symmetric and positive definite.
    """
    nu = z - _apply(H, state.mean)
    S = H @ state.cov @ H.mT + R
    K = np.linalg.solve(S, H @ state.cov).mT
    A = np.eye(state.mean.shape[-1]) - K @ H
    cov = A @ state.cov @ A.mT + K @ R @ K.mT
    return Gaussian(state.mean + _apply(K, nu), cov), log_density(nu, S)


def _apply(matrix: Array, vector: Array) -> Array:
    result: Array = (matrix @ vector[..., None])[..., 0]
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def predict_in_place(x: Array, P: Array, T: float, q: float) -> None:
    """One track of nearly constant velocity, x (4,) and P (4, 4), over `T` s; see `motion`."""
    x[0] += T * x[2]
    x[1] += T * x[3]
    for i in range(4):  # F P
        P[0, i] += T * P[2, i]
        P[1, i] += T * P[3, i]
    for i in range(4):  # (F P) Fᵀ
        P[i, 0] += T * P[i, 2]
        P[i, 1] += T * P[i, 3]
    for p, v in ((0, 2), (1, 3)):
        P[p, p] += q * T * T * T / 3.0
        P[p, v] += q * T * T / 2.0
        P[v, p] = P[p, v]
        P[v, v] += q * T


@njit(cache=True, nogil=True, error_model="numpy")
def update_in_place(x: Array, P: Array, z: Array, R: Array, lag: Array, beta: Array) -> None:
    """Condition one track on alternative position measurements: the PDA update.

    Each alternative is a Kalman update of its own, at its own time and with its own noise; the
    mixture of them and of the prediction is matched by its first two moments.

    Parameters
    ----------
    x, P : (4,) and (4, 4), predicted; changed in place
    z, R : (m, 2) measured positions; (m, 3) their covariances ee, en, nn
    lag : (m,) time of the measurement less the time of x, s
    beta : (m,) probabilities; what is left to 1 belongs to the prediction

    Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, (3.4.2-9) generalised to
    measurements of different noise.
    """
    m = beta.size
    gain, shift, mean = np.empty((4, 2)), np.empty((m, 4)), np.zeros(4)
    reduction, prior = np.zeros((4, 4)), P
    for j in range(m):
        t = lag[j]
        # P Hᵀ, with H = [I, t I]
        for i in range(4):
            gain[i, 0] = prior[i, 0] + t * prior[i, 2]
            gain[i, 1] = prior[i, 1] + t * prior[i, 3]
        s_ee = gain[0, 0] + t * gain[2, 0] + R[j, 0]
        s_en = gain[0, 1] + t * gain[2, 1] + R[j, 1]
        s_nn = gain[1, 1] + t * gain[3, 1] + R[j, 2]
        det = s_ee * s_nn - s_en * s_en
        nu_e = z[j, 0] - x[0] - t * x[2]
        nu_n = z[j, 1] - x[1] - t * x[3]
        u_e = (s_nn * nu_e - s_en * nu_n) / det
        u_n = (s_ee * nu_n - s_en * nu_e) / det
        for i in range(4):
            shift[j, i] = gain[i, 0] * u_e + gain[i, 1] * u_n
            mean[i] += beta[j] * shift[j, i]
            k_e = (gain[i, 0] * s_nn - gain[i, 1] * s_en) / det
            k_n = (gain[i, 1] * s_ee - gain[i, 0] * s_en) / det
            for k in range(i + 1):
                reduction[i, k] += beta[j] * (k_e * gain[k, 0] + k_n * gain[k, 1])
    for i in range(4):
        for k in range(i + 1):
            spread = -mean[i] * mean[k]
            for j in range(m):
                spread += beta[j] * shift[j, i] * shift[j, k]
            P[i, k] += spread - reduction[i, k]
            P[k, i] = P[i, k]
    for i in range(4):
        x[i] += mean[i]


@njit(cache=True, nogil=True, error_model="numpy")
def condition_in_place(x: Array, P: Array, e: float, n: float, ee: float, en: float, nn: float) -> None:
    """Condition one track, x (4,) and P (4, 4), on its position: e, n with covariance ee, en, nn."""
    s_ee, s_en, s_nn = P[0, 0] + ee, P[0, 1] + en, P[1, 1] + nn
    det = s_ee * s_nn - s_en * s_en
    de, dn = e - x[0], n - x[1]
    p0, p1 = P[:, 0].copy(), P[:, 1].copy()
    for i in range(4):
        k0, k1 = (s_nn * p0[i] - s_en * p1[i]) / det, (s_ee * p1[i] - s_en * p0[i]) / det
        x[i] += k0 * de + k1 * dn
        for j in range(4):
            P[i, j] -= k0 * p0[j] + k1 * p1[j]
