"""Optimisation for given durations: the problem, its QP, the exchange method and what to do when a solver fails."""
