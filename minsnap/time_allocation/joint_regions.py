"""Where knots may lie, as the joint search sees it: boxes, balls and gates around waypoints."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.corridors.regions import KnotRegion
from minsnap.time_allocation.cone_programme import Rows
from minsnap.time_allocation.joint_layout import SLACKS, JointLayout, JointState

PROJECTIONS = 50
"""Rounds in which a point is brought back into a region of several sides."""


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
        self._widths = {waypoint: _width(region) for waypoint, region in self.regions.items()}
        self._sides = {waypoint: _half_spaces(region) for waypoint, region in self.regions.items()}

    def excess(self, state: JointState) -> float:
        """Largest distance of a knot from its region, in widths of the region; at least -1."""
        found = -1.0
        for waypoint, region in self.regions.items():
            found = max(found, region.excess(self._offset(state, waypoint)) / self._widths[waypoint])
        return found

    def _offset(self, state: JointState, waypoint: int) -> FloatArray:
        return np.asarray(state.scaled[waypoint * self.layout.task.pieces, 0] * self.length)

    def rows(self, state: JointState, width: int, inwards: float) -> list[Rows]:
        """Rows of all regions, in the unknowns of a piece that the knot belongs to."""
        found = []
        for waypoint, region in self.regions.items():
            found += self._rows_of(state, waypoint, region, width, inwards)
        return _joined(found)

    def _rows_of(self, state: JointState, waypoint: int, region: KnotRegion, width: int, inwards: float) -> list[Rows]:
        size, offset, dim = self._widths[waypoint], self._offset(state, waypoint), self.layout.dim
        normals, bounds = self._sides[waypoint]
        sides = normals / size * self.length
        found = [
            self._rows_at(waypoint, sides[:, None], (bounds - normals @ offset)[:, None] / size - inwards, width, 0)
        ]
        if np.isfinite(region.radius):
            matrix = np.concatenate((np.zeros((1, dim)), -np.eye(dim) * self.length / region.radius))
            bound = np.concatenate(([1.0 - inwards], offset / region.radius))
            found.append(self._rows_at(waypoint, matrix[None], bound[None], width, 0))
        if region.crossing is not None:
            speed = state.scaled[waypoint * self.layout.task.pieces, 1]
            found.append(
                self._rows_at(waypoint, -region.crossing[None, None], region.crossing[None] @ speed[:, None], width, 1)
            )
        return found

    def _rows_at(self, waypoint: int, matrix: FloatArray, bound: FloatArray, width: int, order: int) -> Rows:
        """Rows on a derivative at a knot from their matrix (n, c, dim)."""
        layout = self.layout
        last = waypoint == layout.task.legs
        begin = (order + (layout.half if last else 0)) * layout.dim
        whole = np.zeros((*matrix.shape[:2], width))
        whole[:, :, begin : begin + layout.dim] = matrix
        whole[:, 0, width - SLACKS + 1] = -1.0
        piece = waypoint * layout.task.pieces - (1 if last else 0)
        return Rows(np.full(len(matrix), piece), whole, bound)

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


def _joined(rows: list[Rows]) -> list[Rows]:
    """Join rows whose cones have as many components."""
    found = []
    for size in sorted({part.bound.shape[1] for part in rows if len(part.bound)}):
        same = [part for part in rows if part.bound.shape[1] == size and len(part.bound)]
        joined = (np.concatenate([getattr(part, name) for part in same]) for name in ("piece", "matrix", "bound"))
        found.append(Rows(*joined))
    return found
