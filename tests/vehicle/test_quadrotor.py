import math
from dataclasses import replace

import numpy as np
import pytest

from minsnap.errors import FileError, VehicleError
from minsnap.flight.thesis import published_drag
from minsnap.vehicle import RPM, BodyDrag, Quadrotor, RotorSpeedDrag, SumOfDrags, read_vehicle
from minsnap.vehicle.quadrotor import vehicle_from

GOOD = {
    "mass": 1.0,
    "inertia": np.array([0.005, 0.006, 0.009]),
    "arm_length": 0.2,
    "thrust_coefficient": 7e-6,
    "torque_coefficient": 2e-7,
    "rotor_speed_max": 1000.0,
}


def test_the_f330_hovers_near_5_7_krpm_with_the_coefficients_of_the_thesis() -> None:
    quad = Quadrotor.dji_f330()
    assert quad.thrust_coefficient * RPM**2 == pytest.approx(7.456e-8, rel=1e-12)
    assert quad.torque_coefficient * RPM**2 == pytest.approx(2.278e-9, rel=1e-12)
    assert quad.hover_rotor_speed / RPM == pytest.approx(5734, abs=1)
    np.testing.assert_allclose(quad.wrench([quad.hover_rotor_speed] * 4), [quad.weight, 0, 0, 0], atol=1e-12)
    assert quad.max_thrust_to_weight == pytest.approx(4 * 7.456e-8 * 9500**2 / (1.0 * 9.80665))


def test_the_crazyflie_lifts_itself() -> None:
    quad = Quadrotor.crazyflie()
    assert 1.5 < quad.max_thrust_to_weight < 2.5 and 0.02 < quad.mass < 0.04


def test_the_plus_layout_has_the_equations_of_the_thesis() -> None:
    quad = Quadrotor(**GOOD, layout="+")
    one, two, three, four = np.array([100.0, 200.0, 300.0, 400.0]) ** 2
    k, torque, arm = 7e-6, 2e-7, 0.2
    expected = [
        k * (one + two + three + four),
        arm * k * (one - three),
        arm * k * (two - four),
        torque * (one - two + three - four),
    ]
    np.testing.assert_allclose(quad.wrench([100.0, 200.0, 300.0, 400.0]), expected, rtol=1e-13)


def test_torques_of_the_x_layout_are_lever_times_force() -> None:
    quad = Quadrotor(**GOOD, layout="x")
    speeds = np.array([300.0, 400.0, 500.0, 600.0])
    forces = 7e-6 * speeds**2
    torque = np.cross(quad.rotor_positions, np.outer(forces, [0, 0, 1])).sum(axis=0)
    np.testing.assert_allclose(quad.wrench(speeds)[1:3], torque[:2], rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(quad.rotor_positions, axis=1), 0.2)
    assert (quad.rotor_positions[0] > [0, 0, -1]).all(), "rotor 1 is front left"


@pytest.mark.parametrize("layout", ["x", "+"])
def test_mixing_there_and_back(layout: str) -> None:
    quad = Quadrotor(**GOOD, layout=layout)
    speeds = np.random.default_rng(0).uniform(100, 900, (7, 5, 4))
    np.testing.assert_allclose(quad.rotor_speeds(quad.wrench(speeds)), speeds, rtol=1e-12)


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("mass", 0.0, "mass is 0.0: it must be a number above 0"),
        ("mass", -1.0, "mass"),
        ("mass", math.nan, "mass.*finite"),
        ("mass", "heavy", "mass.*number"),
        ("inertia", [0.01, 0.01, -0.01], "not positive definite"),
        ("inertia", [0.005, 0.005, 0.02], "of a rigid body"),
        ("inertia", [[0.01, 0.001, 0], [0, 0.01, 0], [0, 0, 0.01]], "not symmetric"),
        ("inertia", [0.01, 0.01], "3 finite moments"),
        ("inertia", "none", "3 finite moments"),
        ("layout", "h", "layout is 'h'.*x, \\+"),
        ("arm_length", 0, "arm_length"),
        ("rotor_speed_min", 2000.0, "below the upper"),
        ("rotor_speed_min", -1.0, "rotor_speed_min"),
        ("motor_time_constant", -0.1, "motor_time_constant"),
        ("drag", 3.0, "force method"),
    ],
)
def test_what_is_no_vehicle_is_named(field: str, value: object, says: str) -> None:
    with pytest.raises(VehicleError, match=says):
        Quadrotor(**(GOOD | {field: value}))


