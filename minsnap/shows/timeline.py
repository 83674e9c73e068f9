"""The timeline of a show: flights one after the other, each stretched by a factor of its own, and holds after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FleetError
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class Stage:
    """One flight of a show, and the hold after it.

    Parameters
    ----------
    name : str
        Where it leads.
    start, arrival, end : float
        [s].
    method : str
        How it was planned, or ``"kept"`` from an earlier run.
    """

    name: str
    start: float
    arrival: float
    end: float
    method: str


@dataclass(frozen=True, eq=False)
class PlannedFlight:
    """One flight of a show as it was planned.

    Parameters
    ----------
    name : str
        Where it leads.
    curves : list of Trajectory
        Of each vehicle, from rest to rest; none where all stay.
    method : str
        How it was planned.
    hold : float
        How long all stay after it [s].
    """

    name: str
    curves: list[Trajectory]
    method: str
    hold: float

    @property
    def duration(self) -> float:
        """Until the last vehicle arrives [s]."""
        return max((curve.duration for curve in self.curves), default=0.0)


def timed(
    flights: Sequence[PlannedFlight], stretches: FloatArray, wait: float, home: FloatArray
) -> tuple[list[Trajectory], list[Stage]]:
    """Return the curve of each vehicle and the stages, after a wait at home [s], shape (vehicles, 3)."""
    parts, stages, now, start = [_wait(place, wait) for place in home], [], home, wait
    for flight, stretch in zip(flights, stretches.tolist(), strict=True):
        arrival = start + stretch * flight.duration
        curves = [curve if stretch == 1.0 else _stretched(curve, stretch) for curve in flight.curves]
        now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else now
        for i, (part, goal) in enumerate(zip(parts, now, strict=True)):
            flown = curves[i : i + 1]
            left = arrival - start - sum(curve.duration for curve in flown) + flight.hold
            part.extend([*flown, *_wait(goal, left)])
        stages.append(Stage(flight.name, start, arrival, arrival + flight.hold, flight.method))
        start = arrival + flight.hold
    return [_joined(part) for part in parts], stages


def _stretched(curve: Trajectory, factor: float) -> Trajectory:
    return Trajectory(curve.control_points, curve.durations * factor)


def _wait(point: FloatArray, duration: float) -> list[Trajectory]:
    return [Trajectory(np.tile(point, (1, 8, 1)), np.array([duration]))] if duration > 1e-9 else []


def _joined(parts: list[Trajectory]) -> Trajectory:
    """Return curves one after the other; all rest where they meet."""
    if not parts:
        raise FleetError("nothing moves in this show: give it a climb, or acts")
    points, durations = zip(*((part.control_points, part.durations) for part in parts), strict=True)
    return Trajectory(np.concatenate(points), np.concatenate(durations))
