"""Where a track's next plot may be, and when the beam gets there."""

import math
from typing import Any

from numba import njit

MARGIN = math.radians(0.05)
_TURN = 2.0 * math.pi
_SPEED_SIGMAS = 2.0


def threshold(probability: float) -> float:
    """γ with P(d² ≤ γ) = `probability` for a position, χ² with two degrees of freedom."""
    return -2.0 * math.log1p(-probability)


@njit(cache=True, nogil=True, error_model="numpy")
def wrap(angle: float) -> float:
    """The same angle in (-π, π]."""
    return angle - _TURN * math.ceil(angle / _TURN - 0.5)


@njit(cache=True, nogil=True, error_model="numpy")
def predicted(track: Any, T: float, q: float) -> tuple[float, float, float, float, float]:
    """Position `T` s after the track's time, and its covariance ee, en, nn."""
    x, P = track.x, track.P
    noise = q * T * T * T / 3.0
    return (
        x[0] + T * x[2],
        x[1] + T * x[3],
        P[0, 0] + 2.0 * T * P[0, 2] + T * T * P[2, 2] + noise,
        P[0, 1] + T * (P[0, 3] + P[1, 2]) + T * T * P[2, 3],
        P[1, 1] + 2.0 * T * P[1, 3] + T * T * P[3, 3] + noise,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def half_width(
    de: float, dn: float, ee: float, en: float, nn: float, sd_range: float, sd_azimuth: float, gamma: float
) -> float:
    """Angle between the line of sight to a gate's centre and the farther of its two tangents.

    The gate is the ellipse dᵀ S⁻¹ d ≤ γ about (de, dn), where S is the covariance and a polar
    measurement's together; π where it contains the radar, or reaches around it.
    """
    r2 = de * de + dn * dn
    if r2 == 0.0:
        return math.pi
    r = math.sqrt(r2)
    u_e, u_n = de / r, dn / r
    uu = gamma * (u_e * u_e * ee + 2.0 * u_e * u_n * en + u_n * u_n * nn + sd_range * sd_range)
    ww = gamma * (u_n * u_n * ee - 2.0 * u_e * u_n * en + u_e * u_e * nn + r2 * sd_azimuth * sd_azimuth)
    uw = gamma * (u_e * u_n * (ee - nn) + (u_n * u_n - u_e * u_e) * en)
    # A line at angle θ touches the ellipse where (r² - uu) tan²θ + 2 uw tanθ - ww = 0.
    if r2 <= 1.000001 * uu:
        return math.pi
    return math.atan((abs(uw) + math.sqrt(uw * uw + (r2 - uu) * ww)) / (r2 - uu))


@njit(cache=True, nogil=True, error_model="numpy")
def look(track: Any, starter: bool, beam: Any, par: Any) -> None:
    """Set the track's beam phase, its gate's half-width, and until when it can sleep."""
    T = max(beam.t - track.t, 0.0)
    e, n, ee, en, nn = predicted(track, T, par.q)
    de, dn = e - beam.e, n - beam.n
    track.rho = beam.phi - track.psi - _TURN - wrap(math.atan2(de, dn) - track.psi)
    h = half_width(de, dn, ee, en, nn, track.sd_range, track.sd_azimuth, par.gate)
    r = math.hypot(de, dn)
    if starter:
        noise = track.sd_range * track.sd_range + (r * track.sd_azimuth) ** 2
        reach = start_reach(track, T, noise, par)
        if reach < r:
            h = min(h, math.asin(reach / r))
    track.half_width = h
    ahead = -h - MARGIN - track.rho
    if ahead <= 0.0 or h == math.pi or track.claims:
        track.wake_angle = -math.inf
        return
    # Half of what is ahead is left to the target's motion, and to the growth of its gate.
    x, P = track.x, track.P
    speed = math.hypot(x[2], x[3]) + 10.0 * math.sqrt(P[2, 2] + P[3, 3]) + par.max_speed
    track.wake_angle = beam.phi + 0.5 * ahead
    track.wake_time = beam.t + min(0.25 * ahead, 0.5) * r / speed


@njit(cache=True, nogil=True, error_model="numpy")
def start_reach(track: Any, T: float, noise: float, par: Any) -> float:
    """How far from its first plot a starter's second can be after `T` s; `noise` is its variance."""
    P = track.P
    reach: float = par.max_speed * T + _SPEED_SIGMAS * math.sqrt(P[0, 0] + P[1, 1] + noise)
    return reach


@njit(cache=True, nogil=True, error_model="numpy")
def too_fast(track: Any, par: Any) -> bool:
    """The track is surely faster than targets are."""
    x, P = track.x, track.P
    slack = _SPEED_SIGMAS * math.sqrt(P[2, 2] + P[3, 3])
    return bool(math.hypot(x[2], x[3]) > par.max_speed + slack)


@njit(cache=True, nogil=True, error_model="numpy")
def density_of(track: Any, T: float, plot: Any, scale: float, q: float) -> float:
    """N(z; ẑ, S), m⁻², of a plot `T` s after the track's time, its covariance times `scale`."""
    e, n, ee, en, nn = predicted(track, T, q)
    ee += scale * plot.ee
    en += scale * plot.en
    nn += scale * plot.nn
    de, dn = plot.e - e, plot.n - n
    det = ee * nn - en * en
    d2 = (nn * de * de - 2.0 * en * de * dn + ee * dn * dn) / det
    return math.exp(-0.5 * d2) / (_TURN * math.sqrt(det))


@njit(cache=True, nogil=True, error_model="numpy")
def density(track: Any, starter: bool, plot: Any, par: Any) -> float:
    """Gaussian likelihood of the plot, m⁻², predicted to its own time; 0 outside the gate."""
    T = max(plot.t - track.t, 0.0)
    e, n, ee, en, nn = predicted(track, T, par.q)
    ee += plot.ee
    en += plot.en
    nn += plot.nn
    de, dn = plot.e - e, plot.n - n
    det = ee * nn - en * en
    d2 = (nn * de * de - 2.0 * en * de * dn + ee * dn * dn) / det
    if not d2 <= par.gate:
        return 0.0
    if starter and math.hypot(de, dn) > start_reach(track, T, plot.ee + plot.nn, par):
        return 0.0
    return math.exp(-0.5 * d2) / (_TURN * math.sqrt(det))
