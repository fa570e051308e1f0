"""A radar tracking console: from antenna to screen."""
