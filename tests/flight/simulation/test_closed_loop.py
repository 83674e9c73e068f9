from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import minsnap
from minsnap.cli.app import exit_status
from minsnap.errors import DivergenceError, InputError, TimingError
from minsnap.flight import (
    CascadeController,
    ConstantWind,
    DrydenWind,
    GeometricController,
    Sensors,
    compare,
    simulate,
    simulate_open_loop,
)
from minsnap.flight.simulation.controllers import Command
from minsnap.flight.simulation.flight_inputs import StateEstimator
from minsnap.vehicle import BodyDrag, Quadrotor, RigidBody, flatness_of

F330 = Quadrotor.dji_f330()


class FixedSpeeds:
    """A controller that says the same always, and so is its own pilot."""

    def __init__(self, speeds: list[float]) -> None:
        self.speeds = speeds

    def pilot(self, vehicle: Quadrotor, step: float) -> "FixedSpeeds":
        return self

    def command(self, estimate, reference) -> Command:
        return Command(self.speeds, False)


@pytest.mark.parametrize("path", [minsnap.lemniscate(), minsnap.circle(radius=2.0, speed=3.0, ramp=0.0)])
def test_the_inputs_of_flatness_fly_the_path_with_no_feedback(path) -> None:
    """Asked for: 1e-4 m over 12 s."""
    flight = simulate_open_loop(F330, path, wind=(1.0, -0.5, 0.2), step=0.002)
    assert np.abs(flight.error).max() < 1e-6


def test_a_heading_along_the_velocity_is_flown_with_no_feedback() -> None:
    """Its torque jumps where it begins to follow the velocity: with steps across these instants it strayed by 2 mm."""
    path = minsnap.plan([(0, 0, 1), (3, 1, 2), (2, -2, 1), (0, 1, 2)], durations=[1.5, 1.6, 1.5], yaw="velocity")
    assert np.abs(simulate_open_loop(F330, path).error).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("corridor", [None, 0.3])
def test_a_plan_flown_open_loop_for_12_seconds_stays_within_a_tenth_of_a_millimetre(corridor) -> None:
    """In a corridor snap jumps at the corners; times that are no multiples of the step put knots inside steps."""
    corners = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
    path = minsnap.plan(corners, durations=[4.0003, 1.9997, 4, 2], corridor=corridor)
    flight = simulate_open_loop(F330, path)
    assert flight.duration == pytest.approx(12.0)
    assert np.abs(flight.error).max() < 1e-4


