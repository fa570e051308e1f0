import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radar_console.core.errors import InputError
from radar_console.core.geometry import LocalFrame
from radar_console.core.messages import Site
from radar_console.display import maps

NEAR = 2500.0
"""m; at 1:10m a line drawn with a quarter of a millimetre is so wide."""

CAPES = {
    "Cabo da Roca": Site(38.7804, -9.5006),
    "Europa Point": Site(36.1093, -5.3457),
    "Cape Agulhas": Site(-34.8333, 20.0002),
    "Cape Byron": Site(-28.6386, 153.6366),
    "Cape Leeuwin": Site(-34.3756, 115.1353),
    "Nordkapp": Site(71.1725, 25.7840),
}


def vertices(lines: list[Any]) -> np.ndarray:
    return np.concatenate(lines)


@pytest.mark.parametrize("cape", CAPES)
def test_the_coast_lies_where_capes_are(cape: str) -> None:
    points = vertices(maps.world(CAPES[cape], 50e3)["coast"])
    assert np.hypot(*points.T).min() < NEAR


def test_a_border_along_a_parallel_bends_on_the_plane() -> None:
    site = Site(49.0, -105.0)
    points = vertices(maps.world(site, 300e3)["border"])
    points = points[np.hypot(*points.T) < 250e3]
    latitude, _ = LocalFrame(site).to_wgs84(*points.T)
    assert len(points) > 20
    np.testing.assert_allclose(latitude, 49.0, atol=0.02)
    assert np.ptp(points[:, 1]) > 1000.0


def test_the_antimeridian_is_no_edge() -> None:
    """The same coast of Taveuni, Fiji (180° runs through it), from a site at either side."""
    west = maps.world(Site(-16.8, 179.9), 60e3)["coast"]
    east = maps.world(Site(-16.8, -179.9), 60e3)["coast"]
    seen_west = vertices([np.column_stack(LocalFrame(Site(-16.8, 179.9)).to_wgs84(*p.T)) for p in west])
    seen_east = vertices([np.column_stack(LocalFrame(Site(-16.8, -179.9)).to_wgs84(*p.T)) for p in east])
    both = {tuple(p) for p in np.round(seen_west, 6)} & {tuple(p) for p in np.round(seen_east, 6)}
    assert len(both) > 50
    for lines in (west, east):
        assert max(np.hypot(*np.diff(line, axis=0).T).max() for line in lines) < 30e3


def test_a_pole_sees_every_longitude() -> None:
    site = Site(-89.0, 0.0)
    longitudes = [LocalFrame(site).to_wgs84(*line.T)[1] for line in maps.world(site, 2500e3)["coast"]]
    turned = np.histogram(np.concatenate(longitudes), 12, (-180, 180))[0]
    assert (turned > 0).all()


def test_only_what_is_near_is_taken() -> None:
    site, radius = Site(50.9, -1.4), 100e3
    lines = maps.world(site, radius)["coast"]
    assert lines
    assert all(np.hypot(*line.T).min() < 10 * radius for line in lines)
    assert maps.world(Site(0.0, -140.0), 300e3) == {"coast": [], "border": []}


def write(folder: Path, content: Any) -> Path:
    file = folder / "own.geojson"
    file.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return file


def test_every_geometry_is_read(tmp_path: Path) -> None:
    square = [[0, 0], [1, 0], [1, 1], [0, 0]]
    content = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": None, "geometry": {"type": "Point", "coordinates": [1, 2, 30]}},
            {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}},
            {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [square, square]}},
            {"type": "Feature", "geometry": None},
            {
                "type": "Feature",
                "geometry": {
                    "type": "GeometryCollection",
                    "geometries": [
                        {"type": "MultiPoint", "coordinates": [[0, 0], [1, 1]]},
                        {"type": "MultiLineString", "coordinates": [[[0, 0], [1, 1]], [[2, 2], [3, 3]]]},
                        {"type": "MultiPolygon", "coordinates": [[square], [square]]},
                    ],
                },
            },
        ],
    }
    lengths = [len(line) for line in maps.read_geojson(write(tmp_path, content))]
    assert lengths == [1, 2, 4, 4, 1, 1, 2, 2, 4, 4]


def test_own_lines_lie_on_the_plane(tmp_path: Path) -> None:
    line = {"type": "LineString", "coordinates": [[10.0, 50.0], [10.0, 51.0]]}
    (points,) = maps.user(write(tmp_path, line), Site(50.0, 10.0))["user"]
    np.testing.assert_allclose(points[0], 0.0, atol=1e-6)
    assert points[-1, 0] == pytest.approx(0.0, abs=1e-6)
    # A degree of latitude at 50.5° N on WGS84.
    assert points[-1, 1] == pytest.approx(111_238.7, abs=1.0)


@pytest.mark.parametrize(
    ("content", "place"),
    [
        ("{", "line 1, column 2"),
        ([], "type"),
        ({"type": "Circle"}, "type"),
        ({"type": "FeatureCollection"}, "features"),
        ({"type": "LineString", "coordinates": [[0, 0], [1]]}, "coordinates[1]"),
        ({"type": "LineString", "coordinates": [[0, 0], [1, "x"]]}, "coordinates[1]"),
        ({"type": "Point", "coordinates": [0, 91]}, "coordinates[0]"),
        ('{"type": "Point", "coordinates": [NaN, 1]}', "coordinates[0]"),
        ({"type": "Polygon", "coordinates": 7}, "coordinates"),
        (
            {
                "type": "FeatureCollection",
                "features": [
                    {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [[[0, 0], 5]]}}
                ],
            },
            "features[0].geometry.coordinates[0][1]",
        ),
    ],
)
def test_errors_name_the_place(tmp_path: Path, content: Any, place: str) -> None:
    file = write(tmp_path, content)
    with pytest.raises(InputError) as caught:
        maps.read_geojson(file)
    assert caught.value.place == place
    assert str(file) in str(caught.value)


def test_a_missing_file_and_one_that_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="can't be read"):
        maps.read_geojson(tmp_path / "none.geojson")
    binary = tmp_path / "binary.geojson"
    binary.write_bytes(b"\xd4\xc3\xb2\xa1")
    with pytest.raises(InputError, match="byte 0"):
        maps.read_geojson(binary)
