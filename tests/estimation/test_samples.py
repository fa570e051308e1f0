"""The batched particle filter: resampling against filterpy, the filter against the Kalman filter."""

import filterpy.monte_carlo
import numpy as np
import pytest
import radar_runs
from filterpy.monte_carlo import resampling as oracle

from radar_console.estimation import kalman, measurement, motion, samples
from radar_console.estimation.gaussian import Gaussian, apply, root
from radar_console.estimation.samples import RESAMPLING, Samples

R = np.diag([50.0, 80.0]) ** 2
POSITION = measurement.position(R)
CV = radar_runs.straight(2)


def uneven_weights(rng, *shape):
    weights = rng.random(shape) ** 4
    return weights / weights.sum(-1, keepdims=True)


@pytest.mark.parametrize("name", ["systematic", "stratified"])
def test_combs_are_filterpys(name, monkeypatch):
    """With the same uniform numbers, the same copies."""
    weights = uneven_weights(np.random.default_rng(1), 20, 500)
    copies = RESAMPLING[name](weights, np.random.default_rng(2))
    shape = (20, 1) if name == "systematic" else (20, 500)
    for w, found, u in zip(weights, copies, np.random.default_rng(2).random(shape), strict=True):
        monkeypatch.setattr(oracle, "random", lambda *size, u=u: u if size else u[0])
        chosen = getattr(filterpy.monte_carlo, f"{name}_resample")(w)
        assert np.array_equal(found, np.bincount(chosen, minlength=500))


@pytest.mark.parametrize("name", list(RESAMPLING))
def test_copies_add_up_and_are_in_proportion_on_average(name):
    """4,000 resamplings of 50 particles: means within 5 of their standard errors, of the widest scheme's."""
    w = uneven_weights(np.random.default_rng(3), 50)
    copies = RESAMPLING[name](np.broadcast_to(w, (4000, 50)), np.random.default_rng(4))
    assert np.all(copies.sum(-1) == 50)
    assert np.all(copies >= 0)
    assert np.all(np.abs(copies.mean(0) - 50 * w) < 5 * np.sqrt(50 * w / 4000))
    if name != "multinomial":
        assert np.all(copies >= np.floor(50 * w) - (name == "stratified"))


def test_residual_copies_are_certain_but_for_the_rest():
    """filterpy's lots for the rest are not the residuals (it takes w - ⌊N w⌋ for N w - ⌊N w⌋)."""
    w = np.array([0.45, 0.3, 0.25, 0.0])
    copies = samples.residual(np.broadcast_to(w, (20_000, 4)), np.random.default_rng(5))
    assert np.all(copies >= [1, 1, 1, 0])
    assert np.all(copies[:, 2:] == [1, 0])
    # One of the first two gets the rest, with probabilities 0.8 and 0.2; 5 standard errors.
    assert abs(copies[:, 0].mean() - 1.8) < 5 * np.sqrt(0.16 / 20_000)


@pytest.mark.parametrize("name", list(RESAMPLING))
def test_one_particle_with_all_the_weight_is_all_there_is(name):
    weights = np.zeros((3, 100))
    weights[[0, 1, 2], [0, 40, 99]] = 1.0
    copies = RESAMPLING[name](weights, np.random.default_rng(6))
    assert np.array_equal(copies, 100 * weights)


def test_only_clouds_of_small_effective_size_are_resampled():
    rng, states = np.random.default_rng(7), np.arange(400.0).reshape(100, 2, 2)
    weights = np.full((100, 2), 0.01)
    weights[:, 1] = uneven_weights(rng, 100)
    cloud = Samples(states, np.log(weights))
    assert samples.effective_size(cloud)[0] == pytest.approx(100)
    assert samples.effective_size(cloud)[1] < 50
    found = samples.resample(cloud, np.random.default_rng(8))
    assert np.array_equal(found.states[:, 0], states[:, 0])
    assert np.allclose(found.weights, 0.01, rtol=1e-12)
    copies = samples.systematic(weights[:, 1:].T, np.random.default_rng(8))[0]
    assert np.array_equal(found.states[:, 1], np.repeat(states[:, 1], copies, axis=0))


def test_parting_copies_keeps_mean_and_covariance():
    """100,000 particles: moments are exact but for the sampling, 1 / √(N_eff) with a margin of 4."""
    rng = np.random.default_rng(9)
    cloud = samples.draw(radar_runs.prior_of(2, 1), 100_000, rng)
    cloud, _ = samples.update(cloud, cloud.states.mean(0)[:, :2] + 60, POSITION)
    before, margin = samples.estimate(cloud), 4 / np.sqrt(samples.effective_size(cloud)[0])
    parted = samples.resample(cloud, rng, below=1.0, width=0.5)
    after, sd = samples.estimate(parted), np.sqrt(np.diagonal(before.cov[0]))
    assert len(np.unique(parted.states[..., 0])) == 100_000
    assert np.all(np.abs(after.mean - before.mean) < margin * sd)
    assert np.all(np.abs(after.cov - before.cov) < 1.5 * margin * np.outer(sd, sd))


@pytest.mark.parametrize("sigmas", [20.0, 1e3, 1e6])
def test_a_measurement_far_out_does_not_underflow(sigmas):
    cloud = samples.draw(radar_runs.prior_of(2, 3), 200, np.random.default_rng(10))
    z = np.full((3, 2), 60e3 + sigmas * 100.0)
    for _ in range(3):
        cloud, log_likelihood = samples.update(cloud, z, POSITION)
        assert np.all(np.isfinite(log_likelihood))
        assert np.allclose(cloud.weights.sum(0), 1, rtol=0, atol=1e-9)
        assert np.all(np.isfinite(samples.estimate(cloud).cov))
    resampled = samples.resample(cloud, np.random.default_rng(11), samples.residual)
    assert np.all(np.isfinite(resampled.states))


