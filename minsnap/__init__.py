"""Minimum-snap trajectories, certified inside their corridor at every instant."""
