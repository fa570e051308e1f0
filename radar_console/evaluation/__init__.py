"""How good tracks and filters are: errors against the truth, and whether claimed errors are the real ones."""
