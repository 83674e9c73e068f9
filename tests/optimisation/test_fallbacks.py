"""The ladder: what leads to each rung, what it gives, and that plans without it would be worse or missing."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
import qpsolvers
from programmes import change_daqp
from tasks import REFERENCE, many_legs

import minsnap
from minsnap.basics.tolerances import EXACT
from minsnap.errors import CorridorError, SolverError, TimingError
from minsnap.files.plan_arguments import plan_arguments
from minsnap.optimisation import fallbacks, master_qp, preconditioning
from minsnap.optimisation.exchange import Trouble
from minsnap.optimisation.solved_task import SolvedTask

TIMES = [4.0, 2.0, 4.0, 2.0]


def plan(width=0.3, **options):
    """Plan the rectangle by the Python core, which a named solver asks for."""
    return minsnap.plan(REFERENCE, TIMES, corridor=width, solver="daqp", **plan_arguments(options))


def inside(traj, width=0.3):
    return minsnap.certify(traj, REFERENCE, width).corridor_margin >= 0.0


def refusing(monkeypatch, *names):
    """Let DAQP, or solvers of qpsolvers, refuse every programme."""
    original = qpsolvers.solve_problem
    if "daqp" in names:
        change_daqp(monkeypatch, lambda x: None)

    def solve(problem, solver, **options):
        if solver in names:
            raise qpsolvers.SolverError("refused")
        return original(problem, solver, **options)

    monkeypatch.setattr(qpsolvers, "solve_problem", solve)


def unsolved(monkeypatch, while_):
    """Let no solver solve the master QP as long as a condition on the number of solves so far holds."""
    original, count = master_qp.solve_qp, [0]

    def solve(*asked, **options):
        count[0] += 1
        return None if while_(count[0]) else original(*asked, **options)

    monkeypatch.setattr(master_qp, "solve_qp", solve)


def without(monkeypatch, name):
    """Take one rung out of the ladder."""
    kept = tuple(rung for rung in fallbacks.LADDER if rung.name != name)
    assert len(kept) == len(fallbacks.LADDER) - 1
    monkeypatch.setattr(fallbacks, "LADDER", kept)


def test_an_ordinary_plan_takes_no_rung():
    assert plan().report.rungs == () and plan().report.fallback == ()


def test_the_next_solver_answers_where_one_refuses(monkeypatch):
    refusing(monkeypatch, "daqp")
    traj = plan()
    assert traj.report.rungs == ("next solver",)
    assert (traj.report.solver, traj.report.fallback) == ("nnls", ("daqp",))
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-6)


def faulty(monkeypatch, error):
    """Let daqp's answers be wrong by so much, which its check lets pass."""
    change_daqp(monkeypatch, lambda x: x + error * np.sin(1.0 + np.arange(len(x))))


def test_answers_that_break_their_rows_lead_to_non_negative_least_squares(monkeypatch):
    best = plan(1e-4).cost()
    faulty(monkeypatch, 3e-8)
    traj = plan(1e-4)
    assert "non-negative least squares" in traj.report.rungs and traj.report.fallback == ()
    assert inside(traj, 1e-4)
    assert traj.cost() == pytest.approx(best, rel=3e-6)
    without(monkeypatch, "non-negative least squares")
    assert plan(1e-4).cost() > best * (1.0 + 3e-6)


def test_what_sparse_solvers_leave_is_solved_in_dense_coordinates(monkeypatch):
    points, durations, widths = many_legs(60)
    asked = {"corridor": widths, "solver": "piqp", "continuity": 3}
    best = minsnap.plan(points, durations, **asked).cost()
    refusing(monkeypatch, "piqp", "clarabel")
    traj = minsnap.plan(points, durations, **asked)
    assert traj.report.rungs == ("dense coordinates",)
    assert traj.cost() == pytest.approx(best, rel=3e-6)
    without(monkeypatch, "dense coordinates")
    assert minsnap.plan(points, durations, **asked).cost() > best * (1.0 + 1e-3)


