"""A relaxation of a question to ``plan``: walls at instants only, moved out by a common share of their widths.

A conic programme over all control points, which shares only the walls with the library: where the least share is
positive, no curve keeps all walls at these instants, and the question is refused rightly.
"""

from __future__ import annotations

from math import comb, perm

import clarabel
import numpy as np
import scipy.linalg
import scipy.sparse as sparse

from minsnap import Ball, Gate

ORDER = {"velocity": 1, "acceleration": 2, "jerk": 3, "snap": 4, "crackle": 5}


class Relaxation:
    """Rows ``bound - matrix . (control points, share)`` in cones, of a question with durations and waypoints."""

    def __init__(self, asked, walls, instants=24):
        self.instants = instants
        self.asked, self.degree, self.pieces = asked, asked.get("degree", 7), asked.get("pieces", 1)
        given = asked["waypoints"]
        if given is None:
            given = [asked["start"]["position"], *[None] * (len(asked["durations"]) - 1), asked["end"]["position"]]
        self.legs, self.dim = len(given) - 1, len(getattr(given[0], "center", given[0]))
        self.times = np.repeat(np.asarray(asked["durations"], float) / self.pieces, self.pieces)
        self.size = len(self.times) * (self.degree + 1) * self.dim
        self.equal, self.below, self.cones = [], [], []
        self._knots(given)
        self._joints()
        for wall in walls:
            self._wall(wall)

    def least_share(self):
        """Least share of their widths by which all walls must move out, from below; None where no solver says."""
        origin, free = self._solutions()
        if origin is None:
            return np.inf
        parts = [[row] for row in self.below] + self.cones
        rows, bounds = (np.array(column) for column in zip(*(row for part in parts for row in part), strict=True))
        bounds, rows = bounds - rows[:, :-1] @ origin, np.column_stack((rows[:, :-1] @ free, rows[:, -1]))
        rows, bounds = np.vstack((rows, np.eye(len(free.T) + 1)[-1:] * -1.0)), np.append(bounds, 0.0)
        cones = [clarabel.NonnegativeConeT(len(self.below))]
        cones += [clarabel.SecondOrderConeT(len(cone)) for cone in self.cones] + [clarabel.NonnegativeConeT(1)]
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        q = np.eye(rows.shape[1])[-1]
        P = sparse.csc_matrix((len(q), len(q)))
        found = clarabel.DefaultSolver(P, q, sparse.csc_matrix(rows), bounds, cones, settings).solve()
        if str(found.status) == "PrimalInfeasible":  # what stands contradicts itself, however far the walls move
            return np.inf
        return found.obj_val_dual if str(found.status) in ("Solved", "AlmostSolved") else None

    def _solutions(self):
        """One solution of the equations, None where there is none, and an orthonormal basis of all others."""
        rows, sides = (np.array(column) for column in zip(*self.equal, strict=True))
        sizes = np.linalg.norm(rows, axis=1)
        rows, sides = rows[:, :-1] / sizes[:, None], sides / sizes
        origin = np.linalg.lstsq(rows, sides, rcond=None)[0]
        if np.abs(rows @ origin - sides).max() > 1e-6 * np.abs(sides).max():
            return None, rows
        try:
            return origin, scipy.linalg.null_space(rows)
        except np.linalg.LinAlgError:  # divide and conquer did not converge; QR steps do
            return origin, scipy.linalg.null_space(rows, lapack_driver="gesvd")

    def _row(self, terms, share=0.0):
        """One row: control points of one coordinate of a piece, weighed, and the share."""
        row = np.zeros(self.size + 1)
        for piece, axis, weights in terms:
            at = (piece * self.dim + axis) * (self.degree + 1)
            row[at : at + self.degree + 1] += weights
        row[-1] = share
        return row

    def _weights(self, order, s, time=1.0):
        left = self.degree - order
        basis = np.array([comb(left, j) * s**j * (1.0 - s) ** (left - j) for j in range(left + 1)])
        for _ in range(order):
            basis = np.append(0.0, basis) - np.append(basis, 0.0)
        return basis * perm(self.degree, order) / time**order

    def _knots(self, given):
        tolerance = self.asked.get("waypoint_tolerance")
        for knot, point in enumerate(given):
            if point is None:
                continue
            gate, point = (point, point.center) if isinstance(point, Gate) else (None, point)
            free = tolerance is not None and (np.ndim(getattr(tolerance, "radius", tolerance)) or 0 < knot < self.legs)
            at = self._at(knot, 0)
            if gate is not None:
                self.equal += self._along(at, gate.normal[None], point)
                self.below += self._along(at, gate.edges()[0], point, gate.edges()[1])
                if gate.crossing:
                    speed = self._at(knot, 1)
                    self.below += self._along(speed, -gate.crossing * gate.normal[None], 0.0 * point)
            elif free and isinstance(tolerance, Ball):
                radius = np.broadcast_to(tolerance.radius, len(given))[knot]
                self.cones.append([(self._row([]), radius), *((-row, -b) for row, b in self._along(at, None, point))])
            elif free:
                width = np.broadcast_to(np.asarray(tolerance, float).T, (self.dim, len(given)))[:, knot]
                self.below += self._along(at, np.vstack((np.eye(self.dim), -np.eye(self.dim))), point, (*width, *width))
            else:
                self.equal += self._along(at, None, point)
        states = {0: self.asked.get("start"), self.legs: self.asked.get("end"), **self.asked.get("pins", {})}
        for knot, state in ({} if self.asked.get("closed") else states).items():
            rest = range(1, (self.degree + 1) // 2) if knot in (0, self.legs) else ()
            values = {order: np.zeros(self.dim) for order in rest}
            values |= {ORDER[name]: np.asarray(value) for name, value in (state or {}).items() if name in ORDER}
            for order, value in values.items():
                scale = self.times.min() ** order
                self.equal += self._along(self._at(knot, order, scale), None, value * scale)

    def _at(self, knot, order, scale=1.0):
        """Each coordinate of a derivative at a waypoint."""
        piece, s = (knot * self.pieces, 0.0) if knot < self.legs else (self.legs * self.pieces - 1, 1.0)
        weights = self._weights(order, s, self.times[piece]) * scale
        return [[(piece, axis, weights)] for axis in range(self.dim)]

    def _along(self, terms, normals, point, bounds=0.0):
        """Rows of normals . (value - point), with their bounds."""
        normals = np.eye(self.dim) if normals is None else normals
        bounds = np.broadcast_to(bounds, len(normals))
        rows = []
        for normal, bound in zip(normals, bounds, strict=True):
            parts = [(p, a, n * w) for n, term in zip(normal, terms, strict=True) for p, a, w in term if n]
            rows.append((self._row(parts), float(bound + normal @ point)))
        return rows

    def _joints(self):
        order = self.asked.get("continuity") or (self.degree - 1) // 2
        last = len(self.times) - 1
        pairs = [(piece, piece + 1) for piece in range(last)] + ([(last, 0)] if self.asked.get("closed") else [])
        for before, after in pairs:
            for p in range(order + 1):
                scale = min(self.times[before], self.times[after]) ** p
                left = self._weights(p, 1.0, self.times[before]) * scale
                right = self._weights(p, 0.0, self.times[after]) * scale
                for axis in range(self.dim):
                    self.equal.append((self._row([(before, axis, left), (after, axis, -right)]), 0.0))

    def _wall(self, cones):
        for wall, leg in enumerate(cones.leg):
            for piece in range(leg * self.pieces, (leg + 1) * self.pieces):
                for s in np.linspace(0.0, 1.0, self.instants):
                    self._instant(cones, wall, piece, self._weights(cones.order, s, self.times[piece]))

    def _instant(self, cones, wall, piece, weights):
        def row(direction, bound, share):
            terms = [(piece, axis, factor * weights) for axis, factor in enumerate(direction) if factor]
            size = float(cones.width[wall])
            return self._row(terms, share * size) / size, bound / size

        slope, anchor, matrix = cones.slope[wall], cones.anchor[wall], cones.matrix[wall]
        reach = row(-slope, float(cones.radius[wall] - slope @ anchor), -1.0)
        if cones.flat:
            self.below.append(reach)
        else:
            self.cones.append([reach, *(row(-a, -float(a @ anchor), 0.0) for a in matrix)])
