"""Changes of plan while a stand-in autopilot flies them: taken at the splice, refused when late, and followed."""

import threading

import numpy as np
import pytest
from flying import Flight, in_ned, patient_rules
from pilot import places
from standin import POSCTL, PointMass, StandIn

import minsnap
from minsnap.errors import FlightError, TimingError
from minsnap.replanning.memory import Change
from minsnap.replanning.replanner import Replanner
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1.5), (3, 0, 1.5), (6, 0, 1.5)], dtype=float)
LIMITS = minsnap.Limits(speed=1.5, acceleration=2.0)


@pytest.fixture
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=1.0, pieces=1)


@pytest.fixture
def vehicle(clock):
    with StandIn(clock=clock, body=PointMass(in_ned(POINTS[0]))) as standin:
        yield standin


def in_flight(vehicle, flight):
    """Let the flight begin and return when its first setpoints were sent."""
    vehicle.until(lambda v: len(v.setpoints) > 50)
    vehicle.enter()
    vehicle.until(lambda v: (flight.streamer.now or 0.0) > 0.3)


def detour(flown, splice):
    """A change to another goal, from a splice on."""
    state = {name: flown(splice, order) for order, name in enumerate(("position", "velocity", "acceleration", "jerk"))}
    points = np.array([state["position"], (4.0, 2.0, 1.5)])
    curve = minsnap.plan(points, durations=[4.0], start=state)
    return Change(curve, splice, curve, False)


@pytest.mark.slow
def test_a_change_is_flown_from_its_splice_to_its_own_goal(vehicle, clock, flown):
    with Flight(vehicle, flown.sample(20.0), clock) as flight:
        in_flight(vehicle, flight)
        splice = flight.streamer.now + 0.8
        change = detour(flown, splice)
        assert flight.streamer.change(change) is change.trajectory
        vehicle.until(lambda v: "holding the end" in flight.events)
        goal = places(vehicle)[-1]
        vehicle.enter(POSCTL)
        report = flight.result()
    assert report.completed and report.worst_error < 0.6
    assert goal == pytest.approx(in_ned((4.0, 2.0, 1.5)), abs=1e-5)
    steps = np.abs(np.diff(np.array(places(vehicle)), axis=0)).max(axis=1)
    assert steps.max() < 1.5 * 1.6 / 20.0 * (1 + report.schedule.skipped)


@pytest.mark.slow
def test_late_changes_and_jumps_are_refused_and_the_flight_goes_on(vehicle, clock, flown):
    with Flight(vehicle, flown.sample(20.0), clock) as flight:
        with pytest.raises(FlightError, match="not flying this stream"):
            flight.streamer.change(detour(flown, 0.5))
        in_flight(vehicle, flight)
        with pytest.raises(TimingError, match=r"s ago: it is too late"):
            flight.streamer.change(detour(flown, 0.05))
        with pytest.raises(FlightError, match="m from the setpoint at its splice"):
            flight.streamer.change(Change(detour(flown, 5.0).trajectory, flight.streamer.now + 1.0, None, False))
        with pytest.raises(FlightError, match="not certified and has no stop"):
            flight.streamer.change(Change(flown, 2.0, None, True, certified=False, no_stop="walls"))
        vehicle.until(lambda v: "holding the end" in flight.events)
        vehicle.enter(POSCTL)
        assert flight.result().completed


@pytest.mark.slow
def test_a_change_that_is_not_certified_flies_its_stop(vehicle, clock, flown):
    with Flight(vehicle, flown.sample(20.0), clock) as flight:
        in_flight(vehicle, flight)
        splice = splice_of(flown, flight.streamer.now + 0.2, 0.6, 4)
        state = {name: splice.state[k] for k, name in enumerate(("position", "velocity", "acceleration", "jerk"))}
        end = splice.state[0] + splice.state[1]
        stop = minsnap.plan([splice.state[0], end], durations=[2.0], start=state)
        change = Change(splice.rest, splice.instant, stop, True, certified=False)
        assert flight.streamer.change(change) is stop
        vehicle.until(lambda v: "holding the end" in flight.events)
        assert places(vehicle)[-1] == pytest.approx(in_ned(end), abs=1e-5)
        vehicle.enter(POSCTL)
        assert flight.result().completed


@pytest.mark.slow
def test_the_rules_of_safety_stop_a_changed_flight_too(vehicle, clock, flown):
    with Flight(vehicle, flown.sample(20.0), clock, rules=patient_rules(abort_distance=1.0), delay=0.2) as flight:
        in_flight(vehicle, flight)
        flight.streamer.change(detour(flown, flight.streamer.now + 0.6))
        vehicle.moves = False
        vehicle.until(lambda v: flight.statuses[-1].phase.value == "holding")
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError, match="from its setpoint, more than the 1 m allowed"):
            flight.result()


@pytest.mark.slow
def test_a_moving_goal_is_followed_by_replans_from_another_thread(vehicle, clock, flown):
    """The goal moves sideways while the vehicle flies; a thread replans it some 5 times a second of the flight."""
    replanner = Replanner(LIMITS, 1.0, clock=clock.now)
    goal, current, taken, done = np.array(POINTS[-1]), [flown], [], threading.Event()

    def follow(flight):
        while not done.is_set():
            clock.wait(clock.now() + 0.2)
            now = flight.streamer.now
            if now is None or now > current[0].duration - 1.5:
                break
            goal[1] = min(goal[1] + 0.02, 0.6)
            try:
                change = replanner.replan(current[0], now, goal[None], 1.2)
                current[0] = flight.streamer.change(change)
                taken.append(change)
            except (TimingError, FlightError):
                continue
        clock.leave()

    one_leg = minsnap.plan(POINTS[[0, 2]], limits=LIMITS, corridor=1.0)
    current[0] = one_leg
    with Flight(vehicle, one_leg.sample(20.0), clock) as flight:
        in_flight(vehicle, flight)
        follower = threading.Thread(target=follow, args=(flight,))
        clock.enter()
        follower.start()
        try:
            vehicle.until(lambda v: "holding the end" in flight.events)
        finally:
            done.set()
            while follower.is_alive():
                clock.wait(clock.now() + 0.01)
        end = places(vehicle)[-1]
        vehicle.enter(POSCTL)
        report = flight.result()
    assert report.completed
    assert any(not change.kept for change in taken)
    assert end == pytest.approx(in_ned(current[0](current[0].duration)), abs=1e-5)
