"""What runs under several settings say: means with intervals, and differences to the first setting."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from radar_console.evaluation import intervals
from radar_console.evaluation.intervals import Interval
from radar_console.evaluation.results import Results
from radar_console.evaluation.scoring import Metric

MAIN = (
    "gospa_m",
    "rmse_position_m",
    "rmse_velocity_mps",
    "time_to_confirm_s",
    "continuity",
    "swaps",
    "lost",
    "false_tracks",
    "tracker_ms_per_turn",
)
"""The metrics that are drawn, and said on the terminal."""

RESAMPLES = 2000  # of the bootstrap; its chance moves a bound by some 2 % of the interval


class Summary(NamedTuple):
    """A metric under all settings.

    Attributes
    ----------
    metric : which
    means : of each setting, with a bootstrap interval, over the runs that have it
    differences : of each setting to the first, over the runs that have it under both; NaN for the first
    parts : of each setting, the part of the runs with at least one, with Wilson's interval; only of counts
    """

    metric: Metric
    means: list[Interval]
    differences: list[Interval]
    parts: list[Interval]


def summarise(results: Results, metrics: Sequence[Metric], rng: np.random.Generator) -> list[Summary]:
    """Summaries in the order of the metrics; those that no run has are left out."""
    summaries = []
    for metric in metrics:
        values = results.figures(metric.name)
        there = np.isfinite(values)
        if not there.any():
            continue
        both = there & there[0]
        parts = [
            intervals.proportion(own[has] > 0.0)
            for own, has in zip(values, there, strict=True)
            if metric.counts
        ]
        summaries.append(
            Summary(
                metric,
                [
                    intervals.bootstrap(intervals.average, own[has], rng=rng, resamples=RESAMPLES)
                    for own, has in zip(values, there, strict=True)
                ],
                [NO_DIFFERENCE]
                + [
                    intervals.paired_difference(own[has], values[0][has], rng, resamples=RESAMPLES)
                    for own, has in zip(values[1:], both[1:], strict=True)
                ],
                parts,
            )
        )
    return summaries


_NAN: Any = np.float64("nan")
NO_DIFFERENCE = Interval(_NAN, _NAN, _NAN, 0)


def verdict(metric: Metric, difference: Interval) -> str:
    """``better`` or ``worse`` than the first setting by more than the interval; empty where it can't tell."""
    sign = float(difference.beyond(0.0))
    if not sign or not metric.better:
        return ""
    return "better" if (sign > 0) == (metric.better == "more") else "worse"


def worded(interval: Interval, signed: bool = False) -> str:
    """An interval with as many decimals as its width deserves: ``1,234 [1,201, 1,268]``."""
    value, low, high = (float(bound) for bound in interval[:3])
    if math.isnan(value):
        return "–"
    if signed and value == low == high == 0.0:
        return "0"
    sign = "+" if signed else ""
    if math.isnan(low):
        return f"{value:{sign},.4g}"
    half = 0.5 * (high - low)
    places = min(max(1 - math.floor(math.log10(half)), 0), 9) if half > 0.0 else _places(value)
    value, low, high = (round(bound, places) + 0.0 for bound in (value, low, high))
    return f"{value:{sign},.{places}f} [{low:{sign},.{places}f}, {high:{sign},.{places}f}]"


def _places(value: float) -> int:
    """Decimals of a number without a width: three figures, none where it is whole."""
    if value == round(value):
        return 0
    return max(2 - math.floor(math.log10(abs(value))), 0)
