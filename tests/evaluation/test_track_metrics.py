"""The story of targets and tracks, on runs small enough to be told by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radar_console.core.messages import TRACK, TRUTH, TrackStatus, blank
from radar_console.evaluation.sampling import snapshots
from radar_console.evaluation.track_metrics import track_metrics

TENTATIVE, CONFIRMED, COASTING, DELETED = TrackStatus
GATE = 100.0


def truth_of(rows):
    """(time, target, east) with all else 0."""
    table = blank(TRUTH, len(rows))
    for name in ("north", "v_east", "v_north"):
        table[name] = 0.0
    for name, column in zip(("time", "target", "east"), zip(*rows, strict=True), strict=True):
        table[name] = column
    return table


def tracks_of(rows):
    """(time, track, east[, status]) at rest; confirmed where nothing is said."""
    table = blank(TRACK, len(rows))
    for name in ("north", "v_east", "v_north"):
        table[name] = 0.0
    for row, (time, track, east, *status) in zip(table, rows, strict=True):
        row["time"], row["track"], row["east"] = time, track, east
        row["status"] = status[0] if status else CONFIRMED
    return table


def standing(targets, times=range(10)):
    """Targets 1 km apart that stay where they are."""
    return truth_of([(t, k, 1000.0 * k) for t in times for k in range(targets)])


def test_a_perfect_run():
    score = track_metrics(
        standing(2), tracks_of([(t, 7 + k, 1e3 * k) for t in range(10) for k in (0, 1)]), GATE
    )
    assert score.target.tolist() == [0, 1]
    assert score.track.tolist() == [7, 8]
    assert score.time_to_confirm.tolist() == [0.0, 0.0]
    assert score.continuity.tolist() == [1.0, 1.0]
    assert score.purity.tolist() == [1.0, 1.0]
    for nothing in (score.fragments, score.swaps, score.lost, score.false, score.duplicate):
        assert not nothing.any()
    assert (score.completeness, score.ambiguity, score.spuriousness) == (1.0, 1.0, 0.0)
    assert (score.position_accuracy, score.velocity_accuracy) == (0.0, 0.0)
    assert (score.position_rmse.value, score.velocity_rmse.value) == (0.0, 0.0)
    assert score.longest_segment.tolist() == [1.0, 1.0]
    assert score.number_changes == 0.0


def test_no_tracks_and_no_targets():
    empty_truth, empty_tracks = truth_of([(0, 0, 0)])[:0], tracks_of([(0, 0, 0)])[:0]
    score = track_metrics(standing(2), empty_tracks)
    assert np.isnan(score.time_to_confirm).all()
    assert score.continuity.tolist() == [0.0, 0.0]
    assert not score.lost.any()  # never held: nothing to lose
    assert score.completeness == 0.0
    assert np.isnan([score.ambiguity, score.spuriousness, score.position_accuracy]).all()
    assert np.isnan([score.position_rmse.value, score.velocity_rmse.value, score.number_changes]).all()
    assert score.longest_segment.tolist() == [0.0, 0.0]
    score = track_metrics(empty_truth, tracks_of([(0, 1, 0.0)]))
    assert len(score.target) == len(score.track) == 0


def test_confirmation_a_gap_and_another_track():
    """Tentative at 0 and 1, held by 5 at 2 to 4, by nobody at 5, by 6 from 6 on."""
    tracks = tracks_of(
        [
            (0, 5, 0.0, TENTATIVE),
            (1, 5, 0.0, TENTATIVE),
            (2, 5, 3.0),
            (5, 5, 0.0, DELETED),
            (6, 6, 4.0, COASTING),
        ]
    )
    score = track_metrics(standing(1), tracks, GATE)
    assert score.time_to_confirm.tolist() == [2.0]
    assert score.continuity.tolist() == [0.7]
    assert (score.fragments.tolist(), score.swaps.tolist()) == ([1], [1])
    assert score.track.tolist() == [5, 6]
    assert score.position_accuracy == pytest.approx((3 * 3.0 + 4 * 4.0) / 7)
    assert score.position_rmse.value == pytest.approx(np.sqrt((3 * 3.0**2 + 4 * 4.0**2) / 7))
    assert score.position_rmse.components == pytest.approx([score.position_rmse.value, 0.0])
    assert score.longest_segment.tolist() == [0.4]  # track 6 at 6 to 9, of ten instants
    assert score.number_changes == pytest.approx(1 / 7)  # one swap in 7 s in which it is held


def test_the_longest_segment_ends_at_a_gap_and_at_another_track():
    """Held by 1 at 0 and 1, by nobody at 2, by 1 from 3 to 5, by 2 from 6 to 9; the other target never."""
    tracks = tracks_of(
        [(0, 1, 0.0), (2, 1, 0.0, DELETED), (3, 1, 0.0), (6, 1, 0.0, DELETED), (6, 2, 0.0), (9.5, 2, 0.0)]
    )
    score = track_metrics(standing(2), tracks, GATE)
    assert score.longest_segment.tolist() == [0.4, 0.0]
    assert (score.fragments.tolist(), score.swaps.tolist()) == ([1, 0], [1, 0])


def test_rmse_is_of_the_track_that_holds_and_its_velocity_counts():
    """A duplicate farther off does not enter; the velocities err by (10, −20) m/s."""
    tracks = tracks_of([(t, 1, 30.0) for t in range(10)] + [(t, 2, 60.0) for t in range(10)])
    tracks["v_east"], tracks["v_north"] = 10.0, -20.0
    score = track_metrics(standing(1), tracks, GATE)
    assert score.position_rmse.components == pytest.approx([30.0, 0.0])
    assert score.velocity_rmse.components == pytest.approx([10.0, 20.0])
    assert score.position_accuracy == pytest.approx(45.0)  # of SIAP: of all tracks near the target


def test_two_tracks_change_targets():
    places = [(0.0, 1000.0)] * 5 + [(1000.0, 0.0)] * 5
    tracks = tracks_of([(t, track, place[track]) for t, place in enumerate(places) for track in (0, 1)])
    score = track_metrics(standing(2), tracks, GATE)
    assert score.swaps.tolist() == [1, 1]
    assert score.fragments.tolist() == [0, 0]
    assert score.purity.tolist() == [0.5, 0.5]
    assert score.completeness == 1.0


def test_a_holder_is_kept_though_another_track_comes_nearer():
    tracks = tracks_of([(t, 1, 50.0) for t in range(10)] + [(t, 2, 10.0) for t in range(1, 10)])
    score = track_metrics(standing(1), tracks, GATE)
    assert score.swaps.tolist() == [0]
    assert score.track.tolist() == [1, 2]
    assert score.duplicate.tolist() == [False, True]
    assert score.ambiguity == pytest.approx(1.9)
    assert score.spuriousness == 0.0


def test_false_and_lost():
    """The only track leaves its target at 4 and never comes back; another is nowhere near any."""
    tracks = tracks_of([(t, 1, 0.0 if t < 4 else 500.0 * t) for t in range(20)] + [(0, 2, -5e3)])
    score = track_metrics(standing(1, range(20)), tracks, GATE)
    assert score.lost.tolist() == [True]
    assert score.continuity.tolist() == [0.2]
    assert score.false.tolist() == [True, True]  # 16 of its 20 instants
    assert np.isnan(score.purity[1])
    assert score.spuriousness == pytest.approx(36 / 40)
    kept = track_metrics(standing(1, range(20)), tracks, GATE, tail=17)
    assert kept.lost.tolist() == [False]


def test_at_most_half_of_its_life_astray_is_not_false():
    tracks = tracks_of([(t, 1, 0.0 if t < 5 else 5e3) for t in range(10)])
    assert track_metrics(standing(1), tracks, GATE).false.tolist() == [False]


def test_the_gate_itself_is_inside():
    assert track_metrics(standing(1), tracks_of([(0, 1, GATE)]), GATE).completeness == 1.0
    assert track_metrics(standing(1), tracks_of([(0, 1, GATE + 1e-9)]), GATE).completeness == 0.0


def test_targets_that_come_and_go_are_scored_while_they_are_there():
    truth = truth_of([(t, 0, 0.0) for t in range(10)] + [(t, 1, 1000.0) for t in range(4, 8)])
    tracks = tracks_of([(0, 1, 0.0), (6, 2, 1000.0)])
    score = track_metrics(truth, tracks, GATE)
    assert score.time_to_confirm.tolist() == [0.0, 2.0]
    assert score.continuity.tolist() == [1.0, 0.5]
    assert score.completeness == pytest.approx(12 / 14)
    assert score.spuriousness == pytest.approx(2 / 14)  # track 2 after its target went


def test_tracks_are_moved_on_by_their_velocity_and_never_know_the_future():
    tracks = tracks_of([(0.0, 1, 0.0), (2.5, 1, 100.0)])
    tracks["v_east"], tracks["v_north"] = 10.0, -20.0
    pictures = list(snapshots(standing(1, range(4)), tracks))
    assert [now.estimate[0].tolist() for now in pictures] == [[0, 0], [10, -20], [20, -40], [105, -10]]
    short = list(snapshots(standing(1, range(6)), tracks, memory=1.0))
    assert [len(now.track) for now in short] == [1, 1, 1, 1, 0, 0]


@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi))
def test_order_numbers_and_directions_do_not_matter(seed, turn):
    rng = np.random.default_rng(seed)
    truth = truth_of([(t, k, 0.0) for t in range(6) for k in range(4)])
    tracks = tracks_of([(t + 0.5 * rng.random(), k, 0.0) for t in range(6) for k in range(5)])
    tracks["status"] = rng.integers(0, 4, len(tracks))
    for table in (truth, tracks):
        for name in ("east", "north", "v_east", "v_north"):
            table[name] = rng.uniform(-300, 300, len(table))
    before = track_metrics(truth, tracks, gate=200.0)

    c, s = np.cos(turn), np.sin(turn)
    turned = [rng.permutation(table) for table in (truth, tracks)]
    for table in turned:
        for east, north in (("east", "north"), ("v_east", "v_north")):
            e, n = table[east].copy(), table[north].copy()
            table[east], table[north] = c * e - s * n, s * e + c * n
    turned[1]["track"] += 1000
    after = track_metrics(*turned, gate=200.0)
    for name in (
        "continuity",
        "fragments",
        "swaps",
        "lost",
        "false",
        "duplicate",
        "purity",
        "time_to_confirm",
        "longest_segment",
        "number_changes",
    ):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    # Turned coordinates are rounded, to 1e-13 of a few hundred metres.
    for name in ("completeness", "ambiguity", "spuriousness", "position_accuracy", "velocity_accuracy"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-12, nan_ok=True)
    for name in ("position_rmse", "velocity_rmse"):
        assert getattr(after, name).value == pytest.approx(
            getattr(before, name).value, rel=1e-12, nan_ok=True
        )
    assert (before.longest_segment <= before.continuity).all()
    assert (before.continuity <= 1.0).all()
    assert (before.fragments + (before.continuity > 0) <= 6).all()


@pytest.mark.parametrize("bad", [{"gate": 0.0}, {"gate": np.nan}, {"tail": 0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(ValueError, match="gate must be positive"):
        track_metrics(standing(1), tracks_of([(0, 1, 0.0)]), **bad)


def test_a_track_that_has_held_another_target_since_is_no_longer_the_first_one_s():
    """Track 1 holds target 0, then 1 (where 0 is out of its gate), then is near both."""
    places = [0.0, 0.0, 1000.0, 1000.0, 500.0]
    truth = truth_of(
        [(t, k, (0.0, 1000.0)[k]) for t in range(4) for k in (0, 1)] + [(4, 0, 490.0), (4, 1, 520.0)]
    )
    score = track_metrics(truth, tracks_of([(t, 1, east) for t, east in enumerate(places)]), GATE)
    assert score.continuity.tolist() == [0.4, 0.6]
    assert score.purity.tolist() == [0.6]
    assert score.swaps.tolist() == [0, 0]
