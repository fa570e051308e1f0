"""Polar measurements as positions in the plane."""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from radar_console.estimation.gaussian import Array, Gaussian


def from_polar(
    distance: ArrayLike, azimuth: ArrayLike, sd_range: ArrayLike, sd_azimuth: ArrayLike
) -> Gaussian:
    """Convert ground range, m, and azimuth, rad clockwise from north, without bias.

    Parameters
    ----------
    distance, azimuth : (...)
    sd_range, sd_azimuth : (...)  standard deviations, m and rad

    Returns
    -------
    Gaussian    mean (..., 2) m, east and north; cov (..., 2, 2) m²

    Source: Longbin, Xiaoquan, Yizhou, Kang, Bar-Shalom, Unbiased converted measurements for
    tracking, IEEE T-AES 34(3), 1998, (the multiplicative correction); the covariance is its second
    order, in the axes along and across the line of sight.
    """
    r, a, s_r, s_a = np.broadcast_arrays(
        *(np.asarray(value, float) for value in (distance, azimuth, sd_range, sd_azimuth))
    )
    columns = [np.empty(r.shape) for _ in range(5)]
    _convert(r.ravel(), a.ravel(), s_r.ravel(), s_a.ravel(), *(column.reshape(-1) for column in columns))
    e, n, ee, en, nn = columns
    return Gaussian(
        np.stack([e, n], axis=-1), np.stack([np.stack([ee, en], -1), np.stack([en, nn], -1)], axis=-2)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def convert(
    r: float, a: float, sd_range: float, sd_azimuth: float
) -> tuple[float, float, float, float, float]:
    """One measurement: east, north and the covariance's ee, en, nn; see `from_polar`."""
    u_e, u_n = math.sin(a), math.cos(a)
    s2 = sd_azimuth * sd_azimuth
    along = sd_range * sd_range + 0.5 * r * r * s2 * s2
    across = (r * r + sd_range * sd_range) * s2
    m = r * math.exp(0.5 * s2)
    return (
        m * u_e,
        m * u_n,
        along * u_e * u_e + across * u_n * u_n,
        (along - across) * u_e * u_n,
        along * u_n * u_n + across * u_e * u_e,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _convert(
    r: Array, a: Array, s_r: Array, s_a: Array, e: Array, n: Array, ee: Array, en: Array, nn: Array
) -> None:
    for i in range(r.size):
        e[i], n[i], ee[i], en[i], nn[i] = convert(r[i], a[i], s_r[i], s_a[i])
