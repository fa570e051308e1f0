"""JPDA marginals, dense and sparse calls, beside pyehm's EHM2 on the same matrices.

Medians of wall time, all in one run. pyehm is compared when it is installed (`pip install pyehm stonesoup`),
but not on the widest clusters: it does not end there. `read` is one reading of the
matrix, below which no dense call gets, and `off` the largest error of what was approximated, where the exact
sum can still be had.

Examples:
  python benchmarks/association.py
  python benchmarks/association.py --only formation --json association.json
"""

import argparse
import importlib.util
import json
import math
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from radar_console.core.units import DEG, KM
from radar_console.tracker.association import jpda

Array = NDArray[np.float64]

P_D, P_G, GATE = 0.9, 0.9999, 18.4
SD_RANGE, SD_AZIMUTH = 50.0, 0.1 * DEG
PREDICTED = 0.6  # variance of a predicted position over that of a plot
AMPLE = 1e11  # steps: as good as no budget
PRUNE = 1e-3  # of the miss weight
KM2 = 1e-6


Ints = NDArray[np.int64]
Pairs = tuple[Array, int, Ints, Ints, Array]
"""As `jpda.sparse` takes them: miss, plots, row, column, weight."""


class Case(NamedTuple):
    name: str
    likelihood: Array
    peer: bool  # pyehm ends on it
    exact: bool = True  # and so does the exact sum


@dataclass(frozen=True, slots=True)
class Figure:
    """Wall times in ms, medians; `worst_ms` is the slowest dense call; NaN where nothing was run."""

    case: str
    tracks: int
    plots: int
    pairs: int
    read_ms: float
    dense_ms: float
    worst_ms: float
    sparse_ms: float
    pyehm_ms: float
    approximate: float
    off: float
    error: float


def positions(place: Array, rng: np.random.Generator, variance: float) -> Array:
    """Places (n, 2), east and north, with the errors of a plot times `variance`."""
    r, azimuth = np.hypot(*place.T), np.arctan2(*place.T)
    r = r + math.sqrt(variance) * SD_RANGE * rng.standard_normal(len(r))
    azimuth = azimuth + math.sqrt(variance) * SD_AZIMUTH * rng.standard_normal(len(r))
    return np.stack([r * np.sin(azimuth), r * np.cos(azimuth)], axis=1)


def weights(truth: Array, clutter: Array, density: float, rng: np.random.Generator) -> Array:
    """(tracks, plots + 1) of a scan: tracks predicted near the truth, and their plots among clutter."""
    predicted = positions(truth, rng, PREDICTED)
    seen = positions(truth[rng.random(len(truth)) < P_D], rng, 1.0)
    plots = rng.permutation(np.concatenate([seen, clutter]))
    r, azimuth = np.hypot(*predicted.T), np.arctan2(*predicted.T)
    apart = plots - predicted[:, None]
    along = np.sin(azimuth)[:, None] * apart[..., 0] + np.cos(azimuth)[:, None] * apart[..., 1]
    across = np.cos(azimuth)[:, None] * apart[..., 0] - np.sin(azimuth)[:, None] * apart[..., 1]
    sd = math.sqrt(1.0 + PREDICTED) * np.stack([np.full_like(r, SD_RANGE), r * SD_AZIMUTH])
    d2 = (along / sd[0, :, None]) ** 2 + (across / sd[1, :, None]) ** 2
    w = P_D * np.exp(-0.5 * d2) / (2.0 * np.pi * (sd[0] * sd[1])[:, None]) / density
    miss = 1.0 - P_D * P_G
    w[(d2 > GATE) | (w < PRUNE * miss)] = 0.0
    return np.ascontiguousarray(np.concatenate([np.full((len(w), 1), miss), w], axis=1))


def formation(count: int, rng: np.random.Generator, spacing: float = KM) -> Array:
    """Targets line abreast at 150 km, in clutter of 2/km²."""
    truth = np.stack([(np.arange(count) - (count - 1) / 2) * spacing, np.full(count, 150 * KM)], axis=1)
    low, high = truth.min(axis=0) - 3 * KM, truth.max(axis=0) + 3 * KM
    false = rng.poisson(2.0 * KM2 * np.prod(high - low))
    return weights(truth, rng.uniform(low, high, (false, 2)), 2.0 * KM2, rng)


