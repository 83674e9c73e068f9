"""A question about durations ends in one value: kept, spent with the best so far, or refused with its reason."""

import ast
from pathlib import Path

import numpy as np
import pytest
from random_combinations import question
from tasks import REFERENCE, task_of

import minsnap
from minsnap import Limits
from minsnap.basics.deadline import LateError
from minsnap.durations import watched_search, ways
from minsnap.durations.outcome import End, PlanOutcome, if_possible, or_reason, outcome_of, quickest
from minsnap.durations.strategy import Strategy
from minsnap.durations.timing import Timing
from minsnap.errors import InfeasibleError, LimitError, SolverError, UnprovedError

ROOM = Path(ways.__file__).parent
LIMITS = Limits(speed=3.0, acceleration=6.0)


def raised(error):
    def attempt():
        raise error

    return attempt


def test_every_end_is_a_value_and_its_reason_is_raised_where_a_call_ends():
    late, short, wrong = LateError("late"), UnprovedError("short"), LimitError("wrong")
    for error, end, refused in ((late, End.SPENT, None), (short, End.REFUSED, short), (wrong, End.REFUSED, None)):
        outcome = outcome_of(raised(error))
        assert (outcome.end, outcome.refused, outcome.reason) == (end, refused, error)
        with pytest.raises(type(error)) as told:
            outcome.plan()
        assert told.value is error
    with pytest.raises(KeyboardInterrupt):
        outcome_of(raised(KeyboardInterrupt()))


def test_what_is_only_tried_has_no_end_of_its_own_but_that_of_time():
    assert if_possible(raised(InfeasibleError("no"))) is None
    assert isinstance(or_reason(raised(SolverError("no"))), SolverError)
    with pytest.raises(LateError):
        or_reason(raised(LateError("late")))
    assert quickest((None, PlanOutcome(reason=SolverError("no")))) is None


def test_a_search_ends_kept_or_spent_with_the_best_so_far():
    task = task_of(REFERENCE)
    assert Strategy(task, Timing(limits=LIMITS)).run().end is End.KEPT

    def stop(step):
        raise KeyboardInterrupt

    spent = Strategy(task, Timing(limits=LIMITS, progress=stop, on_interrupt="return")).run()
    assert spent.end is End.SPENT and spent.plan().interrupted
    assert minsnap.certify(spent.plan().trajectory, limits=LIMITS).ok


def test_no_number_of_pieces_is_searched_twice(monkeypatch):
    """One piece was searched for both of the numbers that divide six."""
    searched, run = [], Strategy.run
    monkeypatch.setattr(Strategy, "run", lambda self, first=None: searched.append(self.task.pieces) or run(self, first))
    plan = minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 1)], limits=LIMITS, pieces=6)
    assert sorted(searched) == [1, 2, 3, 4, 5, 6]
    told = [step.evaluation for step in plan.report.steps]
    assert told.count(1) == 6


@pytest.mark.slow
@pytest.mark.parametrize("seed", [910000413, 2000, 2037])
def test_more_pieces_are_no_longer_than_fewer(seed):
    """Only divisors were compared: three pieces of the first took 1.98 s, and two 1.80."""
    asked = question(seed)[0]
    times = [minsnap.plan(**asked | {"pieces": pieces}).duration for pieces in (1, 2, 3, 4)]
    assert (np.array(times[1:]) <= np.minimum.accumulate(times)[:-1] * (1.0 + 1e-4)).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_within_the_rate_of_a_yaw_pieces_left_to_the_plan_are_no_longer_than_three(seed):
    """It flew 8.52 and 9.24 s, where three pieces took 5.21 and 8.52."""
    points = np.cumsum(np.random.default_rng(seed).normal(size=(6, 3)) * [3, 3, 1], axis=0)
    asked = {"limits": Limits(speed=4.0, acceleration=8.0, yaw_rate=1.0), "yaw": "velocity"}
    auto, three = (minsnap.plan(points, pieces=pieces, **asked) for pieces in ("auto", 3))
    assert auto.duration <= three.duration * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("pieces", [3, "auto"])
def test_many_pieces_take_no_longer_than_one_under_a_yaw_that_turns(pieces):
    """Where work ended their search they flew 8.95 and 7.38 s, and one piece a leg 5.04."""
    asked = question(2058)[0]
    one, many = (minsnap.plan(**asked | {"pieces": number}) for number in (1, pieces))
    assert many.duration <= one.duration * (1.0 + 1e-4)


def handlers(path):
    """Return the functions of a module that catch what is no interrupt."""
    tree = ast.parse(path.read_text())
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        for node in ast.walk(function):
            name = getattr(getattr(node, "type", None), "id", "") if isinstance(node, ast.ExceptHandler) else None
            called = getattr(node.func, "id", "") if isinstance(node, ast.Call) else None
            if (name is not None and name != "KeyboardInterrupt") or called == "suppress":
                yield path.stem, function.name


def test_errors_become_values_in_a_few_places_alone():
    """They steered this room: 30 handlers stood around searches."""
    found = {place for path in ROOM.glob("*.py") for place in handlers(path)}
    assert found == {
        ("outcome", "outcome_of"),
        ("outcome", "if_possible"),
        ("outcome", "or_reason"),
        ("timing", "attempted"),
        ("strategy", "_next"),
        ("least_cost", "run"),  # whose evaluations the end of time leaves
    }


def test_no_search_is_made_twice(monkeypatch):
    """Each number of pieces begins from fewer, which were searched anew; all of that was counted as work."""
    asked, search = [], watched_search.search_shortest
    monkeypatch.setattr(watched_search, "search_shortest", lambda *given: asked.append(given[0]) or search(*given))
    minsnap.plan(**question(910000413)[0] | {"pieces": 3})
    assert len(asked) > 2
    assert not any(one.same(other) for k, one in enumerate(asked) for other in asked[:k])


@pytest.mark.parametrize(
    ("seed", "pieces", "most"), [(900000862, 1, 3.4), (910000413, "auto", 1.9), (910000413, 1, 2.7)]
)
def test_what_stands_in_for_the_end_of_a_search_is_compared_with_others(seed, pieces, most):
    """It was taken, however long: 5.02 s within a limit on snap, and 4.61 s of a lap within rotors."""
    asked = question(seed)[0] | {"pieces": pieces}
    path = minsnap.plan(**asked)
    assert path.duration <= most
    assert minsnap.certify(path, asked["waypoints"], asked.get("corridor"), limits=asked["limits"]).ok
