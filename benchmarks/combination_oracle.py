"""Judge of random combinations: what a curve keeps, from its control points alone, without a line of the library.

Polynomials are bounded by their Bernstein coefficients in long double, halved until a bound decides or both agree to
the tolerance; thrust, tilt and body rate, which are no polynomials, are computed at many instants by a formula for
differential flatness with linear drag (M. Faessler, A. Franchi and D. Scaramuzza, "Differential flatness of quadrotor
dynamics subject to rotor drag", RA-L 2018).
"""

from __future__ import annotations

from math import comb, perm

import numpy as np

REAL = np.longdouble
DEPTH = 26
"""Halvings of an interval."""

SHARE = REAL(2e-9)
"""Excess that counts as rounding, relative to the size of what is bounded."""


def derived(points, durations, order):
    """Return control points (pieces, n + 1 - order, dim) of a derivative, in long double."""
    points, degree = np.asarray(points, REAL), points.shape[1] - 1
    if order > degree:
        return np.zeros((len(points), 1, points.shape[2]), REAL)
    for _ in range(order):
        points = np.diff(points, axis=1)
    return points * REAL(perm(degree, order)) / np.asarray(durations, REAL)[:, None, None] ** order


def greatest(coefficients, level):
    """Return a value of one Bernstein polynomial above the level, found by halving; None where none is found."""
    stack = [(np.asarray(coefficients, REAL), 0)]
    while stack:
        part, depth = stack.pop()
        if max(part[0], part[-1]) > level:
            return max(part[0], part[-1])
        if part.max() <= level or depth == DEPTH:
            continue
        left, right, row = [part[0]], [part[-1]], part
        while len(row) > 1:
            row = (row[1:] + row[:-1]) / REAL(2)
            left.append(row[0])
            right.append(row[-1])
        stack += [(np.array(left), depth + 1), (np.array(right[::-1]), depth + 1)]
    return None


def squared(vectors):
    """Return the Bernstein coefficients of the squared norm of control points (n + 1, dim)."""
    n = len(vectors) - 1
    found = np.zeros(2 * n + 1, REAL)
    for i in range(n + 1):
        for j in range(n + 1):
            found[i + j] += REAL(comb(n, i) * comb(n, j)) / REAL(comb(2 * n, i + j)) * (vectors[i] * vectors[j]).sum()
    return found


