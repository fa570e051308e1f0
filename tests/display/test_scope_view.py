"""The operator's view: scales, rings, zoom about a point, change notification."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.core.units import KM, NM
from radar_console.display.projection import Projection
from radar_console.display.view import SCALES, Layer, RangeUnit, View, ring_spacing

SCALE = [(unit, scale) for unit in RangeUnit for scale in SCALES[unit]]
METRES = st.floats(-5e5, 5e5)


@pytest.mark.parametrize(("unit", "scale"), SCALE)
def test_two_to_six_even_rings_on_every_scale(unit: RangeUnit, scale: float) -> None:
    rings = scale / ring_spacing(scale)
    assert rings == pytest.approx(round(rings), abs=1e-9)
    assert 2 <= round(rings) <= 6


def test_rings_of_the_scales_an_operator_knows() -> None:
    assert ring_spacing(300.0) == 50.0
    assert ring_spacing(24.0) == 4.0
    assert ring_spacing(6.0) == 1.0


def test_a_scale_that_nothing_parts_evenly_gets_a_round_spacing() -> None:
    assert ring_spacing(17.0) == 3.0


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan")])
def test_a_scale_must_be_positive(scale: float) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        ring_spacing(scale)


@pytest.mark.parametrize("unit", RangeUnit)
def test_zoom_walks_through_every_scale_and_stops_at_the_ends(unit: RangeUnit) -> None:
    view = View(range_unit=unit, range_m=SCALES[unit][0] * unit.metres)
    seen = [view.scale]
    for _ in range(len(SCALES[unit])):
        view.zoom_out()
        seen.append(view.scale)
    assert seen == pytest.approx([*SCALES[unit], SCALES[unit][-1]])
    for _ in range(len(SCALES[unit])):
        view.zoom_in()
    assert view.scale == pytest.approx(SCALES[unit][0])


def test_zoom_from_between_two_scales_goes_to_the_neighbours() -> None:
    view = View(range_m=120 * KM)
    view.zoom_in()
    assert view.range_m == 100 * KM
    view.range_m = 120 * KM
    view.zoom_out()
    assert view.range_m == 150 * KM


@given(METRES, METRES, METRES, METRES, st.booleans())
def test_the_point_under_the_cursor_stays_there(
    east: float, north: float, centre_east: float, centre_north: float, inwards: bool
) -> None:
    view = View(range_m=100 * KM, centre=(centre_east, centre_north))
    before = Projection.of(view, 1000, 800).to_screen(east, north)
    (view.zoom_in if inwards else view.zoom_out)((east, north))
    after = Projection.of(view, 1000, 800).to_screen(east, north)
    assert view.range_m != 100 * KM
    # The pixel is a difference of numbers of up to 1e4 px; 1e-6 px leaves room for their rounding.
    np.testing.assert_allclose(after, before, atol=1e-6)


@given(METRES, METRES, st.floats(250, 5e5))
def test_the_projection_has_an_inverse(east: float, north: float, range_m: float) -> None:
    on = Projection.of(View(range_m=range_m, centre=(3000.0, -2000.0)), 900, 700)
    x, y = on.to_screen(east, north)
    assert on.to_ground(float(x), float(y)) == pytest.approx((east, north), abs=1e-6)


def test_fit_takes_the_smallest_scale_that_holds() -> None:
    view = View(centre=(1.0, 1.0))
    view.fit(300 * KM)
    assert (view.range_m, view.centre) == (300 * KM, (0.0, 0.0))
    view.fit(301 * KM)
    assert view.range_m == 400 * KM
    view.range_unit = RangeUnit.NM
    view.fit(20 * NM)
    assert view.range_m == pytest.approx(24 * NM)


def test_revision_rises_with_every_change_and_with_nothing_else() -> None:
    view = View()
    start = view.revision
    view.range_m = view.range_m
    assert view.revision == start
    view.toggle(Layer.TRUTH)
    assert view.revision == start + 1
    assert not view.shows(Layer.TRUTH)
    view.selected = 7
    view.pan(10.0, 0.0)
    assert view.revision == start + 3
