"""Thin anti-aliased lines straight into pixels: the map, the grid, all trails at once.

Lines are polylines one after the other in one array; where `starts` is set, a new one begins.
Pixels are packed as Qt's Format_RGB32. A dash is counted in pixels along the line.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Pixels = NDArray[np.uint32]
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

SOLID = (0.0, 0.0)
Dash = tuple[float, float]
"""Drawn and left out, px; (0, 0) is solid."""


def draw(
    pixels: Pixels, x: Floats, y: Floats, starts: Flags, colour: int, opacity: Floats, dash: Dash = SOLID
) -> None:
    """Draw polylines, one pixel wide.

    Parameters
    ----------
    pixels : (height, width) drawn into
    x, y : (n,) vertices; one that is not finite parts the line
    starts : (n,) the vertex begins a polyline
    colour : 0xRRGGBB
    opacity : (n,) of the segment that ends at the vertex, 0 … 1
    """
    _draw(pixels, x, y, starts, colour, opacity, dash[0], dash[1])


def circle(x0: float, y0: float, radius: float) -> tuple[Floats, Floats]:
    """Vertices of a circle, close enough for its curve to be smooth, px."""
    angle = np.linspace(0.0, 2.0 * np.pi, min(max(int(radius), 64), 2048) + 1)
    return x0 + radius * np.cos(angle), y0 + radius * np.sin(angle)


@njit(cache=True, nogil=True)
def _draw(
    pixels: Pixels,
    x: Floats,
    y: Floats,
    starts: Flags,
    colour: int,
    opacity: Floats,
    dash_on: float,
    dash_off: float,
) -> None:
    height, width = pixels.shape
    along, last = 0.0, 0
    for k in range(1, len(x)):
        if starts[k] or not (math.isfinite(x[last]) and math.isfinite(y[last])):
            along, last = 0.0, k
            continue
        if not (math.isfinite(x[k]) and math.isfinite(y[k])):
            last = k
            continue
        length = math.hypot(x[k] - x[last], y[k] - y[last])
        ends = k + 1 == len(x) or starts[k + 1]
        if length < 1.0 and not ends:
            continue  # vertices closer than a pixel are passed over
        _segment(
            pixels, x[last], y[last], x[k], y[k], width, height, colour, opacity[k], along, dash_on, dash_off
        )
        along, last = along + length, k


@njit(cache=True, nogil=True)
def _segment(
    pixels: Pixels,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    width: int,
    height: int,
    colour: int,
    opacity: float,
    along: float,
    dash_on: float,
    dash_off: float,
) -> None:
    """Step along the longer axis; each step shares its ink between two pixels across."""
    dx, dy = x1 - x0, y1 - y0
    steep = abs(dy) > abs(dx)
    if steep:
        x0, y0, x1, y1, dx, dy = y0, x0, y1, x1, dy, dx
        width, height = height, width
    if dx == 0.0:
        return
    slope = dy / dx
    per_step = math.hypot(1.0, slope)
    low, high = min(x0, x1), max(x0, x1)
    # Pixel centres lie at halves. A segment owns the columns in [low, high), so that the joints of
    # a polyline are inked once.
    first, beyond = math.ceil(max(low, 0.0) - 0.5), math.ceil(min(high, width) - 0.5)
    if slope != 0.0:  # leave out what lies above or below the screen
        at_top, at_bottom = x0 + (-1.0 - y0) / slope, x0 + (height + 1.0 - y0) / slope
        first = max(first, math.floor(max(min(at_top, at_bottom), 0.0)))
        beyond = min(beyond, math.ceil(min(max(at_top, at_bottom), width)))
    period = dash_on + dash_off
    for column in range(first, min(beyond, width)):
        if period > 0.0 and (along + abs(column + 0.5 - x0) * per_step) % period >= dash_on:
            continue
        across = y0 + (column + 0.5 - x0) * slope - 0.5
        row = math.floor(across)
        part = across - row
        if 0 <= row < height:
            _ink(pixels, row, column, steep, colour, opacity * (1.0 - part))
        if 0 <= row + 1 < height:
            _ink(pixels, row + 1, column, steep, colour, opacity * part)


@njit(cache=True, nogil=True)
def _ink(pixels: Pixels, row: int, column: int, steep: bool, colour: int, opacity: float) -> None:
    i, j = (column, row) if steep else (row, column)
    below = np.int64(pixels[i, j])
    part = int(opacity * 256.0 + 0.5)
    rest = 256 - part
    red_blue = ((below & 0xFF00FF) * rest + (colour & 0xFF00FF) * part) >> 8
    green = ((below & 0x00FF00) * rest + (colour & 0x00FF00) * part) >> 8
    pixels[i, j] = np.uint32(0xFF000000 | (red_blue & 0xFF00FF) | (green & 0x00FF00))
