"""Half-spaces of the position or of a derivative, on all legs or on some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, FloatArray, IntArray, ReadOnly, bounded, set_fields
from minsnap.basics.checks import is_whole
from minsnap.basics.messages import shown
from minsnap.corridors.boxes import as_numbers, check_dim
from minsnap.corridors.constraint import Walls, leg_scales
from minsnap.errors import CorridorError


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
        Legs on which they hold; by default all.
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
        if not (is_whole(self.order) and self.order in (0, 1, 2)):
            raise CorridorError(f"the order of half-spaces is {shown(self.order)}: give 0, 1 or 2")
        normal, offset = half_space_rows(self.normal, self.offset, "the half-spaces")
        set_fields(self, normal=normal, offset=offset, order=int(self.order), legs=_legs(self.legs))

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return one plane for each leg and half-space."""
        check_dim(self.normal.shape[1], waypoints, "normal of the half-spaces")
        legs = np.arange(len(waypoints) - 1) if self.legs is None else np.array(self.legs, dtype=np.intp)
        if ((legs < 0) | (legs >= len(waypoints) - 1)).any():
            raise CorridorError(f"half-spaces name legs {legs.tolist()}: there are legs 0 to {len(waypoints) - 2}")
        normal, offset = of_unit_length(self.normal, self.offset)
        leg = np.repeat(legs, len(offset))
        normal, offset = np.tile(normal, (len(legs), 1)), np.tile(offset, len(legs))
        return [one_sided(leg, normal, offset, leg_scales(waypoints)[leg], self.order, "half-space")]


def _legs(legs: Any) -> tuple[int, ...] | None:
    """Return the numbers of legs, or raise CorridorError."""
    if legs is None:
        return None
    try:
        named = list(legs)
        good = not isinstance(legs, str) and all(is_whole(leg) and abs(int(leg)) < 2**31 for leg in named)
    except TypeError:
        good = False
    if not good:
        raise CorridorError(f"the legs of half-spaces are {shown(legs)}: give whole numbers, such as [0, 2]")
    return tuple(map(int, named))


def half_space_rows(normal: Any, offset: Any, what: str) -> tuple[FloatArray, FloatArray]:
    """Return normals (m, dim) and offsets (m,), read-only, or raise CorridorError.

    Raises
    ------
    CorridorError
        Unless they are finite numbers, as many offsets as normals, and no normal is zero.
    """
    normals = np.atleast_2d(as_numbers(normal, f"normals of {what}"))
    offsets = np.atleast_1d(as_numbers(offset, f"offsets of {what}"))
    if normals.ndim != 2 or 0 in normals.shape or offsets.shape != (len(normals),):
        raise CorridorError(
            f"the normals of {what} have shape {normals.shape} and the offsets {offsets.shape}: give (m, dim) and (m,)"
        )
    wrong = ~(bounded(normals).all(axis=1) & bounded(offsets))
    if wrong.any():
        raise CorridorError(f"row {int(np.argmax(wrong))} of {what} is not finite: every entry must be a finite number")
    flat = ~(np.abs(normals) >= SMALLEST).any(axis=1)
    if flat.any():
        raise CorridorError(
            f"row {int(np.argmax(flat))} of {what} has a normal of zeros: it has no direction; remove it"
        )
    return normals, offsets


def of_unit_length(normal: FloatArray, offset: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the same half-spaces with normals of unit length."""
    lengths = np.sqrt((normal * normal).sum(axis=1))
    return normal / lengths[:, None], offset / lengths


def one_sided(leg: IntArray, normal: FloatArray, upper: FloatArray, width: FloatArray, order: int, name: str) -> Walls:
    """Return the planes normal . derivative <= upper, each on one leg; arrays as of ``Walls.planes``."""
    return Walls.planes(leg, normal, np.zeros(normal.shape), np.full(len(leg), -np.inf), upper, width, order, name)
