"""Resampling: which particles go on, in numbers proportional to their weights.

Every scheme fills `ancestors` (N,) with indices in ascending order; each particle is expected to be
copied N w times. Weights (N,) sum to 1.

Sources: Arulampalam et al., A tutorial on particle filters, IEEE T-SP 50(2), 2002, Algorithm 2
(systematic); Douc, Cappé, Moulines, Comparison of resampling schemes for particle filtering, 2005
(stratified, residual, multinomial).
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation import draws
from radar_console.estimation.draws import Singles
from radar_console.estimation.gaussian import Array

Indices = NDArray[np.int32]
SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL = range(4)

_mix, _uniforms = draws.mix, draws.uniforms
_FIXED = np.uint64(32)  # binary places of a number of copies
_UNIT = 2.0 ** int(_FIXED)
_TO_FIXED = np.uint64(64) - _FIXED
_BLOCK = 16  # pairs that are looked at together
_TO_UNIT = 2.0**-53


@njit(cache=True, nogil=True, error_model="numpy")
def systematic_pairs(terms: Singles, total: float, key: Any, ancestors: Indices, bounds: Any) -> None:
    """Systematic resampling of N particles from the pairs of an alternative and a particle.

    The copies of one alternative stand together. The sums are in fixed point: exact, and no chain
    of slow additions. Where the comb has no tooth in a whole block, nobody is looked at alone.

    Parameters
    ----------
    terms : (alternatives, N) weight of each pair, ≥ 0; their sum is `total`
    ancestors : (N,) filled with the particle of each copy
    bounds : (alternatives + 1,) filled with where each alternative's copies begin
    """
    rows, count = terms.shape
    blocks = (count + _BLOCK - 1) // _BLOCK
    # Unsigned numbers as indices: numba looks at others whether they count from the end.
    filled, share = np.zeros(count + 1, np.int32), np.zeros(blocks * _BLOCK, np.uint64)
    cumulative = _mix(key) >> _TO_FIXED  # the comb's first tooth
    scale = (count * _UNIT + rows * count) / total  # truncation takes less than a unit from each pair
    place, last_place = np.uint64(0), np.uint64(count)
    for row in range(rows):
        bounds[row] = place
        term = terms[row]
        for i in range(count):
            share[i] = np.int64(term[i] * scale)
        for block in range(blocks):
            begin, after = np.uint64(block * _BLOCK), cumulative
            for k in range(_BLOCK):
                after += share[begin + np.uint64(k)]
            if after >> _FIXED != place:
                for k in range(_BLOCK):
                    pair = begin + np.uint64(k)
                    filled[place] = pair  # overwritten by the next one, unless this one has copies
                    cumulative += share[pair]
                    place = min(cumulative >> _FIXED, last_place)
            cumulative = after
        filled[place] = 0
    bounds[rows] = count
    for row in range(rows):
        last = np.int32(0)
        for k in range(bounds[row], bounds[row + 1]):
            last = max(last, filled[k])
            ancestors[k] = last


@njit(cache=True, nogil=True, error_model="numpy")
def resample(scheme: int, weights: Singles, key: Any, ancestors: Indices) -> None:
    """Fill `ancestors` (N,) by one of the four schemes."""
    count = weights.size
    copies, rest, left = np.zeros(count, np.int64), weights.astype(np.float64), count
    if scheme == RESIDUAL:
        for i in range(count):
            copies[i] = math.floor(count * rest[i])
            rest[i] -= copies[i] / count
            left -= copies[i]
    comb = np.empty(left)
    _comb(scheme, key, comb)
    _place(comb, rest, copies)
    k = 0
    for i in range(count):
        for _ in range(copies[i]):
            ancestors[k] = i
            k += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _comb(scheme: int, key: Any, comb: Array) -> None:
    """Fill `comb` (n,) with the scheme's points in [0, 1), in ascending order."""
    n = comb.size
    points = np.empty(n, np.float32)
    _uniforms(key, points)
    one = float(_mix(key) >> np.uint64(11)) * _TO_UNIT
    if scheme in (SYSTEMATIC, STRATIFIED):
        for k in range(n):
            comb[k] = (k + (one if scheme == SYSTEMATIC else points[k])) / n
        return
    # Uniforms in their order: sums of exponential variates, over the sum of one more.
    total = 0.0
    for k in range(n):
        total -= math.log(points[k])
        comb[k] = total
    total -= math.log(one + _TO_UNIT)
    for k in range(n):
        comb[k] /= total


@njit(cache=True, nogil=True, error_model="numpy")
def _place(comb: Array, weights: Array, copies: Any) -> None:
    """Add to `copies` (N,) how many points of the comb fall to each weight."""
    total = 0.0
    for i in range(weights.size):
        total += weights[i]
    i, cumulative = 0, weights[0]
    for k in range(comb.size):
        while cumulative <= comb[k] * total and i < weights.size - 1:
            i += 1
            cumulative += weights[i]
        copies[i] += 1
