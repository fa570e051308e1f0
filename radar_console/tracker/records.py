"""The tables that the compiled sweep works on."""

from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray


def variable(value: int) -> int:
    """A number for calls between kernels: numba compiles them anew for each literal they are given."""
    return cast(int, np.int64(value))


NIL = variable(0)
NO, YES = cast(bool, np.bool_(False)), cast(bool, np.bool_(True))

CONFIRMED, TENTATIVE, STARTER = 0, 1, 2
"""Levels of a track: the lower is served first. A starter has one plot, and no velocity yet."""

STATE = np.dtype(
    [
        ("t", "f8"),  # s, of x and P
        ("x", "f8", (4,)),  # east, north, v_east, v_north
        ("P", "f8", (4, 4)),
        ("curve", "f8", (2,)),  # m/s², acceleration of the forecast; see `gating.predicted`
        ("growth", "f8", (3,)),  # m²/s³, ee, en, nn: the forecast's covariance grows by this times T³
        ("sd_range", "f8"),  # of its plots: what the next one's are likely to be
        ("sd_azimuth", "f8"),
        ("psi", "f8"),  # unwrapped bearing of the last pass
        ("u_e", "f8"),  # the unit vector that way
        ("u_n", "f8"),
        ("rho", "f8"),  # beam phase relative to the next pass
        ("half_width", "f8"),  # of the gate, seen from the radar
        ("range", "f8"),  # m, of its middle from the sensor
        ("along", "f8"),  # m, half the extent of the gate in range
        ("s_e", "f8"),  # position of the sensor from which a starter was sighted
        ("s_n", "f8"),
        ("turned", "f8"),  # of a starter, seen from there: angle from the bearing of the last pass,
        ("spread", "f8"),  # m, and what its gate reaches at once
        ("level", "i8"),
        ("dense", "?"),  # it was born in dense clutter
        ("claims", "?"),  # it has plots in its gate
        ("crowded", "?"),  # set JPDA: another confirmed track claims one of its plots, too
        ("swept", "?"),
        ("served", "?"),  # in this bin
        ("dead", "?"),
        ("voiced", "?"),  # of the branches of one first plot one is reported
        ("proven", "?"),  # to be confirmed when all who claim its last plot are served
        ("place", "i8"),  # in the list of open tracks
        ("first", "i8"),  # of its edges in this bin; -1 none
        ("score", "f8"),  # log-likelihood ratio: a target against clutter
        ("last", "i8"),  # ordinal of the plot of its last hit
        ("previous", "i8"),  # of the hit before; -1 none
        ("misses", "i8"),  # in a row
        ("hits", "i8"),
        ("id", "i8"),  # ordinal of its first plot
        ("born", "f8"),  # s, time of its first plot
        ("root", "i8"),  # ordinal of its first plot: branches have it in common; -1 of one from elsewhere
        ("up", "f8", (2,)),  # m and m/s, height and its rate at `up_t`; NaN unknown
        ("up_P", "f8", (3,)),  # their covariance pp, pv, vv
        ("up_t", "f8"),  # s, of the height
        ("anchor", "f8", (4,)),  # what the particles are offsets from, at t
        ("cos", "f8"),  # the particles' first axis is the bearing at confirmation
        ("sin", "f8"),
        ("peak", "f8"),  # the highest score so far; of a confirmed track the score as if it had no limit
        ("history", "i8"),  # hits of the last passes, as bits
        ("passes", "i8"),
        ("slot", "i8"),  # of its particles; -1 none
        ("mode_3a", "i8"),
        ("address", "i8"),
        ("agreed", "i8"),  # hits in a row whose identity was the track's own
        ("near", "f8"),  # false centroids that it met around its plots,
        ("exposure", "f8"),  # and m² and turns where they were counted
        ("probability", "f8"),  # of that plot
    ],
    align=True,
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
        ("s_e", "f8"),  # position of the sensor, m
        ("s_n", "f8"),
        ("sd_range", "f8"),
        ("sd_azimuth", "f8"),
        ("up", "f8"),  # height, m; NaN unknown
        ("uu", "f8"),  # its variance, m²
        ("doppler", "f8"),  # range rate, m/s; NaN unknown
        ("sd_doppler", "f8"),
        ("mode_3a", "i8"),
        ("address", "i8"),
        ("extended", "?"),
        ("weight", "f8"),  # 1 less what confirmed tracks have used of it
        ("awaited", "?"),  # an open confirmed track claims it
        ("mark", "i8"),  # scratch: first claimant, or column of a cluster
        ("head", "i8"),  # scratch: first of its edges
        ("near", "f8"),  # centroids around it that the beam met just before,
        ("exposure", "f8"),  # and m² where they were counted
        ("base", "f8"),  # m⁻², density of false centroids at such places
    ],
    align=True,
)
"""A centroid that waits for its bin, or for the tracks that claim it."""

