"""Where a track's next plot may be, and when the beam gets there."""

import math
from typing import Any

from radar_console.tracker.kernels import bare
from radar_console.tracker.records import CONFIRMED, STARTER

MARGIN = math.radians(0.05)
_TURN = 2.0 * math.pi
_SMALL = 0.05  # rad, below which six terms of a series are enough
_SPEED_SIGMAS = 2.0
_SURE_SIGMAS = 4.5
_DENSE_LIMIT = 9.21  # γ for 99 %: plots farther off in dense clutter say less for a target than a miss


def threshold(probability: float) -> float:
    """γ with P(d² ≤ γ) = `probability` for a position, χ² with two degrees of freedom."""
    return -2.0 * math.log1p(-probability)


@bare
def wrap(angle: float) -> float:
    """The same angle in (-π, π]."""
    return angle - _TURN * math.ceil(angle / _TURN - 0.5)


@bare
def arctangent(y: float, x: float) -> float:
    """atan2(y, x): by its series, to the last digit, where it is as small as most are seen from a radar."""
    if not abs(y) < _SMALL * x:
        return math.atan2(y, x)
    q = y / x
    q2 = q * q
    return q - q * q2 * (1.0 / 3.0 - q2 * (0.2 - q2 * (1.0 / 7.0 - q2 * (1.0 / 9.0 - q2 / 11.0))))


@bare
def arcsine(q: float) -> float:
    """asin(q) for 0 ≤ q ≤ 1, where it is small by a series that is no less, and too much by 1e-9 at most."""
    if q > _SMALL:
        return math.asin(q)
    q2 = q * q
    return q * (1.0 + q2 * (1.0 / 6.0 + 0.08 * q2))


@bare
def place(track: Any, T: float) -> tuple[float, float]:
    """East and north `T` s after the track's time, see `predicted`."""
    x, curve = track.x, track.curve
    half = 0.5 * T * T
    return x[0] + T * x[2] + half * curve[0], x[1] + T * x[3] + half * curve[1]


@bare
def predicted(track: Any, T: float) -> tuple[float, float, float, float, float]:
    """The forecast: position `T` s after the track's time, and its covariance ee, en, nn.

    What the filter expects of the target's acceleration is in the track's `curve`, and how the
    position's covariance grows beyond that of a straight flight in its `growth`, times T³. For
    nearly constant velocity that is exact, with q/3; other filters fit both to their own
    prediction one turn ahead.
    """
    x, P, curve, growth = track.x, track.P, track.curve, track.growth
    T2, T3 = T * T, T * T * T
    return (
        x[0] + T * x[2] + 0.5 * T2 * curve[0],
        x[1] + T * x[3] + 0.5 * T2 * curve[1],
        P[0, 0] + 2.0 * T * P[0, 2] + T2 * P[2, 2] + T3 * growth[0],
        P[0, 1] + T * (P[0, 3] + P[1, 2]) + T2 * P[2, 3] + T3 * growth[1],
        P[1, 1] + 2.0 * T * P[1, 3] + T2 * P[3, 3] + T3 * growth[2],
    )


@bare
def extent(
    de: float, dn: float, ee: float, en: float, nn: float, sd_range: float, sd_azimuth: float, gamma: float
) -> tuple[float, float]:
    """How far a gate reaches, seen from the radar: half its width, rad, and half its depth, m.

    The gate is the ellipse dᵀ S⁻¹ d ≤ γ about (de, dn), where S is the covariance and a polar
    measurement's together. The width is the larger angle of its two tangents with the line of
    sight; π where the ellipse contains the radar, or reaches around it.
    """
    r2 = de * de + dn * dn
    if r2 == 0.0:
        return math.pi, math.inf
    r = math.sqrt(r2)
    u_e, u_n = de / r, dn / r
    uu = gamma * (u_e * u_e * ee + 2.0 * u_e * u_n * en + u_n * u_n * nn + sd_range * sd_range)
    ww = gamma * (u_n * u_n * ee - 2.0 * u_e * u_n * en + u_e * u_e * nn + r2 * sd_azimuth * sd_azimuth)
    uw = gamma * (u_e * u_n * (ee - nn) + (u_n * u_n - u_e * u_e) * en)
    # A line at angle θ touches the ellipse where (r² - uu) tan²θ + 2 uw tanθ - ww = 0.
    if r2 <= 1.000001 * uu:
        return math.pi, math.inf
    width = arctangent(abs(uw) + math.sqrt(uw * uw + (r2 - uu) * ww), r2 - uu)
    along = math.sqrt(uu)
    return width, along + 0.5 * ww / (r - along)


@bare
def limit(track: Any, par: Any) -> float:
    """γ of the track's gate; less for a young one in dense clutter, where every plot makes a branch."""
    gate: float = par.gate
    return min(gate, _DENSE_LIMIT) if track.dense and track.level != CONFIRMED else gate


@bare
def look(track: Any, beam: Any, par: Any) -> tuple[float, float]:
    """Set the track's beam phase and its gate's extent; until which beam angle and time it can rest.

    Both are -inf if the beam is in the gate, or may be.
    """
    T = max(beam.t - track.t, 0.0)
    if track.level == STARTER:
        if not (track.s_e == beam.e and track.s_n == beam.n):
            sight(track, beam, par)
        # Where a target can have got to; the ellipse of its unknown velocity reaches farther.
        r, reach, angle = track.range, track.spread + par.max_speed * T, track.turned
        h, along = (arcsine(reach / r), reach) if reach < r else (math.pi, math.inf)
    else:
        e, n, ee, en, nn = predicted(track, T)
        de, dn = e - beam.e, n - beam.n
        r = math.sqrt(de * de + dn * dn)
        gamma = limit(track, par) * (2.0 if par.rectangle else 1.0)  # of the ellipse around the rectangle
        h, along = extent(de, dn, ee, en, nn, track.sd_range, track.sd_azimuth, gamma)
        angle = turned(track, de, dn)
    track.rho = beam.phi - track.psi - _TURN - angle
    track.range, track.half_width, track.along = r, h, along
    if track.claims:
        return -math.inf, -math.inf
    return resting(track, beam, par)


