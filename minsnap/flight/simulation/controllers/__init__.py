"""Controllers of the simulated vehicle."""
