"""Motion, filters and densities: pure, batched over leading axes."""
