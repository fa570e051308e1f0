"""Confirmed tracks of the Gaussian filters: consistent in a matched world, and better where one turns."""

import math

import numpy as np
import pytest
from bank_cases import FILTERS, RADAR, Solo, motion, seen
from scipy.stats import chi2

from radar_console.tracker import modes

T = RADAR.rotation
RUNS, STEPS = 100, 30
P0 = np.diag([100.0**2, 100.0**2, 15.0**2, 15.0**2])
MATCHED = {"outliers": 0.0, "gate_probability": 0.9999}


def own_components(par, k, n):
    """Which components (n,) beyond position and velocity the k-th model uses."""
    return np.array([i >= 4 and modes.has(int(par["model"][k]), i, n) for i in range(n)])


def matched(rng, par, n):
    """Truths (STEPS + 1, n) of a target that does what the filter believes, models switching included."""
    k, x = 0, np.zeros(n)
    r, a, b = rng.uniform(60e3, 150e3), rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi)
    x[:4] = r * math.sin(a), r * math.cos(a), 200 * math.sin(b), 200 * math.cos(b)
    count = int(par["models"])
    leave = np.array(par["leave"][:count], float)
    if count > 1:
        k = rng.choice(count, p=(1 / leave) / (1 / leave).sum())
    prior = np.sqrt([0.0] * 4 + [modes.prior_variance(i, n, par) for i in range(4, n)])
    own = own_components(par, k, n)
    x[own] = prior[own] * rng.normal(size=own.sum())
    path = [x.copy()]
    for _ in range(STEPS):
        if count > 1 and rng.random() < 1 - math.exp(-T * leave[k]):
            k = rng.choice([i for i in range(count) if i != k])
            before, own = own, own_components(par, k, n)
            fresh = own & ~before
            x[fresh] = prior[fresh] * rng.normal(size=fresh.sum())
            x[before & ~own] = 0.0
        mean, Q = motion(int(par["model"][k]), par, x, T)
        U, s, _ = np.linalg.svd(Q)
        x = mean + U @ (np.sqrt(s) * rng.normal(size=n))
        path.append(x.copy())
    return np.array(path)


def distance(solo, plot):
    """d² of a plot's position, from the track's moments."""
    nu = np.array([plot["e"], plot["n"]]) - solo.track["x"][:2]
    S = solo.track["P"][:2, :2] + [[plot["ee"], plot["en"]], [plot["en"], plot["nn"]]]
    return nu @ np.linalg.solve(S, nu)


def errors(name, doppler=False, seed=1, **changes):
    """NEES and NIS (RUNS, STEPS); NIS is of the position alone."""
    rng = np.random.default_rng(seed)
    nees, nis = np.empty((RUNS, STEPS)), np.empty((RUNS, STEPS))
    for run in range(RUNS):
        solo = Solo(**(MATCHED | FILTERS[name] | changes))
        truth = matched(rng, solo.par, solo.x.shape[1])
        solo.start(truth[0, :4] + np.sqrt(np.diag(P0)) * rng.normal(size=4), P0)
        for k in range(STEPS):
            plot = seen(rng, T * (k + 1), truth[k + 1], doppler)
            nis[run, k] = distance(solo.advance(T * (k + 1)), plot[0])
            solo.update(plot)
            error = truth[k + 1, :4] - solo.track["x"]
            nees[run, k] = error @ np.linalg.solve(solo.track["P"], error)
    return nees, nis


def band(count, freedom):
    """The 95 % band of the mean of `count` values of χ² with `freedom` degrees."""
    return chi2.ppf([0.025, 0.975], count * freedom) / count