PAST = np.dtype([("phi", "f8"), ("e", "f8"), ("n", "f8")])
"""A centroid of the last half turn."""

EDGE = np.dtype(
    [
        ("track", "i8"),
        ("plot", "i8"),
        ("density", "f8"),  # Gaussian likelihood, m⁻²
        ("spent", "?"),  # its track was served
        ("next", "i8"),  # scratch: of the same track, or of the same plot
    ],
    align=True,
)
"""A plot in a track's gate; it stays until all who claim the plot are served."""

ENTRY = np.dtype(
    [
        ("bin", "i8"),  # of the turn, in whose list it is; -1 in none
        ("before", "i8"),  # its neighbours there; -1 none
        ("after", "i8"),
        ("time", "f8"),  # s, when it is due even if the beam is not there
    ]
)
"""A track in the calendar, see `agenda`."""

MEMBER = np.dtype(
    [
        ("track", "i8"),
        ("cluster", "i8"),
        ("pairs", "i8"),  # the first of its pairs
        ("kept", "i8"),  # how many of them the association kept; they stand first
        ("used", "f8"),  # Σ β
        ("rough", "?"),  # associated approximately
    ],
    align=True,
)
"""A confirmed track whose cluster is associated in this bin."""

PAIR = np.dtype(
    [
        ("plot", "i8"),
        ("w", "f8"),  # likelihood, m⁻²
        ("total", "f8"),  # what `filters.log_likelihood` gave with it
        ("beta", "f8"),
    ]
)
"""A member and a plot in its gate."""

BEAM = np.dtype(
    [("phi", "f8"), ("t", "f8"), ("e", "f8"), ("n", "f8"), ("step", "f8"), ("seen", "?")], align=True
)
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
        ("up_q", "f8"),  # m²/s³, of the height's rate
        ("associator", "i8"),
        ("rectangle", "?"),  # the gate is one, else an ellipse
        ("initiation", "i8"),  # AUTO, ...
        ("identity", "?"),  # codes and addresses are evidence
        ("max_tracks", "i8"),
        ("log_miss", "f8"),  # log-likelihood ratio of a pass without a plot
        ("turn", "f8"),  # s, nominal time of a turn of the antenna
        ("filter", "i8"),  # KALMAN, EXTENDED, ...
        ("proposal", "i8"),  # PRIOR, OPTIMAL, ADAPTED
        ("resampling", "i8"),  # SYSTEMATIC, ...
        ("gaussian", "?"),  # associate by N(z; ẑ, S), not by the filter's own likelihood
        ("use_doppler", "?"),
        ("models", "i8"),  # how many motion models
        ("model", "i8", (4,)),  # CV, CA, CT, SINGER
        ("leave", "f8", (4,)),  # 1/s, rate at which a target leaves the model; 0 where there is only one
        ("manoeuvre", "f8"),  # m/s², rms acceleration of a manoeuvre
        ("manoeuvre_time", "f8"),  # s, mean duration of a manoeuvre; Singer's time constant
        ("turn_rate", "f8"),  # rad/s, rms rate of a turn
    ]
)

