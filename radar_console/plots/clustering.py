"""The stage that turns the plots of a rotating radar into centroids."""

import math
from collections.abc import Iterable, Iterator

from radar_console.core.messages import NO_CENTROIDS, NO_PLOTS, CentroidFlag, Sector
from radar_console.core.units import KM, TURN
from radar_console.plots.centroids import Resolution, measure, pulses_per_turn
from radar_console.plots.clusters import Clusters, StreamingClusters
from radar_console.scenario import PlotSettings, RadarSettings


class Clustering:
    """Adds centroids to sectors of plots; a stage of the pipeline.

    A sector gets the centroids of the clusters that closed in it. Its `complete` is half a pulse before
    the first plot of the oldest cluster that is still open, so no later centroid lies below it. When
    the stream ends, what is still open follows in a last sector without extent. Sectors of a
    source that delivers centroids itself pass untouched.

    A pulse's unwrapped angle is 2π · pulse / pulses_per_turn.

    Attributes
    ----------
    plots : plots received
    late : of these, left out since they came after the beam had left their pulse
    too_small : clusters dropped for want of hits
    centroids : centroids delivered
    extended, split : of these, flagged so
    """

    def __init__(self, settings: PlotSettings, radar_settings: RadarSettings) -> None:
        self._settings = settings
        self._pulses = pulses_per_turn(radar_settings)
        self._resolution = Resolution.of(radar_settings)
        cells = math.ceil(radar_settings.max_range_km * KM / radar_settings.cell_m) + 1
        # Twice the limit: a cluster is cut only where it is flagged anyway, never a strong target.
        longest = max(2 * settings.land_pulses, settings.gap_pulses + 1)
        self._clusters = StreamingClusters(cells, settings.gap_pulses, longest, settings.min_hits)
        self.plots = self.centroids = self.extended = self.split = 0

    @property
    def late(self) -> int:
        return self._clusters.late

    @property
    def too_small(self) -> int:
        return self._clusters.too_small

    def __call__(self, sectors: Iterable[Sector]) -> Iterator[Sector]:
        last: Sector | None = None
        for sector in sectors:
            if len(sector.centroids) or not (len(sector.plots) or last):
                yield sector
                continue
            last = self._clustered(sector)
            yield last
        if last is not None and last.complete < last.end:
            yield self._ended(last)

    def _clustered(self, sector: Sector) -> Sector:
        self.plots += len(sector.plots)
        # Rounded down: a pulse on the border may belong to either sector.
        closed = self._clusters.push(sector.plots, math.floor(sector.end / TURN * self._pulses))
        complete = (self._clusters.oldest - 0.5) / self._pulses * TURN
        return self._with_centroids(sector, closed, complete)

    def _ended(self, last: Sector) -> Sector:
        nothing = last.adding(start=last.stop, begin=last.end, plots=NO_PLOTS, centroids=NO_CENTROIDS)
        return self._with_centroids(nothing, self._clusters.flush(), last.end)

    def _with_centroids(self, sector: Sector, closed: Clusters, complete: float) -> Sector:
        if not len(closed):
            return sector.adding(complete=complete)
        centroids = measure(closed, self._settings, self._resolution)
        self.centroids += len(centroids)
        self.extended += int(((centroids["flags"] & CentroidFlag.EXTENDED) > 0).sum())
        self.split += int(((centroids["flags"] & CentroidFlag.SPLIT) > 0).sum())
        return sector.adding(complete=complete, centroids=centroids)
