"""Headings of acts: vehicles turn on their way to an act, and keep its heading until the next one that has another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FleetError
from minsnap.shows.timeline import Stage
from minsnap.trajectory import PlannedHeading, Trajectory, wrap

STEEPEST = 35.0 / 16.0
"""Largest slope of a rise from 0 to 1 in a unit of time, of degree 7 and at rest at both ends."""

TRACE = 1e-6
"""Time that is none [s]."""


@dataclass(frozen=True, eq=False)
class Turned:
    """Which heading a vehicle has in an act: an angle [rad], reached on the way there."""

    stage: Stage
    angle: float


def with_headings(curve: Trajectory, turned: Sequence[Turned], fastest: float | None) -> Trajectory:
    """Return a curve of a show with the headings of its acts, 0 before the first one.

    Parameters
    ----------
    curve : Trajectory
        At rest at both ends of each of its flights.
    turned : sequence of Turned
        In their order.
    fastest : float or None
        Limit on the yaw rate [rad/s].

    Raises
    ------
    FleetError
        If a turn is faster than that; says how long its flight would have to be.
    """
    pieces: list[FloatArray] = []
    ends, now = [0.0], 0.0
    for turn in turned:
        begins, arrives = _span(curve, turn.stage)
        angle = now + float(wrap(turn.angle - now))
        if abs(angle - now) <= 0.0:
            continue
        if fastest is not None and STEEPEST * abs(angle - now) > fastest * (arrives - begins) * (1.0 + 1e-9):
            needed = STEEPEST * abs(angle - now) / fastest
            text = f"vehicles turn by {np.degrees(abs(angle - now)):.3g} degrees on the flight to {turn.stage.name!r}"
            text = f"{text} in {arrives - begins:.3g} s, which takes {needed:.3g} s"
            raise FleetError(f"{text} within the yaw rate: give it more seconds")
        if begins > ends[-1] + TRACE:
            pieces.append(np.full(8, now))
            ends.append(begins)
        pieces.append(np.repeat([now, angle], 4))
        ends.append(arrives)
        now = angle
    if curve.duration > ends[-1] + TRACE or not pieces:
        pieces.append(np.full(8, now))
        ends.append(curve.duration)
    ends[-1] = curve.duration
    return curve.with_yaw(PlannedHeading(Trajectory(np.array(pieces)[..., None], np.diff(ends))))


def _span(curve: Trajectory, stage: Stage) -> tuple[float, float]:
    """Return from when to when a vehicle turns: while it flies there, else during the hold; at ends of its pieces."""
    breaks = curve.breaks
    begins = float(breaks[breaks <= stage.start + TRACE].max())
    within = breaks[(breaks > begins + TRACE) & (breaks <= stage.arrival + TRACE)]
    return begins, float(within.max() if len(within) else breaks[breaks > begins + TRACE].min())
