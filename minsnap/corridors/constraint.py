r"""Walls: the convex sets that a derivative of the curve must stay in, leg by leg.

A constraint is anything with a method ``walls(waypoints)`` that returns a list of these two:

* ``Faces``: :math:`lower \le n^\top (r^{(p)}(t) - a) \le upper` on a leg,
* ``Balls``: :math:`\|M (r^{(p)}(t) - a)\|_2 \le \rho` on a leg, or with a radius that grows along a slope,
  :math:`\rho + c^\top (r^{(p)}(t) - a)`: a cone.

From them the library derives both rows of the QP at any instant (a ball gives its tangent plane there) and the exact
margin over all instants, because :math:`n^\top r` and :math:`\|M r\|^2` are polynomials on every piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.errors import CorridorError
from minsnap.polynomials.bernstein import differentiate, squared_norm
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Faces:
    """Pairs of parallel planes, each on one leg.

    Parameters
    ----------
    leg : array_like of int, shape (m,)
        Which leg each belongs to.
    normal : array_like, shape (m, dim)
        Not necessarily of unit length.
    anchor : array_like, shape (m, dim)
        Point from which the bounds are measured; zero for derivatives.
    lower, upper : array_like, shape (m,)
        Bounds along the normal; infinite where there is none.
    width : array_like, shape (m,)
        Length by which an excess is judged, such as half the distance of the planes; positive.
    order : int
        Derivative that is bounded: 0 position, 1 velocity, …
    name : str
        What messages call it.
    """

    leg: IntArray
    normal: FloatArray
    anchor: FloatArray
    lower: FloatArray
    upper: FloatArray
    width: FloatArray
    order: int = 0
    name: str = "corridor"

    def __post_init__(self) -> None:
        _own(self)

    def polynomials(self, trajectory: Trajectory) -> tuple[FloatArray, IntArray, IntArray]:
        """Distance to each plane over each piece, positive inside: control points (r, n + 1), rows, pieces."""
        row, piece = _on_pieces(self.leg, trajectory.pieces)
        along = np.einsum(
            "rnd,rd->rn", _derivative_points(trajectory, piece, self.anchor[row], self.order), self.normal[row]
        )
        above, below = np.isfinite(self.upper[row]), np.isfinite(self.lower[row])
        inside = np.concatenate(((self.upper[row, None] - along)[above], (along - self.lower[row, None])[below]))
        return inside, np.concatenate((row[above], row[below])), np.concatenate((piece[above], piece[below]))


@dataclass(frozen=True, eq=False)
class Balls:
    """Balls, cylinders or disks, each on one leg.

    Parameters
    ----------
    leg : array_like of int, shape (m,)
        Which leg each belongs to.
    matrix : array_like, shape (m, q, dim)
        M: the identity for a ball, a projection for a cylinder.
    anchor : array_like, shape (m, dim)
        Centre; zero for derivatives.
    radius : array_like, shape (m,)
        Positive.
    order : int
        Derivative that is bounded: 0 position, 1 velocity, …
    name : str
        What messages call it.
    slope : array_like, shape (m, dim), optional
        c, by which the radius grows; a ball has none.
    """

    leg: IntArray
    matrix: FloatArray
    anchor: FloatArray
    radius: FloatArray
    order: int = 0
    name: str = "corridor"
    slope: FloatArray | None = None

    def __post_init__(self) -> None:
        _own(self)

    @property
    def width(self) -> FloatArray:
        """Length by which an excess is judged: the radius."""
        return self.radius

    def excess(self, trajectory: Trajectory) -> tuple[FloatArray, IntArray, IntArray]:
        """Half the excess of the squared norm over the squared radius, in squared radii: to first order in radii.

        Control points (r, 2n + 1), rows, pieces.
        """
        row, piece = _on_pieces(self.leg, trajectory.pieces)
        points = _derivative_points(trajectory, piece, self.anchor[row], self.order) / self.radius[row, None, None]
        squares = squared_norm(np.einsum("rnd,rqd->rnq", points, self.matrix[row]))
        reach = (
            1.0
            if self.slope is None
            else squared_norm(1.0 + np.einsum("rnd,rd->rn", points, self.slope[row])[..., None])
        )
        return (squares - reach) / 2.0, row, piece


Walls = Faces | Balls


class Constraint(Protocol):
    """Anything that keeps a derivative of the curve inside convex sets, leg by leg."""

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the sets for these waypoints, shape (n, dim); leg i runs from waypoint i to waypoint i + 1."""
        ...


def _own(walls: Walls) -> None:
    for entry in fields(walls):
        value = getattr(walls, entry.name)
        if entry.name in ("order", "name") or value is None:
            continue
        array = np.array(value, dtype=np.intp if entry.name == "leg" else np.float64)
        if np.isnan(array).any():
            raise CorridorError(f"the {entry.name} of a wall of the {walls.name} is not a number")
        array.flags.writeable = False
        object.__setattr__(walls, entry.name, array)


def _on_pieces(leg: IntArray, pieces: int) -> tuple[IntArray, IntArray]:
    """Repeat each wall on every piece of its leg: index of the wall and of the piece."""
    row = np.repeat(np.arange(len(leg)), pieces)
    piece = np.add.outer(leg * pieces, np.arange(pieces)).reshape(-1)
    return row, piece


def _derivative_points(trajectory: Trajectory, piece: IntArray, anchor: FloatArray, order: int) -> FloatArray:
    points = trajectory.control_points[piece] - anchor[:, None, :] if order == 0 else trajectory.control_points[piece]
    points = differentiate(points, order) / trajectory.durations[piece, None, None] ** order
    return points if order == 0 else points - anchor[:, None, :]