def test_the_inertia_is_owned_and_read_only() -> None:
    mine = np.array([0.005, 0.006, 0.009])
    quad = Quadrotor(**(GOOD | {"inertia": mine}))
    mine[:] = 0
    np.testing.assert_array_equal(np.diag(quad.inertia), [0.005, 0.006, 0.009])
    with pytest.raises(ValueError):
        quad.inertia[0, 0] = 1.0


@pytest.mark.parametrize(
    "drag",
    [
        BodyDrag((0.1, 0.2, 0.3), (0.01, 0.02, 1 / 3)),
        RotorSpeedDrag((1e-7, 2e-7, 0)),
        published_drag("linear"),
        published_drag("propeller"),
    ],
)
def test_yaml_reads_back_exactly(tmp_path, drag) -> None:
    first = Quadrotor(**GOOD, drag=drag, layout="+", motor_time_constant=0.03, name="mine")
    first.to_yaml(tmp_path / "quad.yaml")
    second = Quadrotor.from_yaml(tmp_path / "quad.yaml")
    assert (second.mass, second.layout, second.name) == (1.0, "+", "mine")
    assert second.motor_time_constant == 0.03
    np.testing.assert_array_equal(second.inertia, first.inertia)
    air = np.random.default_rng(0).normal(size=(9, 3))
    known = {"pitch": np.full(9, 0.1), "rotor_speed": 500.0}
    np.testing.assert_array_equal(second.drag.force(air, **known), drag.force(air, **known))


FIELDS = """mass: 1.0
inertia: [0.005, 0.006, 0.009]
arm_length: 0.2
thrust_coefficient: 7.0e-6
torque_coefficient: 2.0e-7
rotor_speed_max: 1000.0
"""


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        ("mass: 1.0\n", VehicleError, "has no inertia and no arm_length"),
        ("- 1\n", VehicleError, "give the fields of a vehicle by name"),
        ("mass: 1.0\nwings: 2\n", VehicleError, "'wings' is not known: the keys are mass"),
        ("mas: 1.0\n", VehicleError, "quad.yaml: 'mas' is not known: did you mean mass"),
        (FIELDS.replace("mass: 1.0", "mass: -1"), VehicleError, "quad.yaml: mass is -1.0: it must be a number above 0"),
        ("mass: [1\n", FileError, "line"),
        ("mass: !!python/object/apply:os.getcwd []\n", FileError, "line 1"),
    ],
)
def test_bad_descriptions_are_named(tmp_path, text: str, error: type, says: str) -> None:
    (tmp_path / "quad.yaml").write_text(text)
    with pytest.raises(error, match=says):
        read_vehicle(tmp_path / "quad.yaml")


def test_a_drag_without_description_is_not_written(tmp_path) -> None:
    quad = Quadrotor(**GOOD, drag=SumOfDrags((BodyDrag(), published_drag("linear"))))
    with pytest.raises(VehicleError, match="SumOfDrags"):
        quad.to_yaml(tmp_path / "quad.yaml")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "drag",
    [
        {"linear": [1, 2]},
        {"linear": [1, 2, -3]},
        {"surface": {"name": "mine", "variables": ["velocity"], "coefficients": [1.0]}},
        {"surface": {"name": "mine", "variables": ["velocity"], "exponents": [[0, 1]], "coefficients": [1.0]}},
        {"surface": {"name": "mine", "variables": ["velocity"], "exponents": [[0], [1]], "coefficients": [1.0]}},
        {"surface": {"name": "mine", "variables": ["humidity"], "exponents": [[1]], "coefficients": [1.0]}},
        {"lift": 1},
        3.0,
        {"published": "linear"},
        {"per_rotor_speed": [1e-7, 1e-7, 0], "x": 1},
    ],
)
def test_bad_drags_in_descriptions_are_named(drag: object) -> None:
    with pytest.raises(VehicleError, match="drag"):
        vehicle_from(GOOD | {"inertia": list(GOOD["inertia"]), "drag": drag})


def test_a_long_value_is_shortened_in_the_message():
    with pytest.raises(VehicleError, match="inertia is ") as refused:
        replace(Quadrotor.crazyflie(), inertia=[["1." + 400 * "6", "x", 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert len(str(refused.value)) < 250
