"""How a curve passes its waypoints and gates: how far from them, when and how fast, and whether where they let it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.gates import Gate
from minsnap.corridors.knot_regions import Placement
from minsnap.trajectory.trajectory import Trajectory


def knot_positions(traj: Trajectory) -> FloatArray:
    """Positions at the waypoints' instants where a leg ends and where one starts: (2, legs + 1, dim) [m]."""
    starts, ends = traj.control_points[:: traj.pieces, 0], traj.control_points[traj.pieces - 1 :: traj.pieces, -1]
    return np.stack((np.concatenate((starts[:1], ends)), np.concatenate((starts, ends[-1:]))))


def passing(traj: Trajectory, placement: Placement) -> tuple[float, bool]:
    """Measure how far a curve passes from its waypoints, beyond their tolerance, and whether it passes all.

    Returns
    -------
    excess : float
        Largest distance, on either side of a knot [m].
    passes : bool
        Whether that is 0, and gates are passed in their direction, to rounding: ``Placement.rounding`` of a
        distance, ``EXACT`` of the largest speed.
    """
    excess = max(float(placement.outside(side).max()) for side in knot_positions(traj))
    return excess, excess <= placement.rounding and _crossed(traj, placement)


def _crossed(traj: Trajectory, placement: Placement) -> bool:
    crossings = [(k, region.crossing) for k, region in placement.regions.items() if region.crossing is not None]
    if not crossings:
        return True
    velocity, size = traj(traj.leg_breaks, 1), traj.max_norm(1)[0]
    return all(float(velocity[k] @ crossing) >= -EXACT * size for k, crossing in crossings)


@dataclass(frozen=True)
class GatePassage:
    """One passage of a gate.

    Parameters
    ----------
    gate : int
        Which of the gates, counted from 0.
    instant : float
        [s].
    speed : float
        [m/s].
    clearance : float
        Distance from the middle of the vehicle to the nearest edge of the opening [m].
    """

    gate: int
    instant: float
    speed: float
    clearance: float


def gate_passages(trajectory: Trajectory, gates: Iterable[Gate], within: float = 1e-6) -> tuple[GatePassage, ...]:
    """Return the passages of gates, in the order of the flight: those of a plan are where its legs meet.

    Parameters
    ----------
    trajectory : Trajectory
        A plan through the gates, any number of laps.
    gates : iterable of Gate
        Other waypoints are left out before.
    within : float
        Distance from a gate's plane and opening at which a place counts as in it, over the path's extent.
    """
    instants = trajectory.leg_breaks
    places, speeds = trajectory(instants), np.linalg.norm(trajectory(instants, 1), axis=1)
    reach = within * max(1.0, float(np.ptp(places, axis=0).max()))
    passages = []
    for index, gate in enumerate(gates):
        clear = clearances(gate, places, reach)
        for knot in np.flatnonzero(clear > -reach):
            passages.append(
                GatePassage(index, float(instants[knot]), float(speeds[knot]), max(float(clear[knot]), 0.0))
            )
    return tuple(sorted(passages, key=lambda passage: passage.instant))


def numbered_passages(trajectory: Trajectory, gates: Mapping[int, Gate]) -> tuple[GatePassage, ...]:
    """Return the passages of gates that have numbers of their own, such as their places among waypoints."""
    numbers = list(gates)
    passages = gate_passages(trajectory, gates.values())
    return tuple(replace(passed, gate=numbers[passed.gate]) for passed in passages)


def clearances(gate: Gate, places: FloatArray, reach: float) -> FloatArray:
    """Return distances of places (n, dim) to the nearest edge of an opening, negative outside of it or its plane."""
    offsets = places - gate.center
    sides, bounds = gate.edges()
    inside = (bounds + gate.margin - offsets @ sides.T).min(axis=1)
    return np.asarray(np.minimum(inside, np.where(np.abs(offsets @ gate.normal) <= reach, np.inf, -np.inf)))
