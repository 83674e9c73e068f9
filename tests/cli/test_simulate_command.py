"""The command that simulates a flight along any path."""

import json
import shutil

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import minsnap


@pytest.fixture
def path(tmp_path):
    traj = minsnap.plan([(0, 0, 1), (1.5, 0, 1), (1.5, 1, 1.3)], durations=(2.0, 1.5))
    minsnap.write_csv(traj, tmp_path / "path.csv")
    from minsnap.files.convert import write_any

    write_any(traj, tmp_path / "path.json")
    return traj


@pytest.mark.slow
def test_a_plan_is_flown_and_everything_is_written(call, path, tmp_path):
    done = call("simulate", "path.json", "-o", "flown.csv", "--plot", "flown.png", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    flown = minsnap.read_csv("flown.csv")
    assert said["duration"] == pytest.approx(path.duration, abs=0.01) and flown.rate == pytest.approx(50.0)
    apart = np.linalg.norm(flown.position - path(np.minimum(flown.t, path.duration)), axis=1)
    assert np.sqrt((apart**2).mean()) == pytest.approx(said["rmse"], rel=0.05)
    assert apart.max() == pytest.approx(said["max_error"], rel=0.02) and 0.0 < said["rmse"] < 0.5
    assert (tmp_path / "flown.png").read_bytes().startswith(b"\x89PNG")


def test_the_figure_names_the_flight_simulated(call, path, monkeypatch):
    names = []
    monkeypatch.setattr(
        "minsnap.flight.tracking.tracking_plot.plot_comparison",
        lambda flights, view, **around: names.extend(flights) or Figure(),
    )
    assert call("simulate", "path.json", "--plot", "flown.png").returncode == 0 and names == ["simulated"]


def test_a_plane_plan_is_refused_with_how_it_gets_an_altitude(call):
    minsnap.plan([(0, 0), (1, 0)], durations=[1.5]).save("plane.json")
    done = call("simulate", "plane.json")
    assert done.returncode == 2 and "plan it with z, a route from --start X Y Z to --goal X Y Z" in done.stderr


def test_an_animation_is_written(call, tmp_path):
    minsnap.write_csv(minsnap.plan([(0, 0, 1), (0.2, 0, 1)], durations=[0.6]), "short.csv")
    assert call("simulate", "short.csv", "--animate", "flown.gif").returncode == 0
    with Image.open(tmp_path / "flown.gif") as film:
        assert film.n_frames == 10


@pytest.mark.slow
def test_what_was_simulated_is_fitted_and_offset(call, tmp_path):
    flown = ["--vehicle", "px4-sih", "--delay", "0.1", "--json"]
    course = ["rect", "--time", "12", "--altitude", "2", "-o"]
    assert call(*course, "first.csv").returncode == 0
    first = json.loads(call("simulate", "first.csv", "--log", "first.ulg", *flown).stdout)
    fitted = json.loads(call("fit", "first.ulg", "-o", "mine.yaml", "--json").stdout)
    assert fitted["drag per mass"]["x"]["linear"]["value"] == pytest.approx(1.0, abs=0.01)  # that of px4-sih
    assert call(*course, "second.csv", "--vehicle", "mine.yaml").returncode == 0
    second = json.loads(call("simulate", "second.csv", *flown).stdout)
    assert second["rmse"] < 0.5 * first["rmse"]
    compared = json.loads(call("compare", "first.csv", "first.ulg", "--json").stdout)
    assert compared["first.ulg"]["rmse_3d"] == pytest.approx(first["rmse"], rel=0.02)


@pytest.mark.slow
def test_wind_pushes_and_a_seed_repeats_it(call, path):
    runs = [
        json.loads(call("simulate", "path.csv", "--controller", "lee", "--json", *more).stdout)
        for more in ([], ["--wind", "4", "0", "0"], ["--gust", "1", "--seed", "3"], ["--gust", "1", "--seed", "3"])
    ]
    assert runs[1]["rmse"] > 1.2 * runs[0]["rmse"]
    assert runs[2]["rmse"] == runs[3]["rmse"] != runs[0]["rmse"]


@pytest.mark.slow
def test_the_summary_says_what_it_took(call, path):
    said = call("simulate", "path.json", "--vehicle", "crazyflie", "--controller", "lee").stdout
    for label in ("tracking error", "largest error", "late by", "max tilt", "max rotor thrust", "saturated"):
        assert label in said
    better = json.loads(call("simulate", "path.json", "--vehicle", "crazyflie", "--controller", "lee", "--json").stdout)
    assert better["rmse"] < 0.1 and better["saturated"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["path.csv", "--animate", "a.avi"], "a.avi does not end in .gif or .mp4"),
        (["path.csv", "--log", "a.csv"], "a.csv does not end in .ulg"),
        (["path.csv", "-o", "a.json"], "a.json does not end in .csv"),
        (["path.csv", "--controller", "mpc"], "--controller is 'mpc'"),
        (["path.csv", "--vehicle", "none.yaml"], "none.yaml cannot be read"),
        (["path.csv", "--vehicle", "racer"], "--vehicle is 'racer': give f330, crazyflie, px4-sih, or a YAML file"),
        (["none.csv"], "none.csv"),
    ],
)
def test_bad_usage_is_one_sentence(call, path, arguments, message):
    done = call("simulate", *arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1


def test_mp4_needs_ffmpeg(call, path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    done = call("simulate", "path.csv", "--animate", "a.mp4")
    assert done.returncode == 2 and "MP4 needs the program ffmpeg" in done.stderr
