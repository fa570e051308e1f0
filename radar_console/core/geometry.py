"""Where things are: polar, local east-north-up, WGS84, slant range and height.

The local frame is the azimuthal equidistant plane about its site: a point's distance and bearing
from the site are true, so ground range and azimuth of a radar at the site need no correction.
"""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS, Transformer

from radar_console.core.messages import Site
from radar_console.core.units import TURN

Array = NDArray[np.floating]

# With the mean radius, ground ranges to 460 km are within 1 m of the ellipsoid's, at any latitude.
MEAN_RADIUS = 6371008.8


def wrap(angle: ArrayLike) -> Array:
    """The same angle in (−π, π]."""
    a = np.asarray(angle, float)
    return a - TURN * np.ceil(a / TURN - 0.5)


def unwrap_near(azimuth: ArrayLike, beam: ArrayLike) -> Array:
    """The unwrapped angle of `azimuth` that is nearest to the unwrapped `beam`."""
    b = np.asarray(beam, float)
    return b + wrap(np.asarray(azimuth, float) - b)


def to_cartesian(distance: ArrayLike, azimuth: ArrayLike) -> tuple[Array, Array]:
    """East and north, m, of ground range, m, and azimuth, rad clockwise from north."""
    r, a = np.asarray(distance, float), np.asarray(azimuth, float)
    return r * np.sin(a), r * np.cos(a)


def to_polar(east: ArrayLike, north: ArrayLike) -> tuple[Array, Array]:
    """Ground range, m, and azimuth in [0, 2π), rad."""
    e, n = np.asarray(east, float), np.asarray(north, float)
    azimuth = np.mod(np.arctan2(e, n), TURN)
    return np.hypot(e, n), np.where(azimuth >= TURN, 0.0, azimuth)


def to_spherical(east: ArrayLike, north: ArrayLike, up: ArrayLike) -> tuple[Array, Array, Array]:
    """Slant range, azimuth and elevation of a flat local offset, m to m, rad, rad."""
    ground, azimuth = to_polar(east, north)
    height = np.asarray(up, float)
    return np.hypot(ground, height), azimuth, np.arctan2(height, ground)


def from_spherical(
    distance: ArrayLike, azimuth: ArrayLike, elevation: ArrayLike
) -> tuple[Array, Array, Array]:
    """East, north and up of a flat local offset; the inverse of `to_spherical`."""
    r, el = np.asarray(distance, float), np.asarray(elevation, float)
    east, north = to_cartesian(r * np.cos(el), azimuth)
    return east, north, r * np.sin(el)


def ground_range(slant: ArrayLike, height: ArrayLike, sensor_height: ArrayLike = 0.0) -> Array:
    """Distance along the sphere, m, below a target at slant range and height, m.

    Where the height is NaN (a two-dimensional world) the ground range is the slant range. A slant
    range shorter than the difference of heights is a target overhead, at ground range 0.

    Source: the law of cosines on a sphere of `MEAN_RADIUS`, in its half-angle form.
    """
    s, h, h0 = (np.asarray(value, float) for value in (slant, height, sensor_height))
    a, b = MEAN_RADIUS + h0, MEAN_RADIUS + h
    half_chord_2 = np.maximum(s**2 - (h - h0) ** 2, 0.0) / (4.0 * a * b)
    arc = 2.0 * MEAN_RADIUS * np.arcsin(np.sqrt(np.minimum(half_chord_2, 1.0)))
    return np.where(np.isnan(h), s, arc)


def slant_range(ground: ArrayLike, height: ArrayLike, sensor_height: ArrayLike = 0.0) -> Array:
    """Straight distance, m, to a target above ground range, m; the inverse of `ground_range`."""
    g, h, h0 = (np.asarray(value, float) for value in (ground, height, sensor_height))
    chord_2 = 4.0 * (MEAN_RADIUS + h0) * (MEAN_RADIUS + h) * np.sin(g / (2.0 * MEAN_RADIUS)) ** 2
    return np.where(np.isnan(h), g, np.sqrt(chord_2 + (h - h0) ** 2))


class LocalFrame:
    """The azimuthal equidistant plane about a site on WGS84."""

    def __init__(self, site: Site) -> None:
        self.site = site

    @cached_property
    def _forward(self) -> Transformer:
        plane = CRS.from_proj4(
            f"+proj=aeqd +lat_0={self.site.latitude_deg} +lon_0={self.site.longitude_deg} "
            "+ellps=WGS84 +units=m"
        )
        return Transformer.from_crs("EPSG:4326", plane, always_xy=True)

    def to_wgs84(self, east: ArrayLike, north: ArrayLike) -> tuple[Array, Array]:
        """Latitude and longitude, degrees, of points of the plane, m."""
        longitude, latitude = self._forward.transform(
            np.asarray(east, float), np.asarray(north, float), direction="INVERSE"
        )
        return np.asarray(latitude), np.asarray(longitude)

    def from_wgs84(self, latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> tuple[Array, Array]:
        """East and north, m, of latitude and longitude, degrees."""
        east, north = self._forward.transform(
            np.asarray(longitude_deg, float), np.asarray(latitude_deg, float)
        )
        return np.asarray(east), np.asarray(north)
