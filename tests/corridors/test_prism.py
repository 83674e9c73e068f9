"""Prisms to keep out of and inside of: parts and margins against brute force and exact arithmetic; plans; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import minsnap
from minsnap import Prism
from minsnap.corridors.keep_out import as_simple, name_of, named_obstacle
from minsnap.corridors.prism import convex_parts, keeps_from_prism, nearest_prism, to_segments
from minsnap.errors import CorridorError, WaypointError
from minsnap.trajectory.trajectory import Trajectory

LIMITS = minsnap.Limits(speed=2.0, acceleration=4.0, jerk=20.0)
YARD = Prism([(0, 0), (9, 0), (9, 6), (5, 6), (5, 3), (0, 3)], inclusion=True)
POCKET = Prism([(2, -2), (4, -2), (4, 2), (2, 2), (2, 1), (3, 1), (3, -1), (2, -1)])


def star(seed):
    """Return a polygon around the origin that is hardly ever convex."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(3, 12))
    angle = 2.0 * np.pi * (np.arange(count) + draw.uniform(-0.3, 0.3, count)) / count
    return draw.uniform(0.5, 2.0, count)[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)


def within(polygon, points):
    """Whether points are inside by their winding number."""
    to = polygon[None] - points[:, None]
    after = np.roll(to, -1, axis=1)
    turn = np.arctan2(to[..., 0] * after[..., 1] - to[..., 1] * after[..., 0], (to * after).sum(axis=2))
    return np.abs(turn.sum(axis=1)) > np.pi


def area(corners):
    after = np.roll(corners, -1, axis=0)
    return 0.5 * (corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum()


@given(st.integers(0, 10_000))
def test_convex_parts_cover_the_polygon_once(seed):
    polygon = Prism(star(seed)).polygon
    parts = [polygon[list(part)] for part in convex_parts(polygon)]
    for part in parts:
        edges = np.roll(part, -1, axis=0) - part
        assert (edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] >= edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]).all()
    assert sum(map(area, parts)) == pytest.approx(area(polygon), rel=1e-9)
    points = np.random.default_rng(seed).uniform(-2, 2, (500, 2))
    assert (np.any([within(part, points) for part in parts], axis=0) == within(polygon, points)).all()


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.booleans())
def test_margins_are_those_of_dense_samples(seed, inclusion):
    draw = np.random.default_rng(seed)
    points = draw.normal(scale=0.3 if inclusion else 1.5, size=(2, 5, 2)) + (0.0 if inclusion else 2.0)
    points[1, 0] = points[0, -1]
    curve, prism = Trajectory(points, [1.0, 2.0]), Prism(star(seed), inclusion=inclusion)
    places = curve(np.linspace(0.0, 3.0, 30_001))
    edge = to_segments(places[:, None], prism.polygon, np.roll(prism.polygon, -1, axis=0)).min(axis=1)
    sampled = np.where(within(prism.polygon, places) == inclusion, edge, -edge).min()
    near = nearest_prism(curve, prism)
    if sampled > 1e-3:
        assert sampled - 2e-3 <= near.value <= sampled + 1e-9
        assert keeps_from_prism(curve, prism, near.value) and not keeps_from_prism(curve, prism, near.value + 1e-5)
    else:
        assert near.value < 2e-3 and (near.value < 0.0 or sampled > -1e-3)


def test_ends_count_in_space_and_are_proved():
    low = Prism(POCKET.polygon, -1.0, 1.2)
    over = minsnap.line((0, 0, 1.5), (6, 0, 1.5), total_time=6.0).as_trajectory()
    certificate = minsnap.certify(over, avoid=[minsnap.Cylinder((50, 0), 1.0), low])
    assert certificate.obstacle_margin == pytest.approx(0.3, abs=1e-8) and certificate.verify()
    near = certificate.nearest_obstacle
    assert near.obstacle == 1 and not replace(certificate, nearest_obstacle=replace(near, value=0.301)).verify()
    room = Prism([(-1, -1), (7, -1), (7, 1), (-1, 1)], 0.0, 2.0, inclusion=True)
    assert minsnap.certify(over, avoid=room).obstacle_margin == pytest.approx(0.5, abs=1e-8)
    assert not minsnap.certify(over, avoid=Prism(room.polygon, 0.0, 1.4, inclusion=True)).ok
    through = minsnap.certify(over, avoid=POCKET)
    assert not through.ok and through.obstacle_margin == pytest.approx(-0.5, abs=1e-2)


@pytest.mark.parametrize(
    ("points", "avoid"),
    [
        ([(1, 1, 1), (8, 5, 1)], YARD),
        ([(1, 1), (8, 5)], [YARD, minsnap.Cylinder((6, 1.5), 0.4)]),
        ([(1, 1, 1), (8, 5, 1)], Prism(YARD.polygon, 0.5, 1.5, inclusion=True)),
        ([(0, 0), (6, 0)], POCKET),
        ([(2.5, 0), (6, 0)], POCKET),
        ([(0, 0, 1), (6, 0, 1)], Prism(POCKET.polygon, -5.0, 1.2)),
        ([(1, 1, 1), (8, 5, 1)], [YARD, minsnap.Moving([(0, 8, 1, 1), (6, 1, 1, 1)], 0.4)]),
        ([(1, 1), (8, 2)], Prism.circle((5, 1), 5.0, inclusion=True)),
    ],
)
def test_plans_keep_out_of_prisms_and_inside_of_fences(points, avoid):
    curve = minsnap.plan(points, limits=LIMITS, avoid=avoid)
    certificate = minsnap.certify(curve, points, limits=LIMITS, avoid=avoid)
    assert certificate.ok and certificate.obstacle_margin >= 0.0 and certificate.verify()


