"""The least time of a course within limits, from below: no curve of any kind is quicker."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics import checks
from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.cards import card
from minsnap.basics.messages import explains_names
from minsnap.bounds.derivative_sets import bounding_sets
from minsnap.bounds.passed_course import PassedCourse, passed_course
from minsnap.corridors.constraint import Constraint, Walls, walls_of
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import Placement, place
from minsnap.corridors.tubes import Sampled, as_constraints, unsampled
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits, check_limits

if TYPE_CHECKING:
    from minsnap.bounds.costate_proof import CostateProof

ROUNDED = 1e-10
"""Share of what a proved time is the sum of by which it is rounded down, above the rounding of that sum."""

HALF = 6
"""Half the number of end derivatives that are read: those of the highest degree."""


@dataclass(frozen=True, eq=False)
class TimeBound:
    """A time that every flight of a course takes at least, whatever its curve, if it is as smooth as its question says.

    Parameters
    ----------
    seconds : float or None
        Proved, rounded down [s]; None where nothing bounds the time.
    left_out : tuple of str
        Limits and walls that it does not know: flights within them may take longer.
    reason : str
        Why there is none; empty where there is one.
    proof : CostateProof or None
    """

    seconds: float | None
    left_out: tuple[str, ...] = ()
    reason: str = ""
    proof: CostateProof | None = None

    def verify(self) -> bool:
        """Prove it again, in exact rational arithmetic of the stored numbers; some milliseconds a leg.

        Returns
        -------
        bool
            False also where there is no bound.
        """
        from minsnap.bounds.exact_proof import proves

        return self.seconds is not None and self.proof is not None and proves(self.proof, self.seconds)

    def _repr_html_(self) -> str:
        """Return the card of a notebook."""
        known = None if self.seconds is None else f"{self.seconds:.6g} s"
        left = ", ".join(self.left_out) or None
        return card("Least time", [("at least", known), ("without", left), ("none", self.reason or None)])


@explains_names({})
def least_time(
    waypoints: ArrayLike | Sequence[object] | None,
    limits: Limits,
    corridor: ArrayLike | Constraint | Sequence[object] | Sampled | None = None,
    waypoint_tolerance: ArrayLike | Ball | None = None,
    start: Mapping[str, ArrayLike] | None = None,
    end: Mapping[str, ArrayLike] | None = None,
    *,
    closed: bool = False,
    degree: int = 7,
) -> TimeBound:
    """Return a time below which no flight passes the waypoints within limits: no polynomial, and no other curve.

    Speed, acceleration, thrust and tilt bound it; jerk, snap, body rate and the torque of a vehicle's rotors do so at
    ends where the flight hovers. Other limits and the walls of a corridor are left out and named.

    Parameters
    ----------
    waypoints, limits, corridor, waypoint_tolerance, start, end, closed, degree
        As :func:`minsnap.plan` takes them: at rest unless ``start`` or ``end`` says otherwise. There is no bound yet
        where the velocity at an end is free. The derivatives up to (degree - 1) / 2 are continuous in all the flights:
        to hover takes an acceleration that is zero and continuous for jerk and body rate, and for snap and rotors a
        jerk that is so too.

    Returns
    -------
    TimeBound
        Its ``seconds``, and ``verify()``, which proves them anew.

    Raises
    ------
    WaypointError, LimitError, CorridorError
        If an argument is malformed.
    """
    check_limits(limits)
    if not limits.given():
        raise LimitError("the limits are empty: set at least one, such as Limits(speed=3)")
    constraints = as_constraints(unsampled(corridor, True)[0])
    knots, lap = as_knots(waypoints, waypoint_tolerance), checks.check_flag("closed", closed)
    (first, start), (last, end) = checks.check_position(start, "start"), checks.check_position(end, "end")
    placement = place(knots, constraints, first, last, lap)
    pinned = checks.check_pins(None, start, end, lap, HALF, placement.points)
    checks.check_closing(lap, placement.points)
    checks.refuse_repeated(placement.points, "leave one of them out")
    free = np.full(placement.points.shape[1], np.nan)
    final = len(placement.points) - 1
    ends = None if lap else np.stack([pinned[knot].get(1, free) for knot in (0, final)])
    gates = {} if knots is None else knots.gates
    calm = calm_orders(pinned, final, checks.check_degree(degree) - 1)
    named = names_of(walls_of(constraints, placement.points))
    return TimeQuestion(placement, gates, ends, limits, named, calm).bound


def calm_orders(pins: Mapping[int, Mapping[int, ArrayLike]], last: int, most: int) -> tuple[int, int]:
    """Return the orders up to which all derivatives pinned at the first and the last waypoint are zero."""
    orders = [0, 0]
    for end, knot in enumerate((0, last)):
        pinned = pins.get(knot, {})
        while orders[end] < most and not np.any(pinned.get(orders[end] + 1, 1.0)):
            orders[end] += 1
    return orders[0], orders[1]


def names_of(walls: Iterable[Walls]) -> tuple[str, ...]:
    """Return what keeps positions inside, by name, each once."""
    return tuple(dict.fromkeys(f"the {wall.name}" for wall in walls if not wall.order))


@dataclass(frozen=True, eq=False)
class TimeQuestion:
    """What a plan was asked for, whose bound is found when somebody asks for it.

    Parameters
    ----------
    placement : Placement
    gates : mapping of int to Gate
        By waypoint.
    ends : ndarray, shape (2, dim), or None
        Velocities at both ends [m/s], not a number where any will do; None for a lap.
    limits : Limits
    beside : tuple of str
        What the flights keep besides: a corridor, obstacles, pins on the way.
    calm : tuple of int
        Order up to which the derivatives of the flights are zero at start and end, and continuous; of a lap, any.
    """

    placement: Placement
    gates: Mapping[int, Gate]
    ends: FloatArray | None
    limits: Limits
    beside: tuple[str, ...] = ()
    calm: tuple[int, int] = (0, 0)

    @cached_property
    def bound(self) -> TimeBound:
        """The bound of all flights that keep the limits."""
        if self.placement.points.shape[1] > 3:
            return TimeBound(None, reason="it is known of up to three coordinates")
        if self.ends is not None and np.isnan(self.ends).any():
            return TimeBound(None, reason="the velocity at an end is free")
        course = passed_course(self.placement, self.gates, self.ends, self.calm)
        return bound_of(course, self.limits, self.beside)


def bound_of(course: PassedCourse, limits: Limits, beside: tuple[str, ...] = ()) -> TimeBound:
    """Return the bound of a course; ``beside`` names what flights keep besides the limits."""
    from minsnap.bounds.costate_search import bounds_legs, longest_proof

    sets = bounding_sets(limits, course.dim)
    left_out = (*sets.left_out, *beside)
    if not (sets.accelerations or sets.velocities):
        return TimeBound(None, left_out, "neither a speed nor an acceleration is bounded all around")
    course = course.apart()
    if not course.advances:
        return TimeBound(None, left_out, "the course may be passed without moving")
    if not bounds_legs(course, sets):
        return TimeBound(None, left_out, "neither a speed nor an acceleration is bounded along every leg")
    proof = longest_proof(course, sets)
    if proof is None:
        return TimeBound(None, left_out, "no proof was found: it takes the native core")
    grown = {one.name for g, one in enumerate(proof.growing) if proof.hovering[..., g, :].any()}
    left_out = tuple(f"{name} away from hover" if name in grown else name for name in left_out)
    seconds, size = proof.seconds()
    seconds -= ROUNDED * size
    if not seconds > 0.0:
        return TimeBound(None, left_out, "no time above zero was proved")
    return TimeBound(seconds, left_out, "", proof)


@dataclass(frozen=True, eq=False)
class BelowLeast:
    """A time that is too short for every flight.

    Parameters
    ----------
    total : float
        [s].
    bound : TimeBound
        With a time above it.
    """

    total: float
    bound: TimeBound

    @property
    def least(self) -> float:
        """The time that every flight takes at least [s]."""
        return 0.0 if self.bound.seconds is None else self.bound.seconds

    def verify(self) -> bool:
        """Prove in exact rational arithmetic that no flight is so short."""
        return self.least > self.total and self.bound.verify()
