"""A rotating radar and its targets: truth in, raw returns or centroids out."""
