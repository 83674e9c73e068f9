import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.basics.arrays import GRAVITY
from minsnap.cli.app import exit_status
from minsnap.errors import ThrustError, VehicleError
from minsnap.vehicle import BodyDrag, Quadrotor, RigidBody, RotorSpeedDrag, check_rotor_limits, flat_states, flatness_of

WIND = (1.0, -2.0, 0.5)
STRONG = BodyDrag(linear=(0.5, 0.3, 0.2), quadratic=(0.05, 0.08, 0.1))


def vehicle(drag: BodyDrag = STRONG) -> Quadrotor:
    inertia = np.array([[0.005, 2e-4, 1e-4], [2e-4, 0.006, -1e-4], [1e-4, -1e-4, 0.009]])
    return Quadrotor(0.9, inertia, 0.165, 7e-6, 2e-7, 1500.0, drag=drag)


@pytest.mark.parametrize("drag", [BodyDrag(), STRONG])
@pytest.mark.parametrize("wind", [(0, 0, 0), WIND])
def test_the_dynamics_give_back_the_motion_that_was_inverted(sines, drag, wind) -> None:
    t = np.linspace(0, 12, 1000)
    flat = flatness_of(vehicle(drag), sines, t, wind=wind)
    assert not flat.singular.any()
    state = [*sines(t).T, *sines(t, 1).T, *flat.quaternion.T, *flat.body_rates.T]
    rate = RigidBody(vehicle(drag)).derivative(state, flat.rotor_speed.T, wind)
    np.testing.assert_allclose(np.array(rate[3:6]).T, sines(t, 2), atol=1e-9)
    np.testing.assert_allclose(np.array(rate[10:]).T, flat.angular_acceleration, atol=1e-9)


def test_rates_and_accelerations_are_those_of_finite_differences(sines) -> None:
    step = 1e-4
    t = 3.0 + step * np.arange(-2000, 2001)
    flat = flatness_of(vehicle(), sines, t)
    turns = (Rotation.from_matrix(flat.rotation[:-2]).inv() * Rotation.from_matrix(flat.rotation[2:])).as_rotvec()
    np.testing.assert_allclose(turns / (2 * step), flat.body_rates[1:-1], atol=1e-5)
    slope = (flat.body_rates[2:] - flat.body_rates[:-2]) / (2 * step)
    np.testing.assert_allclose(slope, flat.angular_acceleration[1:-1], atol=1e-4)


def test_the_attitude_obeys_force_balance_and_yaw(sines) -> None:
    t = np.linspace(0, 12, 300)
    flat = flatness_of(vehicle(), sines, t, wind=WIND)
    body_velocity = np.einsum("mji,mj->mi", flat.rotation, sines(t, 1) - WIND)
    force = STRONG.force(body_velocity) + flat.thrust[:, None] * [0, 0, 1]
    world = np.einsum("mij,mj->mi", flat.rotation, force) - [0, 0, 0.9 * GRAVITY]
    np.testing.assert_allclose(world, 0.9 * sines(t, 2), atol=1e-12)
    yaw = sines.yaw(t)
    np.testing.assert_allclose(
        flat.rotation[:, 0, 1] * np.cos(yaw) + flat.rotation[:, 1, 1] * np.sin(yaw), 0, atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(flat.rotation), 1.0)


def test_torques_and_rotor_speeds_agree_with_euler_and_the_mixer(sines) -> None:
    quad = vehicle()
    flat = flatness_of(quad, sines, np.linspace(0, 12, 100))
    momentum = flat.body_rates @ quad.inertia.T
    euler = flat.angular_acceleration @ quad.inertia.T + np.cross(flat.body_rates, momentum)
    np.testing.assert_allclose(flat.torque, euler, atol=1e-13)
    np.testing.assert_allclose(quad.wrench(flat.rotor_speed), np.column_stack([flat.thrust, flat.torque]), atol=1e-12)


def test_quaternions_are_the_matrices_and_never_change_sign() -> None:
    t = np.linspace(0, 20, 4001)
    zero = np.zeros((len(t), 3))
    flat = flat_states(vehicle(), zero, zero, zero, zero, yaw=1.3 * t, yaw_rate=1.3)
    expected = Rotation.from_matrix(flat.rotation).as_matrix()
    scipy_order = flat.quaternion[:, [1, 2, 3, 0]]
    np.testing.assert_allclose(Rotation.from_quat(scipy_order).as_matrix(), expected, atol=1e-14)
    assert np.abs(np.diff(flat.quaternion, axis=0)).max() < 0.01
    np.testing.assert_allclose(flat.body_rates, [[0, 0, 1.3]] * len(t), atol=1e-12)


