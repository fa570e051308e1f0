"""One confirmed track of a Gaussian filter by itself, its plots, and what a matched world does."""

import math

import numpy as np

from radar_console.core.messages import Radar
from radar_console.estimation import particle
from radar_console.estimation.measurement import convert
from radar_console.scenario import TrackerSettings
from radar_console.tracker import bank, modes, stage
from radar_console.tracker.records import PENDING, STATE, Belief

RADAR = Radar("test", rotation=4.0, max_range=300e3, sd_range=50.0, sd_azimuth=math.radians(0.1))

NORMALS = particle.normals()

FILTERS = {
    "kalman": {"filter": "kalman"},
    "extended": {"filter": "extended"},
    "unscented": {"filter": "unscented"},
    "kalman ca": {"filter": "kalman", "models": ("ca",)},
    "kalman singer": {"filter": "kalman", "models": ("singer",)},
    "kalman ct": {"filter": "kalman", "models": ("ct",)},
    "extended ct": {"filter": "extended", "models": ("ct",)},
    "unscented ct": {"filter": "unscented", "models": ("ct",)},
    "imm cv ct": {"filter": "imm", "models": ("cv", "ct")},
    "imm cv ca": {"filter": "imm", "models": ("cv", "ca")},
    "imm ca singer": {"filter": "imm", "models": ("ca", "singer")},
    "imm all": {"filter": "imm", "models": ("cv", "ca", "ct", "singer")},
}


def empty_belief(par, slots=1):
    """Room for `slots` tracks of the filter in `par`."""
    models = [int(model) for model in par["model"][: par["models"]]]
    r, n = modes.count(int(par["filter"]), models), modes.state_size(models)
    return Belief(
        np.zeros(slots, np.int64),
        np.zeros((slots, 4, 0), np.float32),
        np.zeros((slots, 0), np.float32),
        np.zeros((slots, 0), np.uint8),
        np.zeros((slots, r, n)),
        np.zeros((slots, r, n, n)),
        np.zeros((slots, r)),
        NORMALS,
    )


class Solo:
    """A track and its filter; settings as in the scenario."""

    def __init__(self, **settings):
        self.par = stage._parameters(TrackerSettings(**settings), RADAR, 0)[0]
        self.belief = empty_belief(self.par)
        self.track = np.zeros(1, STATE)[0]

    @property
    def x(self):
        return self.belief.x[0]

    @property
    def P(self):
        return self.belief.P[0]

    @property
    def mu(self):
        return self.belief.mu[0]

    def start(self, x, P, t=0.0):
        self.track["x"], self.track["P"], self.track["t"] = x, P, t
        bank.start(self.track, 0.0, 0.0, self.par, self.belief)
        return self

    def advance(self, t):
        bank.advance(self.track, t, self.par, self.belief)
        return self

    def log_likelihood(self, plot):
        return bank.log_likelihood(self.track, plot, self.par, self.belief, np.zeros(0, np.float32))[0]

    def update(self, plots, beta=(1.0,), miss=0.0):
        beta, chosen = np.asarray(beta, float), np.arange(len(plots))
        nothing = np.zeros((len(plots), 0), np.float32)
        bank.update(
            self.track, miss, beta, np.ones(len(plots)), nothing, chosen, plots, self.par, self.belief
        )
        return self


def plots(count=1):
    table = np.zeros(count, PENDING)
    table["doppler"] = table["sd_doppler"] = np.nan
    return table


def polar(t, distance, azimuth, sensor=(0.0, 0.0), doppler=np.nan, sd_doppler=np.nan):
    """A plot (1,) from range and azimuth, with the radar's noise."""
    table = plots()
    plot = table[0]
    e, n, plot["ee"], plot["en"], plot["nn"] = convert(distance, azimuth, RADAR.sd_range, RADAR.sd_azimuth)
    plot["e"], plot["n"] = e + sensor[0], n + sensor[1]
    plot["s_e"], plot["s_n"] = sensor
    plot["t"], plot["range"], plot["phi"] = t, distance, azimuth
    plot["sd_range"], plot["sd_azimuth"] = RADAR.sd_range, RADAR.sd_azimuth
    plot["doppler"], plot["sd_doppler"] = doppler, sd_doppler
    return table


def seen(rng, t, x, doppler=False, sd_doppler=1.0):
    """What the radar at the origin measures of the state `x` (4 or more,)."""
    r, a = math.hypot(x[0], x[1]), math.atan2(x[0], x[1])
    rate = (x[0] * x[2] + x[1] * x[3]) / r + sd_doppler * rng.normal() if doppler else np.nan
    return polar(
        t, r + RADAR.sd_range * rng.normal(), a + RADAR.sd_azimuth * rng.normal(), doppler=rate,
        sd_doppler=sd_doppler if doppler else np.nan,
    )  # fmt: skip


def motion(model, par, x, T):
    """The mean (n,) and the noise (n, n) of `x` (n,) after T s by the compiled model."""
    mean, Q = np.array(x, float), np.zeros((len(x), len(x)))
    modes.predict(model, mean, Q, T, par)
    return mean, Q


def positive(P):
    """Semidefinite to rounding: no eigenvalue of the correlations is below -1e-9."""
    sd = np.sqrt(np.maximum(np.diag(P), 0.0))
    sd[sd == 0.0] = 1.0
    return np.allclose(P, P.T) and np.linalg.eigvalsh(P / np.outer(sd, sd)).min() > -1e-9
