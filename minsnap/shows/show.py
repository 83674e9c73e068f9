"""A show: formations one after the other, and the flights between them, planned one by one and kept once planned.

From home all climb straight up, fly to the acts, each by the assignment of least squared way, hold each, return above
home and land. A formation may move (``moves``).

A show that is flown from files is planned for these: with their distance from the curves added to the separation, and
flights slowed until the files keep the limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.storage.text import FileName
from minsnap.errors import FleetError
from minsnap.files.formats import Lights, worst_distance
from minsnap.fleet import Fleet, Separation, assign
from minsnap.shows.act_moves import check_moves, curves_of_moves, of_vehicles, reach_of, refuse_late_lights
from minsnap.shows.acts import Act, Groups, Show
from minsnap.shows.file_limits import ROUNDED_KINDS
from minsnap.shows.group_flights import fly_groups
from minsnap.shows.group_places import places_in, refuse_near_groups
from minsnap.shows.least_times import refuse_hasty
from minsnap.shows.played_acts import PlayedAct, headed, lights_of
from minsnap.shows.show_course import SKYBRUSH, ShowCourse, Told
from minsnap.shows.site import Fence
from minsnap.shows.skyc import ShowSheet
from minsnap.shows.timeline import GivenTime, Stage
from minsnap.trajectory import Trajectory

__all__ = ["SKYBRUSH", "Act", "FlownShow", "Show", "fly"]

GENTLE = 1.0
"""Speed of take-off and landing in Skybrush's files unless a show says another: its firmware takes off at it [m/s]."""


DARK = Lights(np.zeros(1), np.zeros((1, 3)), np.zeros(1, dtype=bool))
"""Lights of a vehicle that stays on the ground."""


def those_left(vehicles: int, missing: Sequence[int]) -> list[int]:
    """Return which of so many vehicles are not missing; raise FleetError where none is, or one is not there."""
    for vehicle in missing:
        if not 0 <= vehicle < vehicles:
            raise FleetError(f"there is no vehicle {vehicle}: they are 0 to {vehicles - 1}")
    left = [i for i in range(vehicles) if i not in missing]
    if not left:
        raise FleetError(f"all {vehicles} vehicles are missing: leave some")
    return left


@dataclass(frozen=True, eq=False)
class FlownShow:
    """A show as trajectories.

    Parameters
    ----------
    fleet : Fleet
    lights : tuple of Lights
        Of each vehicle.
    stages : tuple of Stage
    """

    fleet: Fleet
    lights: tuple[Lights, ...]
    stages: tuple[Stage, ...]

    def without(self, missing: Sequence[int]) -> FlownShow:
        """Return the show without some vehicles: all others fly as they do, with their names.

        Raises
        ------
        FleetError
            If there is no such vehicle, or none is left.
        """
        left = those_left(len(self.fleet), missing)
        names = tuple(self.fleet.name(i) for i in left)
        fleet = Fleet(tuple(self.fleet[i] for i in left), names, self.fleet.separation)
        return FlownShow(fleet, tuple(self.lights[i] for i in left), self.stages)

    def sheet(self, show: Show, title: str) -> ShowSheet:
        """Return what a Skybrush show says of itself: a cue for each act, take-off, show and landing."""
        up, down, end = self.stages[0], self.stages[-1], self.stages[-1].end
        spans = {"takeoff": (0.0, up.end), "show": (up.end, down.start), "landing": (down.start, end)}
        names = {act.name for act in show.formations}
        flown = self.stages[1 : -2 if show.return_home else -1]
        cues = tuple(sorted((stage.arrival, stage.name) for stage in flown if stage.name in names))
        highest = None if show.room is None else float(show.room[1][2])
        segments = {name: span for name, span in spans.items() if span[1] > span[0]}
        return ShowSheet(title, show.environment, show.limits, highest, cues, segments, show.origin)


