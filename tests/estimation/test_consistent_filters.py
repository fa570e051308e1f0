"""Filters claim the errors that they make: NEES and NIS of 100 runs with the model that made the truth.

At every step the mean over the runs lies in its 95 % band with that probability. Steps that follow each other
share their errors, so how many of 30 are inside scatters far more than that of independent ones; what is
asked is that the mean over the steps is inside, and, but for particles, three quarters of the steps.
"""

import numpy as np
import pytest
import radar_runs

from radar_console.evaluation.consistency import chi_square_band, nees, nis

CASES = [(d, doppler) for d in (2, 3) for doppler in (False, True)]


def means(runs, found, first=0):
    """Means over the runs of NEES and NIS, (steps,) each, as parts of their bands: inside is [0, 1]."""
    e = nees(runs.truth, found.mean, found.cov)[first:]
    v = nis(found.nu, found.S)[first:]
    parts = []
    for values, dimension in ((e, runs.truth.shape[-1]), (v, found.nu.shape[-1])):
        low, high = chi_square_band(values.shape[1], dimension)
        parts.append((values.mean(axis=1) - low) / (high - low))
    return parts


def inside(part):
    return (part >= 0) & (part <= 1)


def assert_consistent(runs, found):
    for part in means(runs, found):
        assert inside(part.mean())
        assert inside(part).mean() >= 0.75


@pytest.mark.parametrize(("d", "doppler"), CASES)
def test_of_one_model(d, doppler):
    runs = radar_runs.simulate(d, doppler, np.random.default_rng(2))
    assert_consistent(runs, radar_runs.run_converted(runs))
    for name in ("extended", "unscented"):
        assert_consistent(runs, radar_runs.run_gaussian(name, runs))


@pytest.mark.parametrize(("d", "doppler"), CASES)
@pytest.mark.parametrize("name", ["extended", "unscented"])
def test_of_the_imm_with_the_switching_of_the_truth(d, doppler, name):
    runs = radar_runs.simulate_switching(d, doppler, np.random.default_rng(2))
    assert_consistent(runs, radar_runs.run_imm(runs, name))


@pytest.mark.parametrize(("d", "doppler"), CASES)
def test_of_particles(d, doppler):
    """A cloud's moments err by its number too: enough particles, parted, and scored when the first scans,
    which few of the prior's particles survive, are over.
    """
    runs = radar_runs.simulate(d, doppler, np.random.default_rng(2), steps=12)
    found = radar_runs.run_particles(runs, 2000 if d == 2 else 5000, np.random.default_rng(3), width=0.5)
    for part in means(runs, found, first=8):
        assert inside(part.mean())


def test_a_filter_that_is_not_consistent_is_found_out(monkeypatch):
    """Process noise four times too small, or too large."""
    runs = radar_runs.simulate(2, False, np.random.default_rng(2))
    for factor, low in ((0.25, False), (4.0, True)):
        monkeypatch.setattr(radar_runs, "Q_WHITE", factor)
        part = means(runs, radar_runs.run_gaussian("extended", runs))[0]
        assert not inside(part[10:].mean())
        assert (part[10:].mean() < 0) == low
