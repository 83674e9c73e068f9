import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.errors import InputError
from minsnap.flight import CascadeController, GeometricController, drag_feed_forward, simulate
from minsnap.flight.simulation.controllers import Allocator, Estimate, Reference, desired_axes, heading_axes
from minsnap.flight.thesis import published_drag
from minsnap.vehicle import BodyDrag, Quadrotor, flat_states, flatness_of

F330 = Quadrotor.dji_f330()
LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
REST = Reference((0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0), 0.0, 0.0, (0, 0, 0), (0, 0, 0))
STILL = Estimate((0, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0, 0, 0))


def wrench(controller, estimate: Estimate, reference: Reference, vehicle: Quadrotor = F330) -> np.ndarray:
    """Thrust and torques of the first command."""
    return vehicle.wrench(controller.pilot(vehicle, 0.004).command(estimate, reference).rotor_speed)


CONTROLLERS = [GeometricController(), GeometricController(feed_forward=False), CascadeController()]


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_on_the_reference_at_rest_it_holds_its_weight(controller) -> None:
    np.testing.assert_allclose(wrench(controller, STILL, REST), [F330.weight, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_errors_are_pushed_against(controller) -> None:
    ahead = wrench(controller, STILL, REST._replace(position=(1.0, 0, 0)))
    left = wrench(controller, STILL, REST._replace(position=(0, 1.0, 0)))
    above = wrench(controller, STILL, REST._replace(position=(0, 0, 0.5)))
    turned = wrench(controller, STILL, REST._replace(yaw=0.3))
    assert ahead[2] > 0 and abs(ahead[1]) < 1e-9, "nose down to go forward: positive pitch in z up axes"
    assert left[1] < 0 and abs(left[2]) < 1e-9, "roll to the left"
    assert above[0] > F330.weight and turned[3] > 0


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_command_turns_with_the_world(controller) -> None:
    """The same errors seen from a vehicle and a world turned by 90 degrees give the same command."""
    quarter = (math.sqrt(0.5), 0, 0, math.sqrt(0.5))
    reference = REST._replace(position=(0.3, -0.2, 0.1), velocity=(0.1, 0.2, 0), acceleration=(0.2, 0.1, 0.1))
    turned = reference._replace(
        position=(0.2, 0.3, 0.1), velocity=(-0.2, 0.1, 0), acceleration=(-0.1, 0.2, 0.1), yaw=math.pi / 2
    )
    here = wrench(controller, STILL, reference)
    there = wrench(controller, STILL._replace(quaternion=quarter), turned)
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_lee_on_the_reference_commands_exactly_what_flatness_gives() -> None:
    free = replace(F330, drag=BodyDrag())
    path = minsnap.lemniscate(length=8, width=4, period=5.0)
    t = np.linspace(0.5, path.duration - 0.5, 40)
    flat = flatness_of(free, path, t)
    for index, instant in enumerate(t):
        estimate = Estimate(path(instant), path(instant, 1), flat.quaternion[index], flat.body_rates[index])
        accelerations = flat.angular_acceleration[index]
        reference = Reference(
            path(instant),
            path(instant, 1),
            path(instant, 2),
            (0, 0, 0),
            0.0,
            0.0,
            flat.body_rates[index],
            accelerations,
        )
        told = GeometricController().pilot(free, 0.004).command(estimate, reference)
        np.testing.assert_allclose(told.rotor_speed, flat.rotor_speed[index], rtol=1e-9)


def test_lee_away_from_the_reference_is_the_printed_formula_in_matrices() -> None:
    """Equations 15 and 16 of Lee, Leok and McClamroch, with matrices, wedge and vee."""
    rng = np.random.default_rng(5)
    strong = replace(F330, torque_coefficient=20 * F330.torque_coefficient, rotor_speed_min=0.0)
    inertia = strong.inertia
    for _ in range(20):
        attitude = Rotation.from_rotvec(rng.normal(0, 0.2, 3))
        rates, wanted, change = rng.normal(0, 0.5, (3, 3))
        reference = REST._replace(
            position=tuple(rng.normal(0, 0.1, 3)), yaw=0.2, body_rates=tuple(wanted), angular_acceleration=tuple(change)
        )
        estimate = STILL._replace(quaternion=tuple(np.roll(attitude.as_quat(), 1)), body_rates=tuple(rates))
        pull = np.array([6.0, 6.0, 8.0]) * reference.position + [0, 0, F330.gravity]
        rotation, desired = attitude.as_matrix(), np.array(desired_axes(tuple(pull), 0.2, LEVEL)).T
        skew = 0.5 * (desired.T @ rotation - rotation.T @ desired)
        attitude_error = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        seen = rotation.T @ desired
        follow = np.cross(rates, seen @ wanted) - seen @ change
        gains = -np.array([144.0, 144.0, 60.0]) * attitude_error - [19.0, 19.0, 12.0] * (rates - seen @ wanted)
        torque = inertia @ gains + np.cross(rates, inertia @ rates) - inertia @ follow
        expected = np.concatenate([[F330.mass * pull @ rotation[:, 2]], torque])
        np.testing.assert_allclose(wrench(GeometricController(), estimate, reference, strong), expected, atol=1e-12)


def test_desired_attitudes_have_thrust_up_and_yaw_ahead() -> None:
    pull, yaw = (2.0, -3.0, 9.0), 0.7
    for axes in (desired_axes(pull, yaw, LEVEL), heading_axes(pull, yaw, LEVEL)):
        matrix = np.array(axes).T
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(matrix[:, 2], np.array(pull) / np.linalg.norm(pull))
    heading = Rotation.from_matrix(np.array(heading_axes(pull, yaw, LEVEL)).T).as_euler("ZYX")[0]
    assert heading == pytest.approx(yaw), "PX4's yaw is the first angle of ZYX"
    first = Rotation.from_matrix(np.array(desired_axes(pull, yaw, LEVEL)).T).as_euler("ZXY")[0]
    assert first == pytest.approx(yaw), "Mellinger's is the first of ZXY"


@pytest.mark.parametrize("pull", [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)])
def test_attitudes_without_a_direction_stay_finite(pull) -> None:
    assert np.isfinite(np.array(desired_axes(pull, 0.0, LEVEL))).all()
    assert np.isfinite(np.array(heading_axes(pull, 0.0, LEVEL))).all()


def test_allocation_is_exact_within_the_limits() -> None:
    told = Allocator(F330).command(11.0, (0.1, -0.05, 0.02))
    np.testing.assert_allclose(F330.wrench(told.rotor_speed), [11.0, 0.1, -0.05, 0.02], rtol=1e-12)
    assert not told.saturated


@pytest.mark.parametrize(
    ("thrust", "torque"),
    [(100.0, (0, 0, 0)), (0.0, (0.1, 0, 0)), (10.0, (0, 0, 5.0)), (24.0, (0.5, 0.5, 0.1)), (10, (9, 9, 9))],
)
def test_allocation_beyond_the_limits_stays_inside_and_says_so(thrust, torque) -> None:
    told = Allocator(F330).command(thrust, torque)
    assert told.saturated
    speeds = np.array(told.rotor_speed)
    assert (speeds >= F330.rotor_speed_min * (1 - 1e-12)).all() and (speeds <= F330.rotor_speed_max * (1 + 1e-12)).all()


def test_attitude_goes_before_thrust_and_thrust_before_yaw() -> None:
    most = 4 * F330.rotor_thrust_limits[1]
    thrust, roll, pitch, yaw = F330.wrench(Allocator(F330).command(most, (0.3, -0.2, 0.1)).rotor_speed)
    assert (roll, pitch) == (pytest.approx(0.3), pytest.approx(-0.2)) and thrust < most and abs(yaw) < 1e-12
    thrust, roll, _, yaw = F330.wrench(Allocator(F330).command(10.0, (0.3, 0, 1.0)).rotor_speed)
    assert (thrust, roll) == (pytest.approx(10.0), pytest.approx(0.3)) and 0 < yaw < 1.0


def test_the_cascade_follows_as_much_of_the_reference_as_it_is_told() -> None:
    moving = REST._replace(velocity=(1.0, 0, 0), acceleration=(0, 2.0, 0))
    by_position = wrench(CascadeController("position"), STILL, moving)
    by_velocity = wrench(CascadeController("velocity"), STILL, moving)
    by_all = wrench(CascadeController("acceleration"), STILL, moving)
    assert abs(by_position[1:3]).max() < 1e-9
    assert by_velocity[2] > 0.01 and abs(by_velocity[1]) < 1e-9
    assert by_all[2] > 0.01 and by_all[1] < -0.01


def test_feed_forward_reaches_even_a_cascade_that_follows_position_alone() -> None:
    pushed = wrench(CascadeController("position"), STILL, REST._replace(feed_forward=(1.0, 0, 0)))
    assert pushed[2] > 0.01


def test_a_derivative_on_rates_holds_against_their_change() -> None:
    pilots = [CascadeController(rate_derivative=(gain, 0, 0)).pilot(F330, 0.004) for gain in (0.0, 0.5)]
    turning = STILL._replace(body_rates=(0.2, 0, 0))
    for pilot in pilots:
        pilot.command(STILL, REST)
    plain, damped = (F330.wrench(pilot.command(turning, REST).rotor_speed) for pilot in pilots)
    assert damped[1] - plain[1] == pytest.approx(-0.5 * F330.inertia[0, 0] * 0.2 / 0.004)


@pytest.mark.slow
def test_the_cascade_removes_a_constant_push() -> None:
    windless = minsnap.line((0, 0, 1), (1e-6, 0, 1), total_time=40.0)
    from minsnap.flight import ConstantWind

    flight = simulate(F330, CascadeController(), windless, wind=ConstantWind((3.0, 0, 0)))
    assert np.abs(flight.error).max() > 0.05
    assert np.abs(flight.error[-1]).max() < 0.005, "the velocity integral"


def test_the_cascade_tilts_and_speeds_no_more_than_its_limits() -> None:
    far = minsnap.line((0, 0, 1), (30.0, 0, 1), total_time=1.0, constant_speed=True).sample(20.0)
    controller = CascadeController("position", horizontal_speed=4.0, tilt_limit=math.radians(20))
    start = replace(far, velocity=np.zeros_like(far.velocity))
    flight = simulate(F330, controller, start, duration=12.0)
    tilt = np.degrees(np.arccos(1 - 2 * (flight.quaternion[:, 1] ** 2 + flight.quaternion[:, 2] ** 2)))
    assert 15 < tilt.max() < 24 and 3.5 < flight.velocity[:, 0].max() < 4.6
    assert abs(flight.position[-1, 0] - 30.0) < 1.0, "nothing has wound up"


def test_a_climb_at_full_thrust_winds_nothing_up() -> None:
    weak = replace(F330, rotor_speed_max=1.02 * F330.hover_rotor_speed)
    position = np.array([[0, 0, 1.0]] + [[0, 0, 6.0]] * 11)
    start = minsnap.Samples(np.arange(12) / 20.0, position)
    flight = simulate(weak, CascadeController("position"), start, duration=20.0)
    assert flight.saturated.mean() > 0.1
    assert flight.position[:, 2].max() < 6.01, (
        "an integral that goes on while rotors are at their limit overshoots by 1 m"
    )
    assert abs(flight.position[-1, 2] - 6.0) < 0.01


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"references": "all"}, "'all'.*position, velocity, acceleration"),
        ({"position_gain": (1, 2)}, "position gain"),
        ({"tilt_limit": 2.0}, "quarter turn"),
        ({"outer_rate": 0.0}, "outer_rate"),
        ({"rate_limit": (-1, 1, 1)}, "rate limit"),
    ],
)
def test_gains_that_cannot_be_are_named(arguments, says) -> None:
    with pytest.raises(InputError, match=says):
        CascadeController(**arguments)
    with pytest.raises(InputError, match="attitude gain"):
        GeometricController(attitude_gain=(math.nan, 1, 1))
    with pytest.raises(InputError, match="feed_forward is 'no'"):
        GeometricController(feed_forward="no")


