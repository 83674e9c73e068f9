"""Limits of ordinary flight, which hold where neither a limit nor a time is named, or not each limit.

One limit alone leaves the others to the search: a rectangle within 8 m/s would be flown at 73 m/s^2. Python's ``plan``
has exactly the limits that it is given, and its report says what is far from ordinary
(:mod:`minsnap.trajectory.report`); shapes, courses, files and commands have these.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike
from minsnap.basics.checks import check_waypoints
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits

BUILT_UP = 0.2
"""Time in which the acceleration is built up: what limits the jerk where it is not named [s]."""

ORDINARY = {"speed": 3.0, "acceleration": 6.0, "tilt": pi / 4.0, "jerk": 6.0 / BUILT_UP}
"""By name, in [m/s], [m/s^2], [rad] and [m/s^3]; an acceleration, named or not, stands for the tilt.

A metre to stop, a vehicle leaned by 38 degrees at most, and the largest tilt of PX4 unless set otherwise. A jerk of 30
m/s^3 turns a hovering vehicle by 30 / g = 3.1 rad/s, which is 175 degrees/s; PX4 allows 220 (``MC_ROLLRATE_MAX``).
Without a limit on it the shortest plans jump from one acceleration to another, at 2 % less time.
"""

POWER = "max_thrust"
"""A limit that describes what a vehicle can do: it stands for the ordinary ones."""

HEIGHT = 1.0
"""How far above and below its waypoints a path may go, or half of their span if that is more [m]."""


def ordinary_limits() -> Limits:
    """Return the limits that hold where neither limits nor a time are set: 3 m/s, 6 m/s^2 and 30 m/s^3."""
    values: dict[str, Any] = completed({})
    return Limits(**values)


def completed(said: Mapping[str, float | None]) -> dict[str, float]:
    """Return the limits that hold, by name, where some are named: the ordinary ones that are not named hold too.

    Where ``POWER`` is limited, exactly what is named holds.

    Parameters
    ----------
    said : mapping
        Limits by the names of the fields of :class:`~minsnap.Limits`, in their units; None takes one off.

    Raises
    ------
    LimitError
        If a name that is taken off is none of ``ORDINARY``.
    """
    named = {name: value for name, value in said.items() if value is not None}
    for name in said:
        if name not in named and name not in ORDINARY:
            raise LimitError(f"{name} is limited only where it is named: what can be taken off is {_names(ORDINARY)}")
    if POWER in named:
        return named
    filled = {name: value for name, value in ORDINARY.items() if name not in said}
    if "acceleration" in filled or "acceleration" in named:
        filled.pop("tilt", None)
    if "jerk" in filled:
        filled["jerk"] = named.get("acceleration", ORDINARY["acceleration"]) / BUILT_UP
    return {**named, **filled}


def written_in_file(limits: Mapping[str, float]) -> dict[str, float | None]:
    """Return limits as a file has to say them, so that those which do not hold are not read as ordinary ones."""
    if not limits or POWER in limits:
        return dict(limits)
    implied = {"tilt"} if "acceleration" in limits else set()
    return {**limits, **dict.fromkeys(name for name in ORDINARY if name not in {*limits, *implied})}


def ordinary_room(points: ArrayLike) -> tuple[list[float], list[float]]:
    """Return the floor and the ceiling of ordinary flight through waypoints of shape (n, 3), as two corners [m].

    A path within a small tilt alone would climb a hundred metres: thrust is what turns the tilt into acceleration.
    Waypoints above 0, which is the ground as a rule, are flown above it: a way around a box would lead under it.
    """
    where = check_waypoints(points)
    beyond = max(HEIGHT, 0.5 * float(np.ptp(where, axis=0).max()))
    lowest, high = float(where[:, 2].min()), float(where[:, 2].max()) + beyond
    low = max(lowest - beyond, 0.0) if lowest > 0.0 else lowest - beyond
    return [-np.inf, -np.inf, low], [np.inf, np.inf, high]


def _names(mapping: Mapping[str, float]) -> str:
    return ", ".join(mapping)
