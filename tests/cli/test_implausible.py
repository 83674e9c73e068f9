"""Paths that no vehicle flies: not written, in one sentence, unless told to."""

import pytest

FILES = {
    "far.csv": "x,y,z,duration\n0,0,1,\n0.1,0,1,0.1\n0.1,2,1,2\n2,2,1,0.1\n2,1,1,3\n",
    "milliseconds.csv": "t,x,y,z\n0,0,0,1\n2e-3,2,0,1\n4e-3,2,2,1\n",
    "degrees.csv": "x,y,z\n47.3977,8.5456,10\n47.3981,8.5460,12\n",
    "kilometres.csv": "x,y,z,duration\n0,0,100,\n9000,0,100,10\n9000,9000,100,10\n",
}
SAID = {
    "far.csv": "the path leaves its waypoints by 32.5 m, more than any of its legs is long (2 m): leave out the times",
    "milliseconds.csv": "times gravity: are they metres and seconds",
    "degrees.csv": "if they are latitudes and longitudes, convert them to metres",
    "kilometres.csv": "m/s, faster than sound: are they metres and seconds",
}


@pytest.mark.parametrize("name", FILES)
def test_a_path_that_no_vehicle_flies_is_not_written(call, tmp_path, name):
    """1,481 m/s^2 around waypoints within 2 m, and 19,380 m/s^2 from latitudes, were written with status 0."""
    (tmp_path / name).write_text(FILES[name])
    for target in ("a.csv", "a.json", "-"):
        done = call("plan", name, "-o", target)
        assert done.returncode == 1 and SAID[name] in done.stderr and done.stdout == ""
        assert done.stderr.splitlines()[-1].endswith("With --force it is written as it is [magnitude]")
        assert not (tmp_path / target).exists()
    assert call("plan", name).returncode == 0
    done = call("plan", name, "-o", "a.csv", "--force")
    assert done.returncode == 0 and (tmp_path / "a.csv").exists()


def test_a_shape_that_no_vehicle_flies_is_not_written(call, tmp_path):
    done = call("circle", "--radius", 2000, "-o", "a.csv")
    assert done.returncode == 1 and "2193 m/s^2, 224 times gravity" in done.stderr
    assert call("circle", "--radius", 2000, "--max-speed", 10, "-o", "a.csv").returncode == 0


@pytest.mark.parametrize(
    "course", ["waypoints: [[0,0,1],[3,0,1]]\nland: true\n", "waypoints: [[0,0,1],[3,0,1]]\nlaps: 2"]
)
def test_an_ordinary_path_is_written_as_before(call, tmp_path, course):
    (tmp_path / "course.yaml").write_text(course)
    assert call("plan", "course.yaml", "-o", "a.csv").returncode == 0
    refused = call("plan", "course.yaml", "--force")
    assert refused.returncode == 2 and "--force is of the file that is written" in refused.stderr
