"""What the studio plays and the report draws of a show is what its files hold."""

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.cli.fleet_commands import _fleet
from minsnap.plot.fleet_figures import plot_fleet, plot_homes
from minsnap.shows.fleet_files import read_fleet, read_lights
from minsnap.shows.formations import grid

SHOW = "vehicles: 4\nseparation: 1\nlimits: {speed: 3, acceleration: 2}\nhome: {grid: {spacing: 2}}\ntake_off: 3\n"
SHOW += "acts: [{formation: {circle: {radius: 3, height: 6}}, hold: 1, colour: red}]\n"


def written(tmp_path, to):
    (tmp_path / "show.yaml").write_text(SHOW)
    with pytest.raises(SystemExit) as left:
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "out"), "--to", to])
    assert not left.value.code
    return tmp_path / "show.yaml", tmp_path / "out"


@pytest.mark.slow
@pytest.mark.parametrize("to", ["csv", "skyb", "skyc"])
def test_the_studio_plays_the_files_of_the_folder(tmp_path, capsys, to):
    """It planned the show anew, without the margins of files: 142.10 s for 142.44 s."""
    show, out = written(tmp_path, to)
    capsys.readouterr()
    shown, lights = _fleet(show, None, None, out)
    held = read_fleet(out)
    for one, two in zip(shown, held, strict=True):
        assert (one.control_points == two.control_points).all() and (one.durations == two.durations).all()
    assert shown.separation.distance == 1.0 and "is what is shown" in capsys.readouterr().err
    t = np.linspace(0.0, held.duration, 2001)
    ring = t[np.abs(held(t)[..., 2] - 6.0).max(axis=0) < 0.003]
    assert (lights[0](0.5 * (ring[0] + ring[-1])) == (255, 0, 0)).all()
    assert (read_lights(out) is None) == (to == "csv")


@pytest.mark.slow
def test_without_files_it_plays_the_flights_that_files_would_hold(tmp_path, capsys):
    (tmp_path / "show.yaml").write_text(SHOW)
    shown, lights = _fleet(tmp_path / "show.yaml", None, None, tmp_path)
    assert "Skybrush's firmware" in capsys.readouterr().err and len(lights) == len(shown) == 4
    assert not (tmp_path / "flights").exists(), "nothing is written"


def test_homes_have_numbers_and_many_paths_are_pixels():
    def fleet_of(count):
        places = grid(count, 2.0)
        return minsnap.Fleet(tuple(minsnap.plan([place, place + (0, 0, 3)], total_time=3.0) for place in places))

    axes = plot_homes(fleet_of(5))
    assert [text.get_text() for text in axes.texts] == ["0", "1", "2", "3", "4"]
    assert np.array([text.xy for text in axes.texts]) == pytest.approx(grid(5, 2.0)[:, :2])
    assert not plot_fleet(fleet_of(5), "xz").collections[0].get_rasterized()
    assert plot_fleet(fleet_of(31), "xz").collections[0].get_rasterized()
