"""Whole flights against a stand-in that speaks MAVLink by pymavlink's own connections: every rule is seen to act."""

import numpy as np
import pytest
from clocks import FastClock
from flying import Flight, excursion, in_ned
from standin import LAND, OFFBOARD, POSCTL, PointMass, StandIn

from minsnap.errors import FlightError
from minsnap.flight.offboard import prepare
from minsnap.flight.options import StreamOptions
from minsnap.flight.safety import SafetyRules

SPEED = 8
PATH = excursion(6.0, reach=2.5)
START = in_ned(PATH.position[0])


@pytest.fixture
def clock():
    return FastClock(SPEED)


@pytest.fixture
def vehicle(clock):
    with StandIn(clock=clock.now, body=PointMass(START)) as standin:
        yield standin


def sent(vehicle):
    return [message for _, message in vehicle.setpoints]


def places(vehicle):
    return np.array([(m.x, m.y, m.z) for m in sent(vehicle)])


def stands_still(messages):
    return all((m.vx, m.vy, m.vz, m.afx, m.afy, m.afz, m.yaw_rate) == (0,) * 7 for m in messages)


def streamed(vehicle, seconds):
    return len(vehicle.setpoints) > 20 * seconds


def in_flight(flight, beyond=2.0):
    return bool(flight.statuses) and flight.statuses[-1].elapsed > beyond


