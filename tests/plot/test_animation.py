"""Animations: where the point is in which picture, and what is refused."""

import numpy as np
import pytest
from PIL import Image

import minsnap
from minsnap.errors import FileError, InputError, TimingError
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.plot.animation import FilmScene, animate_fleet, animate_path, write_film
from minsnap.plot.fleet_figures import near_pairs

PATH = minsnap.plan([(0, 0, 1), (2, 1, 1)], total_time=1.0)


@pytest.fixture
def moving(monkeypatch):
    """What :func:`animate_path` and :func:`animate_fleet` would write, as FilmScene."""
    made = []
    monkeypatch.setattr(FilmScene, "pictures", lambda self, progress=None: made.append(self))
    monkeypatch.setattr("minsnap.plot.animation.write_film", lambda *_, **__: None)
    return made


def test_points_are_where_the_path_is_at_each_instant(moving):
    animate_path(PATH, "a.gif", flight=PATH.sample(100.0), view="xz", rate=10.0)
    moving[0].show(4)
    for point in moving[0].points.get_offsets():
        assert point == pytest.approx(PATH(0.4)[[0, 2]], abs=1e-3)
    assert moving[0].trails.get_segments()[0][-1] == pytest.approx(PATH(0.4)[[0, 2]])
    assert moving[0].clock.get_text() == "0.4 s"


FLEET = Fleet(
    [minsnap.plan([(-1, 0, 1), (1, 0, 1)], total_time=2.0), minsnap.plan([(0, -1, 2.5), (0, 1, 2.5)], total_time=2.0)],
    separation=Separation(0.9, downwash=2.0),
)


def test_vehicles_that_come_near_are_red_and_joined(moving):
    """They meet at 1 s, 1.5 m above each other: 0.75 m by the downwash, and 0.2 m from the end they are 1.4 m apart."""
    animate_fleet(FLEET, "a.gif", rate=10.0)
    for index, joined in ((0, 0), (10, 1)):
        moving[0].show(index)
        assert len(moving[0].lines.get_segments()) == joined
        assert (moving[0].points.get_facecolor()[:, 0] > 0.5).sum() == 2 * joined
    assert moving[0].points.get_offsets() == pytest.approx(FLEET(1.0)[:, :2], abs=1e-12)


def test_the_dots_that_move_are_not_called_the_start(moving):
    """They looked as the marks of the start, which alone had a name."""
    animate_fleet(FLEET, "a.gif", rate=10.0)
    marks, names = moving[0].axes.get_legend_handles_labels()
    assert names == [text.get_text() for text in moving[0].axes.get_legend().get_texts()] == ["start", "end", "now"]
    assert marks[0].get_markerfacecolor() == "none" and marks[2] is moving[0].points


def test_near_pairs_are_those_of_all_pairs(rng=np.random.default_rng(4)):  # noqa: B008
    places, apart = rng.uniform(0.0, 3.0, (40, 3)), Separation(radii=rng.uniform(0.1, 0.4, 40), downwash=1.5)
    wide = places / (1.0, 1.0, 1.5)
    all_pairs = [(i, j) for i in range(40) for j in range(i + 1, 40)]
    near = {(i, j) for i, j in all_pairs if np.linalg.norm(wide[i] - wide[j]) < 1.25 * apart.between(i, j)}
    assert {tuple(sorted(pair)) for pair in near_pairs(places, apart).tolist()} == near and near


def test_pictures_differ_where_the_points_move_and_nowhere_else(tmp_path):
    animate_fleet(FLEET, tmp_path / "fleet.gif", rate=2.0)
    with Image.open(tmp_path / "fleet.gif") as film:
        assert film.n_frames == 5
        first = np.asarray(film.convert("RGB"), dtype=int)
        film.seek(2)
        changed = np.abs(np.asarray(film.convert("RGB"), dtype=int) - first).max(axis=-1) > 60
    assert 100 < changed.sum() < 0.1 * changed.size


def test_a_film_of_another_program_that_fails_is_refused(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    pictures = iter(np.zeros((200, 64, 64, 3), dtype=np.uint8))
    with pytest.raises(FileError, match="ffmpeg could not write"):
        write_film(pictures, tmp_path / "a.webm", 10.0)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["ffmpeg"]


def test_a_gif_has_a_picture_for_each_instant(tmp_path):
    animate_path(PATH, tmp_path / "a.gif", rate=6.0, speed=2.0)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 4
    with pytest.raises(FileError, match="is there already"):
        animate_path(PATH, tmp_path / "a.gif", clobber=False)


def test_title_corridor_and_progress_are_drawn(tmp_path):
    shares = []
    animate_path(PATH, tmp_path / "a.gif", rate=3.0, progress=shares.append)
    assert shares == [0.0, 0.25, 0.5, 0.75]
    with pytest.raises(InputError, match="drawn in a plane"):
        animate_path(PATH, tmp_path / "a.gif", view="3d")


def test_a_title_and_a_corridor_are_drawn(moving):
    animate_path(PATH, "a.gif", rate=2.0, title="a flight", corridor=0.3)
    moving[0].show(1)
    assert moving[0].clock.get_text() == "a flight  0.5 s" and moving[0].axes.patches


@pytest.mark.parametrize("change", [{"rate": 0.0}, {"speed": -1.0}, {"rate": 1e5}])
def test_numbers_of_pictures_that_make_no_sense_are_refused(tmp_path, change):
    with pytest.raises(TimingError):
        animate_path(PATH, tmp_path / "a.gif", **change)
    assert not list(tmp_path.iterdir())
