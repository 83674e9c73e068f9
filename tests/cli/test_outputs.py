"""What -o writes: the format of its ending, and every command reads it again."""

import json
import os

import numpy as np
import pytest

import minsnap
from minsnap.cli.output import as_json
from minsnap.files.convert import read_any
from minsnap.files.formats.crazyflie import MEMORY
from minsnap.files.formats.polynomials import read_polynomials

RECT = ("rect", "--corridor", "0.4", "--time", "14")


@pytest.mark.parametrize("ending", ["json", "yaml", "npz", "traj", "csv", "parquet"])
def test_the_ending_is_the_format(call, tmp_path, ending):
    done = call(*RECT, "-o", f"r.{ending}")
    assert done.returncode == 0 and f"r.{ending}" in done.stdout, done.stderr
    found = read_any(tmp_path / f"r.{ending}")
    path = minsnap.rectangle(corridor=0.4, total_time=14.0)
    place = found(3.0) if hasattr(found, "legs") else found.position[60]
    assert place == pytest.approx(path(3.0), abs=4e-3)


def test_the_format_can_be_named(call, tmp_path):
    done = call(*RECT, "-o", "x.traj", "--format", "crazyflie-compressed")
    assert done.returncode == 0 and "the format moves the curve by" in done.stdout
    assert (tmp_path / "x.traj").stat().st_size <= MEMORY
    assert call(*RECT, "-o", "x.csv", "--format", "crazyflie").returncode == 0
    assert (tmp_path / "x.csv").read_text().startswith("duration,x^0")


@pytest.mark.parametrize(
    "words",
    [
        ("circle", "--format", "crazyflie"),
        ("circle", "--frame", "ned", "--plot", "a.png"),
        ("circle", "--rate", 50),
        ("fit", "none.ulg", "--base", "mine.yaml"),
        ("fit", "none.ulg", "--mass", 2),
    ],
)
def test_what_is_said_of_a_file_needs_one(call, tmp_path, words):
    """Such options were taken without -o, and nothing was written."""
    done = call(*words)
    option = next(word for word in words if str(word).startswith("--"))
    assert done.returncode == 2 and f"{option} is of the file that is written: give -o FILE with it" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("-o", "r.doc"), "r.doc cannot be written by its ending: use .csv"),
        (("-o", "r"), "cannot be written by its ending"),
        (("-o", "r.csv", "--format", "paper"), "no format is called 'paper'"),
        (("-o", "-", "--format", "npz"), "standard output takes setpoints only"),
    ],
)
def test_what_cannot_be_written_is_refused_before_planning(call, tmp_path, monkeypatch, arguments, says):
    monkeypatch.setattr("minsnap.paths.shapes.rectangle", lambda *_, **__: pytest.fail("planned before it was refused"))
    done = call(*RECT, *arguments)
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_figure_does_not_replace_the_path(call, tmp_path):
    done = call(*RECT, "-o", "a.png", "--format", "setpoints", "--plot", f"{tmp_path}/./a.png")
    assert done.returncode == 2 and "is the file of -o and of --plot" in done.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="names are text there")
def test_a_name_that_is_no_text_is_drawn_and_written(call, tmp_path):
    name = os.fsdecode(b"\xe9")
    assert call("circle", "-o", f"{name}.csv").returncode == 0
    assert call("simulate", f"{name}.csv", "-o", f"{name}2.csv").returncode == 0
    np.save(tmp_path / f"{name}.npy", np.zeros((9, 9), dtype=bool))
    ends = ("--resolution", "1", "--start", "2", "2", "--goal", "7", "7")
    acts = "acts: [{formation: {points: [[3, 3, 8]]}, hold: 1}]"
    show = (
        f"vehicles: 1\nseparation: 1\nlimits: {{speed: 4, acceleration: 3}}\nhome: {{grid: {{spacing: 2}}}}\n{acts}\n"
    )
    (tmp_path / f"{name}.yaml").write_text(show)
    for words in [
        ("plot", f"{name}.csv", "-o", "a.svg"),
        ("plot", f"{name}.csv", "-o", "b.svg", "--title", name),
        ("route", f"{name}.npy", *ends, "--time", "9", "--plot", "c.png"),
        ("compare", f"{name}.csv", f"{name}2.csv", "--plot", "d.png", "--report", "e.html"),
        ("convert", f"{name}.csv", f"{name}.parquet"),
        ("check", f"{name}.parquet"),
        ("fleet", f"{name}.yaml", "-o", name, "--report", "f.html"),
    ]:
        done = call(*words)
        assert done.returncode == 0, done.stderr
    assert "\ufffd" in (tmp_path / "e.html").read_text() and "\ufffd" in (tmp_path / "f.html").read_text()


