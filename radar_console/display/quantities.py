"""Numbers as the operator reads them: three significant digits, bearings as 007°, tabular."""

import math
from datetime import datetime, timedelta

NONE = "–"


def significant(value: float) -> str:
    """Three significant digits, at most two behind the point; a dash for NaN."""
    if not math.isfinite(value):
        return NONE
    size = abs(value)
    decimals = 0 if size >= 99.95 else 1 if size >= 9.995 else 2
    return f"{value:.{decimals}f}".replace("-", "−")


def count(number: float) -> str:
    """A whole number, its thousands apart."""
    return f"{number:,.0f}".replace(",", "\u2009")


def bearing(azimuth: float, decimals: int = 0) -> str:
    """An azimuth, rad, as 007° or 007.3°, never 360°."""
    if not math.isfinite(azimuth):
        return NONE
    degrees = round(math.degrees(azimuth) % 360.0, decimals) % 360.0
    width = 3 if decimals == 0 else 4 + decimals
    return f"{degrees:0{width}.{decimals}f}°"


def duration(seconds: float) -> str:
    """mm:ss, or h:mm:ss from an hour on."""
    if not math.isfinite(seconds):
        return NONE
    whole = max(int(seconds), 0)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes:02d}:{rest:02d}"


def moment(seconds: float, epoch: datetime | None) -> str:
    """Date and time of day if the source knows them, otherwise the data time as +h:mm:ss."""
    if not math.isfinite(seconds):
        return NONE
    if epoch is None:
        whole = max(int(seconds), 0)
        return f"+{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
    return (epoch + timedelta(seconds=seconds)).strftime("%Y-%m-%d %H:%M:%S")


def place(latitude_deg: float, longitude_deg: float) -> str:
    """20.706° N 107.531° E"""
    north = "N" if latitude_deg >= 0 else "S"
    east = "E" if longitude_deg >= 0 else "W"
    return f"{abs(latitude_deg):.3f}° {north} {abs(longitude_deg):.3f}° {east}"


def factor(rate: float) -> str:
    """×20, ×0.5; ×max for as fast as it can."""
    return "×max" if math.isinf(rate) else f"×{rate:g}"
