"""What every other part speaks: messages, geometry, units and errors."""
