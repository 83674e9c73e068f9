"""Bounds that hold on every leg: a room with floor and ceiling, and half-spaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, ReadOnly
from minsnap.corridors.boxes import as_numbers, check_bounds
from minsnap.corridors.constraint import Constraint, Faces, Walls
from minsnap.corridors.half_spaces import check_half_spaces
from minsnap.errors import CorridorError


@dataclass(frozen=True, eq=False)
class Room(ReadOnly):
    """One axis-aligned box for all legs.

    Parameters
    ----------
    lower, upper : array_like, shape (dim,)
        Opposite corners [m]; infinite where there is no wall, such as ``(-inf, -inf, 0)`` for a floor alone.

    Raises
    ------
    CorridorError
        If a bound is not a number or a lower one is not below its upper one; on use, if the waypoints have other
        coordinates.
    """

    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        lower, upper = check_bounds(self.lower, self.upper, ("room", "room", "(dim,)"), 1)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and axis, fewer where a bound is infinite."""
        _check_dim(len(self.lower), waypoints, "room")
        bounded = np.isfinite(self.lower) | np.isfinite(self.upper)
        legs, sides = len(waypoints) - 1, int(bounded.sum())
        lower, upper = np.tile(self.lower[bounded], legs), np.tile(self.upper[bounded], legs)
        normal = np.tile(np.eye(len(bounded))[bounded], (legs, 1))
        scale = np.repeat(leg_scales(waypoints), sides)
        width = np.where(np.isfinite(upper - lower), (upper - lower) / 2.0, scale)
        return [
            Faces(np.repeat(np.arange(legs), sides), normal, np.zeros(normal.shape), lower, upper, width, name="room")
        ]


@dataclass(frozen=True, eq=False)
class HalfSpaces(ReadOnly):
    r"""Half-spaces :math:`n^\top r \le c` of the position or of a derivative, each on all legs or on some.

    Parameters
    ----------
    normal : array_like, shape (m, dim) or (dim,)
        Pointing out of the half-space; only its direction matters to the curve, its length scales ``offset``.
    offset : array_like, shape (m,) or ()
        c, in metres for a normal of unit length.
    legs : sequence of int, optional
        Legs on which they hold; all unless given.
    order : int
        What is bounded: 0 the position, 1 the velocity (the offset in m/s), 2 the acceleration.

    Raises
    ------
    CorridorError
        If the arrays do not match, a normal is zero, an entry is not finite, or the order is another; on use, if a leg
        does not exist.
    """

    normal: FloatArray
    offset: FloatArray
    legs: tuple[int, ...] | None = None
    order: int = 0

    def __post_init__(self) -> None:
        if self.order not in (0, 1, 2):
            raise CorridorError(f"the order of half-spaces is {self.order!r}: give 0, 1 or 2")
        normal = np.atleast_2d(as_numbers(self.normal, "normals of the half-spaces"))
        offset = np.atleast_1d(as_numbers(self.offset, "offsets of the half-spaces"))
        normal.flags.writeable = offset.flags.writeable = False
        check_half_spaces(normal, offset, "the half-spaces")
        object.__setattr__(self, "normal", normal)
        object.__setattr__(self, "offset", offset)
        object.__setattr__(self, "legs", None if self.legs is None else tuple(int(leg) for leg in self.legs))

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return one plane for each leg and half-space."""
        _check_dim(self.normal.shape[1], waypoints, "half-spaces")
        legs = np.arange(len(waypoints) - 1) if self.legs is None else np.array(self.legs, dtype=np.intp)
        if ((legs < 0) | (legs >= len(waypoints) - 1)).any():
            raise CorridorError(f"half-spaces name legs {list(legs)}: there are legs 0 to {len(waypoints) - 2}")
        lengths = np.sqrt((self.normal * self.normal).sum(axis=1))
        leg = np.repeat(legs, len(lengths))
        normal, upper = (
            np.tile(self.normal / lengths[:, None], (len(legs), 1)),
            np.tile(self.offset / lengths, len(legs)),
        )
        lower, anchor = np.full(len(leg), -np.inf), np.zeros(normal.shape)
        return [Faces(leg, normal, anchor, lower, upper, leg_scales(waypoints)[leg], self.order, "half-space")]


def leg_scales(waypoints: FloatArray) -> FloatArray:
    """Length of each leg, the mean length if it is zero: the scale of an excess over a single plane [m]."""
    steps = np.diff(waypoints, axis=0)
    lengths = np.sqrt((steps * steps).sum(axis=1))
    lengths[lengths == 0.0] = lengths.mean() or 1.0
    return np.asarray(lengths)


def as_room(room: Room | Sequence[npt.ArrayLike] | None) -> list[Constraint]:
    """Convert the argument ``room`` to constraints: two corners become a ``Room``."""
    if room is None:
        return []
    if hasattr(room, "walls"):
        return [room]
    try:
        lower, upper = room
    except (TypeError, ValueError):
        raise CorridorError("room must be a Room or two corners, such as ((-4, -4, 0), (4, 4, 6))") from None
    return [Room(lower, upper)]  # type: ignore[arg-type]


def _check_dim(dim: int, waypoints: FloatArray, what: str) -> None:
    if dim != waypoints.shape[1]:
        raise CorridorError(f"the {what} has {dim} coordinates and the waypoints {waypoints.shape[1]}: give as many")
