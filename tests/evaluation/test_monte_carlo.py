"""Runs by whatever workers: the same numbers, failures recorded, dead workers replaced."""

import numpy as np
import pytest
from runs_to_do import METRICS, SETTINGS, dies, dies_once, steady, unlucky

from radar_console.evaluation.monte_carlo import carry_out
from radar_console.evaluation.results import Results
from radar_console.evaluation.workers import inline, processes


def done(folder, run, seeds, workers=inline, settings=SETTINGS):
    with Results(folder, {}, settings, METRICS) as results:
        told = []
        progress = carry_out(run, seeds, results, workers, told.append)
        assert told[-1] == progress
        assert [each.done for each in told] == list(range(len(told)))
        return results, progress


def test_every_setting_has_every_seed(tmp_path):
    results, progress = done(tmp_path, steady, range(5, 9))
    assert (progress.done, progress.total, progress.failed) == (12, 12, 0)
    x = results.figures("x")
    np.testing.assert_array_equal(x[1], 10 * x[0])  # the same draws under both settings
    assert x[0].tolist() == [np.random.default_rng(seed).normal() for seed in range(5, 9)]
    assert np.isnan(results.figures("y")[:, [1]]).all()


def test_more_runs_only_add(tmp_path):
    done(tmp_path, steady, range(3))
    before = (tmp_path / "results.csv").read_text().splitlines()
    _, progress = done(tmp_path, steady, range(5))
    assert progress.total == 6
    assert set(before) < set((tmp_path / "results.csv").read_text().splitlines())
    _, progress = done(tmp_path, steady, range(2))
    assert progress.total == 0


def test_stopped_in_the_middle_it_goes_on(tmp_path):
    def stop(progress):
        if progress.done == 5:
            raise KeyboardInterrupt

    with Results(tmp_path / "a", {}, SETTINGS, METRICS) as results, pytest.raises(KeyboardInterrupt):
        carry_out(steady, range(4), results, inline, stop)
    _, progress = done(tmp_path / "a", steady, range(4))
    assert progress.total == 12 - 5
    done(tmp_path / "b", steady, range(4))
    assert (tmp_path / "a" / "results.csv").read_bytes() == (tmp_path / "b" / "results.csv").read_bytes()


def test_a_run_that_fails_is_recorded_and_done_again_alone(tmp_path):
    results, progress = done(tmp_path, unlucky, range(12, 15))
    assert (progress.done, progress.failed) == (9, 3)
    assert [(row.setting, row.seed) for row in results.failed] == [(0, 13), (1, 13), (2, 13)]
    assert results.failed[0].error.startswith("ValueError: an unlucky, number (runs_to_do.py:")
    _, progress = done(tmp_path, unlucky, range(12, 15))
    assert progress.total == 0  # it would fail again; nothing is done over without being asked
    with Results(tmp_path, {}, SETTINGS, METRICS) as results:
        results.forget([13])
        assert carry_out(steady, [13], results).done == 3
        assert not results.failed
        assert len(results.rows) == 9


def test_processes_give_the_same_file(tmp_path):
    done(tmp_path / "one", unlucky, range(10, 16))
    done(tmp_path / "two", unlucky, range(10, 16), processes(2))
    assert (tmp_path / "one" / "results.csv").read_bytes() == (tmp_path / "two" / "results.csv").read_bytes()


def test_a_process_that_dies_is_replaced(tmp_path):
    results, progress = done(tmp_path / "r", dies_once, range(7), processes(2), [{"folder": str(tmp_path)}])
    assert (tmp_path / "died-4").exists()
    assert (progress.done, progress.failed) == (7, 0)
    assert results.figures("x").tolist() == [[0, 1, 2, 3, 4, 5, 6]]


def test_a_run_that_kills_every_process_is_recorded_and_no_other(tmp_path):
    results, progress = done(tmp_path, dies, range(3, 6), processes(1), [{"k": 0}])
    assert (progress.done, progress.failed) == (3, 1)
    (failed,) = results.failed
    assert (failed.seed, failed.error) == (4, "the process that ran it died, 3 times")
