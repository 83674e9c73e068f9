"""Where a vehicle in its control loop can be while the wind changes, and whether that is inside of what it must keep.

Without wind it flies as :mod:`minsnap.vehicle.expected_flight` proves; a wind that changes by at most w moves it by at
most the width of :meth:`minsnap.vehicle.Loop.widths`, a ball around that place. Each condition is a distance without
wind that the ball, or what feedback commands, must not exceed. Distances are bounded by the control points of short
cells: walls are convex, and so are bounds of tilt and thrust.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import atan, cos, inf, isinf, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_kind, check_number
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Walls
from minsnap.corridors.gates import Gate
from minsnap.corridors.keep_out import Avoided
from minsnap.corridors.moving import Moving
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.errors import VehicleError
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.expected_flight import ExpectedFlight, expected_flight
from minsnap.vehicle.loop import Loop, Widths

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

LATE = 1.0
"""How long after a leg, or before it, the vehicle may still be within its walls in place of the next one's [s]."""

STRONGEST = 100.0
"""Greatest change of the wind that is looked at [m/s]."""

HALVINGS = 50
"""Steps by which the greatest change of the wind is found."""


@dataclass(frozen=True)
class Condition:
    """What the vehicle must keep.

    Parameters
    ----------
    name : str
    room : callable
        Takes the widths of wind, and returns what is left of it, negative where it is not kept.
    unit : str
        Of what is left.
    saturates : bool
        Whether the loop is not linear beyond it, so that nothing is known of the vehicle.
    """

    name: str
    room: Callable[[Widths], float]
    unit: str = "m"
    saturates: bool = False


@dataclass(frozen=True, eq=False)
class VehicleTube:
    """The tube of a vehicle around its plan, and what of it is inside.

    Parameters
    ----------
    loop : Loop
    wind : float
        Largest change of the wind that was asked for [m/s].
    flight : ExpectedFlight
        The flight without wind.
    conditions : tuple of Condition
    """

    loop: Loop
    wind: float
    flight: ExpectedFlight = field(repr=False)
    conditions: tuple[Condition, ...] = field(repr=False)

    @cached_property
    def widths(self) -> Widths:
        """What the wind that was asked for can do."""
        return self.loop.widths(self.wind, self.flight.speed)

    @cached_property
    def rooms(self) -> dict[str, float]:
        """What is left of each condition with that wind, by name, in its unit; negative where it is not kept."""
        return {each.name: each.room(self.widths) for each in self.conditions}

    @property
    def each(self) -> tuple[VehicleTube, ...]:
        """The tubes of all vehicles: this one."""
        return (self,)

    @property
    def error(self) -> float:
        """Largest distance from the plan at the same instant [m]; infinite where the loop saturates."""
        return inf if self.saturated else self.flight.lag + self.widths.error

    @cached_property
    def saturated(self) -> tuple[str, ...]:
        """Names of the bounds of the autopilot at which its loop saturates."""
        return tuple(each.name for each in self.conditions if each.saturates and self._broken(each, self.widths))

    @property
    def ok(self) -> bool:
        """Whether all conditions hold with that wind."""
        return self.fault is None

    @cached_property
    def fault(self) -> str | None:
        """The first condition that does not hold, in words; None where all do."""
        for each in sorted(self.conditions, key=lambda each: not each.saturates):
            if self._broken(each, self.widths):
                short = -self.rooms[each.name]
                lacks = "" if isinf(short) else f": {short:.3g} {each.unit} are missing"
                return f"in a wind that changes by {self.wind:g} m/s the vehicle does not keep {each.name}{lacks}"
        return None

    @cached_property
    def strongest(self) -> float:
        """Largest change of the wind with which all conditions hold [m/s]; 0 where they do not in still air."""
        return strongest_wind(self.holds)

    def holds(self, wind: float) -> bool:
        """Whether all conditions hold in a wind that changes by so much [m/s]."""
        widths = self.loop.widths(wind, self.flight.speed)
        return not any(self._broken(each, widths) for each in self.conditions)

    @staticmethod
    def _broken(condition: Condition, widths: Widths) -> bool:
        return not condition.room(widths) >= -EXACT


def strongest_wind(holds: Callable[[float], bool]) -> float:
    """Return the largest change of the wind [m/s] with which conditions hold that hold with every smaller one."""
    if not holds(0.0):
        return 0.0
    low, high = 0.0, STRONGEST
    if holds(high):
        return inf
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def check_tracking(tracking: Any, wind: Any) -> float:
    """Return the wind of a loop [m/s], or raise VehicleError for what is no loop, or a wind without one."""
    if tracking is None:
        if wind:
            raise VehicleError("wind is of a vehicle in its loop: give tracking=Loop.px4() or another with it")
        return 0.0
    check_kind("tracking", tracking, Loop, "a Loop such as Loop.px4()")
    give = f"give the largest change of the wind from 0 to {STRONGEST:g} m/s"
    return float(check_number("the wind", wind, 0.0, STRONGEST, give, VehicleError))


