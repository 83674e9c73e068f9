"""Replanning in flight: from a moving start, within a budget of time, with a way to stop."""
