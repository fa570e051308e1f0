"""The Gaussian filters of confirmed tracks against filterpy, brute force, and their own laws."""

import math

import filterpy.common
import filterpy.kalman
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from bank_cases import FILTERS, RADAR, Solo, motion, polar, positive, seen

from radar_console.core.geometry import wrap
from radar_console.estimation import kalman
from radar_console.estimation import motion as batched_motion
from radar_console.estimation.gaussian import Gaussian, collapse, log_density
from radar_console.tracker import modes
from radar_console.tracker.records import CA, CT, CV, IMM, KALMAN, PARTICLE, SINGER

X0 = np.array([60e3, 80e3, 150.0, -120.0])
P0 = np.array(
    [[9e3, -2e3, 700.0, 0.0], [-2e3, 6e3, 0.0, 500.0], [700.0, 0.0, 150.0, 10.0], [0.0, 500.0, 10.0, 130.0]]
)
EVERY = pytest.mark.parametrize("name", FILTERS)


def solo(name, **changes):
    return Solo(**({"outliers": 0.0} | FILTERS[name] | changes)).start(X0, P0)


def moments(track):
    return Gaussian(track.track["x"].copy(), track.track["P"].copy())


def jacobian(model, par, x, T, step=1e-4):
    """F by central differences."""
    columns = []
    for i in range(len(x)):
        h = step * np.eye(len(x))[i]
        columns.append((motion(model, par, x + h, T)[0] - motion(model, par, x - h, T)[0]) / (2 * step))
    return np.stack(columns, axis=1)


def discrete(model, par, n, T=4.0):
    """F and Q (n, n) of a linear model."""
    return jacobian(model, par, np.zeros(n), T, 1.0), motion(model, par, np.zeros(n), T)[1]


# The motion of a mode.


@pytest.mark.parametrize("T", [0.01, 4.0, 24.0])
def test_constant_velocity_is_the_batched_one(T):
    par = Solo(filter="kalman").par
    F, Q = batched_motion.constant_velocity(T, par["q"])
    x, P = X0.copy(), P0.copy()
    modes.predict(CV, x, P, T, par)
    assert np.allclose(x, F @ X0, rtol=1e-14)
    assert np.allclose(P, F @ P0 @ F.T + Q, rtol=1e-13)


@pytest.mark.parametrize("T", [1e-3, 0.5, 1.9, 2.1, 24.0, 200.0])
@pytest.mark.parametrize("model", [CA, SINGER])
def test_accelerations_are_the_exact_discretisation(model, T):
    """Against Van Loan's matrix exponential, of a part of the time, as it loses digits beyond a time
    constant; the series' remainder at a tenth of one is below 1e-7."""
    par = Solo(filter="kalman", models=("singer",)).par
    sd, tau = float(par["manoeuvre"]), float(par["manoeuvre_time"])
    A = np.diag([1.0, 1.0], 1)
    A[2, 2] = -1.0 / tau if model == SINGER else 0.0
    block = np.zeros((6, 6))
    block[:3, :3], block[3:, 3:] = -A, A.T
    block[2, 5] = 2 * sd**2 / tau
    E = scipy.linalg.expm(block * T / 32)
    F, Q = E[3:, 3:].T, E[3:, 3:].T @ E[:3, 3:]
    for k in range(5):
        Q, F = F @ Q @ F.T + Q, scipy.linalg.expm(A * T / 2 ** (4 - k))
    found = jacobian(model, par, np.zeros(6), T, 1.0)
    noise = motion(model, par, np.zeros(6), T)[1]
    for axis in range(2):
        own = slice(axis, 6, 2)
        assert np.allclose(found[own, own], F, rtol=1e-9, atol=1e-12)
        assert np.allclose(noise[own, own], Q, rtol=1e-6)
        assert np.all(noise[own, 1 - axis :: 2] == 0.0)


def test_constant_acceleration_has_filterpys_noise():
    par = Solo(filter="kalman", models=("ca",)).par
    w = 2 * float(par["manoeuvre"]) ** 2 / float(par["manoeuvre_time"])
    Q = filterpy.common.Q_continuous_white_noise(3, 3.0, w)
    assert np.allclose(motion(CA, par, np.zeros(6), 3.0)[1][::2, ::2], Q, rtol=1e-13)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 2e-4, 3e-4, 0.05, -0.3])
