"""Courses on the command line."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.vehicle import Quadrotor


@pytest.fixture
def write(tmp_path):
    def _write(text, name="course.yaml"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return _write


@pytest.mark.slow
def test_the_command_flies_a_course(call, write):
    stops = "[0, 0, 1], {center: [3, 0, 1], heading: 0, width: 1}, {x: 5, y: 2, z: 1, hold: 1}"
    write(f"waypoints: [{stops}]\ntakeoff: true\n")
    done = call("plan", "course.yaml", "--land", "--max-speed", "2", "-o", "a.csv", "--plot", "a.png", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said.get("standing") is None
    assert [part["name"] for part in said["parts"]] == ["take-off", "course", "hold", "landing"]
    assert said["max_speed"] <= 2.0 + 1e-6
    read = minsnap.read_csv("a.csv")
    assert read.position[[0, -1], 2] == pytest.approx([0, 0], abs=1e-9) and read.position[:, 2].max() > 0.99
    assert call("check", "a.csv").returncode == 0


@pytest.mark.slow
def test_gates_of_three_shapes_keep_their_margin_and_say_when_they_are_passed(call, write, tmp_path):
    square = "{center: [0,0,1], heading_deg: 0, width: 1, height: 1, margin: 0.3}"
    rest = "{center: [4,3,1], heading_deg: 90, radius: 0.5}, {corners: [[-1,3,0.5],[-3,3,0.5],[-2,3,2.5]]}"
    write(f"closed: true\nmargin: 0.2\nlimits: {{speed: 5}}\ngates: [{square}, {rest}]\n")
    said = json.loads(call("plan", "course.yaml", "--json").stdout)
    assert [passed["gate"] for passed in said["gates"]] == [0, 1, 2, 0]
    assert all(passed["clearance"] >= 0.2 - 1e-7 for passed in said["gates"])
    assert said["gates"][0]["clearance"] >= 0.3 - 1e-7 and said["start"].startswith("flying, at ")
    assert said["standing"] > 1.05 * said["duration"]
    done = call("plan", "course.yaml", "--plot", "a.svg", "--colour-by", "speed")
    assert "gate 2" in done.stdout and "m from its edge" in done.stdout and "from standing" in done.stdout
    drawn = (tmp_path / "a.svg").read_text()
    assert (
        "speed [m/s]" in drawn and f"{said['gates'][1]['instant']:.2f} s, {said['gates'][1]['speed']:.1f} m/s" in drawn
    )


def test_the_summary_warns_of_what_is_not_limited_and_says_that_the_search_was_cut_short(call, write):
    limits = "{tilt: 0.08, acceleration: null, speed: null}"
    write(f"waypoints: [[0,0,1],[10,0,1],[10,5,1]]\npieces: 3\nlimits: {limits}\nland: true\n")
    said = json.loads(call("plan", "course.yaml", "--json").stdout)
    assert "the acceleration is not limited and reaches" in said["note"] and said["interrupted"] is None
    cut = json.loads(call("plan", "course.yaml", "--max-speed", "2", "--time-limit", "1e-6", "--json").stdout)
    assert cut["interrupted"] == "yes" and cut["note"] is None


def test_limits_of_options_are_in_place_of_those_that_they_name_alone(call, write):
    """All limits of the file went, its vehicle's too: from 1 m/s to 3 m/s because more acceleration was allowed."""

    def limits(text, *options):
        write(f"waypoints: [[0, 0, 1], [4, 0, 1], [4, 3, 1]]\n{text}")
        said = json.loads(call("plan", "course.yaml", *options, "--json").stdout)
        return {used["name"]: used["limit"] for used in said["limits"]}

    slow = limits("land: true\nvehicle: crazyflie\nlimits: {speed: 1, jerk: 30}\n", "--max-acceleration", "20")
    assert slow["speed"] == 1 and slow["jerk"] == 30 and slow["acceleration"] == 20 and "rotor_thrust" in slow
    for text in ("land: true\n", ""):
        kept = limits(text + "limits: {speed: 1, jerk: 30}\n", "--max-speed", "2", "--no-limit", "acceleration")
        assert kept == {"speed": 2, "jerk": 30, "tilt": pytest.approx(np.pi / 4)}
    timed = limits("total_time: 20\nlimits: {jerk: 30}\n", "--max-speed", "2")
    assert timed == {"speed": 2, "acceleration": 6, "jerk": 30}
    held = limits("limits: {jerk: 30}\n", "--max-speed", "2", "--time", "20")
    assert held == {"speed": 2, "acceleration": 6, "jerk": 30}


@pytest.mark.parametrize("kind", ["", "laps: 1\n"], ids=["plan", "course"])
def test_obstacles_of_options_are_beside_those_of_the_file(call, write, kind):
    write(f"waypoints: [[0, 0, 1], [6, 0, 1]]\nlimits: {{speed: 2}}\navoid: [{{cylinder: [2, 0.1, 0.5]}}]\n{kind}")
    done = call("plan", "course.yaml", "--avoid", "4,-0.1,0.5", "-o", "a.csv")
    assert done.returncode == 0, done.stderr
    place = minsnap.read_csv("a.csv").position[:, :2]
    for center in ((2, 0.1), (4, -0.1)):
        assert np.linalg.norm(place - center, axis=1).min() >= 0.5 - 1e-6


