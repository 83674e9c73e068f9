"""Windows: solving near fresh rows alone comes to the same plan, and what it may lose is bounded."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import many_legs, task_of

import minsnap
from minsnap.corridors.tubes import Tube
from minsnap.optimisation import local_resolve as windows
from minsnap.optimisation.exchange import Exchange
from minsnap.optimisation.local_resolve import REACH, loss, pieces_around
from minsnap.optimisation.normalised_constraints import compile_walls
from minsnap.optimisation.unconstrained import unbounded_optimum


def exchange_of(count, seed=0):
    points, durations, widths = many_legs(count, seed)
    task = task_of(points, Tube(widths))
    units = task.units(durations)
    problem = task.problem(durations, units)
    return Exchange(problem, unbounded_optimum(problem), compile_walls(task, problem, units), "auto")


def lap(count, seed):
    points, durations, widths = many_legs(count - 1, seed)
    return np.concatenate((points, points[:1])), np.append(durations, 3.0), np.append(widths, 0.2)


@pytest.mark.parametrize("closed", (False, True))
def test_the_plan_is_that_of_solving_for_everything(monkeypatch, closed):
    points, durations, widths = lap(150, 3) if closed else many_legs(150, 3)
    solved = []
    original = windows.solve_qp
    monkeypatch.setattr(windows, "solve_qp", lambda *asked: solved.append(len(asked[1])) or original(*asked))
    local = minsnap.plan(points, durations, corridor=widths, closed=closed)
    assert solved and max(solved) < 0.5 * 9 * 150
    monkeypatch.setattr(windows, "SHARE", -1.0)
    whole = minsnap.plan(points, durations, corridor=widths, closed=closed)
    assert local.cost() == pytest.approx(whole.cost(), rel=2e-6)
    t = np.linspace(0.0, local.duration, 3001)
    assert np.abs(local(t) - whole(t)).max() <= 1e-3 * widths.max()
    assert minsnap.certify(local, points, widths).ok


def test_windows_reach_to_both_sides_and_over_the_seam_of_a_lap():
    problem = exchange_of(40).relaxation.problem
    assert np.flatnonzero(pieces_around(problem, np.array([20]))).tolist() == list(range(20 - REACH, 21 + REACH))
    assert np.flatnonzero(pieces_around(problem, np.array([1]))).tolist() == list(range(2 + REACH))
    around = np.flatnonzero(pieces_around(replace(problem, closed=True), np.array([1])))
    assert around.tolist() == sorted((1 + step) % 40 for step in range(-REACH, REACH + 1))
    assert pieces_around(exchange_of(2 * REACH).relaxation.problem, np.array([0])).all()


def test_the_loss_of_an_optimum_is_nothing_and_that_of_another_plan_no_less_than_it_costs():
    exchange = exchange_of(60)
    exchange.run()
    state = exchange.relaxation
    part, rows = state.components[0], state.rows
    chosen = np.arange(len(rows))
    best, forces = state.cost, state.multipliers
    for shrink in (0.0, 1e-3, 1e-2):
        unknowns, multipliers = part.solve(rows, chosen, shrink)
        dearer = state.base_cost + part.gain - best
        assert loss(part, rows, chosen, shrink, multipliers) <= 1e-7 * best
        if shrink:
            assert dearer <= loss(part, rows, chosen, state.shrink, forces) <= 10.0 * dearer


def test_a_plan_that_windows_leave_too_dear_is_solved_as_a_whole(monkeypatch):
    points, durations, widths = many_legs(150, 3)
    asked = []
    monkeypatch.setattr("minsnap.optimisation.master_qp.loss", lambda *given: asked.append(given) or np.inf)
    traj = minsnap.plan(points, durations, corridor=widths)
    monkeypatch.setattr(windows, "SHARE", -1.0)
    whole = minsnap.plan(points, durations, corridor=widths)
    assert asked
    assert traj.cost() == pytest.approx(whole.cost(), rel=1e-7)


def test_a_course_that_may_move_as_a_whole_is_solved_as_a_whole():
    points, durations, _ = many_legs(60)
    free = np.full(len(points), 0.05)
    local = minsnap.plan(points, durations, corridor=0.1, waypoint_tolerance=free)
    pinned = minsnap.plan(points, durations, corridor=0.1)
    assert local.cost() < pinned.cost()
    assert np.abs(local(local.leg_breaks) - points).max() <= 0.05 + 1e-9
