"""The phosphor: hits light a float raster, which decays in wall time and is laid over the furniture.

Pixels are packed as Qt's Format_RGB32, 0xffRRGGBB. All kernels work on pixels of the device, x to
the right, y down; (x0, y0) is the radar.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.core.units import TURN
from radar_console.display.palette import Colour, Palette, mix
from radar_console.display.picture import CENTROID_HIT, PLOT_HIT, History
from radar_console.display.projection import Projection

Raster = NDArray[np.float32]
Pixels = NDArray[np.uint32]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LEVELS = 256
WEDGE = math.radians(42.0)
"""How far behind the beam the scope is still tinted."""

FAINTEST = 0.5 / (LEVELS - 1)
_THINNEST, _LEAST = 0.9, 0.1  # px of half a blip's width; part of its light that stays at the least
_LONGEST = 48.0  # px; a blip is not drawn wider, however far the operator zooms in
_SQUARE = 3  # px from the middle of a centroid's square to its edge
_STEPS = 1024  # of the wedge's table


class Phosphor:
    """Two rasters, plots and centroids, and how they shine.

    Attributes
    ----------
    pixels : (height, width) the finished picture
    """

    def __init__(self, width: int, height: int, palette: Palette) -> None:
        self.pixels = np.zeros((height, width), np.uint32)
        self._plots = np.zeros((height, width), np.float32)
        self._centroids = np.zeros((height, width), np.float32)
        self._tint = wedge_table()
        self._no_tint = np.zeros_like(self._tint)
        self.recolour(palette)

    def recolour(self, palette: Palette) -> None:
        """Shine in other colours from now on."""
        self._ramp = phosphor_ramp(palette)
        self._amber = alpha_ramp(palette.centroid)
        self._sweep = _packed(palette.sweep)

    def clear(self) -> None:
        """Dark everywhere."""
        self._plots[:] = 0.0
        self._centroids[:] = 0.0

    def erase(self, projection: Projection, begin: float, end: float) -> None:
        """Dark between two beam angles, rad: the beam renews what it passes (afterglow off)."""
        if end - begin >= TURN:
            self.clear()
            return
        start = begin
        while start < end:  # the test by half planes needs less than half a turn
            stop = min(start + 1.0, end)
            for raster in (self._plots, self._centroids):
                _erase(raster, projection.x0, projection.y0, start, stop)
            start = stop

    def light(
        self,
        projection: Projection,
        history: History,
        rows: Integers,
        glow: Floats,
        position: tuple[float, float, float],
        blip: tuple[float, float],
        ratio: float = 1.0,
    ) -> None:
        """Light hits.

        Parameters
        ----------
        rows : (n,) rows of `history`
        glow : (n,) how bright each is, 0 … 1
        position : where the radar is now, m
        blip : how wide a plot is in azimuth, rad, and how deep in range, m
        ratio : pixels of the device in one of the widget
        """
        azimuth, distance = history.azimuth[rows], history.range[rows]
        east = distance * np.sin(azimuth) + (history.east[rows] - position[0])
        north = distance * np.cos(azimuth) + (history.north[rows] - position[1])
        x, y = projection.to_screen(east, north)
        true_width = 0.5 * blip[0] * distance * projection.scale
        half_width = np.clip(true_width, _THINNEST * ratio, _LONGEST * ratio)
        half_depth = min(max(0.5 * blip[1] * projection.scale, 0.75 * ratio), _LONGEST * ratio)
        # Close to the radar blips crowd into the same pixels: one that is drawn wider shines less.
        dimmed = glow * np.sqrt(np.clip(true_width / (_THINNEST * ratio), _LEAST, 1.0))
        kind = history.kind[rows]
        plot, centroid = kind == PLOT_HIT, kind == CENTROID_HIT
        _light_plots(self._plots, x[plot], y[plot], azimuth[plot], half_width[plot], half_depth, dimmed[plot])
        _light_squares(self._centroids, x[centroid], y[centroid], glow[centroid], round(_SQUARE * ratio))

    def develop(
        self, under: Pixels, decay: float, projection: Projection, beam: float, radius: float, tint: bool
    ) -> None:
        """Let the rasters decay and compose the picture.

        Parameters
        ----------
        under : (height, width) what lies below: map, grid, trails
        decay : what is left of the glow since the last time, 0 … 1
        beam : angle of the sweep, rad
        radius : to which the sweep reaches, px
        tint : show the wedge behind the beam
        """
        _develop(
            self._plots,
            self._centroids,
            under,
            self.pixels,
            np.float32(decay),
            self._ramp,
            self._amber,
            self._tint if tint else self._no_tint,
            self._sweep,
            projection.x0,
            projection.y0,
            math.sin(beam),
            -math.cos(beam),
            radius,
        )


def phosphor_ramp(palette: Palette) -> Pixels:
    """(LEVELS,) colour, and opacity in the highest byte, of every level of glow."""
    stops = palette.phosphor
    table = np.zeros(LEVELS, np.uint32)
    for level in range(LEVELS):
        part = level / (LEVELS - 1)
        place = part * (len(stops) - 1)
        below = min(int(place), len(stops) - 2)
        hue = mix(stops[below], stops[below + 1], place - below)
        opacity = round(255 * min(1.0, 3.0 * part))
        table[level] = (_packed(hue) & 0x00FFFFFF) | (opacity << 24)
    return table


def alpha_ramp(hue: Colour) -> Pixels:
    """(LEVELS,) one colour, whose opacity follows the glow."""
    levels = np.arange(LEVELS, dtype=np.uint32)
    return np.asarray((levels << 24) | (_packed(hue) & 0x00FFFFFF), np.uint32)


def wedge_table() -> NDArray[np.int64]:
    """(1024,) opacity of the tint in 1/65536, by the tangent of the angle behind the beam."""
    tangent = np.arange(_STEPS) / (_STEPS - 1) * math.tan(WEDGE)
    part = 1.0 - np.arctan(tangent) / WEDGE
    return np.asarray(np.round(65536 * 0.17 * part**1.6), np.int64)


def _packed(hue: Colour) -> int:
    return 0xFF000000 | hue[0] << 16 | hue[1] << 8 | hue[2]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _light_plots(
    raster: Raster,
    x: Floats,
    y: Floats,
    azimuth: Floats,
    half_width: Floats,
    half_depth: float,
    glow: Floats,
) -> None:
    """A blip is a soft bar across the beam; where two overlap the brighter one shows."""
    height, width = raster.shape
    for k in range(len(x)):
        cos, sin = math.cos(azimuth[k]), math.sin(azimuth[k])
        half = half_width[k]
        reach_x = half * abs(cos) + half_depth * abs(sin) + 1.0
        reach_y = half * abs(sin) + half_depth * abs(cos) + 1.0
        if not (-reach_x < x[k] < width + reach_x and -reach_y < y[k] < height + reach_y):
            continue
        for row in range(max(int(y[k] - reach_y), 0), min(int(y[k] + reach_y) + 1, height)):
            dy = row + 0.5 - y[k]
            for column in range(max(int(x[k] - reach_x), 0), min(int(x[k] + reach_x) + 1, width)):
                dx = column + 0.5 - x[k]
                along = half + 0.5 - abs(dx * cos + dy * sin)
                across = half_depth + 0.5 - abs(dx * sin - dy * cos)
                if along <= 0.0 or across <= 0.0:
                    continue
                value = np.float32(glow[k] * min(along, 1.0) * min(across, 1.0))
                if value > raster[row, column]:
                    raster[row, column] = value


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _light_squares(raster: Raster, x: Floats, y: Floats, glow: Floats, half: int) -> None:
    """A centroid is a hollow square."""
    height, width = raster.shape
    for k in range(len(x)):
        if not (-half - 1 < x[k] < width + half + 1 and -half - 1 < y[k] < height + half + 1):
            continue
        column, row = math.floor(x[k]), math.floor(y[k])
        value = np.float32(glow[k])
        for dy in range(-half, half + 1):
            for dx in range(-half, half + 1):
                i, j = row + dy, column + dx
                on_edge = abs(dx) == half or abs(dy) == half
                if on_edge and 0 <= i < height and 0 <= j < width and value > raster[i, j]:
                    raster[i, j] = value


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _erase(raster: Raster, x0: float, y0: float, begin: float, end: float) -> None:
    """Dark where the azimuth is in (begin, end], less than half a turn."""
    height, width = raster.shape
    begin_x, begin_y = math.sin(begin), -math.cos(begin)
    end_x, end_y = math.sin(end), -math.cos(end)
    for row in range(height):
        dy = row + 0.5 - y0
        for column in range(width):
            dx = column + 0.5 - x0
            # Clockwise on a screen whose y points down is a positive cross product.
            if begin_x * dy - begin_y * dx > 0.0 and dx * end_y - dy * end_x >= 0.0:
                raster[row, column] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _blend(below: int, above: int, opacity: int) -> int:
    """`opacity` / 256 of the colour `above` over `below`; all channels at once in two halves."""
    rest = 256 - opacity
    red_blue = ((below & 0xFF00FF) * rest + (above & 0xFF00FF) * opacity) >> 8
    green = ((below & 0x00FF00) * rest + (above & 0x00FF00) * opacity) >> 8
    return 0xFF000000 | (red_blue & 0xFF00FF) | (green & 0x00FF00)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _tinted(below: int, above: int, opacity: int, dither: int) -> int:
    """`opacity` / 65536 of `above` over `below`; dithered, since a dark gradient shows its steps."""
    result = 0xFF000000
    for shift in (16, 8, 0):
        low, high = (below >> shift) & 0xFF, (above >> shift) & 0xFF
        result |= (low + (((high - low) * opacity + dither) >> 16)) << shift
    return result


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _develop(
    plots: Raster,
    centroids: Raster,
    under: Pixels,
    out: Pixels,
    decay: np.float32,
    ramp: Pixels,
    amber: Pixels,
    tint: NDArray[np.int64],
    sweep: int,
    x0: float,
    y0: float,
    beam_x: float,
    beam_y: float,
    radius: float,
) -> None:
    height, width = out.shape
    steepest = math.tan(WEDGE)
    per_step = (_STEPS - 1) / steepest
    top, faintest, dark = np.float32(LEVELS - 1), np.float32(FAINTEST), np.float32(0.0)
    for row in range(height):
        for column in range(width):  # a loop of its own, which the compiler makes a vector loop
            plot, centroid = plots[row, column] * decay, centroids[row, column] * decay
            plots[row, column] = plot if plot > faintest else dark
            centroids[row, column] = centroid if centroid > faintest else dark
        dy = row + 0.5 - y0
        dither_row = (row & 3) * 4
        half_chord = math.sqrt(max(radius * radius - dy * dy, 0.0))
        for column in range(width):
            dx = column + 0.5 - x0
            colour: Any = np.int64(under[row, column])
            behind = beam_y * dx - beam_x * dy
            along = beam_x * dx + beam_y * dy
            if 0.0 <= behind < along * steepest and -half_chord < dx < half_chord:
                opacity = tint[int(behind / along * per_step)]
                colour = _tinted(colour, sweep, opacity, _BAYER[dither_row + (column & 3)])
            # Without a test for darkness: glow is scattered, and a branch missed costs more.
            shade: Any = np.int64(ramp[int(plots[row, column] * top)])
            colour = _blend(colour, shade, shade >> 24)
            level = int(centroids[row, column] * top)
            if level > 0:
                shade = np.int64(amber[level])
                colour = _blend(colour, shade, shade >> 24)
            out[row, column] = np.uint32(colour)


_BAYER = np.array([0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5]) * 4096 + 2048
