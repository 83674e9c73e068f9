"""Tubes, square and round: what they mean, on the exact optimum, and what is refused."""

import numpy as np
import pytest
from oracles.curves import offsets
from oracles.sum_of_squares import optimum

import minsnap
from minsnap.corridors.tubes import leg_projections
from minsnap.errors import CorridorError

BENT = [(0.0, 0.0, 1.0), (3.0, 1.0, 1.5), (4.0, 4.0, 0.5), (1.0, 3.0, 1.0)]
TIMES = [2.0, 2.5, 2.0]
RECTANGLE = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]


def test_projections_remove_what_is_along_the_leg():
    points = np.array(BENT)
    steps = np.diff(points, axis=0)
    for projection, step in zip(leg_projections(points), steps, strict=True):
        assert projection @ step == pytest.approx(np.zeros(3), abs=1e-14)
        assert projection @ projection == pytest.approx(projection, abs=1e-14)
        assert np.trace(projection) == pytest.approx(2.0)


@pytest.mark.parametrize("width", (0.02, 0.1, 0.4, 1.5))
def test_a_tube_bounds_the_largest_coordinate_of_the_offset(width):
    traj = minsnap.plan(BENT, TIMES, corridor=width)
    reach = np.abs(offsets(traj, BENT, 2000)).max()
    assert reach <= width + 1e-12
    if width < 1.0:
        assert reach >= width * (1.0 - 1e-3)


@pytest.mark.parametrize("radius", (0.02, 0.1, 0.4))
def test_a_round_tube_bounds_the_length_of_the_offset(radius):
    traj = minsnap.plan(BENT, TIMES, corridor=minsnap.RoundTube(radius))
    reach = np.linalg.norm(offsets(traj, BENT, 2000), axis=2).max()
    assert radius * (1.0 - 1e-3) <= reach <= radius + 1e-12


def test_every_leg_has_its_own_half_width():
    widths = np.array([0.05, 0.5, 0.1])
    for corridor in (widths, list(widths), minsnap.Tube(widths), minsnap.Tube(widths[:, None])):
        traj = minsnap.plan(BENT, TIMES, corridor=corridor)
        reach = np.abs(offsets(traj, BENT, 1000)).max(axis=(1, 2))
        assert (reach <= widths + 1e-12).all()
        assert reach[0] >= 0.99 * widths[0]


def test_every_leg_and_axis_has_its_own_half_width():
    widths = np.array([(0.3, 0.3, 0.02), (0.2, 0.2, 0.2), (0.5, 0.05, 0.5)])
    traj = minsnap.plan(BENT, TIMES, corridor=minsnap.Tube(widths))
    assert (np.abs(offsets(traj, BENT, 1000)).max(axis=1) <= widths + 1e-12).all()
    assert traj.cost() < minsnap.plan(BENT, TIMES, corridor=minsnap.Tube(widths.min(axis=1))).cost()


def test_along_an_axis_a_tube_leaves_that_axis_alone():
    walls = minsnap.Tube(0.3).walls(np.array(RECTANGLE, float))[0]
    assert len(walls.leg) == 16
    for leg, axes in enumerate([(1, 2), (0, 2), (1, 2), (0, 2)]):
        assert (np.abs(walls.slope[walls.leg == leg]).argmax(axis=1) == 2 * axes).all()


@pytest.mark.parametrize("width", (0.05, 0.3, 1.0))
def test_a_bent_tube_reaches_the_sum_of_squares_optimum(width):
    assert minsnap.plan(BENT, TIMES, corridor=width).cost() == pytest.approx(optimum(BENT, TIMES, width), rel=1e-5)


@pytest.mark.parametrize("radius", (0.1, 0.4))
def test_a_bent_round_tube_reaches_the_sum_of_squares_optimum(radius):
    cost = minsnap.plan(BENT, TIMES, corridor=minsnap.RoundTube(radius)).cost()
    assert cost == pytest.approx(optimum(BENT, TIMES, radius=radius), rel=1e-5)


