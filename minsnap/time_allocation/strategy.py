"""What is tried for the shortest plan within limits, in which order, and when it ends.

1. One interior point on the whole problem, natively (``interior_search``), from rest at every waypoint or from a curve
   that is given; a plan that exact extrema certify is the answer.
2. Where the yaw turns too fast, a search from that curve with the limit on its rate: of the velocity's direction as a
   limit like others, of a yaw given at the waypoints as least durations of the legs.
3. A plan for the durations found with the limits as walls, kept by rows at every instant: a curve that slides along
   a wall has no room to be moved inwards.
4. Else the reason why there is none.

It ends when the time allowed is over, and where Ctrl-C asks for the best so far: then also a plan that rests at every
waypoint will do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import LONGEST
from minsnap.basics.deadline import LATE, Deadline, LateError
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import LimitError, MinsnapError, SolverError
from minsnap.limits.compliance import KEPT, keeps
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.native.library import NativeCoreError, core, describe
from minsnap.native.shortest_time import Guess, ShortestCurve, ShortestQuestion, search_shortest
from minsnap.optimisation.native_solve import in_pieces
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.solve import Effort, solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.time_allocation.initial_guess import guessed_lengths, stop_and_go_times
from minsnap.time_allocation.interior_search import NOT_LONGER, InteriorSearch, solved_at
from minsnap.time_allocation.least_cost import Log
from minsnap.time_allocation.longer_times import RESERVES
from minsnap.time_allocation.recovery import state_at
from minsnap.time_allocation.refusal import explain
from minsnap.time_allocation.shortest_question import coasting_guess, guess_of, question_of
from minsnap.time_allocation.time_scaling import yaw_too_fast
from minsnap.time_allocation.time_stretch import most_used, nothing_limits, touching_factor
from minsnap.time_allocation.timing import AttachHeading, Run, Timing
from minsnap.time_allocation.yaw_pace import paced
from minsnap.trajectory.cut_pieces import LONGEST_PIECE
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory

VANISHING = 1e-6
"""Share of the first total below which nothing limits the time."""

SOFTER, SLOWER = 2.0, 1.3
"""Factor on rates in a first search, and on the time of its curve, from which the search goes on."""

LOOSER = 4.0
"""Factor on limits for a curve that shows which one is in the way."""

ANY = np.inf
"""Share by which a plan may be slower than the curve of a search that does not know every limit."""


class Strategy:
    """One search for a plan within limits.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    limits : Limits
    timing : Timing
    finish : callable
        Gives a curve its yaw.

    Raises
    ------
    LimitError
        If the limits are too low for any leg.
    LateError
        If the time allowed is over.
    """

    def __init__(self, task: Task, limits: Limits, timing: Timing, finish: AttachHeading) -> None:
        task.deadline.check()
        if core().name != "native":
            raise NativeCoreError(f"plans within limits need the native core, and this is the {describe()}")
        self.times = stop_and_go_times(guessed_lengths(task), limits)
        if not self.times.max() <= LONGEST_PIECE:
            raise LimitError(f"the limits are so low that a leg takes over {LONGEST_PIECE:g} s: raise them")
        self.task, self.limits, self.timing, self.finish = task, limits, timing, finish
        self.log, self.interrupted, self.longest = Log(timing.progress), False, 0.0
        left = timing.time_limit
        self.due = task.deadline.due if left is None else min(task.deadline.due, task.deadline.clock() + left)
        self.search = InteriorSearch(task, limits, finish, self.polled)

    def run(self, first: Trajectory | None = None) -> tuple[SolvedTask, Run]:
        """Return the shortest plan, certified, and its search.

        Parameters
        ----------
        first : Trajectory, optional
            To search from.

        Raises
        ------
        InfeasibleError
            If it is proved that no curve keeps the walls.
        SolverError
            If no speed was found at which limits and walls can be kept.
        LateError
            If the time allowed was over before.
        LimitError
            If nothing limits the time.
        """
        guess = None if first is None else guess_of(first, self.task)
        solved = self.solve(guess)
        if solved is None and not self.interrupted:
            solved = self._from_one_piece() or self._planned()
        if solved is None and self.interrupted and self.task.still:
            solved = self._resting()
        if solved is None:
            raise LateError(LATE) if self.interrupted else self.reason()
        return solved, Run(tuple(self.log.steps), self.interrupted)

    def solve(self, guess: Guess | None, price: float = 0.0) -> SolvedTask | None:
        """Search, for a price of time or for the least time, with the rate of the yaw where it matters."""
        heading = self._heading()
        turns = self.limits.yaw_rate is not None and heading is not None and heading.limited_last
        known = heading is None or heading.constant is not None or heading.medium is not None
        far = NOT_LONGER if known or self.limits.yaw_rate is not None else ANY
        question = replace(question_of(self.task, self.limits, self.timing.refine, heading, guess), price=price)
        first = self._first_guess(heading, turns) if guess is None else None
        if first is not None:
            begun = question_of(self.task, self.limits, self.timing.refine, heading, first)
            solved = self._run(replace(begun, price=price), far)
            if solved is not None or self.interrupted:
                return solved
        if not turns:
            return self._run(question, far)
        others = replace(self.limits, yaw_rate=None)
        free = InteriorSearch(self.task, others, self.finish, self.polled)
        without = question_of(self.task, others, self.timing.refine, heading, guess)
        solved = self._run(replace(without, price=price), far, free)
        self.search.answer = free.answer
        if solved is None or self.interrupted or keeps(self.limits, self.finish(solved.trajectory)):
            return solved
        return self._turning(solved, heading)

    def _first_guess(self, heading: Heading | None, turns: bool) -> Guess | None:
        """Return a curve to begin from where rest at every waypoint is a poor one, or None."""
        softer = self._softer(heading)
        if softer is not None or turns or self.task.still:
            return softer
        return coasting_guess(self.task, self.times)

    def _softer(self, heading: Heading | None) -> Guess | None:
        """Search with higher rates first: from rest the way around free fall, or around a point, is hard to find."""
        names = ["body_rate"] if self.limits.body_rate is not None else []
        soft = self.limits.yaw_rate is not None and heading is not None and heading.limited_softly
        names += ["yaw_rate"] if soft else []
        if not names:
            return None
        limits = replace(self.limits, **{name: SOFTER * getattr(self.limits, name) for name in names})
        question = question_of(replace(self.task, pieces=1), limits, False, heading)
        answer = search_shortest(replace(question, rough=True), self.polled)
        if answer is None or not answer.kept or answer.stopped:
            return None
        return Guess(1, answer.durations, answer.knots, SLOWER)

    def _run(self, question: ShortestQuestion, far: float, search: InteriorSearch | None = None) -> SolvedTask | None:
        self.log.forget()
        try:
            return (search or self.search).run(question, far)
        except KeyboardInterrupt:
            if not self.timing.best_on_interrupt:
                raise
            self.interrupted = True
            return None

    def _turning(self, solved: SolvedTask, heading: Heading | None) -> SolvedTask | None:
        """Search again from a plan with the limit on the rate of its yaw."""
        task = replace(self.task, pieces=solved.task.pieces)
        guess = guess_of(solved.trajectory, task)
        assert guess is not None and self.limits.yaw_rate is not None
        if heading is not None and heading.polynomial is not None:
            curve = self.finish(solved.trajectory)
            least = paced(curve, self.finish, self.limits.yaw_rate)
            if least is None:
                raise yaw_too_fast(self.limits, curve)
            slower = float((least / guess.durations).max())
            guess = replace(guess, slower=slower, least=least)
        again = InteriorSearch(task, self.limits, self.finish, self.polled)
        turned = self._run(question_of(task, self.limits, False, heading, guess), NOT_LONGER, again)
        return turned or self._slower(solved)

    def _slower(self, solved: SolvedTask) -> SolvedTask | None:
        """Fly a plan as much more slowly as all limits ask for."""
        if not self.task.still or self.search.answer is None:
            return None
        try:
            factor = touching_factor(self.limits, self.finish(solved.trajectory))
        except MinsnapError:
            return None
        return solved_at(self.task, self.search.answer, factor)

    def polled(self, total: float, pressed: bool) -> bool:
        """Tell of an iteration, and say whether the search must end: late, or by Ctrl-C."""
        self.longest = max(self.longest, total)
        if total < VANISHING * self.longest:
            raise nothing_limits(list(self.limits.given()))
        try:
            self.log.add(total, total)
            if pressed:
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            if not self.timing.best_on_interrupt:
                raise
            self.interrupted = True
        self.interrupted = self.interrupted or self.task.deadline.clock() > self.due
        return self.interrupted

    def _heading(self) -> Heading | None:
        """Heading of any curve of the task, where limits depend on it: of that along the straight legs."""
        if not isinstance(self.limits, VehicleLimits) and self.limits.yaw_rate is None:
            return None
        return self.finish(self._straight(self.times).trajectory).yaw

    def _straight(self, durations: FloatArray) -> SolvedTask:
        """Return the curve that rests at every waypoint."""
        task = self.task
        knots = np.zeros((task.legs + 1, task.half, task.dim))
        knots[:, 0] = task.waypoints
        ends = [np.repeat(points[:, None], task.half, axis=1) for points in (task.waypoints[:-1], task.waypoints[1:])]
        points = np.concatenate(ends, axis=1)
        return solved_at(task, ShortestCurve(durations, points, knots, 0, True, True), 1.0)

    def _resting(self) -> SolvedTask | None:
        """Return the certified plan that rests at every waypoint, where a search ended before it had a better one."""
        solved = self._straight(self.times)
        if not solved.inside:
            return None
        factor = touching_factor(self.limits, self.finish(solved.trajectory))
        slowed = self._straight(self.times * factor)
        return slowed if keeps(self.limits, self.finish(slowed.trajectory)) else None

    def _from_one_piece(self) -> SolvedTask | None:
        """Search with one piece a leg where several have no curve, then with several from that curve, or cut it."""
        task = self.task
        if task.pieces == 1 and not self.timing.refine:
            return None
        alone = Strategy(replace(task, pieces=1), self.limits, replace(self.timing, refine=False), self.finish)
        alone.log, alone.due = self.log, self.due
        first = alone.solve(None)
        if first is None or alone.interrupted or self.timing.refine:
            self.interrupted = alone.interrupted
            return first
        return self.solve(guess_of(first.trajectory, alone.task)) or self._cut(first)

    def _cut(self, first: SolvedTask) -> SolvedTask | None:
        """Cut a plan of one piece a leg into the wanted number; more samples of it may find it barely too fast."""
        if first.optimum.points is None:
            return None
        task, curve = self.task, first.trajectory
        durations = task.piece_durations(first.durations)
        points, _ = in_pieces(task, durations, first.units, first.optimum.points, first.optimum.knots)
        instants = np.minimum(np.append(0.0, np.cumsum(durations)), curve.duration)
        cut = ShortestCurve(durations, points, state_at(curve, instants, task.half), first.optimum.rounds, True, True)
        slower = (solved_at(task, cut, factor) for factor in (1.0, 1.0 + 1e-6, 1.0 + 1e-5, 1.0 + 1e-4))
        return next((each for each in slower if each.inside and keeps(self.limits, self.finish(each.trajectory))), None)

    def _planned(self) -> SolvedTask | None:
        """Plan for the durations of the search, or barely longer ones, with the limits as walls."""
        answer = self.search.answer
        if answer is None or not (answer.durations <= LONGEST).all():
            return None
        task = replace(self.task, pieces=len(answer.durations) // self.task.legs)
        bounded = task.with_walls(self.limits.walls(task.waypoints))
        for reserve in RESERVES:
            task.deadline.check()
            try:
                solved = solve(bounded, answer.durations * (1.0 + reserve), effort=Effort.TRY)
            except (InfeasibleRowsError, SolverError):
                continue
            if keeps(self.limits, self.finish(solved.trajectory)):
                return replace(solved, task=task)
        return None

    def reason(self) -> MinsnapError:
        """Say why the search ended outside: the corridor alone, or which limit is exceeded where and by how much."""
        if not self.task.explained:
            return SolverError("no plan that keeps the walls and the limits was found from this start")
        used = self._exceeded()
        if used is not None:
            return SolverError(
                f"no speed was found at which the limits can be kept inside the corridor: {used.name} reaches "
                f"{used.value:.6g} on leg {used.leg} at {used.instant:.4g} s where {used.limit:.6g} is allowed; raise "
                "it or change the path"
            )
        answer = self.search.answer
        durations = answer.durations if answer is not None and answer.kept else self.times
        if not (durations <= LONGEST).all():
            return SolverError(f"no plan that keeps the limits was found within {LONGEST:g} s a leg: loosen a limit")
        task = replace(self.task, pieces=len(durations) // self.task.legs, deadline=Deadline(self.due))
        reason = explain(task, durations)
        if answer is None or not isinstance(reason, SolverError):
            return reason
        return SolverError(f"the plan of {durations.sum():.6g} s found could not be certified: loosen a limit")

    def _exceeded(self) -> Utilisation | None:
        """Return the limit that a curve within looser ones exceeds most; None without such a curve."""
        names = [name for name in self.limits.given() if KIND[name].order or name in ("max_thrust", "body_rate")]
        looser = replace(self.limits, **{name: LOOSER * getattr(self.limits, name) for name in names})
        answer = search_shortest(question_of(self.task, looser, False, self._heading()), self.polled)
        if answer is None or not answer.kept or self.interrupted:
            return None
        used = most_used(self.limits, self.finish(solved_at(self.task, answer, 1.0).trajectory))
        return used if used.fraction > 1.0 + KEPT else None
