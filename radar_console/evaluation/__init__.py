"""How good tracks and filters are: distances between sets, the story of each target, honest covariances."""