def test_more_digits_are_tried_where_no_solver_answers(monkeypatch):
    original, asked = preconditioning.decimal_whitening, []
    monkeypatch.setattr(preconditioning, "decimal_whitening", lambda *given: asked.append(given) or original(*given))
    unsolved(monkeypatch, lambda _: not asked)
    traj = plan()
    assert traj.report.rungs == ("more digits",)
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-6)
    asked.clear()
    without(monkeypatch, "more digits")
    assert plan().cost() > 2.0 * traj.cost()


FLOOR = {"corridor": minsnap.Room((-50.0, 0.0), (50.0, 2.0)), "solver": "daqp"}
SLIDING = [(0.0, 0.0), (2.0, 0.0), (5.0, 0.0)]


def slipping(monkeypatch):
    """Let every run of the exchange end with a curve that is below the floor by rounding alone."""
    original = fallbacks.exchange

    def exchange(*given):
        state, _ = original(*given)
        knots = state.curve.knots.copy()
        knots[1, 1, -1] -= 1e-16  # of the upward velocity
        return replace(state, curve=replace(state.curve, knots=knots)), Trouble.OUTSIDE

    monkeypatch.setattr(fallbacks, "exchange", exchange)


def test_rounding_is_removed_where_it_alone_leaves_the_curve_outside(monkeypatch):
    best = minsnap.plan(SLIDING, [2.0, 3.0], **FLOOR).cost()
    slipping(monkeypatch)
    traj = minsnap.plan(SLIDING, [2.0, 3.0], **FLOOR)
    assert traj.report.rungs == ("rounding removed",)
    assert traj.report.corridor_margin == 0.0
    assert traj.cost() == pytest.approx(best, rel=1e-12)
    without(monkeypatch, "rounding removed")
    with contextlib.suppress(CorridorError):  # a blend may be a last resort, and is dearer
        assert minsnap.plan(SLIDING, [2.0, 3.0], **FLOOR).cost() > best * (1.0 + 1e-3)


def doubted(monkeypatch, proofs):
    """Let so many proofs of a curve fail."""
    original, asked = SolvedTask.inside.fget, []

    def judged(solved):
        asked.append(solved)
        return len(asked) > proofs and original(solved)

    monkeypatch.setattr(SolvedTask, "inside", property(judged))


@pytest.mark.parametrize("times", (1, 2))
def test_walls_move_inwards_while_rounding_leaves_the_curve_outside(monkeypatch, times):
    doubted(monkeypatch, 2 * times)
    traj = plan()
    assert traj.report.rungs[-1] == "inward shift"
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-4)
    assert traj.report.corridor_margin >= EXACT * 0.3


def test_walls_move_inwards_by_the_least_excess_of_an_attempt_not_the_last(monkeypatch):
    """The answer of a solver that was tried last, and failed, may lie far outside."""
    original = fallbacks.exchange

    def exchange(master, state, *given):
        ended, trouble = original(master, state, *given)
        if state.inward == 0.0:
            return replace(ended, excess=0.1, least=1e-6), Trouble.STALLED
        shifts.append(state.inward)
        return ended, trouble

    shifts = []
    monkeypatch.setattr(fallbacks, "exchange", exchange)
    without(monkeypatch, "rounding removed")
    plan()
    assert shifts == [2e-6]


def test_a_curve_that_no_rung_proves_to_be_inside_is_not_returned(monkeypatch):
    monkeypatch.setattr(SolvedTask, "inside", property(lambda solved: False))
    with pytest.raises(SolverError, match="the solvers failed on a problem that has a solution"):
        plan()


def test_a_blend_with_the_curve_that_has_most_room_saves_plans_from_a_moving_start(monkeypatch):
    moving = {"start": {"velocity": (1.0, 0.0, 0.0)}}
    best = plan(**moving).cost()
    doubted(monkeypatch, 2)
    traj = plan(**moving)
    assert traj.report.rungs == ("rounding removed", "inward shift")
    assert inside(traj) and traj.cost() == pytest.approx(best, rel=1e-4)
    without(monkeypatch, "inward shift")
    doubted(monkeypatch, 2)
    traj = plan(**moving)
    assert traj.report.rungs == ("rounding removed", "blend")
    assert inside(traj)


