"""The optimal sub-pattern assignment metric between two sets of points [1].

[1] Schuhmacher, Vo, Vo, A consistent metric for performance evaluation of multi-object filters,
    IEEE Transactions on Signal Processing 56 (8), 2008.
"""

from typing import NamedTuple

from numpy.typing import ArrayLike

from radar_console.evaluation.gospa import Gospa, gospa


class Ospa(NamedTuple):
    """An OSPA distance and its parts, m: value^p = location^p + cardinality^p [1, §IV]."""

    value: float
    location: float
    cardinality: float

    def __float__(self) -> float:
        return self.value


def ospa(truth: ArrayLike, estimates: ArrayLike, c: float, p: float = 2.0) -> Ospa:
    """OSPA between the true and the estimated positions [1, (3)]: an error per object, at most c.

    It is GOSPA with α = 1 averaged over the larger set. Two empty sets are 0 apart, an empty one and
    any other `c`.

    Parameters
    ----------
    truth : (n, d) m
    estimates : (m, d) m
    c : cut-off distance, m, > 0
    p : exponent, ≥ 1

    Raises
    ------
    ValueError         as `gospa`
    """
    return averaged(gospa(truth, estimates, c, p, alpha=1.0), c, p)


def averaged(whole: Gospa, c: float, p: float = 2.0) -> Ospa:
    """OSPA from the parts of a GOSPA of the same `c` and `p`, whatever its α: they assign alike."""
    n, m = whole.assigned + whole.missed_count, whole.assigned + whole.false_count
    larger = max(n, m, 1)
    # In units of c^p, so that no power overflows before the root is taken.
    location = (whole.location / c**p + (min(n, m) - whole.assigned)) / larger
    cardinality = abs(n - m) / larger
    return Ospa(
        c * (location + cardinality) ** (1.0 / p), c * location ** (1.0 / p), c * cardinality ** (1.0 / p)
    )
