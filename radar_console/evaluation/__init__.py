"""How good tracks and filters are, and how sure that is: metrics, intervals, many runs and their report."""