def test_a_waypoint_on_a_wall_is_named_where_no_rung_is_left(monkeypatch):
    doubted(monkeypatch, np.inf)
    with pytest.raises(CorridorError, match="waypoint 1 or 2 lies on a wall of leg 1, and the curve has no") as caught:
        minsnap.plan([(0.0, 1.0), (2.0, 1.0), (5.0, 0.0)], [2.0, 3.0], **FLOOR)
    assert caught.value.leg == 1


def test_a_blend_keeps_what_was_found_before_the_solvers_failed(monkeypatch):
    whole, best = minsnap.plan(REFERENCE, TIMES, corridor=1e-9).cost(), plan().cost()
    unsolved(monkeypatch, lambda count: count > 3)
    traj = plan()
    assert traj.report.rungs == ("more digits", "blend")
    assert inside(traj)
    assert best < traj.cost() < 0.5 * whole
    without(monkeypatch, "blend")
    with pytest.raises(SolverError):
        plan()


def test_stop_and_go_is_the_last_resort(monkeypatch):
    unsolved(monkeypatch, lambda _: True)
    traj = plan()
    assert traj.report.rungs[-1] == "blend" and inside(traj)


def test_a_solver_that_was_asked_for_is_the_first_of_all():
    assert fallbacks.solvers_for("osqp", dense=True) == ("osqp", "daqp", "nnls", "piqp", "clarabel")
    assert fallbacks.solvers_for("clarabel", dense=False) == ("clarabel", "piqp")


def test_the_time_limit_ends_with_a_certified_plan_or_a_sentence():
    late = plan(0.05, search=minsnap.Search(time_limit=1e-9))
    assert late.report.rungs[-1] == "blend" and inside(late, 0.05)
    assert late.cost() > plan(0.05, search=minsnap.Search(time_limit=60.0)).cost() * (1.0 + 1e-3)
    limits = minsnap.Limits(speed=3.2)
    with pytest.raises(SolverError, match="time_limit has passed without a certified plan"):
        plan(0.3, limits=limits, search=minsnap.Search(time_limit=1e-9))


def test_a_time_limit_goes_with_durations():
    with pytest.raises(TimingError, match="time_limit goes with durations or limits"):
        minsnap.plan(REFERENCE, total_time=12.0, search=minsnap.Search(time_limit=1.0))
    with pytest.raises(TimingError, match="time_limit is 0"):
        plan(search=minsnap.Search(time_limit=0))


@pytest.mark.parametrize("lower", [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_a_room_whose_walls_lie_along_the_legs_is_no_obstacle(lower):
    """Velocities at the corners are zero there, and what rounding leaves of them must not refuse the plan."""
    room = minsnap.Room(lower, (8.0, 4.0, 2.0))
    traj = minsnap.plan(REFERENCE, TIMES, solver="daqp", corridor=room)
    assert minsnap.certify(traj, REFERENCE, room).corridor_margin >= 0.0
    assert traj.cost() == pytest.approx(3340.14, rel=1e-5)


def test_durations_of_four_decades_end_with_a_certified_plan_where_no_coordinates_are_regular():
    """Degree 11, two pieces a leg: the Hessian of the whole is singular in double precision."""
    draw = np.random.default_rng(44)
    points = np.concatenate((np.zeros((1, 2)), np.cumsum(draw.normal(size=(8, 2)), axis=0)))
    durations = 2.0 * np.array([0.01, 100.0, 1.0, 30.0, 0.03, 0.1, 10.0, 0.3])
    traj = minsnap.plan(points, durations, corridor=5e-4, degree=11, pieces=2)
    assert minsnap.certify(traj, points, 5e-4).ok
    assert traj.report.core == "native" or traj.report.rungs[-1] in ("one polynomial per leg", "blend")