def test_open_loop_integration_by_scipy_follows_the_path(sines) -> None:
    """Torques and thrust from flatness, an integrator and equations of motion written here."""
    quad = vehicle(BodyDrag())

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        flat = flatness_of(quad, sines, [time])
        attitude = Rotation.from_quat(state[6:10])
        omega = state[10:]
        lift = attitude.apply([0, 0, flat.thrust[0]]) / quad.mass - [0, 0, GRAVITY]
        spin = 0.5 * (Rotation.from_quat(state[6:10]).as_quat()[3] * omega + np.cross(state[6:9], omega))
        turn = np.linalg.solve(quad.inertia, flat.torque[0] - np.cross(omega, quad.inertia @ omega))
        return np.concatenate([state[3:6], lift, spin, [-0.5 * state[6:9] @ omega], turn])

    flat = flatness_of(quad, sines, [0.0])
    start = np.concatenate([sines(0.0), sines(0.0, 1), np.roll(flat.quaternion[0], -1), flat.body_rates[0]])
    end = solve_ivp(rate, (0, 1.5), start, method="DOP853", rtol=1e-9, atol=1e-10).y[:, -1]
    np.testing.assert_allclose(end[:3], sines(1.5), atol=1e-6)


def loop(rate: float = 2.0):
    """A vertical loop flown nose first: thrust passes through the yaw direction twice a turn."""
    t = np.linspace(0, 2 * np.pi / rate, 2001)
    force = 12.0 * np.stack([np.sin(rate * t), 0 * t, np.cos(rate * t)], axis=-1)
    jerk = 12.0 * rate * np.stack([np.cos(rate * t), 0 * t, -np.sin(rate * t)], axis=-1)
    snap = -(rate**2) * force
    return np.zeros_like(force), force - [0, 0, GRAVITY], jerk, snap


def test_a_loop_keeps_its_lateral_axis_and_its_pitch_rate() -> None:
    flat = flat_states(vehicle(BodyDrag()), *loop())
    np.testing.assert_allclose(flat.rotation[:, :, 1], [[0, 1, 0]] * len(flat), atol=1e-9)
    regular = ~flat.singular
    assert 0 < flat.singular.sum() <= 2  # the grid hits a quarter turn exactly, or to rounding
    np.testing.assert_allclose(flat.body_rates[regular], [[0, 2.0, 0]] * regular.sum(), atol=1e-6)
    assert np.abs(np.diff(flat.quaternion, axis=0)).max() < 0.01


def test_free_fall_holds_the_attitude_and_is_reported() -> None:
    t = np.linspace(-1, 1, 201)
    acceleration = np.stack([0 * t, 0 * t, np.abs(t) * 5.0 - GRAVITY], axis=-1)
    jerk = np.stack([0 * t, 0 * t, np.sign(t) * 5.0], axis=-1)
    flat = flat_states(vehicle(BodyDrag()), jerk, acceleration, jerk, 0 * jerk, yaw=0.4)
    np.testing.assert_array_equal(np.flatnonzero(flat.singular), [100])
    np.testing.assert_allclose(flat.rotation[100], flat.rotation[99])
    assert all(np.isfinite(getattr(flat, name)).all() for name in ("thrust", "quaternion", "body_rates", "rotor_speed"))


def test_free_fall_throughout_is_level_and_finite() -> None:
    fall = np.tile([0, 0, -GRAVITY], (5, 1))
    flat = flat_states(vehicle(BodyDrag()), 0 * fall, fall, 0 * fall, 0 * fall, yaw=0.4)
    assert flat.singular.all() and np.isfinite(flat.quaternion).all()
    np.testing.assert_allclose(flat.rotation[:, :, 2], [[0, 0, 1]] * 5)


def test_yawing_far_between_samples_is_not_a_flip() -> None:
    zero = np.zeros((2, 3))
    flat = flat_states(vehicle(), zero, zero, zero, zero, yaw=[0.0, np.pi])
    np.testing.assert_allclose(flat.rotation[1, :, 0], [-1, 0, 0], atol=1e-15)


def test_drag_that_cannot_be_inverted_is_named(sines) -> None:
    with pytest.raises(VehicleError, match="RotorSpeedDrag"):
        flatness_of(vehicle(RotorSpeedDrag((1e-4, 1e-4, 0))), sines, [0.0])


def test_too_much_thrust_is_named_with_its_instant(sines) -> None:
    quad = vehicle()
    t = np.linspace(0, 2, 21)
    climb = np.zeros((21, 3))
    climb[13, 2] = 200.0
    flat = flat_states(quad, 0 * climb, climb, 0 * climb, 0 * climb)
    with pytest.raises(ThrustError, match=r"t = 1\.300 s.*above") as caught:
        check_rotor_limits(quad, flat, t)
    needed = 0.9 * (200.0 + GRAVITY) / 4
    assert caught.value.instant == pytest.approx(1.3)
    assert caught.value.excess == pytest.approx(needed - 7e-6 * 1500.0**2)
    assert exit_status(caught.value) == 1


