"""Fits to logs of simulated flights in real formats: the truth is known, and lies within the standard errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
from flown_logs import Measured, dataflash_of, ulog_of

import minsnap
from minsnap.errors import FileError, FitError
from minsnap.files.flight_log import FlightLog
from minsnap.flight import CascadeController, ConstantWind, fit_flight, plot_flight_fit, simulate, simulated_log
from minsnap.flight.mavlink.observer import StreamLog
from minsnap.flight.mavlink.setpoints import Setpoint
from minsnap.flight.mavlink.vehicle_messages import VehicleState
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import BodyDrag, Quadrotor, read_vehicle

COURSE = [(0, 0, 2), (6, 0, 2), (6, 4, 4), (0, 4, 1), (0, 0, 2)]
LINEAR, QUADRATIC, WIND = (0.6, 0.45, 0.3), (0.09, 0.12, 0.12), (1.5, -0.8)
WRITERS = {"flight.ulg": ulog_of, "flight.bin": dataflash_of}


def flown(drag, wind=(0.0, 0.0), yaw=0.0, mass=1.0, **vehicle):
    vehicle = replace(Quadrotor.px4_sih(), mass=mass, drag=drag, **vehicle)
    path = minsnap.plan(COURSE, total_time=14.0, corridor=0.5, yaw=yaw)
    return vehicle, simulate(vehicle, CascadeController(), path, wind=ConstantWind((*wind, 0.0)))


@pytest.fixture(scope="module")
def windy():
    """A flight that turns, in wind, of a vehicle whose drag has all parts."""
    return flown(BodyDrag(LINEAR, QUADRATIC), WIND, yaw=[0.0, 1.0, 2.5, 4.0, 5.0])


@pytest.fixture(scope="module")
def calm():
    """A flight with one heading, of a vehicle with linear drag alone."""
    return flown(BodyDrag((0.9, 0.7, 0.5)))


def near(number, truth, errors=3.0):
    return abs(number.value - truth) <= errors * number.error


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
def test_drag_wind_and_hover_are_told_from_accelerometer_and_attitude(tmp_path, windy, name):
    (tmp_path / name).write_bytes(WRITERS[name](Measured(*windy, bias=(0.05, -0.03, 0.0), hover=0.4)))
    found = fit_flight(tmp_path / name)
    for axis, linear, quadratic in zip(found.axes, LINEAR, QUADRATIC, strict=True):
        assert near(axis.linear, linear) and near(axis.quadratic, quadratic)
        assert axis.linear.error < 0.03 and axis.quadratic.error < 0.01
    assert all(near(told, truth) and told.error < 0.05 for told, truth in zip(found.wind, WIND, strict=True))
    assert near(found.hover, 0.4) and found.notes == ()


@pytest.mark.slow
def test_standard_errors_are_those_of_repeated_flights(tmp_path, calm):
    """Normalised errors of 20 logs with different noise have about unit variance."""
    deviations = []
    for seed in range(20):
        (tmp_path / "a.ulg").write_bytes(ulog_of(Measured(*calm, seed=seed, noise=0.3)))
        found = fit_flight(tmp_path / "a.ulg")
        deviations += [
            (axis.linear.value - k) / axis.linear.error for axis, k in zip(found.axes[:2], (0.9, 0.7), strict=True)
        ]
    assert 0.5 < np.sqrt(np.mean(np.square(deviations))) < 1.8


@pytest.mark.slow
def test_what_a_flight_does_not_tell_is_said(tmp_path, calm):
    (tmp_path / "a.ulg").write_bytes(ulog_of(Measured(*calm)))
    found = fit_flight(tmp_path / "a.ulg")
    assert found.wind is None and any("needs a flight with several headings" in note for note in found.notes)
    assert all(axis.quadratic is None for axis in found.axes)
    assert sum("is not told from zero" in note for note in found.notes) == 3
    along = minsnap.line((0, 0, 2), (12, 0, 2), total_time=20.0)
    vehicle = replace(Quadrotor.px4_sih(), drag=BodyDrag((0.8, 0.8, 0.8)))
    (tmp_path / "b.ulg").write_bytes(ulog_of(Measured(vehicle, simulate(vehicle, CascadeController(), along))))
    found = fit_flight(tmp_path / "b.ulg")
    assert near(found.axes[0].linear, 0.8) and found.axes[1].linear is None and found.axes[2].linear is None
    assert any("drag along y of the body is not told: the speed along it varied by 0.0" in note for note in found.notes)
    assert found.drag(2.0).linear == pytest.approx([2 * found.axes[0].linear.value] * 2 + [0.0])


@pytest.mark.slow
@pytest.mark.parametrize("throttle", [0.0, np.nan, -0.5])
def test_a_throttle_that_pushes_nothing_tells_nothing(tmp_path, calm, throttle):
    """It was divided by, or there was none left to interpolate."""
    measured = Measured(*calm)
    measured.throttle = np.full_like(measured.throttle, throttle)
    (tmp_path / "a.ulg").write_bytes(ulog_of(measured))
    found = fit_flight(tmp_path / "a.ulg")
    assert near(found.axes[0].linear, 0.9) and found.hover is None and found.axes[2].linear is None
    assert "drag along z of the body and the hover throttle are not told: the log has no throttle" in found.notes


@pytest.mark.slow
def test_drag_is_per_mass_and_a_vehicle_has_it(tmp_path):
    heavy = flown(BodyDrag((1.8, 1.8, 1.8)), mass=2.0)
    (tmp_path / "a.ulg").write_bytes(ulog_of(Measured(*heavy)))
    found = fit_flight(tmp_path / "a.ulg")
    assert near(found.axes[0].linear, 0.9)
    vehicle = found.vehicle(mass=2.0)
    assert vehicle.mass == 2.0 and vehicle.drag.linear[:2] == pytest.approx([1.8, 1.8], abs=0.03)
    assert found.vehicle(base=Quadrotor.dji_f330()).arm_length == Quadrotor.dji_f330().arm_length


def stream_log(path, flight, samples, delay=0.0):
    """The log of a stream at 20 Hz with positions at 20 Hz, written by the class that writes real ones."""
    log = StreamLog(path, "ned", 0.0)
    rows = zip(samples.t, samples.position, samples.velocity, samples.acceleration, strict=True)
    for t, place, speed, push in rows:
        ned = [(float(y), float(x), -float(z)) for x, y, z in (place, speed, push)]
        log.setpoint(float(t), 0, Setpoint(*ned), 0, 0.0)
    noise = np.random.default_rng(5)
    for k in range(0, len(flight.t), 12):
        place, speed = (
            flight.position[k] + 0.005 * noise.normal(size=3),
            flight.velocity[k] + 0.01 * noise.normal(size=3),
        )
        ned = [(float(y), float(x), -float(z)) for x, y, z in (place, speed)]
        log.position(float(flight.t[k]), replace(VehicleState(), position=ned[0], velocity=ned[1]))
    log.close()


@pytest.mark.slow
@pytest.mark.parametrize("drag", [1.0, 0.3])
def test_drag_from_setpoints_and_velocities_alone(tmp_path, drag):
    path = minsnap.plan([(0, 0, 2), (8, 0, 2), (8, 4, 2), (0, 4, 2), (0, 0, 2)], total_time=12.0, corridor=0.3)
    vehicle = replace(Quadrotor.px4_sih(), drag=BodyDrag((drag,) * 3))
    samples = path.sample(20.0)
    flight = simulate(vehicle, CascadeController(), samples, setpoint_delay=0.1)
    stream_log(tmp_path / "log.csv", flight, samples)
    found = fit_flight(tmp_path / "log.csv")
    assert found.source == "setpoints and velocity"
    assert near(found.axes[0].linear, drag, 1.5) and found.axes[0].linear == found.axes[1].linear
    assert found.axes[2].linear is None and found.wind is None and found.hover is None
    assert any("the log has no attitude and accelerometer" in note for note in found.notes)
    assert 0.05 < found.delay.value < 1.0


def interrupted(log, start, end):
    """A log in which nothing was written for a while."""

    def kept(t, *values):
        rows = (t < start) | (t > end)
        return t[rows], *(each[rows] for each in values)

    felt = log.inertial
    attitude, force = kept(felt.attitude_t, felt.quaternion), kept(felt.force_t, felt.specific_force)
    reference, flight = (each[(each.t < start) | (each.t > end)] for each in (log.reference, log.flight))
    inertial = type(felt)(*attitude, *force, *kept(felt.throttle_t, felt.throttle))
    return replace(log, reference=reference, flight=flight, inertial=inertial)


@pytest.mark.slow
def test_gaps_of_a_log_are_left_out():
    """Straight lines were drawn across gaps: 3 s of 21 s made a drag of 1.0 along x one of -0.3, from setpoints 0.4."""
    path = minsnap.circle(radius=3.0, period=6.0, laps=3)
    flight = simulate(Quadrotor.px4_sih(), CascadeController(), path, setpoint_rate=20.0, setpoint_delay=0.1)
    log = simulated_log(Quadrotor.px4_sih(), flight, path.sample(20.0))
    for start in (3.0, 8.5):
        found = fit_flight(interrupted(log, start, start + 3.0))
        assert [axis.linear.value for axis in found.axes] == pytest.approx([1.0, 1.0, 1.0], abs=0.02)
        assert found.hover.value == pytest.approx(fit_flight(log).hover.value, rel=1e-3)
        assert found.notes[0].startswith("samples are missing for 3.0")
        told = fit_flight(replace(interrupted(log, start, start + 3.0), inertial=None))
        assert told.axes[0].linear.value == pytest.approx(1.0, abs=0.1)
        assert told.delay.value == pytest.approx(fit_flight(log).delay.value, abs=0.02)
        assert told.notes[-1].endswith("drag was fitted to the longest part between gaps")
    with pytest.raises(FitError, match="together, without gaps, for less than 5 s"):
        fit_flight(replace(interrupted(interrupted(log, 4.0, 5.0), 9.0, 17.0), inertial=None))
    lost = log.inertial.attitude_t < 6.0
    lost = replace(log.inertial, attitude_t=log.inertial.attitude_t[lost], quaternion=log.inertial.quaternion[lost])
    with pytest.raises(FitError, match="attitude, accelerometer and velocity were logged together for less than 5 s"):
        fit_flight(interrupted(replace(log, inertial=lost), 2.0, 4.0))


def test_the_delay_of_the_response():
    path = minsnap.rectangle(6, 4, corridor=0.3, total_time=12.0)
    asked = path.sample(50.0)
    late = Samples(asked.t + 0.27, asked.position + [0.1, 0.0, 0.0], asked.velocity)
    found = fit_flight(FlightLog(asked, late, 0.0))
    assert found.delay.value == pytest.approx(0.27, abs=2e-3) and found.delay.error < 0.01


def test_logs_that_tell_nothing(tmp_path):
    rest = Samples(np.arange(200) / 20.0, np.zeros((200, 3)), np.zeros((200, 3)))
    with pytest.raises(FitError, match="less than 5 s of flight"):
        fit_flight(FlightLog(rest, rest, 0.0))
    moved = minsnap.line(total_time=10.0).sample(20.0)
    with pytest.raises(FitError, match="neither attitude and accelerometer nor setpoints"):
        fit_flight(FlightLog(None, moved, 0.0))
    with pytest.raises(FitError, match="setpoints of the log have no velocities"):
        fit_flight(FlightLog(replace(moved, velocity=None, acceleration=None), moved, 0.0))
    with pytest.raises(FitError, match="has no velocities: log them"):
        fit_flight(FlightLog(moved, replace(moved, velocity=None), 0.0))
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    with pytest.raises(FileError, match="is no log of a flight"):
        fit_flight(tmp_path / "a.csv")


def test_the_figure_has_a_panel_for_each_axis(tmp_path, calm):
    (tmp_path / "a.ulg").write_bytes(ulog_of(Measured(*calm)))
    figure = plot_flight_fit(fit_flight(tmp_path / "a.ulg"))
    assert [len(ax.lines) for ax in figure.axes] == [2, 2, 2]
    assert "speed along y of the body" in figure.axes[1].get_xlabel()


@pytest.mark.slow
def test_the_vehicle_and_the_figures_can_be_stored(tmp_path, windy):
    (tmp_path / "a.bin").write_bytes(dataflash_of(Measured(*windy)))
    found = fit_flight(tmp_path / "a.bin")
    found.vehicle(name="mine").to_yaml(tmp_path / "v.yaml")
    assert read_vehicle(tmp_path / "v.yaml").drag.linear == pytest.approx(found.drag(1.0).linear, rel=1e-15)
    told = json.loads(json.dumps(found.as_dict()))
    assert told["drag per mass"]["x"]["linear"]["value"] == found.axes[0].linear.value


def test_the_command_writes_no_vehicle_with_a_negative_drag(tmp_path, calm, monkeypatch, capsys):
    """The accelerometer of this flight is pushed forwards by its speed, as that of no vehicle is."""
    from minsnap.cli import main

    vehicle, flight = calm
    pushed = replace(vehicle, drag=BodyDrag((0.0, 0.7, 0.5)))
    measured = Measured(pushed, flight)
    turned = flight.velocity[:, :1] * measured.rotation[:, 1, :1]
    measured.force[:, 0] += 0.7 * turned[:, 0]
    (tmp_path / "odd.ulg").write_bytes(ulog_of(measured))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        main(["fit", "odd.ulg", "-o", "odd.yaml"])
    assert left.value.code == 2
    assert "no vehicle has a negative one" in capsys.readouterr().err
    assert not (tmp_path / "odd.yaml").exists()
