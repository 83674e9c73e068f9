"""Limits from an autopilot's parameters, and the plan within them that its tilt and the vehicle's drag allow."""

import math

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, LinkError
from minsnap.flight import CascadeController, compare, simulate
from minsnap.flight.mavlink.parameters import autopilot_limits
from minsnap.flight.mavlink.setpoints import FeedForward
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

PX4 = {
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_TILTMAX_AIR": 45.0,
    "MC_ROLLRATE_MAX": 220.0,
    "MC_PITCHRATE_MAX": 200.0,
    "MC_YAWRATE_MAX": 200.0,
}


@pytest.mark.parametrize("drag", [0.0, 0.4, 1.0])
def test_a_plan_within_them_leaves_the_tilt_room_for_drag(drag):
    found = autopilot_limits("px4", PX4, drag)
    assert found.climb_speed == pytest.approx(2.7) and found.descent_speed == pytest.approx(1.35)
    assert found.yaw_rate == pytest.approx(math.radians(180.0), rel=1e-3) == pytest.approx(found.body_rate, rel=1e-3)
    path = minsnap.rectangle(width=30, length=20, limits=found)
    samples = path.sample(50.0)
    pull = samples.acceleration + drag * samples.velocity
    tilt = np.degrees(np.arctan2(np.hypot(pull[:, 0], pull[:, 1]), 9.80665 + pull[:, 2]).max())
    assert tilt < 45.0


def test_drag_lowers_the_speed_that_the_tilt_can_hold():
    fast, held_back = autopilot_limits("px4", PX4), autopilot_limits("px4", PX4, 1.0)
    assert fast.horizontal_speed == pytest.approx(10.8)
    assert held_back.horizontal_speed == pytest.approx(4.903, abs=2e-3)
    assert held_back.horizontal_acceleration == pytest.approx(3.92, abs=0.01)


def test_ardupilot_counts_in_centimetres():
    values = {"WPNAV_SPEED": 500.0, "WPNAV_ACCEL": 250.0, "PSC_JERK_XY": 5.0, "ANGLE_MAX": 3000.0, "PSC_ANGLE_MAX": 0.0}
    found = autopilot_limits("ardupilot", values)
    assert (found.horizontal_speed, found.horizontal_acceleration, found.jerk) == (4.5, 2.25, 4.5)
    assert found.climb_speed == 3.0, "that of ordinary flight, where a vehicle tells none"
    newer = {"WP_SPD": 5.0, "WP_ACC": 2.5, "PSC_JERK_NE": 5.0, "ATC_ANGLE_MAX": 30.0, "PSC_ANGLE_MAX": 0.0}
    assert autopilot_limits("ardupilot", newer) == found
    assert autopilot_limits("ardupilot", newer | {"ATC_RATE_WPY_MAX": 60.0}).yaw_rate == pytest.approx(0.9424)


def test_a_vehicle_that_does_not_answer_has_no_limits():
    with pytest.raises(LinkError, match="did not answer"):
        autopilot_limits("px4", {})
    with pytest.raises(LinkError, match="neither PX4 nor ArduPilot"):
        autopilot_limits("generic", PX4)


@pytest.mark.parametrize("drag", [-1.0, math.nan, math.inf])
def test_a_drag_that_pushes_or_is_no_number_is_refused(drag):
    with pytest.raises(InputError, match="the drag is .* 1/s: it must be 0 or more"):
        autopilot_limits("px4", PX4, drag)


def missed(plan, lead=0.15):
    """What a stand-in with PX4's controllers misses of a plan [m, root mean square], drag offset and sent ahead."""
    vehicle, samples = Quadrotor.px4_sih(), plan.sample(50.0)
    sent = FeedForward(vehicle=vehicle).stated(samples)
    flight = simulate(vehicle, CascadeController(), sent, setpoint_delay=0.1, duration=plan.duration + 1.0)
    return compare(samples, Samples(flight.t - lead, flight.position)).rmse_3d


@pytest.mark.slow
def test_a_race_within_them_is_followed_where_one_at_eight_metres_a_second_is_not():
    lap = [(0, 0, 2), (9.5, 3.8, 2.5), (14.2, 10.4, 2), (5.7, 13.3, 2.5), (-3.8, 8.5, 2), (0, 0, 2)]
    how = {"waypoint_tolerance": minsnap.Ball(0.3), "pieces": 2}
    eager = minsnap.plan(lap, limits=minsnap.Limits(speed=8, acceleration=20, jerk=120), **how)
    within = minsnap.plan(lap, limits=autopilot_limits("px4", PX4, 1.0), **how)
    assert missed(within) < 0.5 and missed(eager) > 2.0
