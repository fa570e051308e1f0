"""A plot against one Gaussian mode: innovation, its covariance, and how it correlates with the state.

Whatever the filter, a plot becomes ν (m,), Y = cov of the predicted measurement (m, m), the noise R
(m,) or (2, 2) and C = cov(x, z) (n, m); then S = Y + R, and the update is x + C S⁻¹ ν, P - C S⁻¹ Cᵀ.
m is 2, or 3 with Doppler; arrays have room for 3.

[1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker import gating, modes
from radar_console.tracker.records import EXTENDED, UNSCENTED

_wrap, _sigma_points = gating.wrap, modes.sigma_points
_CLOSE = 5.0  # sigmas: nearer to the sensor than this, the bearing is no Gaussian, nor is the Doppler
_SD_DOPPLER = 2.0  # m/s, of a Doppler that does not say
_LEAST = 1e-12  # m² and rad²: variances of an innovation are at least this
_LOG_TURN = math.log(2.0 * math.pi)


@njit(cache=True, nogil=True, error_model="numpy")
def measure(
    x: Array, P: Array, plot: Any, lag: float, par: Any, nu: Array, Y: Array, R: Array, C: Array
) -> tuple[int, float]:
    """Fill nu (3,), Y (3, 3), R (3, 3), C (n, 3) for a plot `lag` s after the mode's time.

    EXTENDED and UNSCENTED measure range and azimuth, the others the converted position; so do these
    where the target is within 5 sigmas of the sensor. Doppler is the third component where it is
    known and used, of a sensor that stands still; it is linearised at the prediction except for UNSCENTED.

    Returns
    -------
    m, and what turns the log-density of ν into one per m² of position; per m/s too where a Doppler is
    known and used by `par`. Within those 5 sigmas any Doppler up to max_speed is equally likely.
    """
    y_e, y_n = x[0] + lag * x[2] - plot.s_e, x[1] + lag * x[3] - plot.s_n
    for i in range(x.size):  # with the position at the plot's time
        C[i, 0] = P[i, 0] + lag * P[i, 2]
        C[i, 1] = P[i, 1] + lag * P[i, 3]
    spread = C[0, 0] + lag * C[2, 0] + C[1, 1] + lag * C[3, 1]
    far = y_e * y_e + y_n * y_n > _CLOSE * _CLOSE * spread and plot.range > _CLOSE * plot.sd_range
    m, factor = 2, 0.0
    if par.use_doppler and math.isfinite(plot.doppler):
        if far:
            m = 3
        else:
            factor = -math.log(2.0 * par.max_speed)
    if m == 3:
        sd = plot.sd_doppler if plot.sd_doppler > 0.0 else _SD_DOPPLER
        R[2, 2] = sd * sd
        R[0, 2] = R[1, 2] = R[2, 0] = R[2, 1] = 0.0
        if par.filter != UNSCENTED:
            R[2, 2] += _curvature(x, P, spread, y_e * y_e + y_n * y_n)
    if far and par.filter in (EXTENDED, UNSCENTED):
        R[0, 0], R[1, 1] = plot.sd_range * plot.sd_range, plot.sd_azimuth * plot.sd_azimuth
        R[0, 1] = R[1, 0] = 0.0
        factor -= math.log(plot.range)  # m² for m rad
        if par.filter == UNSCENTED:
            _unscented(x, P, plot, lag, m, nu, Y, C)
        else:
            _linearised(x, P, plot, lag, y_e, y_n, m, True, nu, Y, C)
    else:
        R[0, 0], R[0, 1], R[1, 0], R[1, 1] = plot.ee, plot.en, plot.en, plot.nn
        _linearised(x, P, plot, lag, y_e, y_n, m, False, nu, Y, C)
    return m, factor


@njit(cache=True, nogil=True, error_model="numpy")
def _curvature(x: Array, P: Array, spread: float, r2: float) -> float:
    """Bound on the variance of what the Doppler's linearisation leaves out [1, (10.3.2-14)], m²/s²."""
    speed2, speeds = x[2] * x[2] + x[3] * x[3], P[2, 2] + P[3, 3]
    variance: float = spread * (speeds + speed2 * spread / r2) / r2
    return variance


