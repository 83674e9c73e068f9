"""Polynomials on the unit interval: the Bernstein basis, exact extrema, ranges and quadrature."""
