"""Setpoints that offset drag and delay: what is added and when it is sent, what is refused, the gain in simulation."""

import numpy as np
import pytest
from flying import PATH, Flight
from pilot import sent, streamed

import minsnap
from minsnap.errors import InputError
from minsnap.flight import CascadeController, simulate
from minsnap.flight.mavlink.compensation import FeedForward
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor


def test_linear_drag_is_added_to_the_acceleration_and_nothing_else_changes():
    added = FeedForward(drag=0.4).applied(PATH)
    np.testing.assert_array_equal(added.acceleration, PATH.acceleration + 0.4 * PATH.velocity)
    for name in ("t", "position", "velocity", "yaw", "yaw_rate"):
        np.testing.assert_array_equal(getattr(added, name), getattr(PATH, name))


def test_a_vehicle_with_linear_drag_adds_the_same():
    craft = Quadrotor.px4_sih()
    assert craft.mass == 1.0
    by_vehicle, by_number = FeedForward(vehicle=craft).applied(PATH), FeedForward(drag=1.0).applied(PATH)
    np.testing.assert_allclose(by_vehicle.acceleration, by_number.acceleration, atol=1e-12)


def test_a_lead_sends_what_comes_later_and_holds_the_end_at_rest():
    led = FeedForward(lead=0.1).applied(PATH)
    for name in ("position", "velocity", "acceleration", "yaw", "yaw_rate"):
        np.testing.assert_allclose(getattr(led, name)[:-3], getattr(PATH, name)[2:-1], atol=1e-12)
        np.testing.assert_allclose(getattr(led, name)[-2:] - getattr(PATH, name)[-1], 0.0, atol=1e-12)
    assert not FeedForward().given and FeedForward().applied(PATH) is PATH


def test_between_samples_the_lead_interpolates_with_all_derivatives():
    path = minsnap.circle(radius=2.0, period=6.0)
    samples = path.sample(20.0)
    led = FeedForward(lead=0.137).applied(samples)
    inside = samples.t + 0.137 < path.duration
    assert np.abs(led.position[inside] - path(samples.t[inside] + 0.137)).max() < 1e-6


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"drag": -1.0}, "the drag is -1.0 1/s"),
        ({"drag": np.nan}, "it must be 0 or more"),
        ({"drag": 1.0, "vehicle": Quadrotor.px4_sih()}, "give one of them"),
        ({"lead": 0.6}, "between 0 and 0.5 s"),
        ({"lead": -0.1}, "between 0 and 0.5 s"),
    ],
)
def test_what_makes_no_sense_is_refused(bad, says):
    with pytest.raises(InputError, match=says):
        FeedForward(**bad)


def test_without_velocity_drag_is_not_known_and_a_lead_takes_one_lap():
    with pytest.raises(InputError, match="has no velocity"):
        prepare(Samples(PATH.t, PATH.position), StreamOptions(feed_forward=FeedForward(drag=1.0)))
    with pytest.raises(InputError, match="fly one lap"):
        prepare(PATH, StreamOptions(feed_forward=FeedForward(lead=0.1), laps=2))


def test_what_is_added_is_said_and_sent(vehicle, clock):
    with Flight(vehicle, PATH, clock, feed_forward=FeedForward(drag=0.5, lead=0.1)) as flight:
        vehicle.until(lambda v: streamed(v, 1))
        assert any(event.startswith("drag offset by up to") and "100 ms ahead" in event for event in flight.events)
    table = flight.streamer._table
    middle = len(PATH) // 3
    row = table[middle]
    later = PATH.acceleration[middle + 2] + 0.5 * PATH.velocity[middle + 2]
    np.testing.assert_allclose((row.acceleration[1], row.acceleration[0], -row.acceleration[2]), later, atol=1e-9)
    assert sent(vehicle)


@pytest.mark.slow
@pytest.mark.parametrize("time", [24.0, 12.0])
def test_in_simulation_the_recorded_gain_is_reached(time):
    """Recorded on PX4 with 20 Hz setpoints: 0.607 to 0.228 m in 24 s, 1.127 to 0.459 m in 12 s (docs/vehicle.rst)."""
    corners = [(0, 0, 2), (8, 0, 2), (8, 4, 2), (0, 4, 2), (0, 0, 2)]
    path, craft = minsnap.plan(corners, total_time=time, corridor=0.3), Quadrotor.px4_sih()
    samples = path.sample(20.0)

    def error(added):
        flight = simulate(craft, CascadeController(), added.applied(samples), setpoint_delay=0.1)
        held = path(np.minimum(np.floor(flight.t * 20.0 + 1e-6) / 20.0, path.duration))
        return np.sqrt(np.mean(np.sum((flight.position - held) ** 2, axis=1)))

    plain = error(FeedForward())
    assert plain == pytest.approx({24.0: 0.607, 12.0: 1.127}[time], rel=0.2)
    assert error(FeedForward(drag=1.0)) < 0.5 * plain
    assert error(FeedForward(drag=1.0, lead=0.2)) < 0.3 * plain