@pytest.mark.parametrize(("lag", "atol"), [(0.04, 1e-8), (0.0005, 1e-5)])
def test_motors_and_motion_agree_with_an_adaptive_integrator(lag, atol) -> None:
    """Motors that settle within a step, too: 0.9 mm apart where one step of the Runge-Kutta method had to do."""
    told, vehicle = [600.0, 640.0, 610.0, 630.0], replace(F330, motor_time_constant=lag)
    flight = simulate(vehicle, FixedSpeeds(told), minsnap.circle(), duration=1.0, wind=ConstantWind((2.0, 1.0, 0.0)))
    body = RigidBody(vehicle)

    def rate(t, state):
        motors = (np.array(told) - state[13:]) / lag
        return np.concatenate([body.derivative(state[:13], state[13:], (2.0, 1.0, 0.0)), motors])

    first = [flight.position, flight.velocity, flight.quaternion, flight.body_rates, flight.rotor_speed]
    start = np.concatenate([column[0] for column in first])
    end = solve_ivp(rate, (0, 1), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(flight.position[-1], end[:3], atol=atol)
    np.testing.assert_allclose(flight.rotor_speed[-1], end[13:], rtol=1e-10)


def test_halving_the_step_divides_the_error_by_sixteen() -> None:
    smooth = minsnap.lemniscate(ramp=0.0)
    coarse, fine = (np.abs(simulate_open_loop(F330, smooth, step=step).error).max() for step in (0.02, 0.01))
    assert 12 < coarse / fine < 20


def test_hover_is_a_fixed_point() -> None:
    class Hover(minsnap.Path):
        duration, dim = 2.0, 3

        def _evaluate(self, t, order):
            return np.full((len(t), 3), 1.0 if order == 0 else 0.0)

    for controller in (CascadeController(), GeometricController()):
        flight = simulate(F330, controller, Hover())
        np.testing.assert_allclose(flight.position, 1.0, atol=1e-12)
        np.testing.assert_allclose(flight.rotor_speed, F330.hover_rotor_speed, rtol=1e-12)


def test_a_projectile_without_drag_keeps_its_energy() -> None:
    still = replace(F330, drag=BodyDrag(), rotor_speed_min=0.0, motor_time_constant=0.0)
    flight = simulate(still, FixedSpeeds([0.0] * 4), minsnap.circle(), duration=2.0)
    energy = 0.5 * np.sum(flight.velocity**2, axis=1) + still.gravity * flight.position[:, 2]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


def test_a_spinning_body_keeps_its_angular_momentum() -> None:
    inertia = np.array([0.004, 0.006, 0.009])
    body = RigidBody(replace(F330, inertia=inertia, drag=BodyDrag()))
    state = [0.0] * 6 + [1.0, 0, 0, 0, 3.0, -2.0, 4.0]
    for _ in range(1000):
        state = body.advance(state, ([0.0] * 4,) * 3, (0, 0, 0), 0.001)
    from scipy.spatial.transform import Rotation

    attitude = Rotation.from_quat(np.roll(state[6:10], -1))
    np.testing.assert_allclose(attitude.apply(inertia * state[10:]), inertia * [3.0, -2.0, 4.0], atol=1e-10)


def test_wind_carries_a_vehicle_whose_rotors_only_hold_it_up() -> None:
    speeds = [F330.hover_rotor_speed] * 4
    path = minsnap.line((0, 0, 1), (1e-6, 0, 1), total_time=3.0)
    flight = simulate(F330, FixedSpeeds(speeds), path, wind=ConstantWind((0.0, 4.0, 0.0)))
    linear, quadratic = F330.drag.linear[1], F330.drag.quadratic[1]
    slow = solve_ivp(lambda t, v: (linear + quadratic * abs(4 - v)) * (4 - v), (0, 3), [0.0], rtol=1e-10, atol=1e-12)
    assert flight.velocity[-1, 1] == pytest.approx(slow.y[0, -1], rel=1e-4)


@pytest.mark.slow
def test_the_same_seed_flies_the_same_flight() -> None:
    def fly(seed: int) -> np.ndarray:
        wind, sensors = DrydenWind(seed=seed), Sensors(delay=0.02, noise=0.002, seed=seed)
        return simulate(F330, GeometricController(), minsnap.lemniscate(), wind=wind, sensors=sensors).position

    one = fly(3)
    np.testing.assert_array_equal(fly(3), one)
    assert np.abs(fly(4) - one).max() > 1e-3


def test_without_delay_and_noise_the_estimate_is_the_truth() -> None:
    path, step = minsnap.lemniscate(ramp=0.0), 0.004
    observer = StateEstimator(Sensors(), step, 1000)
    for t in step * np.arange(1000):
        known = observer.estimate([*path(t), *path(t, 1), 1.0, 0, 0, 0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(known.position, path(t), atol=1e-5)
    np.testing.assert_allclose(known.velocity, path(t, 1), atol=1e-4)
    assert known.body_rates == (0.1, 0.2, 0.3)


def test_noise_is_filtered_and_does_not_pile_up() -> None:
    observer = StateEstimator(Sensors(noise=0.01), 0.004, 20_000)
    known = np.array([observer.estimate([0.0] * 6 + [1.0] + [0.0] * 6)[:2] for _ in range(20_000)])
    assert 0.001 < known[5000:, 0].std() < 0.007, "below the 10 mm of a single pose"
    assert known[5000:, 1].std() < 0.05


def test_a_delayed_pose_drags_the_flight_forward_by_speed_times_delay() -> None:
    """The estimate lags by v d, so the controller holds the estimate on the reference and the vehicle ahead of it."""
    path = minsnap.line((0, 0, 1), (40, 0, 1), total_time=20.0, constant_speed=True)
    still = replace(F330, drag=BodyDrag())
    flight = simulate(still, GeometricController(), path, sensors=Sensors(delay=0.1))
    assert flight.error[-1, 0] == pytest.approx(2.0 * 0.1, rel=0.02)


def test_noise_moves_the_estimate_and_not_the_truth_at_the_start() -> None:
    flight = simulate(F330, GeometricController(), minsnap.circle(), sensors=Sensors(noise=0.01), duration=2.0)
    assert np.abs(flight.error[0]).max() < 1e-12
    assert 1e-4 < np.abs(flight.error).max() < 0.3


@pytest.mark.slow
def test_setpoints_are_held_between_their_instants() -> None:
    path = minsnap.circle(ramp=0.0)
    fast = simulate(F330, GeometricController(), path, compensation=F330.drag)
    slow = simulate(F330, GeometricController(), path, compensation=F330.drag, setpoint_rate=20.0)
    samples = simulate(F330, GeometricController(), path.sample(20.0), compensation=F330.drag)
    np.testing.assert_allclose(slow.position, samples.position, atol=1e-9)
    assert np.abs(fast.error).max() < np.abs(slow.error).max()


def test_a_vehicle_that_waits_for_its_setpoints_or_holds_the_last_one_does_not_turn() -> None:
    """Snap begins and ends with a plan; held on, its angular acceleration moved the vehicle by 0.4 m and by 1.4 m."""
    path = minsnap.plan([(0, 0, 1), (1, 0, 1)], durations=[1.0])
    flight = simulate(F330, GeometricController(), path, setpoint_delay=0.2, duration=4.0)
    assert np.abs(flight.position[flight.t < 0.2] - path(0.0)).max() < 1e-9
    assert np.abs(flight.position[-1] - path(1.0)).max() < 1e-3


def test_the_error_to_coarse_setpoints_is_that_to_the_plan_between_them() -> None:
    """The plan was the chord between setpoints: of a circle at 1 Hz 0.4 m inside of it."""
    path = minsnap.circle(ramp=0.0)
    held, coarse = (
        simulate(F330, GeometricController(), path, setpoint_rate=1.0),
        simulate(F330, GeometricController(), path.sample(1.0)),
    )
    np.testing.assert_allclose(held.position, coarse.position, atol=1e-9)
    np.testing.assert_allclose(coarse.error, held.error, atol=0.02)
    assert compare(path.sample(1.0), coarse.samples).max_error == pytest.approx(
        np.linalg.norm(coarse.error, axis=1).max()
    )


def test_a_flight_knows_its_reference_and_gives_samples() -> None:
    path = minsnap.circle(ramp=0.0)
    flight = simulate(F330, GeometricController(), path)
    np.testing.assert_allclose(flight.reference.position, path(flight.t))
    np.testing.assert_array_equal(flight.samples.position, flight.position)
    assert len(flight) == len(flight.t) and flight.duration == pytest.approx(path.duration)
    with pytest.raises(ValueError):
        flight.position[0, 0] = 1.0


def test_a_flight_at_another_rate_has_each_instant_once_its_end_included() -> None:
    """0.58 s of 50 Hz are 28.999999999999996 steps in floating point."""
    flight = simulate(F330, GeometricController(), minsnap.circle(), duration=0.58)
    assert [len(flight.at_rate(rate)) for rate in (1.0, 50.0, 250.0, 1e4)] == [1, 30, 146, 146]
    assert flight.at_rate(50.0).t[-1] == flight.at_rate(1e4).t[-1] == flight.duration
    for rate in (0.0, -1.0, np.nan, "fast"):
        with pytest.raises(TimingError, match="the rate is"):
            flight.at_rate(rate)


@pytest.mark.slow
def test_a_diverging_flight_stops_says_when_and_keeps_what_it_has() -> None:
    wrong = GeometricController(attitude_gain=(-50.0, -50.0, -50.0))
    with pytest.raises(DivergenceError, match=r"diverged at t = [\d.]+ s: the .* passed") as caught:
        simulate(F330, wrong, minsnap.circle())
    flight = caught.value.flight
    assert caught.value.instant == flight.duration < 6.0
    assert np.isfinite(flight.position).all() and len(flight) > 10
    assert exit_status(caught.value) == 1


def test_rotors_that_are_asked_for_too_much_are_seen_to_saturate() -> None:
    weak = replace(F330, rotor_speed_max=1.15 * F330.hover_rotor_speed)
    flight = simulate(weak, GeometricController(), minsnap.circle(radius=2.0, speed=4.0), duration=5.0)
    assert flight.saturated.any() and flight.rotor_speed.max() <= weak.rotor_speed_max * (1 + 1e-12)
    assert not simulate(F330, GeometricController(), minsnap.circle()).saturated.any()


def test_progress_runs_from_nothing_to_all() -> None:
    seen: list[float] = []
    simulate(F330, GeometricController(), minsnap.circle(), progress=seen.append)
    assert seen[0] == 0.0 and seen[-1] == 1.0 and len(seen) < 110 and seen == sorted(seen)


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"step": 0.0}, TimingError, "step"),
        ({"step": 0.5}, TimingError, "at most 0.1"),
        ({"duration": -1.0}, TimingError, "lasts -1.0"),
        ({"setpoint_rate": 0.0}, TimingError, "rate"),
    ],
)
def test_times_that_cannot_be_flown_are_named(arguments, error, says) -> None:
    with pytest.raises(error, match=says):
        simulate(F330, GeometricController(), minsnap.circle(), **arguments)


