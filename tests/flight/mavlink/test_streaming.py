"""Whole flights against a stand-in that speaks MAVLink by pymavlink's own connections: every rule is seen to act."""

import pytest
from flying import PATH, Flight, patient_rules
from pilot import commanded, fly_until, places, sent, stands_still, streamed
from standin import POSCTL, mavlink

from minsnap.cli.app import exit_status
from minsnap.errors import FlightError


@pytest.mark.slow
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
    assert len(PATH) - report.schedule.skipped <= report.flown <= len(PATH)
    assert report.rmse < 0.1 and report.worst_error < 0.4
    assert vehicle.failsafes == [] and commanded(vehicle) == []
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
    assert exit_status(caught.value) == 1


@pytest.mark.slow
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


@pytest.mark.slow
def test_silence_stops_and_holds(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.beats = vehicle.positions = False
        stopped(flight, vehicle, "the link was silent for 1 s")
        vehicle.beats = vehicle.positions = True
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError, match="silent"):
            flight.result()


@pytest.mark.slow
def test_heartbeats_that_stop_leave_the_mode_unknown(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        fly_until(flight, vehicle)
        vehicle.beats = False
        stopped(flight, vehicle, "no heartbeat for 3 s")


@pytest.mark.slow
def test_a_position_that_is_not_reported_any_more_stops_the_flight(vehicle, clock):
    with Flight(vehicle, PATH, clock, rules=patient_rules(link_timeout=1.5)) as flight:
        fly_until(flight, vehicle)
        vehicle.positions = False
        stopped(flight, vehicle, "position was not reported for 1.5 s")


def test_a_vehicle_that_does_not_follow_is_held_where_it_is(vehicle, clock):
    with Flight(vehicle, PATH, clock, rules=patient_rules(abort_distance=0.5), delay=0.1) as flight:
        fly_until(flight, vehicle, beyond=1.0)
        vehicle.moves = False
        hold = stopped(flight, vehicle, "from its setpoint, more than the 0.5 m allowed")
    assert (hold.x, hold.y, hold.z) == pytest.approx(tuple(vehicle.body.position), abs=1e-5)


@pytest.mark.slow
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
        assert flight.result().reason == "stopped by the user"


@pytest.mark.slow
@pytest.mark.parametrize("failure", [RuntimeError("the display broke"), KeyboardInterrupt()])
def test_a_failure_of_our_own_stops_and_holds(vehicle, clock, failure):
    with Flight(vehicle, PATH, clock) as flight:
        append = flight.statuses.append

        def break_once(status):
            append(status)
            if status.elapsed > 2.0 and not flight.broken:
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


def test_control_characters_of_a_vehicle_do_not_reach_the_terminal_or_the_log(vehicle, clock, tmp_path):
    alarm = mavlink.MAVLink_statustext_message(4, b"\x1b[2Jlow\nbattery\x07")
    vehicle.telemetry = [alarm]
    with Flight(vehicle, PATH, clock, log=tmp_path / "log.csv") as flight:
        vehicle.until(lambda v: streamed(v, 1))
    assert "vehicle: [2Jlowbattery" in flight.events
    assert not set("\x1b\x07") & set((tmp_path / "log.csv").read_text())
