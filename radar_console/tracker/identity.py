"""Mode 3/A codes and Mode S addresses as evidence.

A report that carries a track's own identity is that target's far more likely than its position
alone says, and one with another identity far less; but codes are garbled, and change, so neither is
ever certain, and a track whose only plot has a foreign code still takes it.
"""

from typing import Any

from radar_console.tracker.kernels import bare

# Likelihood ratios: the report is of this target, against any other's.
SAME_ADDRESS, OTHER_ADDRESS = 1e3, 1e-3
SAME_CODE, OTHER_CODE = 50.0, 0.02
_SURE = 5  # agreements beyond which a track's identity gains no more weight


@bare
def factor(track: Any, plot: Any) -> float:
    """How much likelier the plot's identity makes it the track's; 1 where one is unknown."""
    if track.address >= 0 and plot.address >= 0:
        return SAME_ADDRESS if track.address == plot.address else OTHER_ADDRESS
    if track.mode_3a >= 0 and plot.mode_3a >= 0:
        return SAME_CODE if track.mode_3a == plot.mode_3a else OTHER_CODE
    return 1.0


@bare
def learn(track: Any, plot: Any) -> None:
    """Take over the identity of a hit: a majority of recent codes, so that a garbled one passes by."""
    if plot.address >= 0:
        track.address = plot.address
    if plot.mode_3a < 0:
        return
    if track.mode_3a == plot.mode_3a:
        track.agreed = min(track.agreed + 1, _SURE)
    elif track.agreed > 1 and track.mode_3a >= 0:
        track.agreed -= 1
    else:
        track.mode_3a, track.agreed = plot.mode_3a, 1
