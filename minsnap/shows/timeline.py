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
    group : str
        Which group flies it; empty for all.
    least : float
        No flight of its slowest vehicle is shorter [s]; 0 where its time is given.
    """

    name: str
    start: float
    arrival: float
    end: float
    method: str
    group: str = ""
    least: float = 0.0

    @property
    def longer(self) -> float | None:
        """By which share it is longer than any flight of its slowest vehicle, at most; None where its time is given."""
        return max((self.arrival - self.start) / self.least - 1.0, 0.0) if self.least > 0.0 else None


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

    def checked(self, name: str, now: float) -> float:
        """Return when a flight begins that can begin now [s]; a FleetError says where that, or its end, is before."""
        begins = self.begins(now)
        lasts = self.lasts(begins)
        if begins < now - EXACT or (lasts is not None and lasts < 0.0):
            raise FleetError(
                f"{name!r} is at {self.at:g} s, for which its flight would have to begin before "
                f"{now:.4g} s, when what is before it ends: give it later, or shorter holds"
            )
        return begins


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
    inner : tuple of Stage
        Those of groups, whose times count from its start.
    least : float
        As of a stage.
    """

    name: str
    curves: list[Trajectory]
    method: str
    hold: float
    given: GivenTime = UNTIMED
    inner: tuple[Stage, ...] = ()
    least: float = 0.0

    @property
    def duration(self) -> float:
        """Until the last vehicle arrives [s]."""
        return max((curve.duration for curve in self.curves), default=0.0)

    def scaled(self, inner: Sequence[Stage], whole: Stage) -> list[Stage]:
        """Return inner stages with their times in the show, of which the flight is a whole stage."""
        factor = (whole.arrival - whole.start) / self.duration if inner else 1.0

        def at(t: float) -> float:
            return whole.start + factor * t

        return [replace(each, start=at(each.start), arrival=at(each.arrival), end=at(each.end)) for each in inner]


def stages_of(flights: Sequence[PlannedFlight], stretches: FloatArray, wait: float) -> list[Stage]:
    """Return when each flight begins and ends after a wait [s], stretched where nothing says how long it lasts.

    Raises
    ------
    FleetError
        If a flight is to begin, or to be over, before the one before it is.
    """
    stages: list[Stage] = []
    for flight, stretch in zip(flights, stretches.tolist(), strict=True):
        begins = flight.given.checked(flight.name, stages[-1].end if stages else wait)
        lasts = flight.given.lasts(begins)
        if stages:
            stages[-1] = replace(stages[-1], end=begins)
        arrival = begins + (stretch * flight.duration if lasts is None else lasts)
        stages.append(Stage(flight.name, begins, arrival, arrival + flight.hold, flight.method, "", flight.least))
    return stages


def timed(
    flights: Sequence[PlannedFlight], stretches: FloatArray, wait: float, home: FloatArray
) -> tuple[list[Trajectory], list[Stage]]:
    """Return the curve of each vehicle and the stages, after a wait at home [s], shape (vehicles, 3)."""
    stages = stages_of(flights, stretches, wait)
    parts, now = [waiting(place, stages[0].start if stages else wait) for place in home], home
    for flight, stretch, stage in zip(flights, stretches.tolist(), stages, strict=True):
        lasts = stage.arrival - stage.start
        factor = stretch if flight.given == UNTIMED or not flight.curves else lasts / flight.duration
        curves = slower(flight.curves, factor)
        now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else now
        for i, (part, goal) in enumerate(zip(parts, now, strict=True)):
            flown = curves[i : i + 1]
            left = stage.end - stage.start - sum(curve.duration for curve in flown)
            part.extend([*flown, *waiting(goal, left)])
    return [joined(part) for part in parts], stages


def slower(curves: Sequence[Trajectory], factor: float) -> list[Trajectory]:
    """Return curves that last so many times as long."""
    return list(curves) if factor == 1.0 else [curve.stretched(factor) for curve in curves]


def waiting(point: FloatArray, duration: float) -> list[Trajectory]:
    """Return a curve that stays at a point, shape (3,), for so long [s]; none for no time."""
    return [Trajectory(np.tile(point, (1, 8, 1)), np.array([duration]))] if duration > 1e-9 else []


def delayed(curves: Sequence[Trajectory], delays: FloatArray, lasts: float) -> list[Trajectory]:
    """Return curves each of which begins so long after the first, shape (vehicles,), and waits at its end [s]."""
    return [
        joined([*waiting(curve(0.0), delay), curve, *waiting(curve(curve.duration), lasts - delay - curve.duration)])
        for curve, delay in zip(curves, delays.tolist(), strict=True)
    ]


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Return curves one after the other; all rest where they meet."""
    if not parts:
        raise FleetError("nothing moves in this show: give it a climb, or acts")
    points, durations = zip(*((part.control_points, part.durations) for part in parts), strict=True)
    return Trajectory(np.concatenate(points), np.concatenate(durations))
