"""Ends of flights that hold nobody: on the ground, silent, led by another; and lags that would end them."""

import numpy as np
import pytest
from flying import PATH, START, Flight, excursion, in_ned, patient_rules
from pilot import fly_until
from standin import OFFBOARD, PointMass, StandIn
from world import World, fly, ready

from minsnap.errors import FlightError
from minsnap.flight.mavlink.setpoints import FeedForward
from minsnap.flight.mavlink.stream_options import Phase, SafetyRules
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS
from minsnap.vehicle import Quadrotor

FAST = excursion(8.0, reach=13.0)
SPEED = float(np.linalg.norm(FAST.velocity, axis=1).max())


@pytest.mark.slow
@pytest.mark.parametrize("stopped", [False, True])
def test_a_vehicle_that_refuses_to_arm_is_not_held_on_the_ground(clock, stopped):
    ground = (*START[:2], 0.0)
    with StandIn(clock=clock, body=PointMass(ground), armed=False, refuses_arming="PreArm: no compass") as vehicle:
        with Flight(vehicle, PATH, clock, arm=True, land=True, trigger="now", wait=6.0) as flight:
            if stopped:
                vehicle.until(lambda v: v.mode == OFFBOARD)
                flight.stop()
                assert flight.result().reason == "stopped by the user"
                return
            reason = r'refused command 400 \(arm\) with result 1 \(temporarily rejected\); it says "PreArm: no compass"'
            with pytest.raises(FlightError, match=reason):
                flight.result()


@pytest.mark.slow
def test_a_mode_that_a_pilot_chose_for_a_moment_is_noticed(clock):
    with StandIn(clock=clock, body=PointMass(START), beat_period=3.0, beats_on_request=True) as vehicle:
        with Flight(vehicle, PATH, clock, rules=patient_rules(heartbeat_timeout=60.0)) as flight:
            fly_until(flight, vehicle)
            vehicle.enter(vehicle.other)
            seen = clock.now() + 0.7
            vehicle.until(lambda v: clock.now() > seen)
            vehicle.enter()
            vehicle.until(lambda v: any("stopped: the vehicle left OFFBOARD" in event for event in flight.events))
            vehicle.enter(vehicle.other)
            with pytest.raises(FlightError, match="left OFFBOARD"):
                flight.result()
        assert not any("is not seen" in event for event in flight.events)


def test_modes_that_are_told_rarely_are_said_to_be_hidden(clock):
    with StandIn(clock=clock, body=PointMass(START), beat_period=2.0, tells_modes=False) as vehicle:
        with Flight(vehicle, PATH, clock, rules=patient_rules(heartbeat_timeout=60.0)) as flight:
            fly_until(flight, vehicle)
        (said,) = [event for event in flight.events if "is not seen" in event]
        assert said.startswith("the vehicle tells its mode every 2.")


def test_one_stop_ends_the_hold_of_a_vehicle_that_is_gone():
    world, sequence = ready()
    fly(world, sequence, 60)
    world.happen("silent")
    fly(world, sequence, 61)
    assert sequence.phase is Phase.HOLDING and "silent for 1 s" in sequence.reason
    world.happen("stop")
    assert fly(world, sequence, 1) is None


def test_a_refusal_of_long_ago_is_not_what_a_hold_waits_for():
    world, sequence = ready()
    fly(world, sequence, 60)
    told = type("Ack", (), {"get_type": lambda _: "COMMAND_ACK", "command": 22, "result": 4})()
    world.vehicle = world.vehicle.told(told, world.slot / 20.0)
    world.happen("stop")
    fly(world, sequence, 1)
    assert "22" not in sequence.hold_ends(world.conditions(sequence.setpoint))


@pytest.mark.slow
def test_a_second_sender_does_not_say_that_it_leaves_the_vehicle(vehicle, clock):
    vehicle.tells_targets = False
    with Flight(vehicle, PATH, clock) as first:
        fly_until(first, vehicle)
        with Flight(vehicle, PATH, clock, rules=patient_rules(max_start_distance=50.0)) as second:
            vehicle.until(lambda v: "ready" in second.events)
            second.stop()
            second.result()
        assert any("never led the vehicle" in event for event in second.events)
        assert not any("is left armed" in event for event in second.events)


def test_px4_that_flies_by_itself_gets_nothing_more():
    world, sequence = ready()
    fly(world, sequence, 60)
    world.happen("offboard")
    world.mode = (4 << 16) | (5 << 24)
    assert fly(world, sequence, 1) is None
    assert "RETURN has the vehicle" in sequence.reason
    assert AUTOPILOTS["px4"].mode_name(world.vehicle) == "RETURN" and World().mode >> 16 == 3


@pytest.mark.slow
@pytest.mark.parametrize("given", [{}, {"delay": 0.5}, {"feed_forward": FeedForward(vehicle=Quadrotor.px4_sih())}])
def test_a_lag_that_would_stop_the_flight_is_refused_or_allowed_for(clock, given):
    with StandIn(clock=clock, body=PointMass(in_ned(FAST.position[0]))) as vehicle:
        lag = 1.4 * SPEED * given.get("delay", 0.5)
        with Flight(vehicle, FAST, clock, rules=SafetyRules(abort_distance=2.0), **given) as flight:
            with pytest.raises(
                FlightError, match=f"will lag {lag:.1f} m behind in bends at {SPEED:.1f} m/s .* would stop"
            ):
                flight.result()
        assert not vehicle.setpoints
        with Flight(vehicle, FAST, clock, **given) as flight:
            vehicle.until(lambda v: v.setpoints)
            assert any(f"it will lag {lag:.1f} m" in event for event in flight.events)
            assert flight.streamer._options.rules.abort_distance == pytest.approx(1.5 * lag, rel=0.02)
        with Flight(vehicle, FAST, clock, rules=SafetyRules(abort_distance=2.0), delay=0.1) as flight:
            vehicle.until(lambda v: "ready" in flight.events)


def test_a_fitted_delay_goes_with_the_vehicle(tmp_path):
    from dataclasses import replace

    replace(Quadrotor.px4_sih(), delay=0.31).to_yaml(tmp_path / "v.yaml")
    assert Quadrotor.from_yaml(tmp_path / "v.yaml").delay == 0.31
