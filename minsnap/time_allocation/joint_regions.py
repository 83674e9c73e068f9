"""Where knots may lie, as the joint search sees it: boxes, balls and gates around waypoints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.regions import KnotRegion
from minsnap.time_allocation.cone_programme import Rows
from minsnap.time_allocation.joint_layout import SLACKS, JointLayout, JointState
from minsnap.time_allocation.joint_rows import beyond

PROJECTIONS = 50
"""Rounds in which a point is brought back into a region of several sides."""


@dataclass(frozen=True, eq=False)
class _KnotCones:
    """Cones of one size that hold derivatives of one order at knots.

    Parameters
    ----------
    order : int
    knot, piece : ndarray of int, shape (n,)
        Which knots, and a piece that each belongs to.
    matrix : ndarray, shape (n, c, dim)
        In scaled derivatives.
    whole : ndarray, shape (n, c, width)
        The same in the unknowns of the piece.
    bound : ndarray, shape (n, c)
        Of the scaled derivatives themselves.
    """

    order: int
    knot: IntArray
    piece: IntArray
    matrix: FloatArray
    whole: FloatArray
    bound: FloatArray

    def left(self, state: JointState, inwards: float = 0.0) -> FloatArray:
        """Return what a state leaves of the bounds, (n, c)."""
        left = self.bound - np.einsum("ncd,nd->nc", self.matrix, state.scaled[self.knot, self.order])
        if self.order == 0:
            left[:, 0] -= inwards
        return np.asarray(left)


class JointRegions:
    """Regions of all knots that are free.

    Parameters
    ----------
    layout : JointLayout
    """

    def __init__(self, layout: JointLayout) -> None:
        task = layout.task
        self.layout, self.length = layout, layout.units.length
        self.regions = {int(waypoint): region for waypoint, region in task.regions.items()}
        for waypoint in np.flatnonzero((task.upper > task.lower).any(axis=1)):
            if int(waypoint) not in self.regions:
                self.regions[int(waypoint)] = _box(task.lower[waypoint], task.upper[waypoint])
        parts = [part for waypoint, region in self.regions.items() for part in self._cones_of(waypoint, region)]
        kinds = sorted({(part.order, part.bound.shape[1]) for part in parts if len(part.bound)})
        self._cones = [_joined([part for part in parts if (part.order, part.bound.shape[1]) == kind]) for kind in kinds]

    def excess(self, state: JointState) -> float:
        """Largest distance of a knot from its region, in widths of the region; at least -1."""
        return max((float(beyond(cones.left(state)).max()) for cones in self._cones if cones.order == 0), default=-1.0)

    def rows(self, state: JointState, inwards: float) -> list[Rows]:
        """Rows of all regions, in the unknowns of a piece that the knot belongs to."""
        return [Rows(cones.piece, cones.whole, cones.left(state, inwards)) for cones in self._cones]

    def _cones_of(self, waypoint: int, region: KnotRegion) -> list[_KnotCones]:
        """Half-spaces, ball and crossing of a region, in widths of it."""
        size, dim = _width(region), self.layout.dim
        normals, bounds = _half_spaces(region)
        found = [self._cones_at(waypoint, 0, normals[:, None] / size * self.length, bounds[:, None] / size)]
        if np.isfinite(region.radius):
            matrix = np.concatenate((np.zeros((1, dim)), -np.eye(dim) * self.length / region.radius))
            found.append(self._cones_at(waypoint, 0, matrix[None], np.eye(1, dim + 1)))
        if region.crossing is not None:
            found.append(self._cones_at(waypoint, 1, -region.crossing[None, None], np.zeros((1, 1))))
        return found

    def _cones_at(self, waypoint: int, order: int, matrix: FloatArray, bound: FloatArray) -> _KnotCones:
        """Cones on a derivative at a waypoint from their matrix (n, c, dim)."""
        layout, pieces = self.layout, self.layout.task.pieces
        last = waypoint == layout.task.legs
        begin = (order + (layout.half if last else 0)) * layout.dim
        whole = np.zeros((*matrix.shape[:2], layout.unknowns.shape[1]))
        whole[:, :, begin : begin + layout.dim] = matrix
        whole[:, 0, 1 - SLACKS] = -1.0
        knot = np.full(len(matrix), waypoint * pieces)
        return _KnotCones(order, knot, knot - (1 if last else 0), matrix, whole, bound)

    def clipped(self, state: JointState) -> JointState:
        """Put every knot into its region, as near as rounding allows."""
        scaled = state.scaled.copy()
        for waypoint, region in self.regions.items():
            knot = waypoint * self.layout.task.pieces
            scaled[knot, 0] = _projected(region, scaled[knot, 0] * self.length) / self.length
        if self.layout.task.closed and 0 in self.regions:
            scaled[-1, 0] = scaled[0, 0]
        return JointState(scaled, state.durations)


def _box(lower: FloatArray, upper: FloatArray) -> KnotRegion:
    return KnotRegion(lower, upper, np.inf, np.zeros((0, len(lower))), np.zeros(0), what="box")


def _width(region: KnotRegion) -> float:
    """Half of the widest side."""
    return float((region.upper - region.lower).max()) / 2.0


def _half_spaces(region: KnotRegion) -> tuple[FloatArray, FloatArray]:
    """Return normals (n, dim) and bounds (n,) of all flat sides; a plane has two, and a ball needs no box."""
    dim = len(region.lower)
    free = np.flatnonzero(region.upper > region.lower) if np.isinf(region.radius) else np.arange(0)
    axes = np.eye(dim)[free]
    normals = [axes, -axes, region.normals.reshape(-1, dim)]
    bounds = [region.upper[free], -region.lower[free], region.bounds]
    if region.plane is not None:
        normals += [region.plane[None], -region.plane[None]]
        bounds += [np.zeros(2)]
    return np.concatenate(normals), np.concatenate(bounds)


def _projected(region: KnotRegion, offset: FloatArray) -> FloatArray:
    """Bring an offset back by projections on what it violates, by turns."""
    for _ in range(PROJECTIONS):
        offset = np.clip(offset, region.lower, region.upper)
        size = float(np.linalg.norm(offset))
        if size > region.radius:
            offset = offset * (region.radius * (1.0 - 1e-15) / size)
        for normal, bound in zip(region.normals, region.bounds, strict=True):
            offset = offset - normal * max(float(normal @ offset) - bound, 0.0)
        if region.plane is not None:
            offset = offset - region.plane * float(region.plane @ offset)
        if region.excess(offset) <= 0.0:
            break
    return offset


def _joined(parts: list[_KnotCones]) -> _KnotCones:
    """Join cones of one size and order."""
    names = ("knot", "piece", "matrix", "whole", "bound")
    return _KnotCones(parts[0].order, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))
