"""What holds of a planned fleet over all time, by Bernstein polynomials in long double: no code of the library.

A polynomial is above a floor where its Bernstein coefficients are, and below where an end of a part is; parts are
halved until one or the other is seen. Only control points, durations and the numbers that were asked are read.
"""

from math import comb

import numpy as np

NEAR = 1e-9
"""Share, or metres, by which what was asked may be missed."""


def halves(rows):
    """Return the coefficients of both halves, by de Casteljau's scheme, (2 count, n + 1)."""
    left, right, row = [rows[:, 0]], [rows[:, -1]], rows
    while row.shape[1] > 1:
        row = (row[:, 1:] + row[:, :-1]) / 2
        left.append(row[:, 0])
        right.append(row[:, -1])
    return np.concatenate((np.stack(left, axis=1), np.stack(right[::-1], axis=1)))


def above(rows, floor):
    """Whether polynomials (count, n + 1) are nowhere below a floor on [0, 1]."""
    for _ in range(60):
        rows = rows[rows.min(axis=1) < floor]
        if not len(rows):
            return True
        if (rows[:, [0, -1]] < floor).any():
            return False
        rows = halves(rows)
    return False


def square(rows):
    """Return the coefficients of the squares of polynomials (count, n + 1)."""
    n = rows.shape[1] - 1
    result = np.zeros((len(rows), 2 * n + 1), dtype=np.longdouble)
    for i in range(n + 1):
        for k in range(n + 1):
            result[:, i + k] += rows[:, i] * rows[:, k] * np.longdouble(comb(n, i) * comb(n, k)) / comb(2 * n, i + k)
    return result


def norm_square(points):
    """Return the squared norms of curves (count, n + 1, dims)."""
    return sum(square(points[:, :, axis]) for axis in range(points.shape[2]))


def outside_box(points, lower, upper):
    """Whether curves (count, n + 1, 3) are outside of a box: each part of one is behind one of its faces."""
    for _ in range(40):
        behind = (points <= lower + NEAR).all(axis=1) | (points >= upper - NEAR).all(axis=1)
        points = points[~behind.any(axis=1)]
        if not len(points):
            return True
        ends = points[:, [0, -1]]
        if ((ends > lower + NEAR) & (ends < upper - NEAR)).all(axis=2).any():
            return False
        parts = [halves(points[:, :, axis]) for axis in range(3)]
        points = np.stack(parts, axis=2)
    return False


def outside(points, kind, *numbers):
    """Whether curves are outside of an obstacle: a cylinder, an ellipsoid or a cuboid."""
    if kind == "cuboid":
        return outside_box(points, *numbers)
    if kind == "cylinder":
        (center, radius), points = numbers, points[:, :, :2]
        return above(norm_square((points - np.asarray(center)) / np.longdouble(radius)), (1 - NEAR / radius) ** 2)
    center, axes = numbers
    return above(norm_square((points - center) / np.asarray(axes, dtype=np.longdouble)), 1 - 2 * NEAR / min(axes))


def faults(fleet, ways, speed, acceleration, per_axis, radii, downwash, room, obstacles):
    """Return what a fleet does not keep, in words; obstacles as ``(kind, numbers...)``."""
    found = []
    curves = [each.control_points.astype(np.longdouble) for each in fleet]
    times = np.asarray(fleet[0].durations, dtype=np.longdouble)
    if any(not np.array_equal(each.durations, fleet[0].durations) for each in fleet):
        return ["not on one clock"]
    for i, (curve, way) in enumerate(zip(curves, ways, strict=True)):
        if np.abs(curve[0, 0] - way[0]).max() > NEAR or np.abs(curve[-1, -1] - way[-1]).max() > NEAR:
            found.append(f"{i} begins or ends elsewhere")
        found += [f"{i} {what}" for what in _alone(curve, times, speed, acceleration, per_axis)]
        inside = np.minimum(curve - room[0], np.asarray(room[1]) - curve).transpose(0, 2, 1).reshape(-1, curve.shape[1])
        found += [] if above(inside, -NEAR) else [f"{i} leaves the room"]
        found += [f"{i} is in a {kind}" for kind, *numbers in obstacles if not outside(curve, kind, *numbers)]
    scale = np.array([1.0, 1.0, 1.0 / np.longdouble(downwash)])
    for i, one in enumerate(curves):
        for j in range(i):
            apart = np.longdouble(radii[i]) + radii[j]
            if not above(norm_square((one - curves[j]) * (scale / apart)), 1 - 4 * NEAR):
                found.append(f"{j} and {i} come too near")
    return found


def _alone(curve, times, speed, acceleration, per_axis):
    """Say which limits a curve breaks, and whether its derivatives to the third jump at knots."""
    derivative, degree = curve, curve.shape[1] - 1
    for order in range(1, 4):
        derivative = (degree + 1 - order) * np.diff(derivative, axis=1) / times[:, None, None]
        jumps, size = np.abs(derivative[1:, 0] - derivative[:-1, -1]), np.abs(derivative).max() + 1e-6
        if len(jumps) and jumps.max() > 1e-7 * size:
            yield f"jumps in derivative {order}"
        if order < 3:
            limit, rows = (speed, acceleration)[order - 1], derivative / np.longdouble((speed, acceleration)[order - 1])
            each = rows.transpose(0, 2, 1).reshape(-1, rows.shape[1], 1) if per_axis else rows
            if not above(-norm_square(each), -1 - 4 * NEAR):
                yield f"breaks {limit:g} in derivative {order}"
