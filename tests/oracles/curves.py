"""What is seen of a curve from outside, computed from its scipy form alone."""

from math import perm

import numpy as np


def one_sided_limits(traj, order):
    """A derivative on both sides of every inner knot: two arrays (knots, dim)."""
    bpoly = traj.to_bpoly()
    c = bpoly.derivative(order).c if order else bpoly.c
    return c[-1][:-1], c[0][1:]


def local_scale(traj, order):
    """Largest coefficient of a derivative on either side of every inner knot: shape (knots, 1)."""
    bpoly = traj.to_bpoly()
    c = bpoly.derivative(order).c if order else bpoly.c
    largest = np.abs(c).max(axis=(0, 2))
    return np.maximum(largest[:-1], largest[1:])[:, None]


def rounding(traj, order):
    """What rounding of the control points alone may change in a derivative at every inner knot: shape (knots, 1)."""
    factor = 2.0**order * perm(traj.degree, order) * np.finfo(float).eps
    noise = factor * np.abs(traj.control_points).max() / np.diff(traj.breaks) ** order
    return np.maximum(noise[:-1], noise[1:])[:, None]


def jumps(traj, order):
    """Jumps of a derivative at inner knots, in units of its size there, rounding taken off: shape (knots, dim)."""
    left, right = one_sided_limits(traj, order)
    return np.maximum(np.abs(left - right) - 4.0 * rounding(traj, order), 0.0) / local_scale(traj, order)


def offsets(traj, waypoints, samples=400):
    """Perpendicular offsets from each leg's line on a dense grid: (legs, samples, dim)."""
    points = np.asarray(waypoints, float)
    steps = np.diff(points, axis=0)
    unit = steps / np.linalg.norm(steps, axis=1)[:, None]
    breaks = traj.breaks[:: traj.pieces]
    s = np.linspace(0.0, 1.0, samples)
    t = np.minimum(breaks[:-1, None] + np.diff(breaks)[:, None] * s, breaks[1:, None])
    relative = traj(t) - points[:-1, None]
    return relative - (relative * unit[:, None]).sum(axis=2, keepdims=True) * unit[:, None]


def quadrature_cost(traj, order):
    """Integral of the squared norm of a derivative, by Gauss-Legendre on every piece."""
    nodes, weights = np.polynomial.legendre.leggauss(traj.degree + 2)
    s = (nodes + 1.0) / 2.0
    t = traj.breaks[:-1, None] + np.diff(traj.breaks)[:, None] * s
    squares = (traj(t, order) ** 2).sum(axis=2)
    return float((squares @ weights) @ np.diff(traj.breaks) / 2.0)
