"""Plans that leave room for a vehicle's control loop: what is asked of the plan is narrower by what the wind can do.

Corridor, gates and obstacles are moved by the width of the tube, thrust and tilt reduced by what feedback needs against
the wind; the plan in what is left is judged by :mod:`minsnap.vehicle_tube`. How far the vehicle lags behind a plan is
known only with it: where too little was left for that, more is left, or the plan made slower, until it fits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, TypeVar

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KINDS
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.constraint import Constraint, Walls, walls_of
from minsnap.corridors.gates import Gate
from minsnap.corridors.given_waypoints import without_gates
from minsnap.corridors.half_spaces import Polytopes
from minsnap.corridors.keep_out import Avoided, Cylinder, Obstacle
from minsnap.corridors.knot_regions import knot_positions
from minsnap.corridors.moving import Moving
from minsnap.corridors.prism import Prism
from minsnap.corridors.tubes import RoundTube, Sampled, Tube, as_constraints
from minsnap.errors import CorridorError, InfeasibleError, LimitError, UnprovedError, VehicleError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.planning.request import PlanRequest
from minsnap.trajectory.trajectory import Plan, Trajectory
from minsnap.vehicle.loop import Loop
from minsnap.vehicle_tube import VehicleTube, check_dimensions, check_tracking, reserved_limits, vehicle_tube

ATTEMPTS = 10
"""Plans that are tried."""

SLOWER = 1.4
"""Factor on the time scale of limits where a plan does not fit."""

SPARE = 1.1
"""What is left beyond what was lacking."""


@dataclass(frozen=True, eq=False)
class _Narrower:
    """Walls of positions, moved inwards by a distance [m]."""

    constraint: Constraint
    distance: float

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the walls of the constraint, moved."""
        found = self.constraint.walls(waypoints)
        return [block if block.order else block.moved(np.full(len(block.leg), -self.distance)) for block in found]


@dataclass(frozen=True, eq=False)
class _Larger:
    """An obstacle that is larger by a distance [m], or by more."""

    obstacle: Obstacle
    distance: float

    def numbers(self) -> FloatArray:
        """Return its thirteen numbers; see ``Obstacle``."""
        center, scale, radius, low, high = np.split(self.obstacle.numbers(), (3, 6, 7, 10))
        wider = radius + self.distance * (radius >= 0.0)
        return np.concatenate((center, scale, wider, low - self.distance, high + self.distance))


def narrower(constraint: Constraint, distance: float) -> Constraint:
    """Return a constraint whose walls are nearer by a distance [m].

    Raises
    ------
    CorridorError
        If nothing is left of it.
    """
    if isinstance(constraint, Tube):
        return Tube(constraint.half_width - distance)
    if isinstance(constraint, RoundTube):
        return RoundTube(constraint.radius - distance)
    if isinstance(constraint, (Boxes, Room)):
        return type(constraint)(constraint.lower + distance, constraint.upper - distance)
    if isinstance(constraint, Polytopes):
        return Polytopes([(normals, offsets - distance) for normals, offsets in constraint.half_spaces])
    return _Narrower(constraint, distance)


def larger(obstacle: Avoided, distance: float) -> list[Avoided]:
    """Return obstacles that keep a curve out of all that is within a distance [m] of one, or of a fence's outside.

    Of a prism that is itself, the strips along its edges and the disks around its corners, which together are all that
    is so near to its side.
    """
    if distance <= 0.0:
        return [obstacle]
    if isinstance(obstacle, Moving):
        return [obstacle.wider(distance)]
    if not isinstance(obstacle, Prism):
        return [_Larger(obstacle, distance)]
    grow = -distance if obstacle.inclusion else distance
    low, high = obstacle.low - grow, obstacle.high + grow
    itself = Prism(obstacle.polygon, low, high, inclusion=obstacle.inclusion)
    ends = (-inf, inf) if obstacle.inclusion else (low, high)
    parts: list[Avoided] = [itself]
    for one, two in zip(obstacle.polygon, np.roll(obstacle.polygon, -1, axis=0), strict=True):
        along = (two - one) / np.linalg.norm(two - one)
        aside = distance * np.array([-along[1], along[0]])
        parts += [Prism([one - aside, two - aside, two + aside, one + aside], *ends), Cylinder(one, distance, *ends)]
    return parts


def narrow_request(request: PlanRequest, distance: float) -> PlanRequest:
    """Return a request with corridor, gates and obstacles that leave a distance [m]."""
    corridor = request.corridor
    if isinstance(corridor, Sampled):
        parts = [narrower(each, distance) for each in as_constraints(corridor.corridor)]
        corridor = Sampled(parts, corridor.samples)
    elif corridor is not None:
        corridor = [narrower(each, distance) for each in as_constraints(corridor)]
    places = request.waypoints
    if isinstance(places, Sequence) and without_gates(places)[1]:
        places = [place.within(distance) if isinstance(place, Gate) else place for place in places]
    avoid = tuple(part for each in request.avoid for part in larger(each, distance))
    return replace(request, corridor=corridor, waypoints=places, avoid=avoid)


def limits_left(limits: Limits, loop: Loop, command: float, error: float, slowness: float) -> Limits:
    """Return limits that leave what feedback needs, of a flight on a slower time scale."""
    left: dict[str, Any] = reserved_limits(limits, loop, command)
    if loop.speed is not None:
        room = loop.speed - loop.position_gain[0] * error
        left["horizontal_speed"] = min(room, limits.horizontal_speed or room)
    for kind in KINDS:
        value = left.get(kind.name, getattr(limits, kind.name, None)) if kind.order else None
        if value is not None:
            left[kind.name] = value / slowness**kind.order
    return replace(limits, **left)


