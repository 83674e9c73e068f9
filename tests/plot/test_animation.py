"""Animations: where the point is in which picture, and what is refused."""

import numpy as np
import pytest
from PIL import Image

import minsnap
from minsnap.errors import FileError, InputError, TimingError
from minsnap.plot.animation import _Moving, animate_path

PATH = minsnap.plan([(0, 0, 1), (2, 1, 1)], total_time=1.0)


def test_points_are_where_the_path_is_at_each_instant():
    instants = np.linspace(0.0, 1.0, 11)
    moving = _Moving(PATH, PATH.sample(100.0), "xz", instants)
    moving.show(4)
    for point in moving.points:
        assert point.get_xydata()[0] == pytest.approx(PATH(instants[4])[[0, 2]], abs=1e-3)
    assert moving.trails[0].get_xydata()[-1] == pytest.approx(PATH(instants[4])[[0, 2]])
    assert moving.clock.get_text() == "0.4 s"


def test_a_gif_has_a_picture_for_each_instant(tmp_path):
    animate_path(PATH, tmp_path / "a.gif", rate=6.0, speed=2.0)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 4
    with pytest.raises(FileError, match="is there already"):
        animate_path(PATH, tmp_path / "a.gif", clobber=False)


def test_title_corridor_and_progress_are_drawn(tmp_path):
    instants, shares = np.linspace(0.0, 1.0, 3), []
    moving = _Moving(PATH, None, "xy", instants, "a flight", {"corridor": 0.3})
    moving.show(1)
    assert moving.clock.get_text() == "a flight  0.5 s" and moving.figure.axes[0].patches
    animate_path(PATH, tmp_path / "a.gif", rate=3.0, progress=shares.append)
    assert shares == [0.0, 0.25, 0.5, 0.75]
    with pytest.raises(InputError, match="drawn in a plane"):
        animate_path(PATH, tmp_path / "a.gif", view="3d")


@pytest.mark.parametrize("change", [{"rate": 0.0}, {"speed": -1.0}, {"rate": 1e5}])
def test_numbers_of_pictures_that_make_no_sense_are_refused(tmp_path, change):
    with pytest.raises(TimingError):
        animate_path(PATH, tmp_path / "a.gif", **change)
    assert not list(tmp_path.iterdir())
