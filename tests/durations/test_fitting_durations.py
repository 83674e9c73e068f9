"""Durations that leave a curve whose derivatives all join inside its walls."""

import numpy as np
import pytest

import minsnap
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.durations.fitting_durations import fitting_durations
from minsnap.planning.planner import task_of
from minsnap.planning.request import PlanRequest

POINTS = ((0, 0, 0), (4, 0, 0), (4, 1, 0), (4, 6, 1), (3, 6, 1))


def task(corridor):
    return task_of(PlanRequest(waypoints=POINTS, corridor=corridor, continuity=6))


@pytest.mark.parametrize("total", (None, 10.0))
def test_a_smooth_curve_that_only_its_durations_bend_is_brought_inside(total):
    """With continuity 6 and degree 7 there is one curve for the durations; those by distance leave a tube of 0.2 m."""
    lengths = np.linalg.norm(np.diff(np.array(POINTS, float), axis=0), axis=1)
    free = minsnap.plan(POINTS, lengths, continuity=6)
    assert minsnap.certify(free, corridor=0.2).corridor_margin < 0.0
    found = fitting_durations(task(0.2), [lengths], total, NEVER)
    assert total is None or found.sum() == pytest.approx(total, rel=1e-14)
    assert minsnap.certify(minsnap.plan(POINTS, found, continuity=6), corridor=0.2).corridor_margin > 0.0


def test_no_durations_are_found_where_none_bring_the_curve_inside_or_no_time_is_left():
    lengths = np.ones(4)
    assert fitting_durations(task(1e-3), [lengths], None, NEVER) is None
    assert fitting_durations(task(0.2), [lengths], 10.0, Deadline(0.0)) is None


def test_no_other_start_is_tried_after_two_that_lead_to_the_same_excess():
    starts = iter([np.ones(4)] * 4)
    assert fitting_durations(task(1e-3), starts, 10.0, NEVER) is None
    assert len(list(starts)) == 2
