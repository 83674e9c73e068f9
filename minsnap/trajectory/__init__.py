"""Trajectories: the path every other part takes or gives, its heading, its samples and the report of its plan."""
