"""Rows of the full problem: waypoints, states, continuity and sampled planes, over power coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from math import perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import DERIVATIVES
from minsnap.corridors.constraint import Walls
from minsnap.errors import CorridorError

Term = tuple[int, float, int, FloatArray]
"""A leg, where on it in [0, 1], the order of a derivative there, and the vector (dim,) that it is multiplied by."""


class RowCollector:
    """Collector of rows over the coefficients of legs with these durations [s]: matrix, right-hand side and labels."""

    def __init__(self, durations: FloatArray, dim: int, size: int) -> None:
        self.durations, self.axes, self.size = durations, np.eye(dim), size
        self.sides: list[float] = []
        self.labels: list[str] = []
        self.places: list[tuple[int, int]] = []
        self.factors: list[FloatArray] = []

    def add(self, terms: list[Term], side: float, label: str) -> None:
        """Append one row: the sum of the terms."""
        for leg, s, order, vector in terms:
            powers = np.arange(self.size)
            falling = np.array([perm(power, order) for power in powers.tolist()], dtype=np.float64)
            factors = falling * s ** np.maximum(powers - order, 0) / self.durations[leg] ** order
            self.places.append((len(self.sides), leg))
            self.factors.append(np.outer(vector, factors).reshape(-1))
        self.sides.append(float(side))
        self.labels.append(label)

    def collected(self) -> tuple[Any, FloatArray, tuple[str, ...]]:
        """Matrix, right-hand side and labels."""
        from scipy.sparse import csc_matrix

        block, (rows, legs) = len(self.axes) * self.size, (len(self.sides), len(self.durations))
        factors = np.array(self.factors).reshape(-1, block)
        row, leg = np.array(self.places, dtype=np.intp).reshape(-1, 2).T[:, :, None]
        column = leg * block + np.arange(block)
        place = np.broadcast_to(row, column.shape)[factors != 0.0], column[factors != 0.0]
        matrix = csc_matrix((factors[factors != 0.0], place), shape=(rows, legs * block))
        return matrix, np.array(self.sides), tuple(self.labels)


def pass_waypoints(rows: RowCollector, points: FloatArray) -> None:
    """Fix both ends of every leg at their waypoints."""
    for leg in range(len(rows.durations)):
        for end, verb in enumerate(("starts", "ends")):
            for axis, along in enumerate(rows.axes):
                label = f"leg {leg} {verb} at waypoint {leg + end}, axis {axis}"
                rows.add([(leg, float(end), 0, along)], points[leg + end, axis], label)


def keep_states(rows: RowCollector, states: Mapping[int, Mapping[int, FloatArray]], continuity: int) -> None:
    """Fix derivatives at waypoints, on both sides where continuity does not carry them over."""
    for waypoint, state in states.items():
        for order, value in state.items():
            legs = [leg for leg in (waypoint - 1, waypoint) if 0 <= leg < len(rows.durations)]
            for leg in legs[:1] if order <= continuity else legs:
                for axis, along in enumerate(rows.axes):
                    label = f"{DERIVATIVES[order]} at waypoint {waypoint}, leg {leg}, axis {axis}"
                    rows.add([(leg, float(waypoint - leg), order, along)], value[axis], label)


def join(rows: RowCollector, continuity: int, closed: bool) -> None:
    """Make derivatives 1 … continuity equal on both sides of inner waypoints, and of the seam of a closed lap."""
    legs = len(rows.durations)
    for leg in range(legs if closed else legs - 1):
        after = (leg + 1) % legs
        for order in range(1, continuity + 1):
            for axis, along in enumerate(rows.axes):
                label = f"derivative {order} is continuous from leg {leg} to leg {after}, axis {axis}"
                rows.add([(leg, 1.0, order, along), (after, 0.0, order, -along)], 0.0, label)


def sample_planes(rows: RowCollector, walls: Walls, instants: FloatArray) -> None:
    """Keep a leg inside its planes at the instants s, shape (m,)."""
    if not walls.flat:
        raise CorridorError(f"the {walls.name} is round and has no linear rows: use plan, or a Tube")
    for number, (leg, normal, bound) in enumerate(zip(walls.leg.tolist(), *walls.half_spaces, strict=True)):
        for s in instants.tolist():
            label = f"{walls.name}, plane {number} of leg {leg} at s = {s:g}"
            rows.add([(leg, s, walls.order, normal)], bound, label)
