import copy
import math

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, VehicleError
from minsnap.flight.simulation.rotorpy import RotorPyTrajectory, from_rotorpy, reorder_rotors
from minsnap.vehicle import BodyDrag, RigidBody, flatness_of

pytest.importorskip("rotorpy", reason="the simulator of the extra sim")

from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.crazyflie_params import quad_params as crazyflie
from rotorpy.vehicles.hummingbird_params import quad_params as hummingbird
from rotorpy.vehicles.multirotor import Multirotor

STEP = 0.002


def changed(**values: float) -> dict:
    return copy.deepcopy(hummingbird) | values


def wavy_commands(parameters: dict, count: int = 1000) -> np.ndarray:
    """Rotor speeds that tumble the vehicle, in RotorPy's order."""
    hover = math.sqrt(parameters["mass"] * 9.81 / 4 / parameters["k_eta"])
    t = np.arange(count)[:, None] * STEP
    return hover * (
        1 + 0.03 * np.hstack([np.sin(3 * t), -0.6 * np.sin(3 * t), 0.3 * np.sin(5 * t), 0.2 * np.cos(3 * t)])
    )


def start(parameters: dict) -> dict:
    hover = math.sqrt(parameters["mass"] * 9.81 / 4 / parameters["k_eta"])
    return {
        "x": np.zeros(3),
        "v": np.array([1.0, 0.5, 0.0]),
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.array([0.1, -0.2, 0.3]),
        "wind": np.array([0.5, -1.0, 0.2]),
        "rotor_speeds": np.full(4, hover),
    }


def fly_theirs(parameters: dict, commands: np.ndarray, aero: bool) -> np.ndarray:
    state = start(parameters)
    craft = Multirotor(parameters, state, aero=aero)
    positions = []
    for command in commands:
        state = craft.step(state, {"cmd_motor_speeds": command}, STEP)
        positions.append(state["x"])
    return np.array(positions)


def fly_ours(parameters: dict, commands: np.ndarray, aero: bool) -> np.ndarray:
    craft = from_rotorpy(parameters, aero=aero)
    body, begin = RigidBody(craft), start(parameters)
    state = [*begin["x"], *begin["v"], 1.0, 0.0, 0.0, 0.0, *begin["w"]]
    half, whole = (math.exp(-part * STEP / craft.motor_time_constant) for part in (0.5, 1.0))
    speeds, positions = begin["rotor_speeds"], []
    for command in reorder_rotors(commands):
        stages = (speeds, command + half * (speeds - command), command + whole * (speeds - command))
        state = body.advance(state, stages, begin["wind"], STEP)
        speeds = stages[2]
        positions.append(state[:3])
    return np.array(positions)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameters", "aero"),
    [
        (changed(), False),
        (changed(k_d=0.0, k_z=0.0, k_h=0.0), True),
        (changed(k_h=0.0), True),
        (changed(k_h=0.0, Ixy=2e-4, Ixz=-1e-4, Iyz=3e-4), True),
    ],
    ids=["no air", "airframe drag", "rotor drag", "skew inertia"],
)
def test_equal_rotor_commands_move_equal_vehicles_equally(parameters: dict, aero: bool) -> None:
    commands = wavy_commands(parameters)
    theirs, ours = fly_theirs(parameters, commands, aero), fly_ours(parameters, commands, aero)
    assert np.linalg.norm(theirs[-1] - theirs[0]) > 3.0
    np.testing.assert_allclose(ours, theirs, atol=1e-5)  # asked for: 1 mm after 2 s


@pytest.mark.slow
def test_translational_lift_is_the_whole_difference_that_is_left() -> None:
    commands = wavy_commands(hummingbird)
    apart = np.linalg.norm(fly_theirs(hummingbird, commands, True) - fly_ours(hummingbird, commands, True), axis=1)
    assert apart[-1] > 0.01, "RotorPy's k_h lifts a vehicle that moves; without it the test above holds to 1e-5 m"


def fly(path, parameters: dict, aero: bool, compensation=None) -> np.ndarray:
    """Fly a path in RotorPy's own environment, with its controller and dynamics; the error of position after 2 s."""
    from rotorpy.environments import Environment
    from rotorpy.world import World

    craft = from_rotorpy(parameters, aero=aero)
    flat = flatness_of(craft, path, [0.0], drag=BodyDrag())
    state = start(parameters) | {"x": path(0.0), "v": path(0.0, 1), "w": flat.body_rates[0], "wind": np.zeros(3)}
    state["q"] = np.roll(flat.quaternion[0], -1)
    environment = Environment(
        vehicle=Multirotor(parameters, state, aero=aero),
        controller=SE3Control(parameters),
        trajectory=RotorPyTrajectory(path, vehicle=craft, compensation=compensation),
        world=World.empty((-9, 9, -9, 9, -9, 9)),
        sim_rate=100,
    )
    flown = environment.run(
        t_final=path.duration - 0.01, use_mocap=False, terminate=False, plot=False, animate_bool=False, verbose=False
    )
    return (flown["state"]["x"] - path(np.minimum(flown["time"], path.duration)))[200:]


def rmse(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


@pytest.fixture(scope="module")
def circle():
    return minsnap.circle(radius=3.0, speed=3.0, ramp=0.0, laps=0.6)


@pytest.mark.slow
def test_compensation_lowers_the_error_with_their_drag(circle) -> None:
    craft = from_rotorpy(hummingbird)
    body, rotors = craft.drag.parts
    drag = body + rotors.at(craft.hover_rotor_speed)
    without, offset = rmse(fly(circle, hummingbird, True)), rmse(fly(circle, hummingbird, True, drag))
    assert offset < 0.5 * without


@pytest.mark.slow
def test_compensation_changes_nothing_where_there_is_no_drag(circle) -> None:
    none = from_rotorpy(hummingbird, aero=False).drag
    assert none.absent
    np.testing.assert_array_equal(fly(circle, hummingbird, False, none), fly(circle, hummingbird, False))


def test_the_adapter_gives_the_path_and_holds_its_end() -> None:
    path = minsnap.lemniscate(yaw="velocity")
    adapter = RotorPyTrajectory(path)
    flat = adapter.update(2.0)
    for order, name in enumerate(("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot")):
        np.testing.assert_array_equal(flat[name], path(2.0, order))
    assert flat["yaw_dot"] == path.yaw(2.0, 1)
    end = adapter.update(math.inf)
    np.testing.assert_array_equal(end["x"], path(path.duration))
    assert not end["x_dot"].any() and not end["x_ddddot"].any() and end["yaw_dot"] == 0.0


def test_what_cannot_be_taken_over_is_named() -> None:
    with pytest.raises(VehicleError, match="of a rigid body"):
        from_rotorpy(crazyflie)
    with pytest.raises(VehicleError, match="x layout"):
        from_rotorpy(changed(rotor_directions=np.array([1, 1, -1, -1])))
    six = {f"r{index}": np.array([1.0, 0, 0]) for index in range(6)}
    with pytest.raises(VehicleError, match="6 rotors"):
        from_rotorpy(changed(rotor_pos=six))
    with pytest.raises(VehicleError, match="have no 'k_eta'"):
        from_rotorpy({name: value for name, value in changed().items() if name != "k_eta"})
    with pytest.raises(InputError, match="such as hummingbird_params"):
        from_rotorpy(None)
    with pytest.raises(VehicleError, match="vehicle="):
        RotorPyTrajectory(minsnap.circle(), compensation=BodyDrag((1, 1, 1)))
