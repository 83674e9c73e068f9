"""The question of a plan as one value, which ``plan`` makes of its arguments, and files, pages and commands fill."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from minsnap.basics.messages import shown
from minsnap.corridors.boxes import Boxes, as_room
from minsnap.corridors.gates import Gate
from minsnap.corridors.keep_out import Avoided, as_obstacles, named_obstacle
from minsnap.durations.search_options import Search
from minsnap.errors import WaypointError, YawError
from minsnap.trajectory.velocity_heading import Velocity

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

Point = tuple[float, ...]
"""Coordinates [m]."""

Box = tuple[Point, Point]
"""Two opposite corners, the lower one first [m]."""

RESERVE = 0.1
"""Share of the rotors' room that is left to feedback unless told otherwise."""


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


PLAIN = ("boxes", "room", "openings", "rotors", "vehicle", "frame")
"""Fields of a request that say in plain numbers what else is in its other fields, or nothing of the plan."""

SEARCH = tuple(field.name for field in fields(Search))
TURNING = tuple(field.name for field in fields(Velocity))


@dataclass(frozen=True)
class PlanRequest:
    """The question of :func:`minsnap.plan`.

    Files and pages say it in plain numbers, for which the last fields are; equal requests then give the same plan.

    Parameters
    ----------
    waypoints, durations, total_time, continuity, degree, yaw, start, end, closed, solver, pins, pieces, \
    waypoint_tolerance, search
        As ``plan`` takes them; rows of numbers as tuples.
    limits : Limits, or tuple of (name, value)
        The limits, or fields of :class:`~minsnap.Limits` in their units.
    corridor : array_like, Constraint, ... or tuple of float
        As ``plan`` takes it, or the half-width of the tube around each leg [m].
    avoid : obstacles, or tuple of (name, numbers)
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
        As ``plan`` takes them.
    """

    waypoints: Any
    durations: Any = None
    total_time: float | None = None
    limits: Any = ()
    corridor: Any = None
    continuity: int | None = None
    degree: int = 7
    yaw: Any = None
    start: Any = None
    end: Any = None
    closed: bool = False
    solver: str = "auto"
    pins: Any = None
    pieces: int | str | None = None
    waypoint_tolerance: Any = None
    search: Search | None = None
    avoid: Any = ()
    boxes: tuple[Box, ...] | None = None
    room: Any = None
    openings: tuple[Opening, ...] = ()
    rotors: float | None = None
    vehicle: str = ""
    frame: str = "enu"
    tracking: Any = None
    wind: float | None = None

    @property
    def legs(self) -> int:
        """Number of legs between waypoints."""
        return len(self.waypoints) - 1

    @property
    def polynomials(self) -> int | str:
        """Polynomials per leg: as asked, else "auto" where limits choose the time, and one elsewhere.

        Continuity below k - 1 is that of legs of one polynomial.
        """
        if self.pieces is not None:
            return self.pieces
        priced = self.search is not None and self.search.time_weight is not None
        timed = self.durations is not None or self.total_time is not None or priced
        limited = bool(self.limits) or self.rotors is not None
        smooth = self.continuity is None or self.continuity >= self.degree // 2
        return "auto" if limited and smooth and not timed else 1

    @property
    def turns(self) -> tuple[float, ...]:
        """The heading at each waypoint [rad]; empty where one rule or number holds for all."""
        return self.yaw if isinstance(self.yaw, tuple) else ()

    def yaw_in(self, order: Sequence[int]) -> Any:
        """Return the yaw for the waypoints in another order, with some left out or twice."""
        return tuple(self.turns[index] for index in order) if self.turns else self.yaw

    def as_lap(self) -> PlanRequest:
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

    def changed(self, **named: Any) -> PlanRequest:
        """Return the request with other fields, those of ``Search`` and ``Velocity`` among them by their own names.

        Raises
        ------
        InputError
            If a value is malformed, or turning goes with another yaw than one along the velocity.
        """
        return replace(self, **grouped({"yaw": self.yaw} | (vars(self.search) if self.search else {}) | named))

    def within_ordinary(self) -> PlanRequest:
        """Return the request within the limits of ordinary flight, unless a time, a price or a limit is set."""
        priced = self.search is not None and self.search.time_weight is not None
        if priced or any(value is not None for value in (self.durations, self.total_time, self.bounds)):
            return self
        from minsnap.limits.ordinary import completed

        return replace(self, limits=tuple(completed({}).items()))

    @property
    def places(self) -> Any:
        """Waypoints with gates in their places, as ``plan`` and ``certify`` take them.

        Raises
        ------
        WaypointError
            If a gate is malformed, or in the place of no waypoint.
        """
        if not self.openings:
            return self.waypoints
        places: list[Any] = list(self.waypoints)
        for index, corners, crossing, margin in self.openings:
            if not 0 <= index < len(places):
                raise WaypointError(f"a gate is in the place of waypoint {index}, and they go from 0 to {self.legs}")
            places[index] = Gate.polygon(corners, crossing, margin)
        return places

    @property
    def gates(self) -> dict[int, Gate]:
        """The gates of the openings, by the waypoints in whose place they are."""
        places = self.places
        return {index: places[index] for index, *_ in self.openings}

    @property
    def walls(self) -> Any:
        """Corridor, boxes and room together, as ``plan`` and ``certify`` take a corridor; None without any.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        boxes = [] if self.boxes is None else [Boxes(*zip(*self.boxes, strict=True))]
        widths = self.corridor
        plain = (
            isinstance(self.waypoints, tuple) and isinstance(widths, tuple) and {float}.issuperset(map(type, widths))
        )
        if plain and len(widths) == self.legs and len(set(widths)) == 1:
            widths = widths[0]  # the same for all legs
        return with_walls(widths, *boxes, *as_room(self.room))

    @property
    def obstacles(self) -> tuple[Avoided, ...]:
        """The obstacles to keep out of.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        avoid = self.avoid
        named = isinstance(avoid, tuple) and all(isinstance(each, tuple) for each in avoid)
        return tuple(named_obstacle(*each) for each in avoid) if named else as_obstacles(avoid)

    @property
    def bounds(self) -> Limits | None:
        """The limits, those of the rotors among them; None without any.

        Raises
        ------
        LimitError, VehicleError
            If they are no limits, or the rotors of no vehicle are to be kept within their range.
        """
        if self.limits is None:
            return None
        from minsnap.limits.limits import Limits, check_limits

        if not isinstance(self.limits, tuple):
            check_limits(self.limits)
            return self.limits  # type: ignore[no-any-return]
        if self.rotors is not None:
            from minsnap.vehicle.quadrotor import named_vehicle

            return Limits.of(named_vehicle(self.vehicle), self.rotors, **dict(self.limits))
        return Limits(**dict(self.limits)) if self.limits else None

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``plan`` that are set.

        Raises
        ------
        InputError
            If a wall, a gate or a limit is malformed.
        """
        values = vars(self) | {"limits": self.bounds, "corridor": self.walls, "avoid": self.obstacles or None}
        present = {name: value for name, value in values.items() if value is not None and name not in PLAIN}
        return present | {"waypoints": self.places}


def grouped(named: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the options of a search, and the turning of a heading, as ``Search`` and ``Velocity``.

    Raises
    ------
    InputError
        If a value is malformed, or turning goes with another yaw than one along the velocity.
    """
    arguments = {name: value for name, value in named.items() if name not in (*SEARCH, *TURNING)}
    search, turning = ({n: named[n] for n in names if named.get(n) is not None} for names in (SEARCH, TURNING))
    if search:
        arguments["search"] = Search(**search)
    if turning:
        if not (isinstance(arguments.get("yaw"), str) and arguments["yaw"] == "velocity"):
            name, value = next(iter(turning.items()))
            raise YawError(f"{name}={shown(value)} is for a heading along the velocity: give yaw='velocity' with it")
        arguments["yaw"] = Velocity(**turning)
    return arguments


def plan_arguments(named: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of ``plan`` from the flat names of options: as :func:`grouped`, and a ``room`` as a wall."""
    arguments = grouped(named)
    walls = as_room(arguments.pop("room", None))
    return arguments | ({"corridor": with_walls(arguments.get("corridor"), *walls)} if walls else {})


def with_walls(corridor: Any, *walls: Any) -> Any:
    """Return a corridor with more walls, as ``plan`` takes it."""
    if not walls:
        return corridor
    parts = [*([] if corridor is None else [corridor]), *walls]
    return parts if len(parts) > 1 else parts[0]
