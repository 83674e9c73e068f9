"""Rows of the full problem: waypoints, states, continuity and sampled planes, over power coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import DERIVATIVES
from minsnap.corridors.constraint import Walls
from minsnap.errors import CorridorError

Entry = tuple[int, FloatArray, int]
"""A leg, the factors of its 2k coefficients, and the axis."""


@dataclass
class RowCollector:
    """Collector of the rows of a sparse matrix over the coefficients."""

    legs: int
    dim: int
    size: int
    bounds: list[float] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    place: list[tuple[int, int]] = field(default_factory=list)
    factors: list[FloatArray] = field(default_factory=list)

    def add(self, entries: Sequence[Entry], bound: float, label: str) -> None:
        """Append one row: the sum of factors times coefficients."""
        for leg, factors, axis in entries:
            self.place.append((len(self.bounds), (leg * self.dim + axis) * self.size))
            self.factors.append(factors)
        self.bounds.append(float(bound))
        self.labels.append(label)

    def collected(self) -> tuple[Any, FloatArray, tuple[str, ...]]:
        """Matrix, right-hand side and labels."""
        from scipy.sparse import csc_matrix

        place = np.array(self.place, dtype=np.intp).reshape(-1, 2)
        values = np.array(self.factors, dtype=np.float64).reshape(-1, self.size)
        row = np.repeat(place[:, 0], self.size)
        column = (place[:, 1:] + np.arange(self.size)).reshape(-1)
        shape = (len(self.bounds), self.legs * self.dim * self.size)
        matrix = csc_matrix((values.reshape(-1), (row, column)), shape=shape)
        matrix.eliminate_zeros()
        return matrix, np.array(self.bounds), tuple(self.labels)


def derivative_factors(size: int, order: int, s: float, duration: float) -> FloatArray:
    """Factors of the coefficients in a derivative at s, in metres and seconds: shape (size,)."""
    powers = np.arange(size)
    falling = np.array([perm(power, order) if power >= order else 0 for power in powers], dtype=np.float64)
    return np.asarray(falling * s ** np.maximum(powers - order, 0) / duration**order)


def pass_waypoints(rows: RowCollector, points: FloatArray) -> None:
    """Fix both ends of every leg at their waypoints."""
    ends = [derivative_factors(rows.size, 0, s, 1.0) for s in (0.0, 1.0)]
    for leg in range(rows.legs):
        for where, (waypoint, factors) in enumerate(zip((leg, leg + 1), ends, strict=True)):
            for axis in range(rows.dim):
                label = f"leg {leg} {'ends' if where else 'starts'} at waypoint {waypoint}, axis {axis}"
                rows.add([(leg, factors, axis)], points[waypoint, axis], label)


def keep_states(
    rows: RowCollector, states: Mapping[int, Mapping[int, FloatArray]], durations: FloatArray, continuity: int
) -> None:
    """Fix derivatives at waypoints, on both sides where continuity does not carry them over."""
    for waypoint, state in states.items():
        for order, value in state.items():
            legs = [leg for leg in (waypoint - 1, waypoint) if 0 <= leg < rows.legs]
            for leg in legs[:1] if order <= continuity else legs:
                factors = derivative_factors(rows.size, order, float(waypoint - leg), durations[leg])
                for axis in range(rows.dim):
                    label = f"{DERIVATIVES[order]} at waypoint {waypoint}, leg {leg}, axis {axis}"
                    rows.add([(leg, factors, axis)], value[axis], label)


def join(rows: RowCollector, durations: FloatArray, continuity: int, closed: bool) -> None:
    """Make derivatives 1 … continuity equal on both sides of inner waypoints, and of the seam of a closed lap."""
    for leg in range(rows.legs if closed else rows.legs - 1):
        after = (leg + 1) % rows.legs
        for order in range(1, continuity + 1):
            before = derivative_factors(rows.size, order, 1.0, durations[leg])
            behind = -derivative_factors(rows.size, order, 0.0, durations[after])
            for axis in range(rows.dim):
                label = f"derivative {order} is continuous from leg {leg} to leg {after}, axis {axis}"
                rows.add([(leg, before, axis), (after, behind, axis)], 0.0, label)


def sample_planes(rows: RowCollector, walls: Walls, durations: FloatArray, instants: FloatArray) -> None:
    """Keep a leg inside its planes at the instants s, shape (m,)."""
    planes = walls
    if not planes.flat:
        raise CorridorError(f"the {walls.name} is round and has no linear rows: use plan, or a Tube")
    bounds = planes.radius - (planes.slope * planes.anchor).sum(axis=1)
    for number, (leg, normal, bound) in enumerate(zip(planes.leg.tolist(), -planes.slope, bounds, strict=True)):
        for s in instants:
            factors = derivative_factors(rows.size, planes.order, float(s), durations[leg])
            entries = [(leg, normal[axis] * factors, axis) for axis in range(rows.dim) if normal[axis] != 0.0]
            rows.add(entries, bound, f"{walls.name}, plane {number} of leg {leg} at s = {s:g}")
