"""Where and how a flight may begin: near the start, where the vehicle is, from the ground, with what the file has."""

import numpy as np
import pytest
from flying import PATH, START, Flight, excursion, in_ned, patient_rules
from pilot import commanded, fly_until, places, sent, streamed
from standin import LAND, OFFBOARD, POSCTL, PointMass, StandIn, mavlink

from minsnap import write_csv
from minsnap.errors import FlightError
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import StreamOptions


def test_a_start_too_far_is_refused_before_anything_is_sent(vehicle, clock):
    vehicle.body.position = [0.0, 4.0, -1.5]
    with Flight(vehicle, PATH, clock) as flight:
        with pytest.raises(FlightError, match=r"4\.00 m from the start, .*--origin current.*nothing was sent"):
            flight.result()
    assert vehicle.setpoints == []


def test_a_vehicle_carried_away_before_the_start_is_refused_before_it_can_enter_the_mode(vehicle, clock):
    with Flight(vehicle, PATH, clock) as flight:
        vehicle.until(lambda v: streamed(v, 2.5))
        vehicle.body.position = [0.0, 4.0, -1.5]
        with pytest.raises(FlightError, match=r"4\.00 m from the start"):
            flight.result()
    assert set(map(tuple, places(vehicle))) == {START}


@pytest.mark.slow
def test_without_a_position_nothing_is_flown_unless_asked_for(vehicle, clock):
    vehicle.positions = False
    with Flight(vehicle, PATH, clock) as flight, pytest.raises(FlightError, match="does not report LOCAL_POSITION_NED"):
        flight.result()
    with Flight(vehicle, PATH, clock, rules=patient_rules(max_start_distance=np.inf)) as flight:
        fly_until(flight, vehicle)


@pytest.mark.slow
def test_relative_flights_start_where_the_vehicle_is_when_it_enters_the_mode(vehicle, clock):
    vehicle.body.position = [5.0, -3.0, -2.0]
    with Flight(vehicle, PATH, clock, relative=True, relative_height=True) as flight:
        vehicle.until(lambda v: streamed(v, 2.5))
        vehicle.body.position = [6.0, -3.0, -2.0]
        vehicle.until(lambda v: flight.statuses[-1].setpoint.position[0] == 6.0)
        fly_until(flight, vehicle)
    moved = places(vehicle)[-1] - [6.0, -3.0, -2.0]
    flown = np.array([in_ned(p) for p in PATH.position]) - START
    assert np.abs(flown - moved).sum(axis=1).min() < 1e-5


@pytest.mark.slow
def test_arming_flying_and_landing_without_a_pilot(clock):
    with StandIn(clock=clock, body=PointMass((0.0, 0.0, 0.0)), armed=False) as vehicle:
        rules = patient_rules(max_start_distance=0.5)
        with Flight(vehicle, PATH, clock, rules=rules, arm=True, land=True) as flight:
            report = flight.result()
        assert report.completed
        assert [c[0] for c in commanded(vehicle)] == [176, 400, 21]
        assert not vehicle.failsafes and not vehicle.armed or vehicle.mode == LAND


@pytest.mark.slow
def test_ardupilot_takes_off_in_silence_and_flies_in_guided(clock):
    ground = PointMass((0.0, 0.0, 0.0))
    with StandIn(autopilot="ardupilot", clock=clock, body=ground, armed=False) as vehicle:
        with Flight(vehicle, PATH, clock, arm=True, land=True) as flight:
            assert flight.result().completed
        told = commanded(vehicle)
        names = [c[0] for c in told]
        assert sorted(set(names), key=names.index) == [176, 400, 22, 21] and not vehicle.failsafes
        assert told[0][1:3] == (1.0, 4.0) and told[names.index(22)][3] == 1.5
        assert mavlink.MAVLINK_MSG_ID_CURRENT_MODE not in vehicle.asked, "it says so to a pilot"


def test_an_autopilot_that_will_not_arm_is_told_and_left(vehicle, clock):
    vehicle._obey = lambda message: vehicle.commands.append((message.command,))
    with Flight(vehicle, PATH, clock, arm=True, wait=3.0) as flight, pytest.raises(FlightError, match="not armed"):
        flight.result()


@pytest.mark.slow
def test_two_laps_repeat_the_rows_without_a_pause(vehicle, clock):
    with Flight(vehicle, excursion(4.0), clock, laps=2) as flight:
        fly_until(flight, vehicle)
        vehicle.until(lambda v: "holding the end" in flight.events)
        vehicle.enter(POSCTL)
        report = flight.result()
    assert 161 - report.schedule.skipped <= report.flown <= 161


def test_missing_velocities_are_said_and_masked(vehicle, clock):
    bare = type(PATH)(PATH.t, PATH.position)
    with Flight(vehicle, bare, clock) as flight:
        vehicle.until(lambda v: streamed(v, 1))
    assert any("no velocity, acceleration, yaw, yaw_rate: streaming position" in event for event in flight.events)
    assert {m.type_mask for m in sent(vehicle)} == {0x0DF8}


def test_an_inconsistent_file_is_refused():
    with pytest.raises(FlightError, match="not fit to fly: x and vx disagree"):
        prepare(type(PATH)(PATH.t, PATH.position, 3.6 * PATH.velocity), StreamOptions())


def test_a_fault_is_told_of_the_columns_of_the_file(tmp_path):
    """In the axes of NED, vx was said where vy is wrong."""
    velocity = PATH.velocity * [3.6, 1.0, 1.0]
    write_csv(type(PATH)(PATH.t, PATH.position, velocity), tmp_path / "a.csv", frame="ned")
    with pytest.raises(FlightError, match="not fit to fly: y and vy disagree"):
        prepare(tmp_path / "a.csv", StreamOptions())


def test_setpoints_name_the_vehicle_and_the_frame(vehicle, clock):
    with Flight(vehicle, PATH, clock):
        vehicle.until(lambda v: streamed(v, 1))
    message = sent(vehicle)[0]
    assert (message.target_system, message.target_component, message.coordinate_frame) == (1, 1, 1)
    assert (message.get_srcSystem(), message.get_srcComponent()) == (245, 191)
    assert OFFBOARD == 0x60000
