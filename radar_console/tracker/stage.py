"""The tracker as a stage of the chain: sectors in, sectors with track rows out.

The stream is cut again into bins of fixed angles, so how it came cut has no influence on the
tracks, not in one bit: a bin is processed once the watermark `Sector.complete` has passed its end.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radar_console.core.messages import CENTROID, NO_TRACKS, TRACK, Radar, Sector, Table, blank
from radar_console.core.units import TURN
from radar_console.estimation.gaussian import Array
from radar_console.estimation.kalman import MIXTURE
from radar_console.estimation.particle import normals
from radar_console.scenario import TrackerSettings
from radar_console.tracker import cloud, clutter, gating, modes
from radar_console.tracker.association.choose import KINDS
from radar_console.tracker.clusters import associate, step, weigh
from radar_console.tracker.intake import HUGE, bins, merge, take
from radar_console.tracker.management import adopt
from radar_console.tracker.records import (
    BEAM,
    EDGE,
    ENTRY,
    MEMBER,
    N_EDGES,
    N_MEMBERS,
    N_NEXT_BIN,
    N_PAIRS,
    N_PAST,
    N_POOL,
    N_QUEUE,
    N_ROWS,
    N_SLOTS,
    N_TRACKS,
    PAIR,
    PARAMETERS,
    PAST,
    PENDING,
    SIZES,
    STATE,
    SWEPT_COUNTS,
    WHEREABOUTS,
    Belief,
    Books,
    World,
)
from radar_console.tracker.sweep import close_bin, open_bin, sweep

# In the order of their numbers in `records`.
_FILTERS = ("kalman", "extended", "unscented", "imm", "particle")
_PROPOSALS = ("prior", "optimal", "adapted")
_RESAMPLINGS = ("systematic", "stratified", "residual", "multinomial")
_MODELS = ("cv", "ca", "ct", "singer")

_INITIATIONS = ("auto", "m-of-n", "score", "branching")

_MANY_TRACKS = 100  # from which on threads are worth their trouble
_LEAST_SHARE = 4  # members for each thread
_CLIMB_NOISE = 1.0  # m²/s³, of the rate of climb
_LOG = 2048  # sectors that are remembered, to find where the beam was
_FEW_TURNS = 4


@dataclass(slots=True)
class Counts:
    """What the tracker did, and what it had to leave."""

    centroids: int = 0
    invalid: int = 0  # centroids with a range, azimuth or time that cannot be
    claims: int = 0  # heights and deviations of centroids that cannot be, taken as not claimed
    late: int = 0  # centroids below the watermark: their bin was closed
    extended: int = 0  # centroids that could not start a track: wider than a target
    started: int = 0
    confirmed: int = 0
    deleted: int = 0  # before they were confirmed
    lost: int = 0  # confirmed tracks that were deleted
    forced: int = 0  # clusters that were closed before all their members were served
    approximate: int = 0  # updates whose association was past the exact algorithm's budget
    blanked: int = 0  # passes over sectors where the radar did not look
    merged: int = 0  # tracks that another one had the same plots as
    capped: int = 0  # young tracks that went because there were too many
    clock_back: int = 0  # sectors whose time went back
    beam_back: int = 0  # sectors whose angle went back
    broken: int = 0  # sectors whose time, angle or position cannot be: they are passed on as they are


class Tracker:
    """Particle filter and JPDA, fed by the beam.

    Parameters
    ----------
    settings, radar : the scenario's [tracker], and the sensor
    seed : of all random numbers
    threads : at work on the particles when there are many tracks; their number has no influence on the
        tracks. One is fastest as far as was measured, see docs/performance.md.
    """

    def __init__(self, settings: TrackerSettings, radar: Radar, seed: int, threads: int = 1) -> None:
        self.settings, self.radar, self._counts = settings, radar, Counts()
        self._above_sea = radar.site.height if radar.site else 0.0
        self._world = _empty_world(settings, radar, seed)
        self._queue = np.zeros(0, PENDING)
        self._log = _BeamLog()
        self._next_bin: int | None = None
        self._last: Sector | None = None
        self._threads = threads
        self._many_tracks = _MANY_TRACKS
        self._pool: ThreadPoolExecutor | None = None

    @property
    def counts(self) -> Counts:
        """What has been done so far."""
        for name, value in zip(SWEPT_COUNTS, self._world.books.tally.tolist(), strict=True):
            setattr(self._counts, name, value)
        return self._counts

    def __call__(self, sectors: Iterable[Sector]) -> Iterator[Sector]:
        """Add the rows of all services to the sectors that completed them."""
        for sector in sectors:
            yield self.push(sector)
        last = self.flush()
        if last is not None:
            yield last

    def push(self, sector: Sector) -> Sector:
        """The sector, with a row for each track that was served by it, hit or missed."""
        if not _sound(sector):
            self._counts.broken += 1
            self._counts.centroids += len(sector.centroids)
            self._counts.invalid += len(sector.centroids)
            return sector
        if sector.stop < sector.start or (self._last and sector.start < self._last.stop):
            self._counts.clock_back += 1
        if sector.end < sector.begin or (self._last and sector.end < self._last.end):
            self._counts.beam_back += 1
        self._log.append(sector)
        if self._next_bin is None:
            self._next_bin = math.floor(self._log.angle[0] / self._bin) + 1
            self._world.books.size[N_NEXT_BIN] = self._next_bin
            self._world.clutter["last"] = math.floor(self._log.angle[0] / TURN * clutter.COLUMNS)
        self._skip_long_gap()
        if len(sector.centroids):
            self._take(sector)
        self._last = sector
        rows = self._run(min(sector.complete, float(self._log.angle[-1])), final=False)
        return sector.adding(tracks=rows) if len(rows) else sector

    def adopt(self, tracks: Table) -> None:
        """Go on with tracks from elsewhere, as confirmed ones, from the last sector on.

        Parameters
        ----------
        tracks : TRACK  their numbers, times, positions, velocities and standard deviations

        Raises
        ------
        ValueError      no sector has said yet where the beam is
        """
        if self._last is None:
            raise ValueError("expected a sector before tracks are adopted")
        need = self._world.need
        need[:] = self._world.books.size
        need[N_TRACKS] += len(tracks)
        need[N_SLOTS] += len(tracks)
        self._world = _grown(self._world)
        world, first = self._world, int(self._world.books.size[N_TRACKS])
        rows = world.tracks[first : first + len(tracks)]
        rows[:] = np.zeros(1, STATE)
        rows["id"], rows["born"], rows["t"] = tracks["track"], tracks["born"], tracks["time"]
        for i, name in enumerate(("east", "north", "v_east", "v_north")):
            rows["x"][:, i], rows["P"][:, i, i] = tracks[name], tracks["sd_" + name] ** 2
        rows["up"] = np.nan
        rows["sd_range"], rows["sd_azimuth"] = self.radar.sd_range, self.radar.sd_azimuth
        beam, (east, north, _) = float(self._log.angle[-1]), self._last.position
        azimuth = np.arctan2(tracks["east"] - east, tracks["north"] - north)
        rows["psi"] = beam - np.mod(beam - azimuth, TURN)
        rows["u_e"], rows["u_n"] = np.sin(azimuth), np.cos(azimuth)
        for name in ("root", "last", "previous", "first", "mode_3a", "address"):
            rows[name] = -1
        rows["hits"] = rows["passes"] = self.settings.confirm_hits
        rows["history"], rows["voiced"] = 1, True
        for k in range(len(tracks)):
            adopt(first + k, east, north, world)

    def flush(self) -> Sector | None:
        """What is pending at the end of a stream, as one more sector; None if there is nothing."""
        if self._last is None:
            return None
        end = float(self._log.angle[-1])
        rows = self._run(end, final=True)
        if not len(rows):
            return None
        stop = float(self._log.time[-1])
        return Sector(self.radar, stop, stop, end, end, end, self._last.position, tracks=rows)

    def _take(self, sector: Sector) -> None:
        """Put a sector's centroids into the queue, in the order of their angles."""
        table = np.ascontiguousarray(sector.centroids)
        waiting = self._queue[self._world.books.size[N_QUEUE] :]
        fresh = np.empty(len(table), PENDING)
        closed = (self._next_bin_number - 1) * self._bin
        n, late, claims = take(
            table, *self._log.known, closed, self._above_sea, self.settings.dimensions == 3, self._world.par,
            fresh,
        )  # fmt: skip
        self._counts.centroids += len(table)
        self._counts.invalid += len(table) - n - late
        self._counts.late += late
        self._counts.claims += claims
        self._queue = np.empty(len(waiting) + n, PENDING)
        merge(waiting, fresh[:n], self._queue)
        self._world.books.size[N_QUEUE] = 0

    @property
    def _bin(self) -> float:
        return float(self._world.par["bin"])

    @property
    def _next_bin_number(self) -> int:
        assert self._next_bin is not None
        return self._next_bin

    def _skip_long_gap(self) -> None:
        """Whole turns that nobody saw: the tracks' angles go with the beam, and nothing is counted."""
        gap = self._log.angle[-2] - self._next_bin_number * self._bin if len(self._log.angle) > 1 else 0.0
        turns = math.floor(gap / TURN)
        if turns >= _FEW_TURNS:
            self._world.tracks["psi"] += turns * TURN
            self._world.books.agenda["time"] = -np.inf
            self._world.books.alarm[:] = -np.inf
            self._next_bin = self._next_bin_number + turns * self.settings.bins

    def _run(self, complete: float, final: bool) -> Table:
        """Serve the bins below the watermark; the rows of what was served."""
        first, width = self._next_bin_number, self._bin
        stop = first
        while stop * width <= complete:
            stop += 1
        if final:
            stop += 1  # the bin in which the stream ends
        if stop == first:
            return NO_TRACKS
        beams = self._log.bins(first - 1, stop - first, width)
        rows: list[Table] = []
        done, size = 0, self._world.books.size
        while done < len(beams):
            done += self._sweep(beams[done:] if done else beams, final)
            if size[N_ROWS]:
                rows.append(_copied(self._world.books.rows[: size[N_ROWS]]))
                size[N_ROWS] = 0
            if done < len(beams):
                self._world = _grown(self._world)
        self._next_bin = stop
        if not rows:
            return NO_TRACKS
        return rows[0] if len(rows) == 1 else np.concatenate(rows)

    def _sweep(self, beams: Any, final: bool) -> int:
        """Process bins until one needs larger tables; the number of bins that are done."""
        if self._threads == 1 or self._world.books.size[N_SLOTS] < self._many_tracks:
            return int(sweep(beams, self._queue, self._world, final))
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads - 1, "tracker")
        world = self._world
        for b in range(len(beams)):
            if not open_bin(beams[b], self._queue, world, final):
                return b
            if world.books.size[N_MEMBERS]:
                self._share(weigh)
                associate(world)
                self._share(step)
            close_bin(beams[b], world, final)
        return len(beams)

    def _share(self, work: Callable[[World, int, int], None]) -> None:
        """Do the work of all members, a slice in each thread."""
        assert self._pool is not None
        members = int(self._world.books.size[N_MEMBERS])
        parts = min(self._threads, max(members // _LEAST_SHARE, 1))
        edges = [members * k // parts for k in range(parts + 1)]
        others = [self._pool.submit(work, self._world, lo, hi) for lo, hi in pairwise(edges[1:])]
        work(self._world, 0, edges[1])
        for other in others:
            other.result()


def _sound(sector: Sector) -> bool:
    """Time, angle and position are such as can be; the beam made a few turns at most."""
    numbers = (sector.start, sector.stop, sector.begin, sector.end, sector.complete, *sector.position)
    possible = all(abs(number) <= HUGE for number in numbers)  # False for NaN
    return possible and sector.end - sector.begin <= _FEW_TURNS * TURN


class _BeamLog:
    """Where the beam and the sensor were: edges of the sectors, in the order of angle and of time."""

    def __init__(self) -> None:
        self._rows = np.zeros((5, 2 * _LOG))  # time, angle, east, north, up
        self._seen = np.zeros(2 * _LOG, np.bool_)  # the radar looked between the edge before and this
        self._count = 0

    @property
    def time(self) -> Array:
        return self._rows[0, : self._count]

    @property
    def angle(self) -> Array:
        return self._rows[1, : self._count]

    def append(self, sector: Sector) -> None:
        """Time and angle that go back are held where they were."""
        if self._count == 0 or sector.begin > self._rows[1, self._count - 1] + 1e-9:
            self._add(sector.start, sector.begin, sector.position, False)
        self._add(sector.stop, sector.end, sector.position, True)

    def _add(self, time: float, angle: float, position: tuple[float, float, float], seen: bool) -> None:
        n = self._count
        if n == 2 * _LOG:
            self._rows[:, :_LOG], self._seen[:_LOG] = self._rows[:, _LOG:].copy(), self._seen[_LOG:].copy()
            n = _LOG
        if n:
            time, angle = max(time, self._rows[0, n - 1]), max(angle, self._rows[1, n - 1])
        self._rows[:, n] = time, angle, *position
        self._seen[n] = seen
        self._count = n + 1

    @property
    def known(self) -> tuple[Array, int]:
        """The edges (5, m), and how many of them are filled."""
        return self._rows, self._count

    def bins(self, first: int, count: int, width: float) -> Any:
        """The BEAM table (count,) of the bins from number `first` on."""
        beams = np.empty(count, BEAM)
        bins(self._rows, self._count, self._seen, first, width, beams)
        return beams


def warm_up() -> None:
    """Compile all kernels, or load them from their cache, by tracking two targets for a moment."""
    radar = Radar("", 4.0, 1000.0, 1.0, 0.01)
    for threads in (1, 2):
        tracker = Tracker(TrackerSettings(particles=10), radar, 0, threads)
        tracker._many_tracks = 0
        for turn in range(8):
            centroids = np.zeros(2, CENTROID)
            centroids["ordinal"] = 2 * turn, 2 * turn + 1
            centroids["time"], centroids["azimuth"] = 4.0 * turn + 1.0, 0.5 * math.pi
            centroids["range"], centroids["height"] = (500.0, 501.0), np.nan
            tracker.push(Sector(radar, 4.0 * turn, 4.0 * turn + 4.0, TURN * turn, TURN * (turn + 1),
                                TURN * (turn + 1), centroids=centroids))  # fmt: skip
            if turn == 0:
                tracker.adopt(blank(TRACK, 0))
                tracker.adopt(_somewhere())
        tracker.flush()


def _somewhere() -> Table:
    """A confirmed track that nothing will be heard of again."""
    table = np.zeros(1, TRACK)
    table["track"], table["east"], table["north"] = -1, 300.0, 300.0
    for name in ("sd_east", "sd_north", "sd_v_east", "sd_v_north"):
        table[name] = 1.0
    return table


def _parameters(settings: TrackerSettings, radar: Radar, seed: int) -> NDArray[np.void]:
    """The settings as the compiled sweep reads them, in SI."""
    par = np.zeros(1, PARAMETERS)
    density = settings.clutter_per_km2
    models = settings.models or (("cv", "ca", "ct") if settings.filter == "imm" else ("cv",))
    switching = len(models) > 1
    values = {
        "seed": seed,
        "p_d": settings.p_d,
        "p_g": settings.gate_probability,
        "gate": gating.threshold(settings.gate_probability),
        "q": settings.process_noise_m2ps3,
        "clutter": np.nan if density is None else density * 1e-6,
        "max_speed": settings.max_speed_mps,
        "confirm_hits": settings.confirm_hits,
        "confirm_passes": settings.confirm_passes,
        "confirm_score": settings.confirm_score,
        "delete_misses": settings.delete_misses,
        "resample_below": settings.resample_below,
        "outliers": settings.outliers,
        "wait": math.radians(settings.wait_deg),
        "bin": TURN / settings.bins,
        "max_range": radar.max_range,
        "sd_range": radar.sd_range,
        "sd_azimuth": radar.sd_azimuth,
        "up_q": _CLIMB_NOISE,
        "associator": KINDS[settings.associator],
        "rectangle": settings.gate == "rectangle",
        "initiation": _INITIATIONS.index(settings.initiation),
        "identity": settings.identity == "use",
        "max_tracks": settings.max_tracks,
        "log_miss": math.log(max(1.0 - settings.p_d * settings.gate_probability, 1e-300)),
        "turn": radar.rotation,
        "filter": _FILTERS.index(settings.filter),
        "proposal": _PROPOSALS.index(settings.proposal),
        "resampling": _RESAMPLINGS.index(settings.resampling),
        "gaussian": settings.likelihood == "gaussian",
        "use_doppler": settings.doppler == "use",
        "models": len(models),
        "manoeuvre": settings.manoeuvre_mps2,
        "manoeuvre_time": settings.manoeuvre_s,
        "turn_rate": math.radians(settings.turn_rate_dps),
    }
    # The first model is that of undisturbed flight.
    for k, model in enumerate(models):
        par[0]["model"][k] = _MODELS.index(model)
        stay = settings.manoeuvre_s if k else settings.straight_s
        par[0]["leave"][k] = 1.0 / stay if switching else 0.0
    for name, value in values.items():
        par[0][name] = value
    return par


def _empty_world(settings: TrackerSettings, radar: Radar, seed: int) -> World:
    """Room for a few tracks, none of them there."""
    slots, par = 16, _parameters(settings, radar, seed)[0]
    models = par["model"][: par["models"]]
    if settings.filter == "particle":
        count, rows, gaussians = settings.particles, cloud.rows(models), cloud.OPEN
    else:
        n = modes.state_size(models)
        count, rows, gaussians = 0, 0, (modes.count(int(par["filter"]), models), n, n)
    belief = Belief(
        np.zeros(slots, np.int64),
        np.zeros((slots, rows, count), np.float32),
        np.zeros((slots, count), np.float32),
        np.zeros((slots, count), np.uint8),
        np.zeros((slots, *gaussians[:2])),
        np.zeros((slots, *gaussians)),
        np.zeros((slots, gaussians[0])),
        normals(),
    )
    return World(
        par=par,
        clutter=clutter.empty_map()[0],
        tracks=np.zeros(64, STATE),
        books=Books(
            rows=np.zeros(256, TRACK),
            agenda=np.zeros(64, ENTRY),
            pages=np.full(settings.bins, -1),
            alarm=np.full(1, np.inf),
            dead=np.zeros(64, np.int64),
            whereabouts=np.zeros((slots, WHEREABOUTS)),
            blank=np.zeros(settings.bins, np.bool_),
            size=np.zeros(SIZES, np.int64),
            tally=np.zeros(len(SWEPT_COUNTS), np.int64),
        ),
        opened=np.zeros(64, np.int64),
        pool=np.zeros(64, PENDING),
        past=np.zeros(256, PAST),
        edges=np.zeros(256, EDGE),
        ends=np.zeros(256, np.int64),
        mixture=np.zeros(MIXTURE),
        members=np.zeros(64, MEMBER),
        pairs=np.zeros(64, PAIR),
        relative=np.zeros((64, 2, count), np.float32),
        belief=belief,
        need=np.zeros(SIZES, np.int64),
    )


_ROOM = {
    "tracks": N_TRACKS,
    "opened": N_TRACKS,
    "pool": N_POOL,
    "past": N_PAST,
    "edges": N_EDGES,
    "ends": N_EDGES,
    "members": N_MEMBERS,
    "pairs": N_PAIRS,
    "relative": N_PAIRS,
}
_BOOK_ROOM = {
    "rows": N_ROWS,
    "agenda": N_TRACKS,
    "dead": N_TRACKS,
    "whereabouts": N_SLOTS,
}


def _grown(world: World) -> World:
    """The same world with room for the next bin, and for some more."""
    need, belief = world.need, world.belief
    slots = {name: _longer(getattr(belief, name), need[N_SLOTS]) for name in Belief._fields[:-1]}
    tables = {name: _longer(getattr(world, name), need[place]) for name, place in _ROOM.items()}
    books = {name: _longer(getattr(world.books, name), need[place]) for name, place in _BOOK_ROOM.items()}
    return world._replace(belief=belief._replace(**slots), books=world.books._replace(**books), **tables)


def _copied(rows: Any) -> Any:
    """A copy of a table by its bytes: NumPy would go field by field."""
    return rows.view(np.uint8).copy().view(rows.dtype)


def _longer(table: Any, count: int) -> Any:
    """The same rows, and room for at least `count`."""
    if len(table) >= count:
        return table
    result = np.zeros((max(count, 2 * len(table)), *table.shape[1:]), table.dtype)
    result[: len(table)] = table
    return result
