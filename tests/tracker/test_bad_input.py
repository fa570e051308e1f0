"""Bad input: the tracker never raises, gives no NaN, and counts what it had to do."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import FILTERS, RADAR, Scene, held, nothing, of_track, one_turn, run, sound, table_of, with_values

from radar_console.core.messages import Sector, TrackStatus
from radar_console.core.units import TURN

each_filter = pytest.mark.parametrize("name", FILTERS)


def three_targets(turns=10, **values):
    """Two targets side by side and one far away, with these values in their centroids."""
    rng = np.random.default_rng(0)
    tables = []
    for k in range(turns):
        distance = [5e4 - 400.0 * k + 30.0 * rng.normal(), 8e4, 3e4]
        tables.append(table_of(4.0 * k + 1.0, distance, [1.5, 1.5, 1.501], 3 * k))
    return [one_turn(with_values(table, values), k) for k, table in enumerate(tables)]


def test_no_sector():
    assert len(run([])[0]) == 0


def test_empty_scans():
    rows, counts = run(nothing(0, 20))
    assert len(rows) == 0
    assert counts.centroids == counts.started == 0


@each_filter
def test_empty_scans_end_all_tracks(name):
    rows, counts = run(three_targets() + nothing(10, 20), **FILTERS[name])
    assert sound(rows)
    assert len(held(rows)) == counts.lost == 3
    last = {row["track"]: row["status"] for row in rows}
    assert set(last.values()) == {TrackStatus.DELETED}


def test_one_plot():
    rows, counts = run([one_turn(table_of(1.0, 1e4, 1.5)), *nothing(1, 7)])
    assert counts.started == counts.deleted == 1
    assert sound(rows)


def test_a_hundred_thousand_plots_in_a_turn():
    """Twice as many as there may be tracks; it takes about three seconds."""
    count, rng = 100_000, np.random.default_rng(1)
    azimuth, distance = TURN * rng.random(count), 3e5 * np.sqrt(rng.random(count))
    crowd = one_turn(table_of(4.0 + azimuth / TURN * 4.0, distance, azimuth), 1)
    rows, counts = run([*nothing(0, 1), crowd, *nothing(2, 4)], clutter_per_km2=None)
    assert sound(rows)
    assert counts.centroids == counts.started == count
    assert counts.capped > 0
    assert (rows["status"] == TrackStatus.DELETED).sum() == counts.deleted + counts.merged + counts.capped


def test_a_thousand_plots_around_a_track():
    """All in one gate: the association stays possible, and the track alive."""
    rng, sectors = np.random.default_rng(2), three_targets()
    crowd = table_of(
        41.0, 5e4 - 4000.0 + 200.0 * rng.normal(size=1000), 1.5 + 3e-3 * rng.normal(size=1000), 30
    )
    rows, counts = run([*sectors, one_turn(crowd, 10), *nothing(11, 13)])
    assert sound(rows)
    assert counts.confirmed >= 3


@each_filter
def test_identical_plots(name):
    turns = [one_turn(table_of(4.0 * k + np.full(20, 1.0), 5e4, 1.5, 20 * k), k) for k in range(10)]
    rows, counts = run(turns, **FILTERS[name])
    assert sound(rows)
    assert counts.confirmed >= 1


@each_filter
@pytest.mark.parametrize("distance", [0.0, 1e-9, 1.0])
def test_a_target_at_the_radar(name, distance):
    turns = [one_turn(table_of(4.0 * k + 1.0, distance, 1.5, k), k) for k in range(10)]
    rows, _ = run(turns, **FILTERS[name])
    assert sound(rows)
    assert len(rows) > 5


@each_filter
def test_a_track_across_north(name):
    scene = Scene(np.array([(-2.5e3, 60e3, 250.0, 0.0)]), p_d=1.0, turns=15)
    rows, counts = run(scene.sectors(), **FILTERS[name])
    assert sound(rows)
    assert counts.confirmed == 1
    assert counts.lost == 0
    assert rows["east"].min() < -1e3
    assert rows["east"].max() > 1e3
    assert of_track(rows, held(rows)[0])["hit"].all()


@each_filter
@pytest.mark.parametrize(
    "times", [np.zeros(12), -4.0 * np.arange(12), 4.0 * (np.arange(12) % 5)], ids=["still", "back", "jumps"]
)
def test_time_that_stands_still_or_goes_back(times, name):
    turns = [
        one_turn(table_of(t + 1.0, [5e4, 8e4], [1.0, 1.5], 2 * k), k, start=t, stop=t)
        for k, t in enumerate(times)
    ]
    rows, counts = run(turns, **FILTERS[name])
    assert sound(rows)
    assert counts.clock_back == int((np.diff(times) < 0).sum())


def test_a_beam_that_goes_back():
    turns = [
        one_turn(table_of(4.0 * k + 1.0, 5e4, 1.5, k), k % 5, start=4.0 * k, stop=4.0 * k + 4)
        for k in range(12)
    ]
    rows, counts = run(turns)
    assert sound(rows)
    assert counts.beam_back > 0


def stalled(scene, turn, seconds, staring):
    """The scene with its beam held for a while on its way through a turn, at the target's bearing.

    `staring`: the target gives a centroid every tenth of a second, as the beam looks at it.
    """
    angle = (turn + 0.125) * TURN  # the bearing of a target in the north-east
    ordinal = 10_000
    shifted = False
    for sector in scene.sectors():
        if not shifted and sector.begin >= angle - 1e-9:
            shifted = True
            for k in range(int(10 * seconds)):
                start, stop = sector.start + 0.1 * k, sector.start + 0.1 * (k + 1)
                table = table_of([], [], [])
                if staring:
                    e, n = scene.truth(start)[0]
                    table = table_of(start, math.hypot(e, n), math.atan2(e, n), ordinal)
                    ordinal += 1
                yield Sector(RADAR, start, stop, angle, angle, angle - 0.03, centroids=table)
        if shifted:
            table = sector.centroids.copy()
            table["time"] += seconds
            sector = replace(
                sector, start=sector.start + seconds, stop=sector.stop + seconds, centroids=table
            )
        yield sector


@each_filter
@pytest.mark.parametrize("staring", [False, True], ids=["blind", "staring"])
def test_a_stalled_encoder(name, staring):
    """20 s at one angle: the track waits, and no pass is counted that was none."""
    scene = Scene(np.array([(50e3, 50e3, 0.0, 0.0)]), p_d=1.0, turns=16, noise=0.3)
    rows, counts = run(stalled(scene, 10, 20.0, staring), **FILTERS[name])
    assert sound(rows)
    assert counts.beam_back == counts.clock_back == 0
    assert counts.lost == 0
    track = held(rows)[0]
    passes = rows[(rows["track"] == track) & (rows["status"] != TrackStatus.DELETED)]
    assert abs(len(passes) - 16) <= 1


def test_a_long_gap():
    """A million turns that nobody saw, and then the stream goes on."""
    scene = Scene(np.array([(50e3, 50e3, -100.0, 80.0)]), turns=10, p_d=1.0)
    sectors, turns = list(scene.sectors()), 1e6 * TURN
    later = [
        Sector(RADAR, s.start + 4e6, s.stop + 4e6, s.begin + turns, s.end + turns, s.complete + turns,
               centroids=with_time(s.centroids, 4e6))
        for s in sectors
    ]  # fmt: skip
    rows, counts = run(sectors + later)
    assert sound(rows)
    assert counts.confirmed == 2
    assert counts.lost == 1


def with_time(table, later):
    table = table.copy()
    table["time"] += later
    table["ordinal"] += 1000
    return table


SINGULAR = {
    "zero": 0.0,
    "negative": -1.0,
    "tiny": 1e-200,
    "huge": 1e200,
    "infinite": math.inf,
    "unknown": math.nan,
}


@each_filter
@pytest.mark.parametrize("gate", ["ellipse", "rectangle"])
@pytest.mark.parametrize("kind", SINGULAR)
def test_singular_covariances(name, kind, gate):
    """Deviations that cannot be are the radar's own, and counted; none at all is no fault."""
    sd = SINGULAR[kind]
    rows, counts = run(three_targets(sd_range=sd, sd_azimuth=sd), gate=gate, **FILTERS[name])
    assert sound(rows)
    assert counts.claims == (0 if kind in ("tiny", "unknown") else 60)
    if kind != "tiny":  # which no particle of the prior can meet
        assert counts.confirmed == 3
        assert counts.lost == 0