def plan_in_loop(request: PlanRequest, planned: Callable[[PlanRequest, tuple[str, ...]], Plan]) -> Plan:
    """Plan so that the vehicle in its loop keeps what is asked, in a wind that changes by as much as the request says.

    Parameters
    ----------
    request : PlanRequest
        With ``tracking`` and ``wind``.
    planned : callable
        Plans a request, and notes some sentences in its report.

    Raises
    ------
    VehicleError
        If ``tracking`` is no loop, or thrust and tilt leave nothing to the plan.
    UnprovedError
        If no plan was found with which the vehicle stays inside.
    """
    asked = replace(request, tracking=None, wind=None)
    loop = request.tracking
    wind = check_tracking(loop, request.wind)
    if loop is None:
        return planned(asked, ())

    def less(distance: float, limits: Limits | None) -> PlanRequest:
        return replace(narrow_request(asked, distance), limits=limits)

    def followed(less: PlanRequest) -> tuple[Plan, VehicleTube]:
        curve = planned(less, (describe_loop(wind),))
        check_dimensions(curve)
        return curve, _tube(request, loop, wind, curve)

    return plan_kept_in_loop(loop, wind, request.limits, less, followed)


def describe_loop(wind: float) -> str:
    """Return the sentence on a plan that leaves room for a loop."""
    return f"planned for a vehicle that keeps all of it in a wind that changes by {wind:g} m/s"


T = TypeVar("T")
Asked = TypeVar("Asked")


def plan_kept_in_loop(
    loop: Loop,
    wind: float,
    limits: Limits | None,
    less: Callable[[float, Limits | None], Asked],
    followed: Callable[[Asked], tuple[T, VehicleTube]],
) -> T:
    """Plan again and again, in ever less room, until the vehicle in its loop keeps what is asked.

    Parameters
    ----------
    loop : Loop
    wind : float
        Largest change of the wind [m/s].
    limits : Limits or None
        What is asked.
    less : callable
        Takes what corridor, gates and obstacles are to leave [m], and limits, and returns what is asked of a plan;
        raises CorridorError, WaypointError, VehicleError or LimitError where nothing is left.
    followed : callable
        Plans that, and returns the plan and the tube of the vehicle within all of what was asked at first.

    Raises
    ------
    VehicleError
        If thrust and tilt leave nothing to the plan.
    UnprovedError
        If no plan was found with which the vehicle stays inside.
    """
    widths = loop.widths(wind, 0.0 if limits is None or limits.speed is None else limits.speed)
    left = _Left(widths.error, widths.command)
    if limits is not None:
        reserved_limits(limits, loop, left.command)
    why = "corridor, gates and obstacles leave no room for that"
    for _ in range(ATTEMPTS):
        tube = None
        try:
            asked = less(left.distance, left.of(limits, loop))
        except (CorridorError, WaypointError, VehicleError, LimitError):
            pass
        else:
            try:
                plan, tube = followed(asked)
            except InfeasibleError as error:
                why = f"{error}"
            else:
                if tube.ok:
                    return plan
                why = str(tube.fault)
        if left.distance == widths.error and tube is None or not left.leave(tube, limits is not None):
            break
    raise UnprovedError(
        f"no plan was found that the vehicle keeps in a wind that changes by {wind:g} m/s, where its loop needs "
        f"{left.distance:.3g} m: {why}"
    )


@dataclass
class _Left:
    """What a plan leaves to the loop.

    Parameters
    ----------
    distance : float
        [m].
    command : float
        [m/s^2].
    slowness : float
        Factor on the time scale of the limits.
    """

    distance: float
    command: float
    slowness: float = 1.0

    def __post_init__(self) -> None:
        self._wind = self.distance

    def of(self, limits: Limits | None, loop: Loop) -> Limits | None:
        """Return the limits of the plan."""
        return None if limits is None else limits_left(limits, loop, self.command, self._wind, self.slowness)

    def leave(self, tube: VehicleTube | None, slower: bool) -> bool:
        """Leave more where a tube lacks it; return whether there is anything else to try.

        Without a tube the limits are scaled down, and with them the lag.
        """
        lag = self.distance - self._wind
        if tube is None:
            self.slowness, self.distance = SLOWER * self.slowness, self._wind + lag / SLOWER**2
            return slower
        place, push = (_missing(tube, unit) for unit in ("m", "m/s^2"))
        self.command += SPARE * push
        self.distance += SPARE * place
        if lag > 0.0 or place == push == 0.0:
            self.slowness *= SLOWER
        return slower or place > 0.0


def _tube(request: PlanRequest, loop: Loop, wind: float, curve: Trajectory) -> VehicleTube:
    """Return the tube of a plan with what was asked for, before it was narrowed."""
    corridor = request.corridor.corridor if isinstance(request.corridor, Sampled) else request.corridor
    places, gates = without_gates(request.waypoints)
    points = knot_positions(curve)[1] if places is None else np.asarray(places, dtype=np.float64)
    walls = walls_of(as_constraints(corridor), points)
    return vehicle_tube(loop, wind, curve, walls, gates, request.avoid or (), request.limits)


def _missing(tube: VehicleTube, unit: str) -> float:
    """Return how much more a tube needs of what has a unit; 0 where none is known."""
    short = [-tube.rooms[each.name] for each in tube.conditions if each.unit == unit]
    return max([value for value in short if np.isfinite(value)], default=0.0) if short and max(short) > 0.0 else 0.0