def test_the_optimal_proposal_from_one_point_is_the_kalman_update():
    """All particles in one place: their successors are drawn from the posterior, with equal weights."""
    rng, x = np.random.default_rng(12), np.array([100.0, -50.0, 10.0, 20.0])
    model = motion.linear(*motion.constant_velocity(4.0, 100.0))
    cloud = Samples(np.tile(x, (200_000, 1)), np.full(200_000, -np.log(200_000)))
    z = np.array([200.0, 100.0])
    found, log_likelihood = samples.advance(cloud, model, z, POSITION, rng)
    predicted = kalman.predict(Gaussian(x, np.zeros((4, 4))), model.jacobian(x), model.Q)
    expected, log_expected = kalman.update(predicted, z, np.eye(2, 4), R)
    assert log_likelihood == pytest.approx(log_expected, abs=1e-9)
    assert np.ptp(found.log_weights) < 1e-9
    after, sd = samples.estimate(found), np.sqrt(np.diag(expected.cov))
    # 5 standard errors of means and covariances of 200,000 draws.
    assert np.all(np.abs(after.mean - expected.mean) < 5 * sd / np.sqrt(2e5))
    assert np.all(np.abs(after.cov - expected.cov) < 5 * np.sqrt(2) * np.outer(sd, sd) / np.sqrt(2e5))


def test_the_optimal_proposal_refuses_a_measurement_that_is_not_linear():
    cloud = samples.draw(radar_runs.prior_of(2, 1), 10, np.random.default_rng(13))
    with pytest.raises(ValueError, match="linear"):
        samples.advance(cloud, CV, np.zeros(2), measurement.polar([1.0, 1.0]), np.random.default_rng(14))


def linear_runs(proposal, runs=100, steps=25, resampling="systematic", width=0.0):
    """RMSE of the position of 1,000 particles over that of the Kalman filter; both log-likelihoods of a plot.

    The scene is that of the published comparison: 100 m an axis, 4 s, and a piecewise constant acceleration
    of 7 m/s², whose process noise has only half the state's rank.
    """
    rng, count, R = np.random.default_rng(15), 1000, 100.0**2 * np.eye(2)
    F, Q = motion.constant_velocity(4.0, 49.0, piecewise=True)
    model, sensing = motion.linear(F, Q), measurement.position(R)
    kf = Gaussian(np.zeros((runs, 4)), np.tile(np.diag([100.0, 100.0, 20.0, 20.0]) ** 2, (runs, 1, 1)))
    truth = apply(root(kf.cov), rng.standard_normal((runs, 4)))
    cloud, squares, total = samples.draw(kf, count, rng), np.zeros(2), np.zeros(2)
    for _ in range(steps):
        truth = model.f(truth) + apply(root(Q), rng.standard_normal((runs, 4)))
        z = truth[:, :2] + 100 * rng.standard_normal((runs, 2))
        kf, log_kf = kalman.update(kalman.predict(kf, F, Q), z, np.eye(2, 4), R)
        if proposal == "prior":
            cloud, log_pf = samples.update(samples.predict(cloud, model, rng), z, sensing)
        else:
            cloud, log_pf = samples.advance(cloud, model, z, sensing, rng)
        for k, mean in enumerate((kf.mean, samples.estimate(cloud).mean)):
            squares[k] += np.sum((mean - truth)[:, :2] ** 2)
        total += log_kf.mean(), log_pf.mean()
        cloud = samples.resample(cloud, rng, RESAMPLING[resampling], width=width)
    return np.sqrt(squares[1] / squares[0]), total / steps


@pytest.mark.parametrize("proposal", ["prior", "optimal"])
@pytest.mark.parametrize("width", [0.0, 0.25])
def test_on_a_linear_model_the_particle_filter_is_the_kalman_filter(proposal, width):
    """100 runs, 1,000 particles: RMSE of the position within 3 %; the bound is the specification's."""
    ratio, (log_kf, log_pf) = linear_runs(proposal, width=width)
    assert 0.99 < ratio < 1.03
    # The likelihood's estimate is unbiased, so its logarithm is low: by half its relative variance, which is
    # some 1 / N_eff, and far more for the rare plots that few particles are near.
    assert log_kf - 0.1 < log_pf < log_kf + 0.01


@pytest.mark.parametrize("name", list(RESAMPLING))
def test_every_resampling_serves(name):
    """A quarter of the specification's runs, whose ratio scatters by 0.01 more."""
    assert linear_runs("prior", runs=25, resampling=name)[0] < 1.05


def test_the_same_generator_gives_the_same_particles():
    found = []
    for _ in range(2):
        rng = np.random.default_rng(16)
        cloud = samples.predict(samples.draw(radar_runs.prior_of(3, 2), 50, rng), radar_runs.straight(3), rng)
        cloud, _ = samples.update(
            cloud, radar_runs.radar(3, True).h(cloud.states[0]), radar_runs.radar(3, True)
        )
        found.append(samples.resample(cloud, rng, samples.stratified, 1.0, 0.3))
    assert np.array_equal(found[0].states, found[1].states)
    assert np.array_equal(found[0].log_weights, found[1].log_weights)
