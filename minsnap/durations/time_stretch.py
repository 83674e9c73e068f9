"""Factors on time: at which the most used limit is just reached, and walls on derivatives are kept.

A derivative of order p is divided by the p-th power of a factor on time.  Walls around zero, such as a greatest
velocity, are kept by all factors from one on; others, such as a least velocity, may be kept by none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import ceil, exp, inf, isfinite, log, nan
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.deadline import NEVER, WORK, Deadline
from minsnap.basics.limit_kinds import KIND
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import nearest_wall
from minsnap.errors import SolverError
from minsnap.limits.compliance import KEPT, most_used
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.refusals.sentences import no_limits, nothing_limits
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.instants import LONGEST_PIECE
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.optimisation.task import Task


@dataclass(frozen=True)
class StretchSettings:
    """How exactly a factor on time is found, mostly by its logarithm.

    Parameters
    ----------
    precision, rough_precision : float
        Of its logarithm where it is bracketed, and where it is only compared with others.
    first_step, largest_factor : float
        The first step of the bracket, and the bound at which nothing limits.
    met, nearly_met, secant_steps, secant_step : float, float, int, float
        How near to 1 a use is brought by the secant method, one that is proved and one at samples, in how many steps,
        each how far at most.
    grains : float
        In 1: factors on time are rounded up to a whole number of them.
    crossing_steps : int
        Steps in which a least thrust is looked for beyond the speed at which its vertical part is kept.
    largest_measured_use : float
        Use above which it does not matter by how much a limit is exceeded.
    wall_precision, doublings : float, int
        Of a factor with which walls on derivatives are kept, and how often one is doubled until they are.
    surely_exceeded : float
        Use at samples beyond which it need not be proved that a curve exceeds its limits.
    jump_depth : float
        How far below 1 the logarithm of a use falls at a factor where it jumps, as where a yaw turns around.
    """

    precision: float = 1e-13
    rough_precision: float = 1e-5
    first_step: float = 0.02
    largest_factor: float = 40.0
    met: float = 2e-7
    nearly_met: float = 2e-5
    secant_steps: int = 6
    secant_step: float = 0.05
    grains: float = 2.0**32
    crossing_steps: int = 100
    largest_measured_use: float = 1e6
    wall_precision: float = 1e-10
    doublings: int = 20
    surely_exceeded: float = 1.05
    jump_depth: float = 0.01


STRETCH = StretchSettings()


def measuring_work(limits: Limits, pieces: int, yaw: Heading | None = None) -> float:
    """Return the price of how far limits are used along a curve of so many pieces, or with a yaw of many more."""
    if not isinstance(limits, VehicleLimits):
        return WORK.limits_used if limits.yaw_rate is None else WORK.yaw_rate_used
    turns = 0 if yaw is None or yaw.polynomial is None else len(yaw.polynomial.durations)
    return WORK.rotors_used * (WORK.pieces_besides + max(pieces, turns // WORK.yaw_pieces))


def touching_factor(
    limits: Limits,
    trajectory: Trajectory,
    guess: float | None = None,
    roughly: bool = False,
    deadline: Deadline = NEVER,
) -> float:
    """Factor on time at which the most used limit is just reached, none exceeded.

    Parameters
    ----------
    guess : float, optional
        A factor from which some steps of the secant method may do, to ``STRETCH.met``.
    roughly : bool
        Whether ``STRETCH.rough_precision`` does, and uses between samples need not be proved.
    deadline : Deadline
        That counts the work.

    Raises
    ------
    LimitError
        If the path uses none of the limits at any speed.
    SolverError
        If it keeps them at none.
    """
    most = log(LONGEST_PIECE / float(trajectory.durations.max()) * (1.0 - ROUNDING))
    price = measuring_work(limits, len(trajectory.durations), trajectory.yaw)

    @cache
    def over(logarithm: float, whole: bool = False, proved: bool = True) -> float:
        deadline.spend(price)
        used = _most_used_safely(limits, trajectory.stretched(float(np.exp(logarithm))), whole, proved)
        return float(np.log(max(used, 1.0 / STRETCH.largest_measured_use)))  # nearly linear in the factor's

    if not limits.given():
        raise no_limits()
    powers = powers_factor(limits, trajectory)
    if guess is not None and powers is None:
        nearby = nearby_factor(limits, trajectory.stretched(guess).stretched, deadline=deadline)
        if nearby is not None:
            return guess * nearby
    if powers is not None and powers <= np.exp(-STRETCH.largest_factor):
        raise nothing_limits(list(limits.given()))
    sampled, start = partial(over, proved=False), float(np.log(guess or 1.0))
    root = _by_bracket(sampled, limits, start, most, roughly) if powers is None else float(np.log(powers))
    if powers is None and not roughly and over(root, True) > STRETCH.met:  # what is between the samples is more
        nearby = nearby_factor(limits, trajectory.stretched(float(np.exp(root))).stretched, deadline=deadline)
        root = _by_bracket(over, limits, root, most) if nearby is None else root + float(np.log(nearby))
    while not roughly and (excess := over(root, True)) > 0.0:
        root += STRETCH.precision + abs(root) * 1e-12 + 0.5 * excess
    return float(np.exp(root))


def powers_factor(limits: Limits, trajectory: Trajectory) -> float | None:
    """Return the same factor of limits on derivatives, one of order p divided by its p-th power; None for others."""
    orders = [KIND[name].order for name in limits.given()]
    if not orders or not all(orders):
        return None
    used = limits.utilisation(trajectory)
    return max(float(entry.fraction ** (1.0 / order)) for entry, order in zip(used, orders, strict=True))


def _by_bracket(over: Callable[..., float], limits: Limits, start: float, most: float, roughly: bool = False) -> float:
    """Logarithm of the factor, sought from one on, for any limits."""
    low, high, step = start, start, STRETCH.first_step
    while over(high) > 0.0 and high < most:
        low, high, step = high, min(high + step, most), 2.0 * step
    if over(high) > 0.0:
        raise SolverError("no speed was found at which the path keeps its limits: loosen a limit")
    while low == high or over(low) <= 0.0:
        low, high, step = low - step, low, 2.0 * step
        if low < -STRETCH.largest_factor:
            raise nothing_limits(list(limits.given()))
    root = _root(over, low, high, STRETCH.rough_precision if roughly else STRETCH.precision)
    if limits.min_thrust is not None:
        root = _first_crossing(lambda logarithm: over(logarithm, True), root)
    return root


def _root(over: Callable[[float], float], low: float, high: float, precision: float) -> float:
    """Root of an excess that falls from ``low`` to ``high``, or a place just beyond a jump through zero."""
    from scipy.optimize import brentq

    def ended_at_jumps(logarithm: float) -> float:
        nonlocal low
        excess = over(logarithm)
        low = max(low, logarithm) if excess > 0.0 else low
        return 0.0 if excess < -STRETCH.jump_depth and logarithm - low < STRETCH.rough_precision else excess

    root = float(brentq(ended_at_jumps, low, high, xtol=precision, rtol=1e-13))
    return grained(root) if over(root) < -STRETCH.jump_depth else root


def nearby_factor(
    limits: Limits,
    flown: Callable[[float], Trajectory],
    proved: bool = True,
    met: float = STRETCH.met,
    deadline: Deadline = NEVER,
) -> float | None:
    """Return the same factor where it is near one, by a few steps of the secant method; None if they do not find it.

    They end where more time means more use.

    Parameters
    ----------
    flown : callable
        The path flown more slowly by a factor, each of which is a grained one.
    proved : bool
        Whether uses between samples count, where limits are proved by bounds.
    met : float
        How near to 1 the use is brought.
    deadline : Deadline
        That counts the work.
    """
    place, best, last = 1.0, inf, (nan, nan)
    for _ in range(STRETCH.secant_steps):
        curve = flown(place)
        price = measuring_work(limits, len(curve.durations), curve.yaw)
        deadline.spend(price)
        used = most_used(limits, curve, False)
        if proved and used.fraction <= STRETCH.surely_exceeded:
            deadline.spend(price)
            used = most_used(limits, curve)
        excess = log(min(max(used.fraction, 1e-3), 1e3))
        if excess <= KEPT:
            best = min(best, place)
            if excess >= -met:
                break
        if place > last[0] and excess > max(last[1], 0.0) + met:
            break
        known = isfinite(last[0]) and place != last[0]
        slope = (excess - last[1]) / log(place / last[0]) if known else _slope(used, curve, limits.gravity)
        step = (excess + 0.5 * met) / min(max(slope, -10.0), -0.2)
        step = min(max(step, -STRETCH.secant_step), STRETCH.secant_step)
        last, place = (place, excess), grained(place * exp(-step))
    else:
        return None
    return best if isfinite(best) else None


def _slope(used: Utilisation, curve: Trajectory, gravity: float) -> float:
    """Slope of the logarithm of a use in that of the factor on time: where it is largest, others need not be looked at.

    It is exact for limits on a derivative, and for thrusts without drag.
    """
    kind = KIND[used.name]
    if kind.order or kind.measure not in ("thrust", "least_thrust"):
        return -(kind.order or 2.0)
    acceleration = curve(used.instant, 2)
    force = acceleration + (0.0, 0.0, gravity)
    slope = -2.0 * float((acceleration * force).sum()) / (float((force * force).sum()) or 1.0)
    return -slope if kind.least else slope


def grained(factor: float) -> float:
    """Round a factor up, so that the last bits of exact extrema do not decide a plan."""
    return ceil(factor * STRETCH.grains) / STRETCH.grains


def _first_crossing(over: Callable[[float], float], start: float) -> float:
    """First root of an excess below ``start``, in steps of STRETCH.first_step; ``start`` if there is none nearby."""
    if over(start) > -KEPT:
        return start
    for step in range(STRETCH.crossing_steps):
        high, low = start - step * STRETCH.first_step, start - (step + 1) * STRETCH.first_step
        if over(low) > 0.0:
            return _root(over, low, high, STRETCH.precision)
    return start


def _most_used_safely(limits: Limits, trajectory: Trajectory, whole: bool, proved: bool) -> float:
    """Largest utilisation, up to a use that need not be measured; unless whole, a least thrust by its vertical part.

    The least thrust itself is not monotone in the time scale: a path so fast that its thrust is never small keeps it
    again.  Its vertical part is, and where that is kept the whole is.
    """
    fractions = [used.fraction for used in limits.utilisation(trajectory, proved) if whole or used.name != "min_thrust"]
    if limits.min_thrust is not None and not whole:
        least = trajectory.extent((0.0, 0.0, 1.0), 2)[0] / limits.gravity + 1.0
        fractions.append(limits.min_thrust / least if least > 0.0 else STRETCH.largest_measured_use)
    return min(max(fractions), STRETCH.largest_measured_use)


def on_derivatives(walls: Sequence[Walls]) -> list[Walls]:
    """Return those walls that bound a derivative."""
    return [wall for wall in walls if wall.order]


def without_derivative_walls(task: Task) -> Task:
    """Return a task with its walls on positions alone, which no change of time breaks."""
    kept = [wall for wall in task.walls if not wall.order]
    return task if len(kept) == len(task.walls) else replace(task, walls=kept)


def walled_factor(walls: Sequence[Walls], curve: Trajectory, least: float) -> float | None:
    """Return the least factor on time, from one on, with which a curve keeps walls; None without one.

    Parameters
    ----------
    walls : sequence of Walls
        Those on positions are kept or broken by every factor alike.
    curve : Trajectory
    least : float
        Factor from which on it is looked for.
    """
    bounded = on_derivatives(walls)

    def keeps(factor: float) -> bool:
        # without the yaw, which takes longer to follow than walls take to measure
        slower = Trajectory(curve.control_points, curve.durations * factor, pieces=curve.pieces)
        nearest = nearest_wall(slower, bounded)
        return nearest is None or nearest.value >= 0.0

    if not bounded or keeps(least):
        return least
    low = high = least
    for _ in range(STRETCH.doublings):
        low, high = high, 2.0 * high
        if keeps(high):
            break
    else:
        return None
    while high - low > STRETCH.wall_precision * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return high


def kept_factor(
    limits: Limits,
    walls: Sequence[Walls],
    curve: Trajectory,
    roughly: bool = False,
    deadline: Deadline = NEVER,
) -> float:
    """Return the least factor on time with which a curve keeps limits and walls on derivatives.

    Parameters are those of :func:`touching_factor`.

    Raises
    ------
    LimitError
        If the path uses none of the limits at any speed.
    SolverError
        If walls are kept by no factor with which the limits are.
    """
    factor = walled_factor(walls, curve, grained(touching_factor(limits, curve, roughly=roughly, deadline=deadline)))
    if factor is None:
        raise SolverError("no speed was found at which the path keeps its limits and the walls on derivatives")
    return factor
