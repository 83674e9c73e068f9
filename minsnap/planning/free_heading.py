r"""A constant heading that the plan chooses: the best of a few, where limits of rotors depend on it.

Rotors spin a body about its thrust axis where it banks to its side, and the less the thrust leans along the heading,
the less they have to.  So the first that is tried is across the main direction of motion, that of the least eigenvector
of the sum of :math:`d d^\top / \|d\|` over the horizontal parts d of the legs.  Half a turn changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, pi, radians
from typing import Generic, TypeVar

import numpy as np

from minsnap.basics.arrays import FloatArray, significant
from minsnap.basics.deadline import LateError
from minsnap.errors import InfeasibleError, SolverError, UnprovedError
from minsnap.limits.limits import Limits, VehicleLimits

Plan = TypeVar("Plan")


@dataclass(frozen=True)
class FreeHeadingSettings:
    """Which headings are tried.

    Parameters
    ----------
    beside : float
        How far from the first one two others are, one to each side [rad].
    alike : int
        Digits to which flight times, or costs, have to differ to decide.
    """

    beside: float = radians(15.0)
    alike: int = 6


SETTINGS = FreeHeadingSettings()


@dataclass(frozen=True)
class Headed(Generic[Plan]):
    """A plan and its heading.

    Parameters
    ----------
    plan : object
    angle : float
        [rad].
    note : str
        Which heading it is, and what it gains over a yaw of 0.
    """

    plan: Plan
    angle: float
    note: str


def headings_for(limits: Limits | None, points: FloatArray) -> list[float]:
    """Return the headings to try, in this order [rad]; only 0 where no limit depends on the heading.

    Parameters
    ----------
    limits : Limits or None
    points : ndarray, shape (n, dim)
        Waypoints [m].
    """
    if not isinstance(limits, VehicleLimits):
        return [0.0]
    first = heading_across(points)
    angles = [first, 0.0, first + SETTINGS.beside, first - SETTINGS.beside]
    return list(dict.fromkeys(significant(pi / 2.0 - (pi / 2.0 - angle) % pi, 12) for angle in angles))


def heading_across(points: FloatArray) -> float:
    """Return the heading across the main direction of motion through points (n, dim), in [0, pi) [rad]."""
    steps = np.diff(points, axis=0)[:, :2]
    lengths = np.sqrt((steps**2).sum(axis=1))
    along = steps / np.sqrt(np.where(lengths > 0.0, lengths, 1.0))[:, None]
    (xx, xy), (_, yy) = (along.T @ along).tolist()
    main = 0.5 * np.arctan2(2.0 * xy, xx - yy)  # of the greatest eigenvector
    return float((main + pi / 2.0) % pi)


def choose_heading(
    angles: Sequence[float],
    plan: Callable[[float], Plan],
    value: Callable[[Plan], tuple[float, float]],
    what: str,
    ended: Callable[[Plan], bool],
) -> Headed[Plan]:
    """Plan at each heading and return the best, the first of equal ones.

    Parameters
    ----------
    angles : sequence of float
        [rad]; 0 among them.
    plan : callable
        Plans at a heading.
    value : callable
        What is to be small of a plan: its flight time or cost, and its use of the limits among equal ones.
    what : str
        What that first number is, such as "time".
    ended : callable
        Whether a plan was ended from outside, so that no other follows.

    Raises
    ------
    InfeasibleError, SolverError
        If there is no plan at any of them; the refusal of the first one.
    """
    plans: dict[float, Plan] = {}
    refused: Exception | None = None
    for angle in angles:
        try:
            plans[angle] = plan(angle)
        except (InfeasibleError, SolverError) as error:
            refused = refused or error
            if isinstance(error, InfeasibleError) and not isinstance(error, UnprovedError):
                raise  # what is proved holds for every heading
            if isinstance(error, LateError) and plans:
                break
            continue
        if ended(plans[angle]):
            break
    if refused is not None and not plans:
        raise refused
    values = {angle: (significant(value(one)[0], SETTINGS.alike), value(one)[1]) for angle, one in plans.items()}
    best = min(plans, key=lambda angle: values[angle])
    return Headed(plans[best], best, _said(best, {angle: one[0] for angle, one in values.items()}, len(angles), what))


def _said(best: float, values: dict[float, float], tried: int, what: str) -> str:
    if tried == 1:
        return "no limit depends on the heading, so it is 0 degrees"
    said = f"the heading is {degrees(best) + 0.0:.0f} degrees, the best of {len(values)} tried"
    if 0.0 not in values:
        return f"{said}; at 0 degrees no plan was found"
    gain = 1.0 - values[best] / values[0.0]
    return f"{said}: {100.0 * gain:.2g} % less {what} than at 0 degrees" if gain > 0.0 else said
