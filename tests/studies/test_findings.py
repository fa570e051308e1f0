"""Verdicts in words, and the files that a study leaves."""

import json

import numpy as np
import pytest

from radar_console.core.errors import RadarConsoleError
from radar_console.evaluation.intervals import Interval
from radar_console.studies import catalogue, findings
from radar_console.studies.findings import Finding, beside, found, within

HALF = Interval(np.array(0.5), np.array(0.45), np.array(0.55), 200)


def test_verdicts():
    assert within(0.5, 0.4, 0.6) == "as expected (0.4 to 0.6)"
    assert within(0.3, 0.4, 0.6) == "better than the expected 0.4 to 0.6"
    assert within(0.7, 0.4, 0.6) == "falls short of the expected 0.4 to 0.6"
    assert within(0.7, 0.4, 0.6, smaller_is_better=False) == "better than the expected 0.4 to 0.6"
    assert beside(HALF, 0.6) == "better than the reference, 0.6"
    assert beside(HALF, 0.4) == "worse than the reference, 0.4"
    assert beside(HALF, 0.54) == "as the reference, 0.54"


def test_results_have_the_eight_keys(tmp_path):
    rows = [
        found("RMSE", "m", HALF, "good", 0.7),
        Finding("difference", "m", None, 2e-9, None, None, 4, "equal"),
    ]
    findings.write(tmp_path, "Title", "About.", "radar-console study x", rows, ["x.png"])
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    keys = ["quantity", "unit", "published", "ours", "ci_low", "ci_high", "runs", "verdict"]
    assert [list(each) for each in results] == [keys, keys]
    assert results[0]["ci_high"] == 0.55
    assert results[1]["published"] is None
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| RMSE, m | 0.7 | 0.500 | 0.450 … 0.550 | 200 | good |" in report
    assert "| difference, m | – | 2.0e-09 | – | 4 | equal |" in report
    assert "![x](x.png)" in report


def test_a_figure_without_an_interval_has_none_in_the_file():
    nan = np.array(np.nan)
    one = found("RMSE", "m", Interval(np.array(3.0), nan, nan, 1), "one run")
    assert (one.ci_low, one.ci_high) == (None, None)


def test_every_study_of_the_catalogue_can_be_loaded_and_says_what_it_is():
    for name in catalogue.NAMES:
        study = catalogue.load(name)
        assert study.runs >= 100
        assert 10 < len(study.title) < 100
        assert "Running time" in study.about
        assert "aper" in study.about


def test_an_unknown_study_is_named_with_a_suggestion():
    with pytest.raises(RadarConsoleError, match="did you mean filter-rmse"):
        catalogue.load("filter-rsme")
    with pytest.raises(RadarConsoleError, match="expected one of seven-targets, "):
        catalogue.load("xyz")
