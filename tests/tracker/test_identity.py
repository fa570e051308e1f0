"""Mode 3/A codes and Mode S addresses as evidence, and what wrong ones may not do."""

import numpy as np
import pytest
from scenes import RADAR, Scene, held, of_track, run, same, swaps, swarm, target_of, with_values

CROSSING = np.array([(-15e3, 80e3, 160.0, 3.0), (-15e3, 80.6e3, 160.0, -3.0)])  # for minutes side by side
BESIDE = np.array([(-15e3, 84e3, 160.0, 3.0)])


def coded(scene, garbled=0.0, seed=0, **codes):
    """The scene's sectors with the codes of each target; a part of all codes is garbled."""
    rng = np.random.default_rng(seed)
    sectors = list(scene.sectors(8))
    values = {name: np.append(of_targets, -1)[scene.origin] for name, of_targets in codes.items()}
    wrong = rng.random(len(scene.origin)) < garbled
    for name, column in values.items():
        values[name] = np.where(wrong & (column >= 0), rng.integers(0, 4096, len(column)), column)
    for sector in sectors:
        number = sector.centroids["ordinal"]
        changed = {name: column[number] for name, column in values.items()}
        yield sector.adding(centroids=with_values(sector.centroids, changed))


def crossings(identity, garbled=0.0, **codes):
    """Swaps, lost tracks and confirmed tracks in six crossings."""
    found = np.zeros(3, int)
    for seed in range(6):
        scene = Scene(CROSSING, turns=40, p_d=0.9, seed=seed)
        rows, counts = run(coded(scene, garbled, seed, **codes), identity=identity)
        found += swaps(rows, scene), counts.lost, counts.confirmed
    return found.tolist()


@pytest.mark.parametrize("kind", ["mode_3a", "address"])
def test_identity_keeps_crossing_targets_apart(kind):
    codes = {kind: [0o1234, 0o4321]}
    swapped, _, _ = crossings("ignore", **codes)
    assert swapped > 0
    assert crossings("use", **codes) == [0, 0, 12]


def test_garbled_codes_break_no_track():
    """One code in ten is wrong: no track is lost, started twice, or swapped."""
    assert crossings("use", garbled=0.1, mode_3a=[0o1234, 0o4321]) == [0, 0, 12]


def test_a_track_reports_the_code_that_it_mostly_heard():
    scene = Scene(np.array([(-5e3, 80e3, 160.0, 0.0)]), turns=30)
    rows, counts = run(coded(scene, 0.1, mode_3a=[0o1234]))
    assert counts.confirmed == 1
    assert np.mean(of_track(rows, held(rows)[0])["mode_3a"] == 0o1234) > 0.95
    assert np.all(run(scene.sectors())[0]["mode_3a"] == -1)


def test_what_is_ignored_moves_no_track():
    scene = Scene(CROSSING, turns=30)
    plain, _ = run(scene.sectors(8))
    codes = coded(scene, 0.1, mode_3a=[0o1234, 0o4321], address=[77, 78])
    rows, _ = run(codes, identity="ignore")
    for name in ("track", "time", "east", "north", "v_east", "sd_north", "plot", "status"):
        assert same(rows[name], plain[name])


def test_a_code_that_changes_stays_the_same_track():
    """As when a controller assigns another one: the target's only plots have it."""
    scene = Scene(np.array([(-5e3, 80e3, 160.0, 0.0)]), turns=30, p_d=1.0)
    sectors = [
        s.adding(centroids=with_values(s.centroids, {"mode_3a": 0o1234 if s.stop < 60 else 0o7700}))
        for s in scene.sectors()
    ]
    rows, counts = run(sectors)
    assert counts.confirmed == 1
    assert counts.lost == 0
    assert rows["mode_3a"][-1] == 0o7700


@pytest.mark.parametrize("kind", ["mode_3a", "address"])
def test_many_targets_with_one_identity(kind):
    """An address that several aircraft claim, far apart and side by side: each keeps its track."""
    targets = np.concatenate([swarm(12, seed=3, max_range=150e3), CROSSING[:1], BESIDE])
    scene = Scene(targets, turns=15, p_d=0.95)
    rows, counts = run(coded(scene, **{kind: [4711] * len(targets)}))
    assert counts.lost == 0
    assert sorted(target_of(rows, scene, track) for track in held(rows)) == list(range(len(targets)))


def test_false_plots_without_identity_do_not_take_a_track_away():
    scene = Scene(np.array([(-10e3, 80e3, 160.0, 0.0)]), turns=25, disc=(3e3, 4.0), radar=RADAR)
    rows, counts = run(coded(scene, mode_3a=[0o1234]), clutter_per_km2=None)
    kept = [track for track in held(rows) if target_of(rows, scene, track) == 0]
    assert len(kept) == 1
    assert counts.lost == 0
