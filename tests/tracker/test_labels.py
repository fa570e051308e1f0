"""Particles that tracks exchange: the set of targets is what it was, each track knows better where it is."""

import numpy as np
import pytest
from clouds import Cloud
from scenes import Scene, held, run, sound

from radar_console.tracker import labels

P0 = np.diag([50.0**2, 50.0**2, 5.0**2, 5.0**2])
COUNT = 2000


def two_tracks(first, second, mixed=0.5, seed=1, at=60e3):
    """Clouds about two places, of which each particle has changed with its partner with probability `mixed`.

    The two tracks stand at different bearings, so that their particles are in different axes.
    """
    cloud = Cloud(COUNT, tracks=2)
    rng = np.random.default_rng(seed)
    mean = np.array([[0.0, at, 0.0, 0.0], [0.0, at, 0.0, 0.0]]) + np.array([first, second])
    cloud.start(np.array([3e3, at, 40.0, -9.0]), P0, 0)
    cloud.start(np.array([-3e3, at - 1e3, -3.0, 80.0]), P0, 1)
    world = np.stack([mean[i] + rng.normal(size=(COUNT, 4)) * np.sqrt(np.diag(P0)) for i in (0, 1)])
    change = rng.random(COUNT) < mixed
    world[:, change] = world[::-1, change]
    for i in (0, 1):
        put(cloud, i, world[i])
    return cloud, world


def axes(track):
    half = np.array([[track["sin"], track["cos"]], [track["cos"], -track["sin"]]])
    return np.kron(np.eye(2), half)


def put(cloud, i, world):
    cloud.belief.particles[i, :4] = axes(cloud.tracks[i]) @ (world - cloud.tracks[i]["anchor"]).T


def taken(cloud, i):
    return (axes(cloud.tracks[i]) @ cloud.belief.particles[i, :4].astype(float)).T + cloud.tracks[i]["anchor"]


def exchanged(cloud, partners):
    a, b = cloud.tracks[0], cloud.tracks[1]
    return labels.exchange(
        a, b, np.arange(COUNT, dtype=np.int32), partners.astype(np.int32), cloud.par, cloud.belief
    )


def test_two_clouds_over_both_of_two_places_become_one_for_each():
    """Offsets of kilometres in single precision are right to a millimetre, velocities to 0.1 mm/s."""
    cloud, world = two_tracks([-500, 0, 0, 0], [500, 0, 0, 0])
    partners = np.random.default_rng(2).permutation(COUNT)
    a, b = cloud.tracks[0], cloud.tracks[1]
    put(cloud, 1, world[1][np.argsort(partners)])
    mine, yours = taken(cloud, 0), taken(cloud, 1)[partners]
    assert exchanged(cloud, partners)
    found = np.stack([taken(cloud, 0), taken(cloud, 1)[partners]])
    east = np.sort(np.stack([mine, yours])[..., 0], axis=0)
    assert np.abs(np.sort(found[..., 0], axis=0) - east).max() < 0.01  # each event has the same two targets
    assert np.abs(found.sum(axis=0) - mine - yours).max() < 0.02
    assert sorted(np.round(found[..., 0].mean(axis=1), -2)) == [-500, 500]
    assert found[..., 0].std(axis=1).max() < 55  # of 500 and more before
    assert a["id"] == 0
    assert b["id"] == 1


@pytest.mark.parametrize("seed", range(5))
def test_the_mean_squares_never_grow(seed):
    """In any direction: the sum of the variances is a constant less ½ |mean difference|²."""
    rng = np.random.default_rng(seed)
    cloud, world = two_tracks(*(rng.normal(size=(2, 4)) * [100, 100, 10, 10]), mixed=rng.random(), seed=seed)
    scale = np.array([1, 1, 4.0, 4.0])  # a turn takes 4 s
    before = np.linalg.norm((world[0] - world[1]).mean(axis=0) * scale)
    did = exchanged(cloud, np.arange(COUNT))
    after = np.linalg.norm((taken(cloud, 0) - taken(cloud, 1)).mean(axis=0) * scale)
    assert after > 1.0004 * before if did else after == pytest.approx(before)


def test_most_particles_keep_their_label():
    cloud, _ = two_tracks([-500, 0, 0, 0], [500, 0, 0, 0], mixed=0.3)
    assert exchanged(cloud, np.arange(COUNT))
    assert np.median(taken(cloud, 0)[:, 0]) == pytest.approx(-500, abs=10)


def test_clouds_apart_are_left_alone():
    cloud, _ = two_tracks([-500, 0, 0, 0], [500, 0, 0, 0], mixed=0.0)
    assert not exchanged(cloud, np.arange(COUNT))


def test_who_crosses_keeps_its_label():
    """At the same place, at 190 m/s from each other: the velocity says who is who."""
    cloud, world = two_tracks([0, 0, -95, 0], [0, 0, 95, 0], mixed=0.0)
    exchanged(cloud, np.arange(COUNT))
    assert np.abs(taken(cloud, 0) - world[0]).max() < 0.02


def test_filters_that_leave_unlike_rests_open_exchange_nothing():
    cloud, _ = two_tracks([-500, 0, 0, 0], [500, 0, 0, 0])
    cloud.belief.P[0, 0, 1, 1] *= 2.0
    assert not exchanged(cloud, np.arange(COUNT))


def test_targets_abreast():
    """Four that share plots are all held, and not as JPDA holds them."""
    targets = np.array([(1200.0 * k, 150e3, 0.0, -200.0) for k in range(4)])
    scene = Scene(targets, turns=25, p_d=0.9)
    rows, _ = run(scene.sectors(), associator="set-jpda", process_noise_m2ps3=1.0)
    assert sound(rows)
    assert len(held(rows)) == 4
    plain, _ = run(scene.sectors(), associator="jpda", process_noise_m2ps3=1.0)
    assert rows.tobytes() != plain.tobytes()