def test_routes_keep_the_clearance_to_prisms_beside_maps_and_alone():
    route = minsnap.routes.plan_through([YARD], (1, 1), (8, 5), clearance=0.2, limits=LIMITS)
    assert route.distance >= 0.2 - 1e-9
    cells = np.zeros((90, 60))
    cells[60:65, :30] = 1
    inside = minsnap.routes.plan_through(
        cells,
        (1, 1),
        (8, 5),
        clearance=0.2,
        resolution=0.1,
        avoid=[YARD, minsnap.Cylinder((4, 1.5), 0.3)],
        limits=LIMITS,
    )
    assert inside.distance >= 0.2 - 1e-9
    assert nearest_prism(inside.trajectory, YARD).value >= 0.2 - 1e-9
    assert minsnap.certify(inside.trajectory, avoid=minsnap.Cylinder((4, 1.5), 0.3)).obstacle_margin >= 0.2 - 1e-9
    polytopes = minsnap.routes.corridor([POCKET], [(0, 0), (1, 2.5), (5, 2.5)], clearance=0.2)
    assert len(polytopes.half_spaces) == 2
    with pytest.raises(CorridorError, match=r"the segment from \(0, 0\) to \(5, 0\) m is 0 m from prism 0, and the cl"):
        minsnap.routes.corridor([POCKET], [(0, 0), (5, 0)], clearance=0.2)


@pytest.mark.parametrize("prism", [YARD, POCKET, Prism(POCKET.polygon, -1.0, 2.0)])
def test_names_and_numbers_make_a_prism_again(prism):
    again = named_obstacle(*name_of(prism))
    assert (again.polygon == prism.polygon).all()
    assert (again.low, again.high, again.inclusion) == (prism.low, prism.high, prism.inclusion)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Prism([(0, 0), (1, 0, 2)]), "the polygon of a prism is .*: give rows of two finite numbers"),
        (lambda: Prism([(0, 0), (1, 0)]), "the polygon of a prism has 2 corners and no area: give three or more"),
        (lambda: Prism([(0, 0), (1, 0), (2, 0)]), "the polygon of a prism has 3 corners and no area"),
        (
            lambda: Prism([(0, 0), (2, 2), (2, 0), (0, 2)]),
            "no area|edges 0 and 2 of the polygon",
        ),
        (
            lambda: Prism([(0, 0), (3, 3), (2, 0), (0, 2)]),
            "edges 0 and 2 of the polygon of a prism cross",
        ),
        (lambda: Prism(POCKET.polygon, 2, 1), "a prism runs from 2 to 1: give low below high"),
        (lambda: named_obstacle("prism", [3, 0, 0, 1, 0]), "a prism has 5 numbers: give the number of corners"),
        (lambda: as_simple([minsnap.Cylinder((0, 0), 1), YARD]), "obstacle 1 is a prism: fleets take cylinders"),
        (
            lambda: minsnap.plan([(1, 1), (8, 7)], limits=LIMITS, avoid=YARD),
            r"waypoint 1, \(8, 7\), is 1 m outside fence 0: move it",
        ),
        (
            lambda: minsnap.plan([(3.5, 0), (6, 0)], limits=LIMITS, avoid=POCKET),
            r"waypoint 0, \(3.5, 0\), is 0.5 m inside obstacle 0: move it",
        ),
    ],
)
def test_what_is_malformed_or_outside_is_refused(make, said):
    with pytest.raises(CorridorError, match=said):
        make()


@pytest.mark.parametrize(
    ("around", "ends", "said"),
    [
        (
            [YARD],
            ((1, 1), (9.5, 5)),
            r"the goal \(9.5, 5\) m is outside of the fence by 0.5 m, and the",
        ),
        (
            [YARD],
            ((1, 0.1), (8, 5)),
            r"the start \(1, 0.1\) m is inside the fence by 0.1 m, and the",
        ),
        ([POCKET], ((3.5, 0), (8, 5)), r"the start \(3.5, 0\) m is inside a prism by 0.5 m"),
        ([POCKET], ((1.9, 1.5), (8, 5)), r"the start \(1.9, 1.5\) m is 0.1 m from a prism, and the"),
        (
            [minsnap.Cylinder((1, 1), 0.4)],
            ((1, 1.1), (8, 5)),
            r"the start \(1, 1.1\) m is 0.3 m inside obstacle 0",
        ),
    ],
)
def test_routes_say_how_far_an_end_is_inside(around, ends, said):
    with pytest.raises(WaypointError, match=said):
        minsnap.routes.plan_through(around, *ends, clearance=0.2, limits=LIMITS)