def vehicle_tube(
    loop: Loop,
    wind: float,
    curve: Trajectory,
    walls: Sequence[Walls] = (),
    gates: Mapping[int, Gate] | None = None,
    obstacles: Sequence[Avoided] = (),
    limits: Limits | None = None,
    span: tuple[float, float] = (0.0, 0.0),
) -> VehicleTube:
    """Return the tube of a vehicle that flies a trajectory, and what it must keep.

    Parameters
    ----------
    loop : Loop
    wind : float
        Largest change of the wind from what it is at the start [m/s].
    curve : Trajectory
        That :func:`check_dimensions` takes.
    walls : sequence of Walls
        Of its legs; those of derivatives are the plan's own.
    gates : mapping of int to Gate, optional
        By the waypoints in whose place they are.
    obstacles : sequence of Obstacle or Moving
    limits : Limits, optional
        Those of thrust and tilt are asked of the commanded thrust as well.
    span : tuple of 2 floats
        From when and until when it is looked at, at least [s].
    """
    flight = expected_flight(loop, curve, *span)
    kept = [*_wall_conditions(flight, curve, walls), *_gate_conditions(flight, curve, gates or {})]
    still = [each for each in obstacles if not isinstance(each, Moving)]
    moving = [each for each in obstacles if isinstance(each, Moving)]
    if still:
        kept.append(_within("the distance to obstacles", nearest_obstacle(flight.curve, still).value, flight))
    if moving:
        room = nearest_obstacle(flight.from_start, moving).value
        kept.append(_within("the distance to obstacles that move", room, flight))
    return VehicleTube(loop, wind, flight, (*kept, *_thrust_conditions(loop, flight, limits)))


def check_dimensions(curve: Trajectory) -> None:
    """Raise VehicleError for a trajectory that is not in the plane or in space."""
    if curve.dim not in (2, 3):
        raise VehicleError(f"a vehicle has two or three coordinates, and the trajectory has {curve.dim}")


def _within(name: str, room: float, flight: ExpectedFlight) -> Condition:
    """Return the condition that a distance without wind [m] is not less than the error."""
    known = room - flight.position_error
    return Condition(name, lambda widths: known - widths.error)


def _wall_conditions(flight: ExpectedFlight, curve: Trajectory, walls: Sequence[Walls]) -> Iterator[Condition]:
    """Yield the conditions of walls by their names: at every instant the walls of one leg near in time are kept."""
    placed = [block for block in walls if not block.order and len(block.leg)]
    if placed:
        names = " and ".join(dict.fromkeys(f"the {block.name}" for block in placed))
        yield _within(names, _room_of_legs(flight, curve, placed), flight)


def _room_of_legs(flight: ExpectedFlight, curve: Trajectory, walls: Sequence[Walls]) -> float:
    """Least distance to walls over all cells, of the leg near in time that is kept best [m]."""
    best = np.full(len(flight.points), -inf)
    for leg in range(curve.legs):
        begin, end = curve.leg_breaks[leg] - LATE, curve.leg_breaks[leg + 1] + LATE
        begin, end = (-inf if leg == 0 else begin), (inf if leg == curve.legs - 1 else end)
        near = np.flatnonzero((flight.starts + flight.cell >= begin) & (flight.starts <= end))
        near = near[(flight.starts[near] >= begin) & (flight.starts[near] + flight.cell <= end)]
        points, least = flight.points[near], np.full(len(near), inf)
        for block in walls:
            own = block.chosen(block.leg == leg)
            if len(own.leg):
                slack = own.slack(points.reshape(1, -1, curve.dim)) / _steepness(own)[:, None]
                least = np.minimum(least, slack.min(axis=0).reshape(len(near), -1).min(axis=1))
        best[near] = np.maximum(best[near], least)
    return float(best.min())


def _steepness(walls: Walls) -> FloatArray:
    """Return by how much the slack of each wall changes at most over a metre."""
    steep = np.linalg.norm(walls.slope, axis=1)
    return np.asarray(steep if walls.flat else steep + np.linalg.norm(walls.matrix, ord=2, axis=(1, 2)))


def _gate_conditions(flight: ExpectedFlight, curve: Trajectory, gates: Mapping[int, Gate]) -> Iterator[Condition]:
    """Yield the condition of each gate that the vehicle crosses its plane within the opening."""
    for knot, gate in gates.items():
        instant = float(curve.leg_breaks[knot])
        near = np.abs(flight.starts + 0.5 * flight.cell - instant) <= LATE
        offsets, starts = flight.points[near] - gate.center, flight.starts[near]
        height = offsets @ gate.normal
        sides, bounds = gate.edges()
        beyond = (offsets @ sides.T - bounds).max(axis=(1, 2))
        yield Condition(f"gate {knot}", _Crossing(height, beyond, starts - instant, flight.position_error).room)


