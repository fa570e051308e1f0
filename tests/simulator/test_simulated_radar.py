"""Sectors from scenarios: their geometry, their statistics, and that they repeat."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radar_console import scenario
from radar_console.core.errors import ScenarioError
from radar_console.core.geometry import to_polar, unwrap_near, wrap
from radar_console.core.messages import CENTROID, PLOT, Sector
from radar_console.core.units import DEG, TURN
from radar_console.simulator.radar import Simulator

SIGMAS = 5.0
STILL = {"heading_deg": 0.0, "speed_mps": 0.0}


def simulator(seed: int = 1, **tables: Any) -> Simulator:
    raw = {"title": "test", "duration_s": 40.0} | tables
    return Simulator(scenario.parse(raw, Path("test.toml")), np.random.default_rng(seed), "test.toml")


def plots(sectors: list[Sector]) -> np.ndarray:
    return np.concatenate([sector.plots for sector in sectors])


def centroids(sectors: list[Sector]) -> np.ndarray:
    return np.concatenate([sector.centroids for sector in sectors])


BUSY: dict[str, Any] = {
    "target": [
        {"range_km": 100.0, "azimuth_deg": 0.2, "heading_deg": 270.0, "speed_mps": 250.0},
        {"range_km": 40.0, "azimuth_deg": 90.0, "heading_deg": 0.0, "speed_mps": 250.0},
        {"range_km": 0.3, "azimuth_deg": 200.0, "heading_deg": 0.0, "speed_mps": 250.0},
    ],
    "clutter": {
        "disc": [{"radius_km": 15.0, "mean": 5.0}],
        "uniform": [{"density_per_km2": 1e-4}, {"per_cell": 1e-3, "kind": "points"}],
        "land": [
            {"from_range_km": 20.0, "to_range_km": 22.0, "from_azimuth_deg": 355.0, "to_azimuth_deg": 5.0}
        ],
    },
}


@pytest.mark.parametrize("returns", ["raw", "centroids"])
def test_sectors_tile_the_turns(returns: str) -> None:
    sim = simulator(radar={"sectors": 7, "returns": returns}, duration_s=41.0)
    sectors = list(sim.sectors())
    assert len(sectors) == 71  # 41 s of 10.25 turns: 71.75 sectors, the last whole one ends the run
    assert sim.duration == sectors[-1].stop
    assert (sectors[0].begin, sectors[0].start) == (0.0, 0.0)
    for before, after in pairwise(sectors):
        assert (after.begin, after.start) == (before.end, before.stop)
    for sector in sectors:
        assert sector.complete == (sector.begin if returns == "raw" else sector.end)
        pulse = sector.end / TURN * 1800
        assert pulse == pytest.approx(round(pulse), abs=1e-6)
        assert sector.stop == pytest.approx(sector.end / TURN * 4.0)
    assert sectors[6].end == TURN
    assert sectors[13].end == 2 * TURN


def test_plots_say_where_their_pulse_looked() -> None:
    sectors = list(simulator(**BUSY).sectors())
    table = plots(sectors)
    assert table.dtype == PLOT
    np.testing.assert_array_equal(table["ordinal"], np.arange(len(table)))
    np.testing.assert_array_equal(table["azimuth"], TURN * (table["pulse"] % 1800) / 1800)
    np.testing.assert_allclose(table["time"], table["pulse"] / 450.0, rtol=1e-14)
    np.testing.assert_array_equal(table["range"], (table["cell"] + 0.5) * 150.0)
    assert table["cell"].min() >= 0
    assert table["cell"].max() < 2000
    assert table["amplitude"].min() >= np.sqrt(-np.log(6e-3))
    # in the order of pulse and cell, and a cell only once in a pulse
    assert np.all(np.diff(table["pulse"] * 2000 + table["cell"]) > 0)
    for sector in sectors:
        assert np.all((sector.plots["time"] >= sector.start) & (sector.plots["time"] < sector.stop))


@pytest.mark.parametrize("returns", ["raw", "centroids"])
def test_returns_do_not_depend_on_how_a_turn_is_cut(returns: str) -> None:
    def everything(sectors: int) -> bytes:
        run = list(simulator(**BUSY, radar={"sectors": sectors, "returns": returns}).sectors())
        return plots(run).tobytes() + centroids(run).tobytes()

    assert everything(16) == everything(64) == everything(900)


@pytest.mark.parametrize("returns", ["raw", "centroids"])
def test_the_same_seed_gives_the_same_result(returns: str) -> None:
    def everything(sim: Simulator) -> bytes:
        run = list(sim.sectors())
        return plots(run).tobytes() + centroids(run).tobytes()

    radar = {"returns": returns}
    sim = simulator(**BUSY, radar=radar)
    first = everything(sim)
    assert everything(sim) == first  # from the beginning again
    assert everything(simulator(**BUSY, radar=radar)) == first
    assert everything(simulator(2, **BUSY, radar=radar)) != first


def test_two_runs_side_by_side_do_not_disturb_each_other() -> None:
    sim = simulator(**BUSY)
    pairs = list(zip(sim.sectors(), sim.sectors(), strict=True))
    assert all(np.array_equal(a.plots["amplitude"], b.plots["amplitude"]) for a, b in pairs)


def test_noise_alone_has_its_false_alarm_rate() -> None:
    table = plots(list(simulator().sectors()))
    cells = 10 * 1800 * 2000
    assert abs(len(table) - cells * 6e-3) <= SIGMAS * np.sqrt(cells * 6e-3)


def strip(sim: Simulator, azimuth_deg: float, cell: int, reach: int, turns: int) -> np.ndarray:
    """(turns, 2 reach + 1) amplitudes in a cell, pulse by pulse about an azimuth; 0 below the threshold.

    Turn 0 is left out: at north it has no first half.
    """
    table = plots(list(sim.sectors()))
    table = table[table["cell"] == cell]
    centre = round(azimuth_deg / 0.2)
    turn, offset = np.divmod(table["pulse"] - centre + reach, 1800)
    here = (offset <= 2 * reach) & (turn >= 1) & (turn <= turns)
    amplitude = np.zeros((turns, 2 * reach + 1))
    amplitude[turn[here] - 1, offset[here]] = table["amplitude"][here]
    return amplitude


# At the centre of cell 600: the whole echo is in one cell.
CENTRED = STILL | {"range_km": 90.075}


@pytest.mark.parametrize("azimuth_deg", [0.0, 123.4])
def test_pulses_are_weighted_by_the_beam(azimuth_deg: float) -> None:
    """At north as elsewhere."""
    sim = simulator(
        target=[CENTRED | {"azimuth_deg": azimuth_deg}],
        radar={"fluctuation": "swerling0"},
        duration_s=204.0,
    )
    amplitude = strip(sim, azimuth_deg, 600, 5, 50)
    snr = 10.0**1.9 * (250.0 / 90.075) ** 4
    expected = snr * 2.0 ** (-8.0 * (np.arange(-5, 6) * 0.2 / 1.5) ** 2)
    power = np.mean(amplitude**2, axis=0) - 1.0  # noise adds a power of 1
    # The power of a constant echo in noise has the variance 2 SNR + 1.
    np.testing.assert_array_less(np.abs(power - expected), SIGMAS * np.sqrt((2.0 * expected + 1.0) / 50))


@pytest.mark.parametrize("azimuth_deg", [0.0, 123.4])
def test_swerling_one_is_one_strength_a_passage(azimuth_deg: float) -> None:
    turns = 400
    sim = simulator(
        target=[CENTRED | {"azimuth_deg": azimuth_deg, "rcs_db": 40.0}],
        radar={"p_fa": 1e-6},
        duration_s=4.0 * turns + 8.0,
    )
    amplitude = strip(sim, azimuth_deg, 600, 2, turns)
    seen = amplitude.min(axis=1) > 300.0  # noise of 1 then changes a ratio by less than 2 %
    # The mean power is 76.7 dB; under 300 (49.5 dB) it falls once in 500 passages.
    assert np.count_nonzero(seen) >= turns - 10
    ratio = amplitude[seen] / amplitude[seen][:, ::-1]
    assert np.abs(np.log(ratio)).max() < 0.03
    # Between passages the strength is exponential: mean 1, as is its standard deviation.
    strength = amplitude[:, 2] ** 2 / (10.0**5.9 * (250.0 / 90.075) ** 4)
    assert strength.mean() == pytest.approx(1.0, abs=SIGMAS / np.sqrt(turns))
    assert np.median(strength) == pytest.approx(np.log(2.0), abs=SIGMAS / np.sqrt(turns))
    successive = np.corrcoef(strength[:-1], strength[1:])[0, 1]
    assert abs(successive) < SIGMAS / np.sqrt(turns)


def test_single_pulse_detection_at_250_km() -> None:
    """P_D = P_FA^(1/(1 + SNR)) on the axis, in the middle of a cell: 0.9384 at 19 dB."""
    azimuths = np.arange(0.0, 360.0, 18.0)
    sim = simulator(
        target=[STILL | {"range_km": 249.975, "azimuth_deg": float(azimuth)} for azimuth in azimuths],
        duration_s=408.0,
    )
    table = plots(list(sim.sectors()))
    hit = (table["cell"] == 1666) & (table["pulse"] % 90 == 0) & (table["pulse"] >= 1800)
    trials = 20 * 101
    p_d = 6e-3 ** (1.0 / (1.0 + 10.0**1.9 * (250.0 / 249.975) ** 4))
    assert abs(np.count_nonzero(hit) - trials * p_d) <= SIGMAS * np.sqrt(trials * p_d * (1.0 - p_d))


@pytest.mark.parametrize(("metres", "expected"), [(0.025, 0.0), (0.05, 2.0)])
def test_echoes_of_two_targets_interfere_by_their_range(metres: float, expected: float) -> None:
    """A quarter of the wavelength of 0.1 m apart they cancel, half of it apart they add."""
    one = CENTRED | {"azimuth_deg": 50.0, "rcs_db": 40.0}
    sim = simulator(
        target=[one, one | {"range_km": 90.075 + metres / 1000.0}], radar={"fluctuation": "swerling0"}
    )
    single = np.sqrt(10.0**5.9 * (250.0 / 90.075) ** 4)
    amplitude = strip(sim, 50.0, 600, 0, 8)
    # the farther one leaks a part of 1/6000 to the next cell, and noise is of 1 in 6,876
    np.testing.assert_allclose(amplitude / single, expected, atol=2e-3)


@pytest.mark.parametrize("speed_kt", [0.0, 40.0])
def test_the_strongest_plot_is_at_the_truth_of_its_time(speed_kt: float) -> None:
    strong = {"range_km": 100.0, "azimuth_deg": 1.0, "heading_deg": 260.0, "speed_mps": 300.0, "rcs_db": 30.0}
    sim = simulator(
        target=[strong],
        radar={"fluctuation": "swerling0", "course_deg": 70.0, "speed_kt": speed_kt},
        duration_s=120.0,
    )
    table = plots(list(sim.sectors()))
    own = speed_kt * 1852.0 / 3600.0 * np.array([np.sin(70 * DEG), np.cos(70 * DEG)])
    for turn in range(1, 29):
        middle = turn * 1800 - 60  # the target flies from 1° to about 340°: look round it
        near = table[np.abs(table["pulse"] - middle) < 300]
        peak = near[np.argmax(near["amplitude"])]
        truth = sim.truth(float(peak["time"]))[0]
        east, north = np.array([truth["east"], truth["north"]]) - own * peak["time"]
        distance, azimuth = to_polar(east, north)
        assert abs(peak["range"] - distance) <= 75.5  # half a cell, and noise where two are equal
        assert abs(wrap(peak["azimuth"] - azimuth)) <= 0.35 * DEG  # the pattern's top is flat: two pulses


def test_sectors_say_where_a_moving_radar_is() -> None:
    sim = simulator(radar={"course_deg": 90.0, "speed_kt": 36.0})
    sector = list(sim.sectors())[-1]
    assert sector.position == pytest.approx((36.0 * 1852.0 / 3600.0 * 40.0, 0.0, 0.0), abs=1e-9)


RING = [STILL | {"range_km": 100.0, "azimuth_deg": float(a)} for a in range(0, 360, 10)]


def test_centroids_have_their_statistics() -> None:
    turns = 100
    sim = simulator(target=RING, radar={"returns": "centroids"}, duration_s=4.0 * turns)
    table = centroids(list(sim.sectors()))
    assert table.dtype == CENTROID
    trials = 36 * turns
    assert abs(len(table) - trials * 0.9) <= SIGMAS * np.sqrt(trials * 0.09)
    nearest = np.round(table["azimuth"] / (10 * DEG)) * 10 * DEG
    z_azimuth, z_range = wrap(table["azimuth"] - nearest) / (0.1 * DEG), (table["range"] - 100e3) / 50.0
    for z in (z_azimuth, z_range):
        assert abs(z.mean()) <= SIGMAS / np.sqrt(len(z))
        assert abs(np.mean(z**2) - 1.0) <= SIGMAS * np.sqrt(2.0 / len(z))
    assert abs(np.mean(z_azimuth * z_range)) <= SIGMAS / np.sqrt(len(table))
    assert np.all(table["sd_range"] == 50.0)
    assert np.all(table["sd_azimuth"] == 0.1 * DEG)


def test_centroids_come_with_the_beam_and_never_late() -> None:
    sim = simulator(**BUSY, radar={"returns": "centroids", "sd_azimuth_deg": 1.0, "sectors": 900})
    ordinal = 0
    for sector in sim.sectors():
        table = sector.centroids
        angle = unwrap_near(table["azimuth"], 0.5 * (sector.begin + sector.end))
        assert np.all((angle >= sector.begin - 1e-9) & (angle <= sector.end + 1e-9))
        assert np.all((table["time"] >= sector.start) & (table["time"] < sector.stop))
        np.testing.assert_allclose(table["time"], angle / TURN * 4.0, atol=1e-9)
        np.testing.assert_array_equal(table["ordinal"], np.arange(ordinal, ordinal + len(table)))
        ordinal += len(table)
    assert ordinal > 0


def test_at_north_a_target_is_measured_once_a_turn() -> None:
    """Its error in azimuth points to one side or the other of the turn's beginning."""
    sim = simulator(
        target=[STILL | {"range_km": 100.0, "azimuth_deg": 0.0}],
        radar={"returns": "centroids", "p_d": 1.0, "sd_azimuth_deg": 0.5},
        duration_s=400.0,
    )
    table = centroids(list(sim.sectors()))
    nearest = np.round(table["time"] / 4.0).astype(int)
    # Turn 0 is there if its error pointed forward, the turn at the very end if backward.
    assert np.array_equal(nearest[(nearest > 0) & (nearest < 100)], np.arange(1, 100))
    west = np.count_nonzero(table["azimuth"] > np.pi)
    assert abs(west - 50) <= SIGMAS * 5