def test_a_round_tube_lies_between_two_square_ones():
    square, inner = (minsnap.plan(BENT, TIMES, corridor=width).cost() for width in (0.3, 0.3 / np.sqrt(3.0)))
    turned = minsnap.plan(BENT, TIMES, corridor=minsnap.RoundTube(0.3)).cost()
    assert square * (1 - 2e-6) <= turned <= inner * (1 + 2e-6)


def test_on_a_flat_rectangle_round_and_square_are_the_same():
    square = minsnap.plan(RECTANGLE, [4, 2, 4, 2], corridor=0.3)
    turned = minsnap.plan(RECTANGLE, [4, 2, 4, 2], corridor=minsnap.RoundTube(0.3))
    assert turned.cost() == pytest.approx(square.cost(), rel=3e-6)


def test_in_the_plane_and_in_one_dimension():
    flat = minsnap.plan(np.array(RECTANGLE)[:, :2], [4, 2, 4, 2], corridor=0.3)
    assert flat.cost() == pytest.approx(minsnap.plan(RECTANGLE, [4, 2, 4, 2], corridor=0.3).cost(), rel=3e-6)
    line = minsnap.plan([[0.0], [2.0], [1.0]], [1.0, 1.0], corridor=0.1)
    assert line.report.solver == "banded"


@pytest.mark.parametrize(
    ("width", "words"),
    (
        (0.0, "^the corridor half-width must be positive and finite"),
        (1e-300, "not 1e-300, from 1e-40 to 1e"),
        (-0.3, "positive and finite"),
        (np.nan, "positive and finite"),
        (np.inf, "positive and finite"),
        ([0.3, 0.3, -1.0], r"entry 2"),
        ("wide", "numbers"),
        ([], r"positive and finite \[m\], not \[\]$"),
        ([0.3, 0.3], "3 legs"),
        (np.full((3, 2), 0.3), "3 legs of 3 axes"),
        (np.full((3, 3, 1), 0.3), "3 legs"),
    ),
)
def test_a_malformed_tube_is_refused(width, words):
    with pytest.raises(CorridorError, match=words):
        minsnap.plan(BENT, TIMES, corridor=width)


@pytest.mark.parametrize(
    ("radius", "words"),
    ((0.0, "^the corridor radius must be positive"), ([0.1, 0.2], "3 legs"), (np.ones((3, 3)), "3 legs")),
)
def test_a_malformed_round_tube_is_refused(radius, words):
    with pytest.raises(CorridorError, match=words):
        minsnap.plan(BENT, TIMES, corridor=minsnap.RoundTube(radius))


def test_a_tube_around_a_leg_without_length_is_around_its_waypoint():
    """A start in motion comes back to its waypoint, within the box or the ball around it."""
    for tube, norm in ((0.3, np.inf), (minsnap.RoundTube(0.3), 2)):
        asked = {"durations": [2.0, 2.0], "start": {"velocity": (1.0, 0.6)}}
        path, free = (minsnap.plan([(0, 0), (0, 0), (3, 4)], corridor=kept, **asked) for kept in (tube, None))
        t = np.linspace(0.0, 2.0, 2001)
        reach, loop = (np.linalg.norm(each(t), axis=1, ord=norm).max() for each in (path, free))
        assert reach <= 0.3 + 1e-9 < loop
        assert minsnap.certify(path, [(0, 0), (0, 0), (3, 4)], corridor=tube).ok


def test_a_tube_owns_its_widths():
    widths = np.array([0.1, 0.2, 0.3])
    tube = minsnap.Tube(widths)
    widths[:] = 9.0
    assert (tube.half_width == [0.1, 0.2, 0.3]).all()
    with pytest.raises(ValueError, match="read-only"):
        tube.half_width[0] = 1.0


@pytest.mark.parametrize(("slope", "planes"), ((0.9e-12, 2), (1.1e-12, 3)))
def test_a_leg_is_along_an_axis_to_a_trillionth(slope, planes):
    assert len(minsnap.Tube(0.3).walls(np.array([(0, 0, 0), (1, slope, 0)]))[0].leg) == 2 * planes
