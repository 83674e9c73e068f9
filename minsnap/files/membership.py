"""Check whether samples stay inside a corridor, for files that do not say when each leg begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import walls_of
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import WaypointError
from minsnap.trajectory.samples import Samples


@dataclass(frozen=True)
class Membership:
    """Least margin of samples inside a corridor.

    Parameters
    ----------
    margin : float
        Least distance to a wall over all samples [m]; negative outside.
    instant : float
        When it is least [s].
    leg : int
        The leg that sample was counted to, from 0.
    """

    margin: float
    instant: float
    leg: int

    @property
    def ok(self) -> bool:
        """True when no sample is outside."""
        return self.margin >= 0.0


def check_membership(samples: Samples, waypoints: FloatArray, corridor: Any) -> Membership:
    """Return the least margin of samples in a corridor, with the most favourable assignment of samples to legs.

    Samples pass the legs in order, from the first to the last; of all assignments of samples to legs, the one with the
    largest least margin is used. Only the samples are checked, not the curve between them.

    Parameters
    ----------
    samples : Samples
        m of them.
    waypoints : ndarray, shape (n, dim)
        Ends of the legs [m].
    corridor : float, array_like, Constraint or sequence of Constraint
        As :func:`minsnap.plan` takes it.

    Raises
    ------
    WaypointError
        If the waypoints have other coordinates than the samples, or the samples are fewer than the legs.
    """
    points = np.asarray(waypoints, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != samples.dim or len(points) < 2:
        raise WaypointError(f"waypoints of shape {points.shape} do not go with samples of {samples.dim} coordinates")
    if len(samples) < len(points) - 1:
        raise WaypointError(f"{len(samples)} samples cannot run through {len(points) - 1} legs")
    margins = leg_margins(samples.position, points, corridor)
    leg = _assign(margins)
    chosen = margins[leg, np.arange(len(samples))]
    worst = int(chosen.argmin())
    return Membership(float(chosen[worst]), float(samples.t[worst]), int(leg[worst]))


def leg_margins(position: FloatArray, waypoints: FloatArray, corridor: Any) -> FloatArray:
    """Return the margin of every position, shape (m, dim), in every leg: (legs, m), infinite without walls."""
    margins = np.full((len(waypoints) - 1, len(position)), np.inf)
    for wall in walls_of(as_constraints(corridor), waypoints):
        if wall.order == 0:
            np.minimum.at(margins, wall.leg, wall.slack(position[None]))
    return margins


def _assign(margins: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the leg of each sample, non-decreasing, with the largest least margin, by dynamic programming."""
    legs, count = margins.shape
    best = np.full(legs, -np.inf)
    best[0] = margins[0, 0]
    moved = np.zeros((count, legs), dtype=bool)
    for i in range(1, count):
        before = np.concatenate([[-np.inf], best[:-1]])
        moved[i] = before > best
        best = np.minimum(margins[:, i], np.maximum(best, before))
    leg = np.empty(count, dtype=np.intp)
    leg[-1] = legs - 1
    for i in range(count - 1, 0, -1):
        leg[i - 1] = leg[i] - moved[i, leg[i]]
    return leg
