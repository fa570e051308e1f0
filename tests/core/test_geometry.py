"""Polar, local plane, WGS84, slant range and height."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod, Transformer

from radar_console.core import geometry
from radar_console.core.messages import Site
from radar_console.core.units import TURN

angles = st.floats(-100.0, 100.0)
distances = st.floats(1.0, 460e3)
latitudes = st.floats(-80.0, 80.0)


@given(angles)
def test_wrap_keeps_the_direction_and_lies_in_its_interval(angle: float) -> None:
    wrapped = float(geometry.wrap(angle))
    assert -np.pi < wrapped <= np.pi
    # 100 rad carry a rounding of 1.4e-14; sixteen turns more lose a few of them.
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-12)


def test_wrap_of_the_seam() -> None:
    assert geometry.wrap([np.pi, -np.pi, 3 * np.pi, 0.0]).tolist() == [np.pi, np.pi, np.pi, 0.0]


@given(st.floats(0, TURN, exclude_max=True), st.floats(0, 1e4), st.floats(-3.0, 3.0))
def test_a_plot_seen_near_the_beam_gets_the_unwrapped_angle_near_the_beam(
    azimuth: float, turns: float, lag: float
) -> None:
    beam = np.floor(turns) * TURN + azimuth + lag
    assert abs(float(geometry.unwrap_near(azimuth, beam)) - (beam - lag)) < 1e-9 * max(beam, 1.0)


@given(distances, st.floats(0, TURN, exclude_max=True))
def test_polar_and_cartesian_are_inverse(distance: float, azimuth: float) -> None:
    back, angle = geometry.to_polar(*geometry.to_cartesian(distance, azimuth))
    assert back == pytest.approx(distance, rel=1e-12)
    assert abs(float(geometry.wrap(angle - azimuth))) < 1e-12
    assert 0.0 <= angle < TURN


def test_azimuth_is_clockwise_from_north() -> None:
    east, north = geometry.to_cartesian([1.0, 1.0], [0.0, np.pi / 2])
    assert east == pytest.approx([0.0, 1.0], abs=1e-15)
    assert north == pytest.approx([1.0, 0.0], abs=1e-15)


@given(distances, angles, st.floats(-1.5, 1.5))
def test_spherical_and_local_are_inverse(distance: float, azimuth: float, elevation: float) -> None:
    offset = geometry.from_spherical(distance, azimuth, elevation)
    slant, _, up = geometry.to_spherical(*offset)
    assert slant == pytest.approx(distance, rel=1e-12)
    assert up == pytest.approx(elevation, abs=1e-9)


@given(distances, st.floats(0.0, 20e3), st.floats(0.0, 3e3))
def test_ground_and_slant_range_are_inverse(ground: float, height: float, sensor: float) -> None:
    slant = geometry.slant_range(ground, height, sensor)
    # Overhead, a millimetre of slant range is metres of ground range: compare what is well posed.
    again = geometry.slant_range(geometry.ground_range(slant, height, sensor), height, sensor)
    assert again == pytest.approx(slant, rel=1e-12)
    assert slant >= abs(height - sensor)


def test_unknown_height_is_a_flat_world() -> None:
    assert geometry.ground_range(1234.5, np.nan) == 1234.5
    assert geometry.slant_range(1234.5, np.nan) == 1234.5


def test_a_slant_range_below_the_height_is_overhead() -> None:
    assert geometry.ground_range(5_000.0, 10_000.0) == 0.0


@given(latitudes, st.floats(-170, 170), distances, st.floats(0, 360))
def test_the_plane_keeps_distance_and_bearing_from_its_site(
    latitude: float, longitude: float, distance: float, azimuth: float
) -> None:
    frame = geometry.LocalFrame(Site(latitude, longitude))
    east, north = geometry.to_cartesian(distance, np.radians(azimuth))
    there, where = frame.to_wgs84(east, north)
    forward, _, geodesic = Geod(ellps="WGS84").inv(longitude, latitude, float(where), float(there))
    assert geodesic == pytest.approx(distance, abs=1e-3)
    # 1 mm across at 1 m of distance: the bearing's error is bounded by the position's.
    assert abs(float(geometry.wrap(np.radians(forward - azimuth)))) * distance < 1e-3
    assert np.allclose(frame.from_wgs84(there, where), (east, north), atol=1e-3)


@pytest.mark.parametrize("latitude", [0.0, -26.7, 48.0, 70.0])
def test_ground_range_is_within_a_metre_of_the_ellipsoid_to_460_km(latitude: float) -> None:
    """Slant ranges of the true earth (ECEF), brought to the ground by the mean sphere."""
    site = Site(latitude, 10.0, 100.0)
    azimuth = np.linspace(0, TURN, 72, endpoint=False)
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    radar = np.array(to_ecef.transform(10.0, latitude, 100.0))
    for ground in (50e3, 250e3, 460e3):
        where = geometry.LocalFrame(site).to_wgs84(*geometry.to_cartesian(ground, azimuth))
        target = np.array(to_ecef.transform(where[1], where[0], np.full(72, 10e3))).T
        slant = np.linalg.norm(target - radar, axis=1)
        assert np.abs(geometry.ground_range(slant, 10e3, 100.0) - ground).max() < 1.0
