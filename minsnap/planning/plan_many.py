"""plan_many: the same call for many problems, over threads; what fails is an error of its problem alone."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter
from typing import Literal, NamedTuple

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, owned
from minsnap.basics.checks import check_degree, check_switch, check_threads
from minsnap.basics.messages import explains_names
from minsnap.basics.needed_memory import planned_bytes, within_memory
from minsnap.basics.progress import ProgressLine, of_steps, progress_line
from minsnap.basics.tolerances import GAP
from minsnap.corridors.boxes import Room, as_room
from minsnap.corridors.constraint import Constraint
from minsnap.durations.search_options import Search
from minsnap.errors import CorridorError, InputError, LimitError, MinsnapError, TimingError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.native.plan_batches import ManyChains, ManySlopes, many_gradients, many_optima, many_tubes
from minsnap.native.quick_look import look_over
from minsnap.native.status import Status
from minsnap.optimisation.tube_report import TubeReports
from minsnap.planning.problem_rows import GRADIENT_GAP, ManyProblems, Pins, ProblemRows, State
from minsnap.planning.request import with_walls
from minsnap.trajectory.report import LinearSystem
from minsnap.trajectory.trajectories import Gradients, Reports, Slopes, Trajectories
from minsnap.trajectory.trajectory import ReportMaker, Trajectory, report_maker


class ManyStep(NamedTuple):
    """How many problems are planned, of how many."""

    done: int
    problems: int


@within_memory("this batch of plans", planned_bytes)
@explains_names({"times": "durations=", "corridors": "corridor="})
def plan_many(
    waypoints: ArrayLike | Sequence[ArrayLike],
    durations: ArrayLike | Sequence[ArrayLike] | None = None,
    corridor: ArrayLike | Constraint | Sequence[object] | None = None,
    *,
    limits: Limits | Sequence[Limits | None] | None = None,
    pins: Pins | Sequence[Pins | None] | None = None,
    total_time: float | Sequence[float] | None = None,
    degree: int = 7,
    start: State | None = None,
    end: State | None = None,
    pieces: int | Literal["auto"] | Sequence[int | Literal["auto"] | None] | None = None,
    gradients: bool = False,
    threads: int | None = None,
    progress: Callable[[ManyStep], None] | bool | None = None,
    room: Room | Sequence[ArrayLike] | None = None,
    search: Search | Sequence[Search | None] | None = None,
) -> Trajectories:
    """Plan many problems; see ``plan``.

    Parameters
    ----------
    waypoints : array_like, shape (B, n, dim), or sequence of B array_like, each (n_b, dim)
        Positions to pass through [m].
    durations : array_like, shape (B, n - 1) or (n - 1,), or sequence of B array_like, each (n_b - 1,)
        Seconds a leg; one row of them serves all problems of an array. Left out where ``limits`` or ``total_time``
        choose them.
    corridor : float, Constraint, or sequence of B of what ``plan`` takes, optional
        One for all problems, or one for each; an array's first axis counts problems.
    limits, pins, total_time : optional
        What ``plan`` takes: one for all problems, or a sequence of B.
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": v}`` with v of shape (dim,) or (B, dim) [m/s]; those up to order
        k - 1 that are not named are zero.
    pieces : int, "auto" or sequence of B of them, optional
        Polynomials per leg, as ``plan`` takes them: by default ``"auto"`` where ``limits`` choose the time, else one.
    gradients : bool
        Whether ``many.gradients`` holds the exact derivatives of every optimal cost in durations, waypoints and the
        half-widths of tubes (``many.gradients.stacked``: a row for each plan): for fixed durations, without limits,
        one polynomial per leg, in walls of this library. Plans in tubes from rest to rest are then solved more
        accurately, and may differ from those of ``plan`` by some 1e-6 of their cost.
    threads : int, optional
        Threads to use; by default as many as processors.  The result does not depend on it.
    progress : callable or bool, optional
        Called with a ``ManyStep`` now and then: ``done`` of ``problems`` are planned. True shows a line on
        standard error where it takes long.
    room : Room or pair of corners, optional
        Room of all legs of all problems, besides the corridors.
    search : Search or sequence of B of them, optional
        How durations are searched for, as ``plan`` takes it: a time limit is that of each plan.

    Returns
    -------
    Trajectories
        ``many[i]`` is a Trajectory, ``many.errors[i]`` the MinsnapError of a problem that has none.

    Raises
    ------
    InputError
        If it is not clear what the problems are: another number of durations, corridors or end states than of
        waypoints, or a degree that does not exist; or if gradients are not known for it.  What is wrong
        with one problem is in ``errors``.
    OutOfMemoryError
        If there is less memory than the plans take.
    """
    began = perf_counter()
    half = check_degree(degree)
    batch = ProblemRows.of(waypoints, durations)
    ends = batch.ends(start, "start", half), batch.ends(end, "end", half)
    divided = None if limits is None and type(pieces) is int and pieces == 1 else pieces
    known = (
        ("limits", limits, LimitError),
        ("pins", pins, WaypointError),
        ("total_time", total_time, TimingError),
        ("pieces", divided, InputError),
        ("search", search, InputError),
    )
    others = {name: batch.each(name, value, error) for name, value, error in known if value is not None}
    others |= {"durations": [None] * len(batch)} if durations is None else {}
    walls = None if corridor is None else batch.each("corridor", corridor, CorridorError)
    if room is not None:
        walls = [with_walls(own, *as_room(room)) for own in walls or [None] * len(batch)]
    workers = check_threads(threads, InputError)
    told = of_steps(progress, ManyStep, "plan_many")
    with progress_line(told, "planning", _problems_in) as watch:
        return _solve(ManyProblems(batch, half, ends, walls, others, workers, began, watch), gradients)


def _problems_in(line: ProgressLine) -> Callable[[int, int], None]:
    """Return a callback that shows the number of problems in a line."""
    return lambda done, count: line.show(done / count, f"{done} of {count} problems")


def _solve(many: ManyProblems, gradients: bool) -> Trajectories:
    """Plan in the way that fits the request."""
    widths = many.widths()
    if check_switch("gradients", gradients):
        _check_gradients(many)
    if many.others:
        return _solve_one_by_one(many, gradients)
    if many.corridors is None:
        return _solve_free(many, gradients)
    return _solve_one_by_one(many, gradients) if widths is None else _solve_in_tubes(many, widths, gradients)


def _check_gradients(many: ManyProblems) -> None:
    from minsnap.corridors.named_constraints import CONSTRAINTS

    timed = {name: [value for value in values if value is not None] for name, values in many.others.items()}
    if "durations" in timed or timed.get("limits") or timed.get("total_time"):
        raise InputError("gradients are known for fixed durations: leave out gradients=True, or limits and total_time")
    if any(value != 1 for value in timed.get("pieces", ())):
        raise InputError("gradients are known with one polynomial per leg: leave out gradients=True, or pieces")
    for corridor in many.corridors or ():
        for part in corridor if isinstance(corridor, (list, tuple)) else [corridor]:
            if hasattr(part, "walls") and CONSTRAINTS.get(type(part).__name__) is not type(part):
                kinds = ", ".join(CONSTRAINTS)
                raise InputError(f"gradients are known in walls of {kinds}, not of {type(part).__name__}")


def _solve_free(many: ManyProblems, gradients: bool) -> Trajectories:
    """Plan without walls, all at once where the native core is."""
    batch = many.batch
    chains = ManyChains(batch.points, batch.durations, batch.offsets, many.half, many.workers)
    solved = many_optima(chains, many.ends)
    if solved is None:
        return _solve_one_by_one(many, gradients)
    slopes = many_gradients(chains, many.ends) if gradients else None
    how: ReportMaker = LinearSystem(0.0, (perf_counter() - many.began) / max(len(batch), 1), "native")
    return _complete(many, solved, [how] * len(batch), slopes)


def _solve_in_tubes(many: ManyProblems, widths: FloatArray, gradients: bool) -> Trajectories:
    """Plan from rest to rest in tubes, all at once where the native core is."""
    batch = many.batch
    gap = GRADIENT_GAP if gradients else GAP
    chains = ManyChains(batch.points, batch.durations, batch.offsets, many.half, many.workers)
    curves = many_tubes(chains, widths, gradients, gap, many.watch)
    if curves is None:
        return _solve_one_by_one(many, gradients)
    look_over(chains, widths, curves.points, curves.statuses)
    share = (perf_counter() - many.began) / max(len(batch), 1)
    reports = TubeReports(share, curves.figures, owned(batch.points), widths, batch.offsets)
    return _complete(many, (curves.points, curves.breaks, curves.statuses), reports, curves.slopes)


def _complete(
    many: ManyProblems, solved: tuple[FloatArray, FloatArray, IntArray], made: Reports, slopes: ManySlopes | None
) -> Trajectories:
    """Plan by themselves the problems that the native core left, and wrap all."""
    points, breaks, statuses = solved
    batch = many.batch
    errors: list[MinsnapError | None] = [None] * len(batch)
    own_reports: dict[int, ReportMaker] = {}
    for index in np.flatnonzero(statuses != Status.DONE).tolist():
        curve = many.alone(index)
        if isinstance(curve, MinsnapError):
            errors[index] = curve
            continue
        legs = slice(int(batch.offsets[index]), int(batch.offsets[index + 1]))
        points[legs], breaks[legs.start + index : legs.stop + index + 1] = curve.control_points, curve.breaks
        own_reports[index] = curve.report or made[index]
        if slopes is not None:
            own = many.slopes(index, curve)
            slopes.durations[legs], slopes.displacements[legs] = own.durations, -np.cumsum(own.waypoints[:-1], axis=0)
            if slopes.widths is not None:
                slopes.widths[legs] = own.widths
    gradients = None if slopes is None else Gradients.of_legs(*slopes, batch.offsets)
    reports: Reports = ChainMap(own_reports, made)  # type: ignore[arg-type]  # of which only entries are taken
    return Trajectories(points, batch.durations, breaks, batch.offsets, tuple(errors), reports, many.workers, gradients)


def _solve_one_by_one(many: ManyProblems, gradients: bool) -> Trajectories:
    """Plan every problem by itself."""

    def slopes(index: int) -> Slopes:
        curve = answers[index]
        if isinstance(curve, Trajectory):
            return many.slopes(index, curve)
        first, last = many.batch.offsets[index : index + 2].tolist()
        return Slopes.unknown(last - first, many.batch.dim)

    answers = many.all_alone()
    with ThreadPoolExecutor(many.workers) as pool:
        each = list(pool.map(slopes, range(len(answers)))) if gradients else []
    blank: ReportMaker = LinearSystem(0.0, 0.0, "python")
    curves = [curve if isinstance(curve, Trajectory) else None for curve in answers]
    points = np.concatenate([np.zeros((0, 2 * many.half, many.batch.dim)), *(c.control_points for c in curves if c)])
    durations = np.concatenate([np.zeros(0), *(c.durations for c in curves if c)])
    breaks = np.concatenate([np.zeros(0), *(np.zeros(1) if c is None else c.breaks for c in curves)])
    offsets = np.asarray(np.cumsum([0, *(0 if c is None else len(c.durations) for c in curves)]))
    errors = tuple(None if isinstance(f, Trajectory) else f for f in answers)
    reports = [(None if c is None else report_maker(c)) or blank for c in curves]
    walls = many.corridors is not None
    known = Gradients.of_plans(each, many.batch.dim, walls) if gradients else None
    pieces = {index: c.pieces for index, c in enumerate(curves) if c is not None and c.pieces > 1}
    return Trajectories(points, durations, breaks, offsets, errors, reports, many.workers, known, pieces)
