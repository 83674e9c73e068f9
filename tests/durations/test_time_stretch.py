"""The factor on time at which a limit is touched."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.basics.deadline import Deadline
from minsnap.durations import time_stretch
from minsnap.durations.time_stretch import measuring_work, touching_factor
from minsnap.errors import SolverError
from minsnap.limits.compliance import keeps, most_used
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.vehicle import BodyDrag, Quadrotor

LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.mark.parametrize(
    "limits",
    [
        LIMITS,
        Limits(jerk=4.0),
        Limits(max_thrust=1.5),
        Limits(tilt=0.2),
        Limits(body_rate=1.0),
        Limits(climb_speed=0.7),
    ],
)
@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_the_final_touch_reaches_a_limit_and_exceeds_none(limits, scale):
    points = [(0, 0, 0), (2, 1, 3), (0, -1, 1), (3, 0, 0)]
    path = minsnap.plan(points, scale * np.array([3.0, 2.0, 3.0]))
    used = most_used(limits, path.stretched(touching_factor(limits, path)))
    assert 1.0 - 1e-9 <= used.fraction <= 1.0 + 1e-9


@pytest.mark.parametrize("scale", [0.3, 1.0, 100.0])
def test_the_final_touch_reaches_a_least_thrust(scale):
    path = minsnap.plan([(0, 0, 0), (0, 0, 3), (0, 0, 1), (1, 0, 4)], scale * np.array([3.0, 2.0, 3.0]))
    limits = Limits(min_thrust=0.7)
    assert most_used(limits, path.stretched(touching_factor(limits, path))).fraction == pytest.approx(1.0, abs=1e-9)


def test_a_use_that_jumps_is_left_just_beyond_the_jump(monkeypatch):
    """Where the curve turns back the yaw turns around: halvings to the last bits measured the rotors 60 times."""
    measured, use = [], VehicleLimits.utilisation
    monkeypatch.setattr(VehicleLimits, "utilisation", lambda own, *asked: measured.append(own) or use(own, *asked))
    limits, deadline = Limits.of(Quadrotor.dji_f330(), speed=4.0), Deadline()
    path = minsnap.plan([(0, 0, 1), (4, 0, 1), (0, 0.1, 1)], (1.5, 1.5), yaw="velocity")
    factor = touching_factor(limits, path, deadline=deadline)
    assert len(measured) <= 40
    assert deadline.work.done == pytest.approx(len(measured) * measuring_work(limits, 2, path.yaw))
    assert keeps(limits, path.stretched(factor)) and not keeps(limits, path.stretched(factor * (1.0 - 2e-5)))


@pytest.mark.parametrize("change", [{"drag": BodyDrag((1e40, 1e40, 1e40))}, {"rotor_speed_max": 600.5}])
def test_limits_that_no_speed_keeps_are_refused(change):
    """SciPy told that two numbers must have different signs; and for rotors that just hover, of durations of 1e20 s."""
    with pytest.raises(SolverError, match="loosen a limit"):
        minsnap.plan([(0, 0, 0), (1, 0, 0)], limits=Limits.of(replace(Quadrotor.dji_f330(), **change)))


def test_what_a_proof_adds_to_samples_takes_few_steps(monkeypatch):
    """The last bits of a use that is proved were once walked by a precision at a time: 450 proofs, four seconds."""
    path, asked = minsnap.plan([(0, 0, 1), (4, 0, 1)], [3.0]), []

    def use(limits, curve, whole, proved):
        asked.append(proved)
        return (2.0 * path.duration / curve.duration) ** 2 * (1.0 + 1e-8 * proved)

    monkeypatch.setattr(time_stretch, "_most_used_safely", use)
    factor = touching_factor(Limits(tilt=0.2), path)
    assert use(None, path.stretched(factor), True, True) <= 1.0
    assert factor == pytest.approx(2.0, abs=1e-7) and sum(asked) <= 8


def test_walls_on_derivatives_are_kept_without_a_look_at_the_yaw(monkeypatch):
    limits, walls = Limits(speed=3.0), minsnap.HalfSpaces((1, 0, 0), 0.9, order=1)
    looked, on = [], LookAtHeading.on
    monkeypatch.setattr(LookAtHeading, "on", lambda own, *asked: looked.append(own) or on(own, *asked))
    points, search = [(0, 0, 1), (5, 0, 1), (5, 3, 1), (8, 4, 1)], minsnap.Search(split="distance")
    planned = minsnap.plan(points, limits=limits, corridor=walls, yaw=minsnap.LookAt((4, 20)), search=search)
    assert planned.extent((1.0, 0.0, 0.0), 1)[1] == pytest.approx(0.9, abs=1e-6) and len(looked) <= 300


def test_a_yaw_in_time_that_turns_too_fast_is_refused_where_a_path_is_only_scaled():
    """No speed of the path slows a yaw that is a function of time."""
    limits = Limits(speed=2.0, yaw_rate=0.5)
    search = minsnap.Search(split="distance")
    with pytest.raises(minsnap.errors.LimitError, match="however slow the plan"):
        minsnap.plan([(0, 0, 0), (4, 0, 0), (4, 3, 0)], limits=limits, yaw=np.sin, search=search)
    slow = minsnap.plan([(0, 0, 0), (4, 0, 0), (4, 3, 0)], limits=limits, yaw=lambda t: 0.4 * np.sin(t), search=search)
    assert minsnap.certify(slow, limits=limits).ok
