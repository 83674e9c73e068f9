"""What a plan says of a fixed yaw that nobody asked for."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tasks import spinless

import minsnap
from minsnap import Limits
from minsnap.limits.heading_cost import fixed_yaw_notes
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of

VEHICLE = Quadrotor.dji_f330()
COURSE = [(0, 0, 1), (3, 2, 2), (5, -2, 3), (1, -3, 1)]


def largest_share(vehicle, path, reserve):
    t = np.linspace(0.0, path.duration, 20001)
    speed = flatness_of(vehicle, path, t).rotor_speed
    thrust, hover = vehicle.thrust_coefficient * speed * np.abs(speed), vehicle.hover_thrust
    least, most = vehicle.rotor_thrust_limits
    return max((thrust.max() - hover) / (most - hover), (hover - thrust.min()) / (hover - least)) / (1.0 - reserve)


@pytest.mark.parametrize(
    "vehicle",
    (VEHICLE, replace(VEHICLE, drag=BodyDrag(linear=(0.3, 0.3, 0.0))), replace(VEHICLE, rotor_speed_min=500.0)),
    ids=("plain", "drag", "least thrust"),
)
def test_the_sentence_gives_the_shares_of_both_headings(vehicle):
    limits = Limits.of(vehicle, reserve=0.2)
    fixed = minsnap.plan(COURSE, [1.4, 1.5, 1.4])
    free = spinless(fixed, vehicle)
    (note,) = fixed_yaw_notes(limits, fixed)
    shares = [float(found) / 100.0 for found in re.findall(r"(\d+) %", note)]
    assert shares == pytest.approx([largest_share(vehicle, path, 0.2) for path in (fixed, free)], abs=6e-3, rel=2e-3)
    assert "yaw='tilt'" in note


def test_only_a_yaw_that_nobody_asked_for_is_remarked_on():
    limits = Limits.of(VEHICLE, reserve=0.1)
    plans = {
        yaw: minsnap.plan(COURSE, total_time=4.5, limits=limits, yaw=yaw, search=minsnap.Search(split="distance"))
        for yaw in (None, 0.0)
    }
    assert len(plans[None].report.notes) == 1 and plans[0.0].report.notes == ()
    assert minsnap.plan(COURSE, [9.0, 9.0, 9.0]).report.notes == ()


def test_slow_flight_is_not_worth_a_sentence():
    slow = minsnap.plan(COURSE, [9.0, 9.0, 9.0])
    assert fixed_yaw_notes(Limits.of(VEHICLE), slow) == ()
    assert fixed_yaw_notes(Limits(speed=3.0), slow) == () and fixed_yaw_notes(None, slow) == ()
