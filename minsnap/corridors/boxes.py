"""Boxes of free space: one per leg, each overlapping the next, or one room for all legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.checks import SIZE, has_method
from minsnap.corridors.constraint import Constraint, Walls, leg_scales
from minsnap.errors import CorridorError

AXES = "xyz"


@dataclass(frozen=True, eq=False)
class Boxes(ReadOnly):
    """Axis-aligned boxes of free space: leg i stays in box i.

    Parameters
    ----------
    lower, upper : array_like, shape (legs, dim)
        Opposite corners [m]; finite, every upper bound above its lower one, every box overlapping the next.

    Raises
    ------
    CorridorError
        If a bound is not finite, a box has no volume, or a box and the next have no volume in common; on use, if the
        number of boxes is not that of the legs.
    """

    lower: FloatArray
    upper: FloatArray

    def __init__(self, lower: ArrayLike, upper: ArrayLike) -> None:
        low, high = check_bounds(lower, upper, "boxes", 2)
        endless = np.argwhere(~np.isfinite(low) | ~np.isfinite(high))
        if len(endless):
            box, axis = endless[0]
            raise CorridorError(f"box {box} is unbounded along {axis_name(axis)}: bound it, or use HalfSpaces or Room")
        _refuse_apart(*_common(low, high), low, high)
        set_fields(self, lower=low, upper=high)

    def __len__(self) -> int:
        return len(self.lower)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and axis."""
        check_legs(len(self), self.lower.shape[1], waypoints, "boxes")
        return [box_faces(self.lower, self.upper, leg_scales(waypoints), "box")]

    def passages(self, closed: bool = False) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the overlap of each box with the next: its center and its two corners, each (legs - 1, dim) [m].

        Parameters
        ----------
        closed : bool
            The overlap of the last box with the first one comes first, then there are as many as legs.

        Raises
        ------
        CorridorError
            If it is closed, and the last box does not overlap the first.
        """
        lower, upper = self.lower, self.upper
        if closed:
            order = np.concatenate(([-1], np.arange(len(self))))
            lower, upper = lower[order], upper[order]
            if (np.maximum(lower[0], lower[1]) >= np.minimum(upper[0], upper[1])).any():
                raise CorridorError(
                    f"closed=True needs box {len(self) - 1}, the last one, to overlap box 0: append a box that does"
                )
        low, high = _common(lower, upper)
        return (low + high) / 2.0, low, high


def box_faces(lower: FloatArray, upper: FloatArray, scale: FloatArray, name: str) -> Walls:
    """Return two planes for each leg and axis, none where both bounds are infinite.

    Parameters
    ----------
    lower, upper : ndarray, shape (legs, dim)
        [m].
    scale : ndarray, shape (legs,)
        Width where a bound is infinite [m].
    name : str
    """
    leg, axis = np.nonzero(np.isfinite(lower) | np.isfinite(upper))
    low, high = lower[leg, axis], upper[leg, axis]
    normal = np.eye(lower.shape[1])[axis]
    width = np.where(np.isfinite(high - low), (high - low) / 2.0, scale[leg])
    return Walls.pairs(leg, normal, np.zeros(normal.shape), low, high, width, 0, name)


def check_bounds(lower: ArrayLike, upper: ArrayLike, what: str, ndim: int) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds as read-only arrays with ``ndim`` axes, possibly infinite.

    Raises
    ------
    CorridorError
        If they are not numbers, of another shape, or a lower bound is not below its upper one.
    """
    low, high = as_numbers(lower, f"lower bounds of the {what}"), as_numbers(upper, f"upper bounds of the {what}")
    if low.ndim != ndim or low.shape != high.shape or 0 in low.shape:
        raise CorridorError(
            f"the lower and upper bounds of the {what} have shapes {low.shape} and {high.shape}: "
            f"give both the shape {'(boxes, dim)' if ndim == 2 else '(dim,)'}"
        )
    far = np.argwhere(~(bounded(low) | np.isinf(low)) | ~(bounded(high) | np.isinf(high)))
    wrong = np.argwhere(~(low < high))
    if len(far) and not len(wrong):
        raise CorridorError(f"the bounds of the {what} are numbers {SIZE}, or infinite: one is beyond")
    if len(wrong):
        place = tuple(wrong[0])
        which = f"box {place[0]}" if ndim == 2 else f"the {what}"
        raise CorridorError(
            f"{which} runs from {low[place]:g} to {high[place]:g} along {axis_name(place[-1])}: "
            "its lower bound must be a number below its upper bound"
        )
    return low, high


def as_numbers(value: ArrayLike, what: str) -> FloatArray:
    """Return a read-only float64 copy, or raise CorridorError."""
    array = numbers(value)
    if array is None:
        raise CorridorError(f"the {what} must be numbers [m], all rows equally long")
    return array


def axis_name(axis: int) -> str:
    """Return x, y, z, or the number of the axis."""
    return AXES[axis] if axis < len(AXES) else str(axis)


def check_legs(count: int, dim: int, waypoints: FloatArray, what: str) -> None:
    """Raise CorridorError unless there is one of the sets for each leg, of as many coordinates."""
    check_dim(dim, waypoints, "corridor")
    legs = len(waypoints) - 1
    if count != legs:
        raise CorridorError(f"the corridor has {count} {what} for {legs} legs: give one per leg")


def check_dim(dim: int, waypoints: FloatArray, what: str) -> None:
    """Raise CorridorError unless waypoints have as many coordinates."""
    if dim != waypoints.shape[1]:
        raise CorridorError(f"the {what} has {dim} coordinates and the waypoints {waypoints.shape[1]}: give as many")


def _common(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corners of the overlap of each box with the next."""
    return np.maximum(lower[:-1], lower[1:]), np.minimum(upper[:-1], upper[1:])


def _refuse_apart(low: FloatArray, high: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
    apart = np.argwhere(low >= high)
    if not len(apart):
        return
    box, axis = (int(i) for i in apart[0])
    how = "only touch" if low[box, axis] == high[box, axis] else "do not overlap"
    ranges = " and ".join(f"from {lower[b, axis]:g} to {upper[b, axis]:g}" for b in (box, box + 1))
    raise CorridorError(
        f"boxes {box} and {box + 1} {how}: along {axis_name(axis)} they run {ranges}; they need a volume in common",
        leg=box,
    )


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

    def __init__(self, lower: ArrayLike, upper: ArrayLike) -> None:
        low, high = check_bounds(lower, upper, "room", 1)
        set_fields(self, lower=low, upper=high)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and axis, fewer where a bound is infinite."""
        check_dim(len(self.lower), waypoints, "room")
        legs = len(waypoints) - 1
        lower, upper = np.tile(self.lower, (legs, 1)), np.tile(self.upper, (legs, 1))
        return [box_faces(lower, upper, leg_scales(waypoints), "room")]


def as_room(room: Room | Sequence[ArrayLike] | None) -> list[Constraint]:
    """Convert the argument ``room`` to constraints: two corners become a ``Room``."""
    if room is None:
        return []
    if has_method(room, "walls"):
        return [room]  # type: ignore[list-item]
    try:
        lower, upper = room  # type: ignore[misc]
    except (TypeError, ValueError):
        raise CorridorError("room must be a Room or two corners, such as ((-4, -4, 0), (4, 4, 6))") from None
    return [Room(lower, upper)]
