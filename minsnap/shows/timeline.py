"""The timeline of a show: flights one after the other, each stretched by a factor of its own, and holds after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.trajectory import Trajectory


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


@dataclass(frozen=True)
class GivenTime:
    """What a storyboard says of the time of a flight.

    Parameters
    ----------
    at : float or None
        When all have arrived, since the start of the show [s].
    seconds : float or None
        How long it lasts [s]; with ``at``, all wait until it must begin.
    """

    at: float | None = None
    seconds: float | None = None

    def begins(self, now: float) -> float:
        """Return when a flight begins that can begin now [s]."""
        return now if self.at is None or self.seconds is None else self.at - self.seconds

    def lasts(self, begins: float) -> float | None:
        """Return how long a flight lasts that begins then [s]; None where nothing says it."""
        return self.at - begins if self.at is not None else self.seconds


UNTIMED = GivenTime()


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
    given : GivenTime
        What is said of its time.
    """

    name: str
    curves: list[Trajectory]
    method: str
    hold: float
    given: GivenTime = UNTIMED

    @property
    def duration(self) -> float:
        """Until the last vehicle arrives [s]."""
        return max((curve.duration for curve in self.curves), default=0.0)


def stages_of(flights: Sequence[PlannedFlight], stretches: FloatArray, wait: float) -> list[Stage]:
    """Return when each flight begins and ends after a wait [s], stretched where nothing says how long it lasts.

    Raises
    ------
    FleetError
        If a flight is to begin, or to be over, before the one before it is.
    """
    stages: list[Stage] = []
    for flight, stretch in zip(flights, stretches.tolist(), strict=True):
        now = stages[-1].end if stages else wait
        begins = flight.given.begins(now)
        lasts = flight.given.lasts(begins)
        if begins < now - EXACT or (lasts is not None and lasts < 0.0):
            raise FleetError(
                f"{flight.name!r} is at {flight.given.at:g} s, for which its flight would have to begin before "
                f"{now:.4g} s, when what is before it ends: give it later, or shorter holds"
            )
        if stages:
            stages[-1] = replace(stages[-1], end=begins)
        arrival = begins + (stretch * flight.duration if lasts is None else lasts)
        stages.append(Stage(flight.name, begins, arrival, arrival + flight.hold, flight.method))
    return stages


def timed(
    flights: Sequence[PlannedFlight], stretches: FloatArray, wait: float, home: FloatArray
) -> tuple[list[Trajectory], list[Stage]]:
    """Return the curve of each vehicle and the stages, after a wait at home [s], shape (vehicles, 3)."""
    stages = stages_of(flights, stretches, wait)
    parts, now = [_wait(place, stages[0].start if stages else wait) for place in home], home
    for flight, stretch, stage in zip(flights, stretches.tolist(), stages, strict=True):
        lasts = stage.arrival - stage.start
        factor = stretch if flight.given == UNTIMED or not flight.curves else lasts / flight.duration
        curves = [curve if factor == 1.0 else _stretched(curve, factor) for curve in flight.curves]
        now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else now
        for i, (part, goal) in enumerate(zip(parts, now, strict=True)):
            flown = curves[i : i + 1]
            left = stage.end - stage.start - sum(curve.duration for curve in flown)
            part.extend([*flown, *_wait(goal, left)])
    return [_joined(part) for part in parts], stages


def _stretched(curve: Trajectory, factor: float) -> Trajectory:
    return Trajectory(curve.control_points, curve.durations * factor)


def _wait(point: FloatArray, duration: float) -> list[Trajectory]:
    return [Trajectory(np.tile(point, (1, 8, 1)), np.array([duration]))] if duration > 1e-9 else []


def delayed(curves: Sequence[Trajectory], delays: FloatArray) -> list[Trajectory]:
    """Return curves each of which begins so long after the first, shape (vehicles,) [s]; all wait for the last."""
    late = float(delays.max())
    return [
        _joined([*_wait(curve(0.0), delay), curve, *_wait(curve(curve.duration), late - delay)])
        for curve, delay in zip(curves, delays.tolist(), strict=True)
    ]


def _joined(parts: list[Trajectory]) -> Trajectory:
    """Return curves one after the other; all rest where they meet."""
    if not parts:
        raise FleetError("nothing moves in this show: give it a climb, or acts")
    points, durations = zip(*((part.control_points, part.durations) for part in parts), strict=True)
    return Trajectory(np.concatenate(points), np.concatenate(durations))
