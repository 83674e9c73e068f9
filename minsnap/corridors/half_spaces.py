r"""Half-spaces on all legs or on some, and polytopes, convex sets :math:`A r \le b` that overlap, one per leg."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, IntArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.checks import check_number, is_whole
from minsnap.basics.messages import shown
from minsnap.corridors.boxes import as_numbers, axis_name, check_dim, check_legs
from minsnap.corridors.constraint import Walls, leg_scales
from minsnap.errors import CorridorError
from minsnap.native.half_space_sets import HalfSpaceRows, bounding_boxes, flatness, inner_balls


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

    def __init__(self, normal: ArrayLike, offset: ArrayLike, legs: Sequence[int] | None = None, order: int = 0) -> None:
        which = check_number("the order of half-spaces", order, 0, 2, "give 0, 1 or 2", CorridorError, whole=True)
        normals, offsets = half_space_rows(normal, offset, "the half-spaces")
        set_fields(self, normal=normals, offset=offsets, order=which, legs=_legs(legs))

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
    """Return the same half-spaces (m, dim), (m,) with normals of unit length.

    Raises
    ------
    CorridorError
        If they are malformed.
    """
    rows, ends = numbers(normal, copy=False), numbers(offset, copy=False)
    if rows is None or ends is None or rows.ndim != 2 or ends.shape != rows.shape[:1]:
        raise CorridorError(f"half-spaces are {shown(normal)}, {shown(offset)}: give arrays (m, dim) and (m,)")
    normal, offset = rows, ends
    lengths = np.sqrt((normal * normal).sum(axis=1))
    return normal / lengths[:, None], offset / lengths


def one_sided(leg: IntArray, normal: FloatArray, upper: FloatArray, width: FloatArray, order: int, name: str) -> Walls:
    """Return the planes normal . derivative <= upper, each on one leg, of arrays of their own as of ``Walls.pairs``."""
    none = np.zeros((len(leg), 0, normal.shape[1]))
    return Walls.unchecked(leg, none, np.zeros(normal.shape), -normal, upper, width, order, name)


@dataclass(frozen=True, eq=False)
class Polytopes(ReadOnly):
    r"""Convex polytopes of free space: leg i stays in :math:`A_i r \le b_i`.

    Parameters
    ----------
    half_spaces : sequence of (array_like of shape (m, dim), array_like of shape (m,))
        A and b of each leg [m]; rows need not be normalised. A polytope may be unbounded; those that the curve finds
        its own way through (``waypoints=None``) must have bounded overlaps.

    Raises
    ------
    CorridorError
        If an entry is malformed, a polytope has no interior, or a polytope and the next have no volume in common; on
        use, if the number of polytopes is not that of the legs.
    """

    half_spaces: Sequence[Any]
    radius: FloatArray = field(init=False)
    middles: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.half_spaces, (list, tuple)) or not len(self.half_spaces):
            raise CorridorError("polytopes are a list of pairs (A, b) with A r <= b, one pair per leg")
        rows = tuple(_checked(entry, index) for index, entry in enumerate(self.half_spaces))
        dims = [A.shape[1] for A, _ in rows]
        for index, dim in enumerate(dims):
            if dim != dims[0]:
                raise CorridorError(f"polytope {index} has {dim} coordinates and polytope 0 has {dims[0]}")
        radius = inner_balls(rows)[1]
        for index, (entry, size) in enumerate(zip(rows, radius, strict=True)):
            if size < -flatness(entry):
                raise CorridorError(f"polytope {index} is empty: its rows miss each other by {-size:g} m", leg=index)
            if size <= flatness(entry):
                raise CorridorError(f"polytope {index} has no interior: its rows leave no volume; widen it", leg=index)
        middles = _middles([_stacked(a, b) for a, b in zip(rows[:-1], rows[1:], strict=True)], rows[0][0].shape[1])
        set_fields(self, half_spaces=rows, radius=radius, middles=middles)

    def __len__(self) -> int:
        return len(self.half_spaces)

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return one plane for each row; the scale is the inner ball's radius, at most the leg's length."""
        check_legs(len(self), self.half_spaces[0][0].shape[1], waypoints, "polytopes")
        leg = np.repeat(np.arange(len(self)), [len(b) for _, b in self.half_spaces])
        normal, upper = (np.concatenate(part) for part in zip(*self.half_spaces, strict=True))
        width = np.minimum(self.radius, leg_scales(waypoints))[leg]
        return [one_sided(leg, normal, upper, width, 0, "polytope")]

    def passages(self, closed: bool = False) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the overlap of each polytope with the next: center of its inner ball, corners of its bounding box.

        Parameters
        ----------
        closed : bool
            The overlap of the last polytope with the first one comes first.

        Returns
        -------
        center, lower, upper : ndarray, shape (legs - 1, dim), or (legs, dim) if closed [m]

        Raises
        ------
        CorridorError
            If an overlap is unbounded, or it is closed and the last polytope does not overlap the first.
        """
        pairs = [(i, i + 1) for i in range(len(self) - 1)]
        pairs = [(len(self) - 1, 0), *pairs] if closed else pairs
        common = [_stacked(self.half_spaces[i], self.half_spaces[j]) for i, j in pairs]
        if not common:
            return (self.middles,) * 3
        center = self.middles
        if closed:
            seam, radius = inner_balls(common[:1])
            if radius[0] <= flatness(common[0]):
                raise CorridorError(f"polytopes {len(self) - 1} and 0 do not overlap: a closed lap needs that")
            center = np.concatenate((seam, center))
        lower, upper = bounding_boxes(common)
        _refuse_unbounded(lower, upper, pairs)
        return center, lower, upper


def _stacked(first: HalfSpaceRows, second: HalfSpaceRows) -> HalfSpaceRows:
    return np.concatenate((first[0], second[0])), np.concatenate((first[1], second[1]))


def _checked(entry: Any, index: int) -> HalfSpaceRows:
    what = f"polytope {index}"
    if not isinstance(entry, (list, tuple)) or len(entry) != 2:
        raise CorridorError(f"{what} is not a pair (A, b) with A r <= b")
    A, b = of_unit_length(*half_space_rows(entry[0], entry[1], what))
    A.flags.writeable = b.flags.writeable = False
    return A, b


def _middles(common: Sequence[HalfSpaceRows], dim: int) -> FloatArray:
    """Return the centers of the inner balls of overlaps, (m, dim); refuse polytopes that do not overlap."""
    if not common:
        return np.zeros((0, dim))
    centers, radii = inner_balls(common)
    for index, (entry, size) in enumerate(zip(common, radii, strict=True)):
        if size <= flatness(entry):
            how = "only touch" if size >= -flatness(entry) else "do not overlap"
            raise CorridorError(
                f"polytopes {index} and {index + 1} {how}: they need a volume in common for the curve to pass",
                leg=index,
            )
    return centers


def _refuse_unbounded(lower: FloatArray, upper: FloatArray, pairs: Sequence[tuple[int, int]]) -> None:
    wrong = np.argwhere(~np.isfinite(lower) | ~np.isfinite(upper))
    if len(wrong):
        index, axis = wrong[0]
        raise CorridorError(
            f"the overlap of polytopes {pairs[index][0]} and {pairs[index][1]} is unbounded along "
            f"{axis_name(int(axis))}: bound it, or give waypoints"
        )
