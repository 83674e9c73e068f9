"""Plans above the ground of a file."""

import json

import pytest

GROUND = "ncols 4\nnrows 4\nxllcorner -50\nyllcorner -50\ncellsize 100\n" + "0 0 0 0\n0 20 0 0\n0 0 0 0\n0 0 0 0\n"
FLY = ["plan", "w.csv", "--terrain", "dem.asc", "--above", "30"]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "dem.asc").write_text(GROUND)
    (tmp_path / "w.csv").write_text("x,y,z\n30,30,60\n200,220,60\n260,100,50\n")
    (tmp_path / "flat.csv").write_text("x,y\n30,30\n200,220\n")
    (tmp_path / "course.yaml").write_text("waypoints:\n- [30, 30, 60]\n- [200, 220, 60]\nclosed: false\nlaps: 1\n")
    return tmp_path


@pytest.mark.slow
def test_a_plan_stays_above_the_ground(call, folder):
    done = call(*FLY, "--below", "80", "--max-speed", "12", "-o", "o.csv", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["corridor_margin"] >= 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["plan", "w.csv", "--terrain", "dem.asc"], "--terrain and --above go together"),
        (["plan", "w.csv", "--above", "30"], "--terrain and --above go together"),
        ([*FLY, "--below", "30"], "give the lower height first"),
        (["plan", "w.csv", "--terrain", "dem.asc", "--above", "nan"], "--above is nan"),
        (["plan", "flat.csv", *FLY[2:]], "flat.csv has no altitudes"),
        (["plan", "course.yaml", *FLY[2:]], "--terrain is for a plan through waypoints"),
        ([*FLY[:-1], "45"], "leg 0 is 40 m above the ground at (100, 200, 20) m in dem.asc"),
        (["plan", "w.csv", "--terrain", "w.csv", "--above", "3"], "is no ESRI ASCII grid"),
    ],
)
def test_bad_usage_is_one_sentence(call, folder, arguments, message):
    done = call(*arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1
