"""Acts as they are flown: who is where in them and when, and what follows of it for lights and headings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import IntArray
from minsnap.files.formats import Lights
from minsnap.shows.act_headings import Turned, with_headings
from minsnap.shows.act_lights import Shown, lights_of_acts
from minsnap.shows.acts import Act
from minsnap.shows.frame_animation import Animation
from minsnap.shows.timeline import PlannedFlight, Stage
from minsnap.trajectory import Trajectory

WAITS, ELSEWHERE = -1, -2
"""Points of a vehicle that waits above its home in the dark during an act, and of one that is no part of it."""


@dataclass(frozen=True, eq=False)
class PlayedAct:
    """One act, as it is flown.

    Parameters
    ----------
    act : Act
    points : ndarray of int, shape (vehicles,)
        At which of its points each vehicle is; ``WAITS`` or ``ELSEWHERE`` for none.
    stages : tuple of Stage
        The flight there, and its moves; those of a group count from the start of all groups.
    """

    act: Act
    points: IntArray
    stages: tuple[Stage, ...] = ()

    def timed(self, stages: Sequence[Stage], flight: PlannedFlight) -> PlayedAct:
        """Return the act with its times in the show, of which its flight begins the stages."""
        own = flight.scaled(self.stages, stages[0]) if self.stages else stages[: len(self.act.moves) + 1]
        return replace(self, stages=tuple(own))

    def shown(self, vehicle: int) -> Shown:
        """Return what a vehicle shows in the act."""
        stages, act, point = self.stages, self.act, int(self.points[vehicle])
        begins = (stages[0].start, stages[0].arrival, stages[-1].end, point, act.changes)
        played = next((i for i, move in enumerate(act.moves) if isinstance(move, Animation)), None)
        if played is None or act.changes:
            return Shown(*begins)
        move, stage = act.moves[played], stages[played + 1]
        assert isinstance(move, Animation)
        return Shown(*begins, move.lights(max(point, 0)), stage.start, (stage.arrival - stage.start) / move.duration)


def lights_of(played: Sequence[PlayedAct], vehicles: int, end: float) -> list[Lights]:
    """Return the lights of each vehicle of a show that ends then [s]."""
    return [
        lights_of_acts([each.shown(i) for each in played if each.points[i] != ELSEWHERE], end) for i in range(vehicles)
    ]


def headed(curves: list[Trajectory], played: Sequence[PlayedAct], fastest: float | None) -> list[Trajectory]:
    """Return the curves with the headings of acts, where any has one; those without a point keep theirs."""
    turns: list[list[Turned]] = [[] for _ in curves]
    for each in played:
        if each.act.yaw is None:
            continue
        angles = np.broadcast_to(np.asarray(each.act.yaw, dtype=np.float64), (len(each.act.points),))
        for vehicle, point in enumerate(each.points.tolist()):
            turns[vehicle] += [] if point < 0 else [Turned(each.stages[0], float(angles[point]))]
    if not any(turns):
        return curves
    return [with_headings(curve, own, fastest) for curve, own in zip(curves, turns, strict=True)]
