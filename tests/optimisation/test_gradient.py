"""Gradients of the optimal cost in the durations, against central differences of the optimal cost itself."""

import numpy as np
import pytest
from tasks import random_legs, task_of

from minsnap.corridors.tubes import RoundTube, Tube
from minsnap.limits.limits import Limits
from minsnap.optimisation.gradient import cost_gradient
from minsnap.optimisation.solve import solve

TIGHT = 1e-12
STEP = 3e-4

ROUND = 5e-5
"""Agreement where walls are round: they are met by tangents near the contact rather than at it."""


def central(task, durations, index):
    values = []
    for sign in (1.0, -1.0):
        moved = durations.copy()
        moved[index] *= 1.0 + sign * STEP
        values.append(solve(task, moved, gap=TIGHT).cost)
    return (values[0] - values[1]) / (2.0 * STEP * durations[index])


def check(task, durations, tolerance=1e-5):
    gradient = cost_gradient(solve(task, durations, gap=TIGHT))
    assert gradient.shape == durations.shape
    differences = np.array([central(task, durations, index) for index in range(len(durations))])
    assert np.abs(gradient - differences).max() <= tolerance * np.abs(differences).max()


@pytest.mark.parametrize("half", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("seed", [0, 1])
def test_without_corridor(seed, half):
    points, durations = random_legs(seed)
    check(task_of(points, half=half), durations)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_in_a_corridor(seed):
    points, durations = random_legs(seed, dim=2 + seed % 2)
    check(task_of(points, Tube(0.15)), durations)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_in_a_round_corridor(seed):
    points, durations = random_legs(seed)
    check(task_of(points, RoundTube(0.2)), durations, ROUND)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 6])
def test_with_several_pieces_a_leg(seed):
    points, durations = random_legs(seed, legs=2)
    check(task_of(points, Tube(0.1), pieces=2), np.repeat(durations / 2.0, 2) * [0.9, 1.1, 1.2, 0.8])


def test_of_a_closed_lap():
    points, durations = random_legs(7, legs=4)
    points[-1] = points[0]
    check(task_of(points, Tube(0.2), closed=True), durations)


def test_with_pinned_states():
    points, durations = random_legs(8, legs=3)
    pins = {1: {1: np.array([0.3, 0.1, -0.2]), 2: np.array([0.1, 0.0, 0.2])}}
    check(task_of(points, Tube(0.3), pins=pins), durations)


@pytest.mark.parametrize("seed", [9, 10])
def test_within_limits_as_walls(seed):
    """A limit's row changes with the duration by a power of it, too."""
    points, durations = random_legs(seed, legs=3)
    durations = 2.5 * durations
    free = solve(task_of(points), durations).trajectory
    top = Limits(speed=1.0, acceleration=1.0).utilisation(free)
    limits = Limits(speed=0.93 * top[0].value, acceleration=0.95 * top[1].value)
    check(task_of(points, limits=limits), durations, ROUND)


def test_is_zero_in_the_direction_of_scaling_but_for_the_power_of_time():
    """Euler: J(a T) = a^(1 - 2k) J(T), so T . dJ/dT = (1 - 2k) J, walls of a corridor or none."""
    points, durations = random_legs(11)
    for corridor in (None, Tube(0.1)):
        solved = solve(task_of(points, corridor), durations, gap=TIGHT)
        assert durations @ cost_gradient(solved) == pytest.approx(-7.0 * solved.cost, rel=1e-7)


def test_a_thousand_legs_take_one_pass():
    points, durations = random_legs(12, legs=1000)
    solved = solve(task_of(points), durations)
    assert durations @ cost_gradient(solved) == pytest.approx(-7.0 * solved.cost, rel=1e-7)