@njit(cache=True, nogil=True, error_model="numpy")
def _linearised(
    x: Array, P: Array, plot: Any, lag: float, y_e: float, y_n: float, m: int, polar: bool,
    nu: Array, Y: Array, C: Array,
) -> None:  # fmt: skip
    """Through the measurement's Jacobian at the prediction; C holds cov(x, position) on entry."""
    r = math.hypot(y_e, y_n)
    H = np.zeros((3, 4))
    if m == 3:  # ṙ = v · u, whose direction u turns with the position
        u_e, u_n = y_e / r, y_n / r
        rate = u_e * x[2] + u_n * x[3]
        H[2, 0], H[2, 1] = (x[2] - rate * u_e) / r, (x[3] - rate * u_n) / r
        H[2, 2], H[2, 3] = u_e + lag * H[2, 0], u_n + lag * H[2, 1]
        nu[2] = plot.doppler - rate
        for i in range(x.size):
            C[i, 2] = H[2, 0] * P[i, 0] + H[2, 1] * P[i, 1] + H[2, 2] * P[i, 2] + H[2, 3] * P[i, 3]
    d_e, d_n = plot.e - plot.s_e, plot.n - plot.s_n
    if polar:
        nu[0], nu[1] = plot.range - r, _wrap(math.atan2(d_e, d_n) - math.atan2(y_e, y_n))
        H[0, 0], H[0, 1], H[1, 0], H[1, 1] = y_e / r, y_n / r, y_n / (r * r), -y_e / (r * r)
        for i in range(x.size):
            c_e, c_n = C[i, 0], C[i, 1]
            C[i, 0], C[i, 1] = H[0, 0] * c_e + H[0, 1] * c_n, H[1, 0] * c_e + H[1, 1] * c_n
    else:
        nu[0], nu[1] = d_e - y_e, d_n - y_n
        H[0, 0] = H[1, 1] = 1.0
    for a in range(2):
        H[a, 2], H[a, 3] = lag * H[a, 0], lag * H[a, 1]
    for a in range(m):
        for b in range(a + 1):
            Y[a, b] = H[a, 0] * C[0, b] + H[a, 1] * C[1, b] + H[a, 2] * C[2, b] + H[a, 3] * C[3, b]
            Y[b, a] = Y[a, b]


@njit(cache=True, nogil=True, error_model="numpy")
def _unscented(x: Array, P: Array, plot: Any, lag: float, m: int, nu: Array, Y: Array, C: Array) -> None:
    """Through 2n sigma points of equal weight [1 has the EKF; Julier, Uhlmann, Proc. IEEE 92(3), 2004]."""
    n = x.size
    points, z = np.empty((2 * n, n)), np.empty((2 * n, 3))
    _sigma_points(x, P, points)
    d_e, d_n = plot.e - plot.s_e, plot.n - plot.s_n
    measured = math.atan2(d_e, d_n)
    mean = np.zeros(3)
    for k in range(2 * n):
        p = points[k]
        e, n_ = p[0] + lag * p[2] - plot.s_e, p[1] + lag * p[3] - plot.s_n
        z[k, 0] = math.hypot(e, n_)
        z[k, 1] = _wrap(math.atan2(e, n_) - measured)
        z[k, 2] = (e * p[2] + n_ * p[3]) / max(z[k, 0], 1.0)
        # Azimuths near the first one's, so that their mean is one of angles.
        z[k, 1] = z[0, 1] + _wrap(z[k, 1] - z[0, 1])
        for a in range(m):
            mean[a] += z[k, a] / (2 * n)
    nu[0], nu[1] = plot.range - mean[0], _wrap(-mean[1])
    if m == 3:
        nu[2] = plot.doppler - mean[2]
    for a in range(m):
        for b in range(a + 1):
            total = 0.0
            for k in range(2 * n):
                total += (z[k, a] - mean[a]) * (z[k, b] - mean[b])
            Y[a, b] = total / (2 * n)
            Y[b, a] = Y[a, b]
        for i in range(n):
            total = 0.0
            for k in range(2 * n):
                total += (points[k, i] - x[i]) * (z[k, a] - mean[a])
            C[i, a] = total / (2 * n)


@njit(cache=True, nogil=True, error_model="numpy")
def invert(Y: Array, R: Array, scale: float, m: int, W: Array) -> float:
    """Fill W (3, 3) with (Y + scale R)⁻¹ of its first m rows; the log-determinant of Y + scale R."""
    # 1e-12 more than claimed keeps a singular sum invertible.
    a = max((Y[0, 0] + scale * R[0, 0]) * (1.0 + _LEAST), _LEAST)
    b = Y[0, 1] + scale * R[0, 1]
    c = max((Y[1, 1] + scale * R[1, 1]) * (1.0 + _LEAST), _LEAST)
    det = max(a * c - b * b, _LEAST * a * c)
    W[0, 0], W[0, 1], W[1, 0], W[1, 1] = c / det, -b / det, -b / det, a / det
    if m == 2:
        return math.log(det)
    # The third one given the first two.
    u = Y[2, 0] + scale * R[2, 0]
    v = Y[2, 1] + scale * R[2, 1]
    f, g = W[0, 0] * u + W[0, 1] * v, W[1, 0] * u + W[1, 1] * v
    s = max(Y[2, 2] + scale * R[2, 2] - u * f - v * g, _LEAST)
    W[0, 0] += f * f / s
    W[0, 1] += f * g / s
    W[1, 0] = W[0, 1]
    W[1, 1] += g * g / s
    W[0, 2] = W[2, 0] = -f / s
    W[1, 2] = W[2, 1] = -g / s
    W[2, 2] = 1.0 / s
    return math.log(det) + math.log(s)


@njit(cache=True, nogil=True, error_model="numpy")
def log_density(nu: Array, W: Array, log_det: float, m: int, u: Array) -> float:
    """log N(ν; 0, S) from W = S⁻¹; fills u (3,) with W ν."""
    d2 = 0.0
    for a in range(m):
        u[a] = 0.0
        for b in range(m):
            u[a] += W[a, b] * nu[b]
        d2 += nu[a] * u[a]
    return -0.5 * (d2 + log_det + m * _LOG_TURN)


__all__ = ["invert", "log_density", "measure"]
