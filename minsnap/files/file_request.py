"""The question of a plan as files and pages say it: in plain numbers, of which equal ones are the same question."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from minsnap.corridors.boxes import Boxes, as_room
from minsnap.corridors.gates import Gate
from minsnap.corridors.keep_out import Avoided, named_obstacle
from minsnap.durations.search_options import Search
from minsnap.errors import WaypointError
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import completed
from minsnap.planning.request import PlanRequest, Walled, with_walls
from minsnap.vehicle.quadrotor import named_vehicle

if TYPE_CHECKING:
    from minsnap.vehicle.loop import Loop

Point = tuple[float, ...]
"""Coordinates [m]."""

Box = tuple[Point, Point]
"""Two opposite corners, the lower one first [m]."""

Heading = float | str | tuple[float, ...] | None
"""One angle, one for each waypoint [rad], or a rule: "velocity", "tilt", "free"."""


class Opening(NamedTuple):
    """A gate: which waypoint it takes the place of, its corners [m], its crossing, its margin [m]."""

    waypoint: int
    corners: tuple[Point, ...]
    crossing: int = 0
    margin: float = 0.0

    @classmethod
    def of(cls, waypoint: int, gate: Gate) -> Opening:
        """Return the opening of a gate."""
        return cls(waypoint, tuple(map(tuple, gate.corners.tolist())), gate.crossing, gate.margin)


@dataclass(frozen=True)
class FileRequest:
    """The question of :func:`minsnap.plan` in plain numbers, which :meth:`request` makes a value of the library.

    Parameters
    ----------
    waypoints : tuple of Point
        Positions [m]; a gate by its center.
    durations : tuple of float, or None
        Of each leg [s].
    limits : tuple of (name, value)
        Fields of :class:`~minsnap.Limits` in their units.
    corridor : tuple of float, or None
        Half-width of the tube around each leg [m].
    avoid : tuple of (name, numbers)
        What to keep out of, by the names of :func:`~minsnap.corridors.keep_out.named_obstacle`.
    boxes : tuple of Box, or None
        The box that each leg stays in, besides the corridor.
    room : Box or None
        The box that all legs stay in.
    openings : tuple of Opening
        Gates in the place of waypoints, which are their centers.
    rotors : float or None
        Keep the thrust of the rotors of ``vehicle`` within their range, less this reserve in [0, 1).
    vehicle : str
        Name of a preset: one of :data:`~minsnap.vehicle.quadrotor.VEHICLES`; empty for none.
    frame : str
        Axes in which the plan is to be written.
    tracking, wind : Loop and float, or None
        The vehicle's loop, which keeps all of it, and the largest change of the wind [m/s].
    total_time, continuity, degree, yaw, closed, solver, pieces, waypoint_tolerance, search
        As ``plan`` takes them.
    """

    waypoints: tuple[Point, ...]
    durations: tuple[float, ...] | None = None
    total_time: float | None = None
    limits: tuple[tuple[str, Any], ...] = ()
    corridor: tuple[float, ...] | None = None
    continuity: int | None = None
    degree: int = 7
    yaw: Heading = None
    closed: bool = False
    solver: str = "auto"
    pieces: int | Literal["auto"] | None = None
    waypoint_tolerance: float | None = None
    search: Search | None = None
    avoid: tuple[tuple[str, tuple[float, ...]], ...] = ()
    boxes: tuple[Box, ...] | None = None
    room: Box | None = None
    openings: tuple[Opening, ...] = ()
    rotors: float | None = None
    vehicle: str = ""
    frame: str = "enu"
    tracking: Loop | None = None
    wind: float | None = None

    @property
    def legs(self) -> int:
        """Number of legs between waypoints."""
        return len(self.waypoints) - 1

    @property
    def turns(self) -> tuple[float, ...]:
        """The heading at each waypoint [rad]; empty where one rule or number holds for all."""
        return self.yaw if isinstance(self.yaw, tuple) else ()

    def yaw_in(self, order: Sequence[int]) -> Heading:
        """Return the yaw for the waypoints in another order, with some left out or twice."""
        return tuple(self.turns[index] for index in order) if self.turns else self.yaw

    def as_lap(self) -> FileRequest:
        """Return the closed lap: waypoints that do not end where they begin go on to the first one again.

        The leg that is added has the half-width of the last one, unless there is one more already; durations are left
        out then.
        """
        if self.waypoints[0] == self.waypoints[-1]:
            return replace(self, closed=True)
        yaw = self.yaw_in([*range(len(self.waypoints)), 0])
        corridor = self.corridor
        if corridor is not None and len(corridor) <= self.legs:
            corridor = (*corridor, *corridor[-1:])
        points = (*self.waypoints, self.waypoints[0])
        return replace(self, waypoints=points, durations=None, yaw=yaw, corridor=corridor, closed=True)

    def within_ordinary(self) -> FileRequest:
        """Return the request within the limits of ordinary flight, unless a time, a price or a limit is set."""
        priced = self.search is not None and self.search.time_weight is not None
        if priced or any(value is not None for value in (self.durations, self.total_time, self.bounds)):
            return self
        return replace(self, limits=tuple(completed({}).items()))

    @property
    def places(self) -> tuple[Point, ...] | list[Point | Gate]:
        """Waypoints with gates in their places, as ``plan`` and ``certify`` take them.

        Raises
        ------
        WaypointError
            If a gate is malformed, or in the place of no waypoint.
        """
        if not self.openings:
            return self.waypoints
        places: list[Point | Gate] = list(self.waypoints)
        for index, corners, crossing, margin in self.openings:
            if not 0 <= index < len(places):
                raise WaypointError(f"a gate is in the place of waypoint {index}, and they go from 0 to {self.legs}")
            places[index] = Gate.polygon(corners, crossing, margin)
        return places

    @property
    def gates(self) -> dict[int, Gate]:
        """The gates of the openings, by the waypoints in whose place they are."""
        return {number: place for number, place in enumerate(self.places) if isinstance(place, Gate)}

    @property
    def walls(self) -> Walled:
        """Corridor, boxes and room together, as ``plan`` and ``certify`` take a corridor; None without any.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        boxes = [] if self.boxes is None else [Boxes(*zip(*self.boxes, strict=True))]
        widths: Walled = self.corridor
        if self.corridor is not None and len(self.corridor) == self.legs and len(set(self.corridor)) == 1:
            widths = self.corridor[0]  # the same for all legs
        walls: Walled = with_walls(widths, *boxes, *as_room(self.room))
        return walls

    @property
    def obstacles(self) -> tuple[Avoided, ...]:
        """The obstacles to keep out of.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        return tuple(named_obstacle(*each) for each in self.avoid)

    @property
    def bounds(self) -> Limits | None:
        """The limits, those of the rotors among them; None without any.

        Raises
        ------
        LimitError, VehicleError
            If they are no limits, or the rotors of no vehicle are to be kept within their range.
        """
        if self.rotors is not None:
            return Limits.of(named_vehicle(self.vehicle), self.rotors, **dict(self.limits))
        return Limits(**dict(self.limits)) if self.limits else None

    def request(self) -> PlanRequest:
        """Return the question of :func:`minsnap.plan`.

        Raises
        ------
        InputError
            If a wall, a gate or a limit is malformed.
        """
        alike = {name: value for name, value in vars(self).items() if name not in FILE_ONLY}
        made = {"waypoints": self.places, "limits": self.bounds, "corridor": self.walls, "avoid": self.obstacles}
        return PlanRequest(**alike | made)


FILE_ONLY = tuple({field.name for field in fields(FileRequest)} - {field.name for field in fields(PlanRequest)})
"""Fields that say in plain numbers what a :class:`~minsnap.planning.PlanRequest` has in others, or nothing of it."""
