"""When Skybrush's firmware takes off for a show: so that it is 2.5 m above its start when the curve is.

It climbs with a take-off speed and acceleration of its own and stops there, and is late for a curve that climbs faster:
what was proved of the curve does not hold until it has caught up. (libskybrush 99beb12,
``sb_trajectory_propose_takeoff_time_sec``; its callers set a negative time to zero.)
"""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, sqrt

import numpy as np

from minsnap.polynomials import basis
from minsnap.trajectory import Trajectory

ASCENT = 2.5
"""Height above its start from which a vehicle flies the curve [m]."""

CLIMBS = ((1.0, 4.0), (2.5, 1.0))
"""Speeds [m/s] and accelerations [m/s^2] of take-offs: of the firmware's own settings, and of ArduCopter's."""

LOOKED_AT = 129
"""Instants of a piece between which the ascent is found; the earlier one counts."""


def late_by(curves: Iterable[Trajectory]) -> float:
    """Return how long before the start of the clock the first vehicle would have to take off, at most [s].

    Negative where the show waits longer than it must; infinite where a vehicle never rises so far. Those that stay
    where they are do not count.
    """
    instants = [rises_at(curve) for curve in curves if np.ptp(curve.control_points.reshape(-1, 3), axis=0).any()]
    late = max(_travel_time(*each) for each in CLIMBS) - min(instants, default=inf)
    return late if max(instants, default=0.0) < inf else inf


def take_off_note(curves: Iterable[Trajectory]) -> str | None:
    """Return what keeps Skybrush's firmware from being with the curves after its take-off; None where nothing does."""
    late = late_by(curves)
    if late == inf:
        return f"a vehicle never rises by {ASCENT:g} m, from where Skybrush's firmware flies a show: climb higher"
    give = "let them climb slower, or wait for longer (take_off: {speed: ..., wait: ...})"
    return (
        f"Skybrush's firmware would have to take off {late:.2f} s before the show begins: {give}"
        if late > 0.0
        else None
    )


def rises_at(curve: Trajectory) -> float:
    """Return an instant up to which a curve has not risen by the ascent, close to when it does [s]; or infinity."""
    heights = curve.control_points[:, :, 2]
    target, shares = float(heights[0, 0]) + ASCENT, np.linspace(0.0, 1.0, LOOKED_AT)
    for piece in np.flatnonzero(heights.max(axis=1) >= target):
        above = np.flatnonzero(basis(curve.degree, shares) @ heights[piece] >= target)
        if len(above):
            return float(curve.breaks[piece] + curve.durations[piece] * shares[max(above[0] - 1, 0)])
    return inf


def _travel_time(speed: float, acceleration: float) -> float:
    """Return how long a climb of the ascent takes, from rest to rest [s]."""
    if ASCENT < speed * speed / acceleration:
        return 2.0 * sqrt(ASCENT / acceleration)
    return ASCENT / speed + speed / acceleration
