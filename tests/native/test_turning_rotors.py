"""Rotors and body rate as the search has them: headings that turn, drag that differs along the body's axes."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest

from minsnap.native import build
from minsnap.native.shortest_time import InstantKind
from minsnap.trajectory.medium import Medium
from minsnap.vehicle import BodyDrag, Quadrotor, attitude

CASES, ASIDE, BODY_RATE = 20, 0.1, 6.0
DRAGS = {
    "none": BodyDrag(),
    "the same along both lateral axes": BodyDrag((0.3, 0.3, 0.05), (0.02, 0.02, 0.04)),
    "along every axis another": BodyDrag((0.3, 0.1, 0.05), (0.02, 0.05, 0.01)),
}


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    try:
        compiler = build.find_compiler()
    except build.NoCompilerError:
        pytest.skip("there is no C++ compiler")
    made = tmp_path_factory.mktemp("rotors") / "turning_rotors"
    sources = [
        __file__.replace("test_", "").replace(".py", ".cpp"),
        build.SOURCES / "shortest_time/gathered_limits.cpp",
    ]
    flags = ["-std=c++17", "-O1", "-ffp-contract=off", "-Wno-psabi", f"-I{build.SOURCES}"]
    subprocess.run([*compiler, *flags, *map(str, sources), "-o", str(made)], check=True)
    return made


def flown(vehicle, motion, yaw):
    """The thrusts of the rotors by the flatness of the vehicle, and the rate of its thrust axis."""
    drag = vehicle.flat_drag
    per_mass = zip(drag.linear / vehicle.mass, drag.quadratic / vehicle.mass, strict=True)
    media = [Medium(vehicle.gravity, *both) for both in per_mass]
    columns = tuple(part[:, None] for part in motion)
    flat = attitude.flat_motion(columns, attitude.heading_of(tuple(yaw[:, None])), media)
    frame, singular = attitude.body_frame(flat)
    rates = attitude.rates_of(flat, frame, singular)
    turn, rate = attitude.angular_accelerations_of(flat, frame, rates, singular)[:, 0], rates[:, 0]
    torque = vehicle.inertia @ turn + np.cross(rate, vehicle.inertia @ rate)
    lift = vehicle.mass * (frame[2] * flat.gamma).sum()
    return vehicle.inverse_mixer @ (lift, *torque), np.hypot(*rate[:2])


def along_velocity(motion):
    """The yaw of the velocity, its rate and acceleration."""
    v, a, j = (part[:2] for part in motion[:3])
    square, rate = v @ v, (v[0] * a[1] - v[1] * a[0]) / (v @ v)
    bend = (v[0] * j[1] - v[1] * j[0]) / square - 2.0 * rate * (v @ a) / square
    return np.array((np.arctan2(v[1], v[0]), rate, bend))


@pytest.mark.parametrize("along", [False, True], ids=["of a yaw in time", "of a yaw along the velocity"])
@pytest.mark.parametrize("name", DRAGS)
def test_thrusts_and_their_gradients_are_those_of_the_vehicle(program, name, along):
    drag = DRAGS[name]
    vehicle, draw = replace(Quadrotor.dji_f330(), drag=drag), np.random.default_rng(58)
    least, most = vehicle.rotor_thrust_limits
    parts = drag.linear / vehicle.mass, drag.quadratic / vehicle.mass, vehicle.inertia, vehicle.inverse_mixer
    linear, quadratic, inertia, mixer = (part.reshape(-1) for part in parts)
    given = [vehicle.gravity, *linear, *quadratic, vehicle.mass, least, most, *inertia, *mixer, ASIDE, BODY_RATE]
    wanted, rates = [], []
    for _ in range(CASES):
        motion = [draw.normal(size=3) * size for size in (5.0, 4.0, 20.0, 100.0)]
        yaw = along_velocity(motion) if along else draw.normal(size=3) * (2.0, 2.0, 8.0)
        heading = (
            [part[:2] for part in motion[:3]]
            if along
            else [each[:2, 0] for each in attitude.heading_of(tuple(yaw[:, None]))]
        )
        given += [
            *np.concatenate(motion if along or not drag.absent else motion[1:]),
            *np.concatenate(heading),
            float(along),
        ]
        for all_, one in zip((wanted, rates), flown(vehicle, motion, yaw), strict=True):
            all_.append(one)
    text = " ".join(repr(float(value)) for value in given)

    def found(kind, functions):
        """Values of the functions, and their gradients in two ways."""
        asked = [program, str(CASES), str(int(along)), str(int(kind))]
        run = subprocess.run(asked, input=text, capture_output=True, text=True, check=True)
        numbers = np.array([line.split() for line in run.stdout.splitlines()], dtype=float)
        sums, slopes = numbers[:, functions:].reshape(CASES, functions, 2, -1).transpose(2, 0, 1, 3)
        np.testing.assert_allclose(sums, slopes, rtol=1e-9, atol=1e-9)
        return numbers[:, :functions]

    values = found(InstantKind.TURNING_ROTORS, 9)
    rotors = values[:, :4] * most + most
    np.testing.assert_allclose(rotors, wanted, rtol=1e-9, atol=1e-9 * most)
    np.testing.assert_allclose(least - values[:, 4:8] * most, rotors, rtol=1e-12, atol=1e-12 * most)
    values = found(InstantKind.TURNING_BODY_RATE, 1)
    np.testing.assert_allclose(np.sqrt(2.0 * values[:, 0] + 1.0) * BODY_RATE, rates, rtol=1e-9)
