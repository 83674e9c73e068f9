"""Walls that give way at a price: the least relaxation, against what can be flown, and what its multipliers say."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import random_legs, task_of

import minsnap
from minsnap.corridors.margins import nearest_wall
from minsnap.corridors.tubes import Tube
from minsnap.errors import SolverError
from minsnap.limits.limits import Limits
from minsnap.optimisation import elastic
from minsnap.optimisation.elastic import Elastic, Relaxation
from minsnap.optimisation.normalised_constraints import compile_walls
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.solve import solve
from minsnap.time_allocation.refusal import give_limits
from minsnap.trajectory.trajectory import Trajectory


def relaxed(task, durations, **options):
    units = task.units(durations)
    problem = task.problem(durations, units)
    compiled = compile_walls(task, problem, units)
    give = options.pop("give", None) or give_limits(compiled)
    return Elastic(problem, compiled, give, **options).run()


def can_be_flown(task, durations):
    try:
        solve(task, durations)
    except InfeasibleRowsError:
        return False
    return True


def is_the_least(number, solvable, rel):
    """Whether a task is solvable with this number, but not with one that is a little less."""
    return solvable((1.0 + rel) * number) and not solvable((1.0 - rel) * number)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_one_slack_for_all_widths_is_the_least_that_does(seed):
    """C4 at degree 7 leaves a narrow corridor without a solution; every width may give way alike."""
    points, durations = random_legs(seed, 4)
    task = task_of(points, Tube(1e-3), continuity=5)
    walls = sum(len(wall.leg) for wall in task.walls)
    found = relaxed(task, durations, give=Relaxation(np.zeros(walls, int), np.ones(walls), 1), accuracy=1e-6)

    def fits(width):
        return can_be_flown(task_of(points, Tube(width), continuity=5), durations)

    assert is_the_least(1e-3 * (1.0 + found.slacks[0]), fits, 2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "order"), [("speed", 1), ("acceleration", 2), ("jerk", 3)])
@pytest.mark.parametrize("seed", range(2))
def test_relaxation_of_one_limit_is_the_least_that_can_be_kept(seed, name, order):
    """A limit of order n moves by n times the slack, as it does where time is stretched a little."""
    points, durations = random_legs(seed, 3)
    found = relaxed(task_of(points, Tube(0.3), Limits(**{name: 0.5})), durations)
    assert found.slacks[0] > 0.0

    def keeps(limit):
        return can_be_flown(task_of(points, Tube(0.3), Limits(**{name: limit})), durations)

    assert is_the_least(0.5 * (1.0 + order * found.slacks[0]), keeps, 5e-3)


def test_walls_that_stand_do_not_give():
    points, durations = random_legs(1, 3)
    task = task_of(points, Tube(0.05), Limits(speed=0.5))
    found, units = relaxed(task, durations), task.units(durations)
    curve = task.problem(durations, units).control_points(found.knots, task.positions, units.length)
    assert nearest_wall(Trajectory(curve, durations), Tube(0.05).walls(points)).value >= -1e-3 * 0.05
    assert nearest_wall(Trajectory(curve, durations), Limits(speed=0.5).walls(points)).value < 0.0


def test_nothing_to_relax_gives_the_lowest_slack():
    """Far slower than the limit: the walls may be drawn in as far as allowed."""
    points, durations = random_legs(2, 3)
    found = relaxed(task_of(points, limits=Limits(speed=1e3)), durations)
    assert found.slacks[0] == pytest.approx(-0.5, abs=1e-3)


def test_slack_below_zero_says_how_far_a_limit_is_from_binding():
    points, durations = random_legs(2, 3)
    limit = 2.5
    found = relaxed(task_of(points, limits=Limits(speed=limit)), durations)
    assert -0.3 < found.slacks[0] < -0.1

    def keeps(speed):
        return can_be_flown(task_of(points, limits=Limits(speed=speed)), durations)

    assert is_the_least(limit * (1.0 + found.slacks[0]), keeps, 5e-3)


@pytest.mark.slow
def test_programmes_with_many_unknowns_that_one_sparse_solver_leaves_are_solved_by_the_other():
    """Three pieces per leg, C7, durations that differ by 60: Clarabel's answer is off by 3 % of a width."""
    points = [(3.5, 7.6, 0.6), (3.0, 9.3, -1.4), (3.1, 8.9, -1.7), (3.8, 8.7, -0.8), (5.3, 7.8, 4.5), (6.2, 8.3, 4.2)]
    points += [(6.3, 7.8, 2.4), (6.0, 5.8, 1.0)]
    durations, widths = [12.3, 0.2, 4.5, 8.0, 1.0, 7.5, 1.2], [0.016, 0.76, 0.046, 0.029, 0.26, 1.66, 0.31]
    traj = minsnap.plan(points, durations, degree=11, pieces=3, continuity=7, corridor=widths)
    assert minsnap.certify(traj, points, widths).ok


def test_a_curve_with_room_need_not_be_the_best(monkeypatch):
    """An answer that keeps all rows is of use although its duality gap is wide; the least slack it does not give."""
    least_sum = elastic.least_sum

    def with_wide_gap(*given):
        found = least_sum(*given)
        return found and replace(found, lost=found.lost + 1.0)

    monkeypatch.setattr(elastic, "least_sum", with_wide_gap)
    points, durations = random_legs(2, 3)
    task = task_of(points, limits=Limits(speed=1e3))
    assert relaxed(task, durations, sign=True).slacks[0] < 0.0
    with pytest.raises(SolverError):
        relaxed(task, durations)
