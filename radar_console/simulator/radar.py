"""The simulator: a scenario in, sectors out, with the truth beside them."""

from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path

import numpy as np

from radar_console.core.errors import ScenarioError
from radar_console.core.messages import NO_CENTROIDS, NO_PLOTS, Sector, Table
from radar_console.core.units import KM
from radar_console.scenario import Scenario
from radar_console.simulator import targets
from radar_console.simulator.antenna import Antenna
from radar_console.simulator.clutter import land_cells, land_points
from radar_console.simulator.points import Measurements
from radar_console.simulator.raw import RawReturns, cell_count
from radar_console.simulator.scene import Scene

SPEED_OF_LIGHT = 299792458.0  # m/s


class Simulator:
    """A source of sectors from a scenario; as fast as they are consumed.

    Parameters
    ----------
    scenario : the settings
    rng : seeds everything that is random here; the same state gives the same sectors
    file : named in errors

    Attributes
    ----------
    radar : the sensor
    duration : s, to the end of the last whole sector
    skipped, noted : always empty: a simulation has no bad records
    names : of the targets in the order of their numbers in the truth

    Raises
    ------
    ScenarioError   the scenario can't be played; everything that is wrong with it at once
    """

    def __init__(self, scenario: Scenario, rng: np.random.Generator, file: Path | str = "") -> None:
        settings = scenario.radar
        antenna = Antenna(
            settings.rotation_s, max(round(settings.prf_hz * settings.rotation_s), 1), settings.sectors
        )
        swarm_rng, land_rng, *self._generators = rng.spawn(5)
        built, problems = targets.build(
            scenario.target, scenario.swarm, settings, scenario.duration_s, swarm_rng
        )
        self._sectors = int(scenario.duration_s / settings.rotation_s * settings.sectors * (1.0 + 1e-12))
        self._scene = Scene(settings, antenna, built)
        problems += targets.leaving(
            built,
            self._scene.slant,
            len(scenario.target),
            self._scene.max_range,
            scenario.duration_s,
        )
        problems += _radar_problems(scenario, antenna, self._sectors)
        if problems:
            raise ScenarioError(file, problems)

        self._scenario, self._clutter, self._antenna = scenario, scenario.clutter, antenna
        cells = cell_count(settings.max_range_km, settings.cell_m)
        self._raw = settings.returns == "raw"
        if self._raw:
            self._land = land_cells(scenario.clutter.land, settings, antenna, cells, land_rng)
        else:
            self._land_points = land_points(scenario.clutter.land, settings, antenna, land_rng)
        self.radar = settings.message
        self.duration = float(antenna.time(antenna.edge(self._sectors)))
        self.skipped: dict[str, int] = {}
        self.noted: dict[str, int] = {}
        given = [target.name for target in scenario.target]
        self.names = tuple(name or str(i + 1) for i, name in enumerate(given)) + tuple(
            str(i + 1) for i in range(len(given), len(built))
        )

    def sectors(self) -> Iterator[Sector]:
        """Every sector from the beginning; each call begins anew, with the same result.

        Raw returns go out with `complete` at the sector's beginning, which clustering replaces;
        centroids are complete to its end.
        """
        turns = self._turns()
        for turn in range(-(-self._sectors // self._antenna.sectors)):
            yield from self._cut(next(turns), turn)

    def truth(self, t: float) -> Table:
        """The targets alive at `t`, s: TRUTH, from the radar's site."""
        return self._scene.targets.truth(t, self._scene.radar.height_m)

    def facts(self) -> list[tuple[str, str]]:
        """Label and value, for the user."""
        scenario, radar = self._scenario, self._scenario.radar
        place = "nowhere in particular"
        if self.radar.site is not None:
            place = f"{radar.latitude_deg:.4f}°, {radar.longitude_deg:.4f}°, {radar.height_m:g} m"
        return [
            ("format", "scenario"),
            ("title", scenario.title),
            ("about", scenario.description),
            ("duration", f"{self.duration:,.1f} s"),
            ("radar", f"{radar.name}, {place}"),
            ("rotation", f"{radar.rotation_s:g} s, {60.0 / radar.rotation_s:.3g} rpm"),
            ("range", f"{radar.max_range_km:g} km"),
            ("returns", radar.returns),
            ("targets", f"{len(self.names):,}"),
            ("seed", str(scenario.seed)),
        ]

    def _turns(self) -> Iterator[Table]:
        receiver, echoes, chance = deepcopy(self._generators)
        if self._raw:
            return RawReturns(self._scene, self._clutter, self._land, receiver, echoes, chance).turns()
        return Measurements(self._scene, self._clutter, self._land_points, receiver, chance).turns()

    def _cut(self, returns: Table, turn: int) -> Iterator[Sector]:
        """The sectors of a turn, as many of them as belong to the simulation."""
        antenna, raw = self._antenna, self._raw
        first = turn * antenna.sectors
        last = min(first + antenna.sectors, self._sectors)
        edges = np.array([antenna.edge(number) for number in range(first, last + 1)])
        times, angles = antenna.time(edges).tolist(), antenna.angle(edges).tolist()
        east, north = (own.tolist() for own in self._scene.own_position(antenna.time(edges)))
        cuts = np.searchsorted(returns["time"], times).tolist()
        for i in range(last - first):
            part = returns[cuts[i] : cuts[i + 1]]
            yield Sector(
                self.radar,
                start=times[i],
                stop=times[i + 1],
                begin=angles[i],
                end=angles[i + 1],
                complete=angles[i] if raw else angles[i + 1],
                position=(east[i + 1], north[i + 1], 0.0),
                plots=part if raw else NO_PLOTS,
                centroids=NO_CENTROIDS if raw else part,
            )


def _radar_problems(scenario: Scenario, antenna: Antenna, sectors: int) -> list[tuple[str, str]]:
    """What a radar can't do, beyond what single keys can say."""
    radar = scenario.radar
    problems = []
    if antenna.pulses < radar.sectors:
        problems.append(("radar.sectors", f"a turn has only {antenna.pulses} pulses (prf_hz · rotation_s)"))
    unambiguous = SPEED_OF_LIGHT / (2.0 * radar.max_range_km * KM)
    if radar.returns == "raw" and radar.prf_hz > unambiguous:
        what = f"echoes from {radar.max_range_km:g} km would be ambiguous; at most {unambiguous:.0f}"
        problems.append(("radar.prf_hz", what))
    if radar.returns == "raw" and cell_count(radar.max_range_km, radar.cell_m) < 1:
        problems.append(("radar.cell_m", "longer than the instrumented range"))
    if sectors < 1:
        problems.append(("duration_s", f"shorter than a sector of {radar.rotation_s / radar.sectors:g} s"))
    if radar.speed_kt > 0.0 and scenario.clutter.land:
        problems.append(("clutter.land", "needs a radar that stands still; remove radar.speed_kt"))
    return problems