def test_a_turn_solves_its_differential_equation(rate):
    par = Solo(filter="kalman", models=("ct",)).par

    def derivative(_, x):
        return [x[2], x[3], -x[4] * x[3], x[4] * x[2], 0.0]

    x = np.append(X0, rate)
    solution = scipy.integrate.solve_ivp(derivative, (0.0, 4.0), x, rtol=1e-12, atol=1e-9)
    found, _ = motion(CT, par, x, 4.0)
    # A micrometre of 1e5 m; what the integrator leaves.
    assert np.allclose(found, solution.y[:, -1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 2e-4, 3e-4, 0.05, -0.3])
def test_a_turns_covariance_goes_by_its_jacobian(rate):
    par = Solo(filter="extended", models=("ct",)).par
    x, P = np.append(X0, rate), np.diag([1e3, 2e3, 100.0, 200.0, 1e-4])
    Q = motion(CT, par, x, 4.0)[1]
    F = jacobian(CT, par, x, 4.0)
    expected = F @ P @ F.T + Q
    modes.predict(CT, x, P, 4.0, par)
    # The difference quotient's rounding: 1e5 m · 1e-16 / 1e-4, times the sds 1e3 m/rad of F.
    assert np.allclose(P, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("model", [CV, CA, SINGER])
def test_two_halves_are_one_whole(model):
    par, n = Solo(filter="kalman", models=("singer",)).par, 6
    A = np.random.default_rng(3).normal(size=(n, n))
    once, twice = [np.arange(n, dtype=float), A @ A.T], [np.arange(n, dtype=float), A @ A.T]
    if model == CV:
        for part in (once, twice):
            part[0][4:] = 0.0
            part[1][4:] = part[1][:, 4:] = 0.0
    modes.predict(model, *once, 7.0, par)
    for _ in range(2):
        modes.predict(model, *twice, 3.5, par)
    assert np.allclose(once[0], twice[0], rtol=1e-12)
    assert np.allclose(once[1], twice[1], rtol=1e-10)


def test_sizes():
    assert [modes.state_size(m) for m in ([CV], [CV, CT], [CA], [CV, SINGER], [CV, CA, CT])] == [
        4,
        5,
        6,
        6,
        7,
    ]
    assert modes.count(KALMAN, [CT]) == 1
    assert modes.count(IMM, [CV, CT, CA]) == 3
    assert modes.count(PARTICLE, [CV, CT]) == 0


# filterpy does the same, one plot at a time.


@pytest.mark.parametrize(("name", "model"), [("kalman", CV), ("kalman ca", CA), ("kalman singer", SINGER)])
def test_the_kalman_filter_is_filterpys(name, model):
    rng, track = np.random.default_rng(1), solo(name)
    n = track.x.shape[1]
    f = filterpy.kalman.KalmanFilter(n, 2)
    f.x, f.P, f.H = track.x[0].copy(), track.P[0].copy(), np.eye(2, n)
    f.F, f.Q = (
        jacobian(model, track.par, np.zeros(n), 4.0, 1.0),
        motion(model, track.par, np.zeros(n), 4.0)[1],
    )
    for k in range(1, 40):
        plot = seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0]))
        f.predict()
        f.update(
            np.array([plot["e"][0], plot["n"][0]]),
            R=np.array([[plot["ee"][0], plot["en"][0]], [plot["en"][0], plot["nn"][0]]]),
        )
        assert track.advance(4.0 * k).log_likelihood(plot[0]) == pytest.approx(f.log_likelihood, abs=1e-9)
        track.update(plot)
        # Rounding of positions of 1e5 m and variances of 1e4 m²; filterpy uses Joseph's form.
        assert np.allclose(track.x[0], f.x, rtol=0, atol=1e-8)
        assert np.allclose(track.P[0], f.P, rtol=1e-9, atol=1e-9)


def polar_of(x, *_):
    return np.array([math.hypot(x[0], x[1]), math.atan2(x[0], x[1])])


def polar_residual(a, b):
    return np.array([a[0] - b[0], wrap(a[1] - b[1])])


