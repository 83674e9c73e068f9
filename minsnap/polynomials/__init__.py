"""Polynomials on the unit interval: the Bernstein basis, exact extrema, quotients and ranges."""
