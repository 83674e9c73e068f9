"""A few questions of every kind of ``benchmarks/soak.py``, and its judgement of wrong answers."""

import contextlib

import numpy as np
import pytest
import soak  # noqa: E402
from random_plans import KINDS, question  # noqa: E402

import minsnap
from minsnap.errors import InfeasibleError
from minsnap.native.library import core


@pytest.mark.parametrize("kind", KINDS)
def test_questions_are_solved_or_refused_rightly(kind):
    outcomes = {seed: soak.ask(kind, seed)[1] for seed in range(3)}
    assert set(outcomes.values()) <= set(soak.RIGHT), outcomes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("tolerances", 1635),  # no solver found by how much the walls must give way
        ("tolerances", 15669),  # the solvers failed on a problem that has a solution
        ("tolerances", 7621),  # less than the width named did
        ("further tubes", 1274),  # half-widths that differ by axis
        ("further tubes", 5046),
        ("round tubes", 2815),
        ("boxes", 6962),
        ("boxes", 10673),  # continuity above k - 1 was short
        ("boxes", 53645),  # proved by non-negative least squares alone
        ("rooms", 52791),
        ("boxes", 22186),
        ("closed", 1165),
        ("limits", 242),  # a limit on snap, which is zero at degree 3
        ("rooms", 8247),  # pins and continuity contradict each other, which had no proof
        ("gates", 5679),  # what holds at the waypoints alone contradicts itself
        ("tolerances", 21353),
        ("round tubes", 10521),  # a refusal without a proof
        ("further tubes", 30126),  # the width named did not do
        ("further tubes", 30176),  # neither planned nor refused
        ("all", 494118),  # slacks needed more work for a proof
        ("all", 448972),
    ],
)
def test_questions_that_were_refused_wrongly_are_not(kind, seed):
    assert soak.ask(kind, seed)[1] in soak.RIGHT


@pytest.mark.skipif(core().library is None, reason="there is no native core")
@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("tubes", 293437),  # 18 s and a blend six times as dear before
        ("tubes", 504768),  # rounding held the excess above what the gap allows, for a thousand rounds: 10 s
        ("half-spaces", 409480),  # 4e10 times as dear as stops at all waypoints
        ("half-spaces", 412317),
        ("rooms", 301512),
    ],
)
def test_what_the_native_core_solves_after_more_work_is_left_to_it(kind, seed):
    assert soak.ask("all", seed)[:2] == (kind, soak.SOLVED)


def test_pins_that_leave_too_little_free_for_a_continuity_are_refused():
    asked = question("half-spaces", 21722)[1]
    with pytest.raises(InfeasibleError, match="pins and continuity ask for more than the polynomials have free") as at:
        minsnap.plan(**asked)
    assert at.value.verify()


def test_a_curve_outside_is_noticed():
    asked = question("tubes", 0)[1]
    free = minsnap.plan(asked["waypoints"], asked["durations"])
    assert soak._judged(asked, free)[0] == "outside"


@pytest.mark.slow
def test_the_relaxation_of_a_question_with_a_solution_needs_no_share():
    asked = question("boxes", 1)[1]
    minsnap.plan(**asked)
    assert soak._relaxed(asked) <= soak.SLACK


def test_a_wrong_refusal_and_a_wrong_width_are_noticed():
    asked = {"waypoints": np.array([(0.0, 0, 0), (5, 0, 0)]), "durations": np.array([2.0]), "corridor": 0.1}
    narrow = asked | {"start": {"velocity": np.array([0.0, 3.0, 0.0])}}
    with pytest.raises(minsnap.InfeasibleError) as refused:
        minsnap.plan(**narrow)
    error = refused.value
    assert soak._refusal(narrow, error, True) == soak.PROVED
    for factor, said in ((0.9, "does not do"), (1.1, "less than the width named does")):
        wrong = minsnap.InfeasibleError(
            str(error), leg=0, smallest_width=factor * error.smallest_width, contradiction=error.contradiction
        )
        assert said in soak._refusal(narrow, wrong, False)
    assert soak._refusal(asked, error, False) == "refused, and the relaxation has a solution"


@pytest.mark.slow
def test_free_waypoints_with_jumps_do_not_reach_a_solver_that_needs_another_hessian():
    points = np.array([(0.0, 0, 0), (3, 1, 0), (3, 4, 1), (6, 4, 0), (8, 1, 1), (9, 5, 0), (12, 5, 1), (12, 9, 0)])
    durations = [1.42924978, 11.25788208, 0.43767491, 0.10455524, 36.43798207, 4.40785587, 0.2767211]
    with contextlib.suppress(minsnap.MinsnapError):
        minsnap.plan(points, durations, corridor=0.37, continuity=5, waypoint_tolerance=np.full(8, 0.1))