@pytest.mark.parametrize("start", [X0, np.array([-2e3, -90e3, 200.0, 30.0])], ids=["", "south"])
def test_the_extended_filter_is_filterpys(start):
    """The second start crosses south, where azimuths jump by a turn."""
    rng, track = np.random.default_rng(2), solo("extended").start(start, P0)
    f = filterpy.kalman.ExtendedKalmanFilter(4, 2)
    f.x, f.P = start.copy(), P0.copy()
    f.F, f.Q = batched_motion.constant_velocity(4.0, track.par["q"])
    f.R = np.diag([RADAR.sd_range**2, RADAR.sd_azimuth**2])

    def H(x):
        r2 = x[0] ** 2 + x[1] ** 2
        r = math.sqrt(r2)
        return np.array([[x[0] / r, x[1] / r, 0, 0], [x[1] / r2, -x[0] / r2, 0, 0]])

    for k in range(1, 40):
        plot = seen(rng, 4.0 * k, start + 4.0 * k * np.array([*start[2:], 0, 0]))
        f.predict()
        z = np.array([plot["range"][0], math.atan2(plot["e"][0], plot["n"][0])])
        f.update(z, H, polar_of, residual=polar_residual)
        # filterpy's density is per m rad, ours per m².
        expected = f.log_likelihood - math.log(plot["range"][0])
        assert track.advance(4.0 * k).log_likelihood(plot[0]) == pytest.approx(expected, abs=1e-8)
        track.update(plot)
        assert np.allclose(track.x[0], f.x, rtol=0, atol=1e-8)
        assert np.allclose(track.P[0], f.P, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("name", "model"), [("unscented", CV), ("unscented ct", CT)])
def test_the_unscented_filter_is_filterpys(name, model):
    rng, track = np.random.default_rng(3), solo(name)
    n, par = track.x.shape[1], track.par
    # The central point weighs nothing; ours are from the root that is upper triangular.
    points = filterpy.kalman.MerweScaledSigmaPoints(
        n, 1.0, 0.0, 0.0, sqrt_method=lambda P: np.linalg.cholesky(P[::-1, ::-1])[::-1, ::-1].T
    )
    f = filterpy.kalman.UnscentedKalmanFilter(
        n, 2, 4.0, hx=polar_of, fx=lambda x, dt: motion(model, par, x, dt)[0], points=points,
        residual_z=polar_residual,
    )  # fmt: skip
    f.x, f.P = track.x[0].copy(), track.P[0].copy()
    f.R = np.diag([RADAR.sd_range**2, RADAR.sd_azimuth**2])
    f.Q = np.zeros((n, n))
    f.Q[:4, :4] = batched_motion.constant_velocity(4.0, par["q"])[1]
    if model == CT:
        f.Q[4, 4] = 2 * par["turn_rate"] ** 2 / par["manoeuvre_time"] * 4.0
    for k in range(1, 25):
        plot = seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0]))
        f.predict()
        f.update(np.array([plot["range"][0], math.atan2(plot["e"][0], plot["n"][0])]))
        # Not filterpy's own log-likelihood: it takes an S of m² and rad² for singular.
        expected = float(log_density(f.y, f.S)) - math.log(plot["range"][0])
        assert track.advance(4.0 * k).log_likelihood(plot[0]) == pytest.approx(expected, abs=1e-6)
        track.update(plot)
        # Differences of points 1e5 m away: 1e-11 of rounding, squared with spreads of 1e3 m.
        assert np.allclose(track.x[0], f.x, rtol=0, atol=1e-6)
        assert np.allclose(track.P[0], f.P, rtol=1e-7, atol=1e-7)


def test_the_imm_is_filterpys():
    """Two models of the same state; filterpy's M[i, j] is the probability of i → j."""
    rng, track = np.random.default_rng(4), solo("imm ca singer")
    track.x[:, 4:] = 3.0, -2.0
    filters = []
    for k, model in enumerate((CA, SINGER)):
        f = filterpy.kalman.KalmanFilter(6, 2)
        f.x, f.P, f.H = track.x[k].copy(), track.P[k].copy(), np.eye(2, 6)
        f.F, f.Q = discrete(model, track.par, 6)
        filters.append(f)
    leave = 1.0 - np.exp(-4.0 * track.par["leave"][:2])
    M = np.array([[1.0 - leave[0], leave[0]], [leave[1], 1.0 - leave[1]]])
    imm = filterpy.kalman.IMMEstimator(filters, track.mu.copy(), M)
    for k in range(1, 40):
        plot = seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0]))
        for f in filters:
            f.R = np.array([[plot["ee"][0], plot["en"][0]], [plot["en"][0], plot["nn"][0]]])
        imm.predict()
        imm.update(np.array([plot["e"][0], plot["n"][0]]))
        track.advance(4.0 * k).update(plot)
        assert np.allclose(track.mu, imm.mu, rtol=1e-8)
        assert np.allclose(track.track["x"], imm.x[:4], rtol=0, atol=1e-7)
        assert np.allclose(track.track["P"], imm.P[:4, :4], rtol=1e-8, atol=1e-8)


