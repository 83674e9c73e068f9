"""Polytopes around lines of points: they hold their segments, and no point of them is nearer than the clearance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize_scalar

import minsnap
from minsnap import Cuboid, Cylinder, Ellipsoid
from minsnap.errors import CorridorError
from minsnap.native.map_ways import tangent_planes
from minsnap.paths.routes import GridMap, corridor


def distance_to(obstacle, point):
    """Distance of a point (3,) to a cylinder, a sphere or a cuboid, by its own closed form."""
    if isinstance(obstacle, Cuboid):
        return np.linalg.norm(point - np.clip(point, obstacle.lower, obstacle.upper))
    if isinstance(obstacle, Ellipsoid):
        return max(np.linalg.norm(point - obstacle.center) - obstacle.half_axes[0], 0.0)
    beside = max(np.hypot(*(point[:2] - obstacle.center)) - obstacle.radius, 0.0)
    return np.hypot(beside, max(point[2] - obstacle.high, obstacle.low - point[2], 0.0))


def scene(rng, dim, count):
    """Return random cylinders, spheres and cuboids; those of the plane reach through it."""
    height = 9.0 if dim == 2 else 0.8
    for _ in range(count):
        at, size = (
            np.append(rng.uniform(-4.0, 4.0, 2), 0.0 if dim == 2 else rng.uniform(-2.0, 2.0)),
            rng.uniform(0.2, 0.9),
        )
        kind = rng.integers(3)
        if kind == 0:
            yield Cylinder(
                at[:2], size, *((-np.inf, np.inf) if rng.random() < 0.5 else (at[2] - height, at[2] + height))
            )
        elif kind == 1:
            yield Ellipsoid(at, size)
        else:
            yield Cuboid(at - (size, 0.5 * size, height), at + (size, 0.5 * size, height))


def apart(path, obstacles):
    """Least distance of each segment of a line to any obstacle, by a search along it."""
    lines = zip(path[:-1], path[1:], strict=True)

    def along(obstacle, a, b):
        found = minimize_scalar(lambda s: distance_to(obstacle, a + s * (b - a)), bounds=(0, 1), method="bounded",
                                options={"xatol": 1e-12})  # fmt: skip
        return min(found.fun, distance_to(obstacle, a), distance_to(obstacle, b))

    return np.array([min(along(obstacle, a, b) for obstacle in obstacles) for a, b in lines])


def corners_of(A, b, rng, count=40):
    """Return the points of a polytope that are farthest along random directions."""
    for way in rng.normal(size=(count, A.shape[1])):
        found = linprog(-way, A, b, bounds=(None, None))
        assert found.success
        yield found.x


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2, 3]), st.floats(0.0, 0.4))
def test_polytopes_hold_their_segments_and_keep_the_clearance(seed, dim, clearance):
    rng = np.random.default_rng(seed)
    obstacles = list(scene(rng, dim, 8))
    path = np.zeros((4, 3))
    path[:, :dim] = rng.uniform(-4.0, 4.0, (4, dim))
    gaps = apart(path, obstacles)
    if gaps.min() <= clearance + 1e-6:
        if gaps.min() < clearance - 1e-6:
            with pytest.raises(CorridorError, match="the clearance is"):
                corridor(obstacles, path[:, :dim], clearance)
        return
    found = corridor(obstacles, path[:, :dim], clearance)
    for segment, (A, b) in enumerate(found.half_spaces):
        assert (path[segment : segment + 2, :dim] @ A.T <= b + 1e-9).all()
        for corner in corners_of(A, b, rng):
            place = np.append(corner, np.zeros(3 - dim))
            assert min(distance_to(obstacle, place) for obstacle in obstacles) >= clearance - 1e-7


def test_distances_of_segments_are_those_of_a_search_along_them():
    rng = np.random.default_rng(4)
    obstacles = list(scene(rng, 3, 12))
    path = rng.uniform(-4.0, 4.0, (30, 3))
    numbers = np.stack([obstacle.numbers() for obstacle in obstacles])
    found = tangent_planes(path, numbers, np.zeros((0, 3)), 0.0, 100.0)
    assert found.distance == pytest.approx(apart(path, obstacles), abs=1e-7)


def test_an_ellipsoid_is_touched_where_its_normal_points_at_the_segment():
    axes = np.array([2.0, 0.7, 0.4])
    numbers = Ellipsoid((0.0, 0.0, 0.0), axes).numbers()[None]
    rng = np.random.default_rng(1)
    for point in rng.normal(size=(20, 3)) * 4.0:
        if ((point / axes) ** 2).sum() <= 1.0:
            continue
        found = tangent_planes(np.stack((point, point)), numbers, np.zeros((0, 3)), 0.0, 100.0)
        normal, bound = found.sets[0][0][-1], found.sets[0][1][-1]
        touched = -(axes**2) * normal / np.linalg.norm(axes * normal)  # the farthest against the normal
        assert normal @ touched == pytest.approx(bound, abs=1e-9)
        assert found.distance[0] == pytest.approx(np.linalg.norm(point - touched), abs=1e-7)


@pytest.mark.parametrize("dim", [2, 3])
def test_clouds_and_maps_are_kept_away_from(dim):
    rng = np.random.default_rng(dim)
    points = rng.uniform(0.0, 6.0, (400, dim))
    path = np.zeros((3, dim))
    path[:, 0], path[:, 1] = (0.0, 3.0, 6.0), 3.0
    lines = path[0] + np.linspace(0, 1, 601)[:, None] * (path[-1] - path[0])
    gaps = np.linalg.norm(points[:, None] - lines[None], axis=2).min(axis=1)
    points = points[gaps > 0.35]
    for A, b in corridor(points, path, 0.3).half_spaces:
        for corner in corners_of(A, b, rng):
            assert np.linalg.norm(points - corner, axis=1).min() >= 0.3 - 1e-7
    cells = np.zeros((60,) * dim, dtype=bool)
    cells[tuple(np.clip(points / 0.1, 0, 59).astype(int).T)] = True
    grid = GridMap(cells, 0.1)
    lower = 0.1 * np.argwhere(cells)
    for A, b in corridor(grid, path + 0.01 * (1.0 - path / 3.0), 0.2).half_spaces:
        for corner in corners_of(A, b, rng, 20):
            outside = np.maximum(np.maximum(lower - corner, corner - lower - 0.1), 0.0)
            assert np.linalg.norm(outside, axis=1).min() >= 0.2 - 1e-7
            assert (corner >= -1e-9).all() and (corner <= 6.0 + 1e-9).all()


def test_what_is_cut_off_by_a_plane_needs_none_of_its_own():
    wall = [Cylinder((x, 1.0), 0.2) for x in np.linspace(0.0, 10.0, 40)]
    ((A, b),) = corridor(wall, [(0.0, 0.0), (10.0, 0.0)], 0.1).half_spaces
    assert len(b) <= 8
    assert A.shape == (len(b), 2)


@pytest.mark.parametrize(
    ("around", "path", "words"),
    [
        ([Cylinder((2, 0), 0.5)], [(0, 0), (4, 0)], "obstacle 0, and the clearance is 0 m"),
        (np.zeros((3, 3)), [(0, 0), (4, 0)], "points of 2 finite numbers"),
        ([(np.nan, 0.0)], [(0, 0), (4, 0)], r"point 0 of what is around the path is \(nan, 0\): give finite numbers"),
        ("a wall", [(0, 0), (4, 0)], "give cylinders"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(around, path, words):
    with pytest.raises(CorridorError, match=words):
        corridor(around, path)


def test_a_plan_through_polytopes_is_certified():
    obstacles = [Cylinder((2, 0), 0.5), Cylinder((4, 1), 0.4), Cylinder((6, -0.2), 0.5)]
    around = corridor(obstacles, [(0, 0, 1), (2, 1, 1), (4, 0, 1), (6, 1, 1), (8, 0, 1)], clearance=0.1)
    ends = {"start": {"position": (0, 0, 1)}, "end": {"position": (8, 0, 1)}}
    curve = minsnap.plan(None, corridor=around, limits=minsnap.Limits(speed=3, acceleration=6), **ends)
    assert minsnap.certify(curve, corridor=around).ok
    sampled = curve(np.linspace(0.0, curve.duration, 2001))
    assert min(distance_to(obstacle, point) for obstacle in obstacles for point in sampled) >= 0.1 - 1e-9


def test_points_of_a_cloud_count_where_they_are_as_near_as_the_reach():
    """Beside a slanted segment most of its box is far away from it."""
    rng = np.random.default_rng(0)
    path = np.array([(-4.0, -4.0, 0.0), (4.0, 4.0, 2.0)])
    points, reach, clearance = rng.uniform(-6.0, 6.0, (3000, 3)), 0.4, 0.1
    share = np.clip((points - path[0]) @ (path[1] - path[0]) / ((path[1] - path[0]) ** 2).sum(), 0.0, 1.0)
    gaps = np.linalg.norm(points - path[0] - share[:, None] * (path[1] - path[0]), axis=1)
    found = tangent_planes(path, np.zeros((0, 13)), points, clearance, reach)
    balls = np.zeros((len(points), 13))
    balls[:, :3], balls[:, 3:6], balls[:, 7:10], balls[:, 10:] = points, 1.0, -np.inf, np.inf
    near = tangent_planes(path, balls, points[:0], clearance, reach)  # balls without extent are measured by themselves
    assert found.nearest[0] == gaps.argmin() and found.distance[0] == pytest.approx(gaps.min(), abs=1e-9)
    assert (found.sets[0][0] == near.sets[0][0]).all() and (found.sets[0][1] == near.sets[0][1]).all()
    assert len(near.sets[0][0]) > 6
