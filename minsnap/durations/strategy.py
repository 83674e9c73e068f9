"""What is tried for the shortest plan within limits, in which order, and when it ends.

1. One interior point on the whole problem, natively, from rest at every waypoint or from a curve that is given.
   It keeps walls and limits at instants and at the peaks that it sees between them; exact extrema have the last word.
   A curve outside a wall is searched again with the walls moved further inwards, and the time is scaled until the
   most used limit is just kept; where that does not help, the limits are tightened.  Within rotors fewer pieces come
   first, which are divided; where the yaw is known, every search from rest begins with a body that is easy to turn.
   Along the velocity it begins from a curve that takes the least torque which any heading asks for and turns as fast as
   it likes: a rough one, and where the rate is limited from the shortest besides.
   Where it has no end, or a longer one, it leaves the shortest curve inside that it came by.
2. Where drag is uneven and no curve with its mean is certified, the least cost in barely longer durations.
3. The shortest curve inside all limits that any of these searches came by on its way, where its end is no plan.
4. Rest at every waypoint, where the search was ended, or longer times are asked for.

The shortest flight of all is taken; without any, the reason why there is none.  Time, work and Ctrl-C end it between
two of them with the best so far.  Every smaller number of pieces is searched the same way (``starts.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import chain
from typing import Any, TypeVar

import numpy as np

from minsnap.basics.arrays import FloatArray, significant
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import LONGEST
from minsnap.basics.deadline import WORK, LateError
from minsnap.basics.limit_kinds import KIND
from minsnap.durations.initial_guess import guessed_lengths, priced_factor, stop_and_go_times, worth_of_time
from minsnap.durations.outcome import PlanOutcome, if_possible, or_reason
from minsnap.durations.shortest_question import (
    QUESTION,
    begun_from,
    coasting,
    guess_of,
    question_of,
    with_rates,
)
from minsnap.durations.time_stretch import (
    STRETCH,
    grained,
    measuring_work,
    nearby_factor,
    powers_factor,
    touching_factor,
)
from minsnap.durations.timing import Run, Timing, timed
from minsnap.durations.watched_search import WatchedSearch
from minsnap.errors import LimitError, MinsnapError, SolverError, YawError
from minsnap.limits.compliance import KEPT, keeps, largest_use, most_used
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.vehicle_use import lateral_alike
from minsnap.native.library import NativeCoreError, core, describe
from minsnap.native.shortest_time import Guess, ShortestCurve, ShortestQuestion
from minsnap.optimisation.optimum import NO_KNOTS, Optimum
from minsnap.optimisation.solved_task import NATIVE, SolvedTask
from minsnap.optimisation.task import Task
from minsnap.polynomials.bernstein import divided_pieces
from minsnap.refusals.given_times import explain
from minsnap.refusals.sentences import UnlimitedError, exceeded_by_a_search, nothing_limits, yaw_too_fast
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.instants import LONGEST_PIECE
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import VelocityHeading


@dataclass(frozen=True)
class StrategySettings:
    """What decides when a search is repeated, and when it ends.

    Parameters
    ----------
    unlimited_below : float
        Factor on the time of a curve below which no limit is in its way: the search ended only since curves should be
        smooth, and the time has no least.
    large_slack, unlimited_below_slack : float
        Room inside all limits, in widths, beyond which the search ended by none of them, and that factor there.
    rate_factor, time_factor : float
        Factor on the rate of a view in a first search, and on the time of its curve, from which the search goes on.
    limit_factor : float
        Factor on all limits for a curve that shows which one is in the way.
    divided_time_factors : tuple of float
        Factor on the time of a plan whose legs are divided; where it has several pieces a leg, the second one.
    slower_parts : tuple of float
        Shares by which a curve that is divided is flown more slowly, until no sample of its parts is over a limit.
    searches : int
        How often is searched until a curve can be certified.
    inward_factor : float
        Factor on the share by which walls are moved inwards, where a curve is outside.
    seen_excess : float
        Relative excess of a limit up to which the search has seen it; beyond, it is not repeated.
    parts_of_excess : tuple of float
        By which a curve along the velocity is flown more slowly that exceeds a limit by little, until it keeps all.
    worth_repeating : float
        Relative excess from which its search is repeated nevertheless.
    tightening : float
        Multiple of the excess by which limits are tightened where the search is repeated.
    tightened_again : float
        Share by which they are tightened further where a search from a plan is repeated.
    longer_factors : tuple of float
        Factors on the durations of a curve that a search left and none certified, in which the least cost is searched.
    slower_share : float
        Share by which the certified curve may be slower than that of a search; beyond, it did not see a limit.
    slow_by_turns : float
        Factor on the time of a search beyond which a plan is slow by what it does not know, the torque of a yaw.
    prices : tuple of float
        Over what its time is worth where it rests at every waypoint: prices from whose plans a total is searched.
    """

    unlimited_below: float = 0.8
    large_slack: float = 0.05
    unlimited_below_slack: float = 0.98
    rate_factor: float = 2.0
    time_factor: float = 1.3
    limit_factor: float = 4.0
    divided_time_factors: tuple[float, float] = (1.4, 1.05)
    slower_parts: tuple[float, ...] = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
    searches: int = 3
    inward_factor: float = 10.0
    seen_excess: float = 0.05
    parts_of_excess: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0)
    worth_repeating: float = 0.01
    tightening: float = 2.0
    tightened_again: float = 1e-3
    longer_factors: tuple[float, ...] = (1.01, 1.03, 1.06, 1.1)
    slower_share: float = 1e-3
    slow_by_turns: float = 1.02
    prices: tuple[float, ...] = (1.0, 10.0)


SETTINGS = StrategySettings()

Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class Attempt:
    """What a search found, or all so far.

    Parameters
    ----------
    solved : SolvedTask or None
        The plan of the shortest flight, certified.
    curve : ShortestCurve or None
        The last curve of a search, which need not be inside.
    reason : LimitError, SolverError, YawError or None
        What was in the way of a plan, where that is known.
    stands_in : bool
        Whether the plan stands in for the end of a search.
    """

    solved: SolvedTask | None = None
    curve: ShortestCurve | None = None
    reason: LimitError | SolverError | YawError | None = None
    stands_in: bool = False

    def then(self, later: Attempt) -> Attempt:
        """Return what both found: the shorter flight, and the later curve."""
        solved = shorter(self.solved, later.solved)
        stands_in = self.stands_in if solved is self.solved else later.stands_in
        return Attempt(solved, later.curve or self.curve, self.reason or later.reason, stands_in)

    @property
    def hopeless(self) -> bool:
        """Whether there is no plan, as nothing limits the time, or a yaw turns too fast at any."""
        return self.solved is None and isinstance(self.reason, LimitError)


NOTHING = Attempt()


class Strategy:
    """One search for a plan within limits; what changes is in what it watches.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    timing : Timing
        With limits.
    watched : WatchedSearch, optional
        Of the search of which this one is a part.

    Raises
    ------
    LimitError
        If the limits are too low for any leg.
    LateError
        If the time allowed is over.
    """

    def __init__(self, task: Task, timing: Timing, watched: WatchedSearch | None = None) -> None:
        task.deadline.check()
        if core().name != "native":
            raise NativeCoreError(f"plans within limits need the native core, and this is the {describe()}")
        self.task, self.limits, self.timing = task, timing.bounds, timing
        self.times = stop_and_go_times(guessed_lengths(task), self.limits)
        if not self.times.max() <= LONGEST_PIECE:
            raise LimitError(f"the limits are so low that a leg takes over {LONGEST_PIECE:g} s: raise them")
        self.watched = watched or WatchedSearch(task, timing)
        self.deadline = self.watched.deadline
        self.walled = any(wall.order for wall in task.walls)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C, time or work ended the search."""
        return self.watched.ended is not None

    @property
    def found(self) -> Run:
        """What the search leaves."""
        return Run(tuple(self.watched.log.steps), self.interrupted)

    def run(self, first: Trajectory | None = None) -> PlanOutcome:
        """Return the shortest plan, certified, with the steps of its search, or why there is none.

        Parameters
        ----------
        first : Trajectory, optional
            To search from.
        """
        guess = None if first is None else guess_of(first, self.task)
        found = self._next(NOTHING, lambda nothing: self.solve(guess))
        if found.solved is None and self.limits.yaw_rate is not None and not self.interrupted:
            found = replace(found, reason=self._spins() or found.reason)
        if found.solved is None and self._drags_unknown:
            found = self._next(found, self._in_longer_durations)
        if not found.hopeless:
            found = found.then(if_possible(partial(self._spare, found)) or NOTHING)
        solved = found.solved
        slow = solved is None or solved.flown.duration > self.times.sum()
        # Where the search for the shortest time has no plan, ``allocate`` tries others before rest at every waypoint.
        rests = self.interrupted or (slow and (solved is not None or not self.timing.shortest))
        if rests and self.task.still and not found.hopeless:
            solved = shorter(solved, self.resting)
        if solved is not None:
            planned = timed(solved, self.found)
            return PlanOutcome(replace(planned, stands_in=found.stands_in or solved is not found.solved))
        lost = self.watched.ended if self.watched.lost else None
        return PlanOutcome(reason=lost or found.reason or self.find_reason(found.curve))

    def _next(self, found: Attempt, attempt: Callable[[Attempt], Attempt]) -> Attempt:
        """Return what is found with one more attempt; none is made once the search has ended."""
        later = NOTHING
        if not (self.interrupted or found.hopeless):
            try:
                with self.watched.interruptible():
                    later = attempt(found)
            except LateError as late:
                if found.solved is None and self.watched.spare is None:
                    raise
                self.watched.ended = late
        return found.then(later)

    def solve(self, guess: Guess | None) -> Attempt:
        """Search for the least time, from a curve or from where it is best begun."""
        question = self._question
        if guess is None and self._fewer_first:
            return self._divided(question)
        found = NOTHING
        for first in self._first_guesses() if guess is None else ():
            found = found.then(self._certified(begun_from(question, first)))
            if self.interrupted or found.hopeless:
                return found
        return found if found.solved is not None else found.then(self._certified(begun_from(question, guess)))

    def _divided(self, question: ShortestQuestion) -> Attempt:
        """Search with fewer pieces, then from that curve with more, and take the shorter flight of the two."""
        # A search of many pieces takes long within rotors, and is lost where time or work end it. A curve of few is one
        # of many too, cut anywhere, so that the search of many begins at a curve that flies.
        fewer = self._alike(QUESTION.divisions[0] if self.eases else 1)
        found = fewer.solve(None)
        if self.interrupted or found.hopeless:
            return found
        solved = found.solved
        slower = SETTINGS.divided_time_factors[self.eases]
        guess = None if solved is None else guess_of(solved.trajectory, fewer.task, slower)
        if solved is not None and guess is not None:  # several pieces are divided, then cut anew
            parts = (*question.parts[1:], 1) if self.eases else question.parts
            question = replace(question, guess=guess, parts=parts)
        return found.then(self._certified(question))

    @property
    def _fewer_first(self) -> bool:
        """Whether fewer pieces come first: within rotors more take long, and are lost where time or work end."""
        return self.timing.refine and isinstance(self.limits, VehicleLimits)

    @property
    def _yawed(self) -> bool:
        """Whether rotors are limited under a yaw, constant or not."""
        return isinstance(self.limits, VehicleLimits) and self._begun.yaw.medium is None

    @property
    def eases(self) -> bool:
        """Whether a search from rest begins with a body that is easy to turn."""
        return self._yawed and self.task.still

    def cheapest_in_durations(self, first: SolvedTask, durations: FloatArray) -> SolvedTask | None:
        """Search the curve of least cost in piece durations [s], from a curve in any; None where none is found."""
        task, curve = self.task, first.trajectory
        guess = guess_of(curve, replace(task, pieces=first.task.pieces))
        if guess is None or task.continuity > task.half - 1:
            return None
        question = begun_from(self._question, replace(guess, durations=durations))
        price = significant(worth_of_time(curve))
        held = replace(question, parts=(), price=price, timed=True, moving=True)
        return self._certified(held).solved

    def cheapest(
        self, first: SolvedTask, price: float = 0.0, total: float = 0.0, slower: float = 1.0
    ) -> SolvedTask | None:
        """Search the curve of least cost for a price of time [1/s], or with a total [s]; None where none is found.

        Parameters
        ----------
        first : SolvedTask
            A curve of any time, to begin from.
        price, total : float
            One of them.
        slower : float
            Factor on its time at which it is begun from.
        """
        guess = guess_of(first.trajectory, replace(self.task, pieces=first.trajectory.pieces), slower)
        question = replace(begun_from(self._question, guess), price=price, total=total, moving=True)
        with self.watched.interruptible():
            unheaded = self._unheaded(question, rough=False) if self.veers and price > 0.0 else None
            return self._certified(begun_from(question, unheaded)).solved
        return None

    def of_total(self, total: float) -> SolvedTask | None:
        """Search from rest for about the price of a total [s], then for the total; None where either has no plan."""
        worth = worth_of_time(self.rest.trajectory)
        for share in SETTINGS.prices:
            priced = None if self.interrupted else self.cheapest(self.rest, price=significant(share * worth))
            found = None if priced is None or self.interrupted else self.cheapest(priced, total=total)
            if found is not None:
                return found
        return None

    def on_from(self, first: Trajectory, certify: Callable[[SolvedTask], Value | None]) -> Value | None:
        """Search on from a plan whose first piece may be a way back into the limits, on which none is exceeded further.

        Parameters
        ----------
        first : Trajectory
        certify : callable
            Returns what is made of a curve inside the walls, or None where that does not keep the limits.
        """
        question = replace(self._question, guess=guess_of(first, self.task), parts=(), moving=True, planned=True)
        with self.watched.interruptible():
            for _ in range(SETTINGS.searches):
                curve = self._searched(question)
                if not isinstance(curve, ShortestCurve) or not curve.kept:
                    break
                solved = solved_at(self.task, curve)
                found = certify(solved) if solved.inside else None
                if found is not None or curve.stopped:
                    return found
                if not solved.inside:
                    question = further_inwards(question)
                question = replace(question, tightened=question.tightened + SETTINGS.tightened_again)
        return None

    @cached_property
    def rest(self) -> SolvedTask:
        """The curve with rest at every waypoint: in the total, or as slowly as the price of time and limits ask for."""
        straight, price, total = self._stop_and_go, self.timing.time_weight, self.timing.total_time
        if price is None:
            return straight if total is None else straight.slowed(significant(total / self.times.sum()))
        factor = priced_factor(straight.trajectory, price)
        return straight.slowed(max(factor, 1.0) if self.limits.given() else factor)

    @cached_property
    def _heading(self) -> Heading | None:
        """Heading of any curve of the task, where limits depend on it: of that along the straight legs."""
        if not isinstance(self.limits, VehicleLimits) and self.limits.yaw_rate is None:
            return None
        return self._begun.yaw

    @cached_property
    def _stop_and_go(self) -> SolvedTask:
        """The curve with rest at every waypoint, as quick as limits on derivatives allow."""
        return self._straight(self.times)

    @property
    def _begun(self) -> Trajectory:
        """The same with its heading."""
        return self._stop_and_go.flown

    @property
    def _drags_unknown(self) -> bool:
        """Whether drag turns with a body whose heading no search holds, so that its mean is searched with."""
        limits = self.limits
        return isinstance(limits, VehicleLimits) and not (self._yawed or lateral_alike(limits.vehicle))

    @property
    def veers(self) -> bool:
        """Whether limits depend on a yaw along the velocity."""
        return isinstance(self._heading, VelocityHeading)

    @cached_property
    def _question(self) -> ShortestQuestion:
        if self._heading is None:
            return question_of(self.task, self.limits, self.timing.refine)
        flown = max(self._begun, self.rest.flown, key=lambda curve: curve.duration)  # a yaw may be a function of time
        return question_of(self.task, self.limits, self.timing.refine, flown)

    def _first_guesses(self) -> Iterator[Guess]:
        """Yield curves to begin from where rest at every waypoint is a poor one.

        Where the rate along the velocity is limited, a rough curve and a whole one lead to other ways round.
        """
        if self.veers:
            roughly = (True,) if self.limits.yaw_rate is None else (True, False)
            yield from filter(None, (self._unheaded(self._question, rough) for rough in roughly))
            return
        softer = self._softer()
        if softer is not None:
            yield softer
        elif not self.task.still:
            coast = coasting(self.task, self.times)
            yield Guess(1, coast.durations, coast.trajectory.states(coast.trajectory.breaks, self.task.half))

    def _unheaded(self, question: ShortestQuestion, rough: bool) -> Guess | None:
        """Search with the least torque that any heading asks for: from rest the way to one along the velocity is hard.

        At every waypoint a heading along straight legs turns while it is held.  None where that has no end of its own.

        Parameters
        ----------
        question : ShortestQuestion
        rough : bool
            Whether a rough curve will do, with one piece a leg.
        """
        free = replace(self.limits, yaw_rate=None)
        roughly: dict[str, Any] = {"parts": (), "rough": True} if rough else {}
        return self._guess_by(with_rates(question, free, self._heading, turning=None, **roughly))

    def _softer(self) -> Guess | None:
        """Search with a higher rate of a view first: from rest the way around its point is hard to find."""
        rate = self.limits.yaw_rate
        if rate is None or not isinstance(self._heading, LookAtHeading) or self.eases:
            return None
        softer = replace(self.limits, yaw_rate=SETTINGS.rate_factor * rate)
        question = with_rates(self._question, softer, self._heading, parts=(), rough=True)
        return self._guess_by(question, SETTINGS.time_factor)

    def _guess_by(self, question: ShortestQuestion, slower: float = 1.0) -> Guess | None:
        """Return the curve of a search to begin another one from; None where it has no end of its own."""
        curve = self._searched(question)
        if not isinstance(curve, ShortestCurve) or not curve.kept or curve.stopped:
            return None
        return Guess(len(curve.durations) // self.task.legs, curve.durations, curve.knots, slower)

    def _certified(self, question: ShortestQuestion) -> Attempt:
        """Return a certified plan; none where the search has no curve, or none that can be certified nearby."""
        self.watched.log.forget()
        found, inside = NOTHING, None
        mends = self.task.still and not question.held
        # Each round repairs what the last one missed: a curve outside a wall moves the walls inwards, an excess between
        # the instants of the search tightens the limits, and what kept all ends the loop.
        with self.watched.interruptible():
            for _ in range(SETTINGS.searches):
                curve = self._searched(question)
                if not isinstance(curve, ShortestCurve):
                    return replace(found, reason=curve)
                if not question.costs:
                    self.watched.spared(curve.inside)
                found = found if inside else Attempt(curve=curve)
                if not curve.kept or not curve.durations.max() <= LONGEST_PIECE:
                    break
                solved = solved_at(self.task, curve)
                if not solved.inside:
                    question = further_inwards(question)
                    continue
                inside = solved
                found = replace(found, curve=curve)
                ended = or_reason(partial(self._within, solved, curve, question))
                if not isinstance(ended, tuple):
                    return replace(found, reason=ended)
                kept, excess = ended
                seen = excess <= SETTINGS.seen_excess
                slower = self._barely_slower(solved, excess) if mends and seen and kept is None else None
                found = found.then(Attempt(kept or slower, stands_in=curve.restored))
                enough = found.solved is not None and (slower is None or excess < SETTINGS.worth_repeating)
                if enough or curve.stopped or not seen:
                    break
                if self.veers:
                    question = replace(question, guess=guess_of(solved.trajectory, solved.task), parts=())
                question = replace(question, tightened=question.tightened + SETTINGS.tightening * excess)
        if found.solved is None and inside and mends and not self.interrupted:
            return found.then(Attempt(self._slowed(inside), stands_in=True))
        return found

    def _barely_slower(self, solved: SolvedTask, excess: float) -> SolvedTask | None:
        """Fly a curve more slowly by parts of its excess until it keeps all limits; None where that does not help."""
        slower = (solved.slowed(1.0 + part * excess) for part in SETTINGS.parts_of_excess)
        return next((one for one in slower if keeps(self.limits, one.flown)), None)

    def _spare(self, found: Attempt) -> Attempt:
        """Certify the shortest curve that any search came by on its way, if it is shorter than what is found."""
        curve, best = self.watched.spare, found.solved
        if curve is None:
            return NOTHING
        if best is not None and best.flown.duration <= (1.0 + SETTINGS.slower_share) * curve.durations.sum():
            return NOTHING
        solved = solved_at(self.task, curve)
        if not solved.inside:
            return NOTHING
        if self.task.still:
            kept = self._slowed(solved, 1.0)
        else:
            kept = solved if keeps(self.limits, solved.flown) else None
        if kept is None:
            return NOTHING
        if not self.timing.refine and kept.task.pieces != self.task.pieces:
            kept = self.cut(kept) or kept
        return Attempt(kept, stands_in=best is None or found.stands_in)

    def _in_longer_durations(self, found: Attempt) -> Attempt:
        """Search the least cost in durations barely longer than those of a search with the mean of uneven drag."""
        curve = found.curve
        if curve is None or self.interrupted:
            return NOTHING
        slower = map(solved_at(self.task, curve).slowed, SETTINGS.longer_factors)
        plans = (self.cheapest_in_durations(one, one.durations) for one in slower)
        solved = next((one for one in plans if one is not None or self.interrupted), None)
        far = solved is not None and solved.flown.duration > SETTINGS.slow_by_turns * curve.durations.sum()
        return Attempt(solved, stands_in=far)

    def _within(
        self, solved: SolvedTask, answer: ShortestCurve, question: ShortestQuestion
    ) -> tuple[SolvedTask | None, float]:
        """Fly the same path at the speed at which the most used limit is just kept, if that is about its own.

        Returns
        -------
        solved : SolvedTask or None
        excess : float
            Of the most used limit, relative.
        """
        # Slowing a path scales its p-th derivative by a power of the factor, so one factor brings the most used limit
        # to 1. From a start in motion it would change the start: there the curve is kept as it is, or given up.
        limits, curve, at = self.limits, solved.flown, cache(solved.slowed)
        if question.moving:
            self.deadline.spend(measuring_work(limits, len(curve.durations)))
            use = largest_use(limits, curve, proved=False)
            if use <= 1.0 + KEPT:
                quick = () if question.costs else self._hastened(at, limits)
                kept = next((one for one in chain(quick, [solved]) if keeps(limits, one.flown)), None)
                if kept is not None:
                    return kept, 0.0
                use = largest_use(limits, curve)
            return None, use - 1.0
        factor = powers_factor(limits, curve) or nearby_factor(
            limits, lambda factor: at(factor).flown, deadline=self.deadline
        )
        factor = grained(factor or touching_factor(limits, curve, deadline=self.deadline))
        turns = limits.yaw_rate is not None and question.limits
        inside = answer.slack > SETTINGS.large_slack + question.tightened
        least = SETTINGS.unlimited_below_slack if inside else SETTINGS.unlimited_below
        if question.costs or self.walled:
            factor = max(factor, 1.0)
        elif factor < least and not (answer.stopped or turns or limited(solved.task, limits)):
            raise nothing_limits(list(limits.given()))
        near = factor <= 1.0 + SETTINGS.slower_share or answer.stopped
        return at(factor) if near else None, factor - 1.0

    def _hastened(self, at: Callable[[float], SolvedTask], limits: Limits) -> Iterator[SolvedTask]:
        """Touch limits of rotors that the last barrier has kept away from; of others that costs more than it gains.

        Samples do, but where bounds prove more between them.
        """
        if self.task.still and not self.walled and isinstance(limits, VehicleLimits):
            for proved, met in ((False, STRETCH.nearly_met), (True, STRETCH.met)):
                factor = nearby_factor(limits, lambda factor: at(factor).flown, proved, met, self.deadline)
                yield at(min(factor or 1.0, 1.0))

    def _slowed(self, solved: SolvedTask, guess: float | None = None) -> SolvedTask | None:
        """Fly the same path at the speed at which the most used limit is just kept, if all are kept then."""
        factor = if_possible(partial(touching_factor, self.limits, solved.flown, guess, deadline=self.deadline))
        if factor is None:
            return None
        slower = solved.slowed(grained(max(factor, 1.0) if self.walled else factor))
        return slower if keeps(self.limits, slower.flown) else None

    def _searched(self, question: ShortestQuestion) -> ShortestCurve | UnlimitedError | None:
        work = WORK.iteration
        if isinstance(self.limits, VehicleLimits):
            held = WORK.yawed if self._begun.yaw.constant is not None else WORK.turning
            work = WORK.rotors if question.turning is None else held
        return self.watched.curve(question, self.task, work)

    def _straight(self, durations: FloatArray) -> SolvedTask:
        """Return the curve that rests at every waypoint."""
        task = self.task
        ends = [np.repeat(points[:, None], task.half, axis=1) for points in (task.waypoints[:-1], task.waypoints[1:])]
        points = np.concatenate(ends, axis=1)
        return solved_at(task, ShortestCurve(durations, points, 0, True, True))

    @cached_property
    def resting(self) -> SolvedTask | None:
        """The certified plan that rests at every waypoint, where a search ended before it had a better one."""
        return self._slowed(self._stop_and_go, 1.0) if self._stop_and_go.inside else None

    def _alike(self, pieces: int) -> Strategy:
        """Return the same search of a fixed number of pieces a leg; its steps and its end are those of this one."""
        return Strategy(replace(self.task, pieces=pieces), replace(self.timing, refine=False), self.watched)

    def cut(self, first: SolvedTask) -> SolvedTask | None:
        """Divide the pieces of a plan into the wanted number, the longest of each leg once more than others.

        More samples of it may find it barely too fast.
        """
        own = first.durations.reshape(self.task.legs, -1)
        every, rest = divmod(self.task.pieces, own.shape[1])
        if first.optimum.points is None or not every:
            return None
        counts = np.full(own.shape, every)
        np.put_along_axis(counts, (-own).argsort(axis=1, kind="stable")[:, :rest], every + 1, axis=1)
        durations, points = divided_pieces(first.durations, first.optimum.points, counts.reshape(-1))
        divided = solved_at(self.task, ShortestCurve(durations, points, first.optimum.rounds, True, True))
        slower = (divided.slowed(1.0 + share) for share in SETTINGS.slower_parts)
        return next((each for each in slower if each.inside and keeps(self.limits, each.flown)), None)

    def find_reason(self, curve: ShortestCurve | None) -> MinsnapError:
        """Search within looser limits for why there is no plan: the corridor alone, or which limit is exceeded."""
        if not self.task.explains:
            return SolverError("no plan that keeps the walls and the limits was found from this start")
        used = self._exceeded()
        if used is not None:
            return exceeded_by_a_search(used, bool(self.task.walls), SETTINGS.limit_factor)
        durations = curve.durations if curve is not None and curve.kept else self.times
        if not (durations <= LONGEST).all():
            return SolverError(f"no plan that keeps the limits was found within {LONGEST:g} s a leg: loosen a limit")
        task = replace(self.task, pieces=len(durations) // self.task.legs, deadline=self.deadline)
        reason = explain(task, durations)
        if not isinstance(reason, SolverError):
            return reason
        if curve is None:
            return SolverError("no plan that keeps the limits was found: give more time, or loosen a limit")
        return SolverError(f"the plan of {durations.sum():.6g} s found could not be certified: loosen a limit")

    def _spins(self) -> LimitError | None:
        """Return the error that says that a yaw turns too fast however slow the plan, where it does."""

        def turns(times: FloatArray) -> Utilisation:
            return next(one for one in self.limits.utilisation(self._straight(times).flown) if one.name == "yaw_rate")

        used = turns(self.times)
        longer = self.times * used.fraction
        slower = turns(longer) if used.fraction > 1.0 + KEPT and longer.max() <= LONGEST else used
        return yaw_too_fast(slower) if slower.fraction > 1.0 + KEPT else None

    def _exceeded(self) -> Utilisation | None:
        """Return the limit that a curve within looser ones exceeds most; None without such a curve."""
        names = [name for name in self.limits.given() if KIND[name].order or name in ("max_thrust", "body_rate")]
        looser = replace(self.limits, **{name: SETTINGS.limit_factor * getattr(self.limits, name) for name in names})
        curve = self._searched(question_of(self.task, looser, False, None if self._heading is None else self._begun))
        if not isinstance(curve, ShortestCurve) or not curve.kept or self.interrupted:
            return None
        used = most_used(self.limits, solved_at(self.task, curve).flown)
        return used if used.fraction > 1.0 + KEPT else None


def shorter(*plans: SolvedTask | None) -> SolvedTask | None:
    """Return the plan of the shortest flight, the first of equal ones; None without any."""
    return min((one for one in plans if one is not None), key=lambda one: one.flown.duration, default=None)


def further_inwards(question: ShortestQuestion) -> ShortestQuestion:
    """Return a question with its walls moved further inwards, where a curve of it was outside of one."""
    return replace(question, inwards=SETTINGS.inward_factor * max(question.inwards, QUESTION.inward))


def limited(task: Task, limits: Limits) -> bool:
    """Whether a derivative has a limit, which bounds the time where the one below it is continuous and the task moves.

    All are within a single polynomial.  The task moves where no place is in the boxes of all waypoints.
    """
    apart = (task.waypoints + task.lower).max(axis=0) > (task.waypoints + task.upper).min(axis=0)
    orders = [KIND[name].order for name in ("speed", "acceleration", "jerk", "snap") if name in limits.given()]
    smooth = min(task.continuity + 1 if task.legs * task.pieces > 1 else np.inf, 2 * task.half - 1)
    return bool(apart.any()) and min(orders, default=np.inf) <= smooth


def solved_at(task: Task, answer: ShortestCurve) -> SolvedTask:
    """Wrap the curve of a search as a solved task."""
    pieces = len(answer.durations) // task.legs
    continuity = max(task.continuity, task.half - 1)
    if (pieces, continuity) != (task.pieces, task.continuity):
        task = replace(task, pieces=pieces, continuity=continuity)
    optimum = Optimum(NO_KNOTS, answer.iterations, "interior point", core=NATIVE, points=answer.points)
    return SolvedTask(task, answer.durations, task.units(answer.durations), optimum)
