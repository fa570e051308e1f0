"""From plots to centroids."""

from radar_console.plots.stage import Clustering

__all__ = ["Clustering"]
