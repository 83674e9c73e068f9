"""Groups of a show: each flies acts of its own at its own times, and every flight is planned beside what others fly.

Flights are planned in the order in which they begin. When one begins, all others stand, or fly what is known by then:
they are fixed vehicles of its question, and what is planned later has to keep clear of it in turn. Groups that leave
at one instant are planned together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError, MinsnapError
from minsnap.fleet import assign, certify_fleet, extent_of
from minsnap.shows.act_moves import Curves
from minsnap.shows.acts import Act, Group, Groups
from minsnap.shows.formations import spacing_of
from minsnap.shows.played_acts import ELSEWHERE, PlayedAct
from minsnap.shows.show_course import FlightTask, ShowCourse
from minsnap.shows.timeline import UNTIMED, GivenTime, Stage, joined, slower, waiting
from minsnap.trajectory import Trajectory

SLACK = 0.1
"""How long all wait at least before groups whose acts are at instants: flights before may yet become slower [s]."""

TRACE = 1e-6
"""Time that is none [s]."""

ROUNDS = 5
"""How often groups are planned whose files exceed a limit as a whole."""


@dataclass(eq=False)
class _Flying:
    """A group on its way: who it is, and until when it is planned."""

    group: Group
    vehicles: IntArray
    order: IntArray
    clock: float = 0.0
    acts: list[PlayedAct] = field(default_factory=list)

    @property
    def act(self) -> Act | None:
        """The next act; None where all are planned."""
        return self.group.acts[len(self.acts)] if len(self.acts) < len(self.group.acts) else None


def fly_groups(
    course: ShowCourse,
    groups: Groups,
    moves: Mapping[Act, Sequence[Curves]],
    reserves: FloatArray,
    progress: bool,
) -> list[PlayedAct]:
    """Fly all acts of groups, as one flight of the course, and return them; their stages are its inner ones.

    Raises
    ------
    FleetError
        If an act is at an instant before its group is done, or is reached where others stand or move too near.
    UnprovedError
        If a search ends without a flight.
    """
    timed = any(act.at is not None for act in groups.acts)
    if timed:
        course.settle_wait()
    begins = course.begins(groups.name, UNTIMED)
    begins = ceil(begins / SLACK + 1.0) * SLACK if timed else begins
    slack = 1.0
    for _ in range(ROUNDS):
        flight = _GroupFlights(course, groups, moves, reserves, begins, slack, progress)
        curves = flight.fly()
        more = course.slowing(curves, begins) if timed else 1.0
        slack *= more
        if more == 1.0:
            break
    end = curves[0].duration
    given = GivenTime(begins + end, end) if timed else UNTIMED
    acts = [act for each in flight.flying for act in each.acts]
    inner = [stage for act in acts for stage in act.stages]
    course.add(groups.name, curves, f"{len(groups.groups)} groups", 0.0, given, inner)
    return acts


class _GroupFlights:
    """The flights of groups, from one instant of the show on."""

    def __init__(
        self,
        course: ShowCourse,
        groups: Groups,
        moves: Mapping[Act, Sequence[Curves]],
        reserves: FloatArray,
        begins: float,
        slack: float,
        progress: bool,
    ) -> None:
        self._course, self._moves, self._begins, self._slack = course, moves, begins, slack
        self._progress, self._reserves = progress, reserves
        self._parts: list[list[Trajectory]] = [[] for _ in course.now]
        self._places = course.now.copy()
        self.flying = self._members(groups)

    def _members(self, groups: Groups) -> list[_Flying]:
        """Return who flies in which group: those with the least sum of squared ways to its first act."""
        order = np.full(len(self._places), -1)
        order[assign(groups.first, self._places, self._progress)] = np.arange(len(groups.first))
        flying, first = [], 0
        for group in groups.groups:
            count = len(group.acts[0].points)
            vehicles = np.flatnonzero((order >= first) & (order < first + count))
            flying.append(_Flying(group, vehicles, order[vehicles] - first))
            first += count
        return flying

    def fly(self) -> list[Trajectory]:
        """Return the curves of all vehicles, which end together."""
        while True:
            left = [(each, each.act) for each in self.flying if each.act is not None]
            if not left:
                break
            begins = [self._begins_of(each, act) for each, act in left]
            first = min(begins)
            self._leave(first, [pair for pair, at in zip(left, begins, strict=True) if at <= first + EXACT])
        end = max(each.clock for each in self.flying)
        return [
            joined([*part, *waiting(place, end - sum(curve.duration for curve in part))])
            for part, place in zip(self._parts, self._places, strict=True)
        ]

    def _begins_of(self, each: _Flying, act: Act) -> float:
        return GivenTime(act.at, act.seconds).checked(act.name, self._begins + each.clock) - self._begins

    def _leave(self, begins: float, leaving: Sequence[tuple[_Flying, Act]]) -> None:
        """Fly groups to their next acts from one instant on [s], hold, and move."""
        for each, act in leaving:
            if each.acts:
                each.order = np.asarray(assign(self._places[each.vehicles], act.points, self._progress))
        for each, act, curves, method, least in self._flights(begins, leaving):
            each.clock = begins + max(curve.duration for curve in curves)
            self._fly(each.vehicles, begins, curves)
            arrival = each.clock
            each.clock += act.hold
            points = np.full(len(self._places), ELSEWHERE)
            points[each.vehicles] = each.order
            stage = Stage(act.name, begins, arrival, each.clock, method, each.group.name, least)
            each.acts.append(PlayedAct(act, points, (stage,)))
            self._course.tell(f"{each.group.name}, {act.name}: {arrival - begins:.2f} s ({method})")
        for each, act in leaving:
            self._move(each, act)

    def _flights(
        self, begins: float, leaving: Sequence[tuple[_Flying, Act]]
    ) -> list[tuple[_Flying, Act, list[Trajectory], str, float]]:
        """Return the curves of groups that leave at one instant, how they are found, and the least time of each [s]."""
        names = " and ".join(f"act {act.name!r} of group {each.group.name!r}" for each, act in leaving)
        tasks = [self._task(each, act) for each, act in leaving]
        vehicles = np.concatenate([each.vehicles for each, _ in leaving])
        beside = tuple(self._known(i, begins) for i in range(len(self._places)) if i not in vehicles)
        self._refuse_near(names, vehicles, np.concatenate([task.ways[:, 1] for task in tasks]))
        try:
            curves, ends, method = self._flown(begins, leaving, tasks, beside)
        except MinsnapError as error:
            error.args = (f"the flight to {names}: {error}",)
            raise
        flown, first = [], 0
        for (each, act), task, end in zip(leaving, tasks, ends, strict=True):
            own = curves[first : first + len(each.vehicles)]
            least = task.least if GivenTime(act.at, act.seconds) == UNTIMED else 0.0
            flown.append((each, act, [_until(curve, end) for curve in own], method, least))
            first += len(own)
        return flown

    def _flown(
        self,
        begins: float,
        leaving: Sequence[tuple[_Flying, Act]],
        tasks: Sequence[FlightTask],
        beside: tuple[Trajectory, ...],
    ) -> tuple[list[Trajectory], list[float], str]:
        """Return the curves of all that leave at one instant, when each group arrives, and how they are found."""
        course, given = self._course, [GivenTime(act.at, act.seconds) for _, act in leaving]
        lasts = [each.lasts(self._begins + begins) for each in given]
        tasks = [_beside(task, beside) for task in tasks]
        if len(leaving) > 1 and any(last is not None for last in lasts):  # those without a time take their shortest
            own = [
                course.beside(act.name, task, last, time, self._begins + begins, self._slack)
                for (_, act), task, last, time in zip(leaving, tasks, lasts, given, strict=True)
            ]
            arrivals = [max(curve.duration for curve in curves) for curves, _ in own]
            flown = [curve for curves, _ in own for curve in curves]
            if tasks[0].is_apart(flown, course.show.separation.aloft):
                return flown, arrivals, " and ".join(dict.fromkeys(method for _, method in own))
            lasts = list(arrivals)
        ends = [last for last in lasts if last is not None]
        longest, late = max(ends, default=None), [task.late for task in tasks]
        for rows, end in zip(late, ends, strict=False):
            rows[:, 1] = max(ends) - end
        delays, early = np.concatenate(late).T
        ways, lowest = np.concatenate([task.ways for task in tasks]), min(tasks, key=lambda each: each.room.lower[2])
        task = replace(lowest, ways=ways, delays=delays, early=early if early.any() else None)
        told = next((each for each in given if each != UNTIMED), UNTIMED)
        curves, method = course.beside(leaving[0][1].name, task, longest, told, self._begins + begins, self._slack)
        return curves, ends or [max(curve.duration for curve in curves)] * len(leaving), method

    def _task(self, each: _Flying, act: Act) -> FlightTask:
        delays = None if act.delays is None else act.delays[each.order]
        return self._course.task(self._places[each.vehicles], act.points[each.order], None, delays)

    def _refuse_near(self, names: str, vehicles: IntArray, goals: FloatArray) -> None:
        """Refuse goals that are too near to where others are in the end, as far as it is known."""
        places = self._places.copy()
        places[vehicles] = goals
        separation = self._course.show.separation
        least, pair = spacing_of(separation.flat(places)) if len(places) > 1 else (np.inf, (0, 0))
        if least < (separation.distance or 0.0) * (1.0 - EXACT):
            still = [f", vehicle {i} of which is there still" for i in pair if i not in vehicles]
            text = f"{names}: vehicles {pair[0]} and {pair[1]} would be {least:.3f} m apart{''.join(still)}"
            raise FleetError(f"{text}: give it a later time, or shift it", pair=pair)

    def _move(self, each: _Flying, act: Act) -> None:
        """Fly what a formation does after its hold."""
        for curves in self._moves[act]:
            if not curves:
                continue
            own = slower([curves[point] for point in each.order], self._slack)
            own = slower(own, self._course.slowing(own, self._begins + each.clock))
            beside = [self._known(i, each.clock) for i in range(len(self._places)) if i not in each.vehicles]
            beside += [_standing(place) for place in self._reserves]
            near = certify_fleet([*own, *beside], self._course.show.separation.aloft).closest
            if near is not None and near.share < 1.0 - EXACT:
                text = f"a move of act {act.name!r} of group {each.group.name!r} comes within {near.distance:.3f} m"
                raise FleetError(f"{text} of what others fly: give it another time, or more room")
            begins = each.clock
            self._fly(each.vehicles, begins, own)
            each.clock += max(curve.duration for curve in own)
            stage = Stage(f"{act.name} moves", begins, each.clock, each.clock, "move", each.group.name)
            each.acts[-1] = replace(each.acts[-1], stages=(*each.acts[-1].stages, stage))

    def _fly(self, vehicles: IntArray, begins: float, curves: Sequence[Trajectory]) -> None:
        """Wait until an instant [s], and fly curves."""
        for i, curve in zip(vehicles.tolist(), curves, strict=True):
            flown = sum(part.duration for part in self._parts[i])
            self._parts[i] += [*waiting(self._places[i], begins - flown), curve]
            self._places[i] = curve.control_points[-1, -1]

    def _known(self, vehicle: int, begins: float) -> Trajectory:
        """Return what a vehicle flies from an instant on [s], as far as it is planned; it stands after that."""
        here, parts = self._places[vehicle], self._parts[vehicle]
        whole = joined(parts or [_standing(here)])
        return _standing(here) if begins >= whole.duration - TRACE else whole.between(begins, whole.duration)


def _beside(task: FlightTask, beside: tuple[Trajectory, ...]) -> FlightTask:
    """Return the question with what others fly meanwhile, in a room that holds this too."""
    floor = min((float(extent_of(curve.control_points)[0][2]) for curve in beside), default=np.inf)
    lower = np.minimum(task.room.lower, (np.inf, np.inf, floor))
    return replace(task, beside=beside, room=replace(task.room, lower=lower))


def _standing(place: FloatArray) -> Trajectory:
    """Return a curve that stays at a place, for a second: what ends first stands in questions from there on."""
    return joined(waiting(place, 1.0))


def _until(curve: Trajectory, end: float) -> Trajectory:
    """Return a curve that stands from an instant on [s], up to that instant."""
    kept = curve.breaks[1:] <= end + TRACE
    if kept.all():
        return curve
    parts = [Trajectory(curve.control_points[kept], curve.durations[kept])] if kept.any() else []
    return joined([*parts, *waiting(curve.control_points[-1, -1], end - float(curve.durations[kept].sum()))])
