"""Options shared by the commands that plan paths or trace shapes: duration, speed, direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, make_dataclass, replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
from minsnap.cli import options
from minsnap.cli.output import STANDING
from minsnap.errors import InputError, LimitError, MinsnapError, TimingError

Laps = Annotated[float, "Turns, spin-up and spin-down included."]


RECTANGLE_WALLS = 0.3
"""Half-width around the sides of a rectangle, by default [m]."""


if TYPE_CHECKING:
    from minsnap.corridors import Room

    class LimitFields:
        """An option for each limit of :data:`minsnap.basics.limit_kinds.KINDS`."""
else:
    LimitFields = make_dataclass("LimitFields", map(options.limit_field, options.LIMITS), frozen=True)


@dataclass(frozen=True)
class LimitOptions(LimitFields):
    """The limits of a path."""

    no_limit: options.NoLimit = None

    @property
    def limits(self) -> minsnap.Limits | None:
        """The limits of the options, completed by the ordinary ones where they choose the time; None without any."""
        chosen = options.limit_values(self)
        if not chosen and self.no_limit is None:
            return None
        from minsnap.limits import completed

        if getattr(self, "time", None) is not None:
            if self.no_limit is not None:
                raise InputError("with --time only the limits that are named hold: leave out --no-limit")
            return minsnap.Limits(**chosen)
        kept: dict[str, Any] = completed(self._said)
        if not kept:
            raise InputError("--no-limit leaves no limit: name one, such as --max-jerk")
        return minsnap.Limits(**kept)

    @property
    def _said(self) -> dict[str, float | None]:
        """The limits that are named, and None for those that are taken off; without that of altitudes."""
        named, off = options.limit_values(self), options.taken_off(self.no_limit)
        both = [name for name in off if name in named]
        if both:
            raise LimitError(f"the {both[0]} is limited and its limit taken off: do one of them")
        return named | dict.fromkeys(name for name in off if name != "altitude")

    def refuse_idle(self, altitudes: bool = False) -> None:
        """Raise InputError where ``--no-limit`` takes off nothing; ``altitudes`` are limited here or not."""
        if self.no_limit is None:
            return
        from minsnap.limits import completed

        if altitudes and "altitude" in options.taken_off(self.no_limit):
            return
        if completed(self._said) == completed(options.limit_values(self)):
            raise InputError(f"--no-limit {self.no_limit} takes off a limit that does not hold here: leave it out")

    def limits_over(self, own: minsnap.Limits | None, timed: bool = False) -> minsnap.Limits | None:
        """Return the limits of the options with those of a file that they neither name nor take off.

        Parameters
        ----------
        own : Limits or None
            Of the file.
        timed : bool
            Whether the file has a time, so that the ordinary limits do not hold in it.
        """
        if own is None or self.limits is None:
            return self.limits
        from minsnap.limits import ORDINARY, completed, written_in_file

        said = (own.named() if timed else written_in_file(own.named())) | self._said
        fields = said if getattr(self, "time", None) is not None else completed(said)
        return replace(own, **{"leg_speeds": (), **dict.fromkeys(ORDINARY), **fields})


def standing(plan: Callable[[], minsnap.Path], path: minsnap.Trajectory) -> dict[str, Any]:
    """Return how long laps that begin at speed last from a standing start, as another plan finds it."""
    if float(sum(part**2 for part in path(0.0, 1))) <= STANDING**2:
        return {}
    try:
        return {"standing": plan().duration}
    except MinsnapError:
        return {}


@dataclass(frozen=True)
class Span:
    """The duration of a plan, as a time or as a weight on time: first in the help."""

    time: Annotated[float | None, "S", "Total duration [s]; with limits instead, the shortest time within them."] = None
    time_weight: Annotated[float | None, "W", "Minimise cost + W * time, instead of a duration [cost/s]."] = None


@dataclass(frozen=True)
class TimingOptions(LimitOptions, Span):
    """The duration of a plan: a total time, a weight on time, or the shortest time within limits."""

    split: Annotated[str | None, "How --time is split over the legs: optimal or distance."] = None
    pieces: Annotated[
        str | None, "N|auto", "Polynomials per leg; by default 1 with a time, else auto: as many as shorten the flight."
    ] = None
    time_limit: Annotated[float | None, "S", "Stop the search after S seconds, and take the best plan so far."] = None
    yaw: options.Yaw = None
    look_at: options.LookAtPoint = None

    def __post_init__(self) -> None:
        if self.time is not None and self.time_weight is not None:
            raise TimingError("--time and --time-weight exclude each other: give the duration or the price of time")

    @property
    def held(self) -> minsnap.Limits | None:
        """The limits of the options, or the ordinary ones where neither limits nor a time are set."""
        if self.limits is not None or self.time is not None or self.time_weight is not None:
            return self.limits
        from minsnap.limits import ordinary_limits

        return ordinary_limits()

    def altitudes(self, points: Any) -> list[Room]:
        """Return the room between floor and ceiling of ordinary flight, where limits choose the time; else none."""
        timed = self.time is not None or (self.time_weight is not None and self.limits is None)
        if timed or "altitude" in options.taken_off(self.no_limit) or len(points[0]) != 3:
            return []
        from minsnap.corridors import Room
        from minsnap.limits import ordinary_room

        return [Room(*ordinary_room(points))]

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of a plan that the options name."""
        how = {"time_weight": self.time_weight, "split": self.split, "time_limit": self.time_limit}
        how |= {"pieces": options.parse_pieces(self.pieces), "yaw": options.chosen_yaw(self.yaw, self.look_at)}
        return options.present(total_time=self.time, limits=self.limits, **how)