# Alternatives, outliers, Doppler.


def three_plots(t):
    """Plots (3,) near X0, at times of their own; β, and the miss."""
    near = (0.0, 30.0, 0.6440), (0.05, -200.0, 0.6425), (-0.1, 900.0, 0.6460)
    table = np.concatenate([polar(t + lag, 100e3 + r, a) for lag, r, a in near])
    return table, np.array([0.5, 0.2, 0.1]), 0.2


@pytest.mark.parametrize("outliers", [0.0, 0.05])
@pytest.mark.parametrize("name", ["kalman", "kalman singer", "imm cv ct", "imm all"])
def test_the_update_is_the_brute_force_mixture(name, outliers):
    """All alternatives in full, collapsed at the end; 1e-9 is rounding of variances of 1e4 m²."""
    track = solo(name, outliers=outliers).advance(4.0)
    r, n = track.x.shape
    table, beta, miss = three_plots(4.0)
    prior, mu = Gaussian(track.x.copy(), track.P.copy()), track.mu.copy()
    states = [prior]
    densities = []
    for plot in table:
        H = np.zeros((2, n))
        H[:, :2], H[:, 2:4] = np.eye(2), (plot["t"] - 4.0) * np.eye(2)
        z, R = (
            np.array([plot["e"], plot["n"]]),
            np.array([[plot["ee"], plot["en"]], [plot["en"], plot["nn"]]]),
        )
        both = [kalman.update(prior, z, H, scale * R) for scale in (1.0, 64.0)]
        densities.append([w * np.exp(d) for w, (_, d) in zip((1 - outliers, outliers), both, strict=True)])
        states += [state for state, _ in both]
    densities = np.array(densities)  # plot, noise, mode
    g = (densities.sum(axis=1) * mu).sum(axis=-1)
    for plot, expected in zip(table, g, strict=True):
        assert track.log_likelihood(plot) == pytest.approx(math.log(expected), abs=1e-9)
    parts = np.concatenate(
        [np.full((1, r), miss), (beta[:, None, None] * densities / g[:, None, None]).reshape(-1, r)]
    )
    total = parts.sum(axis=0)
    expected = collapse(
        (parts / total).T,
        Gaussian(np.stack([s.mean for s in states], axis=1), np.stack([s.cov for s in states], axis=1)),
    )
    track.update(table, beta, miss)
    assert np.allclose(track.x, expected.mean, rtol=1e-13, atol=1e-9)
    assert np.allclose(track.P, expected.cov, rtol=1e-9, atol=1e-9)
    assert np.allclose(track.mu, mu * total / (mu * total).sum(), rtol=1e-9)
    whole = collapse(track.mu, Gaussian(track.x, track.P))
    assert np.allclose(track.track["x"], whole.mean[:4], rtol=1e-13)
    assert np.allclose(track.track["P"], whole.cov[:4, :4], rtol=1e-9)


@pytest.mark.parametrize("name", ["extended", "unscented"])
def test_polar_filters_weigh_a_plot_like_the_kalman_filter(name):
    """Per m²: at 100 km and 0.1° the two differ by the curvature of the gate, a few parts in 1e3."""
    for plot in three_plots(0.0)[0]:
        one, other = (solo(each).log_likelihood(plot) for each in (name, "kalman"))
        assert one == pytest.approx(other, rel=3e-3, abs=0.05)


