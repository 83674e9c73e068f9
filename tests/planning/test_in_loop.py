"""Plans that leave room for a control loop."""

from dataclasses import replace

import pytest

import minsnap
from minsnap.basics.limit_kinds import KINDS
from minsnap.planning.in_loop import limits_left

LOOP = replace(minsnap.Loop.px4({}), max_thrust=None, min_thrust=None, tilt=None, speed=None)
DERIVATIVES = [kind for kind in KINDS if kind.order]


@pytest.mark.parametrize("kind", DERIVATIVES, ids=lambda kind: kind.name)
def test_a_slower_time_scale_lowers_a_limit_by_its_order(kind):
    """A path flown at half the speed has an eighth of the jerk."""
    path = minsnap.plan([(0, 0, 1), (3, 1, 2), (2, 4, 0.5), (0, 2, 1)], [2.0, 1.7, 2.4])
    slow = minsnap.Trajectory(path.control_points, path.durations * 2.0)
    (fast_use,) = minsnap.Limits(**{kind.name: 1.0}).utilisation(path)
    (slow_use,) = limits_left(minsnap.Limits(**{kind.name: 1.0}), LOOP, 0.0, 0.0, 2.0).utilisation(slow)
    assert slow_use.fraction == pytest.approx(fast_use.fraction, rel=1e-9)
