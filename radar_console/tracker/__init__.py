"""From centroids to tracks."""