@bare
def sight(track: Any, beam: Any, par: Any) -> None:
    """Set what a starter, which stands still, keeps as long as the sensor does."""
    de, dn = track.x[0] - beam.e, track.x[1] - beam.n
    r = math.sqrt(de * de + dn * dn)
    noise = track.sd_range * track.sd_range + (r * track.sd_azimuth) ** 2
    track.range, track.spread, track.turned = r, start_reach(track, 0.0, noise, par), turned(track, de, dn)
    track.s_e, track.s_n = beam.e, beam.n


@bare
def turned(track: Any, de: float, dn: float) -> float:
    """The angle from the bearing of the last pass to that of a place seen from the sensor."""
    return arctangent(de * track.u_n - dn * track.u_e, de * track.u_e + dn * track.u_n)


@bare
def resting(track: Any, beam: Any, par: Any) -> tuple[float, float]:
    """Until which beam angle and time a track can rest whose phase and extent are set, see `look`."""
    r, h = track.range, track.half_width
    ahead = -h - MARGIN - track.rho
    if ahead <= 0.0 or h == math.pi:
        return -math.inf, -math.inf
    # Until the beam is there the target moves on, and its gate grows, by `speed` at the most. The angle
    # of that, over the time that the beam should take, is left to it, and that it is seen from nearer
    # then, and aslant; if the beam takes longer, the track wakes by time. Of the way ahead at least half
    # goes by at rest.
    # A starter stands still, and its reach grows by the largest speed; a radar that moves may do the same.
    x, P, speed = track.x, track.P, 2.0 * par.max_speed
    if track.level != STARTER or h > 1.0:
        speed = math.sqrt(x[2] * x[2] + x[3] * x[3]) + 10.0 * math.sqrt(P[2, 2] + P[3, 3]) + par.max_speed
    most = r / speed  # s, in which it gets a radian on
    wait = min(1.25 * par.turn * ahead / _TURN, min(0.25 * ahead, 0.5) * most)
    far = h < 0.4 and wait < 0.05 * most
    return beam.phi + ahead - (1.2 if far else 2.0) * wait / most, beam.t + wait


@bare
def drift(track: Any, lag: float) -> float:
    """How far the track's gate can move in `lag` s, m."""
    x, P = track.x, track.P
    speed: float = math.sqrt(x[2] * x[2] + x[3] * x[3]) + _SURE_SIGMAS * math.sqrt(P[2, 2] + P[3, 3])
    return lag * speed


@bare
def start_reach(track: Any, T: float, noise: float, par: Any) -> float:
    """How far from its first plot a starter's second can be after `T` s; `noise` is its variance."""
    P = track.P
    reach: float = par.max_speed * T + _SPEED_SIGMAS * math.sqrt(P[0, 0] + P[1, 1] + noise)
    return reach


@bare
def too_fast(track: Any, par: Any) -> bool:
    """The track is surely faster than targets are."""
    x, P = track.x, track.P
    slack = _SPEED_SIGMAS * math.sqrt(P[2, 2] + P[3, 3])
    return bool(math.sqrt(x[2] * x[2] + x[3] * x[3]) > par.max_speed + slack)


@bare
def innovation(track: Any, T: float, plot: Any, scale: float) -> tuple[float, float, float, float, float]:
    """Innovation de, dn of a plot `T` s after the track's time, and S; the plot's noise times `scale`."""
    e, n, ee, en, nn = predicted(track, T)
    return plot.e - e, plot.n - n, ee + scale * plot.ee, en + scale * plot.en, nn + scale * plot.nn


@bare
def density_of(track: Any, T: float, plot: Any, scale: float) -> float:
    """N(z; ẑ, S), m⁻², of a plot `T` s after the track's time, its covariance times `scale`."""
    de, dn, ee, en, nn = innovation(track, T, plot, scale)
    det = ee * nn - en * en
    d2 = (nn * de * de - 2.0 * en * de * dn + ee * dn * dn) / det
    return math.exp(-0.5 * d2) / (_TURN * math.sqrt(det))


@bare
def density(track: Any, plot: Any, par: Any) -> float:
    """Gaussian likelihood of the plot, m⁻², predicted to its own time; 0 outside the gate."""
    T = max(plot.t - track.t, 0.0)
    de, dn, ee, en, nn = innovation(track, T, plot, 1.0)
    det = ee * nn - en * en
    d2 = (nn * de * de - 2.0 * en * de * dn + ee * dn * dn) / det
    gate = limit(track, par)
    if par.rectangle:
        # Along and across the line of sight.
        s_e, s_n = plot.e - plot.s_e, plot.n - plot.s_n
        r = max(math.hypot(s_e, s_n), 1e-9)
        u_e, u_n = s_e / r, s_n / r
        uu = u_e * u_e * ee + 2.0 * u_e * u_n * en + u_n * u_n * nn
        ww = u_n * u_n * ee - 2.0 * u_e * u_n * en + u_e * u_e * nn
        along, across = u_e * de + u_n * dn, u_n * de - u_e * dn
        if not (along * along <= gate * uu and across * across <= gate * ww):
            return 0.0
    elif not d2 <= gate:
        return 0.0
    if track.level == STARTER and math.hypot(de, dn) > start_reach(track, T, plot.ee + plot.nn, par):
        return 0.0
    return max(math.exp(-0.5 * d2), 1e-300) / (_TURN * math.sqrt(det))
