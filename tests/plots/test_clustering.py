"""The stage: the same centroids however the stream is cut, and a watermark that keeps its word."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radar_console.core.geometry import unwrap_near
from radar_console.core.messages import CENTROID, PLOT, CentroidFlag, Sector, Table, blank
from radar_console.core.units import DEG, TURN
from radar_console.plots.clustering import Clustering
from radar_console.scenario import Clutter, LandClutter, PlotSettings, RadarSettings, Scenario, Target
from radar_console.simulator.radar import Simulator

RADAR = RadarSettings(max_range_km=60.0)
PULSES = 1800


def plots_at(pulse: np.ndarray, cell: np.ndarray, amplitude: np.ndarray) -> Table:
    plots = blank(PLOT, len(pulse))
    plots["ordinal"] = np.arange(len(pulse))
    plots["pulse"], plots["cell"], plots["amplitude"] = pulse, cell, amplitude
    plots["time"], plots["range"] = pulse / RADAR.prf_hz, (plots["cell"] + 0.5) * RADAR.cell_m
    plots["azimuth"] = pulse % PULSES * TURN / PULSES
    return plots


def evenly(pulses: int, turns: int) -> list[int]:
    """The borders of sectors of so many pulses."""
    return [*range(0, turns * PULSES, pulses), turns * PULSES]


def cut(plots: Table, edges: list[int]) -> list[Sector]:
    """The plots in sectors between the pulses `edges`."""
    borders = np.searchsorted(plots["pulse"], edges)
    return [
        Sector(
            RADAR.message,
            start=first / RADAR.prf_hz,
            stop=end / RADAR.prf_hz,
            begin=first * TURN / PULSES,
            end=end * TURN / PULSES,
            complete=first * TURN / PULSES,
            plots=plots[a:b].copy(),
        )
        for first, end, a, b in zip(edges, edges[1:], borders, borders[1:], strict=False)
    ]


def run(sectors: list[Sector], plots: PlotSettings | None = None) -> tuple[list[Sector], Clustering]:
    stage = Clustering(plots or PlotSettings(), RADAR)
    return list(stage(sectors)), stage


def every_centroid(sectors: list[Sector]) -> Table:
    """All centroids in an order that does not depend on when they were delivered."""
    table = np.concatenate([sector.centroids for sector in sectors])
    return table[np.argsort(table["ordinal"])]


def assert_watermark_holds(sectors: list[Sector]) -> None:
    """No centroid comes later than a watermark above it; watermarks never sink."""
    complete = -np.inf
    for sector in sectors:
        beam = unwrap_near(sector.centroids["azimuth"], sector.end)
        assert (beam >= complete).all()
        assert complete <= sector.complete <= sector.end
        complete = sector.complete


@pytest.fixture(scope="module")
def two_turns() -> Table:
    """Noise, eight targets of which one is at north, and a patch of land across north."""
    targets = tuple(
        Target(range_km=30.0 + 3 * k, azimuth_deg=(k * 45.0 + 0.2) % 360, heading_deg=90.0, speed_mps=200.0)
        for k in range(8)
    )
    land = LandClutter(from_range_km=10, to_range_km=13, from_azimuth_deg=350, to_azimuth_deg=12)
    scenario = Scenario(title="", duration_s=8.0, radar=RADAR, target=targets, clutter=Clutter(land=(land,)))
    sectors = Simulator(scenario, np.random.default_rng(5)).sectors()
    return np.concatenate([sector.plots for sector in sectors])


@pytest.mark.parametrize("pulses", [1, 25, 57, 450])
def test_centroids_do_not_depend_on_the_sectors(two_turns: Table, pulses: int) -> None:
    whole, _ = run(cut(two_turns, evenly(2 * PULSES, 2)))
    sectors, stage = run(cut(two_turns, evenly(pulses, 2)))
    assert_watermark_holds(sectors)
    assert every_centroid(sectors).tobytes() == every_centroid(whole).tobytes()
    assert len(every_centroid(sectors)) > 20
    assert stage.plots == len(two_turns)
    assert stage.centroids == len(every_centroid(sectors))
    assert stage.late == 0
    assert stage.extended > 0
    in_clusters = sum(sector.centroids["hits"].sum() for sector in sectors)
    assert stage.too_small <= len(two_turns) - in_clusters <= 2 * stage.too_small


drawn = st.lists(
    st.tuples(st.integers(-30, 29), st.integers(0, 3), st.floats(2.3, 60.0)),
    max_size=60,
    unique_by=lambda place: place[:2],
)


@given(drawn, st.integers(1, 30), st.integers(1, 3))
@settings(max_examples=150)
def test_any_plots_in_any_sectors(places: list[tuple[int, int, float]], step: int, gap: int) -> None:
    """About north, in one sector for each turn and in sectors of any size."""
    pulse, cell, amplitude = np.array(sorted(places), float).reshape(-1, 3).T
    plots = plots_at(PULSES + pulse.astype(int), cell.astype(int), amplitude)
    chosen = PlotSettings(gap_pulses=gap, land_pulses=6)
    whole, _ = run(cut(plots, [0, 2 * PULSES]), chosen)
    small, _ = run(cut(plots, [0, *range(PULSES - 30, PULSES + 30, step), PULSES + 30, 2 * PULSES]), chosen)
    assert_watermark_holds(small)
    assert every_centroid(small).tobytes() == every_centroid(whole).tobytes()


def test_watermark_stays_near_the_beam(two_turns: Table) -> None:
    """Over noise alone, one gap behind; never further than the longest cluster and its gap."""
    sectors, _ = run(cut(two_turns, evenly(28, 2)))
    lag = np.array([sector.end - sector.complete for sector in sectors]) * PULSES / TURN
    assert np.median(lag) < RADAR.beam_width_deg * DEG * PULSES / TURN
    longest, gap, rounding = 2 * PlotSettings().land_pulses, PlotSettings().gap_pulses, 1.5
    assert lag.max() <= longest + gap + rounding


def test_land_is_delivered_in_flagged_pieces() -> None:
    """A wall of 300 pulses: cut, and each piece flagged, the last short one too."""
    pulse, cell = (a.ravel() for a in np.meshgrid(np.arange(300), np.arange(20, 30), indexing="ij"))
    plots = plots_at(pulse, cell, np.full(3000, 20.0))
    sectors, stage = run(cut(plots, evenly(28, 1)))
    assert_watermark_holds(sectors)
    pieces = every_centroid(sectors)
    assert len(pieces) == math.ceil(300 / 44)
    assert (pieces["flags"] == CentroidFlag.EXTENDED).all()
    assert pieces["hits"].sum() == 3000
    assert stage.extended == len(pieces)


def test_the_end_of_the_stream_delivers_what_is_open() -> None:
    plots = plots_at(np.arange(1795, 1800), np.full(5, 7), np.full(5, 9.0))
    sectors, _ = run(cut(plots, evenly(450, 1)))
    assert [len(sector.centroids) for sector in sectors] == [0, 0, 0, 0, 1]
    last = sectors[-1]
    assert (last.start, last.begin, last.complete) == (last.stop, last.end, last.end)
    assert len(last.plots) == 0
    assert last.end == TURN


def test_centroids_of_the_source_pass_untouched() -> None:
    reports = blank(CENTROID, 2)
    given = Sector(RADAR.message, 0.0, 1.0, 0.0, 1.0, complete=0.9, centroids=reports)
    silent = Sector(RADAR.message, 1.0, 2.0, 1.0, 2.0, complete=1.9)
    sectors, stage = run([given, silent])
    assert sectors[0] is given
    assert sectors[1] is silent
    assert len(sectors) == 2
    assert stage.plots == 0


def test_an_empty_sector_closes_clusters() -> None:
    plots = plots_at(np.arange(20, 28), np.full(8, 7), np.full(8, 9.0))
    sectors, _ = run(cut(plots, evenly(28, 1)))
    assert [len(sector.centroids) for sector in sectors[:3]] == [0, 1, 0]
    assert sectors[1].complete == pytest.approx(55.5 * TURN / PULSES)


def test_late_plots_are_counted() -> None:
    plots = plots_at(np.arange(4), np.full(4, 7), np.full(4, 9.0))
    sectors = cut(plots, evenly(900, 1))
    sectors[1] = sectors[1].adding(plots=plots)
    _, stage = run(sectors)
    assert (stage.plots, stage.late, stage.centroids) == (8, 4, 1)


def test_an_empty_stream_has_no_last_sector() -> None:
    assert run([])[0] == []
