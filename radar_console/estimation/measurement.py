"""Measurements: converted to positions without bias, or as models z = h(x) + v of the state.

States are those of `motion`: positions, velocities, and what is the model's own. The sensor may move; its
position and velocity are arguments. Azimuth is clockwise from north, range is slant range where the
state has height.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from radar_console.core.geometry import wrap
from radar_console.estimation.gaussian import Array, Gaussian

Quantity = Literal["range", "azimuth", "elevation", "doppler"]

_NEAREST = 1.0  # m: within it, directions are no sharper than here; derivatives stay finite at range 0


@dataclass(frozen=True, slots=True, eq=False)
class Sensing:
    """A measurement model z = h(x) + v, v ~ N(0, R); its leading axes broadcast with those of the states.

    Attributes
    ----------
    h : (..., n) to (..., m)
    jacobian : of h, (..., n) to (..., m, n)
    residual : of z and a prediction, (..., m) each, what z has more; angles are wrapped
    R : (..., m, m), positive definite
    linear : h(x) is a matrix times x
    """

    h: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    residual: Callable[[Array, Array], Array]
    R: Array
    linear: bool = False


def position(R: Array, sensor: ArrayLike = 0.0) -> Sensing:
    """The position itself, less the sensor's: what `from_polar` and `from_spherical` give.

    Parameters
    ----------
    R : (..., d, d)      m²
    sensor : (..., d)    position of the sensor, m
    """
    d, origin = R.shape[-1], np.asarray(sensor, float)
    return Sensing(
        lambda x: x[..., :d] - origin, lambda x: np.eye(d, x.shape[-1]), np.subtract, R, linear=True
    )


def polar(
    sd: ArrayLike,
    quantities: Sequence[Quantity] = ("range", "azimuth"),
    sensor: ArrayLike = (0.0, 0.0),
    velocity: ArrayLike = 0.0,
) -> Sensing:
    """What a radar measures of a target: any of range, m, azimuth and elevation, rad, range rate, m/s.

    Parameters
    ----------
    sd : (..., m)          standard deviations of the quantities; their errors are independent
    quantities :           in the order of z; ("doppler",) follows an update by position
    sensor : (..., d)      position of the sensor, m; its length, 2 or 3, is the number of axes
    velocity : (..., d)    velocity of the sensor, m/s

    Raises
    ------
    ValueError             elevation asked for in the plane

    Source: Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, §1.7.
    """
    place, speed = np.asarray(sensor, float), np.asarray(velocity, float)
    d = place.shape[-1]
    if d == 2 and "elevation" in quantities:
        raise ValueError("elevation needs three axes; expected sensor=(east, north, up)")
    circular = np.array([quantity == "azimuth" for quantity in quantities])
    variances = np.asarray(sd, float) ** 2
    R = variances[..., None] * np.eye(len(quantities))

    def relative(x: Array) -> tuple[Array, Array]:
        return x[..., :d] - place, x[..., d : 2 * d] - speed

    def h(x: Array) -> Array:
        p, v = relative(x)
        return np.stack([_VALUE[quantity](p, v) for quantity in quantities], axis=-1)

    def jacobian(x: Array) -> Array:
        p, v = relative(x)
        H = np.zeros((*np.broadcast_shapes(p.shape, v.shape)[:-1], len(quantities), x.shape[-1]))
        for row, quantity in enumerate(quantities):
            by_position, by_velocity = _GRADIENT[quantity](p, v)
            H[..., row, :d] = by_position
            H[..., row, d : 2 * d] = by_velocity
        return H

    def residual(z: Array, predicted: Array) -> Array:
        difference = z - predicted
        return np.where(circular, wrap(difference), difference)

    return Sensing(h, jacobian, residual, R)


def _norm(p: Array) -> Array:
    return np.sqrt(_dot(p, p))


def _dot(p: Array, v: Array) -> Array:
    result: Array = np.einsum("...i,...i->...", p, v)
    return result


def _range_rate(p: Array, v: Array) -> Array:
    return _dot(p, v) / np.maximum(_norm(p), _NEAREST)


def _range_gradient(p: Array, v: Array) -> tuple[Array, Array]:
    return p / np.maximum(_norm(p), _NEAREST)[..., None], np.zeros_like(p)


def _azimuth_gradient(p: Array, v: Array) -> tuple[Array, Array]:
    ground2 = np.maximum(p[..., 0] ** 2 + p[..., 1] ** 2, _NEAREST**2)
    gradient = np.zeros_like(p)
    gradient[..., 0], gradient[..., 1] = p[..., 1] / ground2, -p[..., 0] / ground2
    return gradient, np.zeros_like(p)


def _elevation_gradient(p: Array, v: Array) -> tuple[Array, Array]:
    ground = np.maximum(np.hypot(p[..., 0], p[..., 1]), _NEAREST)
    r2 = ground**2 + p[..., 2] ** 2
    along = -p[..., 2] / (r2 * ground)
    return np.stack([along * p[..., 0], along * p[..., 1], ground / r2], axis=-1), np.zeros_like(p)


def _doppler_gradient(p: Array, v: Array) -> tuple[Array, Array]:
    r = np.maximum(_norm(p), _NEAREST)[..., None]
    u = p / r
    return (v - u * _dot(u, v)[..., None]) / r, u * np.ones_like(v)


_Value = Callable[[Array, Array], Array]
_VALUE: dict[Quantity, _Value] = {
    "range": lambda p, v: _norm(p),
    "azimuth": lambda p, v: np.arctan2(p[..., 0], p[..., 1]),
    "elevation": lambda p, v: np.arctan2(p[..., 2], np.hypot(p[..., 0], p[..., 1])),
    "doppler": _range_rate,
}
_Gradient = Callable[[Array, Array], tuple[Array, Array]]
_GRADIENT: dict[Quantity, _Gradient] = {
    "range": _range_gradient,
    "azimuth": _azimuth_gradient,
    "elevation": _elevation_gradient,
    "doppler": _doppler_gradient,
}


def from_spherical(
    distance: ArrayLike,
    azimuth: ArrayLike,
    elevation: ArrayLike,
    sd_range: ArrayLike,
    sd_azimuth: ArrayLike,
    sd_elevation: ArrayLike,
) -> Gaussian:
    """Convert slant range, m, azimuth, rad clockwise from north, and elevation, rad, without bias.

    Parameters
    ----------
    distance, azimuth, elevation : (...)
    sd_range, sd_azimuth, sd_elevation : (...)  standard deviations, m, rad, rad

    Returns
    -------
    Gaussian    mean (..., 3) m, east, north and up; cov (..., 3, 3) m²

    Source: Longbin et al. 1998 as in `from_polar`, in space (the multiplicative correction); the
    covariance is its second order, in the axes along, across and above the line of sight.
    """
    r, a, el, s_r, s_a, s_el = np.broadcast_arrays(
        *(
            np.asarray(each, float)
            for each in (distance, azimuth, elevation, sd_range, sd_azimuth, sd_elevation)
        )
    )
    sin, cos, var_a, var_el = np.sin(el), np.cos(el), s_a**2, s_el**2
    flat, east, north = np.zeros_like(r), np.sin(a), np.cos(a)
    level = r * cos * np.exp(0.5 * (var_a + var_el))
    mean = np.stack([level * east, level * north, r * sin * np.exp(0.5 * var_el)], axis=-1)
    # A square of the azimuth's error moves the point inward, level: along and below the line of sight.
    inward = 0.5 * (r * cos * var_a) ** 2
    second = r**2 + s_r**2
    local = np.zeros((*r.shape, 3, 3))
    local[..., 0, 0] = s_r**2 + 0.5 * (r * var_el) ** 2 + inward * cos**2
    local[..., 1, 1] = second * var_a * (cos**2 + var_el * sin**2)
    local[..., 2, 2] = second * var_el + inward * sin**2
    local[..., 0, 2] = local[..., 2, 0] = -inward * sin * cos
    axes = np.stack(
        [
            np.stack([cos * east, cos * north, sin], axis=-1),
            np.stack([north, -east, flat], axis=-1),
            np.stack([-sin * east, -sin * north, cos], axis=-1),
        ],
        axis=-1,
    )
    return Gaussian(mean, axes @ local @ axes.mT)


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
