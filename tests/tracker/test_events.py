"""Joint events that are drawn, against the sum over all feasible ones."""

import numpy as np
import pytest

from radar_console.estimation import draws
from radar_console.tracker.association import events, jpda
from radar_console.tracker.association.events import NOTHING

DRAWS = 40_000


def sparse(likelihood):
    row, plot = np.nonzero(likelihood[:, 1:])
    return likelihood[:, 0].copy(), likelihood.shape[1] - 1, row, plot, likelihood[row, plot + 1]


def drawn(likelihood, count=DRAWS, seed=1):
    """Columns (tracks, draws) of the dense weights that the tracks have, and whose are drawn."""
    miss, columns, row, col, w = sparse(likelihood)
    choice, known = np.full((len(miss), count), -2, np.int32), np.zeros(len(miss), bool)
    events.draw(miss, columns, row, col, w, np.uint64(draws.key(seed, 1, 1)), choice, known)
    return np.where(choice >= 0, col[choice] + 1, choice - NOTHING), known


def all_events(likelihood):
    """Probability of every feasible event, in the plainest form."""
    result = {}

    def visit(event, weight):
        if weight > 0 and len(event) < len(likelihood):
            for j, w in enumerate(likelihood[len(event)]):
                if j == 0 or j not in event:
                    visit((*event, j), weight * w)
        elif weight > 0:
            result[event] = weight

    visit((), 1.0)
    total = sum(result.values())
    return {event: weight / total for event, weight in result.items()}


def cluster(seed, tracks, plots, density):
    rng = np.random.default_rng(seed)
    likelihood = np.exp(1.5 * rng.normal(size=(tracks, plots + 1)))
    likelihood[:, 1:] *= rng.random((tracks, plots)) < density
    return likelihood


@pytest.mark.parametrize("seed", range(12))
def test_events_come_as_often_as_their_weights_say(seed):
    """χ² of the events' counts; with some 10 to 1,000 events 6 sigma of its normal limit."""
    likelihood = cluster(seed, 4, 4, 0.4 + 0.05 * seed)
    found, known = drawn(likelihood)
    exact = all_events(likelihood[known])
    counts = dict.fromkeys(exact, 0)
    for event in found[:, :].T[:, known]:
        counts[tuple(int(j) for j in event)] += 1  # no other event is ever drawn
    expected = DRAWS * np.array(list(exact.values()))
    often = expected > 5
    chi2 = np.sum((np.array(list(counts.values()))[often] - expected[often]) ** 2 / expected[often])
    assert chi2 < often.sum() + 6 * np.sqrt(2 * often.sum()) + 6


def test_long_chains_have_the_marginals_of_jpda():
    """Fifteen tracks abreast: the error of 40,000 draws is below 0.0025, here five of these."""
    rng = np.random.default_rng(3)
    likelihood = np.zeros((15, 32))
    likelihood[:, 0] = 0.1
    for t in range(15):
        likelihood[t, 1 + 2 * t : 6 + 2 * t][: 31 - 2 * t] = rng.exponential(1.0, min(5, 31 - 2 * t))
    found, known = drawn(likelihood)
    assert known.all()
    for j in range(32):
        assert np.abs((found == j).mean(axis=1) - jpda.marginals(likelihood)[:, j]).max() < 0.0125


def test_those_who_share_nothing_and_what_costs_too_much_are_left_alone():
    apart = np.array([[0.1, 1.0, 0.0], [0.1, 0.0, 1.0]])
    found, known = drawn(apart, 10)
    assert not known.any()
    assert np.all(found == -1)
    assert not drawn(np.ones((20, 21)), 10)[1].any()


def test_the_same_key_gives_the_same_events():
    likelihood = cluster(5, 4, 4, 0.8)
    assert np.array_equal(drawn(likelihood)[0], drawn(likelihood)[0])
    assert not np.array_equal(drawn(likelihood)[0], drawn(likelihood, seed=2)[0])
