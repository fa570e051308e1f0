"""The study of complexity: events against a plain product, ways beside one another, the whole in small."""

from itertools import product

import numpy as np
import pytest

from radar_console.studies import association_runs, complexity
from radar_console.studies.association_runs import Point, Problem, clusters, enumerate_events, events, problem
from radar_console.studies.work import Work, generator
from radar_console.tracker.association import jpda


def plainly(given):
    """Probabilities of the pairs and the number of events, from the product of all choices."""
    choices = [[(-1, given.miss[t])] for t in range(len(given.miss))]
    for k, t in enumerate(given.row):
        choices[t].append((k, given.w[k]))
    p, total, count = np.zeros(len(given.row)), 0.0, 0
    for event in product(*choices):
        pairs = [k for k, _ in event if k >= 0]
        if len(set(given.col[pairs])) == len(pairs):
            weight = float(np.prod([w for _, w in event]))
            p[pairs] += weight
            total, count = total + weight, count + 1
    return p / total, count


@pytest.mark.parametrize("spacing", [0.1, 0.6, 1.2])
def test_the_enumeration_goes_through_every_event(spacing):
    for run in range(3):
        given = problem(Point("abreast", 4, spacing), generator(1, run))
        p, count = plainly(given)
        assert events(given) == pytest.approx(count, rel=1e-9)
        assert np.allclose(enumerate_events(*given), p, rtol=0, atol=1e-12)
        assert np.allclose(jpda.sparse(*given).p, p, rtol=0, atol=1e-12)


def test_clusters_are_the_whole():
    """Their events multiply to those of the scan, and their probabilities are the same."""
    given = problem(Point("groups", 12, 0.8), generator(2, 0))
    parts = clusters(given)
    assert len(parts) >= 3
    assert sum(len(part.miss) for part in parts) == 12
    assert np.prod([events(part) for part in parts]) == pytest.approx(events(given), rel=1e-9)
    apart = np.sort(np.concatenate([enumerate_events(*part) for part in parts]))
    assert np.allclose(apart, np.sort(jpda.sparse(*given).p), rtol=0, atol=1e-12)


def test_two_tracks_and_two_plots_by_hand():
    """All weights 1: no plot, four with one plot, two with both; each pair is in 2 of 7 events."""
    pair = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    given = Problem(np.ones(2), 2, *pair, np.ones(4))
    assert events(given) == pytest.approx(7.0)
    assert np.allclose(enumerate_events(*given), 2.0 / 7.0)


def test_targets_far_apart_share_no_plots():
    given = problem(Point("abreast", 5, 4.0), generator(3, 0))
    assert len(clusters(given)) == 5


def test_the_study_in_small(monkeypatch, tmp_path):
    monkeypatch.setattr(complexity, "ABREAST", tuple(Point("abreast", n, 1.0) for n in (2, 4, 8, 16, 24)))
    monkeypatch.setattr(complexity, "GROUPS", tuple(Point("groups", n, 0.8) for n in (4, 8, 16, 24)))
    monkeypatch.setattr(complexity, "SPACINGS", (2.0, 0.4, 0.2))
    monkeypatch.setattr(complexity, "CROWDS", (6, 8, 10))
    monkeypatch.setattr(association_runs, "LIMIT", 1e5)
    work = Work(tmp_path, 4, 1)
    found = {each.quantity: each for each in complexity.run(work)}
    growth = found["joint events, all events, abreast: factor for one more target"]
    assert growth.ci_low > 1.5
    assert growth.verdict == "exponential, as the paper says"
    assert found["largest |all events − exact|, probability"].ours < 1e-9
    assert found["largest error of propagation, 8 abreast, 2 radii"].ours < 1e-3
    assert found["past the exact budget, 10 abreast, 0.2 radii"].ours == 0.0
    assert any("cores" in each.verdict for each in found.values())
    assert work.figures == ["complexity-targets.png", "complexity-overlap.png"]
    assert all(5_000 < (tmp_path / name).stat().st_size < 150_000 for name in work.figures)
