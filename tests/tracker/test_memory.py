"""The kernels let go all the memory that they take: those without counts of references own none."""

import math

import pytest
from numba.core.runtime import _nrt_python, rtsys
from scenes import FILTERS, Scene, run, swarm


@pytest.fixture
def counting():
    was = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    yield
    if not was:
        _nrt_python.memsys_disable_stats()


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("initiation", ["m-of-n", "branching"])
def test_no_array_is_left(counting, name, initiation):
    scene = Scene(swarm(40, seed=3, max_range=50e3), turns=6, clutter=200 / (math.pi * 300e3**2))
    sectors = list(scene.sectors())
    before = rtsys.get_allocation_stats()
    _, counts = run(sectors, initiation=initiation, clutter_per_km2=None, max_tracks=300, **FILTERS[name])
    after = rtsys.get_allocation_stats()
    assert counts.confirmed > 20
    assert after.mi_alloc - before.mi_alloc > 1000
    assert after.mi_free - before.mi_free == after.mi_alloc - before.mi_alloc
