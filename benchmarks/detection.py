"""Figures of the raw returns and their centroids: detection, accuracy, false alarms, resolution.

Examples:
  python benchmarks/detection.py
  python benchmarks/detection.py --scans 60 --range-km 250
  python benchmarks/detection.py --pairs 720 --seed 3
"""

import time
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from scipy.stats import ncx2

from radar_console.core.geometry import wrap
from radar_console.core.messages import CentroidFlag, Table
from radar_console.core.units import DEG, KM, TURN
from radar_console.pipeline import inline
from radar_console.plots.clustering import Clustering
from radar_console.scenario import RadarSettings, Scenario, Target
from radar_console.simulator.radar import Simulator

Array = NDArray[np.float64]

app = typer.Typer(
    add_completion=False,
    rich_markup_mode="rich",
    help="Figures of the raw returns and their centroids: detection, accuracy, false alarms, resolution.",
)

RANGES_KM = (290.0, 250.0, 200.0, 150.0, 100.0, 50.0)


@dataclass(frozen=True, slots=True, eq=False)
class Passages:
    """What became of every passage of the beam over a target.

    Attributes
    ----------
    count : passages
    found : (n,) CENTROID, the strongest near each target that was detected
    error_range, error_azimuth : (n,) measured minus true, m and rad
    others : centroids that are near no target
    doubles : centroids near a target beside its strongest
    """

    count: int
    found: Table
    error_range: Array
    error_azimuth: Array
    others: int
    doubles: int

    @property
    def p_d(self) -> float:
        return len(self.found) / self.count

    @property
    def z(self) -> Array:
        """(2, n) errors in range and azimuth over their claimed deviations."""
        return np.stack(
            [self.error_range / self.found["sd_range"], self.error_azimuth / self.found["sd_azimuth"]]
        )

    def flagged(self, flag: CentroidFlag) -> int:
        return int(np.count_nonzero(self.found["flags"] & flag))


def still_targets(range_km: float, scans: int, rng: np.random.Generator, **radar: Any) -> Scenario:
    """Forty targets at about one range, all round, each at its own place in cell and beam."""
    count = 40
    azimuth_deg = (np.arange(count) + rng.uniform(0.3, 0.7, count)) * 360.0 / count
    distance_km = range_km + rng.uniform(-2.0, 2.0, count)
    targets = tuple(
        Target(range_km=float(r), azimuth_deg=float(a), heading_deg=0.0, speed_mps=0.0)
        for r, a in zip(distance_km, azimuth_deg, strict=True)
    )
    return scene(targets, scans, **radar)


def scene(targets: tuple[Target, ...], scans: int, **radar: Any) -> Scenario:
    settings = RadarSettings(**radar)
    return Scenario(title="Detection", duration_s=scans * settings.rotation_s, radar=settings, target=targets)


def centroids_of(scenario: Scenario, seed: int) -> Table:
    """Every centroid of a run."""
    simulator = Simulator(scenario, np.random.default_rng(seed))
    stage = Clustering(scenario.plots, scenario.radar)
    return np.concatenate([sector.centroids for sector in inline(simulator.sectors(), stage)])


def passages(scenario: Scenario, seed: int) -> Passages:
    """Find still targets, evenly spaced in azimuth, among the centroids of a run."""
    radar, targets = scenario.radar, scenario.target
    centroids = centroids_of(scenario, seed)
    place = np.array([(t.range_km or 0.0, t.azimuth_deg or 0.0) for t in targets]) * (KM, DEG)
    nearest = (centroids["azimuth"] / TURN * len(targets)).astype(int)
    error_range = centroids["range"] - place[nearest, 0]
    error_azimuth = wrap(centroids["azimuth"] - place[nearest, 1])
    near = (np.abs(error_range) < 3.0 * radar.cell_m) & (np.abs(error_azimuth) < radar.beam_width_deg * DEG)
    scan = (centroids["time"] / radar.rotation_s).astype(int)
    order = np.lexsort((-centroids["snr"], scan * len(targets) + nearest))
    order = order[near[order]]
    _, first = np.unique((scan * len(targets) + nearest)[order], return_index=True)
    best = order[first]
    return Passages(
        count=round(scenario.duration_s / radar.rotation_s) * len(targets),
        found=centroids[best],
        error_range=error_range[best],
        error_azimuth=error_azimuth[best],
        others=int(np.count_nonzero(~near)),
        doubles=len(order) - len(best),
    )


