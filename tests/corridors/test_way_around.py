"""Ways around scenes of every shape: found on grids of a bounded number of cells, and clear by other distances."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import minsnap
from minsnap import Cuboid, Cylinder, Ellipsoid, Limits
from minsnap.corridors import way_around as module
from minsnap.corridors.way_around import AROUND, FreeCells, Kept, cells_around, way_around
from minsnap.errors import UnprovedError
from minsnap.paths.routes import plan_through

LIMITS = Limits(speed=5.0, acceleration=10.0, jerk=30.0)
ACROSS = (0.0, 0.0, 1.0), (40.0, 0.0, 1.0)


def trunks(seed, count, radius=0.3):
    rng = np.random.default_rng(seed)
    return [Cylinder(axis, radius) for axis in rng.uniform((3.0, -10.0), (37.0, 10.0), (count, 2))]


def clear_of_trunks(points, forest):
    """Return the least distance of points to upright trunks without ends, from their axes alone [m]."""
    axes, radii = np.array([trunk.center for trunk in forest]), np.array([trunk.radius for trunk in forest])
    return min(float((np.linalg.norm(point[:2] - axes, axis=1) - radii).min()) for point in points)


def sampled(curve):
    return curve(np.linspace(0.0, curve.duration, 4001))


@pytest.mark.slow
@pytest.mark.parametrize("count", [20, 60, 150])
@pytest.mark.parametrize("seed", range(3))
def test_wide_forests_of_thin_trunks_are_passed_in_space(seed, count):
    """Cells as small as thin trunks ask for were too many with the margin around them, and nothing was found."""
    forest = trunks(seed, count)
    curve = minsnap.plan(ACROSS, limits=LIMITS, avoid=forest)
    assert clear_of_trunks(sampled(curve), forest) >= 0.0
    route = plan_through(forest, *ACROSS, clearance=0.2, limits=LIMITS)
    assert clear_of_trunks(sampled(route.trajectory), forest) >= 0.2 - 1e-9
    for flight in (curve, route):
        assert flight.duration <= 1.05 * (40.0 / 5.0 + 5.0 / 10.0 + 10.0 / 30.0)  # straight, within jerk from rest


def walls():
    return [Cuboid((x, -30.0 if odd else -2.0, -50.0), (x + 0.05, 2.0 if odd else 30.0, 50.0)) for x, odd in PLACES]


PLACES = [(5.0, 0), (10.0, 1), (15.0, 0), (20.0, 1)]
SCENES = {
    "thin walls": (walls(), (0, 0, 1), (25, 0, 1)),
    "a thread": ([Ellipsoid((5, 0, 1), (0.05, 200, 0.05))], (0, 0, 1), (10, 0, 1)),
    "a wall much longer than the way": ([Cuboid((5, -1000, -0.02), (5.04, 1000, 2))], (0, 0, 1), (10, 0, 1)),
    "many trunks far aside": (
        [Cylinder((20, 0), 0.3), *(Cylinder((x, y), 0.3) for x in (5, 30) for y in range(-900, 900, 9))],
        (0, 0, 1),
        (40, 0, 1),
    ),
    "millimetres": ([Cylinder((0.2, 0.001), 0.003)], (0, 0, 0.01), (0.4, 0, 0.01)),
    "the plane": (trunks(4, 150), (0, 0), (40, 0)),
    "a trunk beside a cloud": ([Cylinder((20, 0), 0.01), Cuboid((-900, 90, -900), (900, 91, 900))], *ACROSS),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_ways_lead_around_every_kind_of_scene(name):
    avoid, *ends = SCENES[name]
    start, goal = (np.array(end, dtype=np.float64) for end in ends)
    way = way_around(Kept.of(avoid, len(start)), start, goal)
    assert (way[0] == start).all() and (way[-1] == goal).all()
    shares = np.linspace(0.0, 1.0, 501)[:, None]
    points = np.concatenate([(1.0 - shares) * a + shares * b for a, b in zip(way, way[1:], strict=False)])
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    assert not any(inside(each, points).any() for each in avoid)


def inside(obstacle, points):
    """Whether points are inside an obstacle, by its definition alone."""
    if isinstance(obstacle, Cylinder):
        return ((points[:, :2] - obstacle.center) ** 2).sum(axis=1) < obstacle.radius**2
    if isinstance(obstacle, Ellipsoid):
        return (((points - obstacle.center) / obstacle.half_axes) ** 2).sum(axis=1) < 1.0
    return ((points > obstacle.lower) & (points < obstacle.upper)).all(axis=1)


@settings(deadline=None, max_examples=30)
@given(
    scale=st.floats(1e-3, 1e4),
    wide=st.floats(0.0, 100.0),
    high=st.floats(0.0, 100.0),
    radius=st.floats(1e-4, 1.0),
    clearance=st.floats(0.0, 10.0),
)
def test_there_are_never_more_cells_than_the_most(scale, wide, high, radius, clearance):
    kept = Kept.of([Ellipsoid(scale * np.array(c), scale * radius) for c in ((2, wide, -high), (3, -wide, high))], 3)
    ends = scale * np.array([(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)])
    sizes = list(module._sizes(kept._replace(clearance=scale * clearance), ends))
    extent = module._extent_around(kept, ends)
    counts = [np.prod(module._sides_of_grid(kept, extent, size)[1]) for size in sizes]
    assert 1 <= len(sizes) <= 1 + AROUND.finer and max(counts) <= AROUND.most
    assert all(finer < size for size, finer in zip(sizes, sizes[1:], strict=False))
    grid = next(cells_around(kept, *ends))
    assert isinstance(grid, FreeCells) and grid.free.ndim == 3 and grid.free.size <= AROUND.most


@pytest.mark.parametrize("dim", [2, 3])
def test_the_less_time_there_is_the_fewer_cells_a_way_is_looked_for_in(dim):
    kept, ends = Kept.of(trunks(5, 60), dim), [np.array(end[:dim]) for end in ACROSS]
    counts = [next(cells_around(kept, *ends, seconds=seconds)).free.size for seconds in (np.inf, 0.1, 0.01, -1.0)]
    assert counts == sorted(counts, reverse=True) and counts[1] <= 0.1 * AROUND.each_second
    assert all(
        count <= max(AROUND.each_second * seconds, 2e5)
        for count, seconds in zip(counts[1:], (0.1, 0.01, 0.0), strict=True)
    )
    for seconds in (0.1, 0.01, -1.0):
        assert way_around(kept, *ends, seconds=seconds) is not None


def test_the_finest_cells_that_fit_are_tried_where_halves_do_not():
    """Where halves were too many, nothing was tried."""
    wall = [Cuboid((20, -50, -50), (20.1, -1.0, 50)), Cuboid((20, 1.0, -50), (20.1, 50, 50))]
    bars = [Cuboid((20, -1, -50), (20.1, 1, -1.0)), Cuboid((20, -1, 1.0), (20.1, 1, 50))]
    route = plan_through([*wall, *bars], (0, 5, 0), (40, 5, 0), clearance=0.3, limits=LIMITS)
    at = sampled(route.trajectory)
    through = at[(at[:, 0] > 20.0) & (at[:, 0] < 20.1)]
    assert len(through) and (np.abs(through[:, 1:]) <= 0.7 + 1e-9).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_fence_that_is_too_narrow_says_how_wide_it_is(dim):
    """A scene of too many cells ended in "sequence argument must have length equal to input rank"."""
    fence = [Cylinder((20, y), 0.5) for y in np.arange(-45.0, 46.0, 3.0)]
    said = r"no way from .* the widest one has about (0\.[7-9]\d?|1) m on each side, near \((19|20)\."
    with pytest.raises(UnprovedError, match=said):
        plan_through(fence, *(end[:dim] for end in ACROSS), clearance=1.2, limits=LIMITS)
