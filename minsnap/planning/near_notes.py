"""What a path passes nearer than a vehicle's radius: plans are of points, and vehicles have a size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from minsnap.corridors.gate_frames import Bar
from minsnap.corridors.gates import Gate
from minsnap.corridors.keep_out import Avoided, called
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.corridors.passages import gate_passages
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.trajectory.trajectory import Trajectory

RADIUS = 0.15
"""How far a vehicle of unknown size reaches from its middle, with propellers of five inches [m]."""


def near_notes(
    curve: Trajectory, gates: Mapping[int, Gate], obstacles: Sequence[Avoided], limits: Limits | None
) -> tuple[str, ...]:
    """Return sentences about gates and obstacles that are passed nearer than a vehicle's radius.

    A gate with a margin, its frame too, and one that is nowhere so narrow, is passed as it is meant.

    Parameters
    ----------
    curve : Trajectory
        A plan through the gates and outside of the obstacles.
    gates : mapping of int to Gate
        By the numbers that the sentences call them.
    obstacles : sequence of Obstacle
    limits : Limits or None
        Those of a vehicle say how far its rotors are from its middle.
    """
    radius = limits.vehicle.arm_length if isinstance(limits, VehicleLimits) else RADIUS
    return (*_of_gates(curve, gates, radius), *_of_obstacles(curve, obstacles, radius))


def _of_gates(curve: Trajectory, gates: Mapping[int, Gate], radius: float) -> list[str]:
    open_gates = {number: gate for number, gate in gates.items() if not gate.margin}
    near = [passed for passed in gate_passages(curve, open_gates) if passed.clearance < radius]
    if not near:
        return []
    nearest, count = min(near, key=lambda passed: passed.clearance), len({passed.gate for passed in near})
    which = f"gate {nearest.gate}" if count == 1 else f"{count} gates, the nearest of them gate {nearest.gate},"
    return [
        f"the path passes {which} {nearest.clearance:.2g} m from its edge, nearer than a vehicle's radius of "
        f"{radius:g} m: give gates a margin"
    ]


def _of_obstacles(curve: Trajectory, obstacles: Sequence[Avoided], radius: float) -> list[str]:
    open_ones = [which for which, each in enumerate(obstacles) if not (isinstance(each, Bar) and each.clearance)]
    if not open_ones:
        return []
    near = nearest_obstacle(curve, [obstacles[which] for which in open_ones])
    if near.value >= radius:
        return []
    which = open_ones[near.obstacle]
    passed = f"the path passes {called(obstacles, which)} {max(near.value, 0.0):.2g} m from its surface"
    if isinstance(obstacles[which], Bar):
        advice = f", nearer than a vehicle's radius of {radius:g} m: give the gate a margin"
    else:
        size = "smaller" if near.fence else "larger"
        advice = f": unless its size has room for the vehicle's radius, such as {radius:g} m, make it {size}"
    return [f"{passed} at {near.instant:.4g} s{advice}"]
