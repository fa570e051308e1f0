"""Where labels go: greedily, each to the freest of sixteen places about its symbol.

What is on the screen is marked on a coarse board, heavier the more it hurts to be covered. A label
that finds no place with all its lines tries with its name alone, and then stays away: in a crowd
the density decides, track by track. Where a label was it would rather stay.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Board = NDArray[np.int32]

CELL = 4
"""Width of a cell of the board, px."""

HIDDEN = -1
_SYMBOL, _LINE, _FURNITURE, _FAINT, _LABEL = 12, 3, 2, 1, 1000
_TOO_MUCH = 60  # a place that covers more than this is none
_STAY, _FAR, _AGAINST = 14, 6, 8  # what a move, a distance, a place in the direction of motion costs

# North-east first, then around; each near and far.
_DIRECTIONS = np.array(
    [[1, -1], [1, 1], [-1, 1], [-1, -1], [1, 0], [-1, 0], [0, -1], [0, 1]],
    float,
)
_DISTANCES = np.array([13.0, 26.0])
PLACES = len(_DIRECTIONS) * len(_DISTANCES)


def board(width: float, height: float) -> Board:
    """An empty board for a screen."""
    return np.zeros((int(height) // CELL + 1, int(width) // CELL + 1), np.int32)


def mark_symbols(on: Board, x: Floats, y: Floats, radius: float = 7.0, faint: bool = False) -> None:
    """Symbols stand at (n,) x, y; faint ones may be covered if nothing else is free."""
    _mark_boxes(on, x - radius, y - radius, 2.0 * radius, _FAINT if faint else _SYMBOL)


def mark_box(on: Board, left: float, top: float, width: float, height: float) -> None:
    """Figures of the grid stand in this box, px."""
    _add(on, left, top, width, height, _FURNITURE)


def mark_lines(on: Board, x0: Floats, y0: Floats, x1: Floats, y1: Floats) -> None:
    """Lines run from (n,) x0, y0 to x1, y1."""
    _mark_lines(on, x0, y0, x1, y1, _LINE)


def place(
    on: Board, x: Floats, y: Floats, ahead: Floats, sizes: Floats, previous: Integers, insist: Integers
) -> tuple[Integers, Integers, Floats, Floats]:
    """Place labels in the order given; the first ones choose first.

    Parameters
    ----------
    on : the board; labels are marked on it
    x, y : (n,) symbols, px
    ahead : (n, 2) unit vector of motion on the screen, or zero
    sizes : (n, 2, 2) width and height, px, in full and with the name alone
    previous : (n,) the place each had, or HIDDEN
    insist : (n,) not zero: shown whatever it covers

    Returns
    -------
    place : (n,) 0 … PLACES - 1, or HIDDEN
    level : (n,) 0 in full, 1 the name alone
    left, top : (n,) corners of the labels, px
    """
    return _place(on, x, y, ahead, sizes, previous, insist)


@njit(cache=True, nogil=True)
def _mark_boxes(on: Board, left: Floats, top: Floats, side: float, weight: int) -> None:
    for k in range(len(left)):
        _add(on, left[k], top[k], side, side, weight)


@njit(cache=True, nogil=True)
def _add(on: Board, left: float, top: float, width: float, height: float, weight: int) -> None:
    rows, columns = on.shape
    for i in range(max(int(top) // CELL, 0), min(int(top + height) // CELL + 1, rows)):
        for j in range(max(int(left) // CELL, 0), min(int(left + width) // CELL + 1, columns)):
            on[i, j] += weight


@njit(cache=True, nogil=True)
def _mark_lines(on: Board, x0: Floats, y0: Floats, x1: Floats, y1: Floats, weight: int) -> None:
    rows, columns = on.shape
    for k in range(len(x0)):
        dx, dy = x1[k] - x0[k], y1[k] - y0[k]
        steps = int(max(abs(dx), abs(dy)) / CELL) + 1
        if steps > 4 * (rows + columns):
            continue  # far outside
        for step in range(steps + 1):
            i = math.floor((y0[k] + dy * step / steps) / CELL)
            j = math.floor((x0[k] + dx * step / steps) / CELL)
            if 0 <= i < rows and 0 <= j < columns:
                on[i, j] += weight


@njit(cache=True, nogil=True)
def _cost(on: Board, left: float, top: float, width: float, height: float, limit: int) -> int:
    """What a box would cover, counted until it passes `limit`; much, if it leaves the screen."""
    rows, columns = on.shape
    if left < 0 or top < 0 or left + width >= columns * CELL or top + height >= rows * CELL:
        return 15 * _LABEL
    total = 0
    for i in range(int(top) // CELL, int(top + height) // CELL + 1):
        for j in range(int(left) // CELL, int(left + width) // CELL + 1):
            total += on[i, j]
        if total > limit:
            break
    return total


@njit(cache=True, nogil=True)
def _place(
    on: Board, x: Floats, y: Floats, ahead: Floats, sizes: Floats, previous: Integers, insist: Integers
) -> tuple[Integers, Integers, Floats, Floats]:
    count = len(x)
    choice, level = np.full(count, HIDDEN), np.zeros(count, np.int64)
    left, top = np.zeros(count), np.zeros(count)
    for k in range(count):
        for lines in range(2):
            width, height = sizes[k, lines, 0], sizes[k, lines, 1]
            best = np.inf
            for candidate in range(PLACES):
                way = _DIRECTIONS[candidate % len(_DIRECTIONS)]
                distance = _DISTANCES[candidate // len(_DIRECTIONS)]
                norm = math.hypot(way[0], way[1])
                corner_x = x[k] + way[0] / norm * distance + (way[0] - 1.0) * 0.5 * width
                corner_y = y[k] + way[1] / norm * distance + (way[1] - 1.0) * 0.5 * height
                limit = 20 * _LABEL if insist[k] else _TOO_MUCH
                covered = _cost(on, corner_x, corner_y, width, height, limit)
                if covered > limit:
                    continue
                towards = (way[0] * ahead[k, 0] + way[1] * ahead[k, 1]) / norm
                cost = covered + _AGAINST * max(towards, 0.0) + 0.5 * (candidate % len(_DIRECTIONS))
                cost += _FAR * (candidate // len(_DIRECTIONS))
                if previous[k] != HIDDEN and previous[k] != candidate:
                    cost += _STAY
                if cost < best:
                    best = cost
                    choice[k], level[k], left[k], top[k] = candidate, lines, corner_x, corner_y
            if choice[k] != HIDDEN:
                _add(on, left[k], top[k], width, height, _LABEL)
                break
    return choice, level, left, top
