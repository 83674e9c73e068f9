"""PX4 1.17 and ArduCopter 4.7 from the ground, in a noisy hover and after a stop: nobody hovers until someone acts."""

import numpy as np
import pytest
from flying import PATH, START, Flight, patient_rules
from pilot import commanded, fly_until, places, streamed
from standin import BRAKE, HOLD, LAND, PointMass, StandIn, mavlink

import minsnap
from minsnap.errors import FlightError
from minsnap.files.consistency import check_samples
from minsnap.files.frames import map_samples
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.trajectory.samples import Samples


def mission():
    """Up from the ground, a little way at two metres, and there to hover."""
    stops = tuple(minsnap.Stop(point) for point in ((0, 0, 2), (3, 0, 2), (3, 2, 2.5)))
    limits = minsnap.Limits(speed=2, acceleration=2, jerk=20)
    return minsnap.plan_mission(minsnap.Course(stops, takeoff=True, limits=limits)).trajectory.sample(20.0)


MISSION = mission()


def test_a_climb_is_known_and_begins_higher_where_an_autopilot_takes_off_by_itself():
    plain = prepare(MISSION, StreamOptions())
    assert plain.climb == pytest.approx(2.0, abs=0.05) and prepare(PATH, StreamOptions()).climb < 0.1
    lifted = plain.lifted(0.5)
    heights = -lifted.rows[:, 2]
    assert heights[0] == 0.5 and heights[: len(heights) // 3].min() > 0.35, "it hardly goes down"
    same = -plain.rows[:, 2] >= 1.0
    assert same.any() and np.array_equal(lifted.rows[same], plain.rows[same])
    motion = [lifted.rows[:, 3 * k : 3 * k + 3] for k in range(3)]
    assert check_samples(map_samples(Samples(MISSION.t, *motion), "ned", "enu")).ok
    assert abs(lifted.rows[:, 8]).max() < 2.0 * abs(plain.rows[:, 8]).max()


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.0, 0.4, -0.5])
def test_px4_leaves_the_ground_where_its_estimate_has_it(clock, height):
    """Its height on the ground is off the file's 0 by some decimetres: it was armed there until it disarmed itself."""
    ground = PointMass((0.0, 0.0, -height))
    with StandIn(clock=clock, body=ground, floor=-height, armed=False, shakes=0.12) as vehicle:
        with Flight(vehicle, MISSION, clock, arm=True, land=True, trigger="now") as flight:
            assert flight.result().completed
        assert vehicle.failsafes == [] and [c[0] for c in commanded(vehicle)][:2] == [176, 400]
    begun = next(t for t, m in vehicle.setpoints if m.vz)
    assert begun - vehicle.armed_at < 3.0
    track = places(vehicle)
    assert track[0, 2] == pytest.approx(-height, abs=0.13) and track[-1, 2] - track[0, 2] == pytest.approx(
        -2.5, abs=0.2
    )
    assert any("begins on the ground" in event for event in flight.events)


@pytest.mark.slow
def test_it_is_armed_once_the_trigger_lets_it_go(clock):
    """Armed before it, it stood there until it disarmed itself."""
    pressed = []
    with StandIn(clock=clock, body=PointMass((0.0, 0.0, 0.0)), armed=False) as vehicle:
        with Flight(vehicle, MISSION, clock, arm=True, land=True, trigger=lambda: bool(pressed)) as flight:
            vehicle.until(lambda v: streamed(v, 40))
            assert not vehicle.armed and [c[0] for c in commanded(vehicle)] == [176]
            pressed.append(True)
            assert flight.result().completed and vehicle.failsafes == []


@pytest.mark.slow
def test_arducopter_takes_off_and_joins_a_mission_from_the_ground(clock):
    """No take-off was commanded: it idled on the ground for two metres of the plan."""
    with StandIn(
        autopilot="ardupilot", clock=clock, body=PointMass((0.0, 0.0, -0.2)), floor=-0.2, armed=False
    ) as vehicle:
        with Flight(vehicle, MISSION, clock, arm=True, land=True, trigger="now") as flight:
            report = flight.result()
        told = commanded(vehicle)
    assert report.completed and report.worst_error < 0.3 and vehicle.failsafes == []
    assert next(c[3] for c in told if c[0] == 22) == pytest.approx(0.5, abs=1e-6)
    assert places(vehicle)[0, 2] == pytest.approx(-0.7, abs=1e-5) and report.flown == len(MISSION)
    assert any("it takes off by itself, to 0.5 m" in event for event in flight.events)


def test_arducopter_is_not_let_go_on_the_ground_without_arming(clock):
    with StandIn(autopilot="ardupilot", clock=clock, body=PointMass((0.0, 0.0, 0.0)), armed=False) as vehicle:
        with (
            Flight(vehicle, MISSION, clock) as flight,
            pytest.raises(FlightError, match="give --arm, or begin in the air"),
        ):
            flight.result()
        assert vehicle.setpoints == []