def test_a_shape_that_is_no_polynomial_is_fitted(call, tmp_path):
    assert call("circle", "-o", "c.json").returncode == 0
    t = np.linspace(0.0, 6.0, 50)
    assert read_any(tmp_path / "c.json")(t) == pytest.approx(minsnap.circle(3.0)(t), abs=2e-3)


def test_a_plan_is_planned_again_from_its_file(call, tmp_path):
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1.5\n")
    first = call("plan", "points.csv", "--corridor", "0.3", "--max-speed", "1.5", "-o", "r.json")
    assert first.returncode == 0
    stored = read_polynomials(tmp_path / "r.json")
    assert (
        stored.corridor == 0.3
        and stored.limits == minsnap.Limits(speed=1.5, acceleration=6.0, jerk=30.0)
        and len(stored.waypoints) == 3
    )
    again = call("plan", "r.json", "-o", "again.json", "--json")
    figures = json.loads(again.stdout)
    assert figures["corridor_margin"] == stored.certificate["corridor_margin"] >= 0.0
    assert figures["limits"][0]["name"] == "speed"
    copy = read_polynomials(tmp_path / "again.json")
    assert (copy.trajectory.control_points == stored.trajectory.control_points).all()
    assert call("plan", "r.json", "-o", "again.csv").returncode == 0
    refused = call("plan", "r.json", "--max-speed", "3")
    assert refused.returncode == 2 and "r.json is a plan already" in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["json", "npz", "traj"])
def test_other_commands_take_any_of_them(call, tmp_path, ending):
    name = f"r.{ending}"
    assert call(*RECT, "-o", name).returncode == 0
    checked = call("check", name, "--json")
    assert checked.returncode == 0 and json.loads(checked.stdout)["frame"] == "enu"
    assert call("plot", name, "-o", "r.png").returncode == 0
    assert call("convert", name, "again.csv").returncode == 0
    compared = call("compare", name, "again.csv", "--json")
    assert compared.returncode == 0, compared.stderr


@pytest.mark.parametrize("words", [[], ["--takeoff"]])
def test_the_home_of_a_mission_stays_with_the_setpoints(call, tmp_path, words):
    """As a course it lost its home; holds were dropped without a note."""
    home = [47.3977, 8.5456, 488.0]
    places = ([47.3977, 8.5456, 10.0], [47.3978, 8.5457, 12.0])
    items = [{"type": "SimpleItem", "command": 16, "frame": 3, "params": [5, 0, 0, 0, *place]} for place in places]
    content = {"fileType": "Plan", "mission": {"plannedHomePosition": home, "items": items}}
    (tmp_path / "m.plan").write_text(json.dumps(content))
    done = call("plan", "m.plan", "-o", "m.csv", *words)
    assert done.returncode == 0 and "leaves out of the mission: hold (2 times)" in done.stdout, done.stderr
    assert json.loads(call("check", "m.csv", "--json").stdout)["origin"] == home


@pytest.mark.parametrize("file", ["r.json", "r.npz", "r.traj"])
def test_a_rate_of_polynomials_is_refused(call, tmp_path, file):
    """It was taken, and nothing was sampled at it."""
    done = call(*RECT, "-o", file, "--rate", "50")
    assert done.returncode == 2 and "--rate is of files of setpoints" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_figures_that_are_not_finite_are_null_in_json():
    """They were Infinity and NaN, which JSON does not have."""
    text = as_json({"least": np.inf, "pairs": [{"at": np.nan, "on": (1.0, -np.inf)}]})
    assert json.loads(text, parse_constant=pytest.fail) == {"least": None, "pairs": [{"at": None, "on": [1.0, None]}]}


def test_figures_are_drawn_whatever_window_the_environment_asks_for(process, tmp_path):
    done = process(*RECT, "--plot", "r.png", env={**os.environ, "MPLBACKEND": "nonsense"})
    assert done.returncode == 0 and (tmp_path / "r.png").exists(), done.stderr
