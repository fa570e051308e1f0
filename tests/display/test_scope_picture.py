"""The picture model against the plainest possible bookkeeping."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radar_console.core.messages import CENTROID, PLOT, TRACK, TRUTH, Radar, Sector, Table, TrackStatus, blank
from radar_console.core.units import TURN
from radar_console.display.picture import (
    CENTROID_HIT,
    LOST_KEPT,
    PLOT_HIT,
    SILENT_TURNS,
    STALLED_AFTER,
    TRAIL_POINTS,
    History,
    Picture,
)

RADAR = Radar("Test", rotation=4.0, max_range=100e3, sd_range=50.0, sd_azimuth=0.002)


def sector(number: int, **tables: Any) -> Sector:
    """Sixteen a turn of 4 s."""
    step, period = TURN / 16, 0.25
    begin, end = number * step, (number + 1) * step
    return Sector(RADAR, number * period, (number + 1) * period, begin, end, begin, **tables)


def rows(time: float, *tracks: tuple[int, TrackStatus]) -> Table:
    table = blank(TRACK, len(tracks))
    table["track"] = [track for track, _ in tracks]
    table["status"] = [status for _, status in tracks]
    table["time"] = time
    table["east"], table["north"] = 10.0 * table["track"], time
    return table


UPDATES = st.lists(
    st.lists(st.tuples(st.integers(0, 120), st.sampled_from(TrackStatus)), max_size=90), max_size=12
)


@settings(max_examples=60)
@given(UPDATES)
def test_live_tracks_names_and_trails_are_those_of_a_dict(
    updates: list[list[tuple[int, TrackStatus]]],
) -> None:
    picture = Picture()
    alive: dict[int, list[float]] = {}
    named: set[int] = set()
    for k, update in enumerate(updates):
        table = rows(float(k), *update)
        picture.take(sector(k, tracks=table))
        for track, status in update:
            if status == TrackStatus.DELETED:
                alive.pop(track, None)
                named.discard(track)
                continue
            alive.setdefault(track, []).append(float(k))
            if status == TrackStatus.CONFIRMED:
                named.add(track)
        for track, number in zip(picture.tracks["track"].tolist(), picture.numbers.tolist(), strict=True):
            assert (number > 0) == (track in named)
            assert picture.name_of(track) == (f"T{number:03d}" if number else "tentative")
        assert sorted(picture.tracks["track"].tolist()) == sorted(alive)
        assert len(set(picture.numbers[picture.numbers > 0])) == np.count_nonzero(picture.numbers)
    for track, times in alive.items():
        row = picture.row_of(track)
        assert row is not None
        trail = picture.trails[row]
        np.testing.assert_array_equal(trail[-len(times) :, 2], times)
        np.testing.assert_array_equal(trail[-len(times) :, 0], 10.0 * track)
        assert np.isnan(trail[: -len(times)]).all()


def test_a_trail_keeps_the_newest_points() -> None:
    picture = Picture()
    for k in range(TRAIL_POINTS + 5):
        picture.take(sector(k, tracks=rows(float(k), (1, TrackStatus.CONFIRMED))))
    np.testing.assert_array_equal(picture.trails[0, :, 2], np.arange(5, TRAIL_POINTS + 5))


def test_a_lost_track_leaves_its_last_position_for_a_while() -> None:
    picture = Picture()
    picture.take(sector(0, tracks=rows(0.0, (1, TrackStatus.CONFIRMED), (2, TrackStatus.TENTATIVE))))
    picture.take(sector(1, tracks=rows(0.5, (1, TrackStatus.DELETED), (2, TrackStatus.DELETED))))
    assert picture.lost["track"].tolist() == [1]  # a tentative track may go without a word
    assert picture.lost["north"].tolist() == [0.5]
    assert picture.lost_numbers.tolist() == [1]
    assert picture.name_of(1) == "T001"
    assert len(picture.tracks) == 0
    picture.take(sector(int(4 * LOST_KEPT) + 4))
    assert len(picture.lost) == 0


def test_a_name_is_never_given_twice() -> None:
    picture = Picture()
    picture.take(sector(0, tracks=rows(0.0, (5, TrackStatus.CONFIRMED))))
    picture.take(sector(1, tracks=rows(1.0, (5, TrackStatus.DELETED))))
    picture.take(sector(2, tracks=rows(2.0, (6, TrackStatus.CONFIRMED))))
    assert picture.name_of(6) == "T002"


def test_the_rotation_is_measured_over_the_last_turn() -> None:
    picture = Picture()
    for k in range(15):
        picture.take(sector(k))
    assert np.isnan(picture.rotation)
    picture.take(sector(15))
    assert picture.rotation == pytest.approx(4.0)
    # From now on the antenna needs 8 s a turn.
    for k in range(16, 48):
        start = 4.0 + 0.5 * (k - 16)
        step = TURN / 16
        picture.take(Sector(RADAR, start, start + 0.5, k * step, (k + 1) * step, k * step))
    assert picture.rotation == pytest.approx(8.0)


def test_the_encoder_stalls_in_wall_time_and_recovers() -> None:
    picture = Picture()
    picture.take(sector(0))
    picture.advance(STALLED_AFTER)
    assert not picture.stalled
    picture.advance(0.01)
    assert picture.stalled
    standing = sector(0)
    picture.take(standing.adding(start=1.0, stop=2.0, begin=standing.end))
    assert picture.stalled  # data comes, but the antenna stands
    picture.take(sector(1))
    assert not picture.stalled


def test_hits_are_kept_polar_with_ground_range_and_unwrapped_beam() -> None:
    picture = Picture()
    for k in range(17):
        picture.take(sector(k))
    plots, centroids = blank(PLOT, 2), blank(CENTROID, 1)
    plots["azimuth"], plots["range"], plots["amplitude"] = [0.5, 0.55], [1000.0, 2000.0], [3.0, 300.0]
    plots["elevation"] = [np.nan, np.pi / 3]
    centroids["azimuth"], centroids["range"], centroids["height"] = 0.52, 5000.0, 3000.0
    picture.take(sector(17, plots=plots, centroids=centroids))
    history = picture.history
    assert history.count == 3
    np.testing.assert_array_equal(history.kind[:3], [PLOT_HIT, PLOT_HIT, CENTROID_HIT])
    np.testing.assert_allclose(history.beam[:3], TURN + np.array([0.5, 0.55, 0.52]))
    # 4000 m below a right-angled triangle 3-4-5; the earth's curvature takes less than 3 m of it.
    np.testing.assert_allclose(history.range[:3], [1000.0, 1000.0, 4000.0], atol=3.0)
    assert history.strength[0] < history.strength[1] == 1.0


def test_the_depth_of_a_range_cell_is_read_from_the_plots() -> None:
    picture = Picture()
    plots = blank(PLOT, 3)
    plots["cell"], plots["range"] = [10, 200, 30], [10.5 * 7.5, 200.5 * 7.5, 30.5 * 7.5]
    picture.take(sector(0, plots=plots[:1].copy()))
    assert np.isnan(picture.cell_depth)
    picture.take(sector(1, plots=plots))
    assert picture.cell_depth == pytest.approx(7.5)
    picture.take(sector(2, plots=plots[:1].copy()))
    assert picture.cell_depth == pytest.approx(7.5)


@given(st.lists(st.integers(0, 9), max_size=30))
def test_the_history_is_a_ring_of_the_newest_hits(counts: list[int]) -> None:
    picture = Picture()
    picture.history = History(capacity=16)
    expected: list[float] = []
    for k, count in enumerate(counts):
        plots = blank(PLOT, count)
        plots["range"] = 100.0 * k + np.arange(count)
        plots["azimuth"] = 0.0
        picture.take(sector(k, plots=plots))
        expected += plots["range"].tolist()
    kept = picture.history.rows(0, picture.history.count)
    np.testing.assert_array_equal(picture.history.range[kept], expected[-16:])


def test_of_several_rows_of_a_target_the_last_is_the_truth() -> None:
    truth = blank(TRUTH, 3)
    truth["target"], truth["east"] = [4, 2, 4], [1.0, 2.0, 3.0]
    picture = Picture()
    picture.take_truth(truth)
    assert dict(zip(picture.truth["target"].tolist(), picture.truth["east"].tolist(), strict=True)) == {
        2: 2.0,
        4: 3.0,
    }


def test_clear_forgets_everything_but_still_counts_revisions() -> None:
    picture = Picture()
    picture.take(sector(0, tracks=rows(0.0, (5, TrackStatus.CONFIRMED))))
    before = picture.revision
    picture.clear()
    assert picture.revision > before
    assert (len(picture.tracks), picture.radar, picture.history.count) == (0, None, 0)


def test_a_single_plot_is_not_shown_until_it_has_a_velocity() -> None:
    picture = Picture()
    first = rows(0.0, (1, TrackStatus.TENTATIVE))
    first["v_east"] = first["v_north"] = 0.0
    picture.take(sector(0, tracks=first))
    assert len(picture.tracks) == 0
    second = rows(4.0, (1, TrackStatus.TENTATIVE))
    second["v_east"], second["v_north"] = 100.0, 0.0
    picture.take(sector(1, tracks=second))
    assert picture.tracks["track"].tolist() == [1]


def test_a_track_that_is_never_heard_of_again_ends() -> None:
    """The row that ended it may have been dropped on the way."""
    picture = Picture()
    picture.take(sector(0, tracks=rows(0.0, (1, TrackStatus.CONFIRMED))))
    k = 0
    while picture.time <= SILENT_TURNS * picture.radar.rotation:
        assert picture.tracks["track"].tolist() == [1]
        k += 1
        picture.take(sector(k))
    assert len(picture.tracks) == 0
