"""What a plan reaches where no limit holds it, said where it is far from ordinary flight."""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import GRAVITY, FloatArray

NOTED = (
    ("speed", 1, 15.0, "m/s", frozenset({"speed"})),
    ("acceleration", 2, 2.0 * GRAVITY, "m/s²", frozenset({"acceleration", "max_thrust", "rotor_thrust"})),
)
"""Quantity, order of the derivative, greatest value that is left unsaid, unit, and the limits that bound it."""

SPANS = 2.0
"""Greatest extent of a path, over that of its waypoints, that is left unsaid."""


class Spatial(Protocol):
    """What these notes need of a trajectory."""

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        ...

    @property
    def leg_breaks(self) -> FloatArray:
        """Times of the waypoints, shape (legs + 1,) [s]."""
        ...

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Return positions at instants, or a derivative."""
        ...

    def max_norm(self, order: int = 0) -> tuple[float, float]:
        """Return the largest norm of a derivative, and when."""
        ...

    def extent(self, direction: npt.ArrayLike, order: int = 0) -> tuple[float, float]:
        """Return the least and the largest component along a direction."""
        ...


def unlimited_notes(curve: Spatial, limited: Collection[str] = ()) -> tuple[str, ...]:
    """Return sentences about greatest values that no limit bounds: beyond 15 m/s, 2 g, twice the span of the waypoints.

    Parameters
    ----------
    curve : Trajectory
        Its waypoints are taken where its legs begin and end.
    limited : collection of str
        Names of the limits that it was planned with.

    Returns
    -------
    tuple of str
        Empty for an ordinary path, and for one of more than three coordinates, which need not be metres.
    """
    if curve.dim > 3:
        return ()
    open_ = [noted for noted in NOTED if not noted[-1].intersection(limited)]
    reached = [curve.max_norm(order)[0] for _, order, *_ in open_]
    notes = [
        f"the {name} is not limited and reaches {value:.4g} {unit}"
        for (name, _, most, unit, _), value in zip(open_, reached, strict=True)
        if value > most
    ]
    return (*notes, *_extent_note(curve))


def _extent_note(curve: Spatial) -> list[str]:
    """Return a sentence if the path goes far beyond its waypoints along an axis."""
    points = curve(curve.leg_breaks)
    span = float(np.ptp(points, axis=0).max())
    reach = max(np.subtract(*curve.extent(axis)[::-1]) for axis in np.eye(curve.dim))
    if not reach > SPANS * span > 0.0:
        return []
    return [
        f"the path goes over {reach:.4g} m along an axis, and its waypoints over {span:.4g} m: limit it, or give a Room"
    ]
