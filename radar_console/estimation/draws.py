"""Random numbers without state, and the exponential, for loops over particles that vectorise.

A number is a hash of (key, i): nothing depends on the order of the work or the number of threads,
and a loop over i has no chain through a generator's state. The key is that of one step of one track.

Source of the mixing constants: Steele, Lea, Flood, Fast splittable pseudorandom number generators,
OOPSLA 2014 (64 bits); Wellons, Prospecting for hash functions, 2018, `lowbias32` (32 bits).
"""

import math
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

Singles = NDArray[np.float32]

_LOW = np.uint64(0xFFFFFFFF)
_MIX_A, _MIX_B = np.uint32(0x7FEB352D), np.uint32(0x846CA68B)
_TO_UNIT = np.float32(2.0**-24)
_TO_TURN = np.float32(2.0**-24 * math.pi)
_LN2 = np.float32(math.log(2.0))
_LOG2_E = np.float32(math.log2(math.e))
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1.0), np.float32(2.0)
_LEAST_EXPONENT = np.float32(-87.0)
_LARGEST_EXPONENT = np.float32(87.0)
# The polynomials below are Chebyshev's fits of ln(1 + x)/x on [√½ - 1, √2 - 1], of (eˣ - 1 - x)/x² on
# ±½ ln 2, and of sin x/x and cos x on ±½π.


def _bitcast(source: Any, target: Any, width: Any) -> Any:
    """A compiled function that takes the bits of one type for another's."""

    def declare(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], width)

        return target(source), generate

    return intrinsic(declare)


of_bits = _bitcast(types.int32, types.float32, ir.FloatType())
to_bits = _bitcast(types.float32, types.int32, ir.IntType(32))


@njit(cache=True, nogil=True)
def mix(z: Any) -> Any:
    """64 well mixed bits."""
    z = np.uint64(z) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, nogil=True)
def key(seed: int, track: int, step: int) -> Any:
    """The random key of one step of one track."""
    return mix(mix(mix(np.uint64(seed)) ^ np.uint64(track)) ^ np.uint64(step))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _mix32(x: Any) -> Any:
    """32 well mixed bits."""
    x = np.uint32((x ^ np.uint32(x >> np.uint32(16))) * _MIX_A)
    x = np.uint32((x ^ np.uint32(x >> np.uint32(15))) * _MIX_B)
    return np.uint32(x ^ np.uint32(x >> np.uint32(16)))


@njit(cache=True, nogil=True, error_model="numpy")
def bits(key: Any, out: NDArray[np.uint32]) -> None:
    """Fill `out` (N,) with random bits."""
    low, high = np.uint32(key & _LOW), np.uint32(key >> np.uint64(32))
    for i in range(out.size):
        out[i] = _mix32(np.uint32(_mix32(np.uint32(np.uint32(i) + low)) ^ high))


@njit(cache=True, nogil=True, error_model="numpy")
def uniforms(key: Any, out: Singles) -> None:
    """Fill `out` (N,) from the uniform distribution on (0, 1), in steps of 2⁻²⁴."""
    word = np.empty(out.size, np.uint32)
    bits(key, word)
    for i in range(out.size):
        out[i] = (np.float32(np.int32(word[i] >> np.uint32(8))) + _HALF) * _TO_UNIT


@njit(cache=True, nogil=True, error_model="numpy")
def pairs_of_normals(key: Any, a: Singles, b: Singles) -> None:
    """Fill `a` and `b` (N,) with independent standard normals; the largest value is 5.9.

    Source: Box and Muller, A note on the generation of random normal deviates, 1958.
    """
    word, other = np.empty(a.size, np.uint32), np.empty(a.size, np.uint32)
    bits(key, word)
    bits(mix(key), other)
    for i in range(a.size):
        u = (np.float32(np.int32(word[i] >> np.uint32(8))) + _HALF) * _TO_UNIT
        # u = m 2ᵉ with m in [√½, √2)
        whole = to_bits(u)
        e = (whole - np.int32(0x3F3504F3)) >> np.int32(23)
        m = of_bits(np.int32(whole - np.int32(e << np.int32(23)))) - _ONE
        p = np.float32(0.0874394551)
        p = p * m + np.float32(-0.143773302)
        p = p * m + np.float32(0.149490952)
        p = p * m + np.float32(-0.165606961)
        p = p * m + np.float32(0.199569777)
        p = p * m + np.float32(-0.250021547)
        p = p * m + np.float32(0.333341837)
        p = p * m + np.float32(-0.499999881)
        p = p * m + _ONE
        log_u = p * m + np.float32(e) * _LN2
        r = np.float32(math.sqrt(np.float32(-_TWO * log_u)))
        # Half the angle, within ±½π.
        h = (np.float32(np.int32(other[i]) >> np.int32(8)) + _HALF) * _TO_TURN
        s, c = half_turn(h)
        a[i] = r * (_ONE - _TWO * s * s)
        b[i] = r * _TWO * s * c


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def half_turn(h: Any) -> Any:
    """sin h and cos h of a single-precision |h| ≤ ½π, to 1e-7."""
    y = h * h
    s = np.float32(2.60516617e-06)
    s = s * y + np.float32(-0.000198090464)
    s = s * y + np.float32(0.00833305065)
    s = s * y + np.float32(-0.166666582)
    s = (s * y + _ONE) * h
    c = np.float32(2.31531740e-05)
    c = c * y + np.float32(-0.00138536666)
    c = c * y + np.float32(0.0416635796)
    c = c * y + np.float32(-0.499999046)
    c = c * y + _ONE
    return s, c


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def exponential(x: Any) -> Any:
    """eˣ of a single-precision x, to 2e-7 of it; below -87 it is e⁻⁸⁷, above 87 e⁸⁷."""
    x = min(max(x, _LEAST_EXPONENT), _LARGEST_EXPONENT)
    n = np.float32(math.floor(x * _LOG2_E + _HALF))
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    p = np.float32(0.00139336649)
    p = p * r + np.float32(0.00836319756)
    p = p * r + np.float32(0.041666463)
    p = p * r + np.float32(0.166665763)
    p = p * r + _HALF
    power = of_bits(np.int32((np.int32(n) + np.int32(127)) << np.int32(23)))
    return (p * r * r + r + _ONE) * power
