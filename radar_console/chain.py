"""A source, the chain behind it (clustering, tracker), and what is measured on the way."""

import math
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Protocol

import numpy as np

from radar_console import pipeline
from radar_console.core.durations import Durations
from radar_console.core.messages import Sector, Table, TrackStatus
from radar_console.core.units import TURN
from radar_console.pipeline import Gauge, Pace, Policy
from radar_console.scenario import Configuration, Scenario

PRIMING = 8  # sectors; the first returns load the kernels


class Source(pipeline.Source, Protocol):
    """A source that can also say what it holds."""

    @property
    def noted(self) -> Mapping[str, int]:
        """What was mended or is worth knowing, counted; nothing of it was lost."""
        ...

    def facts(self) -> list[tuple[str, str]]:
        """Label and value, for `radar-console info`."""
        ...


@dataclass(frozen=True)
class Opened:
    """A source, and the settings of the stages behind it.

    Attributes
    ----------
    title : for the screen
    kind : "simulation", "recording" or "plot table"
    truth : where the targets are at a time, s; None if nobody knows
    seed : of the tracker
    """

    source: Source
    settings: Configuration
    title: str
    kind: str
    truth: Callable[[float], Table] | None
    seed: int


def simulation(settings: Scenario, seed: int, file: Path | str = "") -> Opened:
    """The simulator of a scenario, and the settings of the stages behind it.

    Parameters
    ----------
    seed : of the simulator and of the tracker
    file : named in errors

    Raises
    ------
    ScenarioError   the scenario can't be played
    """
    from radar_console.simulator.radar import Simulator

    simulator = Simulator(settings, np.random.default_rng(seed), file)
    own = Configuration(
        radar=settings.radar, plots=settings.plots, tracker=settings.tracker, display=settings.display
    )
    return Opened(simulator, own, settings.title, "simulation", simulator.truth, seed)


@dataclass
class Tally:
    """Counts and times of a run, for `--stats` and the text status."""

    plots: int = 0
    centroids: int = 0
    confirmed: set[int] = field(default_factory=set)
    live: dict[int, int] = field(default_factory=dict)
    data_time: float = 0.0
    raw: bool = False
    turns: int = 0
    tracker_s: Durations = field(default_factory=Durations)
    latency_s: Durations = field(default_factory=Durations)
    _turn: int | None = None
    _turn_s: float = 0.0

    def take(self, sector: Sector) -> None:
        """Count what a sector brought at the end of the chain."""
        self.data_time = sector.stop
        self.raw |= len(sector.plots) > 0
        # Of a source that delivers centroids, they are the plots.
        self.plots += len(sector.plots) if self.raw else len(sector.centroids)
        self.centroids += len(sector.centroids)
        tracks = sector.tracks
        if not len(tracks):
            return
        self.latency_s.add(sector.stop - tracks["plot_time"][tracks["hit"]])
        for number, status in zip(tracks["track"].tolist(), tracks["status"].tolist(), strict=True):
            if status == TrackStatus.DELETED:
                self.live.pop(number, None)
                continue
            self.live[number] = status
            if status == TrackStatus.CONFIRMED:
                self.confirmed.add(number)

    def took(self, turn: int, seconds: float) -> None:
        """Add up what the tracker took in a turn of the antenna."""
        if self._turn is None or turn > self._turn:
            self.end_turn()
            self._turn, self.turns = turn, self.turns + 1
        self._turn_s += seconds

    def end_turn(self) -> None:
        """Count what the tracker took in the turn that ends."""
        if self._turn is not None:
            self.tracker_s.add(self._turn_s)
        self._turn, self._turn_s = None, 0.0

    def live_with(self, *statuses: TrackStatus) -> int:
        """How many tracks live now with one of these statuses."""
        return sum(status in statuses for status in self.live.values())


@dataclass
class Chain:
    """A source with its stages, ready to run once.

    Attributes
    ----------
    clock : what the tracker's time is taken with, s
    """

    opened: Opened
    clock: Callable[[], float] = time.perf_counter
    tally: Tally = field(default_factory=Tally)
    gauge: Gauge = field(default_factory=Gauge)

    def __post_init__(self) -> None:
        # Imported here: who only opens a source need not wait for the kernels.
        from radar_console.plots.clustering import Clustering
        from radar_console.tracker import Tracker

        opened, settings = self.opened, self.opened.settings
        self.clustering = Clustering(settings.plots, settings.radar)
        self.tracker = Tracker(settings.tracker, opened.source.radar, opened.seed)

    def run(
        self, threads: bool = False, pace: Pace | None = None, policy: Policy = Policy.BLOCK
    ) -> Generator[Sector]:
        """Sectors with their tracks, counted in `tally`."""
        source: Iterable[Sector] = self.opened.source.sectors()
        if pace is not None:
            source = pace(source)
        stages = (self.clustering, self._timed_tracker)
        run = (
            pipeline.threaded(source, *stages, policy=policy, gauge=self.gauge)
            if threads
            else pipeline.inline(source, *stages)
        )
        with closing(run):
            for sector in run:
                self.tally.take(sector)
                yield sector

    def prime(self) -> None:
        """Load what the stages compile, on a chain that is thrown away: live data must not wait for it."""
        for _ in islice(Chain(self.opened).run(), PRIMING):
            pass

    @property
    def skipped(self) -> dict[str, int]:
        """What the source could not use and what the stages had to leave, counted by reason."""
        counts = self.tracker.counts
        left = {
            "plots after the beam had left them": self.clustering.late,
            "centroids after the beam had left them": counts.late,
            "centroids with a range, azimuth or time that cannot be": counts.invalid,
            "sectors with a time, angle or position that cannot be": counts.broken,
            "young tracks beyond max_tracks": counts.capped,
        }
        return dict(self.opened.source.skipped) | {reason: n for reason, n in left.items() if n}

    @property
    def noted(self) -> dict[str, int]:
        """What the source mended and what the stages did otherwise than asked, counted; nothing was lost."""
        counts = self.tracker.counts
        done = {
            "heights and deviations that cannot be (taken as not claimed)": counts.claims,
            "centroids wider than a target (they start no track)": counts.extended,
            "sectors whose time goes back (held)": counts.clock_back,
            "sectors whose beam goes back (held)": counts.beam_back,
            "clusters closed before all their tracks were served (wait_deg)": counts.forced,
            "updates past the exact association's budget (approximated)": counts.approximate,
            "passes over sectors where the radar did not look (no misses)": counts.blanked,
        }
        return dict(self.opened.source.noted) | {what: n for what, n in done.items() if n}

    def _timed_tracker(self, sectors: Iterable[Sector]) -> Iterator[Sector]:
        """The tracker stage, its time added up for each turn of the antenna."""
        for sector in sectors:
            began = self.clock()
            done = self.tracker.push(sector)
            # A sector that ends at north, or one without extent there, belongs to the turn before.
            turn = math.ceil(sector.end / TURN - 1e-9) - 1
            self.tally.took(turn, self.clock() - began)
            yield done
        self.tally.end_turn()
        rest = self.tracker.flush()
        if rest is not None:
            yield rest