KALMAN, EXTENDED, UNSCENTED, IMM, PARTICLE = range(5)
PRIOR, OPTIMAL, ADAPTED = range(3)
SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL = range(4)
CV, CA, CT, SINGER = range(4)
AUTO, M_OF_N, SCORE, BRANCHING = range(4)


class Belief(NamedTuple):
    """What confirmed tracks believe beyond their moments; a row, the track's `slot`, for each.

    The axes of what the filter in use does not need have length 0.
    """

    owner: NDArray[np.int64]  # (slots,) row of the track
    particles: NDArray[np.float32]  # (slots, rows, N) offsets from the track's anchor, in its axes
    weights: NDArray[np.float32]  # (slots, N)
    model: NDArray[np.uint8]  # (slots, N) place of the particle's motion model in `par.model`
    x: NDArray[np.float64]  # (slots, modes, n) Gaussian modes: e, n, v_e, v_n, then the model's own
    P: NDArray[np.float64]  # (slots, modes, n, n)
    mu: NDArray[np.float64]  # (slots, modes) probabilities
    table: NDArray[np.float32]  # of normals, see `particle.normals`


# The sweep's own counts, in an int64 array; `stage.Counts` gives them their names.
SWEPT_COUNTS = (
    "started",
    "confirmed",
    "deleted",
    "lost",
    "forced",
    "approximate",
    "extended",
    "blanked",
    "merged",
    "capped",
)
(
    C_STARTED,
    C_CONFIRMED,
    C_DELETED,
    C_LOST,
    C_FORCED,
    C_APPROXIMATE,
    C_EXTENDED,
    C_BLANKED,
    C_MERGED,
    C_CAPPED,
) = range(len(SWEPT_COUNTS))

# How much of each table is in use, in an int64 array.
(
    N_TRACKS,
    N_POOL,
    N_EDGES,
    N_SLOTS,
    N_ROWS,
    N_QUEUE,
    N_OPEN,
    N_MEMBERS,
    N_PAIRS,
    N_DEAD,
    N_PHASE,
    N_PAST,
    N_NEXT_BIN,  # its unwrapped number
) = range(13)
SIZES = 13


# Columns of a confirmed track's whereabouts: its first plot; time, position and velocity; a quadratic
# of the time since then that bounds its deviation; and half its acceleration.
B_ROOT, B_T, B_E, B_N, B_V_E, B_V_N, B_REACH, B_REACH_T, B_REACH_TT, B_CURVE = range(10)
WHEREABOUTS = 10


class Books(NamedTuple):
    """What the accounting of a pass writes; handed on by itself, since it is small."""

    rows: Any  # TRACK table
    agenda: Any  # ENTRY table (tracks,)
    pages: NDArray[np.int64]  # (bins,) first track of each bin's list; -1 none
    alarm: NDArray[np.float64]  # (1,) s, time at which a track that rests may be due
    dead: NDArray[np.int64]  # (tracks,) the rows to be buried at the bin's end
    whereabouts: NDArray[np.float64]  # (slots, WHEREABOUTS) of confirmed tracks, see `management.note`
    blank: NDArray[np.bool_]  # (bins,) the radar did not look
    size: NDArray[np.int64]  # (SIZES,)
    tally: NDArray[np.int64]  # (counts,)


class World(NamedTuple):
    """Everything that the compiled sweep works on."""

    par: Any  # PARAMETERS record
    clutter: Any  # `clutter.MAP` record
    tracks: Any  # STATE table
    books: Books
    opened: NDArray[np.int64]  # (tracks,) the rows whose gates the beam has reached
    pool: Any  # PENDING table
    past: Any  # PAST table
    edges: Any  # EDGE table
    ends: NDArray[np.int64]  # (edges,) scratch: the tracks that end on one plot
    mixture: NDArray[np.float64]  # scratch: `kalman.MIXTURE`
    members: Any  # MEMBER table
    pairs: Any  # PAIR table
    relative: NDArray[np.float32]  # (pairs, 2, N) what `filters.log_likelihood` gave
    belief: Belief
    need: NDArray[np.int64]  # (SIZES,) of the bin that did not fit
