"""Time allocation: how the durations of the legs are chosen."""
