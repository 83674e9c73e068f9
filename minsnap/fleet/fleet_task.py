"""The question of a fleet, checked, as the joint search takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import cos, inf, sin

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.keep_out import Obstacle
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Separation
from minsnap.limits.limits import Limits
from minsnap.native.joint_fleet import KINDS, ORDERS
from minsnap.trajectory.path import Path

INWARDS = 0.004
"""Share of the separation by which walls are moved inwards for the search: what lies between samples takes the rest."""

CROWDED = 0.85
"""How much shorter pieces at the ends are than those between: 0 for equal ones, below 1."""

PLAIN = ("speed", "acceleration", "jerk", "snap")


@dataclass(frozen=True, eq=False)
class FleetTask:
    """The question of vehicles that fly at once.

    Parameters
    ----------
    waypoints : tuple of ndarray, shape (n_i, 3)
        Of each vehicle that is planned [m].
    states : tuple of mapping
        Of each: derivatives at the start, by order.
    limits : tuple of Limits or None
        Of each; None where only a total time is set.
    separation : Separation or None
    room : Room or None
    avoid : tuple of Obstacle
    fixed : tuple of Path
        Vehicles that fly as they do.
    corridors : tuple of Boxes or None
        Of each vehicle that is planned; empty for none.
    holds : tuple of ndarray, shape (n_i,), or None
        Of each vehicle: how long it rests at its waypoints at least [s]; empty for none.
    total_time : float or None
        Of all [s].
    """

    waypoints: tuple[FloatArray, ...]
    states: tuple[Mapping[int, FloatArray], ...]
    limits: tuple[Limits, ...] | None
    separation: Separation | None
    room: Room | None
    avoid: tuple[Obstacle, ...]
    fixed: tuple[Path, ...]
    corridors: tuple[Boxes | None, ...] = ()
    holds: tuple[FloatArray | None, ...] = ()
    total_time: float | None = None

    def __len__(self) -> int:
        return len(self.waypoints)

    @cached_property
    def starts(self) -> FloatArray:
        """First waypoints, shape (m, 3) [m]."""
        return np.stack([points[0] for points in self.waypoints])

    @cached_property
    def goals(self) -> FloatArray:
        """Last waypoints, shape (m, 3) [m]."""
        return np.stack([points[-1] for points in self.waypoints])

    @property
    def free_time(self) -> bool:
        """Whether curves can be slowed down as a whole: nobody moves at the start, and nobody flies as he does."""
        return not self.fixed and not any(map(self.moves, range(len(self))))

    def moves(self, vehicle: int) -> bool:
        """Return whether a vehicle has another state than rest at the start."""
        return any(each.any() for each in self.states[vehicle].values())

    def holds_of(self, vehicle: int) -> FloatArray:
        """Return how long a vehicle rests at its waypoints at least, shape (n_i,) [s]."""
        own = self.holds[vehicle] if self.holds else None
        return np.zeros(len(self.waypoints[vehicle])) if own is None else own

    @property
    def through(self) -> bool:
        """Whether some vehicle has waypoints between its first and its last."""
        return any(len(points) > 2 for points in self.waypoints)

    @cached_property
    def radii(self) -> FloatArray:
        """Half the separation of each vehicle, the fixed ones last [m]."""
        count = len(self) + len(self.fixed)
        return np.full(count, 1e-9) if self.separation is None else self.separation.radii_of(count)

    @cached_property
    def length(self) -> float:
        """Unit of distances from walls: the least separation, or a share of the way [m]."""
        if self.separation is not None:
            return float(2.0 * self.radii.min())
        return float(0.05 * max(way_of(points) for points in self.waypoints) or 1.0)

    def walls(self, pieces: int) -> FloatArray:
        """Return the bounds of each piece, shape (m, pieces, 2, 3), the fixed vehicles' infinite [m]."""
        walls = np.empty((len(self) + len(self.fixed), pieces, 2, 3))
        walls[:, :, 0], walls[:, :, 1] = -inf, inf
        inwards = INWARDS * self.length
        if self.room is not None:
            walls[: len(self), :, 0], walls[: len(self), :, 1] = self.room.lower, self.room.upper
        for vehicle, boxes in enumerate(self.corridors):
            if boxes is not None:
                leg = self.legs_of(vehicle, pieces)
                walls[vehicle, :, 0] = np.maximum(walls[vehicle, :, 0], boxes.lower[leg])
                walls[vehicle, :, 1] = np.minimum(walls[vehicle, :, 1], boxes.upper[leg])
        for vehicle, points in enumerate(self.waypoints):  # a waypoint may lie on a wall
            walls[vehicle, :, 0] = np.minimum(walls[vehicle, :, 0] + inwards, points.min(axis=0))
            walls[vehicle, :, 1] = np.maximum(walls[vehicle, :, 1] - inwards, points.max(axis=0))
        return walls

    def legs_of(self, vehicle: int, pieces: int) -> IntArray:
        """Return the leg of each piece of a vehicle, shape (pieces,)."""
        knots = self.knots_of(vehicle, pieces)[:, 0]
        knots[-1] = pieces
        return np.asarray(np.repeat(np.arange(len(knots) - 1), np.diff(knots)))

    def knots_of(self, vehicle: int, pieces: int) -> IntArray:
        """Return the knots at which a vehicle arrives at each waypoint and leaves it, shape (n_i, 2).

        Arrivals go by the length of the way, and each leg has at least one piece. Holds last their seconds in the least
        time that the fleet can take, and longer in longer ones.
        """
        points, holds = self.waypoints[vehicle], self.holds_of(vehicle)
        holds = holds / max(self.total_time or float(self.bounds.max()), 1e-12) if holds.any() else holds
        steps = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
        way = np.concatenate(([0.0], np.cumsum(steps))) / max(way_of(points), 1e-12) * (1.0 - holds.sum())
        instants, knots = knot_shares(pieces), [(0, int(np.searchsorted(knot_shares(pieces), holds[0] - 1e-12)))]
        for index in range(1, len(points)):
            least, most = knots[-1][1] + 1, pieces - (len(points) - 1 - index)
            arrives = min(max(int(np.argmin(np.abs(instants - way[index] - holds[:index].sum()))), least), most)
            leaves = int(np.searchsorted(instants, instants[arrives] + holds[index] - 1e-12))
            knots.append((arrives, leaves))
        last = int(np.searchsorted(instants, 1.0 - holds[-1] + 1e-12, side="right")) - 1
        knots[-1] = (last, pieces)
        indices = np.array(knots)
        if (indices[1:, 0] <= indices[:-1, 1]).any():
            raise FleetError(f"the holds of vehicle {vehicle} leave too few pieces to fly: give pieces={2 * pieces}")
        return indices

    @cached_property
    def limit_table(self) -> FloatArray:
        """Limits of velocity to snap: three axes, norm, norm of x and y, shape (m, 4, 5); infinite for none."""
        table = np.full((len(self) + len(self.fixed), ORDERS, KINDS), inf)
        for vehicle, own in enumerate(self.limits or ()):
            table[vehicle] = table_of(own)
        return table

    def bound_of(self, vehicle: int) -> float:
        """Return the least time within the speed and acceleration limits: a trapezoid along the way [s]."""
        steps = np.diff(self.waypoints[vehicle], axis=0)
        table, at_rest = self.limit_table[vehicle], not self.moves(vehicle)
        ways = [*np.abs(steps).sum(axis=0), np.sqrt((steps * steps).sum(axis=1)).sum()]
        ways.append(np.sqrt((steps[:, :2] ** 2).sum(axis=1)).sum())
        both = zip(ways, table[0], table[1], strict=True)
        flying = max(_trapezoid(float(way), float(v), float(a) if at_rest else inf) for way, v, a in both)
        return flying + float(self.holds_of(vehicle).sum())

    @cached_property
    def bounds(self) -> FloatArray:
        """Least time of each vehicle that is planned, shape (m,) [s]."""
        return np.array([self.bound_of(vehicle) for vehicle in range(len(self))])


