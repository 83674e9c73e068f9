r"""Walls: the convex sets that a derivative of the curve must stay in, per leg.

A constraint is anything with a method ``walls(waypoints)`` that returns a list of :class:`Walls`. All have one form,
the cone

.. math:: \|A\,(r^{(p)}(t) - a)\|_2 \le \rho + s^\top (r^{(p)}(t) - a),

whose matrix has no rows for a plane (:meth:`Walls.planes`) and whose slope is zero for a ball (:meth:`Walls.balls`).
All uses of a wall in the library are computed from it: rows of the QP (a plane, or the tangent plane at an instant),
membership of points, exact margins over all instants, and the drawing, because both sides are polynomials on every
piece. The reference core has them in normalised units, with pieces in the place of legs; a search has those of one leg.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, NDArray, ReadOnly, lengths_of, numbers, read_only
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import DEGREES
from minsnap.basics.tolerances import EXACT
from minsnap.errors import CorridorError
from minsnap.native.records import WallsRecord
from minsnap.polynomials.bernstein import squared_norm
from minsnap.polynomials.enclosures import Enclosure, derivative
from minsnap.trajectory.trajectory import Trajectory

_NUMBERS = ("matrix", "anchor", "slope", "radius", "width")
"""Fields with a number or more for each wall."""


@dataclass(frozen=True, eq=False)
class Walls(ReadOnly):
    """m walls of one kind: norm of A x <= radius + slope . x, with x the derivative minus the anchor.

    Parameters
    ----------
    leg : ndarray of int, shape (m,)
        Which leg each belongs to.
    matrix : ndarray, shape (m, q, dim)
        A; q is 0 for planes.
    anchor, slope : ndarray, shape (m, dim)
    radius, width : ndarray, shape (m,)
        Right-hand side at the anchor, and the positive length by which an excess is judged.
    order : int
        Derivative that is bounded: 0 position, 1 velocity, …
    name : str
        What messages call it.
    at : ndarray of int, shape (m,), optional
        Where on its leg each holds: 0 at the start alone, 1 at the end alone. By default at every instant.
    equal : bool
        Whether they are planes on which the curve lies there.
    """

    leg: IntArray
    matrix: FloatArray
    anchor: FloatArray
    slope: FloatArray
    radius: FloatArray
    width: FloatArray
    order: int = 0
    name: str = "corridor"
    at: IntArray | None = None
    equal: bool = False

    @classmethod
    def planes(
        cls,
        leg: ArrayLike,
        normal: ArrayLike,
        anchor: ArrayLike,
        lower: ArrayLike,
        upper: ArrayLike,
        width: ArrayLike,
        order: int = 0,
        name: str = "corridor",
    ) -> Walls:
        """Return pairs of parallel planes, each on one leg: lower <= normal @ (derivative - anchor) <= upper.

        Parameters
        ----------
        leg : array_like of int, shape (m,)
            Which leg each pair belongs to.
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

        Raises
        ------
        CorridorError
            If an array holds anything but numbers, or has another shape.
        """
        arrays = {"leg": leg, "normal": normal, "anchor": anchor, "lower": lower, "upper": upper, "width": width}
        legs, normal, anchor, lower, upper, width = _checked(name, order, arrays, (1, 2, 2, 1, 1, 1))
        return cls.pairs(read_only(legs.astype(np.intp)), normal, anchor, lower, upper, width, order, name)

    @classmethod
    def pairs(
        cls,
        leg: IntArray,
        normal: FloatArray,
        anchor: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        width: FloatArray,
        *kind: Any,
    ) -> Walls:
        """Return pairs of planes as :meth:`planes` does, of numbers; ``kind`` is their order and name."""
        rows: list[tuple[Any, ...]] = [(leg, -normal, anchor, upper, width), (leg, normal, anchor, -lower, width)]
        if not (np.isfinite(upper).all() and np.isfinite(lower).all()):
            rows = [tuple(part[np.isfinite(side[3])] for part in side) for side in rows]
        leg, slope, anchor, radius, width = map(np.concatenate, zip(*rows, strict=True))
        return cls.unchecked(leg, np.zeros((len(leg), 0, slope.shape[1])), anchor, slope, radius, width, *kind)

    @classmethod
    def unchecked(cls, *values: Any) -> Walls:
        """Return walls of arrays of their own, of the right shapes, which become read-only."""
        for array in values:
            if isinstance(array, np.ndarray):
                read_only(array)
        return cls(*values)

    @classmethod
    def balls(
        cls,
        leg: ArrayLike,
        matrix: ArrayLike,
        anchor: ArrayLike,
        radius: ArrayLike,
        order: int = 0,
        name: str = "corridor",
        slope: ArrayLike | None = None,
    ) -> Walls:
        """Return balls, cylinders, disks or cones, each on one leg; an excess is judged by the radius.

        Parameters
        ----------
        leg : array_like of int, shape (m,)
            Which leg each belongs to.
        matrix : array_like, shape (m, q, dim)
            A: the identity for a ball, a projection for a cylinder, diag(r / a) with the least semi-axis r for an
            ellipsoid of semi-axes a. No singular value above 1, so that a margin is at most the distance in metres.
        anchor : array_like, shape (m, dim)
            Center, or a point inside a cone, not its apex; zero for derivatives.
        radius : array_like, shape (m,)
            Positive.
        order : int
            Derivative that is bounded: 0 position, 1 velocity, …
        name : str
            What messages call it.
        slope : array_like, shape (m, dim), optional
            By which the radius grows: a cone; a ball has none. The sign of a cone's margin is exact; its size is off by
            up to the ratio of the radius at that place to ``radius``.

        Raises
        ------
        CorridorError
            If an array holds anything but numbers, or has another shape.
        """
        grows = np.zeros(np.shape(anchor)) if slope is None else slope
        arrays = {"leg": leg, "matrix": matrix, "anchor": anchor, "slope": grows, "radius": radius}
        legs, matrix, anchor, grows, radius = _checked(name, order, arrays, (1, 3, 2, 2, 1))
        return cls(read_only(legs.astype(np.intp)), matrix, anchor, grows, radius, radius, order, name)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out addresses, which mean nothing in another process."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    @property
    def flat(self) -> bool:
        """Whether they are planes."""
        return bool(self.matrix.shape[1] == 0)

    @cached_property
    def record(self) -> WallsRecord:
        """The same for the native core."""
        at = None if self.at is None else np.ascontiguousarray(self.at, dtype=np.int64)
        known = {"count": len(self.leg), "rows": self.matrix.shape[1], "order": self.order, "equal": self.equal}
        numbers = {name: np.ascontiguousarray(getattr(self, name), dtype=np.float64) for name in _NUMBERS}
        return WallsRecord(**known, **numbers, leg=np.ascontiguousarray(self.leg, dtype=np.int64), at=at)

    @property
    def half_spaces(self) -> tuple[FloatArray, FloatArray]:
        """Planes as normal . r <= bound: (m, dim) and (m,)."""
        return -self.slope, self.radius - (self.slope * self.anchor).sum(axis=1)

    def slack(self, values: FloatArray) -> FloatArray:
        """Slack of values of the derivative, shape (m or 1, k, dim): (m, k), negative outside.

        The distance to planes with normals of unit length and to balls and cylinders.
        """
        offset = values - self.anchor[:, None, :]
        reach = self.radius[:, None] + np.einsum("mkd,md->mk", offset, self.slope)
        if self.flat:
            return np.asarray(reach)
        return np.asarray(reach - np.linalg.norm(np.einsum("mkd,mqd->mkq", offset, self.matrix), axis=2))

    def excess(self, trajectory: Trajectory) -> tuple[Enclosure, IntArray, IntArray]:
        """Polynomials that are positive outside: control points (r, n), rows and pieces, one for each piece of a leg.

        For planes the negative slack; else the difference of the squares of both sides, where ``reach`` is positive.
        """
        curve, row, piece = self._curves(trajectory)
        if self.flat:
            return curve.along(-self.slope[row]).minus(self.radius[row, None]), row, piece
        return curve.mapped(self.matrix[row]).squared_norm().less(self._reach(curve, row).squared_norm()), row, piece

    def reach(self, trajectory: Trajectory) -> Enclosure:
        """Right side over each piece: control points (r, n + 1)."""
        curve, row, _ = self._curves(trajectory)
        return self._reach(curve, row).component(0)

    def _reach(self, curve: Enclosure, row: IntArray) -> Enclosure:
        return curve.mapped(self.slope[row, None]).minus(-self.radius[row, None, None])

    def on_pieces(self, pieces: int) -> tuple[IntArray, IntArray]:
        """Return every pair of a wall and a piece of its leg, with ``pieces`` on each leg: indices (r,) and (r,)."""
        row = np.arange(len(self.leg))
        if pieces == 1:
            return row, self.leg
        return np.repeat(row, pieces), (self.leg[:, None] * pieces + np.arange(pieces)).reshape(-1)

    def cut(self, parts: int) -> Walls:
        """Return the walls of legs that are cut into parts, each of which has those of its leg."""
        if parts == 1:
            return self
        row, part = self.on_pieces(parts)
        return replace(self.chosen(row), leg=part)

    def chosen(self, index: NDArray[Any]) -> Walls:
        """Return some of the walls, by indices or a mask."""
        at = None if self.at is None else self.at[index]
        return replace(self, leg=self.leg[index], **{name: getattr(self, name)[index] for name in _NUMBERS}, at=at)

    def from_origin(self, origin: FloatArray) -> Walls:
        """Return the walls with positions counted from an origin, shape (dim,) [m]; derivatives stay as they are."""
        return self if self.order else replace(self, anchor=self.anchor - origin)

    def moved(self, distance: FloatArray) -> Walls:
        """Return the walls, each moved outwards, shape (m,)."""
        return replace(self, radius=self.radius + distance)

    @cached_property
    def in_widths(self) -> tuple[FloatArray, FloatArray]:
        """Right side and A x in widths, of a derivative d: rows (m, 1 + q, dim) @ d + offset (m, 1 + q)."""
        rows = np.concatenate((self.slope[:, None], self.matrix), axis=1) / self.width[:, None, None]
        offset = np.einsum("rcd,rd->rc", rows, -self.anchor)
        offset[:, 0] += self.radius / self.width
        return rows, offset

    def excess_at(self, values: FloatArray) -> FloatArray:
        """Excess in widths at values (..., dim) of the derivative: (..., m)."""
        rows, offset = self.in_widths
        parts = (values @ rows.reshape(-1, rows.shape[2]).T).reshape(*values.shape[:-1], *offset.shape) + offset
        rest = parts[..., 1:]
        return np.asarray((0.0 if self.flat else np.sqrt((rest * rest).sum(axis=-1))) - parts[..., 0])

    def excess_along(self, points: FloatArray) -> FloatArray:
        """Control points of an excess in widths, from those of the derivative that each wall bounds, (m, n, dim).

        Of round walls half the excess of the squared norm, in squared widths: to first order the excess in widths.
        """
        offset = points - self.anchor[:, None, :]
        reach = self.radius[:, None] + np.matmul(offset, self.slope[:, :, None])[:, :, 0]
        reach /= self.width[:, None]
        if self.flat:
            return np.asarray(-reach)
        mapped = np.matmul(offset, self.matrix.transpose(0, 2, 1)) / self.width[:, None, None]
        return (squared_norm(mapped) - squared_norm(reach[..., None])) / 2.0

    def outward(self, excess: FloatArray) -> FloatArray:
        """Widths by which each wall must move outwards for its largest ``excess_along``, (m,); exact without a slope.

        The excess e of a round wall is half that of the squared norm, which is therefore radius^2 + 2 e.
        """
        if self.flat:
            return excess
        reach = self.radius / self.width
        return np.asarray(np.sqrt(np.maximum(reach**2 + 2.0 * excess, 0.0)) - reach)

    def tangents(self, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Planes normal . x <= bound outside of each wall, in directions (m, q) of length 1 at most: (m, dim), (m,)."""
        normal = np.einsum("rq,rqd->rd", direction, self.matrix) - self.slope
        return normal, self.radius + (normal * self.anchor).sum(axis=1)

    def tangents_at(self, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Such planes in the direction of values (m, dim) of the derivative; planes are their own."""
        mapped = np.einsum("rqd,rd->rq", self.matrix, value - self.anchor)
        norm = np.linalg.norm(mapped, axis=1, keepdims=True)
        return self.tangents(mapped / np.where(norm > 0.0, norm, 1.0))

    def _curves(self, trajectory: Trajectory) -> tuple[Enclosure, IntArray, IntArray]:
        """Return the derivative from each wall's anchor on every piece of its leg, and indices of wall and piece."""
        row, piece = self.on_pieces(trajectory.pieces)
        points, durations = trajectory.control_points[piece], trajectory.durations[piece]
        return derivative(points, durations, self.order).minus(self.anchor[row][:, None, :]), row, piece


class Constraint(Protocol):
    """Protocol of a constraint: keeps a derivative of the curve inside convex sets, per leg."""

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the sets for these waypoints, shape (n, dim); leg i runs from waypoint i to waypoint i + 1."""
        ...


def walls_of(constraints: Sequence[Constraint], waypoints: FloatArray) -> list[Walls]:
    """Return the walls of some constraints for waypoints (n, dim), without empty ones.

    Raises
    ------
    CorridorError
        If a constraint of the user's own returns anything but walls, or walls of other legs or dimensions.
    """
    walls: list[Walls] = []
    for constraint in constraints:
        own, name = constraint.walls(waypoints), type(constraint).__name__
        if not (isinstance(own, Sequence) and all(isinstance(wall, Walls) for wall in own)):
            raise CorridorError(f"{name}.walls() must return a list of minsnap.corridors.Walls")
        if any(wall.equal for wall in own):
            raise CorridorError("walls of a constraint are no equations (equal=True): give a Gate, or pin derivatives")
        walls += own
    return [wall for wall in walls if _fits(wall, *waypoints.shape)]


def walls_from(walls: Sequence[Walls], first: int, last: int) -> list[Walls]:
    """Return the walls of legs from ``first`` to before ``last``, counted from the first of them."""
    rest = []
    for wall in walls:
        own = (wall.leg >= first) & (wall.leg < last)
        if own.any():
            part = wall if own.all() else wall.chosen(own)
            rest.append(replace(part, leg=part.leg - first) if first else part)
    return rest


def _fits(wall: Walls, waypoints: int, dim: int) -> bool:
    """Whether there are any walls; raise CorridorError for those of other legs or dimensions, and of no width."""
    if not len(wall.leg):
        return False
    first, last = wall.leg.min(), wall.leg.max()
    if first < 0 or last > waypoints - 2:
        leg = first if first < 0 else last
        raise CorridorError(f"the {wall.name} has walls on leg {leg}: the legs are 0 to {waypoints - 2}")
    if wall.slope.shape[1] != dim:
        raise CorridorError(f"the {wall.name} has walls of {wall.slope.shape[1]} dimensions, the waypoints have {dim}")
    if not wall.width.min() > 0.0:
        raise CorridorError(f"the width of a wall of the {wall.name} is not positive")
    return True


def leg_scales(waypoints: FloatArray) -> FloatArray:
    """Length of each leg, the mean length if it is zero but for rounding: the scale of an excess over a plane [m]."""
    lengths = lengths_of(waypoints)
    mean = lengths.mean()
    lengths[lengths <= EXACT * mean] = mean or 1.0
    return lengths


def _checked(name: str, order: int, arrays: dict[str, ArrayLike], dims: tuple[int, ...]) -> list[FloatArray]:
    """Return arrays of walls as numbers, legs first and what must be positive last, or raise CorridorError."""
    if order not in range(DEGREES[-1] + 1):
        raise CorridorError(f"the order of the walls of the {name} must be a whole number from 0 to {DEGREES[-1]}")
    entries: list[FloatArray] = []
    for (what, values), ndim in zip(arrays.items(), dims, strict=True):
        array = numbers(values)
        if array is None or np.isnan(array).any():
            raise CorridorError(f"the {what} of a wall of the {name} is not a number")
        fitting = array.ndim == ndim and (not entries or len(array) == len(entries[0]))
        if not fitting or (len(entries) > 1 and ndim > 1 and array.shape[-1] != entries[1].shape[-1]):
            raise CorridorError(f"the {what} of the walls of the {name} has a shape that does not fit: {array.shape}")
        entries.append(array)
    if (entries[0] % 1.0).any():
        raise CorridorError(f"the leg of a wall of the {name} is not a whole number")
    if not (entries[-1] > 0.0).all():
        raise CorridorError(f"the {what} of a wall of the {name} is not positive")
    return entries
