"""plan: the one call that ties waypoints, durations, corridor and solver together.

The module is not named ``plan``: a submodule of that name would hide the function ``minsnap.plan``.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from minsnap.basics import checks
from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.deadline import WORK, Work
from minsnap.basics.messages import explains_names
from minsnap.basics.needed_memory import planned_bytes, short_of_memory
from minsnap.basics.progress import ProgressLine, progress_line
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Room, as_room
from minsnap.corridors.constraint import Constraint, Walls, walls_of
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.given_waypoints import (
    as_knots,
    check_dimension,
    is_table,
    lap_of,
    read_columns,
    warn_magnitude,
    without_gates,
)
from minsnap.corridors.keep_out import Avoided, as_obstacles
from minsnap.corridors.knot_regions import place
from minsnap.corridors.named_constraints import widths_of
from minsnap.corridors.precheck import check_reach
from minsnap.corridors.tubes import Sampled, as_constraints, unsampled
from minsnap.durations.resting import resting_plan
from minsnap.durations.search_options import ENFORCE, USUAL, Search, check_search
from minsnap.durations.timing import Timed, Timing
from minsnap.errors import MinsnapError
from minsnap.optimisation.task import Task
from minsnap.trajectory.plan_notes import plan_notes
from minsnap.trajectory.planned_heading import Yaw, chosen_heading
from minsnap.trajectory.report import Progress, Report
from minsnap.trajectory.trajectory import Plan, Trajectory, as_plan

if TYPE_CHECKING:
    from minsnap.bounds.least_time import TimeQuestion
    from minsnap.limits.limits import Limits
    from minsnap.optimisation.qp import Solver
    from minsnap.planning.leg_table import TimedCourse
    from minsnap.planning.request import PlanRequest
    from minsnap.vehicle.loop import Loop

LOGGER = logging.getLogger(__name__)
logging.getLogger("minsnap").addHandler(logging.NullHandler())  # silent unless a program asks


@explains_names(
    {
        "split": 'search=Search(split="distance")',
        "time_weight": "search=Search(time_weight=100.0)",
        "enforce": ENFORCE,
        "time_limit": "search=Search(time_limit=2.0)",
        "on_interrupt": 'search=Search(on_interrupt="return")',
        "corridor_method": "corridor=Sampled(0.3, samples=20)",
        "samples": "corridor=Sampled(0.3, samples=20)",
        "certify": "corridor=Sampled(0.3), or certify(trajectory, corridor=0.3)",
        "yaw_rate": "yaw=Velocity(yaw_rate=1.5)",
        "hold_below": "yaw=Velocity(hold_below=0.3)",
        "yaw_at_start": "yaw=Velocity(yaw_at_start=1.57)",
        "dim": "nothing: the waypoints have as many coordinates as their rows",
        "max_speed": "limits=Limits(speed=3)",
        "speed": "limits=Limits(speed=3)",
        "max_acceleration": "limits=Limits(acceleration=6)",
        "acceleration": "limits=Limits(acceleration=6)",
        "vehicle": "limits=Limits.of(vehicle)",
        "time": "total_time=10",
        **dict.fromkeys(("vmax", "v_max", "max_velocity", "max_vel", "velocity"), "limits=Limits(speed=3)"),
        **dict.fromkeys(("amax", "a_max", "max_acc", "max_accel"), "limits=Limits(acceleration=6)"),
        **dict.fromkeys(
            ("times", "segment_times", "time_allocation", "T"), "durations=[2, 3], the seconds of each leg"
        ),
        **dict.fromkeys(("obstacles", "obstacle", "keep_out"), "avoid=[Cylinder((x, y), radius)]"),
        **dict.fromkeys(("cost", "objective", "order"), "degree=7 for snap, 5 for jerk"),
        **dict.fromkeys(("points", "path"), "waypoints="),
        **dict.fromkeys(("dt", "rate", "sample_rate"), "nothing: sample the plan, plan.sample(rate=20)"),
        **dict.fromkeys(("jerk", "max_jerk", "jmax"), "limits=Limits(jerk=30)"),
        **dict.fromkeys(("snap", "max_snap"), "limits=Limits(snap=100)"),
        **dict.fromkeys(("tilt", "max_tilt"), "limits=Limits(tilt=0.5), in radians"),
        **dict.fromkeys(("thrust", "max_thrust", "mass"), "limits=Limits.of_mass(mass, max_thrust), in kg and N"),
        **dict.fromkeys(("body_rate", "max_body_rate"), "limits=Limits(body_rate=6)"),
        "frame": 'nothing: write in another frame, write_csv(plan, "path.csv", frame="ned")',
        "gates": "each gate among the waypoints, in the order of the flight",
    },
    short_of_memory("this plan", planned_bytes),
    positional=5,
    last="0.3",
)
def plan(
    waypoints: ArrayLike | Sequence[object] | None,
    durations: ArrayLike | None = None,
    total_time: float | None = None,
    limits: Limits | None = None,
    corridor: ArrayLike | Constraint | Sequence[object] | Sampled | None = None,
    *,
    continuity: int | None = None,
    degree: int = 7,
    yaw: Yaw = None,
    start: Mapping[str, ArrayLike] | None = None,
    end: Mapping[str, ArrayLike] | None = None,
    closed: bool = False,
    solver: Solver = "auto",
    pins: Mapping[int, Mapping[str, ArrayLike]] | None = None,
    pieces: int | Literal["auto"] | None = None,
    waypoint_tolerance: ArrayLike | Ball | None = None,
    search: Search | None = None,
    progress: Progress | bool | None = None,
    avoid: Avoided | Sequence[Avoided] | None = None,
    tracking: Loop | None = None,
    wind: float = 0.0,
    room: Room | Sequence[ArrayLike] | None = None,
) -> Plan:
    r"""Plan the curve through waypoints that minimises the integral of the squared k-th derivative.

    With degree 2k - 1 = 7 that derivative is snap (D. Mellinger and V. Kumar, "Minimum snap trajectory generation and
    control for quadrotors", ICRA 2011).  A corridor holds at every instant, not only at samples.

    Parameters
    ----------
    waypoints : array_like, shape (n, dim), sequence with Gates among them, or None
        Positions to pass through [m], n >= 2; a ``Gate`` is passed anywhere in its opening. A table (a data frame, a
        structured array or a mapping) has columns x, y and z. Its ``yaw`` [rad] and its ``t`` or ``duration`` [s] are
        used unless ``yaw``, a time or limits are set; its ``speed`` [m/s] bounds the leg that begins there, besides.
        With None the corridor is ``Boxes`` or ``Polytopes``: the curve passes from set to set through their overlaps,
        and ``start`` and ``end`` have positions.
    durations : array_like, shape (n - 1,), optional
        Duration of each leg [s]. Between equal waypoints it is a hold, at rest from one to the other.
    total_time : float, optional
        Duration of all legs together [s], divided among them as ``search.split`` says.
    limits : Limits, optional
        Bounds that hold at every instant. Without durations, total time and ``search.time_weight``, the search
        minimises the time within them.
    corridor : float, array_like, Constraint, sequence with Constraints among it, or Sampled, optional
        Half-width of a ``Tube`` around each leg [m], one for all legs or one per leg; or constraints, which all hold,
        such as ``[0.3, Room(lower, upper)]``. All but ``Sampled`` hold at every instant.
    continuity : int, optional
        Derivatives continuous at the knots: k - 1 by default (3 for degree 7), at most 2k - 2. The least is k - 1, or
        k - 2 with one polynomial per leg between fixed waypoints. Above k - 1 it takes durations.
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    yaw : float, array_like of shape (n,), "velocity", "tilt", "free", Velocity, LookAt, callable, optional
        A constant yaw [rad], by default zero. Or one yaw per waypoint, joined by the shortest turns with the least
        integral of squared angular acceleration; ``"velocity"``, along the velocity; ``"tilt"``, without rotation about
        the thrust axis; ``"free"``, the constant yaw that serves best within rotors, of a few that are tried;
        ``LookAt``, towards a point; or a function of time.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": (1, 0, 0)}`` [m/s]; those up to order k - 1 that are not
        named are zero, and those that are ``"free"`` are chosen by the plan, as ``{"velocity": "free"}``. Without
        waypoints also the ``"position"`` [m].
    closed : bool
        A closed lap: the end is a knot like the others. Derivatives that are continuous there are equal at end and
        start, and are chosen by the plan. The first waypoint follows again where the last one is another; durations
        and half-widths are those of all legs then.
    solver : str
        A QP solver by its qpsolvers name, or ``"auto"``.
    pins : mapping, optional
        Derivatives at inner waypoints: ``{2: {"velocity": (1, 0, 0)}}``.
    pieces : int or "auto", optional
        Polynomials per leg. ``"auto"`` lets the search for the shortest time within ``limits`` divide each leg into
        three, divided again into six where three gained 8 %, as six then gain about 0.5 % more, and a single leg into
        nine. In other plans it is one, or three where one has no plan. By default ``"auto"`` where limits choose the
        time, else one.
    waypoint_tolerance : float, array_like of shape (n,) or (n, dim), or Ball, optional
        Half-width of the box around a waypoint within which the curve may pass [m], or a ball. One number applies to
        the inner waypoints; the ends stay exact.
    search : Search, optional
        How durations are searched for: the split of a total time, a price of time, how limits are kept, when to end.
    progress : callable or bool, optional
        Called with a ``Step`` at every evaluation of a search; True shows a line on standard error in a long search.
    avoid : obstacle or sequence of obstacles, optional
        ``Cylinder``, ``Ellipsoid``, ``Cuboid`` and ``Moving`` that the curve stays outside of. Legs around
        them have more polynomials. A better way around them may exist.
    tracking : Loop, optional
        Control loop of the vehicle: corridor, gates, obstacles, thrust and tilt leave it the room that it needs, and
        ``certify`` with the same arguments holds.
    wind : float
        With ``tracking``: largest change of the wind from what it is at the start [m/s].
    room : Room or pair of corners, optional
        Room of all legs, besides the corridor.

    Returns
    -------
    Plan
        A trajectory whose ``report`` says how it was planned.

    Raises
    ------
    WaypointError, TimingError, LimitError, CorridorError, DegreeError, YawError, VehicleError, UnknownSolverError
        If an argument is malformed, contradicts another, or would be ignored; each is a ValueError.
    InfeasibleError
        If no curve meets everything: names the leg and the smallest half-width that has a solution, and proves it.
    UnprovedError
        An InfeasibleError without proof, if a search ends without a plan.
    SolverError
        If every solver failed on a problem that has a solution.
    OutOfMemoryError
        If there is less memory than the plan takes.
    """
    how = check_search(search)
    if room is not None:
        from minsnap.planning.request import with_walls

        corridor = with_walls(corridor, *as_room(room))
    if is_table(waypoints):
        table = read_columns(waypoints)
        waypoints, yaw = table.points, table.yaw if yaw is None else yaw
        if durations is None and total_time is None and limits is None and how.time_weight is None:
            durations = table.durations
        if table.speeds is not None:
            from minsnap.limits.limits import within_speeds

            limits = within_speeds(limits, table.speeds)
    quick = None
    # The quick path takes a few microseconds: it runs before the imports and checks below, and knows their defaults.
    if (
        (search is None or replace(how, on_interrupt="raise") == USUAL)
        and (limits is None and continuity is None and yaw is None and start is None and end is None)
        and (pins is None and waypoint_tolerance is None and avoid is None and tracking is None and not wind)
        and (closed is False and isinstance(solver, str) and solver == "auto" and not isinstance(corridor, Sampled))
        and (pieces is None or (type(pieces) is int and pieces == 1))
    ):
        quick = resting_plan(waypoints, durations, total_time, corridor, degree)
        if quick is not None and progress is None:
            if LOGGER.isEnabledFor(logging.INFO):
                LOGGER.info("planned %d legs: %.6g s of flight, by the quick way", quick.legs, quick.duration)
            return quick
    from minsnap.planning.request import PlanRequest

    waypoints = lap_of(waypoints, durations) if closed is True and waypoints is not None else waypoints
    with progress_line(progress, "searching", partial(_steps_in, how.on_interrupt)) as watch:
        if quick is not None:
            return _show_steps(quick, watch, how.on_interrupt)
        request = PlanRequest(
            waypoints=waypoints,
            durations=durations,
            total_time=total_time,
            limits=limits,
            corridor=corridor,
            continuity=continuity,
            degree=degree,
            yaw=yaw,
            start=start,
            end=end,
            closed=closed,
            solver=_check_named_solver(solver),
            pins=pins,
            pieces=pieces,
            waypoint_tolerance=waypoint_tolerance,
            search=how,
            avoid=as_obstacles(avoid),
            tracking=tracking,
            wind=wind,
        )
        try:
            planned = _plan_request(request, watch)
        except MinsnapError as refused:
            LOGGER.info("refused (%s): %s", refused.code, refused)
            raise
        if LOGGER.isEnabledFor(logging.INFO):
            tried, took = len(planned.report.steps), planned.report.milliseconds
            text = "planned %d legs in %.4g ms: %.6g s of flight, %d steps of a search"
            LOGGER.info(text, planned.legs, took, planned.duration, tried)
        return planned


def _plan_request(request: PlanRequest, watch: Progress | None, said: tuple[str, ...] = ()) -> Plan:
    """Check a request, choose its durations, solve, and report; ``said`` is told in the report, too."""
    if request.tracking is not None or request.wind:
        from minsnap.planning.in_loop import plan_in_loop

        task_of(request)
        return plan_in_loop(request, lambda asked, told: _plan_request(asked, watch, told))
    from minsnap.durations.allocate import plan_timed

    began = perf_counter()
    task, times = task_of(request), request.durations
    if times is None:
        checks.refuse_smoother(task.continuity, task.half)
        checks.refuse_repeated(task.waypoints, "give every leg a duration, which makes it a hold; a course says hold")
    else:
        times = checks.check_durations(times, task.legs)
    search, refine = dict(vars(request.search or USUAL)), checks.check_pieces(request.polynomials)[1]
    limit = search.pop("time_limit")
    due = inf if limit is None else monotonic() + limit
    timing = Timing(times, request.total_time, request.limits, **search, progress=watch, refine=refine, due=due)
    timing.check()
    if task.free_ends and not timing.shortest:
        checks.refuse_undetermined(task.pins, ~task.held[:: task.pieces], task.half)
    task = replace(task, deadline=timing.deadline)
    if limit is None:
        task.deadline.work.worth = WORK.worth(task.legs, task.legs * task.pieces)
    if not request.avoid:
        solve: Callable[[Task], Timed] = partial(plan_timed, timing=timing)
    else:
        from minsnap.planning.around import plan_around

        solve = partial(plan_around, timing=timing, obstacles=request.avoid)
    if checks.is_free(request.yaw):
        timed, told = _plan_with_best_heading(task, timing, solve)
        said += told
    else:
        timed = solve(task)
    known = timed.facts() | {"milliseconds": 1e3 * (perf_counter() - began)}
    widths = widths_of(request.corridor)
    passed = without_gates(request.waypoints)[1], tuple(request.avoid or ()), widths
    chosen = request.pieces is None and refine and not request.avoid
    bounded = timing.shortest and not timed.limits_from
    least = _least_time(request, request.limits, task, passed[0]) if bounded and request.limits else None
    course = _course(task, timing, timed.trajectory) if timing.shortest and not request.avoid else None
    how = _Plan(known, request.limits, request.yaw is None, chosen, *passed, least=least, said=said, course=course)
    return as_plan(timed.trajectory, how)


def _plan_with_best_heading(
    task: Task, timing: Timing, solve: Callable[[Task], Timed]
) -> tuple[Timed, tuple[str, ...]]:
    """Plan at the constant heading that serves best within the limits, and say which one it is."""
    from minsnap.limits.compliance import largest_use
    from minsnap.planning.free_heading import choose_heading, headings_for

    limits, worth, price = timing.limits, task.deadline.work.worth, timing.time_weight or 0.0

    def plan_at(angle: float) -> Timed:
        deadline = replace(task.deadline, work=Work(worth))
        heading = chosen_heading(angle, task.legs, task.closed)
        return solve(replace(task, deadline=deadline, finish=lambda curve: curve.with_yaw(heading(curve))))

    def value(planned: Timed) -> tuple[float, float]:
        duration, used = planned.trajectory.duration, 0.0 if limits is None else largest_use(limits, planned.trajectory)
        return duration if timing.shortest else planned.cost + price * duration, used

    what = "flight time" if timing.shortest else "cost"
    angles = headings_for(limits, task.waypoints)
    headed = choose_heading(angles, plan_at, value, what, lambda planned: planned.interrupted)
    return headed.plan, (headed.note,)


def _course(task: Task, timing: Timing, curve: Trajectory) -> TimedCourse | None:
    """Return the question on which the flight time depends, None where no search goes on from the curve."""
    from minsnap.planning.leg_table import TimedCourse

    if task.continuity > task.half - 1 or timing.split != "optimal" or curve.legs != task.legs:
        return None
    yaw = curve.yaw  # one that was chosen stays
    finish = task.finish if yaw.constant is None else lambda other: other.with_yaw(yaw)
    return TimedCourse(replace(task, pieces=curve.pieces, finish=finish), timing, curve)


def _least_time(request: PlanRequest, limits: Limits, task: Task, gates: Mapping[int, Gate]) -> TimeQuestion:
    """Return the question how long every flight takes at least that keeps what was asked of a plan."""
    from minsnap.bounds.least_time import names_of
    from minsnap.durations.starts import time_question

    beside = {"the obstacles": request.avoid, "the pins on the way": request.pins}
    named = names_of(task.walls) + tuple(name for name, given in beside.items() if given)
    return time_question(task, limits, gates, named)


def _show_steps(curve: Plan, watch: Progress | None, on_interrupt: str) -> Plan:
    """Show the steps of a search that was too quick to be watched."""
    if watch is None:
        return curve
    try:
        for step in curve.report.steps:
            watch(step)
    except KeyboardInterrupt:
        if on_interrupt != "return":
            raise
    return curve


def _steps_in(on_interrupt: str, line: ProgressLine) -> Progress:
    """Return a callback that shows every step of a search in a line."""
    hint = " (Ctrl-C takes the best)" if on_interrupt == "return" else ""
    return lambda step: line.show(None, f"{step.evaluation} plans, {step.total_time:.4g} s{hint}")


def _check_named_solver(solver: Solver) -> Solver:
    """Return the name of a solver that is installed; see ``check_solver``."""
    checks.check_words(solver=solver)
    if solver == "auto":
        return solver
    from minsnap.optimisation.qp import check_solver

    return check_solver(solver)


def task_of(request: PlanRequest) -> Task:
    """Check where the curve passes, with which derivatives, and that both are inside the walls of their legs."""
    limits = request.limits
    if limits is not None:
        from minsnap.limits.limits import check_limits

        check_limits(limits)
    corridor, instants = unsampled(request.corridor, limits is not None)
    constraints = as_constraints(corridor)
    knots = as_knots(request.waypoints, request.waypoint_tolerance)
    half, closed = checks.check_degree(request.degree), checks.check_flag("closed", request.closed)
    smoothness = checks.check_continuity(request.continuity, half)
    pieces, refine = checks.check_pieces(request.polynomials)
    (first, start), (last, end) = (
        checks.check_position(request.start, "start"),
        checks.check_position(request.end, "end"),
    )
    placement = place(knots, constraints, first, last, closed)
    points, lower, upper = placement.points, placement.lower, placement.upper
    check_dimension(points)
    warn_magnitude(points)
    yaw = None if checks.is_free(request.yaw) else request.yaw
    heading = chosen_heading(yaw, len(points) - 1, closed, limits)

    def finish(curve: Trajectory) -> Trajectory:
        return curve.with_yaw(heading(curve))

    pinned = checks.check_pins(request.pins, start, end, closed, half, points)
    checks.check_closing(closed, points)
    held: list[int] = []
    if request.durations is not None and smoothness < half:
        fixed = (lower == upper).all(axis=1)
        fixed[[*placement.regions]] = False
        pinned, held = checks.at_rest_in_holds(pinned, points, fixed, half)
        if closed and pinned.keys() & {0, len(points) - 1}:  # it is closed at rest: from rest to rest, that is
            rest = {order: np.zeros(points.shape[1]) for order in range(1, half)}
            pinned, closed = pinned | {0: rest, len(points) - 1: rest}, False
    walls = walls_of(constraints, points)
    check_reach(placement, pinned, walls)
    walls = [_drop_walls_of_holds(wall, points, held) for wall in walls] if held else walls
    checks.check_jumps(smoothness, half, pieces == 1 and not refine and not (upper > lower).any())
    return Task(
        waypoints=points,
        lower=lower,
        upper=upper,
        pins=pinned,
        half=half,
        continuity=smoothness,
        closed=closed,
        pieces=pieces,
        walls=walls,
        solver=request.solver,
        regions=placement.regions,
        samples=instants,
        finish=finish,
    )


def _drop_walls_of_holds(wall: Walls, points: FloatArray, held: list[int]) -> Walls:
    """Return walls without those that a hold lies on: a point needs no room there, and a curve has none."""
    if wall.order:
        return wall
    on_it = wall.slack(points[wall.leg, None])[:, 0] <= EXACT * wall.width
    return wall.chosen(~(on_it & np.isin(wall.leg, held)))


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is known of a plan when it is made; the rest of its report is measured when somebody asks for it."""

    facts: Mapping[str, Any]
    limits: Limits | None
    default_yaw: bool
    default_pieces: bool
    gates: Mapping[int, Gate]
    obstacles: Sequence[Avoided]
    widths: FloatArray | None
    least: TimeQuestion | None = None
    said: tuple[str, ...] = ()
    course: TimedCourse | None = None

    def report(self, curve: Trajectory) -> Report:
        """Return the report of the plan."""
        limits, notes = self.limits, self.said
        if limits is not None and self.default_yaw:
            from minsnap.limits.heading_cost import fixed_yaw_notes

            notes += fixed_yaw_notes(limits, curve)
        if self.default_pieces and curve.pieces > 1:
            notes += (f"the search chose {curve.pieces} polynomials a leg; with one the flight takes longer",)
        if self.gates or self.obstacles:
            from minsnap.planning.near_notes import near_notes

            notes += near_notes(curve, self.gates, self.obstacles, limits)
        used = () if limits is None else limits.utilisation(curve)
        notes += plan_notes(curve, () if limits is None else limits.given(), self.widths)
        from minsnap.planning.leg_table import LegTable

        course: dict[str, Any] = {"least": self.least, "duration": curve.duration}
        course["known"] = LegTable(curve, limits, self.course)
        return Report(cost=curve.cost(), utilisation=used, notes=notes, **course, **self.facts)
