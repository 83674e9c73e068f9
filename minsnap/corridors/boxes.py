"""Boxes: a sequence of axis-aligned boxes, one per leg, each overlapping the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, ReadOnly, numbers
from minsnap.corridors.constraint import Faces, Walls
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

    def __post_init__(self) -> None:
        lower, upper = check_bounds(self.lower, self.upper, ("boxes", "box", "(boxes, dim)"), 2)
        _refuse_infinite(lower, upper)
        _refuse_apart(*_common(lower, upper), lower, upper)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def __len__(self) -> int:
        return len(self.lower)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and axis."""
        check_legs(len(self), self.lower.shape[1], waypoints, "boxes")
        legs, dim = self.lower.shape
        lower, upper = self.lower.reshape(-1), self.upper.reshape(-1)
        normal = np.tile(np.eye(dim), (legs, 1))
        leg = np.repeat(np.arange(legs), dim)
        return [Faces(leg, normal, np.zeros((legs * dim, dim)), lower, upper, (upper - lower) / 2.0, name="box")]

    def passages(self, closed: bool = False) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the overlap of each box with the next: its centre and its two corners, each (legs - 1, dim) [m].

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


def check_bounds(
    lower: npt.ArrayLike, upper: npt.ArrayLike, names: tuple[str, str, str], ndim: int
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds as read-only arrays, each upper one above its lower one.

    Parameters
    ----------
    lower, upper : array_like
        Of the same shape, possibly infinite.
    names : tuple of str
        What they are called, what one of them is called, and the shape to ask for.
    ndim : int
        Number of dimensions that the arrays must have.

    Raises
    ------
    CorridorError
        If they are not numbers, of another shape, or a lower bound is not below its upper one.
    """
    low, high = (
        as_numbers(lower, f"lower bounds of the {names[0]}"),
        as_numbers(upper, f"upper bounds of the {names[0]}"),
    )
    if low.ndim != ndim or low.shape != high.shape or 0 in low.shape:
        raise CorridorError(
            f"the {names[0]} have lower bounds of shape {low.shape} and upper bounds of shape {high.shape}: "
            f"give both the shape {names[2]}"
            if ndim > 1
            else f"the {names[0]} has corners of shape {low.shape} and {high.shape}: give both the shape {names[2]}"
        )
    wrong = np.argwhere(np.isnan(low) | np.isnan(high) | ~(low < high))
    if len(wrong):
        _refuse_bounds(low, high, tuple(int(i) for i in wrong[0]), names[1])
    return low, high


def as_numbers(value: npt.ArrayLike, what: str) -> FloatArray:
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
    legs = len(waypoints) - 1
    if dim != waypoints.shape[1]:
        raise CorridorError(f"the {what} have {dim} coordinates and the waypoints {waypoints.shape[1]}")
    if count != legs:
        raise CorridorError(f"the corridor has {count} {what} for {legs} legs: give one per leg")


def _refuse_bounds(low: FloatArray, high: FloatArray, place: tuple[int, ...], name: str) -> None:
    below, above, axis = low[place], high[place], axis_name(place[-1])
    which = f"{name} {place[0]}" if len(place) > 1 else f"the {name}"
    if np.isnan(below) or np.isnan(above):
        raise CorridorError(f"{which} runs from {below:g} to {above:g} along {axis}: every bound must be a number")
    if below > above:
        raise CorridorError(
            f"{which} has its lower bound {below:g} above its upper bound {above:g} along {axis}: exchange them"
        )
    raise CorridorError(f"{which} has no volume: along {axis} it begins and ends at {below:g}; widen it")


def _refuse_infinite(lower: FloatArray, upper: FloatArray) -> None:
    wrong = np.argwhere(~np.isfinite(lower) | ~np.isfinite(upper))
    if len(wrong):
        box, axis = wrong[0]
        raise CorridorError(f"box {box} is unbounded along {axis_name(axis)}: bound it, or use HalfSpaces or Room")


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