@dataclass(frozen=True)
class Planning(TimingOptions):
    """Options of a plan through several waypoints."""

    corridor: options.Corridor = None
    avoid: Annotated[list[str] | None, "X,Y,R", "Vertical cylinder to avoid [m]; or X,Y,R,LOW,HIGH. Repeatable."] = None
    fence: Annotated[Path | None, "FILE", "Geofence of a QGroundControl plan (.plan), in metres from its home."] = None
    yaw_rate: Annotated[
        float | None, "RAD/S", "With --yaw velocity: greatest yaw rate where the heading is held [rad/s]."
    ] = None
    hold_below: Annotated[
        float | None, "M/S", "With --yaw velocity: hold the heading below this horizontal speed [m/s]."
    ] = None
    yaw_at_start: Annotated[
        float | None, "DEG", "With --yaw velocity: the vehicle's heading at the start, from which it turns [degrees]."
    ] = None
    degree: options.Degree = 7
    continuity: Annotated[int | None, "Derivatives continuous at the waypoints."] = None
    solver: Annotated[str, "auto, or a solver's name: daqp, clarabel, osqp, or another of qpsolvers."] = "auto"
    tracking: options.Tracking = None
    wind: Annotated[float | None, "M/S", "With --tracking: largest change of the wind [m/s]."] = None

    def in_loop(self, said: Any = None) -> dict[str, Any]:
        """Return the loop of the vehicle and the wind as ``plan`` and ``certify`` take them; nothing without one.

        What the options do not name is that of a request or a course, if it says so.
        """
        loop = getattr(said, "tracking", None) if self.tracking is None else None
        wind = getattr(said, "wind", None) if self.wind is None else self.wind
        loop = loop or options.loop_of(self.tracking, wind or 0.0)
        return {} if loop is None else {"tracking": loop, "wind": wind or 0.0}

    @property
    def walls(self) -> float | list[float] | None:
        """The half-widths of the corridor [m], or None."""
        return options.parse_corridor(self.corridor)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of a plan that the options name."""
        avoided = options.avoided(self.avoid, self.fence)
        chosen = options.present(corridor=self.walls, continuity=self.continuity, avoid=avoided)
        angle = None if self.yaw_at_start is None else options.angle_of("--yaw-at-start", self.yaw_at_start)
        chosen |= options.present(yaw_rate=self.yaw_rate, hold_below=self.hold_below, yaw_at_start=angle)
        return super().arguments() | chosen | {"degree": self.degree, "solver": self.solver}


@dataclass(frozen=True)
class RectanglePlanning(Planning):
    """The same for a rectangle: in a corridor, and within limits where no time is set."""

    corridor: Annotated[
        str | None, "M", "Half-width around each side [m]: one (default 0.3), or four a lap with commas."
    ] = None
    no_corridor: Annotated[bool, "Plan without a corridor."] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.no_corridor and self.corridor is not None:
            raise InputError(f"--no-corridor and --corridor {self.corridor} exclude each other: leave out one")

    @property
    def walls(self) -> float | list[float] | None:
        """The half-widths of the corridor [m], or None."""
        if self.no_corridor:
            return None
        return RECTANGLE_WALLS if self.corridor is None else super().walls


@dataclass(frozen=True)
class Turning(LimitOptions):
    """Options of a circle, a helix or a figure of eight."""

    period: Annotated[float | None, "S", "Time per lap at full speed [s]; default 6."] = None
    speed: Annotated[float | None, "M/S", "Full speed, instead of the period [m/s]."] = None
    laps: Laps = 1.0
    ramp: Annotated[float | None, "DEG", "Angle of spin-up and spin-down [degrees]; default 90; 0 starts at speed."] = (
        None
    )
    center: options.Center = (0.0, 0.0)
    altitude: options.Altitude = 1.5
    clockwise: options.Clockwise = False
    yaw: options.Yaw = None
    look_at: options.LookAtPoint = None

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of a shape that the options name."""
        own = {name: getattr(self, name) for name in ("period", "speed", "laps", "center", "altitude", "clockwise")}
        self.refuse_idle()
        yaw, ramp = options.chosen_yaw(self.yaw, self.look_at), None if self.ramp is None else radians(self.ramp)
        return options.present(**own, yaw=yaw, ramp=ramp, limits=self.limits)


@dataclass(frozen=True)
class Climbing(Turning):
    """The same for a helix."""

    laps: Laps = 3.0
    altitude: Annotated[float, "M", "z at the start [m]."] = 1.0