@pytest.mark.parametrize("name", ["kalman", "extended", "unscented", "imm cv ct"])
def test_doppler_is_taken_in_with_the_position(name):
    """Against an update with all three at once through a Jacobian by differences."""
    track, t = solo(name, doppler="use"), 0.1
    plot = polar(t, 100e3 + 40.0, 0.6440, doppler=-20.0, sd_doppler=1.5)

    def h(x):
        e, n = x[0] + t * x[2], x[1] + t * x[3]
        r = math.hypot(e, n)
        return np.array([e, n, (e * x[2] + n * x[3]) / r])

    H = np.stack([(h(X0 + d) - h(X0 - d)) / 2e-2 for d in 1e-2 * np.eye(4)], axis=1)
    p = plot[0]
    R = np.array([[p["ee"], p["en"], 0.0], [p["en"], p["nn"], 0.0], [0.0, 0.0, 2.25]])
    nu = np.array([p["e"], p["n"], -20.0]) - h(X0)
    S = H @ P0 @ H.T + R
    gain = P0 @ H.T @ np.linalg.inv(S)
    # Polar against Cartesian.
    assert track.log_likelihood(p) == pytest.approx(float(log_density(nu, S)), abs=0.02)
    track.update(plot)
    sd = np.sqrt(np.diag(P0 - gain @ S @ gain.T))
    assert np.all(np.abs(track.track["x"] - X0 - gain @ nu) < 0.02 * sd)
    assert np.allclose(np.sqrt(np.diag(track.track["P"])), sd, rtol=0.02)


def test_doppler_that_is_ignored_or_unknown_changes_nothing():
    plot = polar(0.0, 100e3, 0.6440, doppler=-20.0, sd_doppler=1.0)
    without = polar(0.0, 100e3, 0.6440)
    for doppler, table in (("ignore", plot), ("use", without)):
        a, b = solo("kalman", doppler=doppler), solo("kalman", doppler="ignore")
        assert a.log_likelihood(table[0]) == b.log_likelihood(without[0])
        assert np.array_equal(a.update(table).track["P"], b.update(without).track["P"])


def test_doppler_at_the_radar_is_evenly_spread():
    """The line of sight has no direction there."""
    track = Solo(filter="kalman").start([0.0, 0.0, 100.0, 0.0], P0)
    known, unknown = (track.log_likelihood(polar(0.0, 90.0, 1.0, doppler=d)[0]) for d in (80.0, np.nan))
    assert known == pytest.approx(unknown - math.log(2.0 * track.par["max_speed"]))


def test_doppler_without_its_deviation_is_2_m_per_s():
    said, silent = (polar(0.0, 100e3, 0.6440, doppler=-20.0, sd_doppler=sd) for sd in (2.0, np.nan))
    assert solo("kalman").log_likelihood(said[0]) == solo("kalman").log_likelihood(silent[0])


# The forecast, and the modes' probabilities.


@EVERY
def test_the_forecast_is_the_filters_own_after_a_turn(name):
    """In its covariance each mode counts for a quarter at least, for the gate's sake; a turn can shrink
    it below the forecast's least growth."""
    rng, track = np.random.default_rng(5), solo(name, outliers=0.05)
    for k in range(1, 15):
        heading = 0.05 * 4.0 * k
        x = np.array([60e3 + 4000 * math.sin(heading), 80e3 + 4000 * math.cos(heading), 0, 0])
        track.advance(4.0 * k).update(seen(rng, 4.0 * k, x), [0.95], 0.05)
    T = float(track.par["turn"])
    now, curve, growth = moments(track), track.track["curve"].copy(), track.track["growth"].copy()
    F = batched_motion.constant_velocity(T, 0.0)[0]
    mean = (F @ now.mean)[:2] + 0.5 * T**2 * curve
    cov = (F @ now.cov @ F.T)[:2, :2] + T**3 * np.array([[growth[0], growth[1]], [growth[1], growth[2]]])
    track.advance(float(track.track["t"]) + T)
    assert np.allclose(mean, track.track["x"][:2], rtol=1e-13)
    shares = np.maximum(track.mu, 0.25)
    expected = collapse(shares / shares.sum(), Gaussian(track.x, track.P)).cov[:2, :2]
    if "ct" not in name:
        assert np.allclose(cov, expected, rtol=1e-9)
    assert np.linalg.eigvalsh(cov - expected).min() > -1e-6 * np.trace(cov)
    assert growth[0] > 0
    assert growth[2] > 0
    assert growth[1] ** 2 < growth[0] * growth[2]


@pytest.mark.parametrize("name", ["kalman", "extended", "unscented"])
def test_the_forecast_of_constant_velocity_is_its_white_noise(name):
    track = solo(name)
    third = float(track.par["q"]) / 3.0
    assert track.track["growth"].tolist() == [third, 0.0, third]
    assert track.track["curve"].tolist() == [0.0, 0.0]


