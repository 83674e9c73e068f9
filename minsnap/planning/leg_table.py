"""What a report knows of the legs of a flight, and how its time depends on each limit and on the room at waypoints.

The time is searched again within a little more and a little less of each, from the curve of the plan on, and the
difference is taken over both.  Neither of the other ways knows every limit: multipliers of the search are those of a
barrier, and the costate that proves the least time leaves out jerk, rates and rotors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.cached import cached_property
from minsnap.basics.deadline import Deadline
from minsnap.corridors.knot_regions import KnotRegion
from minsnap.durations.outcome import PlanOutcome, outcome_of
from minsnap.durations.starts import shortest_of_starts
from minsnap.durations.timing import Timing
from minsnap.durations.ways import end_on_limit, shortest_from
from minsnap.errors import MinsnapError
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.uses_over_time import legs_within
from minsnap.optimisation.task import Task
from minsnap.trajectory.leg_uses import LegUse, Sensitivity
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class SensitivitySettings:
    """By how much limits and rooms are changed.

    Parameters
    ----------
    limit : float
        Share of a limit: with 0.02 the sum that dimensions fix is met to 0.3 % (median); less is lost in the accuracy
        of the search, more in the curvature of the time.
    room : float
        Share of the smallest distance from the middle to the edge of a gate, a ball or a box.
    settled, gain : int, float
        How often the search is repeated from the curve of the plan on, at most, and while it gains that share.
    """

    limit: float = 0.02
    room: float = 0.1
    settled: int = 4
    gain: float = 5e-5


SETTINGS = SensitivitySettings()


@dataclass(frozen=True, eq=False)
class TimedCourse:
    """A question for the shortest time, and a curve that answers it.

    Parameters
    ----------
    task : Task
        With as many pieces a leg as the curve has, and its heading.
    timing : Timing
        For the shortest time within limits.
    curve : Trajectory
    """

    task: Task
    timing: Timing
    curve: Trajectory

    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """Return how the flight time depends on each limit and on the room at each waypoint.

        What no plan is found for on either side is left out; from one side alone the difference is taken there.
        """
        base = self._searched(self.task, self.timing.bounds, self.curve)
        for _ in range(SETTINGS.settled):  # what searches still gain is no difference
            again = None if base is None else self._searched(self.task, self.timing.bounds, base)
            if base is None or again is None or again.duration > (1.0 - SETTINGS.gain) * base.duration:
                break
            base = again
        if base is None:
            return ()
        return tuple(one for one in (*self._of_limits(base), *self._of_rooms(base)) if one is not None)

    def _searched(self, task: Task, limits: Limits, first: Trajectory) -> Trajectory | None:
        """Return the shortest flight that a search finds from a curve; None where it finds none."""
        timing = replace(self.timing, limits=limits, progress=None, refine=False)
        task = replace(task, deadline=Deadline(), explains=False)
        moving = 0 in task.moving or end_on_limit(task, limits)
        search: Callable[..., PlanOutcome] = shortest_from if moving else shortest_of_starts
        found = outcome_of(lambda: search(task, timing, first)).planned
        return None if found is None else found.trajectory

    def _of_limits(self, base: Trajectory) -> Iterator[Sensitivity | None]:
        limits = self.timing.bounds
        own = of_rotors(limits)
        for name, value in limits.given().items():
            if name not in own:
                yield self._differed(name, None, value, SETTINGS.limit * value, base, _with_limit(limits, name, value))
        if isinstance(limits, VehicleLimits):
            most = limits.vehicle.rotor_thrust_limits[1]
            yield self._differed("rotor_thrust", None, most, SETTINGS.limit * most, base, _with_rotors(limits, most))

    def _of_rooms(self, base: Trajectory) -> Iterator[Sensitivity | None]:
        task = self.task
        for waypoint in np.flatnonzero(task.held[:: task.pieces]).tolist():
            if task.closed and waypoint == task.legs:
                continue
            region, room = task.regions.get(waypoint), room_of(task, waypoint)
            name = "box" if region is None else region.what
            yield self._differed(name, waypoint, room, SETTINGS.room * room, base, _with_room(task, waypoint))

    def _differed(
        self,
        name: str,
        waypoint: int | None,
        value: float,
        step: float,
        base: Trajectory,
        changed: Callable[[float], Limits | Task],
    ) -> Sensitivity | None:
        """Return the difference of the times a step to both sides, each searched from base and from the other side."""
        found = {0.0: base}
        for change, start in ((-step, 0.0), (step, 0.0), (step, -step), (-step, step)):
            with suppress(MinsnapError):
                other = changed(change)
                task = other if isinstance(other, Task) else self.task
                limits = other if isinstance(other, Limits) else self.timing.bounds
                curve = self._searched(task, limits, found[start]) if start in found else None
                if curve is not None and (change not in found or curve.duration < found[change].duration):
                    found[change] = curve
        low, high = min(found), max(found)
        if low == high:
            return None
        return Sensitivity(name, waypoint, value, (found[high].duration - found[low].duration) / (high - low))


def of_rotors(limits: Limits) -> frozenset[str]:
    """Return the names of the limits that follow from the rotors' thrust."""
    if not isinstance(limits, VehicleLimits):
        return frozenset()
    alone = Limits.of(limits.vehicle, limits.reserve).given()
    return frozenset(name for name, value in limits.given().items() if alone.get(name) == value)


