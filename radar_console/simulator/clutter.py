"""Clutter: false targets and single returns drawn anew each scan, and patches of land that stay.

A false target stands still for the one passage of the beam that it lives; its echo is a target's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d
from scipy.spatial import cKDTree

from radar_console.core.geometry import to_cartesian, to_polar
from radar_console.core.units import DEG, KM, TURN
from radar_console.scenario import Clutter, DiscClutter, LandClutter, RadarSettings, UniformClutter
from radar_console.simulator.antenna import Antenna
from radar_console.simulator.detection import LIT, Cells, Voltages, two_way_gain
from radar_console.simulator.scene import Scene

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where false returns are in one turn: (k,) fractional pulse of the axis' crossing, and range, m."""

    pulse: Array
    distance: Array


def false_targets(clutter: Clutter, scene: Scene, turn: int, rng: np.random.Generator) -> Places:
    """False targets of a turn, uniform ones and those of the discs, in the instrumented range."""
    uniform = [
        _uniform(one, scene.radar, scene.antenna, turn, rng)
        for one in clutter.uniform
        if one.kind == "targets"
    ]
    return _joined([*uniform, *(_disc(one, scene, turn, rng) for one in clutter.disc)])


def points(clutter: Clutter, scene: Scene, turn: int, rng: np.random.Generator) -> Places:
    """Single returns of a turn."""
    return _joined(
        [
            _uniform(one, scene.radar, scene.antenna, turn, rng)
            for one in clutter.uniform
            if one.kind == "points"
        ]
    )


def _joined(parts: Sequence[Places]) -> Places:
    if not parts:
        return Places(np.empty(0), np.empty(0))
    return Places(
        np.concatenate([part.pulse for part in parts]), np.concatenate([part.distance for part in parts])
    )


def _uniform(
    clutter: UniformClutter, radar: RadarSettings, antenna: Antenna, turn: int, rng: np.random.Generator
) -> Places:
    """Poisson over the coverage: the same number in every km², or in every range cell × beam width."""
    limit = radar.max_range_km * KM
    if clutter.density_per_km2 is not None:
        count = rng.poisson(clutter.density_per_km2 * np.pi * radar.max_range_km**2)
        distance = limit * np.sqrt(rng.random(count))
    else:
        assert clutter.per_cell is not None
        cells = (limit / radar.cell_m) * (TURN / (radar.beam_width_deg * DEG))
        count = rng.poisson(clutter.per_cell * cells)
        distance = limit * rng.random(count)
    return Places(antenna.pulses * (turn + rng.random(count)), distance)


def _disc(clutter: DiscClutter, scene: Scene, turn: int, rng: np.random.Generator) -> Places:
    """Poisson in a disc around every target, where the beam finds it in this turn."""
    east, north = _centres(scene, turn)
    radius = clutter.radius_km * KM
    mean = clutter.mean
    if mean is None:
        assert clutter.density_per_km2 is not None
        mean = clutter.density_per_km2 * np.pi * clutter.radius_km**2
    count = rng.poisson(mean, len(east))
    away = radius * np.sqrt(rng.random(count.sum()))
    offset_east, offset_north = to_cartesian(away, TURN * rng.random(count.sum()))
    east_of, north_of = np.repeat(east, count) + offset_east, np.repeat(north, count) + offset_north
    if clutter.density_per_km2 is not None and len(east):
        # Where n discs overlap the density is n-fold; keeping one in n makes it one over the union.
        discs = cKDTree(np.column_stack([east, north]))
        overlap = discs.query_ball_point(np.column_stack([east_of, north_of]), radius, return_length=True)
        keep = rng.random(len(east_of)) * np.maximum(overlap, 1) < 1.0
        east_of, north_of = east_of[keep], north_of[keep]
    distance, azimuth = to_polar(east_of, north_of)
    seen = distance <= scene.max_range
    pulse = scene.antenna.pulses * (turn + azimuth / TURN)
    return Places(pulse[seen], distance[seen])


