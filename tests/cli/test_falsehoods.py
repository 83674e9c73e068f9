"""What a beginner was told wrongly, or not at all."""

from __future__ import annotations

import numpy as np
import pytest

import minsnap

LAP = "x,y,z\n0,0,1\n4,0,1\n4,3,1\n0,3,1\n0,0,1\n"
COURSE = "waypoints: [[0,0,1], {place}, [4,3,1]]\n"


@pytest.mark.slow
def test_binary_setpoints_are_not_written_into_a_csv(call, tmp_path):
    assert call("rect", "-o", "a.json").returncode == 0
    run = call("convert", "a.json", "b.csv", "--to", "px4")
    assert run.returncode == 2 and not (tmp_path / "b.csv").exists()
    assert "b.csv is named as setpoints is and was to hold px4: name it *.npy" in run.stderr
    assert call("convert", "a.json", "b.npy", "--to", "px4").returncode == 0
    assert call("rect", "--pieces", 1, "-o", "c.csv", "--format", "crazyflie").returncode == 0


@pytest.mark.parametrize("widths", ["0.3,0.3", "0.3,0.4,0.3,0.3,0.3"])
def test_half_widths_are_as_many_as_legs(call, tmp_path, widths):
    (tmp_path / "lap.csv").write_text(LAP)
    for command in (("plan", "lap.csv"), ("rect",)):
        run = call(*command, "--corridor", widths)
        assert run.returncode == 2 and "half-width" in run.stderr and "4 legs" in run.stderr


def test_a_map_without_a_way_is_status_1_closed_or_too_narrow(call, tmp_path):
    cells = np.zeros((20, 20))
    cells[10] = 1
    np.save(tmp_path / "closed.npy", cells)
    cells[10, 9:11] = 0
    np.save(tmp_path / "narrow.npy", cells)
    for name, said in (("closed", "close it off"), ("narrow", "too narrow")):
        ends = ("--start", 0.35, 0.95, "--goal", 1.7, 1.0)
        run = call("route", f"{name}.npy", "--resolution", 0.1, *ends, "--clearance", 0.3)
        assert run.returncode == 1 and said in run.stderr


@pytest.mark.slow
def test_files_take_the_names_of_vehicles_of_the_command_line(call, tmp_path):
    (tmp_path / "a.yaml").write_text(COURSE.format(place="[4,0,1]") + "vehicle: f330\n")
    assert call("plan", "a.yaml").returncode == 0
    (tmp_path / "b.yaml").write_text(COURSE.format(place="[4,0,1]") + "vehicle: f450\n")
    run = call("plan", "b.yaml")
    assert run.returncode == 2 and "no vehicle is called 'f450': choose one of crazyflie, dji_f330" in run.stderr


def test_a_heading_of_90_is_asked_whether_it_is_degrees(call, tmp_path):
    (tmp_path / "a.yaml").write_text(COURSE.format(place="{center: [4,0,1], width: 1, height: 1, heading: 90}"))
    run = call("plan", "a.yaml")
    assert run.returncode == 2 and "heading is 90 rad, beyond a turn: write heading_deg: 90 for degrees" in run.stderr


def test_a_gate_that_is_listed_apart_is_named_as_that(call, tmp_path):
    gates = "gates: [{center: [2,0,1], width: 1, heading: 0}, {center: [4,0,1], width: 1, heading: 90}]\n"
    (tmp_path / "a.yaml").write_text("waypoints: [[0,0,1], [1,0,1]]\n" + gates)
    assert "a.yaml: gates 1: heading is 90 rad" in call("plan", "a.yaml").stderr


def test_a_tilt_is_told_in_the_degrees_that_it_was_asked_in(call):
    run = call("line", "--max-tilt", 5)
    assert "limit tilt          100.00 %, 5 of 5 degrees, on leg 0" in run.stdout


@pytest.mark.slow
def test_a_lower_limit_says_the_least_value_and_its_bound(call, tmp_path):
    (tmp_path / "a.yaml").write_text(COURSE.format(place="[4,0,1]") + "vehicle: f330\n")
    lines = call("plan", "a.yaml").stdout.splitlines()
    (line,) = (line for line in lines if line.startswith("limit min rotor thrust"))
    assert " %, least " in line and ", not below " in line and " N, on leg " in line


@pytest.mark.slow
def test_the_drag_of_another_vehicle_than_the_courses_is_said(call, tmp_path):
    (tmp_path / "a.yaml").write_text(COURSE.format(place="[4,0,1]") + "vehicle: crazyflie\n")
    run = call("plan", "a.yaml", "--vehicle", "f330", "-o", "a.csv")
    assert run.returncode == 0 and "the course is planned for " in run.stdout
    same = call("plan", "a.yaml", "--vehicle", "crazyflie", "-o", "a.csv")
    assert same.returncode == 0 and "the course is planned for " not in same.stdout


@pytest.mark.slow
def test_a_figure_of_a_vehicles_plan_draws_its_rotors_and_fills_its_left_side():
    vehicle = minsnap.vehicle.Quadrotor.crazyflie()
    limits = minsnap.Limits.of(vehicle)
    path = minsnap.plan([[0, 0, 1], [4, 0, 1], [4, 3, 1]], limits=limits)
    figure = minsnap.plot.plot_overview(path, limits=limits)
    assert "rotor 4" in [line.get_label() for line in figure.subfigs[1].axes[-1].lines]
    lap = minsnap.rectangle(6.0, 4.0, limits=minsnap.Limits(speed=3.0, acceleration=6.0))
    drawn = minsnap.plot.plot_overview(lap)
    drawn.canvas.draw()
    place = drawn.subfigs[0]
    assert place.axes[0].get_window_extent().height > 0.7 * place.bbox.height


def test_axes_of_a_constant_altitude_have_no_offset():
    path = minsnap.plan([[0, 0, 1.5], [4, 0, 1.5 + 1e-12], [4, 3, 1.5]], durations=[3, 3])
    axes = minsnap.plot.plot_path(path, view="xz")
    axes.figure.canvas.draw()
    assert axes.yaxis.get_offset_text().get_text() == ""
