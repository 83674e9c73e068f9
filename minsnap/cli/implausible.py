"""Paths that no vehicle flies, which commands do not write unless they are told to.

Most of them come from another unit or from times that do not suit the legs: latitudes and longitudes, millimetres,
milliseconds, one second for a leg of a decimetre.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import minsnap
from minsnap.basics.arrays import GRAVITY
from minsnap.corridors import in_degrees
from minsnap.errors import MagnitudeError

MOST_ACCELERATION = 100.0 * GRAVITY
"""A racing drone pulls some 10 g, a rocket that catches one some 50 g [m/s^2]."""

MOST_SPEED = 340.0
"""That of sound, near the ground [m/s]."""

UNITS = "are they metres and seconds, and not latitudes, millimetres or milliseconds?"


def refuse_implausible(path: minsnap.Path, figures: Mapping[str, Any]) -> None:
    """Raise where a path is none that a vehicle can be meant to fly.

    Parameters
    ----------
    path : Path
    figures : mapping
        ``max_speed`` and ``max_acceleration`` of it [m/s], [m/s^2].

    Raises
    ------
    MagnitudeError
        If it is faster than sound, takes over a hundred times gravity, leaves its waypoints by more than the length of
        any leg, or has waypoints that are latitudes and longitudes.
    """
    doubt = _of_motion(figures) or (_of_place(path) if isinstance(path, minsnap.Trajectory) and path.dim <= 3 else None)
    if doubt is not None:
        raise MagnitudeError(f"{doubt} With --force it is written as it is")


def _of_motion(figures: Mapping[str, Any]) -> str | None:
    speed, acceleration = figures["max_speed"], figures["max_acceleration"]
    if acceleration > MOST_ACCELERATION:
        return f"the path takes {acceleration:.4g} m/s^2, {acceleration / GRAVITY:.0f} times gravity: {UNITS}"
    if speed > MOST_SPEED:
        return f"the path is flown at {speed:.4g} m/s, faster than sound: {UNITS}"
    return None


def _of_place(path: minsnap.Trajectory) -> str | None:
    points = path(path.leg_breaks)
    degrees = in_degrees(points)
    if degrees is not None:
        return f"{degrees}."
    longest = float(np.linalg.norm(np.diff(points, axis=0), axis=1).max())
    beyond = max(
        max(low - least, most - high)
        for (least, most), low, high in zip(
            map(path.extent, np.eye(path.dim)), points.min(axis=0), points.max(axis=0), strict=True
        )
    )
    if not beyond > longest > 0.0:
        return None
    return (
        f"the path leaves its waypoints by {beyond:.4g} m, more than any of its legs is long ({longest:.4g} m): leave "
        "out the times, so that limits choose them, or give a corridor."
    )
