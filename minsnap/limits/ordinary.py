"""Limits of ordinary flight, which hold on the command line and in files where they are not named.

One limit alone leaves the others to the search: a rectangle within 8 m/s would be flown at 73 m/s^2. In Python a plan
has the limits that it is given, and its report says what is far from ordinary (:mod:`minsnap.trajectory.report`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import pi
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits

ORDINARY = {"speed": 3.0, "acceleration": 6.0, "tilt": pi / 4.0}
"""By name, in [m/s], [m/s^2] and [rad]; an acceleration, named or not, stands for the tilt.

A metre to stop, a vehicle leaned by 38 degrees at most, and the largest tilt of PX4 unless set otherwise.
"""

POWER = "max_thrust"
"""A limit that describes what a vehicle can do: in a file it stands for the ordinary ones."""

HEIGHT = 1.0
"""How far above and below its waypoints a path may go, or half of their span if that is more [m]."""


def ordinary_limits() -> Limits:
    """Return the limits that hold where neither limits nor a time are set: 3 m/s and 6 m/s^2."""
    return Limits(speed=ORDINARY["speed"], acceleration=ORDINARY["acceleration"])


def completed(named: Mapping[str, float], off: Collection[str] = ()) -> dict[str, float]:
    """Return limits by name with the ordinary ones that are neither named nor taken off.

    Parameters
    ----------
    named : mapping
        Limits by the names of the fields of :class:`~minsnap.Limits`, in their units.
    off : collection of str
        Names of ``ORDINARY`` that are not to hold.

    Raises
    ------
    LimitError
        If a name of ``off`` is none of them, or is also named.
    """
    for name in off:
        if name not in ORDINARY:
            raise LimitError(f"{name} is limited only where it is named: what can be taken off is {_names(ORDINARY)}")
        if name in named:
            raise LimitError(f"the {name} is limited and its limit taken off: do one of them")
    filled = {name: value for name, value in ORDINARY.items() if name not in off and name not in named}
    if "acceleration" in filled or "acceleration" in named:
        filled.pop("tilt", None)
    return {**named, **filled}


def completed_in_file(said: Mapping[str, float | None]) -> dict[str, float]:
    """Return the limits of a file: None takes one off, and the thrust of a vehicle stands for the ordinary ones."""
    named = {name: value for name, value in said.items() if value is not None}
    return named if not said or POWER in said else completed(named, [name for name in said if name not in named])


def written_in_file(limits: Mapping[str, float]) -> dict[str, float | None]:
    """Return limits as a file has to say them, so that those which do not hold are not read as ordinary ones."""
    if not limits or POWER in limits:
        return dict(limits)
    implied = {"tilt"} if "acceleration" in limits else set()
    return {**limits, **dict.fromkeys(name for name in ORDINARY if name not in {*limits, *implied})}


def ordinary_room(points: ArrayLike) -> tuple[list[float], list[float]]:
    """Return the floor and the ceiling of ordinary flight through waypoints of shape (n, 3), as two corners [m].

    A path within a small tilt alone would climb a hundred metres: thrust is what turns the tilt into acceleration.
    """
    where = np.asarray(points, dtype=np.float64)
    beyond = max(HEIGHT, 0.5 * float(np.ptp(where, axis=0).max()))
    low, high = float(where[:, 2].min()) - beyond, float(where[:, 2].max()) + beyond
    return [-np.inf, -np.inf, low], [np.inf, np.inf, high]


def _names(mapping: Mapping[str, Any]) -> str:
    return ", ".join(mapping)