@pytest.mark.parametrize("miss_km", [0.05, 1.0])
@pytest.mark.parametrize("heading_deg", [90.0, 270.0])
def test_crossings_are_counted_by_the_winding_of_the_bearing(miss_km: float, heading_deg: float) -> None:
    """A fly-over: with the beam or against it, the axis passes a target as often as it overtakes it."""
    side = 1.0 if heading_deg == 270.0 else -1.0
    fly_over = {"east_km": side * 20.0, "north_km": miss_km, "heading_deg": heading_deg, "speed_mps": 300.0}
    sim = simulator(
        target=[fly_over],
        radar={"returns": "centroids", "p_d": 1.0, "sd_azimuth_deg": 1e-6, "sd_range_m": 1e-3},
        duration_s=136.0,
    )
    table = centroids(list(sim.sectors()))
    time = np.arange(0.0, 136.0, 0.001)
    bearing = np.unwrap(np.arctan2(side * (20e3 - 300.0 * time), miss_km * 1000.0))
    passed = np.floor((TURN * time / 4.0 - bearing) / TURN)
    assert len(table) == np.count_nonzero(np.diff(passed) > 0)
    assert np.all(np.diff(passed) >= 0)  # this target never overtakes the beam
    truth = np.array([(sim.truth(t)[0]["east"], sim.truth(t)[0]["north"]) for t in table["time"]])
    distance, azimuth = to_polar(truth[:, 0], truth[:, 1])
    # In a step of 2.2 ms the bearing, interpolated between pulses, bends by under 1e-3 rad at 50 m.
    np.testing.assert_allclose(wrap(table["azimuth"] - azimuth), 0.0, atol=1e-3)
    np.testing.assert_allclose(table["range"], distance, atol=0.01)