def test_modes_begin_as_they_are_in_the_long_run():
    track = solo("imm cv ct")
    a, b = track.par["leave"][:2]
    assert track.mu == pytest.approx([b / (a + b), a / (a + b)])
    assert track.advance(4.0).mu == pytest.approx([b / (a + b), a / (a + b)], rel=0.1)


@pytest.mark.parametrize("wait", [24.0, 3600.0])
def test_a_long_wait_forgets_the_modes_and_does_not_swap_them(wait):
    """Against the chain's own exponential; in steps of half a switch, 1 - exp(-1/2) is 0.1
    less than the chain's rate, and the probabilities are half of that out."""
    track = solo("imm all")
    track.mu[:] = 0.97, 0.01, 0.01, 0.01
    leave = np.array(track.par["leave"])
    rates = np.outer(leave / 3, np.ones(4))
    np.fill_diagonal(rates, -leave)
    expected = track.mu @ scipy.linalg.expm(rates * wait)
    track.advance(wait)
    assert track.mu == pytest.approx(expected, abs=0.05)
    assert track.mu.sum() == pytest.approx(1.0, abs=1e-12)


def test_straight_flight_leaves_the_turning_mode_ready():
    """Its rate is uncertain like a turn's that has just begun, not known to be zero; straight flight is
    more probable than it is in the long run."""
    rng, track = np.random.default_rng(6), solo("imm cv ct")
    for k in range(1, 40):
        track.advance(4.0 * k).update(seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0])))
    track.advance(164.0)
    assert math.sqrt(track.P[1, 4, 4]) > 0.4 * track.par["turn_rate"]
    a, b = track.par["leave"][:2]
    assert track.mu[0] > b / (a + b)


@EVERY
def test_what_a_model_lacks_stays_zero(name):
    rng, track = np.random.default_rng(7), solo(name, outliers=0.05)
    n = track.x.shape[1]
    for k in range(1, 10):
        track.advance(4.0 * k).update(seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0])))
    for k in range(len(track.mu)):
        for i in range(4, n):
            if modes.has(int(track.par["model"][k]), i, n):
                assert track.P[k, i, i] > 0.0
            else:
                assert track.x[k, i] == 0.0
                assert not track.P[k, i].any()
                assert not track.P[k, :, i].any()


@EVERY
@pytest.mark.parametrize("angle", [0.7, 3.0])
def test_a_rotated_track_is_the_same_track(name, angle):
    """To 1e-7 m, the rounding of 1e5 m over ten updates; sigma points of the measurement lie along east
    and north, and what they see of its curvature, σ²/r, makes centimetres."""
    limit = 0.05 if name.startswith("unscented") else 1e-7
    c, s = math.cos(angle), math.sin(angle)
    turn = np.kron(np.eye(2), [[c, s], [-s, c]])  # clockwise, as azimuths grow
    a, b = solo(name, outliers=0.05), solo(name, outliers=0.05)
    b.start(turn @ X0, turn @ P0 @ turn.T)
    rng = np.random.default_rng(10)
    for k in range(1, 11):
        r, azimuth = 100e3 + 200 * k + 50 * rng.normal(), 0.6435 + 0.003 * k
        for track, by in ((a, 0.0), (b, angle)):
            track.advance(4.0 * k).update(polar(4.0 * k, r, azimuth + by, doppler=50.0), [0.9], 0.1)
        assert np.allclose(turn @ a.track["x"], b.track["x"], rtol=0, atol=limit)
        assert np.allclose(turn @ a.track["P"] @ turn.T, b.track["P"], rtol=limit, atol=limit)


# Whatever comes, numbers stay numbers.


def sound(track):
    numbers = [track.x, track.P, track.mu, *(track.track[name] for name in ("x", "P", "curve", "growth"))]
    assert all(np.isfinite(part).all() for part in numbers)
    assert track.mu.sum() == pytest.approx(1.0, abs=1e-6)
    assert track.mu.min() >= 0.0
    for P in (*track.P, track.track["P"]):
        assert positive(P)


def flown(name, **changes):
    rng, track = np.random.default_rng(8), solo(name, outliers=0.05, **changes)
    for k in range(1, 6):
        track.advance(4.0 * k).update(seen(rng, 4.0 * k, X0 + 4.0 * k * np.array([*X0[2:], 0, 0])))
    return track


