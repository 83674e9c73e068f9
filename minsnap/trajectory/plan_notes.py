"""What is said of a plan whose numbers are beyond what quadrotors fly, or may be in another unit than metres, seconds.

One function for each sentence, in the table ``NOTES``. What is given, and not found, is doubted where it is read: see
:class:`~minsnap.errors.MagnitudeWarning`.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.basics.cached import cached_property

NOTED = (
    ("speed", 1, 15.0, "m/s", frozenset({"speed"})),
    ("acceleration", 2, 2.0 * GRAVITY, "m/s²", frozenset({"acceleration", "max_thrust", "rotor_thrust"})),
    ("jerk", 3, 10.0 * GRAVITY, "m/s³", frozenset({"jerk", "snap", "body_rate", "rotor_thrust"})),
)
"""Quantity, order of the derivative, greatest value that is left unsaid, unit, and the limits that bound it.

A jerk of 10 g turns a hovering vehicle by 10 rad/s.
"""


@dataclass(frozen=True)
class NoteSettings:
    """From where on something is said.

    Parameters
    ----------
    spans : float
        Extent of a path over that of its waypoints.
    ground : float
        How far below the ground a path goes [m].
    long : float
        Duration of a leg that may be milliseconds [s], where its mean speed is below ``creeping``.
    creeping : float
        [m/s].
    small : float
        Extent of waypoints that may be kilometres [m].
    wide : float
        Half-width of a tube that may be centimetres [m], where it is ``wider`` times as long as every leg.
    wider : float
    """

    spans: float = 2.0
    ground: float = 0.01
    long: float = 500.0
    creeping: float = 0.02
    small: float = 0.05
    wide: float = 3.0
    wider: float = 2.0


SAID = NoteSettings()


@dataclass(frozen=True, eq=False)
class _Planned:
    """A curve of up to three coordinates, with the names of its limits and the half-widths of its tube."""

    curve: Any
    limited: Collection[str]
    widths: FloatArray | None

    @cached_property
    def points(self) -> FloatArray:
        """Where its legs begin and end, shape (n, dim) [m]."""
        return np.asarray(self.curve(self.curve.leg_breaks))

    @cached_property
    def lengths(self) -> FloatArray:
        """Of its legs, shape (n - 1,) [m]."""
        return np.asarray(np.linalg.norm(np.diff(self.points, axis=0), axis=1))


def plan_notes(curve: Any, limited: Collection[str] = (), widths: FloatArray | None = None) -> tuple[str, ...]:
    """Return sentences about a plan: greatest values that no limit bounds, and what may be in another unit.

    Parameters
    ----------
    curve : Trajectory
        Its waypoints are taken where its legs begin and end.
    limited : collection of str
        Names of the limits that it was planned with.
    widths : ndarray or None
        Half-widths of the tube around its legs [m].

    Returns
    -------
    tuple of str
        Empty for an ordinary path, and for one of more than three coordinates, which need not be metres.
    """
    if curve.dim > 3:
        return ()
    planned = _Planned(curve, limited, widths)
    return tuple(sentence for note in NOTES for sentence in note(planned))


def _unlimited(planned: _Planned) -> list[str]:
    return [
        f"the {name} is not limited and reaches {value:.4g} {unit}"
        for name, order, most, unit, bounding in NOTED
        if not bounding.intersection(planned.limited) and (value := planned.curve.max_norm(order)[0]) > most
    ]


def _extent(planned: _Planned) -> list[str]:
    """Whether the path goes far beyond its waypoints along an axis."""
    span = float(np.ptp(planned.points, axis=0).max())
    reach = max(np.subtract(*planned.curve.extent(axis)[::-1]) for axis in np.eye(planned.curve.dim))
    if not reach > SAID.spans * span > 0.0:
        return []
    return [
        f"the path goes over {reach:.4g} m along an axis, and its waypoints over {span:.4g} m: limit it, or give a Room"
    ]


def _ground(planned: _Planned) -> list[str]:
    """Whether the path goes below the ground, at an altitude of zero, and its waypoints do not."""
    if planned.curve.dim != 3 or planned.points[:, 2].min() < 0.0:
        return []
    lowest = float(planned.curve.extent(np.eye(3)[2])[0])
    if not lowest < -SAID.ground:
        return []
    return [f"the path goes down to z = {lowest:.3g} m, below the ground if that is at 0: give a Room, or a corridor"]


def _milliseconds(planned: _Planned) -> list[str]:
    times, lengths = np.diff(planned.curve.leg_breaks), planned.lengths
    slow = np.flatnonzero((times >= SAID.long) & (lengths > 0.0) & (lengths < SAID.creeping * times))
    if not slow.size:
        return []
    leg = int(slow[0])
    return [f"leg {leg} takes {times[leg]:g} s over {lengths[leg]:.4g} m: if that is milliseconds, divide it by 1000"]


def _kilometres(planned: _Planned) -> list[str]:
    span = float(np.ptp(planned.points, axis=0).max())
    if not 0.0 < span < SAID.small:
        return []
    return [f"all waypoints are within {1e3 * span:.3g} mm: if they are kilometres, multiply them by 1000"]


def _centimetres(planned: _Planned) -> list[str]:
    widths = planned.widths
    bounded = np.zeros(0) if widths is None else widths[np.isfinite(widths)]
    widest, longest = float(bounded.max(initial=0.0)), float(planned.lengths.max())
    if widest < SAID.wide or widest < SAID.wider * longest:
        return []
    return [
        f"the corridor is {widest:g} m to each side of legs of up to {longest:.4g} m: if that is centimetres, divide "
        "it by 100"
    ]


NOTES = (_unlimited, _extent, _ground, _milliseconds, _kilometres, _centimetres)
"""What each says, in this order."""