def test_land_is_the_same_at_each_turn() -> None:
    patch = {"from_range_km": 20.0, "to_range_km": 23.0, "from_azimuth_deg": 350.0, "to_azimuth_deg": 10.0}
    table = plots(list(simulator(clutter={"land": [patch | {"snr_db": 60.0}]}).sectors()))
    over = (table["cell"] >= 133) & (table["cell"] < 153)
    table = table[over & (table["amplitude"] > 100.0)]
    place, count = np.unique((table["pulse"] % 1800) * 2000 + table["cell"], return_counts=True)
    assert len(place) == pytest.approx(100 * 20, rel=0.05)  # under 100 of 1000 rms is one in a hundred
    assert np.count_nonzero(count == 10) > 0.98 * len(place)  # the others are near the limit of 100
    order = np.argsort((table["pulse"] % 1800) * 2000 + table["cell"], kind="stable")
    by_place = np.split(table["amplitude"][order], np.cumsum(count)[:-1])
    assert max(float(np.ptp(amplitude)) for amplitude in by_place) < 10.0  # only noise of 1 differs


def test_false_targets_at_north_are_lit_from_both_sides() -> None:
    clutter = {"uniform": [{"density_per_km2": 0.01}]}
    table = plots(list(simulator(radar={"p_fa": 1e-6}, clutter=clutter, duration_s=204.0).sectors()))
    pulse = np.bincount(table["pulse"] % 1800, minlength=1800)
    blocks = np.roll(pulse, 7).reshape(120, 15).sum(axis=1)  # the first is about north, 3° wide
    assert abs(blocks[0] - blocks[1:].mean()) <= SIGMAS * blocks[1:].std()


