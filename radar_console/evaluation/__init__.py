"""How good tracks are: distances between sets, and the story of each target and track over a run."""
