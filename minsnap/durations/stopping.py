"""Stop plans: one polynomial from a state to hover, inside the walls of the leg or of the next one, and the limits.

First a family in closed form, along the motion, natively: ``native/src/stopping``.  Where none of it is inside, the
place of the end is chosen too, by small cone programmes in the first leg.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.corridors.constraint import Walls, walls_from
from minsnap.durations.connector import piece_demands, pinned_state, state_use, typical
from minsnap.durations.single_piece import SinglePiece, conditions_of
from minsnap.limits.compliance import keeps, kept_from
from minsnap.limits.limits import Limits
from minsnap.native.stops import ProvedStop, StopFamily
from minsnap.optimisation.task import Task
from minsnap.trajectory.trajectory import Trajectory, made


@dataclass(frozen=True)
class StopSettings:
    """When a stop counts as one, and what programmes try; the family has its own, in ``native/src/stopping``.

    Parameters
    ----------
    programmed : (float, float, int)
        Shortest and longest duration for which a programme chooses the place of the end, in the time that stopping
        takes at the largest acceleration, and how many.
    briefest : float
        Time that stopping takes at least [s]: the jerk of much shorter polynomials has the rounding of their positions.
    on_limit : float
        How near to a limit a start counts as on it.
    """

    programmed: tuple[float, float, int] = (0.75, 7.15, 6)
    briefest: float = 0.15
    on_limit: float = 1e-6


STOPS = StopSettings()


@dataclass(frozen=True, eq=False)
class Stopping:
    """Stops from the start of a task.

    Parameters
    ----------
    task : Task
        Its first legs are those to stop in; ``finish`` gives a stop its heading.
    limits : Limits or None
    deadline : Deadline
        End of the search for a stop: LateError where there is none by then.
    """

    task: Task
    limits: Limits | None
    deadline: Deadline = NEVER

    @cached_property
    def _state(self) -> FloatArray:
        return pinned_state(self.task)

    @cached_property
    def _bounds(self) -> tuple[Walls, ...]:
        return () if self.limits is None else tuple(self.limits.walls(np.zeros((2, self.task.dim))))

    @cached_property
    def _scales(self) -> tuple[float, float, float]:
        """A large speed and acceleration here, and the time that stopping takes with it."""
        speed, acceleration = typical(self._state, self.limits)
        moving = hypot(*self._state[1]) + 0.3 * hypot(*self._state[2:3].ravel())
        return speed, acceleration, max(moving / acceleration, STOPS.briefest)

    @cached_property
    def _stops(self) -> StopFamily:
        walls, bounds = ([wall.record for wall in walls] for walls in (self.task.walls, self._bounds))
        return StopFamily(self._state, self.task.waypoints, walls, bounds, self._scales[2])

    def braking(self) -> Trajectory | None:
        """Return a certified member of the closed family; None where there is none.

        Raises
        ------
        LateError
            If the deadline would pass before that is known.
        """
        return self._first_within(self._stops.members())

    def aside(self) -> Trajectory | None:
        """Return a certified stop in the first leg, its end chosen by programmes; None, and LateError, as braking."""
        return self._first_within(self._programmed())

    def _first_within(self, stops: Iterator[ProvedStop]) -> Trajectory | None:
        """Return the first stop that keeps the limits: by the proof that it has, or as they are measured."""
        self.deadline.check()
        proves = self.limits is None or (type(self.limits) is Limits and self.limits.body_rate is None)
        for stop in stops:
            self.deadline.check()
            curve = self.task.finish(made(stop.points, stop.durations))
            if (proves and stop.limited) or back_within(curve, self.limits):
                return curve
        return None

    def _programmed(self) -> Iterator[ProvedStop]:
        """Yield stops in the first leg whose end is at rest at the place that a programme chooses."""
        speed, acceleration, unit = self._scales
        piece, origin = SinglePiece(self._state, acceleration, self.deadline), self.task.waypoints[0]
        own = (wall.from_origin(origin) for wall in walls_from([*self.task.walls, *self._cap(), *self._bounds], 0, 1))
        demands = [demand for wall in own for demand in piece_demands(wall, piece.state, speed / acceleration)]
        conditions = conditions_of(demands)
        for duration in (unit * np.geomspace(*STOPS.programmed)).tolist():
            points = piece.solve(duration, piece.rest_ends(duration), (0,), conditions)
            stop = None if points is None else self._stops.proved(duration, points)
            if stop is not None:
                yield stop

    def _cap(self) -> list[Walls]:
        """Return the plane that ends the first leg, where its walls run along it: their width beyond the waypoint."""
        far, (start, end) = self._stops.caps[:1], self.task.waypoints[:2]
        along = (end - start) / hypot(*(end - start))
        return [Walls.planes([0], along[None], end[None], [-np.inf], far, far)] if np.isfinite(far).all() else []


def back_within(curve: Trajectory, limits: Limits | None) -> bool:
    """Whether a curve keeps all limits, or comes back to them where it starts outside of one."""
    if limits is None or keeps(limits, curve):
        return True
    state = curve.states(0.0, 4)
    return state_use(state, limits) > 1.0 - STOPS.on_limit and kept_from(limits, curve) < 0.9 * curve.duration
