"""What was reported of the tracks lately: a ring of short rows, without Qt."""

import numpy as np

from radar_console.core.messages import Table, TrackStatus

ENTRY = np.dtype(
    [
        ("track", "i8"),
        ("time", "f8"),  # s
        ("hit", "?"),
        ("speed", "f4"),  # m/s
        ("plot_time", "f8"),  # s; NaN without a plot
        ("latency", "f4"),  # s from the plot to the sector that brought the update; NaN without a plot
        ("probability", "f4"),  # of the most probable plot; NaN without one
    ]
)


class Logbook:
    """The last `capacity` passes of all tracks together, from their confirmation on."""

    def __init__(self, capacity: int = 1 << 16) -> None:
        self._entries: Table = np.zeros(capacity, ENTRY)
        self._count = 0

    def take(self, tracks: Table, stop: float) -> None:
        """Note the rows TRACK of the sector that ended at `stop`, s."""
        # Young tracks in clutter are many and short: they would push the others out.
        tracks = tracks[tracks["status"] != TrackStatus.TENTATIVE][-len(self._entries) :]
        rows = np.arange(self._count, self._count + len(tracks)) % len(self._entries)
        for name in ("track", "time", "hit", "plot_time", "probability"):
            self._entries[name][rows] = tracks[name]
        self._entries["speed"][rows] = np.hypot(tracks["v_east"], tracks["v_north"])
        self._entries["latency"][rows] = np.where(tracks["hit"], stop - tracks["plot_time"], np.nan)
        self._count += len(tracks)

    def of(self, track: int) -> Table:
        """The passes of one track that are still known, ENTRY, oldest first."""
        kept = min(self._count, len(self._entries))
        order = np.arange(self._count - kept, self._count) % len(self._entries)
        entries = self._entries[order]
        found: Table = entries[entries["track"] == track]
        return found