@dataclass(frozen=True, eq=False)
class _Crossing:
    """How a gate is crossed without wind.

    Parameters
    ----------
    height : ndarray, shape (cells, 6)
        Control points of the distance from the gate's plane [m].
    beyond : ndarray, shape (cells,)
        How far outside of the opening each cell comes, negative inside [m].
    late : ndarray, shape (cells,)
        When it begins, from the instant of the plan [s].
    doubt : float
        By how much positions may differ [m].
    """

    height: FloatArray
    beyond: FloatArray
    late: FloatArray
    doubt: float

    def room(self, widths: Widths) -> float:
        """Return the least distance to the edges while the vehicle may be in the plane [m]."""
        reach = widths.error + self.doubt
        if isinf(reach):
            return -inf
        low, high = self.height.min(axis=1), self.height.max(axis=1)
        met = np.flatnonzero((low <= 0.0) & (high >= 0.0))
        if not len(met):  # it ends in the gate, or turns in it
            met = np.array([np.abs(self.height).min(axis=1).argmin()])
        first = int(met[np.abs(self.late[met]).argmin()])
        inside = (low <= reach) & (high >= -reach)
        apart = np.flatnonzero(~inside)
        begin = int(apart[apart < first].max(initial=-1)) + 1
        end = int(apart[apart > first].min(initial=len(inside)))
        return -float(self.beyond[begin : max(end, first + 1)].max()) - reach


def _thrust_conditions(loop: Loop, flight: ExpectedFlight, limits: Limits | None) -> Iterator[Condition]:
    """Yield the conditions of the commanded thrust and velocity, those of the loop and those of limits."""
    gravity = GRAVITY if limits is None else limits.gravity
    lifted = flight.commands
    if lifted.shape[-1] == 2:
        lifted = np.concatenate((lifted, np.zeros((*lifted.shape[:-1], 1))), axis=-1)
    thrust = lifted + np.array([0.0, 0.0, gravity])
    for whose, source in (("the autopilot's", loop), ("the", limits)):
        for name, bound in _bounds(thrust, gravity, source):
            yield _commanded(f"{whose} {name}", bound, flight, source is loop)
    yield from _speed_conditions(loop, flight)


def _bounds(thrust: FloatArray, gravity: float, source: Any) -> Iterator[tuple[str, float]]:
    """Yield what is left of the bounds of thrust and tilt without wind, by name [m/s^2]."""
    most, least, tilt = (getattr(source, name, None) for name in ("max_thrust", "min_thrust", "tilt"))
    if most is not None:
        yield "greatest thrust", float(most * gravity - np.linalg.norm(thrust, axis=-1).max())
    if least:
        middle = thrust.mean(axis=1)
        along = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
        yield "least thrust", float(np.einsum("mkd,md->mk", thrust, along).min() - least * gravity)
    if tilt is not None:
        aside = np.linalg.norm(thrust[..., :2], axis=-1)
        yield "tilt", float((sin(tilt) * thrust[..., 2] - cos(tilt) * aside).min())


def _commanded(name: str, bound: float, flight: ExpectedFlight, saturates: bool) -> Condition:
    """Return the condition that a bound of the thrust leaves what feedback commands."""
    known = bound - flight.command_error
    return Condition(name, lambda widths: known - widths.command, "m/s^2", saturates)


def _speed_conditions(loop: Loop, flight: ExpectedFlight) -> Iterator[Condition]:
    """Yield the conditions that the position loop asks for velocities that the autopilot lets pass."""
    asked, gain = flight.asked, loop.position_gain
    sides = [("speed", np.linalg.norm(asked[..., :2], axis=-1).max(), gain[0])]
    if asked.shape[-1] == 3:
        sides += [("climb_speed", asked[..., 2].max(), gain[1]), ("descent_speed", -asked[..., 2].min(), gain[1])]
    for name, most, stiff in sides:
        cap = getattr(loop, name)
        if cap is not None:
            room = float(cap - most) - stiff * flight.position_error
            yield _asked(f"the autopilot's {name.replace('_', ' ')}", room, stiff)


def _asked(name: str, room: float, stiff: float) -> Condition:
    return Condition(name, lambda widths: room - stiff * widths.error, "m/s", True)


def reserved_limits(limits: Limits, loop: Loop, command: float) -> dict[str, float]:
    """Return the bounds of thrust and tilt that are left to a plan where feedback needs an acceleration [m/s^2].

    Those of the loop count where they are narrower.

    Raises
    ------
    VehicleError
        If nothing is left.
    """
    need, left = command / limits.gravity, dict[str, float]()
    names = ("max_thrust", "min_thrust", "tilt")
    most, least, tilt = ([own for own in (getattr(limits, name), getattr(loop, name)) if own] for name in names)
    if most:
        left["max_thrust"] = min(most) - need
    if least:
        left["min_thrust"] = max(least) + need
    if tilt:
        left["tilt"] = min(tilt) - atan(need / max(1.0 - need, 1e-3))
    if left.get("max_thrust", inf) <= 1.0 or left.get("min_thrust", 0.0) >= 1.0 or left.get("tilt", 1.0) <= 0.0:
        raise VehicleError(
            f"against this wind feedback needs {command:.3g} m/s^2, and thrust and tilt leave nothing beside it: "
            "give less wind, or a vehicle with more thrust"
        )
    return left
