"""How the durations of the legs are chosen."""
