"""The stand-in behaves as unmodified autopilots were recorded, and our side meets it as the offboard page says."""

import numpy as np
import pytest
from clocks import SharedClock
from flying import PATH, START, Flight, patient_rules, stall_once
from pilot import fly_until
from standin import COASTING, RETURN, PointMass, StandIn, mavlink

from minsnap.errors import FlightError
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mocap import Pose, PoseSource, Relay


def lost(stack, velocity, seconds, **settings):
    """The stand-in, flown by hand from the last setpoint on: instants, positions and velocities."""
    vehicle = StandIn(autopilot=stack, body=PointMass((0.0, 0.0, -2.0)), **settings)
    message = mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, 0, 0.0, 0.0, -2.0, *velocity, *(0.0,) * 5
    )
    vehicle.setpoints, vehicle.last_setpoint, vehicle.mode = [(0.0, message)], 0.0, vehicle.following
    vehicle.last_setpoint = -COASTING
    vehicle.body.velocity = list(velocity)
    record = []
    for now in np.arange(1, round(seconds / 0.01)) * 0.01:
        vehicle._fly(now, 0.01)
        record.append((now + COASTING, *vehicle.body.position, *vehicle.body.velocity))
    vehicle.link.close()
    return vehicle, np.array(record)


def test_arducopter_accelerates_after_a_loss_for_three_seconds_then_brakes():
    vehicle, record = lost("ardupilot", (1.06, 0.0, 0.0), 8.0)
    speed = record[:, 4]
    assert speed.max() == pytest.approx(1.99, abs=0.15) and record[speed.argmax(), 0] == pytest.approx(3.0, abs=0.1)
    assert record[-1, 1] + COASTING * 1.06 == pytest.approx(6.0, abs=0.6)
    assert speed[-1] == 0.0 and vehicle.mode == vehicle.following


def test_px4_returns_and_climbs_after_a_loss():
    vehicle, record = lost("px4", (0.0, 0.0, 0.0), 8.0, returns=True)
    assert vehicle.mode == RETURN and vehicle.failsafes[0] + COASTING == pytest.approx(1.06, abs=0.07)
    assert record[-1, 3] < -13.9 and record[:60, 3].min() == -2.0


@pytest.mark.slow
def test_what_px4_has_taken_for_a_return_after_a_long_stall_is_left_to_it():
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START), beat_period=1.0, returns=True) as vehicle:
        rules = patient_rules(max_gap=1.0, heartbeat_timeout=60.0, abort_distance=50.0)
        with Flight(vehicle, PATH, clock, rules=rules) as flight:
            flight.streamer._observer._on_status = stall_once(flight, 4.0)
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: v.failsafes)
            before = len(vehicle.setpoints)
            with pytest.raises(FlightError, match="no setpoint left this program.*RETURN has the vehicle"):
                flight.result()
            assert len(vehicle.setpoints) == before and vehicle.mode == RETURN


@pytest.mark.slow
def test_a_stall_after_which_px4_still_follows_is_met_by_a_hold_once_it_has_said_so():
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START), patience=60.0) as vehicle:
        rules = patient_rules(max_gap=1.0, heartbeat_timeout=60.0, abort_distance=50.0)
        with Flight(vehicle, PATH, clock, rules=rules) as flight:
            flight.streamer._observer._on_status = stall_once(flight, 2.5)
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: any("no setpoint left this program" in event for event in flight.events))
            now = len(vehicle.setpoints)
            vehicle.until(lambda v: len(v.setpoints) > now + 20)
            held = {(m.x, m.y, m.z, m.vx, m.vy, m.vz) for _, m in vehicle.setpoints[now + 5 :]}
            assert len(held) == 1 and next(iter(held))[3:] == (0, 0, 0)
            vehicle.enter(vehicle.other)
            with pytest.raises(FlightError, match="no setpoint left this program"):
                flight.result()


def test_what_px4_does_after_a_second_stop_is_said():
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START)) as vehicle, Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        flight.stop()
        vehicle.until(lambda v: any("stopped by the user" in event for event in flight.events))
        flight.stop()
        flight.result()
    said = next(event for event in flight.events if event.startswith("the vehicle is left armed"))
    assert "in OFFBOARD" in said and "m high" in said and "climbs" in said


class OnePose(PoseSource):
    def __init__(self, clock):
        self._clock, self._left = clock, 20

    def latest(self):
        self._left -= 1
        self.ended = self._left <= 0
        return Pose(self._clock.now(), (1.0, 2.0, 3.0 + 0.01 * self._left), (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("message", "topic", "fused"),
    [
        ("vision", "vehicle_visual_odometry", True),
        ("odometry", "vehicle_visual_odometry", True),
        ("odometry-mocap", "vehicle_mocap_odometry", False),
        ("mocap", "vehicle_mocap_odometry", False),
    ],
)
def test_poses_reach_the_topic_that_the_page_names(message, topic, fused):
    clock = SharedClock()
    with StandIn(clock=clock) as vehicle:
        link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock)
        Relay(OnePose(clock), link, clock, message=message).run()
        vehicle.until(lambda v: v.topics)
        link.close()
        assert set(vehicle.topics) == {topic} and (vehicle.fused > 0) == fused
