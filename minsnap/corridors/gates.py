"""Waypoints that are regions: balls around a point, and gates (convex polygons to fly through)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.checks import check_array, check_distance
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.errors import WaypointError

if TYPE_CHECKING:
    from minsnap.corridors.gate_frames import Bar


@dataclass(frozen=True, eq=False)
class Ball(ReadOnly):
    """Waypoints are met if the curve passes within a distance.

    Parameters
    ----------
    radius : float or array_like, shape (n,)
        [m]: one for all inner waypoints (the ends stay pinned), or one per waypoint; 0 pins.

    Raises
    ------
    WaypointError
        If a radius is negative or not finite.
    """

    radius: FloatArray

    def __init__(self, radius: ArrayLike) -> None:
        values = _numbers(radius, "the radius of a ball")
        if values.ndim > 1 or (values < 0.0).any():
            raise WaypointError(
                f"the radius of a ball is {shown(radius)}: give one, or one per waypoint, not negative [m]"
            )
        set_fields(self, radius=values)

    def of_waypoints(self, count: int) -> FloatArray:
        """Radius around each of ``count`` waypoints, shape (count,) [m].

        Raises
        ------
        WaypointError
            If their number is another.
        """
        if self.radius.ndim and self.radius.shape != (count,):
            raise WaypointError(
                f"the ball has {len(self.radius)} radii: give one, or one for each of {count} waypoints"
            )
        radii = np.where(self.radius < SMALLEST, 0.0, self.radius) + np.zeros(count)
        if not self.radius.ndim:
            radii[[0, -1]] = 0.0
        return radii

    def __repr__(self) -> str:
        return f"Ball({self.radius.tolist()!r})"


@explains_names(
    {
        "heading": "normal=(cos(heading), sin(heading), 0)",
        "yaw": "normal=(cos(yaw), sin(yaw), 0)",
        "direction": "normal=, and crossing=1 where it is flown through along it",
        "size": "width= and height=",
    }
)
@dataclass(frozen=True, eq=False)
class Gate(ReadOnly):
    """A waypoint that is an opening: the curve meets its plane within it.

    If the next waypoint is on the same side, the shortest flight touches the plane and turns back: add one beyond it.

    Parameters
    ----------
    center : array_like, shape (3,) or (2,)
        [m].
    normal : array_like, shape (3,) or (2,)
        Perpendicular to the opening; any length.
    width : float
        Horizontal side [m]; in the plane the only one.
    height : float, optional
        The other side [m]; by default the width.
    up : array_like, shape (3,)
        Direction of the height; its component in the plane of the opening counts. By default z, or y for a level
        opening.
    crossing : {0, 1, -1}
        1: flown through along the normal; -1: against it; 0: either way.
    margin : float
        How far the curve stays from the edges [m], such as the radius of the vehicle.

    Attributes
    ----------
    corners : ndarray, shape (m, dim)
        Of the opening, in order [m].

    Raises
    ------
    WaypointError
        If a vector or a size is not one, or the margin leaves nothing of the opening around its center.
    """

    center: FloatArray
    normal: FloatArray
    corners: FloatArray
    crossing: int
    margin: float

    def __init__(
        self,
        center: ArrayLike,
        normal: ArrayLike,
        width: float,
        height: float | None = None,
        up: ArrayLike | None = None,
        crossing: int = 0,
        margin: float = 0.0,
    ) -> None:
        middle, axis = _numbers(center, "the center of a gate"), _numbers(normal, "the normal of a gate")
        if middle.shape not in ((2,), (3,)) or axis.shape != middle.shape:
            raise WaypointError(
                f"a gate has a center and a normal of 3 (or 2) coordinates, not {shown(center)} and {shown(normal)}"
            )
        sides = [_size(width, "width"), _size(width if height is None else height, "height")]
        axis = _unit(axis, "the normal of a gate")
        half = [side / 2.0 * along for side, along in zip(sides, _sides(axis, up), strict=False)]
        if len(middle) == 2:
            corners = np.array([middle - half[0], middle + half[0]])
        else:
            corners = np.array([middle + x * half[0] + y * half[1] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        self._fill(middle, axis, corners, crossing, margin)

    @classmethod
    def circle(
        cls,
        center: ArrayLike,
        normal: ArrayLike,
        radius: float,
        crossing: int = 0,
        margin: float = 0.0,
        count: int = 24,
    ) -> Gate:
        """Return the gate with a round opening: the regular polygon with ``count`` corners on it (24: 0.9 % inside).

        Raises
        ------
        WaypointError
            As ``Gate``.
        """
        square = cls(center, normal, 2.0 * _size(radius, "radius"), crossing=crossing)
        if len(square.center) == 2:
            return cls(center, normal, 2.0 * radius, crossing=crossing, margin=margin)
        across, up = (0.5 * (square.corners[k] - square.corners[0]) for k in (1, 3))
        angles = 2.0 * np.pi * np.arange(count) / count
        corners = square.center + np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * up
        return cls._of(square.center, square.normal, corners, crossing, margin)

    @classmethod
    def polygon(cls, corners: ArrayLike, crossing: int = 0, margin: float = 0.0) -> Gate:
        """Return the gate with these corners, (m, 3), in order: convex, in one plane.

        The normal is that about which they go round counter-clockwise; the center is the mean of the corners.

        Raises
        ------
        WaypointError
            If they are fewer than three, not in one plane or not convex.
        """
        points = _numbers(corners, "the corners of a gate")
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3:
            raise WaypointError(f"a polygon has at least three corners of 3 coordinates, not {points.shape}")
        middle = points.mean(axis=0)
        spokes = points - middle
        axis = _unit(np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0), "the area of a polygon")
        size = float(np.abs(spokes).max())
        if np.abs(spokes @ axis).max() > EXACT * size:
            raise WaypointError("the corners of a gate must lie in one plane")
        edges = np.roll(points, -1, axis=0) - points
        if (np.cross(edges, np.roll(edges, -1, axis=0)) @ axis <= 0.0).any():
            raise WaypointError(
                "the corners of a gate must go round a convex polygon, in order, none on a straight side"
            )
        return cls._of(middle, axis, points, crossing, margin)

    def moved(self, step: ArrayLike) -> Gate:
        """Return the same gate elsewhere; ``step`` is a vector (dim,) [m]."""
        shift = check_array("step", step, (self.center.shape,), "one number per axis [m]", WaypointError)
        return self._of(self.center + shift, self.normal, self.corners + shift, self.crossing, self.margin)

    def within(self, distance: float) -> Gate:
        """Return the same gate with a margin that is larger by a distance [m].

        Raises
        ------
        WaypointError
            If that leaves nothing of the opening around its center.
        """
        return self._of(
            self.center,
            self.normal,
            self.corners,
            self.crossing,
            self.margin + check_distance("the distance", distance, WaypointError),
        )

    def frame(
        self, bar: float, depth: float | None = None, clearance: float = 0.0, number: int | None = None
    ) -> tuple[Bar, ...]:
        """Return the four bars around a rectangular opening as obstacles for ``avoid=``.

        Parameters
        ----------
        bar : float
            How wide each bar is, from the opening outwards [m].
        depth : float, optional
            Of the frame along the normal, half of it on either side [m]; by default ``bar``.
        clearance : float
            By how much each bar is larger on all sides [m], such as the radius of the vehicle. The margin of the gate
            is at least as large, or the frame takes more of the opening than the margin.
        number : int, optional
            Which gate messages call it, such as the number of its waypoint.

        Raises
        ------
        WaypointError
            If a size is none, or the opening is no rectangle that stands upright or lies level.
        """
        from minsnap.corridors.gate_frames import bars_of

        deep = bar if depth is None else depth
        return bars_of(self.center, self.normal, self.corners, bar, deep, clearance, number)

    @classmethod
    def _of(cls, *fields: Any) -> Gate:
        """Return a gate of its fields: an opening that need not be a rectangle."""
        gate = object.__new__(cls)
        gate._fill(*fields)
        return gate

    def _fill(self, center: FloatArray, normal: FloatArray, corners: FloatArray, crossing: int, margin: float) -> None:
        if crossing not in (-1, 0, 1) or isinstance(crossing, bool):
            raise WaypointError(
                f"the crossing of a gate is {shown(crossing)}: 1 along its normal, -1 against it, 0 either way"
            )
        if (corners == np.roll(corners, 1, axis=0)).all(axis=1).any():
            raise WaypointError(
                f"two corners of a gate are both {corners[0].tolist()}: it is too small beside its place"
            )
        room = check_distance("the margin of a gate", margin, WaypointError)
        set_fields(self, center=center, normal=normal, corners=corners, crossing=int(crossing), margin=room)
        if self.margin and self.edges()[1].min() <= 0.0:
            room = float(self.edges()[1].min()) + self.margin
            raise WaypointError(
                f"the margin of a gate is {self.margin:g} m, and its nearest edge is {room:.4g} m from its center"
            )

    def edges(self) -> tuple[FloatArray, FloatArray]:
        """Outward unit normals in the plane, (m, dim), and how far the curve may be from the center, (m,) [m].

        That is the distance of each side, less the margin.
        """
        spokes = self.corners - self.center
        if len(self.center) == 2:
            lengths = np.linalg.norm(spokes, axis=1)
            return _snapped(spokes / lengths[:, None]), lengths - self.margin
        outward = np.cross(np.roll(spokes, -1, axis=0) - spokes, self.normal)
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        return _snapped(outward), np.asarray((outward * spokes).sum(axis=1) - self.margin)

    def __repr__(self) -> str:
        center, normal = (tuple(value.tolist()) for value in (self.center, self.normal))
        return f"Gate(center={center}, normal={normal}, corners={len(self.corners)}, crossing={self.crossing})"


def center_of(place: Any) -> Any:
    """Return the center of a gate; a point as it is."""
    return place.center if isinstance(place, Gate) else place


def _sides(axis: FloatArray, up: ArrayLike | None) -> Sequence[FloatArray]:
    """Return unit vectors along the width and the height of an opening."""
    if len(axis) == 2:
        return [np.array([-axis[1], axis[0]])]
    level = abs(axis[2]) > 1.0 - EXACT
    vertical = (0.0, 1.0, 0.0) if level else (0.0, 0.0, 1.0)
    upwards = check_array("up of a gate", vertical if up is None else up, ((3,),), "three coordinates", WaypointError)
    across = np.cross(upwards, axis)
    if hypot(*across) <= EXACT * hypot(*upwards):
        raise WaypointError(f"up of a gate is {shown(up)}, along its normal: give a direction in its plane")
    across = _snapped(across / hypot(*across))
    return [across, _snapped(np.cross(axis, across))]


def _unit(vector: FloatArray, what: str) -> FloatArray:
    size = hypot(*vector)
    if size == 0.0:
        raise WaypointError(f"{what} is zero: it has no direction")
    return _snapped(vector / size)


def _snapped(vectors: FloatArray) -> FloatArray:
    """Set components to zero that are only rounding."""
    return np.where(np.abs(vectors) <= ROUNDING, 0.0, vectors)


def _size(value: Any, what: str) -> float:
    number = _numbers(value, f"the {what} of a gate")
    if number.ndim or not number >= SMALLEST:
        raise WaypointError(f"the {what} of a gate is {shown(value)}: it must be positive [m]")
    return float(number)


def _numbers(values: Any, what: str) -> FloatArray:
    array = numbers(values)
    if array is None or not bounded(array).all():
        raise WaypointError(f"{what} must be finite numbers, not {shown(values)}")
    return array
