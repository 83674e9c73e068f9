"""The sentences of refusals of limits and times, each made of the few values that it names.

Rooms that search for durations find the evidence; here it becomes the error, with the evidence attached.  The caller
puts it into how its question ended, and where a public call ends it is raised.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from minsnap.basics.limit_kinds import KIND
from minsnap.errors import InfeasibleError, LimitError, SolverError, UnprovedError
from minsnap.trajectory.report import Utilisation

if TYPE_CHECKING:
    from minsnap.bounds.least_time import BelowLeast
    from minsnap.refusals.short_total import ShortTotal


class UnlimitedError(LimitError):
    """No limit ends a search for the shortest time: a total, or a price of time, may have a plan."""


def nothing_limits(names: Sequence[str]) -> UnlimitedError:
    """Say that a path keeps the limits of these names at any speed."""
    used = " and ".join(KIND[name].label if name in KIND else name for name in names)
    return UnlimitedError(f"nothing limits the time: the path keeps the limit on {used} at any speed; add another one")


def no_limits() -> LimitError:
    """Say that limits are asked for and none is set."""
    return LimitError("the limits are empty: set at least one, such as Limits(speed=3)")


def pinned_beyond(waypoint: int, used: Utilisation, value: float, at: bool) -> LimitError:
    """Say that a state pinned at a waypoint is at or beyond a limit, and to which value to change that."""
    change = "lower the limit to at most" if used.name == "min_thrust" else "raise the limit to at least"
    return LimitError(
        f"the state pinned at waypoint {waypoint} has {used.name} {used.value:.6g}, {'at' if at else 'beyond'} its "
        f"limit {used.limit:.6g}: {change} {value:.6g}",
        waypoint=waypoint,
        smallest=value,
    )


def no_connector(waypoint: int, used: Utilisation) -> LimitError:
    """Say that no way between the start or end, on or outside its limits, and a state with room was found."""
    if waypoint:
        what, leg = "the end has", waypoint - 1
        advice = f"no way to it inside the corridor was found: widen the corridor of leg {leg}, or end more slowly"
    else:
        what = "the start has"
        advice = "no way back inside the corridor was found: widen the corridor of leg 0, or slow down first"
    return LimitError(
        f"{what} {used.name} {used.value:.6g} where {used.limit:.6g} is allowed, and {advice}",
        waypoint=waypoint,
        smallest=used.value,
    )


def connector_too_long(duration: float, taken: float, leg: int | None) -> UnprovedError:
    """Say that the way between a state on its limits and one with room takes the time of a leg, or of the plan."""
    return UnprovedError(
        f"{'the plan' if leg is None else f'leg {leg}'} has {duration:.6g} s, and the way between its limits and "
        f"a state with room takes {taken:.4g} s: give it more time",
        leg=leg,
    )


def yaw_too_fast(used: Utilisation) -> LimitError:
    """Say that the yaw is a function of time, which no speed slows."""
    return LimitError(
        f"the yaw turns at {used.value:.4g} rad/s at {used.instant:.4g} s, however slow the plan, and "
        f"{used.limit:g} rad/s are allowed: give one that turns more slowly"
    )


def exceeded_by_a_search(used: Utilisation, corridor: bool, factor: float) -> SolverError:
    """Say which limit is exceeded by the plan that a search finds within a multiple of all limits."""
    return SolverError(
        f"no plan that keeps the limits{' inside the corridor' if corridor else ''} was found: in one for {factor:g} "
        f"times as much of each, {used.name} reaches {used.value:.6g} on leg {used.leg} at {used.instant:.4g} s where "
        f"{used.limit:.6g} is allowed; raise it or change the path"
    )


def exceeded_at_least_cost(total: float, used: Utilisation, drags: bool, factor: float | None) -> UnprovedError:
    """Say that the plan of least cost exceeds a limit, and which factor on its time would do, where that is known."""
    where = f"on leg {used.leg} at {used.instant:.4g} s" + (" with the vehicle's drag" if drags else "")
    message = f"the plan of least cost in {total:.6g} s does not keep {used.name}: it reaches {used.value:.6g} {where}"
    if factor is None:
        return UnprovedError(f"{message}; give more time", leg=used.leg, instant=used.instant)
    return UnprovedError(
        f"{message}; {total * factor:.6g} s would do in these proportions",
        leg=used.leg,
        instant=used.instant,
        shortest=total * factor,
        stretch=factor,
    )


def shorter_than_found(total: float, shortest: float) -> UnprovedError:
    """Say that a total is shorter than the shortest plan found."""
    return UnprovedError(
        f"no plan of {total:.6g} s within the limits was found: the shortest found is {shortest:.6g} s",
        shortest=shortest,
    )


def only_found(total: float, shortest: float) -> UnprovedError:
    """Say that the shortest plan found cannot be flown in a total, which is longer."""
    return UnprovedError(
        f"no plan of {total:.6g} s within the limits was found, only one of {shortest:.6g} s: give that time",
        shortest=shortest,
    )


def leg_too_short(proof: ShortTotal) -> InfeasibleError:
    """Say that a leg is too long for its time."""
    leg = proof.moves[0].start
    message = f"leg {leg} has {proof.total:.6g} s, and its length alone needs {float(proof.least):.6g} s"
    return InfeasibleError(f"{message}: give it more time", leg=leg, contradiction=proof)


def total_too_short(proof: ShortTotal, shortest: float | None) -> InfeasibleError:
    """Say that the lengths of the legs need more than a total; name the shortest plan found, if there is any."""
    known = "" if shortest is None else f", and the shortest found is {shortest:.6g} s"
    needed = f"the lengths of the legs alone need {float(proof.least):.6g} s{known}"
    message = f"{proof.total:.6g} s are too short for the limits: {needed}"
    return InfeasibleError(message, shortest=shortest, contradiction=proof)


def any_time_too_short(proof: ShortTotal, shortest: float | None) -> InfeasibleError:
    """Say that the lengths of the legs need more than the longest time that a plan may have."""
    message = "the limits on derivatives let no curve pass the waypoints in any time: loosen them"
    return InfeasibleError(message, shortest=shortest, contradiction=proof)


def below_least_time(proof: BelowLeast, shortest: float | None) -> InfeasibleError:
    """Say that every flight takes longer than a total; name the shortest plan found, if there is any."""
    known = "" if shortest is None else f", and the shortest found takes {shortest:.6g} s"
    message = f"{proof.total:.6g} s are too short for the limits: every flight takes {proof.least:.6g} s{known}"
    return InfeasibleError(message, shortest=shortest, contradiction=proof)


def unproved(refused: InfeasibleError) -> UnprovedError:
    """Return a refusal without its proof, which is not of all that was asked for: other times may have a plan."""
    if isinstance(refused, UnprovedError):
        return refused
    error = UnprovedError(str(refused), leg=refused.leg, instant=refused.instant, shortest=refused.shortest)
    error.smallest_width = refused.smallest_width
    return error