@pytest.mark.parametrize("doppler", [False, True])
@pytest.mark.parametrize("name", FILTERS)
def test_errors_are_what_the_filter_believes(name, doppler):
    """Within the 95 % bands of 100 runs. NEES is averaged over the steps of a run, which are not
    independent: the band is that of one step. A single turning mode does 0.5°/s: at 3°/s, 4 s between
    plots, what is believed is no Gaussian any more (with Doppler NIS 1.91, linearised 3.0). Several
    modes have the default's switching and turns; their d² is no χ²: what they predict is a mixture, and a
    manoeuvre lasts for several plots. So the band of its mean, 2, comes from the scatter of the runs."""
    several = name.startswith("imm")
    gentle = {"turn_rate_dps": 0.5} if name.endswith(" ct") and not several else {}
    nees, nis = errors(name, doppler, **gentle)
    low, high = band(RUNS, 4)
    assert low < nees.mean() < high
    low, high = band(RUNS * STEPS, 2)
    if several:
        reach = 1.96 * nis.mean(axis=1).std(ddof=1) / math.sqrt(RUNS)
        low, high = 2.0 - reach, 2.0 + reach
    assert low < nis.mean() < high


def manoeuvring(rng, kind):
    """Truth (35, 4) at the times of the plots: a minute at 250 m/s, 20 s of manoeuvre, a minute; its begin.

    The manoeuvre is a turn of 3 g, or 15 m/s² along the track.
    """
    a, b, r = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi), rng.uniform(60e3, 120e3)
    x = np.array([r * math.sin(a), r * math.cos(a), 250 * math.sin(b), 250 * math.cos(b)])
    begin, side, dt = 60.0 + rng.uniform(0, T), rng.choice([-1.0, 1.0]), 0.1
    path = [x.copy()]
    for k in range(1, round(34 * T / dt) + 1):
        acceleration = np.zeros(2)
        if begin <= k * dt < begin + 20.0:
            u = x[2:] / math.hypot(*x[2:])
            acceleration = 29.4 * side * np.array([-u[1], u[0]]) if kind == "turn" else 15.0 * u
        x[:2] += dt * x[2:] + 0.5 * dt * dt * acceleration
        x[2:] += dt * acceleration
        if k % round(T / dt) == 0:
            path.append(x.copy())
    return np.array(path), begin


def flights(name, kind, runs=30, seed=3, **changes):
    """RMSE, m, while straight, and from the begin of the manoeuvre to 8 s after; part of its plots
    outside the gate of 0.9999. Every plot is used, whatever the gate."""
    rng = np.random.default_rng(seed)
    squares, within, outside = [], [], []
    for _ in range(runs):
        truth, begin = manoeuvring(rng, kind)
        solo = Solo(**(MATCHED | FILTERS[name] | changes)).start(truth[0], P0)
        for k in range(1, len(truth)):
            plot = seen(rng, T * k, truth[k])
            d2 = distance(solo.advance(T * k), plot[0])
            solo.update(plot)
            if k > 5:
                squares.append(((solo.track["x"][:2] - truth[k, :2]) ** 2).sum())
                within.append(begin < T * k < begin + 28.0)
                outside.append(d2 > solo.par["gate"])
    squares, within, outside = np.array(squares), np.array(within), np.array(outside)
    rmse = (math.sqrt(squares[chosen].mean()) for chosen in (~within, within))
    return *rmse, outside[within].mean()


@pytest.mark.parametrize("kind", ["turn", "along"])
def test_manoeuvres(kind):
    """Constant velocity has most of the plots outside its gate; a filter that knows the manoeuvre has
    few, and less than 60 % of its error, without being worse in straight flight by more than a fifth."""
    straight, error, outside = flights("kalman", kind)
    assert outside > 0.3
    for name in ("kalman singer", "imm all", "imm cv ct" if kind == "turn" else "imm cv ca"):
        found = flights(name, kind)
        assert found[0] < 1.2 * straight
        assert found[1] < 0.6 * error
        assert found[2] < 0.1


if __name__ == "__main__":
    for kind in ("turn", "along"):
        for name in (
            "kalman",
            "kalman singer",
            "kalman ca",
            "kalman ct",
            "imm cv ct",
            "imm cv ca",
            "imm all",
        ):
            figures = "straight {:.0f} m, manoeuvre {:.0f} m, {:.1%} outside".format(*flights(name, kind))
            print(f"{kind} {name}: {figures}")
