"""Films of explorations, and routes drawn with what they keep away from."""

import numpy as np
import pytest
from PIL import Image

import minsnap
from minsnap.errors import FileError, InputError, TimingError

LIMITS = minsnap.Limits(speed=2.0, acceleration=4.0, jerk=20.0)


def explored(dim=2):
    explorer = minsnap.routes.Explorer((6.0, *(0.0,) * (dim - 1)), limits=LIMITS, sensing=5.0, clock=lambda: 0.0)
    with pytest.raises(InputError, match="nothing was observed yet"):
        explorer.seen()
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ends = np.pad(5.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1), ((0, 0), (0, dim - 2)))
    pictures = []
    for x in (0.0, 1.0, 2.0):
        place = np.array((x, *(0.0,) * (dim - 1)))
        explorer.observe(place, [place + ends[20] * 0.5], place + ends)
        plan = minsnap.plan([place, place + ends[0]], total_time=4.0)
        pictures.append(explorer.seen(plan if x else None))
    return pictures


@pytest.mark.parametrize("dim", [2, 3])
def test_a_film_has_a_picture_of_each_instant(tmp_path, dim):
    pictures, told = explored(dim), []
    minsnap.plot.animate_exploration(pictures, tmp_path / "film.gif", title="woods", progress=told.append)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 3 and len(told) >= 3
        shots = []
        for frame in (0, 2):
            film.seek(frame)
            shots.append(np.asarray(film.convert("RGB"), dtype=int))
    assert np.abs(shots[0] - shots[1]).max() > 50
    assert [np.count_nonzero(each.states == 2) for each in pictures] == sorted(
        np.count_nonzero(each.states == 2) for each in pictures
    )


def test_what_is_no_exploration_is_refused(tmp_path):
    with pytest.raises(InputError, match="an exploration has one or more SeenSoFar"):
        minsnap.plot.animate_exploration([], tmp_path / "film.gif")
    with pytest.raises(FileError, match="film"):
        minsnap.plot.animate_exploration(explored(), tmp_path / "film.png")
    with pytest.raises(TimingError, match="the rate of an animation is 0"):
        minsnap.plot.animate_exploration(explored(), tmp_path / "film.gif", rate=0.0)


def test_a_route_is_drawn_with_obstacles_points_and_fences():
    fence = minsnap.Prism([(-1, -3), (7, -3), (7, 3), (-1, 3)], inclusion=True)
    around = [fence, minsnap.Cylinder((2, 0), 0.5), minsnap.Prism([(4, -1), (5, -1), (4.5, 1)])]
    route = minsnap.routes.plan_through(around, (0, 0), (6, 0), clearance=0.2, limits=LIMITS)
    plane = minsnap.plot.plot_route(route).subfigs[0].axes[0]
    named = {text.get_text() for text in plane.get_legend().get_texts()}
    assert {"fence", "obstacles"} <= named and len(plane.patches) >= 2
    cloud = minsnap.routes.plan_through(
        np.array([(2.0, 0.0), (4.0, 0.2)]), (0, 0), (6, 0), clearance=0.2, limits=LIMITS
    )
    drawn = minsnap.plot.plot_route(cloud).subfigs[0].axes[0].get_legend().get_texts()
    assert "points" in {text.get_text() for text in drawn}