def at_range(range_km: float, scans: int, seed: int) -> Passages:
    """Passages over still targets that are placed anew every fifth scan."""
    parts = []
    for part in range(-(-scans // 5)):
        rng = np.random.default_rng((seed, part))
        parts.append(passages(still_targets(range_km, 5, rng), seed * 1000 + part))
    return Passages(
        count=sum(p.count for p in parts),
        found=np.concatenate([p.found for p in parts]),
        error_range=np.concatenate([p.error_range for p in parts]),
        error_azimuth=np.concatenate([p.error_azimuth for p in parts]),
        others=sum(p.others for p in parts),
        doubles=sum(p.doubles for p in parts),
    )


def detection_probability(radar: RadarSettings, range_km: float, hits: int) -> float:
    """At least `hits` of the pulses and cells that a Swerling I target fills, in theory.

    A passage has one strength u, exponential with mean 1, taken at the midpoints of equal parts of
    v = e^(−u). Given u each pulse within a beam width of the axis, in both of the cells that share the
    echo, is Rician and crosses the threshold by itself. The mean is over u and over the target's place
    between two pulses and two cells. Hits that are not connected count too, so this is a little high.

    Source: Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, §6.3.
    """
    threshold = -np.log(radar.p_fa)
    peak = 10.0 ** (radar.snr_db / 10.0) * (max(range_km, radar.stc_range_km) / radar.snr_range_km) ** -4
    u = -np.log((np.arange(400) + 0.5) / 400)
    pulses = round(radar.rotation_s * radar.prf_hz)
    step = 360.0 / pulses
    probability = []
    for shift in (np.arange(4) + 0.5) / 4:
        offset = (np.arange(-pulses // 4, pulses // 4) + shift) * step
        offset = offset[np.abs(offset) <= radar.beam_width_deg]
        gain = np.exp2(-8.0 * (offset / radar.beam_width_deg) ** 2)
        for part in (np.arange(8) + 0.5) / 8:
            share = np.array([1.0 - part, part]) ** 2
            snr = peak * u[:, None, None] * gain[:, None] * share
            each = ncx2.sf(2.0 * threshold, 2, 2.0 * snr).reshape(len(u), -1)
            probability.append(_at_least(hits, each).mean())
    return float(np.mean(probability))


def _at_least(hits: int, probability: Array) -> Array:
    """(n,) the probability of at least so many successes in (n, k) independent trials."""
    reached = np.zeros((len(probability), hits + 1))
    reached[:, 0] = 1.0
    for p in probability.T[:, :, None]:
        more = reached[:, :-1] * p
        reached[:, :-1] -= more
        reached[:, 1:] += more
    return reached[:, hits]


@dataclass(frozen=True, slots=True)
class Separation:
    """Pairs of steady targets, a number of beams apart in azimuth and of cells in range."""

    beams: float
    cells: float


def pairs(separation: Separation, count: int, rng: np.random.Generator) -> tuple[Target, ...]:
    """Pairs at 120 km in even directions, their phases at random within a wavelength."""
    radar = RadarSettings()
    azimuth_deg = (np.arange(count) + rng.uniform(0.4, 0.6, count)) * 360.0 / count
    range_km = 120.0 + rng.uniform(-1.0, 1.0, count)
    phase_km = rng.uniform(0.0, radar.wavelength_m / KM, count)
    return tuple(
        Target(
            range_km=float(r + side * separation.cells * radar.cell_m / KM + (p if side > 0.0 else 0.0)),
            azimuth_deg=float(a + side * separation.beams * radar.beam_width_deg),
            heading_deg=0.0,
            speed_mps=0.0,
        )
        for a, r, p in zip(azimuth_deg, range_km, phase_km, strict=True)
        for side in (-0.5, 0.5)
    )


def resolved(separation: Separation, count: int, seed: int) -> float:
    """Of pairs, the part where each target has a centroid nearer to it than to the other."""
    turns, each = -(-count // 36), 36
    both = 0
    for turn in range(turns):
        rng = np.random.default_rng((seed, turn))
        targets = pairs(separation, each, rng)
        scenario = scene(targets, 1, fluctuation="swerling0")
        radar = scenario.radar
        found = centroids_of(scenario, seed + turn)
        place = np.array([(t.range_km or 0.0, t.azimuth_deg or 0.0) for t in targets]) * (KM, DEG)
        away = np.hypot(
            (found["range"] - place[:, :1]) / radar.cell_m,
            wrap(found["azimuth"] - place[:, 1:]) / (radar.beam_width_deg * DEG),
        )
        seen = (away < 0.5 * np.hypot(separation.beams, separation.cells)).any(axis=1)
        both += int(np.count_nonzero(seen.reshape(-1, 2).all(axis=1)))
    return both / (turns * each)


def _parts_within(z: Array) -> str:
    """Parts of |z| (2, n) below 2 and above 4, in range and in azimuth."""
    inside, outside = np.mean(z < 2.0, axis=1), np.mean(z > 4.0, axis=1)
    return f"{inside[0]:.3f} {inside[1]:.3f}  {outside[0]:.4f} {outside[1]:.4f}"


@app.command(epilog="Example:  python benchmarks/detection.py --scans 60 --range-km 250")
def main(
    scans: Annotated[int, typer.Option(help="Scans of 40 targets at each range.")] = 60,
    range_km: Annotated[list[float] | None, typer.Option(help="Ranges; all of the table without it.")] = None,
    pairs: Annotated[int, typer.Option(help="Pairs for each separation.")] = 360,
    seed: int = 1,
) -> None:
    """Print the tables of docs/detection.md."""
    hits = Scenario(title="", duration_s=1.0).plots.min_hits
    print("   km  passages    P_D theory   hits 5/50/95   σ_r m   σ_az °  bias °  |z|<2 r az   |z|>4 r az")
    every = []
    for r in range_km or RANGES_KM:
        run = at_range(r, scans, seed)
        theory = detection_probability(RadarSettings(), r, hits)
        number = "/".join(f"{q:.0f}" for q in np.quantile(run.found["hits"], (0.05, 0.5, 0.95)))
        every.append(run.z)
        print(
            f"{r:5.0f} {run.count:9d} {run.p_d:6.3f} {theory:6.3f} {number:>14} "
            f"{run.error_range.std():7.1f} {run.error_azimuth.std() / DEG:8.4f} "
            f"{run.error_azimuth.mean() / DEG:7.4f}  {_parts_within(np.abs(run.z))}  "
            f"extended {run.flagged(CentroidFlag.EXTENDED)}, split {run.flagged(CentroidFlag.SPLIT)}"
        )
    z = np.abs(np.concatenate(every, axis=1))
    print(f"{'all':>5} {z.shape[1]:9d} found {'':51}{_parts_within(z)}")

    noise = scene((), scans)
    sectors = list(Simulator(noise, np.random.default_rng(seed)).sectors())
    stage = Clustering(noise.plots, noise.radar)
    started = time.process_time()
    for _ in stage(sectors):
        pass
    spent = time.process_time() - started
    print(f"\nfalse centroids a scan: {stage.centroids / scans:.1f} of {stage.plots / scans:.0f} plots")
    print(f"clustering: {spent / scans * 1e3:.1f} ms a scan, {spent / len(sectors) * 1e3:.2f} ms a sector")
    print("\nbeams cells  both found")
    for beams, cells in ((1.0, 0.0), (1.25, 0.0), (1.5, 0.0), (0.0, 1.5), (0.0, 2.0), (0.0, 2.5)):
        print(f"{beams:5.2f} {cells:5.1f} {resolved(Separation(beams, cells), pairs, seed):11.3f}")


if __name__ == "__main__":
    app()
