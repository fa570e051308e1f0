"""How sure a figure over runs is: confidence intervals, for one setting and for two on the same seeds.

Runs lie along the last axis, and every function broadcasts over the axes before it. A NaN among the
runs makes the figure and its bounds NaN: who has runs that say nothing leaves them out, and says how
many. Of a single run the bounds are NaN.

[1] Hesterberg, What teachers should know about the bootstrap: resampling in the undergraduate
    statistics curriculum, The American Statistician 69 (4), 2015 ("expanded percentile interval").
[2] Wilson, Probable inference, the law of succession, and statistical inference, Journal of the
    American Statistical Association 22, 1927.
[3] Newcombe, Improved confidence intervals for the difference between binomial proportions based on
    paired data, Statistics in Medicine 17, 1998.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm, t

from radar_console.estimation.gaussian import Array

LEVEL = 0.95
RESAMPLES = 10_000
_AT_ONCE = 4_000_000  # numbers of a batch of resamples, so that memory stays small

Statistic = Callable[[Array], Array]
"""A figure over the runs, (..., n) to (...)."""


class Interval(NamedTuple):
    """A figure and its bounds, each (...); numbers where one figure was asked for.

    Attributes
    ----------
    value : the figure
    low, high : what holds the true one with the probability asked for
    runs : that it was made from
    """

    value: Array
    low: Array
    high: Array
    runs: int

    def beyond(self, value: float = 0.0) -> Array:
        """+1 where the whole interval is above `value`, −1 where it is below, 0 where it can't tell."""
        result: Array = (self.low > value) * 1.0 - (self.high < value) * 1.0
        return result


def average(values: Array) -> Array:
    """The mean over the runs."""
    result: Array = values.mean(axis=-1)
    return result


def middle(values: Array) -> Array:
    """The median over the runs."""
    result: Array = np.median(values, axis=-1)
    return result


def root_mean_square(values: Array) -> Array:
    """√(mean x²): from the RMSE of runs of the same length, the RMSE over all of them."""
    result: Array = np.sqrt(np.square(values).mean(axis=-1))
    return result


def mean(values: ArrayLike, level: float = LEVEL) -> Interval:
    """The mean with Student's interval; `values` (..., n).

    Exact for Gaussian values, and good from some thirty runs on for others. `bootstrap(average,
    values, rng=rng)` asks nothing of their distribution.
    """
    x, n = _runs(values)
    value = average(x) if n else np.full(x.shape[:-1], np.nan)
    if n < 2:
        return _unsure(value, n)
    half = t.ppf(0.5 * (1.0 + level), n - 1) * x.std(axis=-1, ddof=1) / np.sqrt(n)
    return Interval(value, value - half, value + half, n)


def median(
    values: ArrayLike, rng: np.random.Generator, level: float = LEVEL, resamples: int = RESAMPLES
) -> Interval:
    """The median with a bootstrap interval; `values` (..., n)."""
    return bootstrap(middle, values, rng=rng, level=level, resamples=resamples)


def proportion(hits: ArrayLike, runs: int | None = None, level: float = LEVEL) -> Interval:
    """A probability with Wilson's interval [2, (4)], which also holds near 0 and 1.

    Parameters
    ----------
    hits : (...) how many of the `runs`; without `runs`, (..., n) whether each run was one

    Example: `proportion(0, 200)` is 0 with bounds 0 and 0.0188.
    """
    flags = np.asarray(hits, float)
    count, n = (flags.sum(axis=-1), flags.shape[-1]) if runs is None else (flags, runs)
    if not n:
        return _unsure(np.full(count.shape, np.nan), 0)
    p, z = count / n, norm.ppf(0.5 * (1.0 + level))
    scale = 1.0 / (1.0 + z**2 / n)
    centre = scale * (p + 0.5 * z**2 / n)
    half = scale * z * np.sqrt(p * (1.0 - p) / n + 0.25 * (z / n) ** 2)
    # The bounds of none and of all are 0 and 1, not a rounding beside them.
    low, high = np.where(count == 0, 0.0, centre - half), np.where(count == n, 1.0, centre + half)
    return Interval(p, low[()], high[()], n)


