"""ASTERIX recordings."""
