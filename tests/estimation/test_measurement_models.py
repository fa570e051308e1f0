"""Measurement models against finite differences, geometry and simulation."""

import numpy as np
import pytest
import radar_runs

from radar_console.core import geometry
from radar_console.estimation import extended, measurement, unscented
from radar_console.estimation.gaussian import Gaussian

CASES = [(d, doppler) for d in (2, 3) for doppler in (False, True)]


def states(d, count=40):
    """Around the radar, on all sides and at all heights."""
    rng = np.random.default_rng(1)
    place = rng.normal(size=(count, d)) * np.array([2e4, 2e4, 5e3])[:d]
    return np.concatenate([place, 200 * rng.normal(size=(count, d)), np.zeros((count, 1))], axis=-1)


@pytest.mark.parametrize(("d", "doppler"), CASES)
def test_jacobians_are_derivatives(d, doppler):
    sensing, x = radar_runs.radar(d, doppler), states(d)
    H = sensing.jacobian(x)
    for column in range(2 * d):
        shift = np.eye(2 * d + 1)[column]
        expected = sensing.residual(sensing.h(x + shift), sensing.h(x - shift)) / 2
        # Central differences over 1 m at more than some 100 m.
        assert np.allclose(H[..., column], expected, rtol=1e-3, atol=1e-7)
    assert np.all(H[..., -1] == 0)


def test_h_is_the_geometry_seen_from_a_moving_sensor():
    x, place, speed = states(3), np.array([1e3, -2e3, 100.0]), np.array([30.0, -10.0, 2.0])
    names = ("range", "azimuth", "elevation", "doppler")
    z = measurement.polar(np.ones(4), names, place, speed).h(x)
    r, azimuth, elevation = geometry.to_spherical(*np.moveaxis(x[:, :3] - place, -1, 0))
    assert np.allclose(z[:, 0], r, rtol=1e-14)
    assert np.allclose(geometry.wrap(z[:, 1] - azimuth), 0, atol=1e-14)
    assert np.allclose(z[:, 2], elevation, rtol=0, atol=1e-14)
    dt = 1e-3
    later = x[:, :3] - place + dt * (x[:, 3:6] - speed)
    rate = (np.linalg.norm(later, axis=-1) - r) / dt
    curvature = np.sum((x[:, 3:6] - speed) ** 2, axis=-1) * dt / (2 * r)
    assert np.all(np.abs(z[:, 3] - rate) <= 1.01 * curvature + 1e-6)


def test_a_sensor_for_each_track():
    x, places = states(2, 5), np.arange(10.0).reshape(5, 2) * 1e3
    sensing = measurement.polar([50.0, 0.002], sensor=places)
    for k in range(5):
        one = measurement.polar([50.0, 0.002], sensor=places[k])
        assert np.array_equal(sensing.h(x)[k], one.h(x[k]))
        assert np.array_equal(sensing.jacobian(x)[k], one.jacobian(x[k]))


def test_elevation_in_the_plane_is_refused():
    with pytest.raises(ValueError, match="elevation needs three axes"):
        measurement.polar([1.0, 1.0], ("range", "elevation"))


@pytest.mark.parametrize("update", [extended.update, unscented.update])
def test_azimuth_across_north(update):
    """A target just west of north, seen just east of it, or named a turn apart: the same small step."""
    state = Gaussian(np.array([-40.0, 5e4, 100.0, 0.0]), np.diag([200.0, 200.0, 10.0, 10.0]) ** 2)
    sensing = measurement.polar([50.0, 0.002])
    z = np.array([5e4, 0.001])
    here, log_here = update(state, z, sensing)
    there, log_there = update(state, z + np.array([0.0, 2 * np.pi]), sensing)
    assert -40 < here.mean[0] < 50
    # Subtracting a turn loses a few units of 1e-16 rad, 1e-11 m.
    assert np.allclose(here.mean, there.mean, rtol=0, atol=1e-9)
    assert log_here == pytest.approx(log_there, abs=1e-9)


