"""What recorded flights showed: pauses of our own, unsettled starts, holds that must end, and what is said of them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from flying import PATH, START, Flight, patient_rules
from pilot import fly_until, places, sent, stands_still, streamed
from standin import COPTER_LAND, COPTER_RTL, GUIDED, LAND, OFFBOARD, RETURN, PointMass, StandIn
from world import HERE, TABLE, fly, ready

from minsnap.errors import FlightError, InputError
from minsnap.flight.mavlink.sequence import Conditions, Sequence
from minsnap.flight.mavlink.stream_options import Phase, SafetyRules, StreamOptions
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS

COPTER = AUTOPILOTS["ardupilot"]


@pytest.mark.parametrize(("gap", "flies"), [(0.49, True), (0.51, False)])
def test_a_pause_of_our_own_ends_the_flight_where_the_vehicle_is(gap, flies):
    world, sequence = ready()
    fly(world, sequence, 60)
    at = world.conditions(sequence.setpoint)
    elsewhere = tuple(x + 0.4 for x in at.vehicle.position)
    sequence.step(replace(at, gap=gap, vehicle=replace(at.vehicle, position=elsewhere)))
    assert (sequence.phase is Phase.FLYING) == flies
    if not flies:
        assert "no setpoint left this program for 0.51 s, more than the 0.5 s allowed" in sequence.reason
        assert sequence.setpoint.position == elsewhere and sequence.setpoint.velocity == (0, 0, 0)


def test_a_pause_during_a_hold_holds_where_the_vehicle_has_got_to():
    world, sequence = ready()
    fly(world, sequence, 60)
    world.happen("stop")
    fly(world, sequence, 5)
    at = world.conditions(sequence.setpoint)
    sequence.step(replace(at, gap=1.6, vehicle=replace(at.vehicle, position=(9.0, 9.0, -9.0))))
    assert sequence.setpoint.position == (9.0, 9.0, -9.0) and sequence.reason == "stopped by the user"


def near(world, offset=0.0, speed=0.0):
    x, y, z = TABLE.start.position
    return replace(world.vehicle, position=(x + offset, y, z), velocity=(speed, 0.0, 0.0))


@pytest.mark.parametrize(("offset", "speed", "goes"), [(0.14, 0.19, True), (0.16, 0.0, False), (0.0, 0.21, False)])
def test_the_flight_begins_when_the_vehicle_stands_at_the_start(offset, speed, goes):
    world, sequence = ready()
    for _ in range(45):
        at = world.conditions(sequence.setpoint)
        sequence.step(replace(at, vehicle=near(world, offset, speed)))
    assert (sequence.phase is Phase.FLYING) == goes
    if not goes:
        assert sequence.waits_for(near(world, offset, speed)) in (
            "the vehicle is 0.16 m from the start, not within 0.15 m",
            "the vehicle still moves at 0.21 m/s",
        )


def test_it_must_stand_there_for_a_while():
    world, sequence = ready()
    for slot in range(70):
        at = world.conditions(sequence.setpoint)
        sequence.step(replace(at, vehicle=near(world, speed=0.5 if slot == 50 else 0.0)))
        if sequence.phase is Phase.FLYING:
            break
    assert slot == 39, "2 s of stream, during which it stood there"
    world, sequence = ready()
    for slot in range(80):
        at = world.conditions(sequence.setpoint)
        sequence.step(replace(at, vehicle=near(world, speed=0.5 if slot == 30 else 0.0)))
        if sequence.phase is Phase.FLYING:
            break
    assert slot == 51, "1 s after it last moved"


@pytest.mark.slow
def test_an_origin_on_the_ground_is_climbed_from_first(clock):
    with StandIn(clock=clock, body=PointMass((3.0, 1.0, 0.0)), armed=False) as vehicle:
        with Flight(vehicle, PATH, clock, relative=True, arm=True, land=True) as flight:
            report = flight.result()
    assert report.completed
    track = places(vehicle)
    assert np.allclose(track[0], (3.0, 1.0, START[2])), "above where it stands, at the height of the file"
    assert track[:, 2].max() <= START[2] + 1e-6, "z points down: never lower than the file"


def test_options_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="use it with relative"):
        StreamOptions(relative_height=True)
    with pytest.raises(InputError, match="choose hold, land, rtl or hand-back"):
        StreamOptions(on_abort="crash")
    with pytest.raises(InputError, match="give_up is 0"):
        StreamOptions(give_up=0.0)


ENDS = [("px4", "land", LAND), ("px4", "rtl", RETURN), ("ardupilot", "rtl", COPTER_RTL)]


@pytest.mark.slow
@pytest.mark.parametrize(("stack", "on_abort", "mode"), ENDS)
def test_after_an_abort_it_comes_down_as_asked(clock, stack, on_abort, mode):
    with StandIn(autopilot=stack, clock=clock, body=PointMass(START)) as vehicle:
        rules = patient_rules(abort_distance=0.5)
        with Flight(vehicle, PATH, clock, rules=rules, on_abort=on_abort, delay=0.1) as flight:
            fly_until(flight, vehicle, beyond=1.0)
            vehicle.moves = False
            with pytest.raises(FlightError, match="from its setpoint"):
                flight.result()
        assert vehicle.mode == mode


def test_a_stop_by_the_user_holds_whatever_aborts_do():
    world, sequence = ready(on_abort="land")
    fly(world, sequence, 60)
    world.happen("stop")
    assert fly(world, sequence, 40).commands == ()


@pytest.mark.slow
def test_a_hold_says_every_ten_seconds_what_ends_it(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        flight.stop()
        vehicle.until(lambda v: any(event.startswith("holding: ") for event in flight.events))
        assert "holding: it ends when the vehicle leaves OFFBOARD, or with a second Ctrl-C" in flight.events
        flight.stop()
        flight.result()
    (left,) = [event for event in flight.events if event.startswith("the vehicle is left")]
    assert re.search(r"left armed, in OFFBOARD, \d\.\d m high", left)
    assert "returns to launch" in left and "COM_OBL_RC_ACT" in left


@pytest.mark.slow
def test_what_arducopter_does_after_a_second_stop_is_said(clock):
    with StandIn(autopilot="ardupilot", clock=clock, body=PointMass(START)) as vehicle:
        with Flight(vehicle, PATH, clock) as flight:
            fly_until(flight, vehicle)
            flight.stop()
            flight.stop()
            flight.result()
            vehicle.until(lambda v: v.failsafes)
            assert vehicle.mode == GUIDED
    assert any("flies on at its last velocity" in event and "GUID_TIMEOUT" in event for event in flight.events)


@pytest.mark.slow
def test_a_hold_for_a_vehicle_that_is_silent_for_good_is_given_up(vehicle, clock):
    with Flight(vehicle, PATH, clock, give_up=5.0) as flight:
        fly_until(flight, vehicle)
        vehicle.beats = vehicle.positions = False
        with pytest.raises(FlightError, match="silent for 1 s; the vehicle has been silent for 5 s, so the hold"):
            flight.result()


def test_who_never_led_falls_silent_beside_another_streamer(vehicle, clock):
    vehicle.enter()
    with Flight(vehicle, PATH, clock) as flight:
        vehicle.until(lambda v: streamed(v, 2.5))
        vehicle.body.position = [0.0, 9.0, -1.5]
        with pytest.raises(FlightError, match="from the start"):
            flight.result()
    assert vehicle.mode == OFFBOARD and stands_still(sent(vehicle))


def test_a_vehicle_that_has_just_booted_is_waited_for(vehicle, clock):
    vehicle.positions = False
    with Flight(vehicle, PATH, clock, wait=60.0) as flight:
        vehicle.until(lambda v: sum(c[0] == 511 for c in v.commands) >= 2)
        vehicle.positions = True
        vehicle.until(lambda v: "ready" in flight.events)


@pytest.mark.slow
def test_a_refused_take_off_is_repeated_in_silence(clock):
    ground = PointMass((0.0, 0.0, 0.0))
    with StandIn(autopilot="ardupilot", clock=clock, body=ground, armed=False) as vehicle:
        with Flight(vehicle, PATH, clock, arm=True, land=True) as flight:
            assert flight.result().completed
        assert [c[0] for c in vehicle.commands].count(22) >= 2
    assert not any("refused" in event for event in flight.events)


@pytest.mark.slow
def test_a_take_off_that_stays_refused_is_reported(clock):
    ground = PointMass((0.0, 0.0, 0.0))
    with StandIn(autopilot="ardupilot", clock=clock, body=ground, armed=False, refused_takeoffs=99) as vehicle:
        with Flight(vehicle, PATH, clock, arm=True, wait=10.0) as flight:
            with pytest.raises(FlightError, match=r"it refused command 22 \(take off\) with result 4 \(failed\)"):
                flight.result()
            assert vehicle.mode == COPTER_LAND and any("told to land" in event for event in flight.events)
    assert "the vehicle has refused command 22 (take off) with result 4 (failed) 5 times" in flight.events


def test_the_rules_do_not_look_at_a_start_that_nobody_bounds():
    blind = SafetyRules(max_start_distance=np.inf)
    sequence = Sequence(TABLE, COPTER, StreamOptions(trigger=bool, rules=blind), 0.0)
    unseen = replace(HERE, autopilot=3, custom_mode=4, position=None)
    for slot in range(1, 60):
        seen = replace(unseen, heard=slot / 20, heartbeat=slot / 20)
        sequence.step(Conditions(slot, slot / 20, seen))
    assert sequence.phase is Phase.FLYING