def paired_proportions(hits: ArrayLike, against: ArrayLike, level: float = LEVEL) -> Interval:
    """How much likelier an event is under one setting than under another on the same runs [3, method 10].

    Unlike a bootstrap it does not take what never differed for what never will.

    Parameters
    ----------
    hits, against : (n,) whether each run was one, the same run at the same place

    Example: of 50 runs, 36 with both, 12 with the first alone, 2 with the second alone: 0.2 with bounds
    0.0569 and 0.3404.
    """
    first, second = np.asarray(hits, np.bool_), np.asarray(against, np.bool_)
    if first.shape != second.shape or first.ndim != 1:
        raise ValueError(f"paired runs must be two rows of the same length: {first.shape}, {second.shape}")
    n = len(first)
    p, q = proportion(first, level=level), proportion(second, level=level)
    value = np.asarray(float(p.value) - float(q.value))
    if n < 2:
        return _unsure(value, n)
    both, neither = float(np.sum(first & second)), float(np.sum(~first & ~second))
    one, other = float(np.sum(first & ~second)), float(np.sum(~first & second))
    cross = both * neither - one * other
    if cross > 0.0:
        cross = max(cross - 0.5 * n, 0.0)  # for continuity
    margins = (both + one) * (other + neither) * (both + other) * (one + neither)
    phi = cross / np.sqrt(margins) if margins else 0.0

    def reach(x: Array, y: Array) -> Array:
        result: Array = np.sqrt(np.maximum(x**2 - 2.0 * phi * x * y + y**2, 0.0))
        return result

    low = value - reach(p.value - p.low, q.high - q.value)
    high = value + reach(p.high - p.value, q.value - q.low)
    return Interval(value[()], low[()], high[()], n)


def paired_difference(
    values: ArrayLike,
    against: ArrayLike,
    rng: np.random.Generator,
    statistic: Statistic = average,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
) -> Interval:
    """How much larger a figure is under one setting than under another, run by run on the same seeds.

    Parameters
    ----------
    values, against : (..., n), the same run at the same place
    statistic : `average`, `middle` or `root_mean_square`, of each setting before they are subtracted
    """
    return bootstrap(
        lambda x, y: statistic(x) - statistic(y), values, against, rng=rng, level=level, resamples=resamples
    )


def paired_ratio(
    values: ArrayLike,
    against: ArrayLike,
    rng: np.random.Generator,
    statistic: Statistic = average,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
) -> Interval:
    """How many times as large a figure is under one setting as under another; see `paired_difference`.

    It is a ratio of figures, not a mean of ratios, which single small denominators would rule. Over a
    figure that is 0 the ratio is NaN.
    """

    def ratio(x: Array, y: Array) -> Array:
        over, under = statistic(x), statistic(y)
        quotient: Array = np.divide(over, under, out=np.full(np.shape(over), np.nan), where=under != 0.0)[()]
        return quotient

    return bootstrap(ratio, values, against, rng=rng, level=level, resamples=resamples)


def bootstrap(
    statistic: Callable[..., Array],
    *samples: ArrayLike,
    rng: np.random.Generator,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
) -> Interval:
    """A figure of one or several samples of the same runs, with a bootstrap interval.

    Runs are drawn with replacement, the same for all samples and all leading axes, so that what was
    measured on one seed stays together. The bounds are quantiles of the figure over the resamples, a
    little farther out than the level says, as Student's are beside the Gaussian's [1]: without that they
    are too narrow for few runs.

    Parameters
    ----------
    statistic : takes as many arrays (..., n) as there are samples, gives (...)
    samples : (..., n) each, broadcast against one another
    rng : the same state gives the same bounds
    level : probability that the interval holds the true figure
    resamples : how many times all runs are drawn anew

    Raises
    ------
    ValueError         samples of different numbers of runs
    """
    arrays = [np.asarray(sample, float) for sample in samples]
    if len({array.shape[-1] for array in arrays}) != 1:
        raise ValueError(f"samples must be of the same runs, not {[array.shape[-1] for array in arrays]}")
    together = np.broadcast_arrays(*arrays)
    n = together[0].shape[-1]
    value = statistic(*together) if n else np.full(together[0].shape[:-1], np.nan)
    if n < 2:
        return _unsure(value, n)
    batch = max(_AT_ONCE // max(together[0].size, 1), 1)
    drawn = []
    for first in range(0, resamples, batch):
        run = rng.integers(n, size=(min(batch, resamples - first), n))
        drawn.append(statistic(*(array[..., run] for array in together)))
    tail = norm.cdf(-np.sqrt(n / (n - 1)) * t.ppf(0.5 * (1.0 + level), n - 1))
    low, high = np.quantile(np.concatenate(drawn, axis=-1), [tail, 1.0 - tail], axis=-1)
    return Interval(value, low, high, n)


def _runs(values: ArrayLike) -> tuple[Array, int]:
    x = np.asarray(values, float)
    return x, x.shape[-1]


def _unsure(value: Array, runs: int) -> Interval:
    unknown = np.full(np.shape(value), np.nan)[()]
    return Interval(value[()], unknown, unknown, runs)
