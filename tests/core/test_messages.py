"""The sector message and its tables."""

import numpy as np
import pytest

from radar_console.core.messages import CENTROID, PLOT, TRACK, Radar, Sector, blank, empty

RADAR = Radar("r", 4.0, 300e3, 50.0, 1e-3)


def test_a_sector_locks_its_tables() -> None:
    plots = blank(PLOT, 3)
    sector = Sector(RADAR, 0.0, 1.0, 0.0, 0.1, 0.0, plots=plots)
    with pytest.raises(ValueError, match="read-only"):
        sector.plots["range"][0] = 1.0


def test_adding_keeps_the_rest() -> None:
    sector = Sector(RADAR, 0.0, 1.0, 0.0, 0.1, 0.0, plots=blank(PLOT, 3))
    more = sector.adding(centroids=blank(CENTROID, 2), complete=0.05)
    assert more.plots is sector.plots
    assert (len(more.centroids), more.complete, len(sector.centroids)) == (2, 0.05, 0)


@pytest.mark.parametrize("dtype", [PLOT, CENTROID, TRACK])
def test_blank_says_unknown(dtype: np.dtype) -> None:
    row = blank(dtype, 1)[0]
    for name in dtype.names:
        if dtype[name].kind == "f":
            assert np.isnan(row[name])
        else:
            assert row[name] == (-1 if name in ("mode_3a", "address", "plot") else 0)
    assert len(empty(dtype)) == 0