def test_other_references_are_named() -> None:
    with pytest.raises(InputError, match="type list"):
        simulate(F330, GeometricController(), [1, 2, 3])
    samples = minsnap.circle().sample(20.0)
    for wrong in (samples[::-1], samples[[0, 0, 1]], samples[:0]):
        with pytest.raises(InputError, match="each later than the one before"):
            simulate(F330, GeometricController(), wrong)
    with pytest.raises(InputError, match="the reference has numbers in acceleration that are not finite"):
        simulate(F330, GeometricController(), replace(samples, acceleration=np.nan * samples.acceleration))
    with pytest.raises(TimingError, match="own instants"):
        simulate(F330, GeometricController(), minsnap.circle().sample(20.0), setpoint_rate=20.0)
    with pytest.raises(TimingError, match="step"):
        simulate_open_loop(F330, minsnap.circle(), step=0.0)
    with pytest.raises(InputError, match="pose rate"):
        Sensors(pose_rate=0.0)
    with pytest.raises(InputError, match="delay"):
        Sensors(delay=-0.1)


def test_a_plane_plan_is_flown_level() -> None:
    path = minsnap.plan([(0, 0), (4, 0), (4, 3)], durations=[4, 3], yaw="velocity")
    flight = simulate(F330, GeometricController(), path, compensation=F330.drag)
    assert flight.reference.position.shape[1] == 3 and np.abs(flight.error).max() < 0.05


def test_the_flight_starts_in_the_state_of_the_reference() -> None:
    path = minsnap.circle(ramp=0.0)
    flight = simulate(F330, GeometricController(), path, duration=0.1, compensation=F330.drag)
    flat = flatness_of(F330, path, [0.0])
    np.testing.assert_allclose(flight.velocity[0], path(0.0, 1))
    np.testing.assert_allclose(flight.quaternion[0], flat.quaternion[0])
    np.testing.assert_allclose(flight.rotor_speed[0], flat.rotor_speed[0])
