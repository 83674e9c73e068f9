"""A room with floor and ceiling: one box for all legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly
from minsnap.corridors.boxes import box_faces, check_bounds, check_dim
from minsnap.corridors.constraint import Constraint, Walls, leg_scales
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
        lower, upper = check_bounds(self.lower, self.upper, "room", 1)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and axis, fewer where a bound is infinite."""
        check_dim(len(self.lower), waypoints, "room")
        legs = len(waypoints) - 1
        lower, upper = np.tile(self.lower, (legs, 1)), np.tile(self.upper, (legs, 1))
        return [box_faces(lower, upper, leg_scales(waypoints), "room")]


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
