"""plan_fleet: curves of several vehicles at once, apart at every instant, in the shortest common time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import ceil, inf
from time import monotonic
from typing import Any, Literal, NamedTuple

import numpy as np

from minsnap.basics.arrays import ArrayLike
from minsnap.basics.checks import check_number, check_seed, check_threads, check_time
from minsnap.basics.messages import explains_names
from minsnap.basics.progress import ProgressLine, of_steps, progress_line
from minsnap.basics.warn import warn_deprecated
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.keep_out import Obstacle
from minsnap.durations.search_options import USUAL, Search, check_search
from minsnap.errors import FleetError, TimingError, UnprovedError
from minsnap.fleet.common_clock import Fleet, FleetReport, Separation, checked_names
from minsnap.fleet.first_guess import one_curve
from minsnap.fleet.fleet_certificate import fleet_fault
from minsnap.fleet.fleet_task import FleetTask, apart_at_knots, check_task, meeting_at, refuse_meetings, way_of
from minsnap.fleet.leg_times import timed_legs, with_knots
from minsnap.fleet.time_search import LAST, TIMES, WARM, Certified, TimeSearch, flown, unproved_fleet
from minsnap.limits.limits import Limits
from minsnap.trajectory.path import Path
from minsnap.trajectory.planned_heading import ChosenHeading, Yaw, chosen_heading
from minsnap.trajectory.trajectory import Trajectory


class FleetStep(NamedTuple):
    """A time of flight that the search has reached [s], and the least distance of two vehicles in it [m]."""

    time: float
    least_distance: float


MOST_KNOTS = 40
"""Most pieces that are tried so that waypoints are passed when it is best."""

PIECE_COST = 0.002
"""Share of the time that one piece more is worth."""


@explains_names({"corridor": "corridors=, one for each vehicle, or room="}, positional=3, last="0.3")
def plan_fleet(
    waypoints: ArrayLike | Sequence[ArrayLike],
    limits: Limits | Sequence[Limits] | None = None,
    separation: Separation | float | None = None,
    *,
    room: Room | Sequence[ArrayLike] | None = None,
    avoid: Obstacle | Sequence[Obstacle] | None = None,
    total_time: float | None = None,
    pieces: int | Literal["auto"] = "auto",
    start: Sequence[Mapping[str, ArrayLike] | None] | None = None,
    fixed: Sequence[Path] | Fleet | None = None,
    corridors: Sequence[Boxes | None] | None = None,
    holds: Sequence[ArrayLike | None] | None = None,
    durations: Sequence[ArrayLike | None] | None = None,
    yaw: Yaw | Sequence[Yaw] = None,
    names: Sequence[str] | None = None,
    polish: float = 0.0,
    seed: int = 0,
    time_limit: float | None = None,
    progress: bool | Callable[[FleetStep], None] | None = None,
    threads: int | None = None,
    search: Search | None = None,
) -> Fleet:
    """Plan several vehicles that start at one instant and arrive at one instant, apart at every instant.

    The fleet is certified by ``certify_fleet``. Ctrl-C and a time limit end the search with
    the best fleet certified so far.

    Parameters
    ----------
    waypoints : array_like, shape (m, n, 3), or sequence of array_like, shape (n_i, 3)
        Waypoints of each vehicle: start and goal, or more [m]. Inner ones are passed about when the vehicle alone would
        pass them, in proportion to the time of all.
    limits : Limits or sequence of Limits, optional
        Limits of all vehicles, or of each. The search minimises the time within them.
    separation : Separation or float, optional
        How far apart any two are to be [m].
    room : Room or pair of corners, optional
        Room of all vehicles.
    avoid : obstacle or sequence of obstacles, optional
        Cylinders, ellipsoids and cuboids to keep out of.
    total_time : float, optional
        Common flight time [s]; by default the shortest within the limits. Curves then have little snap.
    pieces : int or "auto"
        Polynomials of each vehicle.
    start : sequence of mapping, optional
        Of each vehicle, such as ``{"velocity": (1, 0, 0)}``, or None for rest.
    fixed : sequence of Trajectory, optional
        Trajectories of vehicles that are not planned; they come last in the fleet.
    corridors : sequence of Boxes or None, optional
        For each vehicle, a box for each leg between its waypoints.
    holds : sequence of array_like, shape (n_i,), or None, optional
        For each vehicle, the least time at rest at each of its waypoints [s]. ``(2, 0)`` starts two seconds late,
        ``(0, 1)`` arrives a second before the end.
    durations : sequence of array_like, shape (n_i - 1,), or None, optional
        For each vehicle, how long each of its legs lasts [s], between its holds, before it stays at its goal; None for
        one that passes its waypoints about when it alone would. The total time is that of the longest unless given.
    yaw : float, "velocity", callable or sequence of these, optional
        Of all vehicles, or of each.
    names : sequence of str, optional
        Of the vehicles, the fixed ones last.
    polish : float
        Share of the shortest time to spend on curves of less snap, such as 0.05.
    seed : int
        Seed of the choice between equal ways. The same seed gives the same bits with any number of threads.
    progress : bool or callable, optional
        True for a line on the terminal; or a function that is called with each ``FleetStep``: a ``time`` that is
        reached [s] and its ``least_distance`` [m].
    threads : int, optional
        By default as many as processors.
    search : Search, optional
        ``Search(time_limit=5)`` ends the search after 5 s.
    time_limit : float, optional
        The same; it goes (:doc:`/upgrading`).

    Returns
    -------
    Fleet
        Its report says how it was planned; degree 7, three derivatives continuous.

    Raises
    ------
    FleetError
        If the question is malformed or contradicts itself.
    TimingError
        If neither a time nor limits are set, or the total time or a leg is shorter than its way allows.
    UnprovedError
        If the search ends without a fleet. There may be one.
    """
    task = check_task(waypoints, limits, separation, room, avoid, start, fixed, corridors, holds)
    check_seed(seed)
    check_number("polish", polish, 0.0, 10.0, "give a share of the time from 0 to 10, such as 0.05", FleetError)
    due = _due(check_search(search), time_limit)
    if total_time is not None:
        total_time = check_time("total_time", total_time, TimingError)
    task = replace(task, total_time=total_time) if durations is None else timed_legs(task, durations, total_time)
    _check_time(task)
    count = _pieces_of(task, pieces)
    task = with_knots(task, count)
    count = count if task.shares is None else len(task.shares) - 1
    task = apart_at_knots(task, count) if pieces == "auto" else task
    refuse_meetings(task, count)
    workers = check_threads(threads, FleetError)
    given = _headings(task, yaw), checked_names(names, len(task) + len(task.fixed))
    with progress_line(of_steps(progress, FleetStep, "plan_fleet"), "fleet", _line) as callback:
        joint = TimeSearch(task, count, workers, lambda: monotonic() > due, callback)
        return _searched(joint, partial(_finished, task, joint, *given), polish, seed, pieces)


def _due(search: Search, time_limit: float | None) -> float:
    """Return when the search ends by the clock [s]."""
    if time_limit is not None:
        warn_deprecated("plan_fleet(time_limit=)", "search=Search(time_limit=)", "0.3")
        search = replace(search, time_limit=time_limit)
    other = next((name for name in ("split", "time_weight") if getattr(search, name) != getattr(USUAL, name)), None)
    if other is not None:
        raise TimingError(f"search has {other}, which is for one vehicle: a fleet takes a time_limit alone")
    return inf if search.time_limit is None else monotonic() + search.time_limit


def _finished(
    task: FleetTask,
    search: TimeSearch,
    headings: list[ChosenHeading | None],
    names: tuple[str, ...] | None,
    curves: list[Trajectory],
    method: str,
    stopped: str = "",
) -> Fleet:
    """Return the curves with headings, and those that were fixed, or raise UnprovedError."""
    bounds, duration, slowest = search.task.least, curves[0].duration, int(np.argmax(search.task.least))
    report = FleetReport(
        *(method, duration, float(bounds[slowest]), slowest, search.alone or duration, len(curves[0].durations)),
        *(search.tried, search.iterations, search.seconds, stopped),
    )
    pairs = zip(curves, headings, strict=True)
    headed = [curve if heading is None else curve.with_yaw(heading(curve)) for curve, heading in pairs]
    fleet = Fleet((*headed, *task.fixed), names, task.separation, report)  # type: ignore[arg-type]
    wrong = fleet_fault(task, fleet, search.threads)
    if wrong is not None:
        raise UnprovedError(f"the fleet is refused at the last look: {wrong}; give more time or another yaw")
    return fleet


def _searched(search: TimeSearch, finished: Callable[..., Fleet], polish: float, seed: int, pieces: Any) -> Fleet:
    """Return the best fleet: by one curve where that decides it, or by a joint search."""
    stopped = ""
    quick = one_curve(search.task, polish, pieces)
    if quick is not None:
        try:
            return finished(*quick)
        except UnprovedError:
            if len(quick[0]) == 1:
                raise
    try:
        best = _joint(search, polish, seed)
        stopped = "time_limit" if search.stopped() else ""
    except KeyboardInterrupt:
        if search.best is None or search.task.total_time is not None:
            raise
        best, stopped = search.best, "Ctrl-C"
    return finished(flown(best.curves[: len(search.task)], best.time, search.shares), "joint", stopped)


def _joint(search: TimeSearch, polish: float, seed: int) -> Certified:
    bound = least = float(search.task.bounds.max())
    if search.task.total_time is not None:
        return _timed(search, search.task.total_time, seed)
    certified: list[Certified] = []
    for kind in TIMES.guesses:
        opened = search.open(seed, kind, max(bound, 1e-3))
        if opened is not None and not certified:
            search.alone = _alone(search)
            least = max(bound, TIMES.below_alone * search.alone)
        if opened is not None:
            certified.append(search.shorten(opened, TIMES.coarse, WARM, TIMES.exploring, least))
        if search.stopped() or _settled(certified, len(search.task), least):
            break
    if search.best is None:
        raise unproved_fleet(search, "", seed)
    search.shorten(search.best, TIMES.coarse, WARM, TIMES.lowering, least)
    search.shorten(search.best, TIMES.fine, LAST, TIMES.ending, least)
    best = search.best
    return (search.least_snap(best.time * (1.0 + polish)) if polish > 0.0 else None) or best


def _settled(certified: list[Certified], vehicles: int, least: float) -> bool:
    """Whether another guess is not worth its time: one came near the least time, two agree, or vehicles are few."""
    times = sorted(each.time for each in certified)
    if not times:
        return False
    agree = len(times) > 1 and times[1] <= times[0] * (1.0 + TIMES.agreeing)
    return agree or times[0] <= least * (1.0 + TIMES.near) or len(times) > vehicles // TIMES.crowd


def _alone(search: TimeSearch) -> float:
    """Return the shortest time known for the slowest vehicle alone, with the same pieces; 0 if none was."""
    if len(search.task) + len(search.task.fixed) == 1:
        return 0.0
    lone = TimeSearch(_lone_task(search.task, int(np.argmax(search.task.bounds))), search.pieces, 1, search.stopped)
    try:
        return _joint(lone, 0.0, 0).time
    except UnprovedError:
        return 0.0


def _lone_task(task: FleetTask, vehicle: int) -> FleetTask:
    one = slice(vehicle, vehicle + 1)
    lone = replace(task, waypoints=task.waypoints[one], states=task.states[one], separation=None, fixed=())
    return replace(lone, limits=task.limits and task.limits[one], corridors=task.corridors[one], holds=task.holds[one])


def _timed(search: TimeSearch, time: float, seed: int) -> Certified:
    """Return curves of little snap at a fixed time, or raise UnprovedError."""
    settings = replace(LAST, smoothness=1e-5, tau=0.02, iterations=200)
    for kind in TIMES.guesses:
        search.inside = TIMES.inside[0]
        while True:
            curves = search.opening(seed, kind, time)
            search.nearest = search.attempt(search.search_of(TIMES.fine), curves, time, settings)
            if search.nearest.certified is not None and search.nearest.certified.time <= time * (1.0 + 1e-9):
                search.best = replace(search.nearest.certified, time=time)
                return search.least_snap(time) or search.best
            if search.stopped() or not search.narrowed(search.nearest, settings):
                break
        if search.stopped():
            break
    raise unproved_fleet(search, f" in {time:g} s", seed)


def _headings(task: FleetTask, yaw: Any) -> list[ChosenHeading | None]:
    """Return what gives each curve its heading, None where no yaw is requested."""
    each = list(yaw) if isinstance(yaw, list | tuple) else [yaw] * len(task)
    if len(each) != len(task):
        raise FleetError(f"{len(each)} yaws for {len(task)} vehicles: give one for all, or one each")
    pairs = zip(each, task.limits or (None,) * len(task), strict=True)
    return [None if own is None else chosen_heading(own, 1, False, limit) for own, limit in pairs]


def _pieces_of(task: FleetTask, pieces: Any) -> int:
    legs = max(len(points) for points in task.waypoints) - 1
    if isinstance(pieces, str) and pieces == "auto":
        length = float(np.mean([way_of(points) for points in task.waypoints]))
        count = 6 if len(task) >= 150 else 8 + 2 * sum(length >= far * task.length for far in (20.0, 40.0))
        count = max(count, 4 * legs if legs > 1 else 0)
        waiting = max(float(task.holds_of(i).sum()) for i in range(len(task))) / max(float(task.bounds.max()), 1e-12)
        count = count if waiting == 0.0 else ceil(count / max(1.0 - waiting, 0.25)) + 2
        return count if legs == 1 else _knots_that_suit(task, count)
    least = max(2, legs)
    give = f"give 'auto' or a whole number from {least} to 200"
    return int(check_number("pieces", pieces, least, 200, give, FleetError, whole=True))


def _knots_that_suit(task: FleetTask, least: int) -> int:
    """Return how many pieces let all vehicles pass their waypoints about when each does alone, and no more."""
    stretches = {}
    for count in range(least, MOST_KNOTS + 1):
        with suppress(FleetError):  # the holds leave too few pieces
            if meeting_at(task, count) is not None:
                continue
            stretches[count] = task.stretch_of(count) * (1.0 + PIECE_COST * count)
    return min(stretches, key=stretches.__getitem__) if stretches else least


def _check_time(task: FleetTask) -> None:
    """Refuse a question without a time, or one too short for the speed and acceleration of a vehicle."""
    bound, slowest = float(task.bounds.max()), int(np.argmax(task.bounds))
    if task.total_time is None:
        if not any(map(way_of, task.waypoints)):
            raise TimingError(
                "no vehicle that is planned moves to another place, so no limit sets the time: give total_time"
            )
        if task.limits is None or not bound > 0.0:
            raise TimingError(
                "plan_fleet needs limits on the speed or the acceleration of vehicles that move, or a total_time"
            )
    elif task.total_time < bound * (1.0 - 1e-9):
        raise TimingError(
            f"total_time is {task.total_time:g} s, and vehicle {slowest} alone needs {bound:.4g} s for its way of "
            f"{way_of(task.waypoints[slowest]):.4g} m within its speed and acceleration: give more time"
        )


def _line(line: ProgressLine) -> Callable[[float, float], None]:
    return lambda time, least: line.show(None, f"{time:.3f} s, least distance {least:.3f} m")
