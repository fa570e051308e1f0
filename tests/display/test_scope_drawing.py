"""The kernels beneath the scope: lines, labels, the phosphor's wedge, palettes."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.core.units import TURN
from radar_console.display import labels, strokes
from radar_console.display.palette import NIGHT, PALETTES, Palette, code, colour, mix
from radar_console.display.phosphor import LEVELS, Phosphor, phosphor_ramp
from radar_console.display.projection import Projection
from radar_console.display.sweep import Sweep
from radar_console.display.view import View

PIXEL = st.floats(-300.0, 400.0)


def drawn(x: list[float], y: list[float], dash: strokes.Dash = strokes.SOLID) -> np.ndarray:
    """Ink of a white polyline on 100 × 100 black pixels, 0 … 255."""
    pixels = np.full((100, 100), 0xFF000000, np.uint32)
    starts = np.zeros(len(x), bool)
    strokes.draw(pixels, np.array(x), np.array(y), starts, 0xFFFFFF, np.ones(len(x)), dash)
    assert (pixels >> 24 == 0xFF).all()
    return (pixels & 0xFF).astype(float)


def test_a_line_through_pixel_middles_is_sharp() -> None:
    ink = drawn([10.0, 20.0], [30.5, 30.5])
    assert (ink[30, 10:20] == 255).all()
    assert ink.sum() == 10 * 255


@given(PIXEL, PIXEL, PIXEL, PIXEL)
def test_ink_lies_on_the_line_and_stays_on_the_screen(x0: float, y0: float, x1: float, y1: float) -> None:
    ink = drawn([x0, x1], [y0, y1])
    rows, columns = np.nonzero(ink)
    length = np.hypot(x1 - x0, y1 - y0)
    if len(rows):
        across = ((columns + 0.5 - x0) * (y1 - y0) - (rows + 0.5 - y0) * (x1 - x0)) / length
        assert np.abs(across).max() < 1.0 + 1e-9


def test_a_line_is_the_same_from_either_end() -> None:
    np.testing.assert_array_equal(drawn([3.0, 80.0], [5.0, 33.0]), drawn([80.0, 3.0], [33.0, 5.0]))


def test_a_dash_leaves_out_what_it_should() -> None:
    ink = drawn([0.0, 100.0], [50.5, 50.5], (6.0, 4.0))
    assert np.count_nonzero(ink) == 60
    np.testing.assert_array_equal(ink[50, :10] > 0, [True] * 6 + [False] * 4)


def test_a_vertex_that_is_not_finite_parts_the_line() -> None:
    ink = drawn([10.0, 30.0, np.nan, 60.0, 80.0], [20.5, 20.5, np.nan, 20.5, 20.5])
    np.testing.assert_array_equal(np.flatnonzero(ink[20]), [*range(10, 30), *range(60, 80)])


def test_a_start_parts_the_line() -> None:
    pixels = np.full((50, 100), 0xFF000000, np.uint32)
    x, y = np.array([10.0, 30.0, 60.0, 80.0]), np.full(4, 20.5)
    starts = np.array([True, False, True, False])
    strokes.draw(pixels, x, y, starts, 0xFFFFFF, np.ones(4))
    np.testing.assert_array_equal(np.flatnonzero(pixels[20] & 0xFF), [*range(10, 30), *range(60, 80)])


def place(
    x: list[float], y: list[float], board: labels.Board | None = None, previous: list[int] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Places of labels 60 × 28 px (24 × 14 with the name alone), and their boxes."""
    on = labels.board(600, 600) if board is None else board
    count = len(x)
    px, py = np.array(x), np.array(y)
    labels.mark_symbols(on, px, py)
    sizes = np.tile(np.array([[60.0, 28.0], [24.0, 14.0]]), (count, 1, 1))
    before = np.array(previous if previous is not None else [labels.HIDDEN] * count)
    still = np.zeros(count, np.int64)
    chosen, level, left, top = labels.place(on, px, py, np.zeros((count, 2)), sizes, before, still)
    return chosen, np.column_stack([left, top, sizes[np.arange(count), level]])


@given(st.lists(st.tuples(st.floats(0, 599), st.floats(0, 599)), max_size=60))
def test_labels_never_cover_each_other_nor_leave_the_screen(symbols: list[tuple[float, float]]) -> None:
    chosen, boxes = place([x for x, _ in symbols], [y for _, y in symbols])
    boxes = boxes[chosen != labels.HIDDEN]
    assert (boxes[:, :2] >= 0).all()
    # The board is made of whole cells: a label may reach into the last one.
    assert (boxes[:, :2] + boxes[:, 2:] <= 600 + labels.CELL).all()
    for k, one in enumerate(boxes):
        for other in boxes[:k]:
            apart = (one[:2] >= other[:2] + other[2:]) | (other[:2] >= one[:2] + one[2:])
            assert apart.any()


