"""The tables that the compiled sweep works on."""

import numpy as np

CONFIRMED, TENTATIVE, STARTER = 0, 1, 2
"""Levels of a track: the lower is served first. A starter has one plot, and no velocity yet."""

STATE = np.dtype(
    [
        ("id", "i8"),  # ordinal of its first plot
        ("born", "f8"),  # s, time of its first plot
        ("t", "f8"),  # s, of x and P
        ("x", "f8", (4,)),  # east, north, v_east, v_north
        ("P", "f8", (4, 4)),
        ("anchor", "f8", (4,)),  # what the particles are offsets from, at t
        ("cos", "f8"),  # the particles' first axis is the bearing at confirmation
        ("sin", "f8"),
        ("sd_range", "f8"),  # of its plots: what the next one's are likely to be
        ("sd_azimuth", "f8"),
        ("psi", "f8"),  # unwrapped bearing of the last pass
        ("rho", "f8"),  # beam phase relative to the next pass
        ("half_width", "f8"),  # of the gate, seen from the radar
        ("wake_angle", "f8"),  # until the beam is there, and
        ("wake_time", "f8"),  # before this time, the gate can't be reached
        ("score", "f8"),  # log-likelihood ratio: a target against clutter
        ("level", "i8"),
        ("history", "i8"),  # hits of the last passes, as bits
        ("passes", "i8"),
        ("misses", "i8"),  # in a row
        ("last", "i8"),  # ordinal of the plot of its last hit
        ("previous", "i8"),  # of the hit before; -1 none
        ("slot", "i8"),  # of its particles; -1 none
        ("mode_3a", "i8"),
        ("place", "i8"),  # in the list of open tracks; -1 not open
        ("first", "i8"),  # of its edges in this bin; -1 none
        ("claims", "?"),  # it has plots in its gate
        ("swept", "?"),
        ("served", "?"),  # in this bin
        ("dead", "?"),
    ]
)
"""A track."""

PENDING = np.dtype(
    [
        ("ordinal", "i8"),
        ("phi", "f8"),  # unwrapped azimuth
        ("range", "f8"),  # ground range from the sensor, m
        ("t", "f8"),  # s
        ("e", "f8"),  # position in the site's plane, m
        ("n", "f8"),
        ("ee", "f8"),  # its covariance, m²
        ("en", "f8"),
        ("nn", "f8"),
        ("sd_range", "f8"),
        ("sd_azimuth", "f8"),
        ("mode_3a", "i8"),
        ("extended", "?"),
        ("weight", "f8"),  # 1 less what confirmed tracks have used of it
        ("awaited", "?"),  # an open confirmed track claims it
        ("mark", "i8"),  # scratch: first claimant, or column of a cluster
    ]
)
"""A centroid that waits for its bin, or for the tracks that claim it."""

EDGE = np.dtype([("track", "i8"), ("plot", "i8"), ("density", "f8"), ("next", "i8")])
"""A plot in a track's gate; `density` is the Gaussian likelihood, m⁻²."""

BEAM = np.dtype([("phi", "f8"), ("t", "f8"), ("e", "f8"), ("n", "f8"), ("step", "f8"), ("seen", "?")])
"""A bin's end: beam angle, time, position of the sensor; how long it took, and whether the radar looked."""

PARAMETERS = np.dtype(
    [
        ("seed", "i8"),
        ("p_d", "f8"),
        ("p_g", "f8"),
        ("gate", "f8"),  # γ
        ("q", "f8"),  # m²/s³
        ("clutter", "f8"),  # m⁻²; NaN: estimated
        ("max_speed", "f8"),
        ("confirm_hits", "i8"),
        ("confirm_passes", "i8"),
        ("confirm_score", "f8"),
        ("delete_misses", "i8"),
        ("resample_below", "f8"),
        ("outliers", "f8"),
        ("wait", "f8"),  # rad
        ("bin", "f8"),  # rad
        ("max_range", "f8"),
        ("sd_range", "f8"),
        ("sd_azimuth", "f8"),
    ]
)

# The sweep's own counts, in an int64 array; `stage.Counts` gives them their names.
C_STARTED, C_CONFIRMED, C_DELETED, C_LOST, C_FORCED, C_APPROXIMATE, C_EXTENDED, C_BLANKED, C_MERGED = range(9)
COUNTS = 9

# How much of each table is in use, in an int64 array.
N_TRACKS, N_POOL, N_EDGES, N_SLOTS, N_ROWS, N_QUEUE = range(6)
SIZES = 6
