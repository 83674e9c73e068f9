"""The factor on time at which the most used limit is just reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from minsnap.basics.limit_kinds import KIND
from minsnap.errors import LimitError
from minsnap.limits.compliance import KEPT
from minsnap.limits.limits import Limits
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory

LIMIT_MET, SECANTS, TIME_STEP = 2e-7, 6, 0.05
"""How near to 1 it is brought by the secant method, in how many steps, each how far at most."""

CROSSING_STEPS = 100
"""Steps in which a least thrust is looked for beyond the speed at which its vertical part is kept."""

OVERUSED = 2.0
"""Utilisation above which it does not matter by how much a limit is exceeded."""

SLOWEST = 40.0
"""Bound on the logarithm of a factor on time."""

FIRST_STEP, PRECISION = 0.02, 1e-13
"""Of the logarithm of a factor on time."""


def most_used(limits: Limits, trajectory: Trajectory) -> Utilisation:
    """Return the limit that is used most."""
    return max(limits.utilisation(trajectory), key=lambda used: used.fraction)


def touching_factor(limits: Limits, trajectory: Trajectory, guess: float | None = None) -> float:
    """Factor on time at which the most used limit is just reached, none exceeded.

    Parameters
    ----------
    guess : float, optional
        A factor from which some steps of the secant method may do, to ``LIMIT_MET``.

    Raises
    ------
    LimitError
        If the path uses none of the limits at any speed.
    """

    def over(logarithm: float, exact: bool = False) -> float:
        return _most_used_safely(limits, trajectory.stretched(float(np.exp(logarithm))), exact) - 1.0

    orders = [KIND[name].order for name in limits.given()]
    if guess is not None and not all(orders):
        nearby = nearby_factor(limits, trajectory.stretched(guess))
        if nearby is not None:
            return guess * nearby
    if not orders:
        raise LimitError("the limits are empty: set at least one, such as Limits(speed=3)")
    root = _by_powers(limits, trajectory, orders) if all(orders) else _by_bracket(over, limits)
    while over(root, True) > 0.0:
        root += PRECISION + abs(root) * 1e-12
    return float(np.exp(root))


def _by_powers(limits: Limits, trajectory: Trajectory, orders: Sequence[int]) -> float:
    """Logarithm of the factor for limits on derivatives, of which the one of order p is divided by its p-th power."""
    used = limits.utilisation(trajectory)
    factor = max(entry.fraction ** (1.0 / order) for entry, order in zip(used, orders, strict=True))
    if factor <= np.exp(-SLOWEST):
        raise nothing_limits(list(limits.given()))
    return float(np.log(factor))


def _by_bracket(over: Callable[..., float], limits: Limits) -> float:
    """Logarithm of the factor for any limits."""
    from scipy.optimize import brentq

    low, high, step = 0.0, 0.0, FIRST_STEP
    while over(high) > 0.0 and high < SLOWEST:
        low, high, step = high, high + step, 2.0 * step
    while low == high or over(low) <= 0.0:
        low, high, step = low - step, low, 2.0 * step
        if low < -SLOWEST:
            raise nothing_limits(list(limits.given()))
    root = float(brentq(over, low, high, xtol=PRECISION, rtol=1e-13))
    if limits.min_thrust is not None:
        root = _first_crossing(lambda logarithm: over(logarithm, True), root)
    return root


def nearby_factor(limits: Limits, trajectory: Trajectory, use: float | None = None) -> float | None:
    """Return the same factor where it is near one, by a few steps of the secant method; None if they do not find it.

    They end where more time means more use.

    Parameters
    ----------
    use : float, optional
        Share of the most used limit as the trajectory is, where it is known.
    """
    place, slope, best, last = 0.0, -2.0, np.inf, (np.nan, np.nan)
    for _ in range(SECANTS):
        if use is None:
            use = most_used(limits, trajectory.stretched(float(np.exp(place)))).fraction
        excess, use = float(np.log(np.clip(use, 1e-3, 1e3))), None
        if excess <= KEPT:
            best = min(best, place)
            if excess >= -LIMIT_MET:
                break
        if place > last[0] and excess > max(last[1], 0.0) + LIMIT_MET:
            break
        if place != last[0] and np.isfinite(last[0]):
            slope = float(np.clip((excess - last[1]) / (place - last[0]), -10.0, -0.2))
        last, place = (place, excess), float(place - np.clip((excess + 0.5 * LIMIT_MET) / slope, -TIME_STEP, TIME_STEP))
    else:
        return None
    return float(np.exp(best)) if np.isfinite(best) else None


def nothing_limits(names: Sequence[str]) -> LimitError:
    """Say that no limit ends the search."""
    used = " and ".join(KIND[name].label if name in KIND else name for name in names)
    return LimitError(f"nothing limits the time: the path keeps the limit on {used} at any speed; add another one")


def _first_crossing(over: Callable[[float], float], start: float) -> float:
    """First root of an excess below ``start``, in steps of FIRST_STEP; ``start`` if there is none nearby."""
    from scipy.optimize import brentq

    if over(start) > -KEPT:
        return start
    for step in range(CROSSING_STEPS):
        high, low = start - step * FIRST_STEP, start - (step + 1) * FIRST_STEP
        if over(low) > 0.0:
            return float(brentq(over, low, high, xtol=PRECISION, rtol=1e-13))
    return start


def _most_used_safely(limits: Limits, trajectory: Trajectory, exact: bool) -> float:
    """Largest utilisation, at most OVERUSED; unless exact, of the vertical part in place of the least thrust.

    The least thrust itself is not monotone in the time scale: a path so fast that its thrust is never small keeps it
    again.  Its vertical part is, and where that is kept the whole is.
    """
    fractions = [used.fraction for used in limits.utilisation(trajectory) if exact or used.name != "min_thrust"]
    if limits.min_thrust is not None and not exact:
        least = trajectory.extent((0.0, 0.0, 1.0), 2)[0] / limits.gravity + 1.0
        fractions.append(limits.min_thrust / least if least > 0.0 else OVERUSED)
    return min(max(fractions), OVERUSED)
