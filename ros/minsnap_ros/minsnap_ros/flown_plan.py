"""A plan on a clock: since when it is flown, what is to be flown now, and what comes after a change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import minsnap
from minsnap import Samples, Trajectory


@dataclass(frozen=True)
class FlownPlan:
    """A plan and the instant of its time 0.

    Parameters
    ----------
    trajectory : Trajectory
        One polynomial per leg.
    began : float or None
        Instant of its time 0 on the node's clock [s]; None while it waits for its beginning.
    then : FlownPlan or None
        What takes over when it begins.
    own : mapping
        Limits and corridor that its file names; a change keeps them.
    fixed : bool
        Whether it flies through boxes or around obstacles, which a change would not know of.
    """

    trajectory: Trajectory
    began: float | None = None
    then: FlownPlan | None = None
    own: Mapping[str, Any] = field(default_factory=dict)
    fixed: bool = False

    def begun(self, now: float) -> FlownPlan:
        """Return the plan with its time 0 now."""
        return replace(self, began=now)

    def over(self, now: float) -> bool:
        """Whether its end is held."""
        return self.began is not None and self.then is None and now >= self.began + self.trajectory.duration

    def at(self, now: float) -> FlownPlan:
        """Return what is flown now: itself, or what has taken over."""
        if self.then is not None and self.then.began is not None and now >= self.then.began:
            return self.then
        return self

    def time(self, now: float) -> float:
        """Return the plan's time now [s]: 0 before it begins, its duration from its end on."""
        return 0.0 if self.began is None else float(np.clip(now - self.began, 0.0, self.trajectory.duration))

    def state(self, now: float) -> Samples:
        """Return what is to be flown now, as one sample."""
        t, curve = np.array([self.time(now)]), self.trajectory
        return Samples(t, *(curve(t, order) for order in range(5)), curve.yaw(t), curve.yaw(t, 1))

    def changed(self, goal: Any, now: float, budget: float, asked: Mapping[str, Any]) -> FlownPlan:
        """Return the plan with another end, which takes over ``budget`` seconds from now.

        ``asked`` holds limits and corridor for a plan whose file names none.

        Raises
        ------
        MinsnapError
            If it does not fly, or if no change is certified in time; it is then flown as it was.
        """
        if self.began is None or now + budget >= self.began + self.trajectory.duration:
            raise minsnap.InputError("nothing is flown that could be changed: plan through waypoints instead")
        if self.fixed:
            raise minsnap.InputError("a course through boxes or around obstacles cannot be changed in flight")
        passed = int(np.searchsorted(self.trajectory.breaks, now + budget - self.began, side="right"))
        ahead = [*self.trajectory(self.trajectory.breaks[passed:-1]), goal]
        change = minsnap.replan(self.trajectory, now - self.began, ahead, budget, **{**asked, **self.own})
        if change.kept:
            raise minsnap.InputError(f"the plan is flown as it was: {change.reason}")
        return replace(self, then=replace(self, trajectory=change.trajectory, began=self.began + change.splice))
