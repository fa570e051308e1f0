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


MIXTURE = (9, 4)
"""Shape of the room in which the alternatives of an update are added up; zero before the first."""


@njit(cache=True, nogil=True, error_model="numpy")
def add_alternative(
    x: Array, P: Array, e: float, n: float, ee: float, en: float, nn: float, lag: float, beta: float, A: Array
) -> None:
    """Add to `A` what a position of probability `beta` makes of one track, x (4,) and P (4, 4).

    Each alternative is a Kalman update of its own, at its own time and with its own noise. It moves the
    mean by P w, where w = Hᵀ S⁻¹ ν, and takes P Hᵀ S⁻¹ H P from the covariance. So the mixture of all, and
    of the prediction with what is left to 1, has the mean x + P w̄ and the covariance P - P M P, with
    M = Σ β (Hᵀ S⁻¹ H - w wᵀ) + w̄ w̄ᵀ. `A` holds w̄ and the sum in M; `mix_in_place` finishes.

    Parameters
    ----------
    e, n : measured position; ee, en, nn its covariance
    lag : s, its time less that of x
    A : MIXTURE

    Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, (3.4.2-9) generalised to
    measurements of different noise.
    """
    t = lag
    s_ee = P[0, 0] + 2.0 * t * P[0, 2] + t * t * P[2, 2] + ee
    s_en = P[0, 1] + t * (P[0, 3] + P[1, 2]) + t * t * P[2, 3] + en
    s_nn = P[1, 1] + 2.0 * t * P[1, 3] + t * t * P[3, 3] + nn
    det = s_ee * s_nn - s_en * s_en
    nu_e, nu_n = e - x[0] - t * x[2], n - x[1] - t * x[3]
    u_e, u_n = (s_nn * nu_e - s_en * nu_n) / det, (s_ee * nu_n - s_en * nu_e) / det
    m_ee, m_en, m_nn = s_nn / det - u_e * u_e, -s_en / det - u_e * u_n, s_ee / det - u_n * u_n
    for i in range(2):  # position and velocity
        b = beta * t if i else beta
        A[0, 2 * i] += b * u_e
        A[0, 2 * i + 1] += b * u_n
        for k in range(2):
            c = b * t if k else b
            A[1 + 2 * i, 2 * k] += c * m_ee
            A[1 + 2 * i, 2 * k + 1] += c * m_en
            A[2 + 2 * i, 2 * k] += c * m_en
            A[2 + 2 * i, 2 * k + 1] += c * m_nn


@njit(cache=True, nogil=True, error_model="numpy")
def mix_in_place(x: Array, P: Array, A: Array) -> None:
    """Make one track, x (4,) and P (4, 4), the mixture that was added up in `A`."""
    w, M, G = A[0], A[1:5], A[5:9]
    for i in range(4):
        for k in range(4):
            M[i, k] += w[i] * w[k]
    for i in range(4):  # P M
        for k in range(4):
            G[i, k] = P[i, 0] * M[0, k] + P[i, 1] * M[1, k] + P[i, 2] * M[2, k] + P[i, 3] * M[3, k]
    for i in range(4):
        x[i] += P[i, 0] * w[0] + P[i, 1] * w[1] + P[i, 2] * w[2] + P[i, 3] * w[3]
        for k in range(i + 1):
            M[i, k] = G[i, 0] * P[0, k] + G[i, 1] * P[1, k] + G[i, 2] * P[2, k] + G[i, 3] * P[3, k]
    for i in range(4):
        for k in range(i + 1):
            P[i, k] -= M[i, k]
            P[k, i] = P[i, k]


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