def test_the_vehicles_height_is_an_origin_for_what_climbs_first(clock):
    with StandIn(clock=clock, body=PointMass((3.0, 1.0, -0.3)), floor=-0.3, armed=False) as vehicle:
        how = {"arm": True, "relative": True, "relative_height": True}
        with Flight(vehicle, PATH, clock, **how) as flight, pytest.raises(FlightError, match="does not climb first"):
            flight.result()
        with Flight(vehicle, MISSION, clock, trigger="now", **how):
            vehicle.until(lambda v: streamed(v, 1))
        assert places(vehicle)[0] == pytest.approx((3.0, 1.0, -0.3), abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("shakes", "begins"), [(0.15, True), (0.7, False)])
def test_a_noisy_hover_widens_the_gate_and_none_that_is_no_hover(clock, shakes, begins):
    with StandIn(clock=clock, body=PointMass((*START[:2], 0.0)), armed=False, shakes=shakes) as vehicle:
        rules = patient_rules(max_start_distance=3.0)
        with Flight(vehicle, PATH, clock, rules=rules, arm=True, land=True, trigger="now", wait=15.0) as flight:
            if begins:
                assert flight.result().completed
                assert any("hovers no nearer to its start than 0." in event for event in flight.events)
                return
            with pytest.raises(FlightError, match="at the start in time: the vehicle is|not at its start within 15 s"):
                flight.result()
        assert vehicle.mode == LAND, "it does not hover there"


STOPS = [
    ("px4", True, {"land": True}, LAND),
    ("px4", True, {}, HOLD),
    ("ardupilot", True, {}, BRAKE),
    ("px4", False, {}, None),
]


@pytest.mark.slow
@pytest.mark.parametrize(("stack", "arm", "given", "mode"), STOPS)
def test_after_a_stop_it_lands_or_hovers_by_itself_and_is_held_where_a_pilot_has_it(clock, stack, arm, given, mode):
    with StandIn(autopilot=stack, clock=clock, body=PointMass(START)) as vehicle:
        rules = patient_rules(abort_distance=0.5)
        with Flight(vehicle, PATH, clock, rules=rules, delay=0.1, arm=arm, **given) as flight:
            if arm:
                vehicle.until(lambda v: any(status.elapsed > 1.0 for status in flight.statuses[-500:]))
            else:
                fly_until(flight, vehicle, beyond=1.0)
            vehicle.moves = False
            if mode is not None:
                with pytest.raises(FlightError, match="from its setpoint"):
                    flight.result()
                assert vehicle.mode == mode and any("the vehicle is told to" in event for event in flight.events)
                return
            vehicle.until(lambda v: any(event.endswith("; holding") for event in flight.events))
            now = len(vehicle.setpoints)
            vehicle.until(lambda v: len(v.setpoints) > now + 300)
            assert commanded(vehicle) == []


@pytest.mark.slow
@pytest.mark.parametrize("gone", [0.2, 0.12])
def test_a_mode_of_a_fifth_of_a_second_is_seen_though_heartbeats_are_refused(clock, gone):
    with StandIn(clock=clock, body=PointMass(START), beat_period=1.0) as vehicle:
        with Flight(vehicle, PATH, clock) as flight:
            fly_until(flight, vehicle)
            vehicle.enter(vehicle.other)
            back = clock.now() + gone
            vehicle.until(lambda v: clock.now() > back)
            vehicle.enter()
            vehicle.until(lambda v: any("stopped: the vehicle left OFFBOARD" in event for event in flight.events))
        assert not any("is not seen" in event for event in flight.events)


def disturb(vehicle, clock, until, shift):
    """Send setpoints beside those that come, some metres off them, until something is true."""
    strays = set()
    while not until():
        m = next(m for _, m in reversed(vehicle.setpoints) if id(m) not in strays)
        place = [a + b for a, b in zip((m.x, m.y, m.z), shift, strict=True)]
        stray = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, *place, *(0.0,) * 8)
        strays.add(id(stray))
        vehicle.setpoints.append((clock.now(), stray))
        clock.wait(clock.now() + 0.013, [])


@pytest.mark.slow
def test_a_second_program_is_refused_and_one_that_comes_all_the_same_is_said(clock):
    """Two programs led one vehicle, and neither said a word."""
    with (
        StandIn(clock=clock, body=PointMass(START), beat_period=0.21) as vehicle,
        Flight(vehicle, PATH, clock) as first,
    ):
        fly_until(first, vehicle)
        with Flight(vehicle, PATH, clock, trigger="now", relative=True) as second:
            with pytest.raises(FlightError, match="another program sends setpoints to this vehicle: it is in OFFBOARD"):
                second.result()
        vehicle.until(lambda v: "holding the end" in first.events)
        said = "while it is held here"
        disturb(vehicle, clock, lambda: any(said in event for event in first.events), (5.0, 5.0, -5.0))
    assert any("another program sends setpoints to this vehicle too" in event for event in first.events)


@pytest.mark.slow
def test_a_program_that_sends_too_stops_the_flight(clock):
    with StandIn(clock=clock, body=PointMass(START), beat_period=0.21) as vehicle:
        with Flight(vehicle, PATH, clock, land=True) as flight:
            fly_until(flight, vehicle, beyond=1.0)
            disturb(vehicle, clock, lambda: vehicle.mode == LAND, (1.6, 0.0, 0.0))
            with pytest.raises(FlightError, match="another program sends setpoints to this vehicle too"):
                flight.result()
