"""Clusters: tracks that share plots, and each cluster as a small problem of its own.

Up to a million pairs lie in memory as they come; what is done to a cluster then waits for memory more than it
computes. So its pairs are copied once, with tracks and plots numbered from 0, and all work is on the copy.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association import pairs
from radar_console.tracker.association.pairs import Ints, Side
from radar_console.tracker.kernels import inlined

Claims = NDArray[np.uint8]
Places = NDArray[np.int32]

_find = pairs.find
_MANY = 255  # claims are not counted further
FAR = 16384  # plots or tracks, beyond which memory is waited for
AHEAD = 64  # tracks


class Cluster(NamedTuple):
    """Room for one cluster: made once for all of a call, and never cleared.

    Attributes
    ----------
    tracks, plots : its shared pairs by track and by plot, both numbered from 0
    place : (pairs,) of each pair by plot, its place by track
    free : (tracks,) weight of the miss and the track's own plots together
    """

    tracks: Side
    plots: Side
    place: Ints
    free: Array


@njit(cache=True, nogil=True)
def count_claims(col: Ints, columns: int) -> tuple[Claims, int]:
    """(columns,) the pairs of each plot, at most 255; and the pairs of plots that have several."""
    claims, shared = np.zeros(columns, np.uint8), 0
    for k in range(col.size):
        c = np.uint64(col[k])  # else numba looks whether it counts from the end
        n = claims[c]
        claims[c] = n + (n < _MANY)
        shared += (n > 0) + (n == 1)
    return claims, shared


@njit(cache=True, nogil=True, error_model="numpy")
def components(by_track: Side, claims: Claims) -> tuple[Ints, Ints, Places]:
    """Tracks that share plots, one component after the other, and where each begins.

    Also returns the first track of each shared plot (columns,).
    """
    tracks = by_track.start.size - 1
    parent, claimant = np.empty(tracks, np.int32), np.full(claims.size, -1, np.int32)
    for t in range(tracks):
        root, some = t, False
        parent[t] = t
        for k in range(by_track.start[t], by_track.start[t + 1]):
            c = by_track.other[k]
            if claims[c] == 1:
                continue
            some = True
            if claimant[c] < 0:
                claimant[c] = t
                continue
            other = parent[claimant[c]]
            if other != root:
                other = _find(parent, other)
                parent[max(root, other)] = min(root, other)
                root = min(root, other)
        if not some:
            parent[t] = -1
    size = np.zeros(tracks, np.int32)
    for t in range(tracks):
        if parent[t] >= 0:
            # A root is the lowest of its tracks: that parent has its root already.
            parent[t] = parent[parent[t]]
            size[parent[t]] += 1
    begin, count, total = np.empty(tracks + 1, np.int64), 0, 0
    for t in range(tracks):
        if size[t] > 0:
            begin[count] = total
            count += 1
            total, size[t] = total + size[t], total
    begin[count] = total
    members = np.empty(total, np.int64)
    for t in range(tracks):
        if parent[t] >= 0:
            members[size[parent[t]]] = t
            size[parent[t]] += 1
    return members, begin[: count + 1], claimant


@njit(cache=True, nogil=True)
def room(members: int, pairs: int) -> Cluster:
    """For a cluster of up to so many tracks, plots and pairs."""
    n = members + 1
    whole, real = np.empty(3 * pairs + 2 * n, np.int64), np.empty(2 * pairs + n)
    starts = whole[3 * pairs :]
    return Cluster(
        Side(starts[:n], whole[:pairs], real[:pairs]),
        Side(starts[n:], whole[pairs : 2 * pairs], real[pairs : 2 * pairs]),
        whole[2 * pairs : 3 * pairs],
        real[2 * pairs :],
    )


@inlined
def touch(members: Ints, begin: int, every: Side, claims: Claims, number: Places) -> float:
    """Read what `gather` will for the next `AHEAD` members: with few branches, it is waited for together."""
    end, total = min(begin + AHEAD, members.size), 0.0
    for m in range(begin, end):
        total += every.start[members[m]]
    for m in range(begin, end):
        for k in range(every.start[members[m]], every.start[members[m] + 1]):
            total += every.ratio[k] + (claims[every.other[k]] + number[every.other[k]])
    return total


@inlined
def gather(group: Ints, every: Side, claims: Claims, number: Places, cluster: Cluster) -> int:
    """Fill `cluster` with the tracks of `group`, plots of one track folded into its miss; how many plots.

    Parameters
    ----------
    number : (columns,) below 0 of the plots that have their number in a cluster, as ~number
    """
    start, other, ratio = cluster.tracks
    start[0] = plots = n = 0
    for i in range(group.size):
        free = 1.0
        for k in range(every.start[group[i]], every.start[group[i] + 1]):
            c = every.other[k]
            if claims[c] == 1:
                free += every.ratio[k]
                continue
            if number[c] >= 0:
                number[c] = ~plots
                plots += 1
            other[n], ratio[n] = ~number[c], every.ratio[k]
            n += 1
        for k in range(start[i], n):
            ratio[k] /= free
        cluster.free[i], start[i + 1] = free, n
    arrange(group.size, cluster.tracks, plots, cluster.plots, cluster.place)
    return plots


@inlined
def arrange(tracks: int, by_track: Side, columns: int, by_plot: Side, place: Ints) -> None:
    """Fill `by_plot` with the same pairs by plot, and the place of each by track."""
    start, pairs = by_plot.start, by_track.start[tracks]
    for c in range(columns + 1):
        start[c] = 0
    # Each plot's place to fill stands one further than its start: in the end it is the next one's start.
    for k in range(pairs):
        c = by_track.other[k] + 2
        if c <= columns:
            start[c] += 1
    for c in range(2, columns + 1):
        start[c] += start[c - 1]
    for t in range(tracks):
        for k in range(by_track.start[t], by_track.start[t + 1]):
            c = by_track.other[k] + 1
            n = start[c]
            start[c] += 1
            by_plot.other[n], by_plot.ratio[n], place[n] = t, by_track.ratio[k], k


@njit(cache=True, nogil=True, error_model="numpy")
def arranged(by_track: Side, columns: int) -> Side:
    """The same pairs by plot."""
    pairs = by_track.other.size
    by_plot = Side(np.empty(columns + 1, np.int64), np.empty(pairs, np.int64), np.empty(pairs))
    arrange(by_track.start.size - 1, by_track, columns, by_plot, np.empty(pairs, np.int64))
    return by_plot
