"""Extreme numbers and other kinds in simulation, tracking, missions and files: what is true, or one sentence."""

from dataclasses import is_dataclass

import numpy as np
import pytest

import minsnap
from minsnap.errors import MinsnapError
from minsnap.files.convert import read_any, write_any
from minsnap.flight.simulation import (
    CascadeController,
    ConstantWind,
    DrydenWind,
    GeometricController,
    Sensors,
    drag_feed_forward,
    simulate,
    simulate_open_loop,
)
from minsnap.flight.tracking import compare, fit_flight, simulated_log
from minsnap.vehicle import Quadrotor

P = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.5, 1.2)])
CURVE = minsnap.plan(P, [0.5, 0.5])
VEHICLE, CONTROLLER, SAMPLES = Quadrotor.crazyflie(), GeometricController(), CURVE.sample(50.0)
FLOWN = simulate(VEHICLE, CONTROLLER, CURVE, duration=0.2)
SIZES = (0.0, 5e-324, 1e-300, 1e-20, 1e20, 1e39, 1e300, np.nan, np.inf, -1.0)
KINDS = (
    *(True, "x", None, 1j, 10**400, np.array(2.0), np.array([]), np.zeros((3, 3)), np.array(None)),
    *(object(), {}, [None], np.timedelta64(1)),
)


def flown(vehicle=VEHICLE, controller=CONTROLLER, path=CURVE, **asked):
    return simulate(vehicle, controller, path, **{"duration": 0.02} | asked)


def mission(**asked):
    stops = tuple(minsnap.Stop(point) for point in P)
    return minsnap.plan_mission(minsnap.Course(**{"stops": stops, "limits": minsnap.Limits(speed=3.0)} | asked))


def at(position):
    return minsnap.Samples([0.0, 1.0], [position, (1.0, 1.0, 1.0)])


ASKED = {
    "vehicle": lambda v: flown(vehicle=v),
    "controller": lambda v: flown(controller=v),
    "path": lambda v: flown(path=v),
    "step": lambda v: flown(step=v),
    "rate": lambda v: flown(setpoint_rate=v),
    "flight time": lambda v: simulate(VEHICLE, CONTROLLER, CURVE, duration=v, step=0.05),
    "delay": lambda v: flown(setpoint_delay=v),
    "compensation": lambda v: flown(compensation=v),
    "wind": lambda v: flown(wind=v),
    "constant wind": lambda v: flown(wind=ConstantWind((v, 0, 0))),
    "gusts": lambda v: flown(wind=DrydenWind(intensity=(v, 1, 1))),
    "lengths": lambda v: flown(wind=DrydenWind(length=(v, 1, 1))),
    "airspeed": lambda v: flown(wind=DrydenWind(airspeed=v)),
    "seed of gusts": lambda v: flown(wind=DrydenWind(seed=v)),
    "sensors": lambda v: flown(sensors=v),
    "pose rate": lambda v: flown(sensors=Sensors(v)),
    "age of a pose": lambda v: flown(sensors=Sensors(delay=v)),
    "noise": lambda v: flown(sensors=Sensors(noise=v)),
    "seed": lambda v: flown(sensors=Sensors(seed=v)),
    "gain": lambda v: flown(controller=GeometricController((v, 1, 1))),
    "references": lambda v: flown(controller=CascadeController(v)),
    "speed": lambda v: flown(controller=CascadeController(climb_speed=v)),
    "tilt": lambda v: flown(controller=CascadeController(tilt_limit=v)),
    "outer rate": lambda v: flown(controller=CascadeController(outer_rate=v)),
    "open loop": lambda v: simulate_open_loop(VEHICLE, v),
    "open loop, vehicle": lambda v: simulate_open_loop(v, CURVE),
    "open loop, step": lambda v: simulate_open_loop(VEHICLE, CURVE, step=v),
    "open loop, wind": lambda v: simulate_open_loop(VEHICLE, CURVE, wind=(v, 0, 0), step=0.05),
    "feed-forward": lambda v: drag_feed_forward(VEHICLE, v),
    "feed-forward, vehicle": lambda v: drag_feed_forward(v, SAMPLES),
    "feed-forward, drag": lambda v: drag_feed_forward(VEHICLE, SAMPLES, v),
    "reference": lambda v: compare(v, SAMPLES),
    "flight": lambda v: compare(SAMPLES, v),
    "align": lambda v: compare(SAMPLES, SAMPLES, align=v),
    "longest delay": lambda v: compare(SAMPLES, SAMPLES, max_delay=v),
    "place of a flight": lambda v: compare(SAMPLES, at((v, 0, 0)), align=True),
    "time of a flight": lambda v: compare(SAMPLES, minsnap.Samples([0, v], P[:2]), align=True),
    "part": lambda v: compare(SAMPLES, SAMPLES).within(v, 1.0),
    "fit": fit_flight,
    "log": lambda v: simulated_log(VEHICLE, v, SAMPLES),
    "log, noise": lambda v: simulated_log(VEHICLE, FLOWN, SAMPLES, v),
    "log, seed": lambda v: simulated_log(VEHICLE, FLOWN, SAMPLES, seed=v),
    "course": minsnap.plan_mission,
    "stops": lambda v: mission(stops=v),
    "stop": lambda v: mission(stops=(minsnap.Stop(P[0]), v)),
    "place": lambda v: minsnap.Stop((v, 0, 1)),
    "hold": lambda v: minsnap.Stop((0, 0, 1), hold=v),
    "closed": lambda v: mission(closed=v),
    "laps": lambda v: minsnap.Course(tuple(minsnap.Stop(point) for point in P), laps=v),
    "tolerance": lambda v: mission(tolerance=v),
    "take-off": lambda v: mission(takeoff=v),
    "ground": lambda v: mission(land=(0, 0, v)),
    "file of a course": minsnap.read_course,
    "file": minsnap.read_csv,
}