def swarm(count: int, rng: np.random.Generator, false: int = 1000) -> Array:
    """Targets at random within 180 km, and false plots within 200 km."""

    def disc(n: int, radius: float) -> Array:
        r, azimuth = radius * np.sqrt(rng.random(n)), 2.0 * np.pi * rng.random(n)
        return np.stack([r * np.sin(azimuth), r * np.cos(azimuth)], axis=1)

    density = false / (np.pi * (200 * KM) ** 2)
    return weights(disc(count, 180 * KM), disc(false, 200 * KM), density, rng)


def all_gated(tracks: int, plots: int, rng: np.random.Generator) -> Array:
    w = np.exp(rng.normal(size=(tracks, plots + 1)))
    w[:, 0] = 1.0 - P_D * P_G
    return w


def cases(seed: int) -> Iterator[Case]:
    for count in range(2, 16):
        yield Case(f"formation {count}", formation(count, np.random.default_rng((seed, count))), True)
    yield Case("tight20", formation(20, np.random.default_rng((seed, 20)), 0.5 * KM), True)
    for count in (100, 500, 1000):
        yield Case(f"swarm {count}", swarm(count, np.random.default_rng((seed, count))), True)
    for tracks, plots in (
        (10, 16),
        (12, 20),
        (15, 20),
        (18, 30),
        (300, 500),
        (300, 3000),
        (3000, 300),
        (1000, 1000),
    ):
        rng = np.random.default_rng((seed, tracks))
        w = all_gated(tracks, plots, rng)
        yield Case(f"all-gated {tracks} × {plots}", w, tracks == 10, tracks < 20)
    rng = np.random.default_rng((seed, 1500))
    half = all_gated(1500, 1500, rng)
    half[:, 1:] *= rng.random((1500, 1500)) < 0.45
    yield Case("half-gated 1500 × 1500", half, False, False)
    crowds = np.zeros((1000, 1001))
    crowds[:, 0] = 1.0 - P_D * P_G
    for n in range(0, 1000, 40):
        crowds[n : n + 40, 1 + n : 41 + n] = np.exp(rng.normal(size=(40, 40)))
    yield Case("25 crowds of 40 × 40", crowds, False, False)


def side_by_side(count: int, tracks: int, plots: int, rng: np.random.Generator, mixed: bool = False) -> Pairs:
    """So many clusters, each all gated; `mixed` in any order."""
    row, column = (np.arange(count)[:, None, None] * n + index for n, index in (
        (tracks, np.arange(tracks)[:, None] + np.zeros(plots, int)),
        (plots, np.arange(plots) + np.zeros((tracks, 1), int)),
    ))  # fmt: skip
    row, column = row.ravel(), column.ravel()
    if mixed:
        row, column = rng.permutation(count * tracks)[row], rng.permutation(count * plots)[column]
        order = np.argsort(row, kind="stable")
        row, column = row[order], column[order]
    return pairs(count * tracks, count * plots, row, column, rng)


def at_random(tracks: int, plots: int, each: int, rng: np.random.Generator) -> Pairs:
    """Tracks with so many random plots each."""
    row = np.repeat(np.arange(tracks), each)
    return pairs(tracks, plots, row, rng.integers(0, plots, row.size), rng)


def pairs(tracks: int, plots: int, row: Ints, column: Ints, rng: np.random.Generator) -> Pairs:
    return np.full(tracks, 1.0 - P_D * P_G), plots, row, column, np.exp(rng.normal(size=row.size))