@pytest.mark.parametrize(("d", "doppler"), CASES)
@pytest.mark.parametrize("update", [extended.update, unscented.update])
def test_a_target_at_the_radar_is_updated_to_something_finite(d, doppler, update):
    names = radar_runs.quantities_of(d, doppler)
    sensing = measurement.polar([radar_runs.SD[name] for name in names], names, np.zeros(d))
    state = Gaussian(np.zeros((2, 2 * d)), np.broadcast_to(1e4 * np.eye(2 * d), (2, 2 * d, 2 * d)))
    z = np.zeros((2, len(names)))
    z[1, :2] = 300.0, 3.0
    found, log_likelihood = update(state, z, sensing)
    assert np.all(np.isfinite(found.mean))
    assert np.all(np.isfinite(log_likelihood))
    values = np.linalg.eigvalsh(found.cov)
    assert np.all(values >= -1e-9 * values.max())


@pytest.mark.parametrize("elevation", [0.0, 0.3, 1.2])
@pytest.mark.parametrize("sd_angle", [0.002, 0.03])
def test_conversion_from_space_is_unbiased_and_its_covariance_is_its_own(elevation, sd_angle):
    """A million draws: the mean within 4 of its standard errors, the covariance within 1 %."""
    rng, n, r, a = np.random.default_rng(3), 1_000_000, 8e4, 5.5
    noise = rng.normal(size=(3, n)) * np.array([[50.0], [sd_angle], [1.5 * sd_angle]])
    z = measurement.from_spherical(
        r + noise[0], a + noise[1], elevation + noise[2], 50.0, sd_angle, 1.5 * sd_angle
    )
    error = z.mean - np.stack(geometry.from_spherical(r, a, elevation))
    assert np.all(np.abs(error.mean(axis=0)) < 4 * error.std(axis=0) / np.sqrt(n))
    claimed = measurement.from_spherical(r, a, elevation, 50.0, sd_angle, 1.5 * sd_angle).cov
    # Whitened by the claimed covariance, in whatever axes.
    white = np.linalg.solve(np.linalg.cholesky(claimed), error.T)
    assert np.allclose(np.cov(white), np.eye(3), rtol=0, atol=0.01)


def test_an_error_of_azimuth_alone_moves_the_point_level():
    """The point stays on its circle of latitude: the errors along and above the line of sight are one."""
    z = measurement.from_spherical(8e4, 5.5, 0.6, 0.0, 0.03, 0.0)
    # Rounding of what is across the line of sight.
    assert np.all(np.abs(z.cov[2]) < 1e-12 * np.trace(z.cov))
    inward = np.array([np.sin(5.5), np.cos(5.5)])
    assert inward @ z.cov[:2, :2] @ inward == pytest.approx(
        0.5 * (8e4 * np.cos(0.6) * 0.03**2) ** 2, rel=1e-9
    )


def test_conversion_from_space_at_the_horizon_is_that_of_the_plane():
    space = measurement.from_spherical(5e4, 2.0, 0.0, 50.0, 0.01, 0.0)
    plane = measurement.from_polar(5e4, 2.0, 50.0, 0.01)
    assert np.allclose(space.mean[:2], plane.mean, rtol=1e-15)
    assert np.allclose(space.cov[:2, :2], plane.cov, rtol=1e-12)
    assert np.all(space.cov[2] == 0)


@pytest.mark.parametrize("elevation", [0.0, np.pi / 2])
def test_conversion_from_space_at_range_zero_and_overhead_has_a_proper_covariance(elevation):
    z = measurement.from_spherical([0.0, 1e4], 1.0, elevation, 50.0, 0.002, 0.003)
    assert np.all(np.linalg.eigvalsh(z.cov)[1] > 0)
    assert np.all(np.isfinite(z.mean))