@pytest.mark.parametrize("column", ["sd_range", "sd_azimuth"])
@pytest.mark.parametrize("sd", [1e-200, 1e-3, 1.0, 1e6])
def test_one_direction_is_certain_or_unknown(column, sd):
    rows, _ = run(three_targets(**{column: sd}))
    assert sound(rows)


@pytest.mark.parametrize("height", [-1e5, 1e6, 1e300, -1e300, math.inf])
def test_a_height_above_the_range_is_none(height):
    rows, counts = run(three_targets(height=height))
    assert sound(rows)
    assert counts.claims == 30
    assert np.isnan(rows["up"]).all()
    assert counts.confirmed == 3


@each_filter
@pytest.mark.parametrize("doppler", [0.0, 1e6, 1e300, -1e300, math.inf])
@pytest.mark.parametrize("sd", [0.0, 1.0, 1e300, math.nan, math.inf])
def test_any_doppler(name, doppler, sd):
    rows, _ = run(three_targets(doppler=doppler, sd_doppler=sd), **FILTERS[name])
    assert sound(rows)


@each_filter
@pytest.mark.parametrize("p_d", [0.0, 1e-12, 1.0 - 1e-12, 1.0])
@pytest.mark.parametrize("initiation", ["auto", "m-of-n", "score", "branching"])
def test_detection_that_is_certain_or_impossible(name, p_d, initiation):
    rows, counts = run(three_targets() + nothing(10, 18), p_d=p_d, initiation=initiation, **FILTERS[name])
    assert sound(rows)
    assert counts.confirmed == (3 if p_d > 0.5 else 0)
    assert counts.lost == counts.confirmed


