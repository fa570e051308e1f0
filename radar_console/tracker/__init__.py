"""Tracks from centroids: gate, associate, filter, start and end, served as the beam passes."""

from radar_console.tracker.stage import Counts, Tracker, warm_up

__all__ = ["Counts", "Tracker", "warm_up"]