def sparse_cases(seed: int) -> Iterator[tuple[str, Pairs]]:
    """Up to a million pairs whose matrices would not fit in memory; most where it costs most for its size."""
    rng = np.random.default_rng((seed, 1_000_000))
    for size, mixed in ((2, False), (3, False), (3, True), (8, False), (32, False), (32, True)):
        name = f"clusters {size} × {size}, a million pairs" + ", mixed" * mixed
        yield name, side_by_side(1_000_000 // size**2, size, size, rng, mixed)
    chain = np.repeat(np.arange(500_000), 2)
    yield "chain, a million pairs", pairs(500_000, 500_001, chain, chain + np.arange(chain.size) % 2, rng)
    yield "300,000 tracks, 3 random plots each", at_random(300_000, 300_000, 3, rng)
    yield "500,000 tracks, 2 random plots each", at_random(500_000, 500_000, 2, rng)
    alone = np.arange(1_000_000)
    yield "a million tracks, one plot each", pairs(1_000_000, 1_000_000, alone, alone.copy(), rng)
    for size, count in ((2, 200_000), (3, 200_000)):  # as many as are summed exactly
        yield f"clusters {size} × {size}, {count:,} pairs", side_by_side(count // size**2, size, size, rng)
    yield (
        "chain, 300,000 pairs",
        pairs(150_000, 150_001, chain[:300_000], chain[:300_000] + np.arange(300_000) % 2, rng),
    )
    yield "250,000 tracks, 2 of a million plots each", at_random(250_000, 1_000_000, 2, rng)
    # As many tracks as the tracker has room for, and fewer with more plots each.
    for tracks, each in ((50_000, 20), (10_000, 100), (1000, 1000)):
        yield f"{tracks:,} tracks, {each:,} of 100,000 plots each", at_random(tracks, 100_000, each, rng)


def timed(call: Callable[[], Any], seconds: float) -> list[float]:
    """Wall times of repeated calls, ms, over about so many seconds; the first, uncounted, compiles."""
    call()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while not times or (time.perf_counter() < end and len(times) < 5000):
        began = time.perf_counter()
        call()
        times.append((time.perf_counter() - began) * 1e3)
    return times


def pyehm() -> Callable[[Array], Array] | None:
    """pyehm's EHM2 on a matrix of weights, or None."""
    if importlib.util.find_spec("pyehm") is None:
        return None
    run = importlib.import_module("pyehm.core").EHM2().run
    return lambda w: np.asarray(run((w > 0).astype(np.int32), w))


def measure(case: Case, peer: Callable[[Array], Array] | None, seconds: float) -> Figure:
    w = case.likelihood
    row, column = (np.ascontiguousarray(index) for index in np.nonzero(w[:, 1:]))
    values = w[:, 1:][row, column]
    miss, plots = w[:, 0].copy(), w.shape[1] - 1
    found = jpda.sparse(miss, plots, row, column, values)
    off = math.nan
    if np.any(found.approximate) and case.exact:
        off = float(np.abs(jpda.marginals(w) - jpda.marginals(w, AMPLE)).max())
    read = timed(lambda: w.sum(), seconds)
    dense = timed(lambda: jpda.marginals(w), seconds)
    sparse = timed(lambda: jpda.sparse(miss, plots, row, column, values), seconds)
    theirs, error = math.nan, math.nan
    if peer is not None and case.peer:
        if not np.any(found.approximate):
            error = float(np.abs(peer(w) - jpda.marginals(w)).max())
        theirs = statistics.median(timed(lambda: peer(w), seconds))
    return Figure(
        case.name, len(w), plots, len(row), statistics.median(read), statistics.median(dense), max(dense),
        statistics.median(sparse), theirs, float(np.mean(found.approximate)), off, error,
    )  # fmt: skip


def measure_sparse(name: str, problem: Pairs, seconds: float) -> Figure:
    """The sparse call alone; `read` is one reading of the pairs."""
    miss, plots, row, column, values = problem
    rough = float(np.mean(jpda.sparse(*problem).approximate))
    read = timed(lambda: row.sum() + column.sum() + values.sum(), seconds)
    sparse = timed(lambda: jpda.sparse(*problem), seconds)
    return Figure(
        name, len(miss), plots, len(row), statistics.median(read), math.nan, math.nan,
        statistics.median(sparse), math.nan, rough, math.nan, math.nan,
    )  # fmt: skip


def table(figures: list[Figure]) -> str:
    lines = [
        "| case | pairs | read, ms | dense, ms | slowest | sparse, ms | pyehm, ms | pyehm / dense | rough "
        "| off | apart |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for f in figures:
        cells = (f.case, f"{f.pairs}", f"{f.read_ms:.3f}", f"{f.dense_ms:.3f}", f"{f.worst_ms:.3f}",
                 f"{f.sparse_ms:.3f}", f"{f.pyehm_ms:.3f}", f"{f.pyehm_ms / f.dense_ms:.1f}",
                 f"{f.approximate:.0%}", f"{f.off:.3f}", f"{f.error:.0e}")  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines).replace("nan", "–")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE as well")
    parser.add_argument("--only", default="", metavar="PART", help="cases whose name has this part")
    parser.add_argument("--seconds", type=float, default=0.5, help="of repeated calls, each case and column")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    peer = pyehm()
    if peer is None:
        print("pyehm is not installed: its column stays empty\n")
    chosen = (case for case in cases(arguments.seed) if arguments.only in case.name)
    figures = [measure(case, peer, arguments.seconds) for case in chosen]
    figures += [
        measure_sparse(name, problem, arguments.seconds)
        for name, problem in sparse_cases(arguments.seed)
        if arguments.only in name
    ]
    print(table(figures))
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(f) for f in figures], indent=2) + "\n")


if __name__ == "__main__":
    main()