class Judge:
    """One curve, and sentences about what it does not keep.

    Parameters
    ----------
    points : ndarray, shape (pieces in all, n + 1, dim)
    durations : ndarray, shape (pieces in all,)
    pieces : int
        Polynomials per leg.
    """

    def __init__(self, points, durations, pieces):
        self.points, self.durations, self.pieces = np.asarray(points, REAL), np.asarray(durations, REAL), pieces
        self.legs, self.degree = len(points) // pieces, points.shape[1] - 1
        self.wrong = []

    def beyond(self, what, pieces, coefficients, level, size):
        """Note where a polynomial of a piece exceeds a level by more than rounding."""
        for piece, row in zip(pieces, coefficients, strict=True):
            value = greatest(row, level + SHARE * size)
            if value is not None:
                self.wrong.append(f"{what} on piece {piece}: {float(value):.12g} over {float(level):.12g}")
                return

    def on_leg(self, leg):
        """Return the numbers of the pieces of a leg."""
        return range(leg * self.pieces, (leg + 1) * self.pieces)

    def planes(self, what, leg, normals, offsets, order=0):
        """Judge n . x <= c on a leg, normals (m, dim)."""
        pieces = list(self.on_leg(leg))
        points = derived(self.points[pieces], self.durations[pieces], order)
        for normal, offset in zip(np.asarray(normals, REAL), np.asarray(offsets, REAL), strict=True):
            values = points @ normal
            self.beyond(what, pieces, values, offset, np.abs(values).max() + abs(offset))

    def tube(self, waypoints, widths):
        """Judge the infinity norm of the offset from the line of every leg."""
        waypoints = np.asarray(waypoints, REAL)
        for leg in range(self.legs):
            along = waypoints[leg + 1] - waypoints[leg]
            along = along / np.sqrt((along * along).sum())
            across = np.eye(len(along), dtype=REAL) - np.outer(along, along)
            offset = (self.points[list(self.on_leg(leg))] - waypoints[leg]) @ across
            size = np.abs(waypoints).max() + widths[leg]
            for axis in range(len(along)):
                for sign in (1, -1):
                    self.beyond("tube", self.on_leg(leg), sign * offset[:, :, axis], REAL(widths[leg]), size)

    def norms(self, what, order, limit, axes=None):
        """Judge the norm of a derivative, of some axes only where they are given."""
        points = derived(self.points, self.durations, order)
        points = points if axes is None else points[:, :, axes]
        level = REAL(limit) ** 2
        self.beyond(what, range(len(points)), [squared(row) for row in points], level, level)

    def axis_bounds(self, what, order, limit, axes=None, signs=(1, -1)):
        """Judge the size of each coordinate of a derivative."""
        points = derived(self.points, self.durations, order)
        for axis in range(points.shape[2]) if axes is None else axes:
            for sign in signs:
                self.beyond(what, range(len(points)), sign * points[:, :, axis], REAL(limit), REAL(limit))

    def knots(self, waypoints, tolerance):
        """Judge how far from its waypoints the curve passes; tolerance gives an excess for each waypoint."""
        size = np.abs(np.asarray(waypoints, REAL)).max() + 1
        for k in range(self.legs + 1):
            for position in ([self.points[k * self.pieces, 0]] if k < self.legs else []) + (
                [self.points[k * self.pieces - 1, -1]] if k else []
            ):
                excess = tolerance(k, position)
                if not excess <= SHARE * size:
                    self.wrong.append(f"waypoint {k} is missed by {float(excess):.3g} m")

    def continuity(self, order, closed):
        """Judge that derivatives up to an order agree on both sides of every knot."""
        for p in range(order + 1):
            points = derived(self.points, self.durations, p)
            jump = np.abs(points[1:, 0] - points[:-1, -1])
            lap = np.abs(points[0, 0] - points[-1, -1]) if closed else np.zeros(1, REAL)
            shortest = self.durations.min()
            rounding = REAL(1e-14) * np.abs(self.points).max() * perm(self.degree, min(p, self.degree)) / shortest**p
            if max(jump.max(initial=0), lap.max()) > REAL(1e-8) * np.abs(points).max() + rounding * 2**p:
                self.wrong.append(f"derivative {p} jumps by {float(max(jump.max(initial=0), lap.max())):.3g}")
                return

    def state(self, waypoint, order, value):
        """Judge a derivative pinned at a waypoint, on both sides."""
        points, leg = derived(self.points, self.durations, order), waypoint * self.pieces
        sides = ([points[leg, 0]] if waypoint < self.legs else []) + ([points[leg - 1, -1]] if waypoint else [])
        near = self.durations[max(leg - 1, 0) : leg + 1].min()
        stored = (
            REAL(1e-15) * np.abs(self.points).max() * perm(self.degree, min(order, self.degree)) * (2 / near) ** order
        )
        allowed = REAL(1e-8) * (np.abs(points).max() + np.abs(value).max()) + stored
        if any(np.abs(side - np.asarray(value, REAL)).max() > allowed for side in sides):
            self.wrong.append(f"derivative {order} at waypoint {waypoint} is not the one pinned")

    def flight(self, limits, gravity, drag=(0.0, 0.0)):
        """Judge thrust, tilt and body rate at many instants."""
        found = self.flown(gravity, drag)
        for name, limit in limits.items():
            bound = -limit if name == "min_thrust" else limit
            if name in found and not found[name] <= bound + 1e-8 * max(abs(limit), 1.0):
                self.wrong.append(f"{name} reaches {abs(float(found[name])):.12g} over {limit:.12g}")

    def flown(self, gravity, drag=(0.0, 0.0), instants=160):
        """Return extremes at many instants, the least thrust negative; drag per mass across and along [1/s]."""
        s = np.linspace(0, 1, instants).astype(REAL)
        up = np.array([0, 0, gravity], REAL)
        values = {p: self.values(p, s) for p in (1, 2, 3)}
        lift = values[2] + up + REAL(drag[0]) * values[1]
        size = np.sqrt((lift * lift).sum(axis=-1))
        axis = lift / np.maximum(size, REAL(1e-30))[..., None]
        thrust = (size + REAL(drag[1] - drag[0]) * (axis * values[1]).sum(axis=-1)) / REAL(gravity)
        slope = values[3] + REAL(drag[0]) * values[2]
        turn = slope - axis * (axis * slope).sum(axis=-1, keepdims=True)
        rate = np.sqrt((turn * turn).sum(axis=-1)) / np.maximum(size, REAL(1e-30))
        tilt = np.arctan2(np.hypot(axis[..., 0], axis[..., 1]), axis[..., 2])
        return {"max_thrust": thrust.max(), "min_thrust": -thrust.min(), "tilt": tilt.max(), "body_rate": rate.max()}

    def values(self, order, s):
        """Return a derivative (pieces, m, dim) at shares s (m,) of every piece."""
        points = derived(self.points, self.durations, order)
        n = points.shape[1] - 1
        basis = np.stack([REAL(comb(n, j)) * s**j * (1 - s) ** (n - j) for j in range(n + 1)], axis=1)
        return basis @ points
