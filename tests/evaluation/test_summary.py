"""What a report says of runs: which of them count, which way is better, and how many decimals are meant."""

import numpy as np
import pytest

from radar_console.evaluation.intervals import Interval
from radar_console.evaluation.report import page
from radar_console.evaluation.results import Results, Row
from radar_console.evaluation.scoring import Metric
from radar_console.evaluation.summary import summarise, verdict, worded

LESS = Metric("error_m", "error", "m", "less", "of a run")
EVENTS = Metric("events", "events", "", "less", "of a run", counts=True)
NEVER = Metric("never", "never", "", "more", "of a run")
METRICS = (LESS, EVENTS, NEVER)


def filled(folder):
    """Twenty runs under two settings; the second errs 1 m more, one of its runs failed, one has no error."""
    results = Results(folder, {}, [{"k": 1}, {"k": 2}], [metric.name for metric in METRICS])
    noise = np.random.default_rng(1).normal(size=20)
    with results:
        for seed in range(20):
            results.add(Row(0, seed, {"error_m": 50.0 + 10.0 * noise[seed], "events": float(seed == 3)}))
            figures = {"events": 0.0} if seed == 4 else {"error_m": 51.0 + 10.0 * noise[seed], "events": 2.0}
            results.add(Row(1, seed, {}, "it <failed>") if seed == 5 else Row(1, seed, figures))
    return results


def test_means_differences_and_parts(tmp_path):
    error, events = summarise(filled(tmp_path), METRICS, np.random.default_rng(2))
    assert (error.metric, events.metric) == (LESS, EVENTS)
    assert [mean.runs for mean in error.means] == [20, 18]
    assert [difference.runs for difference in error.differences] == [0, 18]
    # Pairs differ by 1 m to the last roundings, though the runs spread by 10 m.
    assert error.differences[1][:3] == pytest.approx((1.0, 1.0, 1.0), rel=1e-12)
    assert verdict(LESS, error.differences[1]) == "worse"
    assert not error.parts
    assert [float(part.value) for part in events.parts] == [0.05, 18 / 19]
    assert [part.runs for part in events.parts] == [20, 19]


def test_the_same_runs_give_the_same_page(tmp_path):
    results = filled(tmp_path)
    one, two = (page("<A>", [("who", "&")], results, METRICS, np.random.default_rng(3)) for _ in range(2))
    assert one == two
    for part in ("&lt;A&gt;", "&amp;", "it &lt;failed&gt;", "1 of 40 runs failed", "(18 runs)", "worse"):
        assert part in one


@pytest.mark.parametrize(
    ("bounds", "way", "said"),
    [
        ((1.0, 0.5, 1.5), "more", "better"),
        ((1.0, 0.5, 1.5), "less", "worse"),
        ((-1.0, -1.5, -0.5), "less", "better"),
        ((1.0, -0.5, 2.5), "less", ""),
        ((1.0, 0.0, 2.5), "less", ""),
        ((1.0, 0.5, 1.5), "", ""),
        ((1.0, np.nan, np.nan), "less", ""),
    ],
)
def test_verdicts(bounds, way, said):
    assert verdict(LESS._replace(better=way), Interval(*map(np.float64, bounds), 9)) == said


@pytest.mark.parametrize(
    ("bounds", "signed", "said"),
    [
        ((1234.5678, 1200.1, 1270.2), False, "1,235 [1,200, 1,270]"),
        ((0.97492, 0.97437, 0.97544), False, "0.97492 [0.97437, 0.97544]"),
        ((0.5, 0.1, 0.9), True, "+0.50 [+0.10, +0.90]"),
        ((-0.0001, -3.0, 2.0), True, "+0.0 [-3.0, +2.0]"),
        ((0.0, 0.0, 0.0), True, "0"),
        ((2.0, 2.0, 2.0), False, "2 [2, 2]"),
        ((1 / 3, 1 / 3, 1 / 3), False, "0.333 [0.333, 0.333]"),
        ((12.3456, np.nan, np.nan), False, "12.35"),
        ((np.nan, np.nan, np.nan), False, "–"),
    ],
)
def test_decimals_follow_the_width(bounds, signed, said):
    assert worded(Interval(*map(np.float64, bounds), 9), signed) == said