def are_finite(value):
    """Whether the arrays and numbers of an answer are finite, in its parts too."""
    if isinstance(value, np.ndarray | float):
        return bool(np.isfinite(value).all())
    if isinstance(value, minsnap.Trajectory):
        return are_finite(value.control_points) and are_finite(value.durations)
    return not is_dataclass(value) or all(are_finite(part) for part in vars(value).values())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::minsnap.errors.OutsideRangeWarning", "ignore::minsnap.errors.MagnitudeWarning")
@pytest.mark.parametrize("name", ASKED)
def test_any_number_and_kind_ends_in_finite_numbers_or_a_sentence(name):
    for value in (*SIZES, *KINDS):
        try:
            answer = ASKED[name](value)
        except MinsnapError as refused:
            text = str(refused)
            assert 10 < len(text) <= 1000 and "\n" not in text and "0x" not in text
        else:
            assert are_finite(answer), value


@pytest.mark.parametrize("origin", [(np.nan, 0, 0), (0, 0), 1.0, "here", [None] * 3])
def test_nothing_is_written_with_an_origin_that_is_none(origin, tmp_path):
    with pytest.raises(minsnap.errors.FileError, match="the origin is .*: give latitude and longitude"):
        minsnap.write_csv(CURVE, tmp_path / "a.csv", origin=origin)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("value", [v for v in KINDS if not isinstance(v, str)])
def test_what_is_no_name_of_a_file_is_not_written_to(value):
    with pytest.raises(minsnap.errors.FileError, match="is no name of a file"):
        minsnap.write_csv(CURVE, value)


@pytest.mark.parametrize("longest", [0.0, 1e-300, 1e-3])
def test_a_delay_is_found_within_the_longest_allowed(longest):
    late = minsnap.Samples(SAMPLES.t + 0.1, SAMPLES.position)
    assert abs(compare(SAMPLES, late, max_delay=longest).delay) <= longest


@pytest.mark.filterwarnings("ignore::minsnap.errors.MagnitudeWarning")
@pytest.mark.parametrize("size", [5e-324, 1e-300, 1e-40, 1e9, 1e20, 1e39])
@pytest.mark.parametrize("durations", [(1e-12, 1e-12), (1e-12, 1e9), (1e9, 1e9)])
def test_extreme_trajectories_read_back_exactly(size, durations, tmp_path):
    curve = minsnap.plan(P * size, durations)
    for ending in ("npz", "json", "yaml"):
        write_any(curve, tmp_path / f"a.{ending}")
        read = read_any(tmp_path / f"a.{ending}")
        assert np.array_equal(read.control_points, curve.control_points)
        assert np.array_equal(read.durations, curve.durations)
    samples = curve.sample(10.0 / sum(durations))
    for frame in ("enu", "ned"):
        minsnap.write_csv(samples, tmp_path / "a.csv", frame=frame)
        read = minsnap.read_csv(tmp_path / "a.csv")
        for name in ("t", "position", "velocity", "acceleration", "yaw", "yaw_rate"):
            assert np.array_equal(getattr(read, name), getattr(samples, name)), (frame, name)
