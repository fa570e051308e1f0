"""Clusters of plots, as they come: connected components of a stream.

Two plots are neighbours when their range cells are the same or next to each other and their pulses
are at most a gap apart; a cluster is a connected component. For each range cell only the newest
plot matters: an older one within the gap of a new plot is also within the gap of the newest, so it
is joined already. Open clusters go on into the next sector, and the number of the pulse never
wraps, so neither the borders of sectors nor north leave a mark.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.core.messages import NO_PLOTS, Table

_NEVER = -(2**62)


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """Plots, those of one cluster side by side, each cluster in the order of pulse and cell.

    Attributes
    ----------
    plots : (n,) PLOT
    bounds : (clusters + 1,) cluster k has the plots bounds[k] to bounds[k + 1]
    cut : (clusters,) the cluster is a part of one that was longer than allowed
    """

    plots: Table
    bounds: NDArray[np.int64]
    cut: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.cut)


class StreamingClusters:
    """Joins plots to clusters, sector by sector.

    Parameters
    ----------
    cells : number of range cells; a plot beyond them makes it grow
    gap : largest step in pulses between neighbours
    longest : pulses; a plot does not join a cluster that began so many pulses before it. The
        cluster goes on in a new part, and both are marked as cut, so land can't stay open for long
    min_hits : smaller clusters are dropped when they close, and counted

    Attributes
    ----------
    swept : every plot of an earlier pulse has been seen
    too_small : clusters dropped for want of plots
    late : plots left out since they came after their pulse was swept
    """

    def __init__(self, cells: int, gap: int, longest: int, min_hits: int = 1) -> None:
        if longest <= gap:
            raise ValueError(f"longest is {longest} pulses, expected more than the gap of {gap}")
        self.gap, self.longest, self.min_hits = gap, longest, min_hits
        self.swept = self.too_small = self.late = 0
        # One cell more on either side, so that every cell has two neighbours.
        self._newest_pulse = np.full(cells + 2, _NEVER)
        self._newest_plot = np.zeros(cells + 2, np.int64)
        self._open = NO_PLOTS  # plots of open clusters, in the order of pulse and cell
        self._root = np.zeros(0, np.int64)  # the first plot of each one's cluster
        self._cut = np.zeros(0, np.bool_)  # of the cluster, kept at its root

    @property
    def oldest(self) -> int:
        """The pulse at which the oldest open cluster began, or the next one if none is open.

        No plot of a cluster that closes later belongs to an earlier pulse.
        """
        return min(self.swept, int(self._open["pulse"][0])) if len(self._open) else self.swept

    def push(self, plots: Table, swept: int) -> Clusters:
        """Add plots; return the clusters that can grow no more, in the order of their first plot.

        Parameters
        ----------
        plots : (n,) PLOT
        swept : all plots of pulses before this one have now been given

        Raises
        ------
        ValueError  a range cell is negative
        """
        plots = self._in_order(plots)
        begin = len(self._open)
        pool: Table = np.concatenate((self._open, plots))
        pulse, cell = pool["pulse"].copy(), pool["cell"].copy()
        root = np.concatenate((self._root, np.arange(begin, len(pool))))
        cut = np.concatenate((self._cut, np.zeros(len(plots), np.bool_)))
        _join(pulse, cell, begin, root, cut, self._newest_pulse, self._newest_plot, self.gap, self.longest)
        self.swept = max(self.swept, swept)
        closed, hits = _closed(pulse, root, self.swept - self.gap)
        self._keep(pool, root, cut, ~closed)
        large = hits >= self.min_hits
        self.too_small += int(np.count_nonzero(closed & ~large & (root == np.arange(len(root)))))
        return _grouped(pool, root, cut, closed & large)

    def flush(self) -> Clusters:
        """The clusters that are still open: the stream has ended."""
        return self.push(NO_PLOTS, int(self._open["pulse"][-1]) + self.gap + 1 if len(self._open) else 0)

    def _in_order(self, plots: Table) -> Table:
        """The plots by pulse and cell, without those that are late."""
        if not len(plots):
            return NO_PLOTS
        if plots["cell"].min() < 0:
            raise ValueError(f"range cell {plots['cell'].min()}, expected a number from 0")
        missing = int(plots["cell"].max()) + 3 - len(self._newest_pulse)
        if missing > 0:
            self._newest_pulse = np.pad(self._newest_pulse, (0, missing), constant_values=_NEVER)
            self._newest_plot = np.pad(self._newest_plot, (0, missing))
        late = plots["pulse"] < self.swept
        if late.any():
            self.late += int(late.sum())
            plots = plots[~late]
        order = np.lexsort((plots["cell"], plots["pulse"]))
        return plots if (order[1:] > order[:-1]).all() else plots[order]

    def _keep(
        self, pool: Table, root: NDArray[np.int64], cut: NDArray[np.bool_], kept: NDArray[np.bool_]
    ) -> None:
        """Carry the plots of the open clusters over; they are numbered anew."""
        number = np.cumsum(kept) - 1
        self._open, self._root, self._cut = pool[kept], number[root[kept]], cut[kept]
        self._newest_plot[self._open["cell"] + 1] = np.arange(len(self._open))


@njit(cache=True, nogil=True)
def _root_of(root: NDArray[np.int64], plot: int) -> int:
    while root[plot] != plot:
        root[plot] = root[root[plot]]
        plot = root[plot]
    return plot


@njit(cache=True, nogil=True)
def _join(
    pulse: NDArray[np.int64],
    cell: NDArray[np.int32],
    begin: int,
    root: NDArray[np.int64],
    cut: NDArray[np.bool_],
    newest_pulse: NDArray[np.int64],
    newest_plot: NDArray[np.int64],
    gap: int,
    longest: int,
) -> None:
    """Join the plots from `begin` on to their neighbours before them; then root[i] is i's root.

    A root is the first plot of its cluster, so its pulse is the one at which the cluster began.
    """
    for plot in range(begin, pulse.size):
        now, middle = pulse[plot], cell[plot] + 1
        for near in range(middle - 1, middle + 2):
            if now - newest_pulse[near] > gap:
                continue
            this, other = _root_of(root, plot), _root_of(root, newest_plot[near])
            if this == other:
                continue
            first, second = min(this, other), max(this, other)
            if now - pulse[first] >= longest:
                cut[first] = cut[second] = True
                continue
            root[second] = first
            cut[first] |= cut[second]
        newest_pulse[middle], newest_plot[middle] = now, plot
    for plot in range(pulse.size):
        root[plot] = _root_of(root, plot)


@njit(cache=True, nogil=True)
def _closed(
    pulse: NDArray[np.int64], root: NDArray[np.int64], before: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Of each plot's cluster: its newest plot is from a pulse before `before`; its number of plots."""
    last, hits = np.zeros_like(pulse), np.zeros_like(pulse)
    for plot in range(pulse.size):  # in the order of pulses, so the newest comes last
        last[root[plot]] = pulse[plot]
        hits[root[plot]] += 1
    return last[root] < before, hits[root]


def _grouped(
    pool: Table, root: NDArray[np.int64], cut: NDArray[np.bool_], chosen: NDArray[np.bool_]
) -> Clusters:
    """Bring the chosen plots of each cluster together."""
    index = np.flatnonzero(chosen)
    index = index[np.argsort(root[index], kind="stable")]
    roots, starts = np.unique(root[index], return_index=True)
    return Clusters(pool[index], np.append(starts, len(index)), cut[roots])
