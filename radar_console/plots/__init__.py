"""From plots to centroids."""