@EVERY
@pytest.mark.parametrize("P", [np.zeros((4, 4)), np.diag([0.0, 1e4, 0.0, 0.0]), np.ones((4, 4)) * 1e4])
def test_singular_covariances(name, P):
    track = solo(name).start(X0, P)
    sound(track)
    for k in range(3):
        plot = polar(4.0 * k, 100e3, 0.64)
        assert math.isfinite(track.advance(4.0 * k).log_likelihood(plot[0]))
        sound(track.update(plot))


@EVERY
@pytest.mark.parametrize("distance", [0.0, 1.0, 100.0])
def test_a_target_at_the_radar(name, distance):
    track = Solo(**FILTERS[name]).start([0.0, 0.0, 100.0, 0.0], P0)
    for k, azimuth in enumerate((1.5, 4.0, 0.1)):
        plot = polar(4.0 * k, distance, azimuth, doppler=100.0)
        assert math.isfinite(track.advance(4.0 * k).log_likelihood(plot[0]))
        sound(track.update(plot, [0.9], 0.1))


@EVERY
@pytest.mark.parametrize(("beta", "miss"), [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0), (1e-300, 1.0)])
def test_certain_and_impossible_plots(name, beta, miss):
    """β = 0 with a miss of 1 is P_D = 0, no miss at all is P_D = 1; nothing at all leaves the prediction."""
    track = flown(name).advance(24.0)
    before = track.P.copy()
    sound(track.update(polar(24.0, 100e3, 0.64), [beta], miss))
    if beta < 1.0:
        assert np.allclose(track.P, before, rtol=1e-9)


@EVERY
def test_no_time_passes(name):
    track = flown(name)
    before = [track.x.tobytes(), track.P.tobytes(), track.mu.tobytes(), track.track.tobytes()]
    for t in (20.0, 19.0, -1e9, math.nan):
        track.advance(t)
        assert before == [track.x.tobytes(), track.P.tobytes(), track.mu.tobytes(), track.track.tobytes()]
    sound(track.update(polar(20.0, 100e3, 0.64)))


@EVERY
@pytest.mark.parametrize("outliers", [0.0, 0.05])
@pytest.mark.parametrize("sigmas", [20.0, 1e3])
def test_a_measurement_far_out(name, sigmas, outliers):
    track = flown(name).advance(24.0)
    track.par["outliers"] = outliers
    r, a = (float(v) for v in polar_of(track.track["x"]))
    plot = polar(24.0, r + sigmas * 80.0, a + sigmas * 0.004)
    assert math.isfinite(track.log_likelihood(plot[0]))
    sound(track.update(plot, [0.5], 0.5))
    sound(track.advance(28.0))


@EVERY
def test_an_hour_without_a_plot(name):
    track = flown(name).advance(3620.0)
    sound(track)
    for k in range(5):
        plot = polar(3620.0 + 4.0 * k, 200e3 + 500.0 * k, 1.0)
        assert math.isfinite(track.advance(3620.0 + 4.0 * k).log_likelihood(plot[0]))
        sound(track.update(plot))
    # Five plots make a track again: within five times the plots' own deviation, 350 m.
    distance = math.dist(track.track["x"][:2], (plot["e"][0], plot["n"][0]))
    assert distance < 5 * 350.0


@EVERY
def test_a_hundred_random_lives(name):
    rng = np.random.default_rng(9)
    for _ in range(20):
        A = rng.normal(size=(4, 4)) * np.array([[300.0], [300.0], [50.0], [50.0]])
        track = Solo(**FILTERS[name]).start(rng.normal(size=4) * [2e4, 2e4, 300, 300], A @ A.T)
        t = 0.0
        for _ in range(15):
            t += rng.exponential(4.0)
            track.advance(t)
            m = rng.integers(1, 5)
            e, n = track.track["x"][:2]
            near = [
                (t + 0.1 * rng.normal(), abs(math.hypot(e, n) + 500 * rng.normal()), rng.normal())
                for _ in range(m)
            ]
            azimuth, doppler = math.atan2(e, n), [np.nan, 100.0]
            table = np.concatenate(
                [polar(lag, r, azimuth + 0.05 * d, doppler=rng.choice(doppler)) for lag, r, d in near]
            )
            share = rng.dirichlet(np.ones(m + 1))
            assert all(math.isfinite(track.log_likelihood(plot)) for plot in table)
            sound(track.update(table, share[:-1], share[-1]))


def test_the_same_again_is_the_same_bit_by_bit():
    a, b = flown("imm all"), flown("imm all")
    assert a.track.tobytes() == b.track.tobytes()
