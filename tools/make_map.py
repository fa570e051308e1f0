"""Make `radar_console/display/data/world.npz`, the coast and border lines of the world.

Source: Natural Earth 4.1, 1:10m, public domain, as packed in TopoJSON by the npm package
`world-atlas` 2.0.2 (file `countries-10m.json`). In that topology a line shared by two countries is
stored once, so a line used once is coast and a line used twice is a border.

    npm pack world-atlas@2.0.2 && tar xf world-atlas-2.0.2.tgz
    python tools/make_map.py package/countries-10m.json

What is done to it:

1. the integer lattice of the source is kept (360°/99999 in longitude, about 400 m at the equator);
2. lines are thinned (Douglas and Peucker) to `TOLERANCE_DEG` of latitude;
3. lines are cut into pieces of at most `PIECE` steps, so that a crop by bounding box is fine;
4. a piece that crosses the antimeridian goes on past 180° instead of jumping to the other side.

The file holds, per layer, `<layer>_first` (pieces, 2) int32, the lattice point where each piece begins,
`<layer>_count` (pieces,) uint16, its number of steps, and `<layer>_step` (steps, 2) int16; and
`scale`, `origin` (2,) float64 with longitude, latitude = origin + lattice × scale, in degrees.
"""

import argparse
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

TOLERANCE_DEG = 0.0015  # 170 m; the lattice itself rounds to 200 m in longitude
PIECE = 200
LATTICE_TURN = 99_999  # steps of the lattice in 360° of longitude
TARGET = Path(__file__).parents[1] / "radar_console" / "display" / "data" / "world.npz"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("topojson", type=Path, help="countries-10m.json of world-atlas")
    topology = json.loads(parser.parse_args().topojson.read_text(encoding="utf-8"))
    scale = np.array(topology["transform"]["scale"])
    origin = np.array(topology["transform"]["translate"])
    uses = Counter(
        arc if arc >= 0 else ~arc
        for country in topology["objects"]["countries"]["geometries"]
        for arc in arcs_of(country.get("arcs", []))
    )
    lines: dict[str, list[NDArray[np.int64]]] = {"coast": [], "border": []}
    for number, arc in enumerate(topology["arcs"]):
        if uses[number]:
            line = thinned(unwrapped(np.cumsum(arc, axis=0)), scale, origin)
            lines["coast" if uses[number] == 1 else "border"].append(line)
    arrays = {"scale": scale, "origin": origin}
    for layer, members in lines.items():
        arrays |= packed(layer, members)
        print(f"{layer}: {len(members)} lines, {sum(map(len, members))} points")
    TARGET.parent.mkdir(exist_ok=True)
    np.savez_compressed(TARGET, **arrays)  # type: ignore[arg-type]
    print(f"{TARGET}: {TARGET.stat().st_size / 1e6:.2f} MB")


def arcs_of(nested: Any) -> Iterator[int]:
    """The arc numbers of a geometry, however deeply its rings are nested."""
    for item in nested:
        if isinstance(item, int):
            yield item
        else:
            yield from arcs_of(item)


def unwrapped(lattice: NDArray[np.int64]) -> NDArray[np.int64]:
    """The line with its longitude going on past ±180° where it would jump by a turn."""
    step = np.diff(lattice[:, 0])
    jumps = -LATTICE_TURN * np.rint(step / LATTICE_TURN).astype(np.int64)
    line = lattice.copy()
    line[1:, 0] += np.cumsum(jumps)
    return line


def thinned(line: NDArray[np.int64], scale: NDArray[Any], origin: NDArray[Any]) -> NDArray[np.int64]:
    """The line without the points that lie within `TOLERANCE_DEG` of what is left."""
    degrees = origin + line * scale
    flat = degrees * [np.cos(np.radians(degrees[:, 1].mean())), 1.0]
    keep = np.zeros(len(line), bool)
    keep[[0, -1]] = True
    spans = [(0, len(line) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        away = distances(flat[first + 1 : last], flat[first], flat[last])
        farthest = int(np.argmax(away))
        if away[farthest] > TOLERANCE_DEG:
            middle = first + 1 + farthest
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return line[keep]


def distances(points: NDArray[Any], start: NDArray[Any], stop: NDArray[Any]) -> NDArray[Any]:
    """From each point to the segment between start and stop."""
    along = stop - start
    length_2 = along @ along
    part = np.clip((points - start) @ along / length_2, 0.0, 1.0) if length_2 > 0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - part[:, None] * along, axis=1))


def packed(layer: str, lines: list[NDArray[np.int64]]) -> dict[str, NDArray[Any]]:
    """The lines of a layer as pieces of integer steps."""
    pieces = [
        line[begin : begin + PIECE + 1] for line in lines for begin in range(0, max(len(line) - 1, 1), PIECE)
    ]
    steps = np.concatenate([np.diff(piece, axis=0) for piece in pieces])
    if np.abs(steps).max() > np.iinfo(np.int16).max:
        raise ValueError("a step does not fit in 16 bits")
    return {
        f"{layer}_first": np.array([piece[0] for piece in pieces], np.int32),
        f"{layer}_count": np.array([len(piece) - 1 for piece in pieces], np.uint16),
        f"{layer}_step": steps.astype(np.int16),
    }


if __name__ == "__main__":
    main()
