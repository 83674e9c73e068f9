"""Plans by a call or two of the native core against the same plans the long way."""

import numpy as np
import pytest
from helpers.tasks import REFERENCE, random_legs

import minsnap
from minsnap.durations.resting import resting_plan
from minsnap.native import library
from minsnap.native.durations import best_tube_split
from minsnap.native.status import Status

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


@pytest.mark.parametrize("corridor", [None, 0.05, 0.4, [0.1, 0.2, 0.3, 0.4]])
@pytest.mark.parametrize("degree", [5, 7, 9])
def test_the_quick_way_finds_the_split_of_the_long_one(corridor, degree):
    points, durations = random_legs(3, legs=4)
    total = float(durations.sum())
    quick = resting_plan(points, None, total, corridor, degree)
    told = []
    long = minsnap.plan(
        points, total_time=total, corridor=corridor, degree=degree, progress=lambda *step: told.append(step)
    )
    assert quick.duration == pytest.approx(total, rel=1e-12)
    assert quick.cost() == pytest.approx(long.cost(), rel=3e-6)
    assert minsnap.certify(quick, points, corridor).ok
    assert quick.report.core == "native" and quick.report.solver == long.report.solver
    assert quick.report.steps[-1].best == pytest.approx(quick.cost(), rel=3e-6)
    assert [step.evaluation for step in quick.report.steps] == list(range(1, len(quick.report.steps) + 1))


def test_plan_takes_the_quick_way_for_a_total_time():
    for corridor in (None, 0.3):
        quick = resting_plan(REFERENCE, None, 12.0, corridor, 7)
        plan = minsnap.plan(REFERENCE, total_time=12.0, corridor=corridor)
        assert plan.control_points.tobytes() == quick.control_points.tobytes()


def test_one_leg_has_all_the_time():
    plan = resting_plan(REFERENCE[:2], None, 3.0, 0.2, 7)
    assert plan.durations.tolist() == [3.0] and plan.report.steps == ()


@pytest.mark.parametrize(
    "asked",
    [
        (REFERENCE, None, None, None, 7),
        (REFERENCE, [4.0, 2.0, 4.0, 2.0], 12.0, None, 7),
        (REFERENCE, None, -1.0, None, 7),
        (REFERENCE, None, np.inf, None, 7),
        (REFERENCE, None, True, None, 7),
        (REFERENCE[[0, 0, 1]], None, 12.0, None, 7),
        (REFERENCE, None, 12.0, -0.1, 7),
        (REFERENCE, None, 12.0, [0.1, 0.2], 7),
        (REFERENCE, None, 12.0, None, 6),
        (REFERENCE[:1], None, 12.0, None, 7),
        (REFERENCE[:3] @ np.ones((3, 4)), None, 12.0, None, 7),
    ],
)
def test_what_is_unusual_is_left_to_the_long_way(asked):
    assert resting_plan(*asked) is None


def test_a_split_in_a_tube_has_the_status_of_what_is_wrong_with_it():
    points, first = REFERENCE.copy(), np.array([4.0, 2.0, 4.0, 2.0])
    assert best_tube_split(points, first, np.array(-1.0), 4) is Status.BAD_NUMBER
    assert best_tube_split(points, first, np.array(0.3), 9) is Status.BAD_SIZE
    many, durations = random_legs(0, legs=257)
    assert best_tube_split(many, durations, np.array(0.3), 4) is Status.BAD_SIZE