@pytest.mark.parametrize("associator", ["jpda", "set-jpda", "pda", "gnn", "nn"])
@pytest.mark.parametrize("p_d", [1e-12, 1.0])
def test_certain_detection_and_shared_plots(associator, p_d):
    targets = np.array([(30e3, 30e3 + 300.0 * k, 50.0, 5.0 * k) for k in range(4)])
    scene = Scene(targets, turns=14, p_d=0.7)
    rows, _ = run(scene.sectors(), p_d=p_d, associator=associator)
    assert sound(rows)


@each_filter
@pytest.mark.parametrize("density", [0.0, 1e-300, 1e300])
@pytest.mark.parametrize("initiation", ["auto", "m-of-n", "score", "branching"])
def test_clutter_density_of_nothing(name, density, initiation):
    rows, counts = run(three_targets(), clutter_per_km2=density, initiation=initiation, **FILTERS[name])
    assert sound(rows)
    assert counts.confirmed == (3 if density < 1.0 else 0)


def test_bad_centroids_are_counted():
    distance = [1e4, np.nan, 2e4, -5.0, 3e4, 1e300, np.inf]
    table = table_of(1.0, distance, [1.0, 1.0, np.nan, 1.0, 1.5, 1.0, 1.0])
    table["time"][4] = np.inf
    rows, counts = run([one_turn(table)])
    assert counts.centroids == 7
    assert counts.invalid == 6
    assert counts.started == 1
    assert sound(rows)


@pytest.mark.parametrize("azimuth", [-1.0, 7.0, 1e6, 1e17, 1e300])
def test_azimuths_out_of_a_turn(azimuth):
    """They are angles all the same, as far as a number of that size is one."""
    rows, _ = run(three_targets(azimuth=azimuth))
    assert sound(rows)


@pytest.mark.parametrize("time", [-1e9, 1e9, 1e300, -1e300])
def test_times_far_from_the_sectors(time):
    rows, counts = run(three_targets(time=time))
    assert sound(rows)
    assert counts.centroids == 30
    assert counts.invalid == (30 if abs(time) > 1e12 else 0)


def test_a_centroid_below_the_watermark_is_late():
    first = one_turn(table_of(3.9, 1e4, 6.2))
    late = one_turn(table_of(3.0, 2e4, 4.5, 5), 1, stop=4.1, end=TURN * 1.01, complete=TURN * 1.01)
    _, counts = run([first, late])
    assert counts.late == 1
    assert counts.started == 1


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("field", ["start", "stop", "begin", "end", "complete", "position"])
def test_a_sector_that_is_no_sector_is_passed_over(field, value):
    """Its centroids are counted as invalid, and the tracks go on."""
    sectors = three_targets()
    sectors[6] = replace(sectors[6], **{field: (value, 0.0, 0.0) if field == "position" else value})
    rows, counts = run(sectors)
    assert sound(rows)
    assert (counts.broken, counts.invalid) == (1, 3)
    assert counts.confirmed == 3
    assert counts.lost == 0


def test_a_sector_of_a_million_turns_is_passed_over():
    sectors = three_targets()
    sectors[6] = replace(sectors[6], end=1e6 * TURN, complete=1e6 * TURN)
    rows, counts = run(sectors)
    assert sound(rows)
    assert counts.broken == 1