def test_a_whole_flight_waits_flies_holds_and_ends_when_the_pilot_takes_over(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        vehicle.until(lambda v: streamed(v, 3))
        assert len(set(map(tuple, places(vehicle)))) == 1 and stands_still(sent(vehicle))
        vehicle.enter()
        vehicle.until(lambda v: "holding the end" in flight.events)
        held = len(vehicle.setpoints)
        vehicle.until(lambda v: len(v.setpoints) > held + 40)
        vehicle.enter(POSCTL)
        report = flight.result()
    assert report.completed and report.reason is None
    assert report.flown == len(PATH)
    assert report.rmse < 0.1 and report.worst_error < 0.4
    assert vehicle.failsafes == [] and vehicle.commands[0][0] == 511 and len(vehicle.commands) == 1
    assert stands_still(sent(vehicle)[held:])


def test_nothing_moves_before_two_seconds_of_stream(vehicle, clock):
    vehicle.enter()
    with Flight(vehicle, PATH, clock, trigger="now") as flight:
        vehicle.until(lambda v: len(v.setpoints) > 60)
        flight.stop()
        vehicle.until(lambda v: flight.statuses[-1].phase.value == "holding")
    first = next(t for t, m in vehicle.setpoints if abs(m.vx) + abs(m.vy) > 1e-6)
    assert first - vehicle.setpoints[0][0] >= 1.95


def test_a_mode_entered_before_we_came_is_no_trigger(vehicle, clock):
    vehicle.enter()
    with Flight(vehicle, PATH, clock) as flight:
        vehicle.until(lambda v: streamed(v, 4))
        assert flight.statuses[-1].phase.value == "ready"
        vehicle.enter(POSCTL)
        vehicle.until(lambda v: streamed(v, 6))
        vehicle.enter()
        vehicle.until(lambda v: "flying" in flight.events)


def test_a_callable_triggers_and_waits_for_the_mode(vehicle, clock):
    pressed = []
    with Flight(vehicle, PATH, clock, trigger=lambda: bool(pressed)) as flight:
        vehicle.until(lambda v: streamed(v, 3))
        pressed.append(True)
        vehicle.until(lambda v: streamed(v, 4))
        assert "flying" not in flight.events
        vehicle.enter()
        vehicle.until(lambda v: "flying" in flight.events)


def fly_until(flight, vehicle, beyond=2.0):
    vehicle.until(lambda v: "ready" in flight.events)
    vehicle.enter()
    vehicle.until(lambda v: in_flight(flight, beyond))


def stopped(flight, vehicle, because):
    """The flight holds, for the reason given, and goes on holding; then the pilot ends it."""
    vehicle.until(lambda v: any(because in event for event in flight.events))
    now = len(vehicle.setpoints)
    vehicle.until(lambda v: len(v.setpoints) > now + 30)
    hold = sent(vehicle)[now + 2 :]
    assert stands_still(hold) and len({(m.x, m.y, m.z, m.yaw) for m in hold}) == 1
    assert not vehicle.failsafes
    return hold[-1]


def test_leaving_the_mode_stops_holds_and_ends(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError, match="left OFFBOARD") as caught:
            flight.result()
    left = vehicle.modes[-1][0]
    after = [(t, m) for t, m in vehicle.setpoints if t > left + 0.5]
    assert stands_still([m for _, m in after])
    assert after[-1][0] > left + 0.9, "the hold goes on for a while after the mode is left"
    assert not caught.value.report.completed and 0 < caught.value.report.flown < len(PATH)
    assert caught.value.exit_status == 1


def test_a_mode_that_comes_back_meets_a_hold_not_the_rest_of_the_flight(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.enter(POSCTL)
        vehicle.until(lambda v: any("left OFFBOARD" in event for event in flight.events))
        vehicle.enter()
        stopped(flight, vehicle, "left OFFBOARD")
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError):
            flight.result()


def test_silence_stops_and_holds(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.beats = vehicle.positions = False
        stopped(flight, vehicle, "the link was silent for 1 s")
        vehicle.beats = vehicle.positions = True
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError, match="silent"):
            flight.result()


def test_heartbeats_that_stop_leave_the_mode_unknown(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.beats = False
        stopped(flight, vehicle, "no heartbeat for 3 s")


def test_a_position_that_is_not_reported_any_more_stops_the_flight(vehicle, clock):
    with Flight(vehicle, PATH, clock, rules=SafetyRules(link_timeout=1.5)) as flight:
        fly_until(flight, vehicle)
        vehicle.positions = False
        stopped(flight, vehicle, "position was not reported for 1.5 s")


def test_a_vehicle_that_does_not_follow_is_held_where_it_is(vehicle, clock):
    with Flight(vehicle, PATH, clock, rules=SafetyRules(abort_distance=0.5)) as flight:
        fly_until(flight, vehicle, beyond=1.0)
        vehicle.moves = False
        hold = stopped(flight, vehicle, "from its setpoint, more than the 0.5 m allowed")
    assert (hold.x, hold.y, hold.z) == pytest.approx(tuple(vehicle.body.position), abs=1e-5)


def test_stopping_in_flight_holds_until_the_mode_is_left(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        flight.stop()
        stopped(flight, vehicle, "stopped by the user")
        vehicle.enter(POSCTL)
        report = flight.result()
    assert not report.completed and report.reason == "stopped by the user"


def test_stopping_twice_ends_at_once(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        flight.stop()
        stopped(flight, vehicle, "stopped by the user")
        flight.stop()
        assert flight.result(2.0).reason == "stopped by the user"


@pytest.mark.parametrize("failure", [RuntimeError("the display broke"), KeyboardInterrupt()])
def test_a_failure_of_our_own_stops_and_holds(vehicle, clock, failure):
    with Flight(vehicle, PATH, clock) as flight:
        append = flight.statuses.append

        def break_once(status):
            append(status)
            if status.elapsed > 2.5 and not flight.broken:
                flight.broken = True
                raise failure

        flight.broken = False
        flight.streamer._observer._on_status = break_once
        fly_until(flight, vehicle)
        vehicle.until(lambda v: flight.broken)
        now = len(vehicle.setpoints)
        vehicle.until(lambda v: len(v.setpoints) > now + 30)
        assert stands_still(sent(vehicle)[now + 3 :]) and not vehicle.failsafes
        vehicle.enter(POSCTL)
        if isinstance(failure, RuntimeError):
            with pytest.raises(RuntimeError, match="the display broke"):
                flight.result()
        else:
            assert flight.result().reason == "stopped by the user"


def test_a_start_too_far_is_refused_before_anything_is_sent(vehicle, clock):
    vehicle.body.position = [0.0, 4.0, -1.5]
    with Flight(vehicle, PATH, clock) as flight:
        with pytest.raises(FlightError, match=r"4\.00 m from the start, more than the 1 m allowed"):
            flight.result()
    assert vehicle.setpoints == []


def test_a_vehicle_carried_away_before_the_start_is_refused_before_it_can_enter_the_mode(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        vehicle.until(lambda v: streamed(v, 2.5))
        vehicle.body.position = [0.0, 4.0, -1.5]
        with pytest.raises(FlightError, match=r"4\.00 m from the start"):
            flight.result()
    assert set(map(tuple, places(vehicle))) == {START}


def test_without_a_position_nothing_is_flown_unless_asked_for(vehicle, clock):
    vehicle.positions = False
    with Flight(vehicle, PATH, clock) as flight, pytest.raises(FlightError, match="does not report LOCAL_POSITION_NED"):
        flight.result()
    with Flight(vehicle, PATH, clock, rules=SafetyRules(max_start_distance=np.inf)) as flight:
        fly_until(flight, vehicle)


def test_relative_flights_start_where_the_vehicle_is_when_it_enters_the_mode(vehicle, clock):
    vehicle.body.position = [5.0, -3.0, -2.0]
    with Flight(vehicle, PATH, clock, relative=True) as flight:
        vehicle.until(lambda v: streamed(v, 2.5))
        vehicle.body.position = [6.0, -3.0, -2.0]
        vehicle.until(lambda v: flight.statuses[-1].setpoint.position[0] == 6.0)
        fly_until(flight, vehicle)
    moved = places(vehicle)[-1] - [6.0, -3.0, -2.0]
    flown = np.array([in_ned(p) for p in PATH.position]) - START
    assert np.abs(flown - moved).sum(axis=1).min() < 1e-5


def test_arming_flying_and_landing_without_a_pilot(clock):
    with StandIn(clock=clock.now, body=PointMass((0.0, 0.0, 0.0)), armed=False) as vehicle:
        rules = SafetyRules(max_start_distance=0.5)
        with Flight(vehicle, PATH, clock, rules=rules, arm=True, land=True) as flight:
            report = flight.result()
        assert report.completed
        assert [c[0] for c in vehicle.commands] == [511, 176, 400, 21]
        assert not vehicle.failsafes and not vehicle.armed or vehicle.mode == LAND


def test_ardupilot_takes_off_in_silence_and_flies_in_guided(clock):
    ground = PointMass((0.0, 0.0, 0.0))
    with StandIn(autopilot="ardupilot", clock=clock.now, body=ground, armed=False) as vehicle:
        with Flight(vehicle, PATH, clock, arm=True, land=True) as flight:
            assert flight.result().completed
        assert [c[0] for c in vehicle.commands] == [511, 176, 400, 22, 21]
        assert vehicle.commands[1][1:3] == (1.0, 4.0) and vehicle.commands[3][3] == 1.5


def test_an_autopilot_that_will_not_arm_is_told_and_left(vehicle, clock):
    vehicle._obey = lambda message: vehicle.commands.append((message.command,))
    with Flight(vehicle, PATH, clock, arm=True, wait=3.0) as flight, pytest.raises(FlightError, match="not armed"):
        flight.result()


def test_two_laps_repeat_the_rows_without_a_pause(vehicle, clock):
    with Flight(vehicle, excursion(4.0), clock, laps=2) as flight:
        fly_until(flight, vehicle)
        vehicle.until(lambda v: "holding the end" in flight.events)
        vehicle.enter(POSCTL)
        assert flight.result().flown == 161


def test_missing_velocities_are_said_and_masked(vehicle, clock):
    bare = type(PATH)(PATH.t, PATH.position)
    with Flight(vehicle, bare, clock) as flight:
        vehicle.until(lambda v: streamed(v, 1))
    assert any("no velocity, acceleration, yaw, yaw_rate: streaming position" in event for event in flight.events)
    assert {m.type_mask for m in sent(vehicle)} == {0x0DF8}


def test_an_inconsistent_file_is_refused():
    with pytest.raises(FlightError, match="not fit to fly: x and vx disagree"):
        prepare(type(PATH)(PATH.t, PATH.position, 3.6 * PATH.velocity), StreamOptions())


def test_setpoints_name_the_vehicle_and_the_frame(vehicle, clock):
    with Flight(vehicle, PATH, clock):
        vehicle.until(lambda v: streamed(v, 1))
    message = sent(vehicle)[0]
    assert (message.target_system, message.target_component, message.coordinate_frame) == (1, 1, 1)
    assert (message.get_srcSystem(), message.get_srcComponent()) == (245, 191)
    assert OFFBOARD == 0x60000