def test_a_lonely_label_stands_north_east() -> None:
    chosen, boxes = place([300.0], [300.0])
    assert chosen[0] == 0
    assert boxes[0, 0] > 300.0
    assert boxes[0, 1] + boxes[0, 3] < 300.0


def test_a_label_stays_where_it_was() -> None:
    chosen, _ = place([300.0], [300.0], previous=[3])
    assert chosen[0] == 3


def test_a_label_turns_away_from_traffic() -> None:
    board = labels.board(600, 600)
    labels.mark_lines(
        board, np.full(5, 305.0), np.linspace(270, 290, 5), np.full(5, 400.0), np.linspace(270, 290, 5)
    )
    chosen, boxes = place([300.0], [300.0], board)
    assert chosen[0] != 0
    assert boxes[0, 1] > 290.0 or boxes[0, 0] + boxes[0, 2] < 305.0


def test_the_ramp_gets_brighter_and_starts_invisible() -> None:
    ramp = phosphor_ramp(NIGHT)
    assert ramp[0] >> 24 == 0
    light = sum((ramp.astype(np.int64) >> shift) & 0xFF for shift in (16, 8, 0))
    assert (np.diff(light) >= 0).all()
    assert len(ramp) == LEVELS


def test_what_is_dark_shows_what_lies_below() -> None:
    phosphor = Phosphor(64, 48, NIGHT)
    under = np.random.default_rng(1).integers(0, 1 << 24, (48, 64)).astype(np.uint32) | np.uint32(0xFF000000)
    on = Projection(1.0, 32.0, 24.0, 64.0, 48.0)
    phosphor.develop(under, 0.9, on, 0.0, 20.0, False)
    np.testing.assert_array_equal(phosphor.pixels, under)


@given(st.floats(0.0, TURN), st.floats(0.01, 3.0))
def test_erase_darkens_exactly_the_sector(begin: float, width: float) -> None:
    phosphor = Phosphor(64, 64, NIGHT)
    phosphor._plots[:] = 1.0
    on = Projection(1.0, 31.3, 33.8, 64.0, 64.0)
    phosphor.erase(on, begin, begin + width)
    rows, columns = np.indices((64, 64)) + 0.5
    azimuth = np.arctan2(columns - on.x0, on.y0 - rows)
    turned = (azimuth - begin) % TURN
    clear_of_edges = np.minimum(np.abs(turned - width), np.minimum(turned, TURN - turned)) > 1e-6
    np.testing.assert_array_equal((phosphor._plots == 0.0)[clear_of_edges], (turned <= width)[clear_of_edges])


def test_the_sweep_jumps_over_a_gap_and_back_to_a_new_start() -> None:
    sweep = Sweep()
    sweep.follow(30.0, 0.02)
    assert sweep.angle == 30.0
    sweep.follow(0.5, 0.02)
    assert sweep.angle == 0.5


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES.keys())
def test_meanings_have_colours_of_their_own_on_every_palette(palette: Palette) -> None:
    hues = {name: getattr(palette, name) for name in ("track", "centroid", "truth", "alarm", "sweep")}
    names = list(hues)
    for k, one in enumerate(names):
        for other in names[:k]:
            assert np.linalg.norm(np.subtract(hues[one], hues[other])) > 60
    for field in fields(Palette):
        if field.name != "phosphor":
            assert colour(code(getattr(palette, field.name))) == getattr(palette, field.name)


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES.keys())
def test_text_can_be_read(palette: Palette) -> None:
    """Contrast of at least 4.5 for what is read, 3 for the grid's figures (WCAG 2.1, 1.4.3 and 1.4.11)."""
    for name, least in (("text", 4.5), ("dim", 4.5), ("track", 4.5), ("alarm", 4.5), ("ring_text", 3.0)):
        assert _contrast(getattr(palette, name), palette.scope) >= least


def _contrast(one: tuple[int, int, int], other: tuple[int, int, int]) -> float:
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(hue: tuple[int, int, int]) -> float:
    part = np.array(hue) / 255.0
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def test_a_projection_keeps_the_whole_rim_on_the_screen() -> None:
    on = Projection.of(View(range_m=1000.0), 900.0, 500.0)
    x, y = on.to_screen([1000.0, 0.0, -1000.0, 0.0], [0.0, 1000.0, 0.0, -1000.0])
    assert (x > 0).all()
    assert (x < 900).all()
    assert (y > 0).all()
    assert (y < 500).all()


@pytest.mark.parametrize("wrong", ["123456", "#12345", "#gggggg"])
def test_a_colour_is_six_digits(wrong: str) -> None:
    with pytest.raises(ValueError, match=r"#rrggbb|invalid literal"):
        colour(wrong)


def test_mix_goes_from_one_to_the_other() -> None:
    assert mix((0, 0, 0), (10, 20, 30), 0.0) == (0, 0, 0)
    assert mix((0, 0, 0), (10, 20, 30), 1.0) == (10, 20, 30)
