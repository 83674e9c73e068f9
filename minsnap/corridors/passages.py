"""Passages of gates by a finished plan: when, how fast, and how far from their edges."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import check_kind
from minsnap.basics.messages import shown
from minsnap.corridors.gates import Gate
from minsnap.errors import WaypointError
from minsnap.trajectory.trajectory import Trajectory


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


def gate_passages(
    trajectory: Trajectory, gates: Iterable[Any] | Mapping[int, Gate], within: float = 1e-6
) -> tuple[GatePassage, ...]:
    """Return the passages of gates, in the order of the flight: those of a plan are where its legs meet.

    Parameters
    ----------
    trajectory : Trajectory
        A plan through the gates, any number of laps.
    gates : iterable of Gate, or of waypoints with Gates among them, or mapping of int to Gate
        They have their places in it for numbers; points are passed over. A mapping gives them numbers of its own.
        Several that are one opening are passed in their order.
    within : float
        Distance from a gate's plane and opening at which a place counts as in it, over the path's extent.

    Raises
    ------
    WaypointError
        If one of them is neither a gate nor a point.
    """
    check_kind("what passes gates", trajectory, Trajectory, "a Trajectory")
    numbered = _numbered_gates(gates)
    instants = trajectory.leg_breaks
    places, speeds = trajectory(instants), np.linalg.norm(trajectory(instants, 1), axis=1)
    reach = within * max(1.0, float(np.ptp(places, axis=0).max()))
    passages = []
    for same in _openings(numbered):
        clear = clearances(same[0][1], places, reach)
        for turn, knot in enumerate(np.flatnonzero(clear > -reach)):
            figures = float(instants[knot]), float(speeds[knot]), max(float(clear[knot]), 0.0)
            passages.append(GatePassage(same[turn % len(same)][0], *figures))
    return tuple(sorted(passages, key=lambda passage: passage.instant))


def _openings(numbered: Iterable[tuple[int, Gate]]) -> Iterable[list[tuple[int, Gate]]]:
    """Return gates with their numbers, those together that are one opening, such as one of several laps."""
    found: dict[bytes, list[tuple[int, Gate]]] = {}
    for number, gate in numbered:
        found.setdefault(gate.corners.tobytes(), []).append((number, gate))
    return found.values()


def _numbered_gates(gates: Any) -> Iterator[tuple[int, Gate]]:
    """Yield the gates among waypoints with their numbers, those of a mapping or their places."""
    if not isinstance(gates, Iterable):
        raise WaypointError(f"the gates are {shown(gates)}: give gates, or waypoints with gates among them")
    for number, entry in gates.items() if isinstance(gates, Mapping) else enumerate(gates):
        if isinstance(entry, Gate):
            yield number, entry
        elif isinstance(gates, Mapping) or getattr(numbers(entry), "shape", None) not in ((2,), (3,)):
            raise WaypointError(f"gate {number} is {shown(entry)}: give a Gate, or a point, which is passed over")


def clearances(gate: Gate, places: FloatArray, reach: float) -> FloatArray:
    """Return distances of places (n, dim) to the nearest edge of an opening, negative outside of it or its plane."""
    offsets = places - gate.center
    sides, bounds = gate.edges()
    inside = (bounds + gate.margin - offsets @ sides.T).min(axis=1)
    return np.asarray(np.minimum(inside, np.where(np.abs(offsets @ gate.normal) <= reach, np.inf, -np.inf)))
