"""CPA and TCPA against cases worked by hand, and against a search along the way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from radar_console.core.encounter import closest_approach, course_and_speed, encounter
from radar_console.core.units import DEG, KT, NM

places = st.tuples(*[st.floats(-1e5, 1e5)] * 2)
motions = st.tuples(*[st.floats(-50.0, 50.0)] * 2).filter(lambda v: np.hypot(*v) > 0.01)


@pytest.mark.parametrize(
    ("own_kt", "target", "velocity_kt", "course_deg", "speed_kt", "cpa_nm", "tcpa_min"),
    [
        # head on, 8 NM, 20 kn together: 24 minutes
        (10, (0, 8), (0, -10), 180, 20, 0, 24),
        # crossing ahead: it stays as far ahead as it is, and drifts away from there
        (10, (0, 1), (10, 10), 90, 10, 1, 0),
        # from the north-east on a steady bearing
        (0, (3, 4), (-3, -4), 180 + 36.8699, 5, 0, 60),
        # 3-4-5: along the hypotenuse, from 5 NM east, the leg across is 3 and the leg along is 4
        (0, (5, 0), (-8, 6), 306.8699, 10, 3, 24),
        # it has passed: two NM abeam, six minutes ago
        (0, (2, 1), (0, 10), 0, 10, 2, -6),
    ],
)
def test_cases_by_hand(own_kt, target, velocity_kt, course_deg, speed_kt, cpa_nm, tcpa_min):
    met = encounter((0.0, 0.0), np.array([0, own_kt]) * KT, np.array(target) * NM, np.array(velocity_kt) * KT)
    assert met.course / DEG == pytest.approx(course_deg, abs=1e-4)
    assert met.speed / KT == pytest.approx(speed_kt)
    assert met.cpa / NM == pytest.approx(cpa_nm, abs=1e-9)
    assert met.tcpa / 60.0 == pytest.approx(tcpa_min, abs=1e-9)
    assert met.distance / NM == pytest.approx(np.hypot(*target))


@given(places, motions)
def test_the_closest_is_where_a_search_finds_it(place, motion):
    def distance(t):
        return float(np.hypot(place[0] + motion[0] * t, place[1] + motion[1] * t))

    cpa, tcpa = closest_approach(place, motion)
    reach = np.hypot(*place) / np.hypot(*motion) + 1.0
    found = minimize_scalar(distance, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-6})
    # The search is right to its step along the way.
    assert cpa == pytest.approx(found.fun, abs=1e-3)
    assert distance(float(tcpa)) == pytest.approx(float(cpa), abs=1e-6 * (1.0 + np.hypot(*place)))
    assert distance(float(tcpa)) <= np.hypot(*place) + 1e-6


@given(places, motions, places, motions, st.floats(0.0, 2.0 * np.pi))
def test_only_what_is_relative_counts(place, motion, own, own_motion, angle):
    """Moving both, sailing both along, and turning the world change neither CPA nor TCPA."""
    still = closest_approach(place, motion)
    rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    met = encounter(
        rotation @ own,
        rotation @ own_motion,
        rotation @ np.add(place, own),
        rotation @ np.add(motion, own_motion),
    )
    assert met.cpa == pytest.approx(still[0], abs=1e-4)  # of 1e5 m; speeds add up with a rounding
    assert met.tcpa == pytest.approx(still[1], rel=1e-6, abs=1e-4)


def test_without_relative_motion_the_distance_stays():
    met = encounter((0.0, 0.0), (3.0, 4.0), (300.0, 400.0), (3.0, 4.0))
    assert (met.cpa, met.speed) == (500.0, 0.0)
    assert np.isnan(met.tcpa)


def test_one_own_ship_against_many():
    targets = np.array([[0.0, 1e4], [1e4, 0.0], [0.0, -1e4]])
    many = encounter((0.0, 0.0), (0.0, 5.0), targets, np.zeros(2))
    for k, target in enumerate(targets):
        alone = encounter((0.0, 0.0), (0.0, 5.0), target, np.zeros(2))
        for together, single in zip(many, alone, strict=True):
            assert together[k] == single
    course, speed = course_and_speed([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
    assert course == pytest.approx(np.arange(4) * np.pi / 2)
    assert speed == pytest.approx(1.0)
