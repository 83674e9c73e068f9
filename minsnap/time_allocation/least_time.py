"""The shortest plan within limits: a joint search with one piece a leg, then with more, and a certified end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import LONGEST
from minsnap.basics.deadline import LATE, LateError
from minsnap.errors import LimitError, MinsnapError, SolverError, YawError
from minsnap.limits.compliance import keeps, largest_use
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.certified_end import CertifiedEnd, shorter
from minsnap.time_allocation.initial_guess import guessed_lengths, stop_and_go, stop_and_go_times
from minsnap.time_allocation.joint_layout import JointLayout, JointState
from minsnap.time_allocation.joint_problem import JointProblem
from minsnap.time_allocation.joint_search import VANISHING, Evaluated, JointSearch, firmer
from minsnap.time_allocation.least_cost import Log
from minsnap.time_allocation.longer_times import RESERVES
from minsnap.time_allocation.refinement import divided, slowed
from minsnap.time_allocation.refusal import explain
from minsnap.time_allocation.time_stretch import most_used, nothing_limits
from minsnap.time_allocation.timing import Finish, Run
from minsnap.time_allocation.yaw_pace import paced
from minsnap.trajectory.cut_pieces import LONGEST_PIECE
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.report import Progress

DIVISIONS = (3, 2)
"""Parts into which pieces are divided one time after another where their number is left to the search."""

WORTHWHILE = 0.08
"""Relative gain by which pieces are divided once more: that gains about a sixteenth of it, here half a percent."""

OPEN = 1e-3
"""Excess of a limit or a wall above which the search has not found a curve that keeps it."""

FAR = 1.0
"""Excess from which no steps lead back: a curve as wide again as its walls, or to be flown in twice the time."""

RAISES = 3
"""How often the penalties are raised where the search ends outside."""

IDLE, ONWARDS = 1e-4, 6
"""Room below every limit from which a curve found is searched on from, and how often: the fastest reaches a limit."""

WARM_GAIN = 1e-3
"""Relative gain of a step that counts as none in a search from a curve that is given, such as the plan being flown."""

REFINED_GAIN = 1e-4
"""Relative gain of a step that counts as none where the number of pieces is left to the search."""

FirstGuess = Callable[[JointLayout], JointState | None]
"""Gives the state that a search begins from on a layout; None for the usual one."""

SLOWINGS = 30
"""Steps in which a curve found without spin is slowed down until rotors keep their limits under a fixed yaw."""

EASED, POLISHES, POLISHED = 1.03, 2, 2e-4
"""Factor on time from which a search with several pieces is repeated, how often, and the least gain that repeats it."""


class OutOfTimeError(Exception):
    """The time allowed for a search is over."""


class LeastTime:
    """One search for the shortest plan of a task within limits.

    Parameters
    ----------
    task : Task
        Without walls of limits.
    limits : Limits
    finish : callable
        Gives a trajectory its yaw.
    progress : callable, optional
        Called with every Step.
    time_limit : float, optional
        Seconds after which the search ends with the best that it has.
    refine : bool
        Whether legs are divided as long as that promises to gain half a percent, whatever the task's pieces.
    best_on_interrupt : bool
        Whether Ctrl-C ends the search with the best plan it has, instead of raising KeyboardInterrupt.
    first : callable, optional
        Gives the state that the search begins from, such as that of an earlier plan.
    """

    def __init__(
        self,
        task: Task,
        limits: Limits,
        finish: Finish,
        progress: Progress | None = None,
        time_limit: float | None = None,
        refine: bool = False,
        best_on_interrupt: bool = False,
        first: FirstGuess | None = None,
    ) -> None:
        self.task, self.limits, self.finish, self.refine, self.first = task, limits, finish, refine, first
        guess = stop_and_go_times(guessed_lengths(task), limits)
        if not guess.max() <= LONGEST_PIECE:
            raise LimitError(f"the limits are so low that a leg takes over {LONGEST_PIECE:g} s: raise them")
        headed = isinstance(limits, VehicleLimits) or limits.yaw_rate is not None
        self.problem = JointProblem(task, limits, guess, self._heading(guess) if headed else None)
        self.value_unit = self.problem.units.time
        self.log = Log(progress)
        self.clock = task.deadline.clock
        self.told = self.clock()
        self.deadline = np.inf if time_limit is None else self.told + time_limit
        self.interrupted, self.best_on_interrupt = False, best_on_interrupt
        self.kept: Evaluated | None = None
        self.gain = WARM_GAIN if first is not None else REFINED_GAIN if refine else None

    def run(self) -> tuple[SolvedTask, Run]:
        """Return the shortest plan found, certified, and how it was found.

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
        check = self.task.deadline.check
        check()
        first = search = self.problem.search(1, self._tell, self._tick)
        check()
        found = self._looking(search, self._settled(search, self._begin(search)))
        for parts in DIVISIONS if self.refine else (self.task.pieces,):
            before = found.merit
            if self.interrupted or parts == 1:
                break
            search, found = self._finer(search, found, parts)
            if found.merit > before * (1.0 - WORTHWHILE):
                break
        solved = self._certified(search, found)
        solved = self._turning(search, found, None if solved is None else self._again(search, found, solved))
        if solved is None and not self.interrupted:
            solved = self._planned(search, found)
        if solved is None and self.interrupted and self.task.still:
            solved = self._resting(first)
        if solved is None:
            raise LateError(LATE) if self.interrupted else self._reason(search, found)
        return solved, Run(tuple(self.log.steps), self.interrupted)

    def resting(self) -> SolvedTask:
        """Return the plan that rests at every waypoint, where a search has ended before it had a better one.

        Raises
        ------
        LateError
            If it cannot be certified.
        """
        solved = self._resting(self.problem.search(1)) if self.task.still else None
        if solved is None:
            raise LateError(LATE)
        return solved

    def _resting(self, search: JointSearch) -> SolvedTask | None:
        return self._end(search).run(search.evaluate(self._guess(search)))

    def _end(self, search: JointSearch) -> CertifiedEnd:
        return CertifiedEnd(search, self.limits, self.finish, self.problem.complete)

    def _certified(self, search: JointSearch, found: Evaluated) -> SolvedTask | None:
        """Return the certified end of a search, or of the curve before the last division where that is shorter."""
        if _excess(found) > FAR:
            return None
        solved, kept = self._end(search).run(found), self.kept
        if kept is None or kept is found:
            return solved
        if solved is not None and _duration(solved) <= (1.0 + OPEN) * kept.merit * self.problem.units.time:
            return solved
        return shorter(solved, self._end(search).run(kept))

    def _again(self, search: JointSearch, found: Evaluated, solved: SolvedTask) -> SolvedTask:
        """Search again where the certified plan is far slower than the curve found; return the shorter plan.

        The search begins from that curve flown so slowly that it keeps the limits, at a higher price of excesses.
        """
        near = _duration(solved) <= (1.0 + OPEN) * found.state.total * self.problem.units.time
        if near or self.interrupted or not (self.task.still and self.problem.complete):
            return solved
        self._raise_price(search)
        other = self._settled(search, self._slow_enough(search, found.state))
        return shorter(solved, self._end(search).run(other)) or solved

    def _planned(self, search: JointSearch, found: Evaluated) -> SolvedTask | None:
        """Plan for the durations found, or barely longer ones, with the limits as walls: by rows at every instant.

        A curve that slides along a wall has no room for the steps inwards of the certified end.
        """
        task = search.layout.task
        bounded = task.with_walls(self.limits.walls(task.waypoints))
        durations = found.state.durations * self.problem.units.time
        if not (durations <= LONGEST).all():
            return None
        for reserve in RESERVES:
            task.deadline.check()
            try:
                solved = solve(bounded, durations * (1.0 + reserve))
            except (InfeasibleRowsError, SolverError):
                continue
            if keeps(self.limits, self.finish(solved.trajectory)):
                return replace(solved, task=task)
        return None

    def _turning(self, search: JointSearch, found: Evaluated, solved: SolvedTask | None) -> SolvedTask | None:
        """Search again with the limit on the yaw rate, if to keep it the curve was slowed down.

        It begins from a slower curve: where all legs begin at rest a velocity has no direction to speak of.  With a yaw
        at the waypoints no piece becomes shorter than the turns on it take.
        """
        factor = 1.0 if solved is None else solved.trajectory.duration / (found.state.total * self.problem.units.time)
        turns, limit, least = self.problem.turns, self.limits.yaw_rate, None
        if self.interrupted or limit is None or (solved is not None and factor < 1.0 + OPEN):
            return solved
        if not turns:
            if isinstance(self.problem.heading, PlannedHeading):
                least = paced(search.layout, found.state, self.finish, limit, factor * found.state.total)
            if least is None:
                return self._turned(solved, limit)
            factor = float((least / found.state.durations).max())
        again = self.problem.search(search.layout.task.pieces, self._tell, self._tick, turns, least=least)
        best = self._settled(again, slowed(found.state, factor))
        other = self._end(again).run(best)
        return shorter(solved, other)

    def _turned(self, solved: SolvedTask | None, limit: float) -> SolvedTask | None:
        """Return a plan whose yaw keeps the limit on its rate, or raise LimitError: functions of time do not slow."""
        curve = None if solved is None else self.finish(solved.trajectory)
        if curve is not None and not keeps(self.limits, curve):
            used = most_used(self.limits, curve)
            if used.name == "yaw_rate":
                raise LimitError(
                    f"the yaw turns at {used.value:.4g} rad/s at {used.instant:.4g} s, however slow the plan, and "
                    f"{limit:g} rad/s are allowed: give one that turns more slowly"
                )
        return solved

    def _heading(self, guess: FloatArray) -> Heading:
        """Heading of the first guess."""
        layout = JointLayout(replace(self.task, pieces=1), self.task.units(guess))
        return self.finish(layout.trajectory(stop_and_go(layout, guess / layout.units.time))).yaw

    def _tell(self, found: Evaluated) -> None:
        self.log.add(found.state.total * self.problem.units.time, found.merit * self.value_unit)

    def _tick(self) -> None:
        """Measure the step that has ended, and end the search if one more would be late."""
        before, self.told = self.told, self.clock()
        if 2.0 * self.told - before > self.deadline:
            raise OutOfTimeError

    def _guess(self, search: JointSearch) -> JointState:
        known = None if self.first is None else self.first(search.layout)
        if known is not None:
            return known
        return stop_and_go(search.layout, self.problem.guess / self.problem.units.time)

    def _begin(self, search: JointSearch) -> JointState:
        """Return where the search begins; for rotors under a fixed yaw, at a curve found without spin, flown slower.

        From rest at every waypoint the search under a fixed yaw ends in a curve that is twice as slow.
        """
        state = self._guess(search)
        if self.first is not None or self.problem.yaw is None or not isinstance(self.limits, VehicleLimits):
            return state
        free = JointProblem(self.task, self.limits, self.problem.guess, None).search(1, self._tell, self._tick)
        return self._slow_enough(search, self._settled(free, state).state)

    def _looking(self, search: JointSearch, found: Evaluated) -> Evaluated:
        """Where a point is looked at, search also from a curve that keeps the limits: the other may lead through it."""
        looks = isinstance(self.problem.heading, LookAtHeading) and self.limits.yaw_rate is not None
        if not looks or self.first is not None or self.interrupted:
            return found
        again = self.problem.search(1, self._tell, self._tick)
        other = self._settled(again, self._slow_enough(again, self._guess(again)))
        return min(found, other, key=lambda one: self._slowed_time(search, one))

    def _slowed_time(self, search: JointSearch, found: Evaluated) -> float:
        """Total time at which a curve keeps the limits; infinite for one through the point that is looked at."""
        curve = search.layout.trajectory(found.state)
        try:
            return found.state.total * max(1.0, largest_use(self.limits, self.finish(curve)))
        except YawError:
            return np.inf

    def _slow_enough(self, search: JointSearch, state: JointState) -> JointState:
        """Return the same curve flown so slowly that it keeps the limits of a search."""
        for _ in range(SLOWINGS):
            excess = search.evaluate(state).measured.limit
            if self.interrupted or excess <= 0.0:
                break
            state = slowed(state, 1.0 + min(excess, 0.5) + OPEN)
        return state

    def _settled(self, search: JointSearch, state: JointState) -> Evaluated:
        """Search from a state, with higher penalties as long as it ends outside."""
        found = self._run(search, state)
        for attempt in range(RAISES):
            if self.interrupted or _excess(found) <= OPEN:
                break
            self._raise_price(search)
            keeps_all = attempt > 0 and self.task.still
            slower = slowed(found.state, 1.0 + max(found.measured.limit, 0.0))
            found = self._run(search, self._slow_enough(search, slower) if keeps_all else slower)
            if keeps_all:
                found = self._searched_on(search, found)
        if found.state.total < VANISHING * state.total:
            raise nothing_limits(list(self.limits.given()))
        return found

    def _searched_on(self, search: JointSearch, found: Evaluated) -> Evaluated:
        """Search on from a curve that reaches no limit: such a curve is not the fastest nearby, the steps ended early.

        Near free fall steps become so short that rounding decides where they end, 3 % apart. Where the same curve is
        a dead end, so need not be the same flown a little more slowly.
        """
        factor = 1.0
        for _ in range(ONWARDS):
            if self.interrupted or not found.measured.limit < -IDLE:
                break
            before, found = found, min(found, self._run(search, slowed(found.state, factor)), key=_merit)
            factor = factor * EASED if found is before else 1.0
        return found

    def _raise_price(self, search: JointSearch) -> None:
        search.penalties = firmer(search.penalties)
        self.log.forget()

    def _run(self, search: JointSearch, state: JointState) -> Evaluated:
        try:
            return search.run(state, gain=self.gain)
        except (KeyboardInterrupt, OutOfTimeError) as end:
            if isinstance(end, KeyboardInterrupt) and not self.best_on_interrupt:
                raise
            self.interrupted = True
            return search.best

    def _finer(self, search: JointSearch, found: Evaluated, parts: int) -> tuple[JointSearch, Evaluated]:
        """Go on with every piece divided, from the same curve flown more slowly; keep what is shorter in the end."""
        fine = self.problem.search(search.layout.task.pieces * parts, self._tell, self._tick)
        fine.penalties = search.penalties
        start = divided(search.layout, found.state, fine.layout)
        self.kept = fine.evaluate(start)
        best = min(self.kept, self._settled(fine, slowed(start)), key=_merit)
        return fine, best if self.refine else self._repeated(fine, best)

    def _repeated(self, search: JointSearch, best: Evaluated) -> Evaluated:
        """Search again from the best curve flown a little more slowly, while that gains."""
        for _ in range(POLISHES):
            if self.interrupted or _excess(best) > OPEN:
                break
            before, best = best, min(best, self._settled(search, slowed(best.state, EASED)), key=_merit)
            if best.merit > before.merit * (1.0 - POLISHED):
                break
        return best

    def _reason(self, search: JointSearch, found: Evaluated) -> MinsnapError:
        """Say why the search ended outside: the corridor alone, or which limit is exceeded where and by how much."""
        if not self.task.explained:
            return SolverError("no plan that keeps the walls and the limits was found from this start")
        durations = found.state.durations * self.problem.units.time
        if not (durations <= LONGEST).all():
            return SolverError(f"no plan that keeps the limits was found within {LONGEST:g} s a leg: loosen a limit")
        reason = explain(search.layout.task, durations)
        if not isinstance(reason, SolverError):
            return reason
        used = most_used(self.limits, self.finish(search.layout.trajectory(found.state)))
        if _excess(found) <= OPEN:
            return SolverError(f"the plan of {durations.sum():.6g} s found could not be certified: loosen a limit")
        return SolverError(
            f"no speed was found at which the limits can be kept inside the corridor: {used.name} reaches "
            f"{used.value:.6g} on leg {used.leg} at {used.instant:.4g} s where {used.limit:.6g} is allowed; raise it "
            "or change the path"
        )


def _duration(solved: SolvedTask) -> float:
    return solved.trajectory.duration


def _excess(found: Evaluated) -> float:
    return max(found.measured.limit, found.measured.wall)


def _merit(found: Evaluated) -> float:
    return found.merit
