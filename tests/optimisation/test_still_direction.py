"""Pins and continuity that no durations join: along a direction in which nothing else moves."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import minsnap
from minsnap.optimisation.still_direction import StillDirection, still_direction
from minsnap.planning.planner import task_of
from minsnap.planning.request import PlanRequest

POINTS = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.3), (0.2, 0.0, 0.5), (1.2, 0.0, 0.6)])
ACROSS = np.array((0.0, 1.0, 0.0))


def task(points, across, **changed):
    pins = {1: {"velocity": across}}
    return task_of(PlanRequest(**{"waypoints": points, "pins": pins, "continuity": 6, "degree": 7} | changed))


@pytest.mark.parametrize("dim", [3, 4, 5])
def test_a_pin_across_all_legs_has_no_curve_in_any_time(dim):
    """The plans without the pin do not move across, whatever their durations; with less continuity there is one."""
    draw = np.random.default_rng(dim)
    points = draw.normal(size=(4, dim))
    points[:, 0] = 0.5 * points[:, 1]
    across = np.eye(dim)[0]
    proof = still_direction(task(points, across))
    assert proof.verify() and proof.direction[0] != 0
    for durations in np.exp(draw.normal(size=(5, 3))):
        free = minsnap.plan(points, durations, continuity=6)
        assert abs(free(durations[0], 1) @ np.array(proof.direction, float)) < 1e-9
    with pytest.raises(minsnap.InfeasibleError, match="in any time") as refused:
        minsnap.plan(points, total_time=3.0, continuity=6, pins={1: {"velocity": across}})
    assert refused.value.verify()
    assert minsnap.plan(points, total_time=3.0, pins={1: {"velocity": across}}).duration == pytest.approx(3.0)


@pytest.mark.parametrize(
    "changed",
    [
        {"continuity": 5},
        {"pieces": 2},
        {"start": {"velocity": ACROSS}},
        {"pins": {1: {"velocity": (0.1, 0.0, 0.3)}}},
        {"waypoint_tolerance": 1e-3},
        {"waypoints": POINTS + np.outer((0, 0, 0, 1e-9), ACROSS)},
    ],
)
def test_nothing_is_proved_where_a_curve_may_move_across(changed):
    assert still_direction(task(POINTS, ACROSS)).direction == (0, 1, 0)
    assert still_direction(task(POINTS, ACROSS, **changed)) is None


def test_tampered_proofs_do_not_verify():
    proof = still_direction(task(POINTS, ACROSS))
    assert not StillDirection(proof.task, (Fraction(1), Fraction(1), Fraction(0))).verify()
    assert not StillDirection(proof.task, (Fraction(0),) * 3).verify()
    assert not replace(proof, task=task(POINTS, ACROSS, continuity=5)).verify()


def test_a_lap_in_a_plane_does_not_leave_it():
    """All derivatives of its seam are chosen by the plan."""
    lap = np.vstack((POINTS, POINTS[:1]))
    assert still_direction(task(lap, ACROSS, closed=True)).verify()
    free = minsnap.plan(lap, (1.0, 2.0, 0.5, 1.5), continuity=6, closed=True)
    assert np.abs(free.control_points[:, :, 1]).max() < 1e-12
