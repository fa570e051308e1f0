"""One track's particles, driven by hand: the four verbs without the sweep."""

import math

import numpy as np

from radar_console.core.messages import Radar
from radar_console.estimation import motion
from radar_console.scenario import TrackerSettings
from radar_console.tracker import cloud, stage
from radar_console.tracker.records import PENDING, STATE


class Cloud:
    """Tracks with their particles; one call for each verb."""

    def __init__(self, particles=1000, tracks=1, seed=1, **settings):
        chosen = {"outliers": 0.0, "doppler": "ignore"} | settings
        self.settings = TrackerSettings(particles=particles, **chosen)
        radar = Radar("", 4.0, 300e3, 50.0, math.radians(0.1))
        self.par = stage._parameters(self.settings, radar, seed)[0]
        room = stage._empty_world(self.settings, radar, seed).belief
        self.belief = room._replace(
            **{
                name: np.zeros((tracks, *getattr(room, name).shape[1:]), getattr(room, name).dtype)
                for name in room._fields[:-1]
            }
        )
        self.tracks = np.zeros(tracks, STATE)

    def start(self, x, P, i=0, t=0.0):
        """Begin track `i` at the Gaussian (x, P)."""
        track = self.tracks[i]
        track["id"], track["slot"], track["t"], track["passes"] = i, i, t, 1
        track["x"], track["P"] = x, P
        cloud.start(track, 0.0, 0.0, self.par, self.belief)

    def advance(self, t, i=0):
        self.tracks[i]["passes"] += 1
        cloud.advance(self.tracks[i], t, self.par, self.belief)

    def weigh(self, pool, i=0):
        relative = np.empty((len(pool), 2, self.belief.weights.shape[1]), np.float32)
        found = [
            cloud.log_likelihood(self.tracks[i], plot, self.par, self.belief, relative[j])
            for j, plot in enumerate(pool)
        ]
        return np.array([log_g for log_g, _ in found]), np.array([total for _, total in found]), relative

    def update(self, pool, miss, beta, i=0):
        _, total, relative = self.weigh(pool, i)
        cloud.update(
            self.tracks[i], miss, np.asarray(beta, float), total, relative, np.arange(len(pool)), pool,
            self.par, self.belief,
        )  # fmt: skip

    def step(self, t, pool, i=0, miss=0.0, beta=(1.0,)):
        self.advance(t, i)
        self.update(pool, miss, beta, i)


def plots(t, positions, R, doppler=np.nan, sd_doppler=np.nan):
    """A pool of plots at time(s) t, positions (m, 2), covariance R (2, 2), from a radar at (0, 0)."""
    positions = np.atleast_2d(positions)
    pool = np.zeros(len(positions), PENDING)
    pool["t"], pool["e"], pool["n"] = t, positions[:, 0], positions[:, 1]
    pool["ee"], pool["en"], pool["nn"] = R[0, 0], R[0, 1], R[1, 1]
    pool["doppler"], pool["sd_doppler"], pool["weight"] = doppler, sd_doppler, 1.0
    pool["range"] = np.hypot(positions[:, 0], positions[:, 1])
    return pool


def straight_flight(rng, x0, P0, q, R, steps, T=4.0):
    """A target of the filter's own model: truth (steps + 1, 4) and positions measured (steps, 2)."""
    F, Q = motion.constant_velocity(T, q)
    truth = [x0 + np.linalg.cholesky(P0) @ rng.normal(size=4)]
    for _ in range(steps):
        truth.append(F @ truth[-1] + np.linalg.cholesky(Q) @ rng.normal(size=4))
    truth = np.array(truth)
    return truth, truth[1:, :2] + rng.normal(size=(steps, 2)) @ np.linalg.cholesky(R).T
