"""Rows halfway between a place where a wall is violated and the nearest row of that wall."""

import numpy as np
import pytest
from tasks import random_legs, task_of

import minsnap
from minsnap.optimisation.normalised_constraints import compile_walls
from minsnap.optimisation.rows import Curve, halfway_rows
from minsnap.optimisation.unconstrained import unbounded_optimum


@pytest.fixture
def curve():
    points, durations = random_legs(0, 4)
    task = task_of(points, minsnap.Tube(0.2))
    units = task.units(durations)
    problem = task.problem(durations, units)
    return Curve(problem, compile_walls(task, problem, units), unbounded_optimum(problem))


def at(curve, walls, places):
    return curve.rows(0, np.array(walls), np.array(places))


def test_a_row_is_added_halfway_to_the_nearest_row_of_the_same_wall(curve):
    known = at(curve, [1, 3, 3, 4], [0.9, 0.2, 0.6, 0.1])
    (rows,) = halfway_rows(curve, known, [at(curve, [3, 3, 3], [0.5, 0.1, 0.8])])
    assert rows.wall.tolist() == [3, 3, 3]
    np.testing.assert_allclose(rows.s, [0.55, 0.15, 0.7])
    direct = at(curve, [3, 3, 3], rows.s)
    assert (rows.normal == direct.normal).all() and (rows.bound == direct.bound).all()


def test_a_wall_without_a_row_elsewhere_gets_none(curve):
    known = at(curve, [1, 4], [0.9, 0.1])
    assert halfway_rows(curve, known, [at(curve, [2, 3, 4], [0.5, 0.5, 0.1])]) == []