def test_feed_forward_is_the_drag_along_the_reference_turned_round() -> None:
    path = minsnap.circle(radius=3.0, speed=3.0, ramp=0.0)
    samples = path.sample(20.0)
    drag = BodyDrag((0.3, 0.2, 0.1), (0.02, 0.02, 0.05))
    offset = drag_feed_forward(F330, samples, drag)
    exact = flat_states(
        F330, samples.velocity, samples.acceleration, samples.jerk, samples.snap, samples.yaw, drag=drag
    )
    needed = exact.thrust[:, None] / F330.mass * exact.rotation[:, :, 2] - [0, 0, F330.gravity]
    np.testing.assert_allclose(samples.acceleration + offset, needed, atol=1e-12)


def test_isotropic_feed_forward_by_hand_and_the_published_one_pushes_backwards() -> None:
    samples = minsnap.line((0, 0, 1), (9, 0, 1), total_time=3.0, constant_speed=True).sample(20.0)
    np.testing.assert_allclose(drag_feed_forward(F330, samples, BodyDrag((0.2, 0.2, 0.2)))[5], [0.6, 0, 0], atol=1e-12)
    assert drag_feed_forward(F330, samples, published_drag("linear"))[5, 0] == pytest.approx(-0.1069 - 0.01856 * 3)
    without = drag_feed_forward(F330, replace(samples, velocity=None), BodyDrag((1, 1, 1)))
    assert not without.any()
    np.testing.assert_array_equal(drag_feed_forward(F330, samples), drag_feed_forward(F330, samples, F330.drag))


@pytest.fixture(scope="module")
def steady():
    """3-D error of a 3 m/s circle in steady state: laps 2 to 4 of 4, from rest to rest."""
    path = minsnap.circle(radius=3.0, speed=3.0, laps=5)

    def fly(controller, compensation) -> float:
        flight = simulate(F330, controller, path, compensation=compensation)
        kept = (flight.t > 0.4 * path.duration) & (flight.t < 0.8 * path.duration)
        return float(np.sqrt(np.mean(np.sum(flight.error[kept] ** 2, axis=1))))

    return fly


@pytest.mark.slow
@pytest.mark.parametrize("controller", [GeometricController(), GeometricController(feed_forward=False)])
def test_the_exact_model_takes_more_than_half_of_the_error_of_a_circle(steady, controller) -> None:
    assert steady(controller, F330.drag) < 0.5 * steady(controller, None)


@pytest.mark.slow
def test_the_published_model_makes_the_same_circle_worse(steady) -> None:
    assert steady(GeometricController(), published_drag("linear")) > 1.1 * steady(GeometricController(), None)
