"""The generalised optimal sub-pattern assignment metric between two sets of points [1].

[1] Rahmathullah, García-Fernández, Svensson, Generalized optimal sub-pattern assignment metric,
    20th International Conference on Information Fusion, 2017.
"""

from typing import NamedTuple

from numpy.typing import ArrayLike

from radar_console.evaluation.assignment import match, points


class Gospa(NamedTuple):
    """A GOSPA distance and its parts: value^p = location + missed + false.

    Attributes
    ----------
    value : m
    location : m^p, Σ d^p over the assigned pairs
    missed, false : m^p, what the unassigned truths and estimates cost
    assigned, missed_count, false_count : how many pairs, truths and estimates those are
    """

    value: float
    location: float
    missed: float
    false: float
    assigned: int
    missed_count: int
    false_count: int

    def __float__(self) -> float:
        return self.value


def gospa(truth: ArrayLike, estimates: ArrayLike, c: float, p: float = 2.0, alpha: float = 2.0) -> Gospa:
    """GOSPA between the true and the estimated positions, and its parts.

    With α = 2 each missed truth and each false estimate costs c^p / 2 [1, Proposition 1]. With a
    smaller α [1, Definition 1] a truth and an estimate that are paired across the cut-off still cost
    c^p together, half for the miss and half for the false one; what one set has more costs c^p / α.
    Points exactly `c` apart count as unassigned, at the same cost. Two empty sets are 0 apart.

    Parameters
    ----------
    truth : (n, d) m
    estimates : (m, d) m
    c : cut-off distance, m, > 0
    p : exponent, ≥ 1; large ones punish outliers
    alpha : (0, 2]; 2 is the one that parts into location, missed and false

    Raises
    ------
    ValueError         a parameter out of its range, sets of different dimension, or a coordinate
                       that is no number
    OverflowError      c^p is beyond the largest float

    Example: `gospa([[0, 0], [9e3, 0]], [[30, 40]], c=5e3)` is √(50² + 5000² / 2) = 3535.9 m.
    """
    if not (c > 0.0 and 1.0 <= p < float("inf") and 0.0 < alpha <= 2.0):
        raise ValueError(f"GOSPA needs c > 0, p >= 1 and 0 < alpha <= 2, not {c}, {p} and {alpha}")
    x, y = points(truth, "truth"), points(estimates, "estimates")
    if len(x) and len(y) and x.shape[1] != y.shape[1]:
        raise ValueError(f"truth has {x.shape[1]} coordinates and estimates {y.shape[1]}")
    n, m = len(x), len(y)
    distance = match(x, y, c, p)[2]
    assigned = len(distance)
    # In units of c^p, so that no power overflows before the root is taken.
    location = float(((distance / c) ** p).sum())
    across, more = 0.5 * (min(n, m) - assigned), abs(n - m) / alpha
    missed = across + (more if n > m else 0.0)
    false = across + (more if m > n else 0.0)
    value = c * (location + missed + false) ** (1.0 / p)
    unit = c**p
    return Gospa(value, location * unit, missed * unit, false * unit, assigned, n - assigned, m - assigned)
