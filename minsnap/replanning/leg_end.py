"""The end of a leg: flown on as it is, because a plan from there through its waypoint would lose digits.

The control points of a polynomial of duration h lie so close together that its derivatives of order p have the rounding
of positions divided by h^p.  A new plan therefore begins at the waypoint where little is left of the leg.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.compliance import turns_within
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.replanning.horizon import grouped, legs_of, walls_from
from minsnap.replanning.splice import Splice
from minsnap.replanning.stopping import inside, within
from minsnap.trajectory.trajectory import Trajectory

SHARE = 0.1
"""Share of a leg, or of the next one if that is longer, below which what is left of it is flown on."""

AT_WAYPOINT = 1e-9
"""Distance from its waypoint up to which a leg ends there, relative to the largest coordinate."""


@dataclass(frozen=True, eq=False)
class LegEnd:
    """What is left of a leg.

    Parameters
    ----------
    splice : Splice
    leg : Trajectory
        The whole leg.
    instant : float
        The splice on its clock [s].
    left : Trajectory
        What is left of it, with the flown heading.
    """

    splice: Splice
    leg: Trajectory
    instant: float
    left: Trajectory

    @property
    def after(self) -> Splice:
        """The instant of the waypoint."""
        return replace(self.splice, instant=self.splice.instant + self.left.duration)

    def within(self, limits: Limits | None) -> bool:
        """Whether it keeps the limits; the last tenth of the leg at least is judged: its polynomial has more digits."""
        begin = min(self.instant, (1.0 - SHARE) * self.leg.duration)
        judged = Splice(self.leg, begin, self.splice.half).rest or self.left
        return within(judged, limits) and turns_within(limits, self.left)

    def before(self, curve: Trajectory) -> Trajectory:
        """Fly it, then a curve from its end."""
        pieces = max(self.leg.pieces, curve.pieces)
        leg, left, following = (grouped(part, pieces) for part in (self.leg, self.left, curve))
        return replace(left.then(following), rest_of=(leg.then(following), self.instant))


def leg_end_of(splice: Splice) -> LegEnd | None:
    """Return the rest of the leg in flight if it is short; None otherwise."""
    rest, (whole, at) = splice.rest, splice.source
    if rest is None:
        return None
    index = whole.legs - rest.legs
    leg, left = legs_of(whole, index, index + 1), legs_of(rest, 0, 1)
    if left.duration >= SHARE * np.diff(whole.leg_breaks[index : index + 3]).max():
        return None
    return LegEnd(splice, leg, at - float(whole.leg_breaks[index]), rest.turned(left, 0.0))


def flown_on(splice: Splice, task: Task, limits: Limits | None) -> LegEnd | None:
    """Return the end of a leg that is flown on: it passes its waypoint inside the walls of the leg and the limits."""
    end = leg_end_of(splice)
    if end is None or task.legs < 2 or not _meets(task, end.left.control_points[-1, -1]):
        return None
    return end if inside(end.left, walls_from(task.walls, 0, 1)) and end.within(limits) else None


def rest_within(splice: Splice, limits: Limits | None) -> bool:
    """Whether the rest of the flown plan keeps the limits."""
    rest, end = splice.rest, leg_end_of(splice)
    if rest is None or within(rest, limits):
        return rest is not None
    if end is None or not end.within(limits):
        return False
    return rest.legs == 1 or within(rest.turned(legs_of(rest, 1, rest.legs), float(rest.leg_breaks[1])), limits)


def _meets(task: Task, position: FloatArray) -> bool:
    """Whether a position is in the region of the first waypoint ahead."""
    offset, rounding = position - task.waypoints[1], AT_WAYPOINT * float(np.abs(task.waypoints).max())
    if 1 in task.regions and task.regions[1].excess(offset) > rounding:
        return False
    return bool((np.maximum(offset - task.upper[1], task.lower[1] - offset) <= rounding).all())


def after_first_leg(curve: Trajectory | None) -> Trajectory | None:
    """Return a curve without its first leg; None if it has no other."""
    return None if curve is None or curve.legs == 1 else legs_of(curve, 1, curve.legs)
