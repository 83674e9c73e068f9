"""Simulated flights beside those recorded on PX4's simulation in hardware: four courses, as planned and compensated."""

import numpy as np
import pytest

import minsnap
from minsnap.flight import CascadeController, FeedForward, fit_flight, simulate, simulated_log
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

BELOW, CLIMBING, DELAY = 1.0, 0.7, 0.1


def rectangle(width, length, **timing):
    corners = [(0, 0, 2), (width, 0, 2), (width, length, 2), (0, length, 2), (0, 0, 2)]
    return minsnap.plan(corners, corridor=0.3, **timing)


COURSES = {
    "24 s": (lambda: rectangle(8, 4, total_time=24.0), 0.607, 0.228),
    "12 s": (lambda: rectangle(8, 4, total_time=12.0), 1.127, 0.535),
    "9.1 s": (lambda: rectangle(6, 4, limits=minsnap.Limits(speed=3.0, acceleration=6.0), pieces=1), 1.102, 0.700),
    "circle": (lambda: minsnap.circle(radius=3.0, period=6.0), 1.055, 0.707),
}


def flown(sent, plain):
    """Fly setpoints; return the flight and its error to the setpoints that hold."""
    flight = simulate(Quadrotor.px4_sih(), CascadeController(), sent, setpoint_delay=DELAY)
    held = plain.position[np.clip(((flight.t - sent.lead) * 20.0 + 1e-6).astype(int), 0, len(plain) - 1)]
    return flight, float(np.sqrt(np.mean(np.sum((flight.position - held) ** 2, axis=1))))


def climbing(samples):
    """The same setpoints for a vehicle that begins below the first one, and climbs, as the recorded ones did."""
    place, velocity = samples.position.copy(), samples.velocity.copy()
    place[0, 2] -= BELOW
    velocity[0, 2] = CLIMBING
    return Samples(samples.t, place, velocity, samples.acceleration, feed_forward=samples.feed_forward)


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_errors_are_within_a_fifth_of_the_recorded_ones(name):
    make, without, compensated = COURSES[name]
    plain = make().sample(20.0)
    stated = FeedForward(drag=1.0).stated(plain)
    assert flown(climbing(plain), plain)[1] == pytest.approx(without, rel=0.2)
    assert flown(climbing(stated), plain)[1] == pytest.approx(compensated, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_the_loop_takes_off_more_than_half(name):
    plain = COURSES[name][0]().sample(20.0)
    vehicle = Quadrotor.px4_sih()
    first, before = flown(plain, plain)
    fitted = fit_flight(simulated_log(vehicle, first, plain)).vehicle()
    second, _ = flown(FeedForward(vehicle=fitted).stated(plain), plain)
    lead = fit_flight(simulated_log(vehicle, second, plain)).delay.value
    assert 0.05 < lead < 0.4
    assert flown(FeedForward(vehicle=fitted, lead=lead).stated(plain), plain)[1] < 0.5 * before
