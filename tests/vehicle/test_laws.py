"""What holds of every vehicle and every motion."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from minsnap.vehicle import BodyDrag, Quadrotor, RigidBody, flat_states

seeds = st.integers(0, 2**32 - 1)


def some_vehicle(random: np.random.Generator) -> Quadrotor:
    """A body of scattered points, so that its inertia is that of a body, with drag of any strength."""
    points = random.normal(0, 0.1, (6, 3))
    spread = np.einsum("ij,ij", points, points) * np.eye(3) - points.T @ points
    mass = 10 ** random.uniform(-2, 1)
    drag = BodyDrag(mass * random.uniform(0, 0.6, 3), mass * random.uniform(0, 0.1, 3))
    layout = str(random.choice(["x", "+"]))
    return Quadrotor(mass, mass / 6 * spread, 0.2, 1e-5 * mass, 3e-7 * mass, 2000.0, layout=layout, drag=drag)


def some_motion(random: np.random.Generator, count: int = 6) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Velocity to snap, and yaw with two derivatives, at instants that have nothing to do with each other."""
    motion = [random.normal(0, size, (count, 3)) for size in (5.0, 4.0, 5.0, 10.0)]
    return motion, [random.normal(0, size, count) for size in (2.0, 1.0, 1.0)]


def upright(vehicle: Quadrotor, motion: list[np.ndarray]) -> bool:
    """Thrust is well away from free fall and from the horizontal."""
    return bool(((motion[1][:, 2] + vehicle.gravity) > 4.0).all())


@given(seeds)
def test_inverse_and_forward_dynamics_agree_to_1e_9(seed: int) -> None:
    random = np.random.default_rng(seed)
    vehicle, (motion, yaw) = some_vehicle(random), some_motion(random)
    assume(upright(vehicle, motion))
    wind = random.normal(0, 3, 3)
    flat = flat_states(vehicle, *motion, *yaw, wind=wind)
    assume(not flat.singular.any())
    state = [*np.zeros((3, 6)), *motion[0].T, *flat.quaternion.T, *flat.body_rates.T]
    rate = np.array(RigidBody(vehicle).derivative(state, flat.rotor_speed.T, wind)[3:6]).T
    np.testing.assert_allclose(rate, motion[1], atol=1e-9)
    turn = np.array(RigidBody(vehicle).derivative(state, flat.rotor_speed.T, wind)[10:]).T
    np.testing.assert_allclose(turn, flat.angular_acceleration, atol=1e-9, rtol=1e-9)


@given(seeds, st.floats(-3.0, 3.0))
def test_turning_the_world_about_the_vertical_turns_the_attitude_and_nothing_else(seed: int, angle: float) -> None:
    random = np.random.default_rng(seed)
    vehicle, (motion, yaw) = some_vehicle(random), some_motion(random)
    assume(upright(vehicle, motion))
    here = flat_states(vehicle, *motion, *yaw)
    turn = Rotation.from_euler("z", angle).as_matrix()
    there = flat_states(vehicle, *(value @ turn.T for value in motion), yaw[0] + angle, *yaw[1:])
    assume(not here.singular.any())
    np.testing.assert_allclose(there.rotation, turn @ here.rotation, atol=1e-9)
    np.testing.assert_allclose(there.rotor_speed, here.rotor_speed, rtol=1e-7)


@given(seeds, st.floats(0.01, 100.0))
def test_scaling_mass_inertia_and_drag_scales_thrust_and_torque(seed: int, factor: float) -> None:
    random = np.random.default_rng(seed)
    vehicle, (motion, yaw) = some_vehicle(random), some_motion(random)
    assume(upright(vehicle, motion))
    drag = BodyDrag(factor * vehicle.drag.linear, factor * vehicle.drag.quadratic)
    big = Quadrotor(factor * vehicle.mass, factor * vehicle.inertia, 0.2, 1.0, 1.0, 2000.0, drag=drag)
    one, other = flat_states(vehicle, *motion, *yaw), flat_states(big, *motion, *yaw)
    np.testing.assert_allclose(other.thrust, factor * one.thrust, rtol=1e-9)
    np.testing.assert_allclose(other.body_rates, one.body_rates, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(other.torque, factor * one.torque, rtol=1e-6, atol=1e-9 * factor)


@given(seeds)
def test_nothing_is_ever_not_a_number(seed: int) -> None:
    """Free fall, thrust along the yaw direction, standstill in the air, all of them and none."""
    random = np.random.default_rng(seed)
    vehicle = some_vehicle(random)
    choices = np.array([[0, 0, -vehicle.gravity], [3.0, 0, -vehicle.gravity], [0, 0, 0], [1, 2, 3]])
    acceleration = choices[random.integers(0, 4, 8)]
    velocity = random.normal(size=(8, 3)) * random.integers(0, 2, (8, 1))
    flat = flat_states(vehicle, velocity, acceleration, random.normal(size=(8, 3)), random.normal(size=(8, 3)))
    for name in ("thrust", "rotation", "quaternion", "body_rates", "angular_acceleration", "torque", "rotor_speed"):
        assert np.isfinite(getattr(flat, name)).all(), name
    np.testing.assert_allclose(np.linalg.norm(flat.quaternion, axis=1), 1.0)
