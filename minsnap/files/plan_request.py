"""The question of a plan: waypoints, times, walls, limits and heading as one value, and as arguments of ``plan``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from minsnap.errors import CorridorError, FrameError, VehicleError, WaypointError
from minsnap.files.frames import get_frame, map_vectors, map_yaw

if TYPE_CHECKING:
    from minsnap.corridors.keep_out import Obstacle
    from minsnap.limits.limits import Limits, VehicleLimits
    from minsnap.vehicle.quadrotor import Quadrotor

Point = tuple[float, ...]
"""Coordinates [m]."""

Box = tuple[Point, Point]
"""Two opposite corners, the lower one first [m]."""

Opening = tuple[int, tuple[Point, ...], int, float]
"""A gate: which waypoint it takes the place of, its corners [m], its crossing, its margin [m]; see ``Gate.polygon``."""

RESERVE = 0.1
"""Share of the rotors' room that is left to feedback unless told otherwise."""

VEHICLES = ("crazyflie", "dji_f330", "px4_sih")
"""Presets of :class:`~minsnap.vehicle.Quadrotor` by name."""

SHORT_NAMES = {"f330": "dji_f330", "px4-sih": "px4_sih"}
"""Names of presets on the command line, which files may use too."""


@dataclass(frozen=True)
class PlanRequest:
    """The question of :func:`minsnap.plan` as plain numbers; two equal requests give the same plan.

    Parameters
    ----------
    waypoints : tuple of points
        [m].
    durations : tuple of float, or None
        Seconds of each leg.
    total_time : float or None
        Of all legs together [s].
    limits : tuple of (name, value)
        Fields of :class:`~minsnap.Limits`, in their units.
    rotors : float or None
        Keep the thrust of the rotors of ``vehicle`` within their range, less this reserve in [0, 1).
    corridor : tuple of float, or None
        Half-width of the tube around each leg [m].
    boxes : tuple of Box, or None
        The box that each leg stays in.
    room : Box or None
        The box that all legs stay in.
    avoid : tuple of (name, numbers)
        Obstacles to keep out of, as :func:`~minsnap.corridors.keep_out.named_obstacle` takes them.
    openings : tuple of Opening
        Gates in the place of waypoints, which are their centers.
    yaw : float, str, tuple of float, or None
        As ``plan`` takes it.
    degree, continuity, pieces, closed
        As ``plan`` takes them.
    vehicle : str
        Name of a preset: one of :data:`VEHICLES`; empty for none.
    frame : str
        Axes in which the plan is to be written.
    """

    waypoints: tuple[Point, ...]
    durations: tuple[float, ...] | None = None
    total_time: float | None = None
    limits: tuple[tuple[str, float], ...] = ()
    rotors: float | None = None
    corridor: tuple[float, ...] | None = None
    boxes: tuple[Box, ...] | None = None
    room: Box | None = None
    avoid: tuple[tuple[str, Point], ...] = ()
    openings: tuple[Opening, ...] = ()
    yaw: float | str | tuple[float, ...] | None = None
    degree: int = 7
    continuity: int | None = None
    pieces: int | str = 1
    closed: bool = False
    vehicle: str = ""
    frame: str = "enu"

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.waypoints) - 1

    @property
    def turns(self) -> tuple[float, ...]:
        """The heading at each waypoint [rad]; empty where one rule or number holds for all."""
        return self.yaw if isinstance(self.yaw, tuple) else ()

    def yaw_in(self, order: Sequence[int]) -> float | str | tuple[float, ...] | None:
        """Return the yaw for the waypoints in another order, with some left out or twice."""
        return tuple(self.turns[index] for index in order) if self.turns else self.yaw

    def as_lap(self) -> PlanRequest:
        """Return the closed lap: waypoints that do not end where they begin go on to the first one again.

        The leg that is added has the half-width of the last one; durations are left out then.
        """
        if self.waypoints[0] == self.waypoints[-1]:
            return replace(self, closed=True)
        yaw = self.yaw_in([*range(len(self.waypoints)), 0])
        corridor = None if self.corridor is None else (*self.corridor, *self.corridor[-1:])
        points = (*self.waypoints, self.waypoints[0])
        return replace(self, waypoints=points, durations=None, yaw=yaw, corridor=corridor, closed=True)

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
        from minsnap.corridors.gates import Gate

        places: list[Any] = list(self.waypoints)
        for index, corners, crossing, margin in self.openings:
            if not 0 <= index < len(places):
                raise WaypointError(f"a gate is in the place of waypoint {index}, and they go from 0 to {self.legs}")
            places[index] = Gate.polygon(corners, crossing, margin)
        return places

    @property
    def gates(self) -> dict[int, Any]:
        """The gates, by the waypoints in whose place they are."""
        places = self.places
        return {index: places[index] for index, *_ in self.openings}

    @property
    def walls(self) -> Any:
        """Tube, boxes and room together, as ``certify`` takes a corridor; None without any.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        from minsnap.corridors.boxes import Room

        corridor = self._corridor()
        if self.room is None:
            return corridor
        room = Room(*self.room)  # type: ignore[arg-type]
        return [room] if corridor is None else [corridor, room]

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles to keep out of.

        Raises
        ------
        CorridorError
            If one of them is malformed.
        """
        from minsnap.corridors.keep_out import named_obstacle

        return tuple(named_obstacle(*each) for each in self.avoid)

    @property
    def bounds(self) -> Limits | None:
        """The limits, those of the rotors among them; None without any.

        Raises
        ------
        VehicleError
            If the rotors of no vehicle are to be kept within their range.
        """
        from minsnap.limits.limits import Limits

        if self.rotors is not None:
            return Limits.of(named_vehicle(self.vehicle), self.rotors, **dict(self.limits))
        return Limits(**dict(self.limits)) if self.limits else None  # type: ignore[arg-type]

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``plan`` that are set, the waypoints among them.

        Raises
        ------
        InputError
            If a wall or a limit is malformed.
        """
        arguments: dict[str, Any] = {"waypoints": self.places, "durations": self.durations, "yaw": self.yaw}
        arguments |= {"total_time": self.total_time, "limits": self.bounds, "corridor": self.walls}
        arguments |= {"continuity": self.continuity, "avoid": self.obstacles or None}
        present = {name: value for name, value in arguments.items() if value is not None}
        return present | {"degree": self.degree, "pieces": self.pieces, "closed": self.closed}

    def _corridor(self) -> Any:
        """Half-widths where the tube is alone, so that the native core sees the plain problem."""
        if self.corridor is not None and len(self.corridor) != max(self.legs, 1):
            raise CorridorError(f"{len(self.corridor)} half-widths for {self.legs} legs: give one, or one per leg")
        if self.boxes is None:
            return None if self.corridor is None else _plain(self.corridor)
        from minsnap.corridors.boxes import Boxes
        from minsnap.corridors.tubes import Tube

        boxes = Boxes(*_corners(self.boxes))
        return boxes if self.corridor is None else [Tube(self.corridor), boxes]  # type: ignore[arg-type]


def in_enu(request: PlanRequest, frame: str) -> PlanRequest:
    """Return a request whose waypoints and headings are in the axes of a frame.

    Raises
    ------
    FrameError
        If the frame is unknown, needs three coordinates, or walls would have to be mapped.
    """
    axes = get_frame(frame)
    if axes.name == "enu":
        return request
    if len(request.waypoints[0]) != 3:
        raise FrameError(
            f"waypoints of {len(request.waypoints[0])} coordinates are in ENU: give x, y and z for {frame}"
        )
    if request.boxes is not None or request.room is not None or request.avoid or request.openings:
        raise FrameError(
            "boxes, a room, obstacles and gates are in ENU: give the waypoints in ENU too, or leave the walls out"
        )
    points = tuple(tuple(row) for row in map_vectors(request.waypoints, axes, "enu").tolist())
    yaw = request.yaw
    if yaw is not None and not isinstance(yaw, str):
        mapped = map_yaw(yaw, axes, "enu").tolist()
        yaw = tuple(mapped) if request.turns else mapped
    return replace(request, waypoints=points, yaw=yaw)


def named_vehicle(name: str) -> Quadrotor:
    """Return the preset of that name.

    Raises
    ------
    VehicleError
        If there is none.
    """
    from minsnap.vehicle.quadrotor import Quadrotor

    makers: dict[str, Callable[[], Quadrotor]] = {known: getattr(Quadrotor, known) for known in VEHICLES}
    name = SHORT_NAMES.get(name, name)
    if name not in makers:
        raise VehicleError(f"no vehicle is called {name!r}: choose one of {', '.join(VEHICLES)}")
    return makers[name]()


def preset_of(vehicle: Quadrotor) -> str | None:
    """Return the name of the preset that is the same vehicle, or None."""
    from minsnap.vehicle.yaml import description_of

    description = description_of(vehicle)
    return next((name for name in VEHICLES if description_of(named_vehicle(name)) == description), None)


def besides_rotors(limits: VehicleLimits) -> dict[str, float]:
    """Return the limits that a vehicle's own were combined with, by name."""
    own = type(limits).of(limits.vehicle, limits.reserve).given()
    return {name: value for name, value in limits.given().items() if own.get(name) != value}


def _plain(widths: tuple[float, ...]) -> float | list[float]:
    return widths[0] if len(set(widths)) == 1 else list(widths)


def _corners(boxes: tuple[Box, ...]) -> tuple[Any, Any]:
    lower, upper = zip(*boxes, strict=True)
    return lower, upper
