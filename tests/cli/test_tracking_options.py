"""The options ``--tracking`` and ``--wind``: plans with room for the vehicle's loop, and checks of the vehicle."""

import json

import pytest

import minsnap


@pytest.fixture
def run(call):
    def asked(*arguments, code=0):
        done = call(*arguments)
        assert done.returncode == code, done.stderr
        return done

    return asked


@pytest.fixture
def points(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x,y,z\n0,0,1\n6,0,1\n6,4,1\n")
    return file


def test_a_plan_with_room_is_checked_with_its_loop(points, run, tmp_path):
    out = tmp_path / "plan.json"
    done = run("plan", points, "--corridor", 1.2, "--tracking", "px4", "--wind", 1, "-o", out, "--json")
    figures = json.loads(done.stdout)
    assert figures["wind"] == 1.0
    assert figures["strongest_wind"] >= 1.0
    assert figures["tube"] < 2.4
    text = run("check", out, "--tracking", "px4", "--wind", 1).stdout
    assert "tracking error" in text
    assert "strongest wind" in text
    worse = run("check", out, "--tracking", "px4", "--wind", 20, "--json", code=1)
    told = json.loads(worse.stdout)
    assert any("in a wind that changes by 20 m/s the vehicle does not keep" in each for each in told["problems"])
    assert told["vehicle"]["left"]


def test_a_loop_from_a_file_and_a_rectangle(run, tmp_path):
    (tmp_path / "mine.yaml").write_text("autopilot: ardupilot\ndrag: 0.2\n")
    text = run("rect", "--corridor", 1, "--tracking", tmp_path / "mine.yaml", "--wind", 0.5).stdout
    assert "in a wind that changes by 0.5 m/s" in text


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--wind", 2), "give --tracking px4"),
        (("--tracking", "betaflight"), "px4, ardupilot, or a YAML file"),
        (("--tracking", "px4", "--wind", -1), "from 0 to 100 m/s"),
        (("--tracking", "none.yaml"), "none.yaml"),
    ],
)
def test_bad_loops_are_refused_in_one_sentence(points, run, options, said):
    assert said in run("plan", points, *options, code=2).stderr


def test_setpoints_say_that_they_are_no_plan_for_a_loop(points, run, tmp_path):
    run("plan", points, "-o", tmp_path / "path.csv")
    assert "holds no plan" in run("check", tmp_path / "path.csv", "--tracking", "px4", code=2).stderr


def test_a_course_is_planned_in_a_loop_and_checked_in_it(points, run, tmp_path):
    told = run("plan", points, "--takeoff", "--tracking", "px4", "--wind", 0.5, "-o", tmp_path / "course.json").stdout
    assert "strongest wind" in told and "keeps all of it in a wind that changes by 0.5 m/s" in told
    assert "strongest wind" in run("check", tmp_path / "course.json", "--tracking", "px4", "--wind", 0.5).stdout


WAYS = {
    "course": "takeoff: true\n",
    "plan": "corridor: 1.2\n",
}


@pytest.mark.parametrize("kind", WAYS)
def test_a_file_says_loop_and_wind_and_options_take_precedence(run, tmp_path, kind):
    (tmp_path / "mine.yaml").write_text("autopilot: px4\ndrag: 0.2\n")
    file = tmp_path / "way.yaml"
    file.write_text("waypoints: [[0, 0, 1], [6, 0, 1], [6, 4, 1]]\ntracking: mine.yaml\nwind: 0.5\n" + WAYS[kind])
    told = run("plan", file).stdout
    assert "in a wind that changes by 0.5 m/s" in told
    by_option = json.loads(run("plan", file, "--wind", 0.25, "--tracking", "ardupilot", "--json").stdout)
    assert by_option["wind"] == 0.25
    assert json.loads(run("plan", file, "--json").stdout)["tube"] != by_option["tube"]
    file.write_text(file.read_text().replace("mine.yaml", "other.yaml"))
    assert "other.yaml" in run("plan", file, code=2).stderr
    file.write_text(file.read_text().replace("tracking: other.yaml", ""))
    assert "give --tracking px4" in run("plan", file, code=2).stderr


def test_a_fleet_is_checked_in_its_loops(run, tmp_path):
    lanes = [[(0, y, 1), (6, y, 1)] for y in (0.0, 1.6)]
    fleet = minsnap.plan_fleet(lanes, limits=minsnap.Limits(speed=2.0, acceleration=3.0), separation=0.5)
    (tmp_path / "out").mkdir()
    for index, path in enumerate(fleet):
        path.save(tmp_path / "out" / f"{index}.traj")
    known = ("check", tmp_path / "out", "--separation", 0.5, "--tracking", "px4")
    assert "strongest wind" in run(*known, "--wind", 0.5).stdout
    assert "nearer than their separation" in run(*known, "--wind", 3, code=1).stdout
