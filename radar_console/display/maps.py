"""Map lines around a site: the world's coast and borders, and the user's GeoJSON.

A map is a dict from layer to polylines (n, 2), m east and north in the plane of the site. A point is
a polyline of one vertex.
"""

import json
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radar_console.core.errors import InputError
from radar_console.core.geometry import MEAN_RADIUS, LocalFrame
from radar_console.core.messages import Site

Array = NDArray[np.floating]
Map = dict[str, list[Array]]

COAST, BORDER, USER = "coast", "border", "user"
LONGEST_DEG = 0.25  # a longer step is cut, so that a parallel bends as it should on the plane
_MARGIN = 1.05


def world(site: Site, radius: float) -> Map:
    """Coast and borders that come near the disc of `radius`, m, about the site.

    Source: Natural Earth 1:10m, public domain; see `tools/make_map.py`.
    """
    frame = LocalFrame(site)
    file = resources.files("radar_console.display") / "data" / "world.npz"
    with file.open("rb") as stream, np.load(stream) as data:
        return {
            layer: [_projected(frame, line) for line in _near(_Layer(data, layer), site, radius)]
            for layer in (COAST, BORDER)
        }


def user(file: Path, site: Site) -> Map:
    """The lines and points of a GeoJSON file."""
    frame = LocalFrame(site)
    return {USER: [_projected(frame, line) for line in read_geojson(file)]}


class _Layer:
    """The pieces of a layer, as longitude and latitude in degrees, one after the other.

    A piece that crosses the antimeridian goes on past 180°.
    """

    def __init__(self, data: Any, name: str) -> None:
        first, count = data[f"{name}_first"].astype(float), data[f"{name}_count"].astype(int)
        self.stop = np.cumsum(count + 1)
        self.start = self.stop - count - 1
        steps = np.zeros((self.stop[-1], 2))
        is_step = np.ones(len(steps), bool)
        is_step[self.start] = False
        steps[is_step] = data[f"{name}_step"]
        walked = np.cumsum(steps, axis=0)
        lattice = walked + np.repeat(first - walked[self.start], count + 1, axis=0)
        self.points = data["origin"] + lattice * data["scale"]
        self.low = np.minimum.reduceat(self.points, self.start)
        self.high = np.maximum.reduceat(self.points, self.start)


def _near(layer: _Layer, site: Site, radius: float) -> list[Array]:
    """The pieces whose box touches the box about the disc."""
    reach = _MARGIN * radius / MEAN_RADIUS
    south, north = (site.latitude_deg + side * np.degrees(reach) for side in (-1.0, 1.0))
    touches = (layer.high[:, 1] >= south) & (layer.low[:, 1] <= north)
    if south > -90.0 and north < 90.0:  # otherwise a pole is in the disc, and every longitude with it
        across = np.degrees(np.arcsin(np.sin(reach) / np.cos(np.radians(site.latitude_deg))))
        half = (layer.high[:, 0] - layer.low[:, 0]) / 2.0
        away = (layer.low[:, 0] + half - site.longitude_deg + 180.0) % 360.0 - 180.0
        touches &= np.abs(away) <= half + across
    return [layer.points[layer.start[i] : layer.stop[i]] for i in np.flatnonzero(touches)]


def _projected(frame: LocalFrame, line: Array) -> Array:
    """Longitude and latitude, degrees, to the plane; long steps are cut."""
    dense = _densified(line)
    return np.column_stack(frame.from_wgs84(dense[:, 1], dense[:, 0]))


def _densified(line: Array) -> Array:
    longest = np.abs(np.diff(line, axis=0)).max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(longest / LONGEST_DEG), 1).astype(int)
    if parts.max(initial=1) == 1:
        return line
    at = np.concatenate([[0.0], np.cumsum(np.repeat(1.0 / parts, parts))])
    index = np.arange(len(line), dtype=float)
    return np.column_stack([np.interp(at, index, line[:, 0]), np.interp(at, index, line[:, 1])])


