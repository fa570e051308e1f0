"""Times of day into one time that runs on: across midnight, and when a clock is set back."""

import numpy as np
from numpy.typing import NDArray

from radar_console.core.geometry import Array
from radar_console.core.units import DAY


def unwrap_days(time_of_day: Array, captured: Array) -> Array:
    """Seconds since the midnight before the first time, of times in the order of the file.

    Of the times that differ by whole days, the one is taken that is nearest to the time before it,
    plus what passed between the captures where these are known.

    Parameters
    ----------
    time_of_day : (n,) s, in [0, 86400)
    captured : (n,) s since anything; NaN unknown
    """
    passed = np.nan_to_num(np.diff(captured))
    days = np.round((passed - np.diff(time_of_day)) / DAY)
    return time_of_day + DAY * np.concatenate(([0.0], np.cumsum(days)))


def steady(time: Array, back: float, ahead: float) -> tuple[Array, NDArray[np.bool_], int]:
    """Mend a series of times that should not run backward.

    A time that jumps while most of the next three go on from before it is a stray, and is not kept.
    If they jump back with it, the clock was set back: this and all later times are moved on, so
    that time goes on from where it was.

    Parameters
    ----------
    time : (n,) s, in the order of the file
    back, ahead : s, a smaller step back or ahead is no jump

    Returns
    -------
    The times (n,), what was added to each is their difference; which are kept (n,); how often the
    clock was set back.
    """
    mended, kept = time.copy(), np.ones(len(time), bool)
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    offset, jumps = 0.0, 0
    last: float | None = None
    values = time.tolist()
    for i, value in enumerate(values):
        now = value + offset
        following = [v + offset for v in values[i + 1 : i + 4]]
        if last is None:
            jumping = True
            going_on = sum(v < now - back for v in following)
        else:
            jumping = now < last - back or now > last + ahead
            going_on = sum(last - back <= v <= last + ahead for v in following) if jumping else 0
        if jumping and following and 2 * going_on > len(following):
            kept[i] = False
        elif last is not None and now < last - back:
            jumps += 1
            offset += last + max(usual, 0.0) - now
            now = value + offset
        mended[i] = now
        if kept[i]:
            last = now if last is None else max(last, now)
    return mended, kept, jumps