def room_of(task: Task, waypoint: int) -> float:
    """Return the smallest distance from a waypoint's nominal position to the edge of where it may lie [m]."""
    region, upper, lower = task.regions.get(waypoint), task.upper[waypoint], task.lower[waypoint]
    own = upper > lower  # but for axes across a slanted plane, along which the box is only around the region
    known: list[float] = []
    if region is not None:
        own = own if region.plane is None else own & (region.plane == 0.0)
        known = [region.radius, *region.bounds.tolist()]
    return float(min(*known, *upper[own], *-lower[own]))


def _with_limit(limits: Limits, name: str, value: float) -> Callable[[float], Limits]:
    def changed(change: float) -> Limits:
        other: dict[str, Any] = {name: value + change}
        return replace(limits, **other)

    return changed


def _with_rotors(limits: VehicleLimits, most: float) -> Callable[[float], Limits]:
    """Return limits for rotors of more thrust, with the same other limits."""
    vehicle, own = limits.vehicle, of_rotors(limits)
    others: dict[str, Any] = {name: value for name, value in limits.named().items() if name not in own}

    def changed(change: float) -> Limits:
        speed = vehicle.rotor_speed_max * float(np.sqrt((most + change) / most))
        return Limits.of(replace(vehicle, rotor_speed_max=speed), limits.reserve, norm=limits.norm, **others)

    return changed


def _with_room(task: Task, waypoint: int) -> Callable[[float], Task]:
    """Return the task with all edges of where a waypoint may lie moved outwards; of a lap at both of its ends."""
    knots = [waypoint, task.legs] if task.closed and waypoint == 0 else [waypoint]

    def changed(change: float) -> Task:
        lower, upper = (side.copy() for side in (task.lower, task.upper))
        regions = dict(task.regions)
        for knot in knots:
            wide = upper[knot] > lower[knot]
            lower[knot, wide] -= change
            upper[knot, wide] += change
            if knot in regions:
                regions[knot] = _wider(regions[knot], change)
        return replace(task, lower=lower, upper=upper, regions=regions)

    return changed


def _wider(region: KnotRegion, change: float) -> KnotRegion:
    wide = region.upper > region.lower
    return replace(
        region,
        lower=np.where(wide, region.lower - change, region.lower),
        upper=np.where(wide, region.upper + change, region.upper),
        radius=region.radius + change,
        bounds=region.bounds + change,
    )


class LegTable:
    """What a report knows of the legs, found at the first use.

    Parameters
    ----------
    curve : Trajectory
        The flight; it is kept without its report.
    limits : Limits or None
    question : TimedCourse or None
        Where the plan chose its time within limits.
    """

    def __init__(self, curve: Trajectory, limits: Limits | None, question: TimedCourse | None = None) -> None:
        self._curve, self._limits, self._question = curve.with_yaw(curve.yaw), limits, question

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the question, a task with a function of one call; what was found stays."""
        return vars(self) | {"_question": None}

    @cached_property
    def legs(self) -> tuple[LegUse, ...]:
        """Each leg of the flight."""
        return legs_within(self._curve, self._limits)

    @cached_property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """How the flight time depends on limits and rooms; empty where the plan did not choose its time."""
        return () if self._question is None else self._question.sensitivities()