def read_geojson(file: Path) -> list[Array]:
    """Every line and point of a GeoJSON file as (n, 2), longitude and latitude in degrees.

    Polygons give their rings. Altitudes and properties are ignored.

    Raises
    ------
    InputError   the file can't be read, or is not GeoJSON; the place is named

    Source: RFC 7946.
    """
    try:
        root = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(file, "", f"can't be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(file, f"byte {error.start}", "not a text file in UTF-8; expected GeoJSON") from error
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise InputError(file, place, f"not valid JSON: {error.msg}") from error
    except RecursionError as error:
        raise InputError(file, "", "nested too deeply; expected GeoJSON") from error
    return _Reader(file).lines(root, "")


_DEPTH = {
    "Point": 0,
    "MultiPoint": 1,
    "LineString": 1,
    "MultiLineString": 2,
    "Polygon": 2,
    "MultiPolygon": 3,
}
_SCATTERED = ("Point", "MultiPoint")
_CONTAINERS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}


class _Reader:
    """Walks a GeoJSON object; knows the file for its errors."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def lines(self, item: Any, place: str) -> list[Array]:
        kind = item.get("type") if isinstance(item, dict) else None
        if kind in _CONTAINERS:
            key = _CONTAINERS[kind]
            members = item.get(key)
            if not isinstance(members, list):
                raise self.error(_join(place, key), "expected an array")
            inner = [self.lines(member, f"{_join(place, key)}[{i}]") for i, member in enumerate(members)]
            return [line for lines in inner for line in lines]
        if kind == "Feature":
            geometry = item.get("geometry")
            return [] if geometry is None else self.lines(geometry, _join(place, "geometry"))
        if kind in _DEPTH:
            return self.geometry(kind, item.get("coordinates"), _join(place, "coordinates"))
        known = ", ".join((*_CONTAINERS, "Feature", *_DEPTH))
        raise self.error(_join(place, "type"), f"found {kind!r}; expected one of {known}")

    def geometry(self, kind: str, coordinates: Any, place: str) -> list[Array]:
        depth = _DEPTH[kind]
        if kind in _SCATTERED:
            points = self.positions([coordinates] if depth == 0 else coordinates, place)
            return [point[None, :] for point in points]
        return [line for line in self.nested(coordinates, depth, place) if len(line)]

    def nested(self, coordinates: Any, depth: int, place: str) -> list[Array]:
        if depth == 1:
            return [_unwrapped(self.positions(coordinates, place))]
        if not isinstance(coordinates, list):
            raise self.error(place, "expected an array")
        inner = [self.nested(part, depth - 1, f"{place}[{i}]") for i, part in enumerate(coordinates)]
        return [line for lines in inner for line in lines]

    def positions(self, coordinates: Any, place: str) -> Array:
        """(n, 2) longitude and latitude; each position is checked."""
        if not isinstance(coordinates, list):
            raise self.error(place, "expected an array of positions")
        for i, position in enumerate(coordinates):
            if not (isinstance(position, list) and len(position) >= 2 and all(map(_is_number, position[:2]))):
                raise self.error(f"{place}[{i}]", f"found {position!r}; expected [longitude, latitude]")
            longitude, latitude = position[:2]
            if not (-180.0 <= longitude <= 180.0 and -90.0 <= latitude <= 90.0):
                found = f"found longitude {longitude}, latitude {latitude}"
                raise self.error(f"{place}[{i}]", f"{found}; expected −180 … 180 and −90 … 90 degrees")
        return np.array([position[:2] for position in coordinates], float).reshape(-1, 2)

    def error(self, place: str, expected: str) -> InputError:
        return InputError(self.file, place, expected)


def _unwrapped(line: Array) -> Array:
    """The line going on past ±180° where it would jump to the other side of the map."""
    if len(line) == 0:
        return line
    return np.column_stack([np.unwrap(line[:, 0], period=360.0), line[:, 1]])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _join(place: str, key: str) -> str:
    return f"{place}.{key}" if place else key