def fly(
    show: Show, kept: FileName | None = None, told: Told | None = None, progress: bool = False, to: str = "csv"
) -> FlownShow:
    """Plan every flight of a show.

    Ctrl-C ends the search for one flight with the best certified so far. That is flown, but not stored: the next run
    searches again.

    Parameters
    ----------
    show : Show
    kept : str or path, optional
        Folder in which planned flights are stored; those of an earlier run with equal conditions are not planned
        again.
    told : callable, optional
        Is told a sentence after each flight.
    progress : bool
        Show a line on the terminal while a flight is searched for.
    to : str
        Format of the files from which it is flown, as in ``write_fleet``. Where these round, twice their distance from
        the curves is added to the separation, and flights are slowed until the files keep the limits.

    Raises
    ------
    FleetError
        If acts and vehicles do not fit together.
    UnprovedError
        If a search ends without a flight, or with none in the time that its act gives it; says which.
    FileError
        If no file of the format holds a curve.
    """
    show.check()
    refuse_hasty(show)
    moves = {act: curves_of_moves(act, show) for act in show.formations}
    for each, motion in moves.items():
        refuse_late_lights(each, motion)
    asked, show = show, _prepared(show, to, max(show.reach, reach_of(list(moves.values()))))
    reserves = show.home[show.flying :]
    show = replace(show, home=show.home[: show.flying])
    for each, motion in moves.items():
        check_moves(each, motion, show)
    refuse_near_groups(show, moves)
    course = ShowCourse(show, kept, progress, told, show.home, to)
    course.climb("take-off")
    flown: list[tuple[PlayedAct, int]] = []
    for act in show.acts:
        first = len(course.flights)
        if isinstance(act, Groups):
            flown += [(own, first) for own in fly_groups(course, act, moves, reserves, progress)]
            continue
        order, goals = places_in(show, course.now, act, progress)
        delays = None if act.delays is None else np.where(order >= 0, act.delays[order], 0.0)
        course.fly(act.name, goals, None, act.hold, GivenTime(act.at, act.seconds), delays)
        for moved in moves[act]:
            curves = of_vehicles(moved, order, course.now, reserves, show.separation, act.name)
            course.add(f"{act.name} moves", curves, "move")
        flown.append((PlayedAct(act, order), first))
    if show.return_home:
        order = _return(show, course.now, progress)
        course.fly("return", show.above[order])
        course.land("landing", order)
    else:
        below = np.column_stack((course.now[:, :2], np.full(len(show.home), show.home[:, 2].min())))
        course.fly("landing", below, show.descent_speed)
    curves, stages = course.timeline()
    played = [own.timed(stages[first:], course.flights[first]) for own, first in flown]
    curves, lights = headed(curves, played, show.limits.yaw_rate), lights_of(played, len(curves), stages[-1].end)
    pairs = zip(course.flights, stages, strict=True)
    stages = [stage for flight, whole in pairs for stage in (flight.scaled(flight.inner, whole) or [whole])]
    end = max(curve.duration for curve in curves)
    curves += [Trajectory(np.tile(place, (1, 8, 1)), np.array([end])) for place in reserves]
    lights += [DARK] * len(reserves)
    return FlownShow(Fleet(tuple(curves), None, asked.separation), tuple(lights), tuple(stages))


def _prepared(show: Show, to: str, reach: float) -> Show:
    """Return the show as it is planned for files: apart by what they may lose too, gentle where Skybrush flies it."""
    if to not in ROUNDED_KINDS:
        return show
    apart, lost = show.separation, worst_distance(reach)
    fence = None if show.fence is None else Fence(show.fence.corners, show.fence.margins + lost)
    wider = Separation((apart.distance or 0.0) + 2.0 * lost, apart.downwash, ground=apart.ground)
    show = replace(show, separation=wider, fence=fence)
    show.check_inside()
    if to not in SKYBRUSH:
        return show
    up, down = (GENTLE if speed is None else speed for speed in (show.climb_speed, show.descent_speed))
    return replace(show, climb_speed=up, descent_speed=down)


def _return(show: Show, now: FloatArray, progress: bool) -> IntArray:
    """Return above whose place each vehicle returns: its own, or any where the longest way is then shorter."""
    own = np.arange(len(now))
    if show.land == "own":
        return own
    order = np.asarray(assign(now, show.above, progress))
    ways = [float(np.linalg.norm(show.above[each] - now, axis=1).max()) for each in (own, order)]
    return own if ways[0] <= ways[1] else order
