"""certify against obstacles: margins against geometry and dense grids, and proved again in exact arithmetic."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import minsnap
from minsnap import Cuboid, Cylinder, Ellipsoid
from minsnap.corridors.keep_out import clearance_of
from minsnap.errors import CorridorError
from minsnap.trajectory.trajectory import Trajectory

LINE = minsnap.line((0, 0, 1), (8, 0, 1), total_time=8.0)


@pytest.mark.parametrize(
    ("obstacle", "margin"),
    [
        (Cylinder((4.0, 1.0), 0.25), 0.75),
        (Cylinder((4.0, 0.0), 0.5, high=0.25), 0.75),
        (Ellipsoid((4.0, 0.0, 3.0), 0.5), 1.5),
        (Cuboid((3, -1, 1.5), (5, 1, 2)), 0.5),
        (Cuboid((3, -1, 0), (5, 0.25, 2)), -0.25),
        (Cylinder((9.0, 0.0), 0.5), 0.5),
    ],
    ids=repr,
)
def test_the_margin_of_a_straight_line_is_that_of_geometry(obstacle, margin):
    certificate = minsnap.certify(LINE, avoid=[Cylinder((4.0, 9.0), 1.0), obstacle])
    assert certificate.obstacle_margin == pytest.approx(margin, abs=2e-9) and certificate.obstacle_margin <= margin
    assert certificate.nearest_obstacle.obstacle == 1 and certificate.ok == (margin >= 0.0)
    assert clearance_of(obstacle, LINE(certificate.nearest_obstacle.instant)) == pytest.approx(margin, abs=1e-8)
    assert minsnap.certify(LINE).obstacle_margin is None


def test_the_margin_of_wild_curves_is_below_every_sample_and_proved_in_exact_arithmetic():
    draw = np.random.default_rng(4)
    for dim in (2, 3):
        times = np.cumsum(draw.uniform(0.5, 2.0, 4))
        curve = Trajectory.from_ppoly(CubicSpline(times, draw.normal(size=(4, dim))))
        obstacles = [Cylinder(draw.normal(size=2), 0.2, -1.0, 1.0), Cuboid((0, 0, -1), (1, 1, 1))]
        obstacles += [Ellipsoid(draw.normal(size=3), draw.uniform(0.1, 0.5, 3))]
        certificate = minsnap.certify(curve, avoid=obstacles)
        places = curve(np.linspace(0.0, curve.duration, 501))
        places = np.concatenate((places, np.zeros((len(places), 3 - dim))), axis=1)
        least = min(clearance_of(obstacle, place) for obstacle in obstacles for place in places)
        assert least - 4e-2 <= certificate.obstacle_margin <= least + 1e-12
        assert certificate.verify()
        near = certificate.nearest_obstacle
        for other in (near.value + 1e-6, near.value + 1.0):
            assert not replace(certificate, nearest_obstacle=replace(near, value=other)).verify()


@pytest.mark.slow
def test_a_plan_around_a_corner_of_two_walls_is_certified_and_proved():
    walls = [Cuboid((2, -2, -5), (3, 0.3, 5)), Cuboid((6, -0.3, -5), (7, 2, 5))]
    curve = minsnap.plan([(0, 0, 1), (9, 0, 1)], total_time=8.0, avoid=walls)
    certificate = minsnap.certify(curve, avoid=walls)
    assert certificate.ok and certificate.obstacle_margin >= -1e-9 and certificate.verify()
    assert "obstacle margin" in certificate._repr_html_()
    through = minsnap.certify(minsnap.plan([(0, 0, 1), (9, 0, 1)], total_time=8.0), avoid=walls)
    assert not through.ok and through.obstacle_margin == pytest.approx(-0.3, abs=1e-8) and through.verify()


def test_what_is_no_obstacle_is_refused():
    with pytest.raises(CorridorError, match="avoid has 3: give cylinders, ellipsoids and cuboids"):
        minsnap.certify(LINE, avoid=3)