@pytest.mark.parametrize("named", ["vehicle: racer.yaml", "limits: {rotors: {vehicle: racer.yaml}}"])
def test_the_file_of_the_vehicle_is_not_replaced(call, write, named):
    write(f"waypoints: [[0, 0, 1], [6, 0, 1]]\n{named}\n")
    racer = write("", "racer.yaml")
    Quadrotor.dji_f330().to_yaml(racer)
    kept = racer.read_bytes()
    done = call("plan", "course.yaml", "-o", "racer.yaml")
    assert done.returncode == 2 and "racer.yaml is the file that is read" in done.stderr
    assert racer.read_bytes() == kept


def test_a_limit_on_the_yaw_rate_leaves_a_course_its_others(call, write):
    write("waypoints: [[0, 0, 1], [4, 0, 1], [4, 3, 1]]\nland: true\n")
    said = json.loads(call("plan", "course.yaml", "--yaw", "velocity", "--max-yaw-rate", "1", "--json").stdout)
    held = {used["name"]: used["limit"] for used in said["limits"]}
    assert held == {"speed": 3, "acceleration": 6, "jerk": 30, "yaw_rate": 1}


@pytest.mark.parametrize("laps", [2, 3])
def test_a_standing_start_is_of_all_laps(call, write, laps):
    """It was of one lap, so that laps from rest seemed quicker than flying ones."""
    corners = "0,0,1\n8,0,1\n8,4,1.5\n0,4,2\n"
    write(f"x,y,z\n{corners}", "lap.csv")
    write(f"x,y,z\n{corners}0,0,1\n", "open.csv")
    flying = json.loads(call("plan", "lap.csv", "--closed", "--laps", str(laps), "--json").stdout)
    resting = json.loads(call("plan", "open.csv", "--laps", str(laps), "--json").stdout)
    assert flying["standing"] == resting["duration"] > flying["duration"]


@pytest.mark.parametrize(
    ("gate", "said"),
    [
        ("{center: [3,0,1], heading: 0, width: 1, radius: 1}", "a width or a radius"),
        ("{corners: [[3,0,0],[3,1,0],[3,0,1]], width: 1}", "no center, direction or size besides"),
        ("{center: [3,0,1], heading: 0, width: 1, margin: 0.6}", "the margin of a gate is 0.6 m"),
    ],
)
def test_malformed_gates_are_refused(call, write, gate, said):
    write(f"waypoints: [[0, 0, 1], {gate}, [6, 0, 1]]\n")
    run = call("plan", "course.yaml")
    assert run.returncode == 2 and said in run.stderr


def test_waypoints_are_flown_with_take_off_and_laps(call, write):
    write("x,y,z\n0,0,1\n3,0,1\n1,2,1\n", "w.csv")
    done = call("plan", "w.csv", "--closed", "--laps", "2", "--takeoff", "--land", "-o", "a.csv")
    assert done.returncode == 0 and "lap 2" in done.stdout and "take-off" in done.stdout
    read = minsnap.read_csv("a.csv")
    passes = np.linalg.norm(read.position - [3, 0, 1], axis=1) < 0.3
    assert np.count_nonzero(np.diff(passes.astype(int)) == 1) == 2


@pytest.mark.parametrize("words", [["--laps", "2"], ["--takeoff"], ["--land"]])
def test_a_closed_course_may_end_with_its_first_waypoint(call, write, words):
    """A file that ends where it begins was refused with --closed beside such an option, for two equal waypoints."""
    write("x,y,z\n0,0,1\n3,0,1\n1,2,1\n", "w.csv")
    write("x,y,z\n0,0,1\n3,0,1\n1,2,1\n0,0,1\n", "again.csv")
    done = [call("plan", name, "--closed", "--json", *words) for name in ("w.csv", "again.csv")]
    assert done[1].returncode == 0, done[1].stderr
    assert len({json.loads(each.stdout)["duration"] for each in done}) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["w.csv", "--laps", "2", "--time", "20"], "--time is for a plan through waypoints"),
        (["timed.csv", "--takeoff"], "timed.csv has durations"),
        (["w.csv", "--laps", "0"], "laps is 0"),
        (["how.yaml", "--laps", "2"], "how.yaml says how to plan its waypoints: --laps, --takeoff and --land are for"),
    ],
)
def test_what_does_not_go_with_a_course_is_refused(call, write, arguments, message):
    write("x,y,z\n0,0,1\n3,0,1\n", "w.csv")
    write("t,x,y,z\n0,0,0,1\n2,3,0,1\n", "timed.csv")
    write("{waypoints: [[0, 0, 1], [3, 0, 1]], corridor: 0.4}", "how.yaml")
    done = call("plan", *arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1


def test_a_plan_kept_as_a_file_says_how_its_gates_are_passed(call, tmp_path):
    gates = "{center: [4,0,1], width: 1, heading: 0}, {center: [6,3,1.5], radius: 0.5, heading_deg: 90, margin: 0.1}"
    (tmp_path / "course.yaml").write_text(f"waypoints: [[0,0,1], {gates}, [6,6,1]]\n")
    planned = json.loads(call("plan", "course.yaml", "--json", "-o", "plan.json").stdout)
    again = json.loads(call("plan", "plan.json", "--json").stdout)
    kept = json.loads((tmp_path / "plan.json").read_text())
    assert [passed["gate"] for passed in planned["gates"]] == [1, 2]
    for one, two, three in zip(planned["gates"], again["gates"], kept["certificate"]["gates"], strict=True):
        assert one == pytest.approx(two, abs=1e-9) and two == pytest.approx(three, abs=1e-12)
    assert [opening["waypoint"] for opening in kept["openings"]] == [1, 2] and kept["openings"][1]["margin"] == 0.1
    assert len(kept["openings"][0]["corners"]) == 4
