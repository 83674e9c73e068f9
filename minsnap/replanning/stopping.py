"""Stop plans: one polynomial from a state to hover, inside the walls of the leg or of the next one, and the limits.

First a family in closed form, along the motion: for each duration the polynomial of least cost whose end is at rest
anywhere.  Where none of it is inside, the place of the end is chosen too, by small cone programmes in the first leg.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import chain, islice

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.corridors.constraint import Walls
from minsnap.limits.compliance import kept_from
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.polynomials.bernstein import end_basis, ends_gram, ends_to_points, split
from minsnap.replanning.horizon import inside, walls_from, within
from minsnap.time_allocation.last_look import fault_as_one_leg
from minsnap.time_allocation.recovery import piece_demands, start_state, state_at, state_use, typical
from minsnap.time_allocation.single_piece import SinglePiece, conditions_of, walls_on
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class StopSettings:
    """What is tried for a stop, and how exactly it is judged.

    Parameters
    ----------
    durations : (float, float, int)
        Shortest and longest duration tried, in the time that stopping takes at the largest acceleration, and how many.
    together : int
        Durations looked at together: the shortest that does ends the search.
    programmed : (int, int)
        First duration for which a programme chooses the place of the end, and every how many-th follows.
    reaches : tuple of float
        By how much further than for the least cost it ends, in the way that the speed of the start makes meanwhile.
    legs : int
        Legs within which a stop may end.
    instants : int
        Instants at which the family is looked at before it is certified.
    inwards : float
        By how many widths it must be inside at the end of the piece, less before.
    briefest : float
        Time that stopping takes at least [s]: the jerk of much shorter polynomials has the rounding of their positions.
    exact_tries : int
        Candidates that are certified at most.
    on_limit : float
        How near to a limit a start counts as on it.
    across : float
        Component along a leg below which a wall is along it.
    """

    durations: tuple[float, float, int] = (0.6, 8.0, 24)
    together: int = 12
    programmed: tuple[int, int] = (2, 4)
    reaches: tuple[float, ...] = (0.0, -0.12, 0.12)
    legs: int = 2
    instants: int = 25
    inwards: float = 1e-4
    briefest: float = 0.15
    exact_tries: int = 6
    on_limit: float = 1e-6
    across: float = 1e-9


STOPS = StopSettings()
DURATIONS = np.geomspace(*STOPS.durations)
INSTANTS = np.linspace(0.0, 1.0, STOPS.instants)
INWARDS = STOPS.inwards * np.where(INSTANTS > 0.0, INSTANTS, -0.5)


@dataclass(frozen=True, eq=False)
class Candidate:
    """One polynomial: duration [s], control points (n + 1, dim) from the start, and where it enters the next leg."""

    duration: float
    points: FloatArray
    change: float | None = None

    def curve(self, origin: FloatArray) -> Trajectory:
        """Return it as a trajectory of one leg, or of two."""
        if self.change is None:
            return Trajectory(self.points[None] + origin, np.array([self.duration]))
        both = np.stack(split(self.points, self.change)) + origin
        return Trajectory(both, self.duration * np.array([self.change, 1.0 - self.change]))


@dataclass(frozen=True, eq=False)
class Stopping:
    """Stops from the start of a task.

    Parameters
    ----------
    task : Task
        Its first legs are those to stop in.
    limits : Limits or None
    deadline : Deadline
        End of the search for a stop: LateError where there is none by then.
    """

    task: Task
    limits: Limits | None
    deadline: Deadline = NEVER

    @cached_property
    def _walls(self) -> list[Walls]:
        legs = min(STOPS.legs, self.task.legs)
        return [*walls_from(self.task.walls, 0, legs), *_caps(self.task, legs)]

    @cached_property
    def _legs(self) -> list[list[Walls]]:
        """Walls of each leg to stop in."""
        origin = self.task.waypoints[0]
        return [walls_on(self._walls, leg, origin) for leg in range(min(STOPS.legs, self.task.legs))]

    @cached_property
    def _bounds(self) -> list[Walls]:
        walls = [] if self.limits is None else self.limits.walls(np.zeros((2, self.task.dim)))
        return walls_on(walls, 0, self.task.waypoints[0])

    @cached_property
    def _scales(self) -> tuple[float, float, float]:
        """A large speed and acceleration here, and the time that stopping takes with it."""
        state = start_state(self.task)
        speed, acceleration = typical(state, self.limits)
        moving = float(np.linalg.norm(state[1]) + 0.3 * np.linalg.norm(state[2]))
        return speed, acceleration, max(moving / acceleration, STOPS.briefest)

    def braking(self) -> Trajectory | None:
        """Return a certified member of the closed family; None where there is none.

        Raises
        ------
        LateError
            If the deadline would pass before that is known.
        """
        _, acceleration, unit = self._scales
        piece = SinglePiece(start_state(self.task), acceleration)
        parts = (unit * DURATIONS[first : first + STOPS.together] for first in range(0, len(DURATIONS), STOPS.together))
        families = (self._family(piece, durations) for durations in parts)
        return self._first_certified(chain.from_iterable(families))

    def aside(self) -> Trajectory | None:
        """Return a certified stop in the first leg, its end chosen by programmes; None, and LateError, as braking."""
        speed, acceleration, unit = self._scales
        piece = SinglePiece(start_state(self.task), acceleration, self.deadline)
        known = [*self._legs[0], *self._bounds]
        first, step = STOPS.programmed
        return self._first_certified(_programmes(piece, known, unit * DURATIONS[first::step], speed / acceleration))

    def _family(self, piece: SinglePiece, durations: FloatArray) -> Iterator[Candidate]:
        self.deadline.check()
        return _family(piece, self._legs, self._bounds, durations)

    def _first_certified(self, candidates: Iterator[Candidate]) -> Trajectory | None:
        origin = self.task.waypoints[0]
        for curve in islice((candidate.curve(origin) for candidate in candidates), STOPS.exact_tries):
            self.deadline.check()
            if inside(curve, self._walls) and back_within(curve, self.limits) and not self._misses(curve):
                return curve
        return None

    def _misses(self, curve: Trajectory) -> bool:
        """Whether a curve does not go on from the state of the start to rest, without a jump."""
        ends = np.stack((self.task.waypoints[0], curve.control_points[-1, -1]))
        return fault_as_one_leg(curve, ends, self.task.pins[0], self.task.half, curve.duration) is not None


def _caps(task: Task, legs: int) -> list[Walls]:
    """Planes at the end of legs whose walls run along them, such as tubes: their width beyond the waypoint."""
    caps: list[Walls] = []
    for leg in range(legs):
        along = task.waypoints[leg + 1] - task.waypoints[leg]
        along = along / np.linalg.norm(along)
        widths = [wall.width[wall.leg == leg].min() for wall in task.walls if _runs_along(wall, leg, along)]
        if widths:
            far = np.array([min(widths)])
            caps.append(Walls.planes(np.array([leg]), along[None], task.waypoints[[leg + 1]], -np.inf + far, far, far))
    return caps


def _runs_along(wall: Walls, leg: int, along: FloatArray) -> bool:
    own = wall.leg == leg
    parts = np.concatenate(((wall.slope[own] @ along).ravel(), (wall.matrix[own] @ along).ravel()))
    return wall.order == 0 and bool(own.any()) and bool((np.abs(parts) <= STOPS.across).all())


def _family(
    piece: SinglePiece, own: Sequence[Sequence[Walls]], bounds: Sequence[Walls], durations: FloatArray
) -> Iterator[Candidate]:
    """Members of the closed family that are inside at the instants looked at, shortest first."""
    durations = np.repeat(durations, len(STOPS.reaches))
    ends = piece.start_ends(durations)
    ends[:, piece.half :] = 0.0
    gram = ends_gram(piece.degree)
    ends[:, piece.half] = -np.einsum("j,mjd->md", gram[piece.half], ends) / gram[piece.half, piece.half]
    ends[:, piece.half] += np.tile(STOPS.reaches, len(durations) // len(STOPS.reaches))[:, None] * ends[:, 1]
    family = _Family(piece.degree, ends, durations)
    limited = family.excess(bounds).max(axis=1) <= 0.0
    within = [family.excess(walls) <= 0.0 for walls in own]
    before, after = np.logical_and.accumulate(within[0], axis=1), within[-1][:, ::-1]
    # A stop may pass from the first leg into the last: inside of one up to the change, of the other from it on.
    both = before & np.logical_and.accumulate(after, axis=1)[:, ::-1]
    for index in np.flatnonzero(limited & (before[:, -1] | both[:, 1:-1].any(axis=1))):
        change = None if before[index, -1] else _middle(both[index, 1:-1])
        yield Candidate(float(durations[index]), ends_to_points(piece.degree) @ ends[index], change)


@cache
def _basis(degree: int, order: int) -> FloatArray:
    """Factors of end derivatives in a derivative at the instants."""
    return end_basis(degree, order, INSTANTS)


def _middle(possible: BoolArray) -> float:
    """Return the possible inner instant nearest to the middle: short polynomials lose digits."""
    instants = INSTANTS[1:-1][possible]
    return float(instants[np.abs(instants - 0.5).argmin()])


@dataclass(frozen=True, eq=False)
class _Family:
    """Polynomials by their end derivatives (m, n + 1, dim) and durations (m,), at the instants looked at."""

    degree: int
    ends: FloatArray
    durations: FloatArray
    known: dict[int, FloatArray] = field(default_factory=dict)

    def values(self, order: int) -> FloatArray:
        """Return a derivative at every instant, (m, instants, dim)."""
        if order not in self.known:
            values = _basis(self.degree, order) @ self.ends
            self.known[order] = values / self.durations[:, None, None] ** order if order else values
        return self.known[order]

    def excess(self, walls: Sequence[Walls]) -> FloatArray:
        """Return the largest excess at every instant, moved inwards: (m, instants)."""
        worst = np.full((len(self.durations), len(INSTANTS)), -np.inf)
        for wall in walls:
            worst = np.maximum(worst, wall.excess_at(self.values(wall.order)).max(axis=2))
        return worst + INWARDS


def _programmes(
    piece: SinglePiece, known: Sequence[Walls], durations: FloatArray, moment: float
) -> Iterator[Candidate]:
    """Pieces whose end is at rest at the place that a programme chooses."""
    demands = [demand for wall in known for demand in piece_demands(wall, piece.state, moment)]
    conditions = conditions_of(demands)
    for duration in durations:
        solution = piece.solve(float(duration), piece.rest_ends(float(duration)), (0,), conditions)
        if solution is not None:
            yield Candidate(float(duration), solution)


def back_within(curve: Trajectory, limits: Limits | None) -> bool:
    """Whether a curve keeps all limits, or comes back to them where it starts outside of one."""
    if limits is None or within(curve, limits):
        return True
    state = state_at(curve, 0.0, 4)
    return state_use(state, limits) > 1.0 - STOPS.on_limit and kept_from(limits, curve) < 0.9 * curve.duration