def test_pulling_down_is_below_the_least_thrust() -> None:
    quad = vehicle(BodyDrag())
    dive = np.array([[0, 0, -GRAVITY], [0.0, 0, 0]])
    spin = flat_states(quad, 0 * dive, dive * 0, 0 * dive, 0 * dive, yaw_acceleration=[0, 500.0])
    with pytest.raises(ThrustError, match="below"):
        check_rotor_limits(quad, spin, [0.0, 1.0])


def test_a_plane_path_flies_level() -> None:
    plane = np.zeros((4, 2))
    flat = flat_states(vehicle(), plane + 1.0, plane, plane, plane)
    assert flat.rotation.shape == (4, 3, 3) and flat.thrust == pytest.approx(flat.thrust[0])


def test_arrays_are_read_only(sines) -> None:
    flat = flatness_of(vehicle(), sines, [0.0, 1.0])
    with pytest.raises(ValueError):
        flat.thrust[0] = 1.0


LEAPS = [(0, 0, 1), (3, 1, 3), (5, -2, 2), (1, -3, 1), (-2, 0, 2)]


@pytest.mark.parametrize("times", [[1.1, 1.0, 1.2, 1.3], [0.7, 0.6, 0.75, 0.8]], ids=["banked", "upside down"])
def test_a_heading_from_the_tilt_does_not_spin(times):
    body = Quadrotor.dji_f330()
    path = minsnap.plan(LEAPS, times, yaw="tilt")
    t = np.linspace(0.0, path.duration, 2001)
    states = flatness_of(body, path, t, drag=BodyDrag())
    assert not states.singular.any()
    assert states.body_rates[:, 2] == pytest.approx(0.0, abs=1e-9)
    assert states.angular_acceleration[:, 2] == pytest.approx(0.0, abs=1e-7 * np.abs(states.angular_acceleration).max())
    step = np.einsum("mji,mjk->mik", states.rotation[:-1], states.rotation[1:])
    spin = (step[:, 1, 0] - step[:, 0, 1]) / 2.0 / np.diff(t)
    assert np.abs(spin).max() < 1e-3 * np.linalg.norm(states.body_rates, axis=1).max()
    turn = np.stack([step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0]], axis=1) / 2.0 / np.diff(t)[:, None]
    middle = (states.body_rates[1:, :2] + states.body_rates[:-1, :2]) / 2.0
    assert turn == pytest.approx(middle, abs=2e-3 * np.abs(middle).max())


@pytest.mark.parametrize("drag", [BodyDrag(), BodyDrag(linear=(0.3, 0.1, 0.05))], ids=["no drag", "drag"])
def test_a_heading_from_the_tilt_is_the_yaw_that_it_tells(drag):
    body = Quadrotor.dji_f330()
    path = minsnap.plan(LEAPS, [1.5, 1.4, 1.6, 1.7], yaw="tilt")
    t = np.linspace(0.0, path.duration, 301)
    whole = flatness_of(body, path, t, drag=drag)
    motion = [path(t, order) for order in range(1, 5)]
    told = flat_states(body, *motion, *(path.yaw(t, order) for order in range(3)), drag=drag)
    far = 1e-9 if drag.absent else 0.05
    assert whole.rotation == pytest.approx(told.rotation, abs=far)
    assert whole.rotor_speed == pytest.approx(told.rotor_speed, rel=1e-6 if drag.absent else 0.05)


def test_drag_leaves_a_heading_from_the_tilt_regular():
    """Rates and accelerations with drag agree with differences of the attitude, upside down too."""
    body = Quadrotor.dji_f330()
    path = minsnap.plan(LEAPS, [0.7, 0.6, 0.75, 0.8], yaw="tilt")
    t, step = np.linspace(0.01, path.duration - 0.01, 400), 1e-5
    drag = BodyDrag(linear=(0.3, 0.1, 0.05))
    at, ahead, back = (flatness_of(body, path, t + shift, drag=drag) for shift in (0.0, step, -step))
    turn = np.einsum("mji,mjk->mik", back.rotation, ahead.rotation)
    rates = np.stack([turn[:, k, j] - turn[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1)
    assert rates / (4.0 * step) == pytest.approx(at.body_rates, abs=1e-4 * np.abs(at.body_rates).max())
    slope = (ahead.body_rates - back.body_rates) / (2.0 * step)
    assert slope == pytest.approx(at.angular_acceleration, abs=1e-4 * np.abs(slope).max())
