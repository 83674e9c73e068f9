"""Distances of segments against exact rational arithmetic, and polytopes around clouds without a point in them."""

from fractions import Fraction
from itertools import pairwise
from math import isqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import minsnap
from minsnap.errors import CorridorError
from minsnap.native.map_ways import tangent_planes
from minsnap.paths.routes import corridor

NUMBER = st.floats(-50.0, 50.0, allow_subnormal=False)


def exact(values):
    return [Fraction(float(value)) for value in values]


def square_to_box(start, end, low, high):
    """Square of the distance of a segment to a box: on each part of it, a parabola, whose least value is rational."""
    step = [b - a for a, b in zip(start, end, strict=True)]
    borders = {Fraction(0), Fraction(1)}
    for a, d, sides in zip(start, step, zip(low, high, strict=True), strict=True):
        borders |= {share for side in sides if d for share in [(side - a) / d] if 0 < share < 1}

    def ways(share):
        """How far the point is outside along each axis, and how that changes along the segment."""
        found = []
        for a, d, (below, above) in zip(start, step, zip(low, high, strict=True), strict=True):
            x = a + share * d
            found.append((below - x, -d) if x < below else (x - above, d) if x > above else (Fraction(0), Fraction(0)))
        return found

    least = min(sum(way**2 for way, _ in ways(share)) for share in borders)
    for left, right in pairwise(sorted(borders)):
        middle = (left + right) / 2
        found = ways(middle)
        bend = sum(slope**2 for _, slope in found)
        if bend:
            share = middle - sum(way * slope for way, slope in found) / bend
            if left < share < right:
                least = min(least, sum((way + (share - middle) * slope) ** 2 for way, slope in found))
    return least


def root(square):
    """Square root of a rational number, to 30 digits more than a float has."""
    scale = 10**60
    return float(Fraction(isqrt(square.numerator * scale**2 // square.denominator), scale))


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.sampled_from([2, 3]), st.data())
def test_distances_to_points_and_boxes_are_those_of_exact_arithmetic(dim, data):
    start, end, point, corner = (np.array(data.draw(st.tuples(*[NUMBER] * dim))) for _ in range(4))
    other = corner + np.array(data.draw(st.tuples(*[st.floats(0.0, 9.0, allow_subnormal=False)] * dim)))
    path = np.stack((start, end))
    if (start == end).all():
        return
    scale = 1e-12 * (1.0 + np.abs(np.stack((start, end, point, corner, other))).max())
    alone = tangent_planes(path, np.zeros((0, 13)), point[None], 0.0, 300.0)
    least = root(square_to_box(*map(exact, (start, end, point, point))))
    assert alone.distance[0] == pytest.approx(least, abs=1e3 * scale)
    box = np.zeros((1, 13))
    box[0, 6], box[0, 7:10], box[0, 10:] = -1.0, -np.inf, np.inf
    box[0, 7 : 7 + dim], box[0, 10 : 10 + dim] = corner, other
    beside = tangent_planes(path, box, np.zeros((0, dim)), 0.0, 300.0)
    least = root(square_to_box(*map(exact, (start, end, corner, other))))
    assert beside.distance[0] == pytest.approx(least, abs=1e3 * scale)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2, 3]), st.floats(0.0, 0.3))
def test_polytopes_around_clouds_hold_their_legs_and_no_point(seed, dim, clearance):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform(-5.0, 5.0, (int(rng.integers(1, 40)), dim))
    path = rng.uniform(-5.0, 5.0, (3, dim))
    lines = [tuple(map(exact, line)) for line in pairwise(path)]
    nearest = min(root(square_to_box(*line, at, at)) for line in lines for at in map(exact, cloud))
    if nearest < clearance + 1e-6:
        if nearest < clearance - 1e-6:
            with pytest.raises(CorridorError, match="the clearance is"):
                corridor(cloud, path, clearance)
        return
    for (A, b), (start, end) in zip(corridor(cloud, path, clearance).half_spaces, pairwise(path), strict=True):
        assert (A @ np.stack((start, end)).T <= b[:, None] + 1e-9).all(), "the leg is inside"
        beyond = (A @ cloud.T - b[:, None]) / np.linalg.norm(A, axis=1)[:, None]
        assert (beyond.max(axis=0) >= clearance - 1e-9).all(), "each point is beyond a plane by the clearance"


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6))
def test_flights_through_polytopes_keep_dense_samples_away_from_the_cloud(seed):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform((0.0, -3.0), (10.0, 3.0), (25, 2))
    cloud = cloud[np.linalg.norm(cloud, axis=1) > 1.0]
    cloud = cloud[np.linalg.norm(cloud - (10.0, 0.0), axis=1) > 1.0]
    route = minsnap.routes.plan_through(cloud, (0, 0), (10, 0), 0.25)
    samples = route.trajectory(np.linspace(0.0, route.duration, 2000))
    apart = np.linalg.norm(samples[:, None] - cloud, axis=2).min()
    assert apart >= 0.25 - 1e-9 and abs(route.distance - apart) < 1e-3