def _centres(scene: Scene, turn: int) -> tuple[Array, Array]:
    """East and north from the radar of the targets when the beam points at them, m; those alive."""
    antenna = scene.antenna
    every = np.arange(len(scene.targets))
    time = np.full(len(every), antenna.time((turn + 0.5) * antenna.pulses))
    for _ in range(2):  # the time of the crossing follows the azimuth, which hardly moves
        east, north, _ = scene.relative(every, time)
        _, azimuth = to_polar(east, north)
        time = antenna.rotation * (turn + azimuth / TURN)
    alive = scene.targets.alive(every, time)
    east, north, _ = scene.relative(every[alive], time[alive])
    return east, north


@dataclass(frozen=True, slots=True, eq=False)
class Land:
    """The cells of fixed land in one turn, in the order of the stream, and their voltages."""

    cells: Cells
    voltage: Voltages


def land_cells(
    patches: Sequence[LandClutter],
    radar: RadarSettings,
    antenna: Antenna,
    cells: int,
    rng: np.random.Generator,
) -> Land:
    """Every pulse's view of every land cell, the same at each turn.

    The ground is complex Gaussian, independent from pulse to pulse of azimuth; the beam smooths it.
    """
    stream, voltage = [np.empty(0, np.int64)], [np.empty(0, complex)]
    reach = int(np.ceil(LIT * radar.beam_width_deg * DEG / antenna.step))
    pattern = two_way_gain(np.arange(-reach, reach + 1) * antenna.step, radar.beam_width_deg * DEG)
    weights = np.sqrt(pattern / pattern.sum())
    for patch in patches:
        pulses, span = _extent(patch, radar, antenna, cells)
        ground = rng.standard_normal((2, len(pulses) + 2 * reach, len(span)))
        scale = np.sqrt(0.5 * 10.0 ** (patch.snr_db / 10.0))
        smooth = convolve1d(ground, weights, axis=1)[:, reach : reach + len(pulses)]
        stream.append((pulses[:, None] * cells + span).ravel())
        voltage.append(scale * (smooth[0] + 1j * smooth[1]).ravel())
    every, order = np.concatenate(stream), np.argsort(np.concatenate(stream), kind="stable")
    return Land(every[order], np.concatenate(voltage)[order])


def land_points(
    patches: Sequence[LandClutter], radar: RadarSettings, antenna: Antenna, rng: np.random.Generator
) -> tuple[Places, Array]:
    """For centroids: a point in every range cell × beam width of land, and its detection probability.

    Each has a fixed place, in the pulses of turn 0, and a fixed strength, exponential about the mean.
    """
    places, p_d = [], [np.empty(0)]
    for patch in patches:
        beams = np.arange(0.5 * radar.beam_width_deg, _width_deg(patch), radar.beam_width_deg)
        spans = np.arange(patch.from_range_km * KM + 0.5 * radar.cell_m, patch.to_range_km * KM, radar.cell_m)
        azimuth = np.repeat((patch.from_azimuth_deg + beams) % 360.0, len(spans)) * DEG
        places.append(Places(azimuth / antenna.step, np.tile(spans, len(beams))))
        snr = 10.0 ** (patch.snr_db / 10.0) * rng.standard_exponential(len(azimuth))
        p_d.append(radar.p_fa ** (1.0 / (1.0 + snr)))
    return _joined(places), np.concatenate(p_d)


def _extent(
    patch: LandClutter, radar: RadarSettings, antenna: Antenna, cells: int
) -> tuple[Cells, NDArray[np.int64]]:
    """The pulses of turn 0 and the range cells of a patch; patches side by side share none."""
    first = round(patch.from_azimuth_deg * DEG / antenna.step)
    count = min(round(_width_deg(patch) * DEG / antenna.step), antenna.pulses)
    low, high = round(patch.from_range_km * KM / radar.cell_m), round(patch.to_range_km * KM / radar.cell_m)
    return (first + np.arange(count)) % antenna.pulses, np.arange(low, min(high, cells))


def _width_deg(patch: LandClutter) -> float:
    """The sector from the one azimuth clockwise to the other; equal azimuths are the whole turn."""
    return (patch.to_azimuth_deg - patch.from_azimuth_deg) % 360.0 or 360.0