def way_of(points: FloatArray) -> float:
    """Return the straight length through waypoints [m]."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def knot_shares(pieces: int) -> FloatArray:
    """Return the instants of knots in units of the flight time: pieces are shorter at the ends, where speeds change."""
    x = np.arange(pieces + 1) / pieces
    return np.asarray((1.0 - CROWDED) * x + CROWDED * x * x * (3.0 - 2.0 * x))


def table_of(limits: Limits) -> FloatArray:
    """Return limits of one vehicle, shape (4, 5); those on thrust, tilt and body rate by what implies them."""
    table = np.full((ORDERS, KINDS), inf)
    for order, name in enumerate(PLAIN):
        value = getattr(limits, name)
        if value is not None:
            table[order, : 3 if limits.norm == "axis" else 0] = value
            table[order, 3] = inf if limits.norm == "axis" else value
    values = limits.given()
    for order, name in enumerate(PLAIN[:2]):
        table[order, 4] = values.get(f"horizontal_{name}", inf)
        table[order, 2] = min(table[order, 2], values.get(f"vertical_{name}", inf))
    table[0, 2] = min(table[0, 2], values.get("climb_speed", inf), values.get("descent_speed", inf))
    _add_thrust(table, values, limits.gravity)
    return table


def _add_thrust(table: FloatArray, values: Mapping[str, float], gravity: float) -> None:
    """Lower the acceleration so that thrust and tilt are kept, and the jerk so that body rates are."""
    room = [gravity * (values["max_thrust"] - 1.0)] if "max_thrust" in values else []
    room += [gravity * (1.0 - values["min_thrust"])] if "min_thrust" in values else []
    room += [gravity * sin(values["tilt"])] if "tilt" in values else []
    table[1, 3] = min([table[1, 3], *room])
    if "body_rate" in values:
        table[1, 3] = min(table[1, 3], gravity * cos(1.0))
        table[2, 3] = min(table[2, 3], values["body_rate"] * (gravity - table[1, 3]))


def _trapezoid(way: float, speed: float, acceleration: float) -> float:
    """Return the least time from rest to rest over a way [s]."""
    if way == 0.0:
        return 0.0
    if acceleration == inf:
        return way / speed
    if speed == inf or way * acceleration < speed * speed:
        return float(2.0 * np.sqrt(way / acceleration))
    return way / speed + speed / acceleration