def test_points_are_single_returns() -> None:
    clutter = {"uniform": [{"per_cell": 0.01, "kind": "points"}]}
    table = plots(list(simulator(radar={"p_fa": 1e-9}, clutter=clutter).sectors()))
    mean = 10 * 0.01 * 2000 * 240
    assert abs(len(table) - mean) <= SIGMAS * np.sqrt(mean)


@pytest.mark.parametrize(
    ("tables", "path"),
    [
        ({"radar": {"prf_hz": 501.0}}, "radar.prf_hz"),
        ({"radar": {"prf_hz": 10.0, "rotation_s": 1.0, "sectors": 16}}, "radar.sectors"),
        ({"radar": {"cell_m": 400e3}}, "radar.cell_m"),
        ({"duration_s": 0.06}, "duration_s"),
        (
            {
                "radar": {"speed_kt": 5.0},
                "clutter": {
                    "land": [
                        {"from_range_km": 1.0, "to_range_km": 2.0}
                        | {"from_azimuth_deg": 0.0, "to_azimuth_deg": 9.0}
                    ]
                },
            },
            "clutter.land",
        ),
    ],
)
def test_what_a_radar_can_not_do(tables: dict[str, Any], path: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        simulator(**tables)
    assert [problem for problem, _ in caught.value.problems] == [path]


def test_centroids_know_no_ambiguity() -> None:
    assert simulator(radar={"prf_hz": 501.0, "returns": "centroids"}).skipped == {}
