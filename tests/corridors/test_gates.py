"""Waypoints that are balls and gates: their geometry, the plans through them, and what is refused."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

import minsnap
from minsnap import Ball, Boxes, Gate
from minsnap.basics.arrays import SMALLEST, lengths_of
from minsnap.corridors.knot_regions import ball_region, gate_region
from minsnap.errors import CorridorError, WaypointError

POINTS = [(0, 0, 1), (3, 1, 2), (6, -1, 1), (9, 0, 1)]
SLANTED = Gate((3, 1, 2), (1, 1, 0.5), 1.0, 0.6)
GATES = {
    "upright": Gate((3, 1, 2), (1, 0, 0), 1.0, 0.6),
    "turned": Gate((3, 1, 2), (1, 1, 0), 1.0, 0.6),
    "slanted": SLANTED,
    "level": Gate((3, 1, 2), (0, 0, 1), 0.5),
    "triangle": Gate.polygon([(3, 0.5, 1.6), (3.2, 1.5, 1.6), (3, 1, 2.8)]),
}


def cost_through(points, durations):
    return minsnap.plan(points, durations).cost()


def quadratic_cost(durations, movable):
    """Cost as a quadratic function of the displacements of some waypoints: value, gradient, Hessian, by differences."""
    size, points = 3 * len(movable), np.array(POINTS, dtype=float)

    def cost(move):
        shifted = points.copy()
        shifted[movable] += move.reshape(-1, 3)
        return cost_through(shifted, durations)

    step, middle = np.eye(size), cost(np.zeros(size))
    ahead, back = (np.array([cost(sign * row) for row in step]) for sign in (1, -1))
    mixed = np.array([[cost(a + b) for b in step] for a in step])
    return middle, (ahead - back) / 2, mixed - ahead[:, None] - ahead[None, :] + middle


def least_cost(durations, movable, constraints):
    middle, slope, curve = quadratic_cost(durations, movable)
    found = minimize(
        lambda x: 1.0 + (slope @ x + x @ curve @ x / 2) / middle,
        np.zeros(len(slope)),
        jac=lambda x: (slope + curve @ x) / middle,
        constraints=constraints,
        options={"ftol": 1e-15, "maxiter": 400},
    )
    return middle * found.fun


def inside_hull(points, corners, normal):
    """Largest distance of points outside a flat convex polygon, by the facets of a prism on it."""
    normal = normal / np.linalg.norm(normal)
    prism = ConvexHull(np.concatenate((corners - normal, corners + normal)))
    sides = prism.equations[np.abs(prism.equations[:, :3] @ normal) < 0.5]
    return max((sides[:, :3] @ points.T + sides[:, 3:]).max(), np.abs((points - corners[0]) @ normal).max())


def test_balls_are_the_optimum_of_an_independent_programme():
    times = [2.0, 2.5, 1.5]
    balls = [{"type": "ineq", "fun": lambda x, k=k: 0.09 - x[3 * k : 3 * k + 3] @ x[3 * k : 3 * k + 3]} for k in (0, 1)]
    traj = minsnap.plan(POINTS, times, waypoint_tolerance=Ball(0.3))
    distance = np.linalg.norm(traj(traj.leg_breaks) - np.array(POINTS), axis=1)
    assert distance.max() <= 0.3 and distance[[0, -1]].max() == 0.0
    assert traj.cost() == pytest.approx(least_cost(times, [1, 2], balls), rel=3e-6)


def test_gates_are_the_optimum_of_an_independent_programme():
    times = [2.0, 2.5, 1.5]
    normals, bounds = SLANTED.edges()
    sides = [
        {"type": "ineq", "fun": lambda x: bounds - normals @ x},
        {"type": "eq", "fun": lambda x: SLANTED.normal @ x},
    ]
    traj = minsnap.plan([POINTS[0], SLANTED, *POINTS[2:]], times)
    assert traj.cost() == pytest.approx(least_cost(times, [1], sides), rel=3e-6)


@pytest.mark.parametrize("gate", GATES.values(), ids=GATES.keys())
def test_sides_of_a_gate_hold_two_corners_each_and_no_corner_is_outside(gate):
    normals, bounds = gate.edges()
    beyond = (gate.corners - gate.center) @ normals.T - bounds
    assert beyond.max() <= 1e-12 and ((np.abs(beyond) <= 1e-12).sum(axis=0) == 2).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0) and np.abs(normals @ gate.normal).max() <= 1e-12


@pytest.mark.parametrize("gate", GATES.values(), ids=GATES.keys())
@pytest.mark.parametrize("how", [{}, {"corridor": 0.6}, {"pieces": 2}, {"continuity": 4}])
def test_a_curve_passes_through_its_gate(gate, how):
    waypoints = [POINTS[0], gate, *POINTS[2:]]
    times = 6.0 * lengths_of(np.array([POINTS[0], gate.center, *POINTS[2:]]))
    times /= times.sum() / 6.0
    traj = minsnap.plan(waypoints, times, **how)
    knot = traj(traj.leg_breaks[1])
    assert inside_hull(knot[None], gate.corners, gate.normal) <= 1e-9
    assert minsnap.certify(traj, waypoints, corridor=how.get("corridor")).ok
    centered = minsnap.plan(POINTS[:1] + [gate.center] + POINTS[2:], times, **how)
    assert traj.cost() < centered.cost() * (1 + 1e-9)


def test_a_gate_is_crossed_in_its_direction():
    for crossing in (1, -1):
        gate = Gate((3, 1, 2), (1, 1, 0.5), 1.0, 0.6, crossing=crossing)
        traj = minsnap.plan([POINTS[0], gate, *POINTS[2:]], total_time=6, search=minsnap.Search(split="distance"))
        assert crossing * (traj(traj.leg_breaks[1], 1) @ gate.normal) >= -1e-9
        assert minsnap.certify(traj, [POINTS[0], gate, *POINTS[2:]]).ok
    free = minsnap.plan([POINTS[0], SLANTED, *POINTS[2:]], total_time=6, search=minsnap.Search(split="distance"))
    back = Gate((3, 1, 2), (1, 1, 0.5), 1.0, 0.6, crossing=-1)
    assert not minsnap.certify(free, [POINTS[0], back, *POINTS[2:]]).ok


def test_larger_regions_never_cost_more():
    costs = [minsnap.plan(POINTS, [2, 2, 2], waypoint_tolerance=Ball(r)).cost() for r in (0.0, 1e-3, 0.1, 0.5, 1.0)]
    assert (np.diff(costs) < 0.0).all()
    box = minsnap.plan(POINTS, [2, 2, 2], waypoint_tolerance=0.5).cost()
    assert box < costs[3] and minsnap.plan(POINTS, [2, 2, 2], waypoint_tolerance=0.5 / np.sqrt(3.0)).cost() > costs[3]


def test_a_closed_lap_begins_in_its_gate():
    lap = [SLANTED, (6, 3, 2), (3, 6, 2), (0, 3, 2), SLANTED]
    traj = minsnap.plan(lap, [2, 2, 2, 2], closed=True, waypoint_tolerance=Ball(0.2))
    assert minsnap.certify(traj, lap, tolerance=Ball(0.2)).ok
    assert traj(traj.duration) == pytest.approx(traj(0.0), abs=1e-12)
    assert traj(traj.duration, 3) == pytest.approx(traj(0.0, 3), abs=1e-9)


def test_gates_in_the_plane_are_segments():
    gate = Gate((3.0, 1.0), (1.0, 1.0), 1.0)
    assert np.linalg.norm(np.diff(gate.corners, axis=0)) == pytest.approx(1.0)
    traj = minsnap.plan([(0, 0), gate, (6, 0)], [2, 2])
    offset = traj(2.0) - gate.center
    assert abs(offset @ gate.normal) <= 1e-12 and np.linalg.norm(offset) <= 0.5 + 1e-12
    assert traj.cost() < minsnap.plan([(0, 0), (3, 1), (6, 0)], [2, 2]).cost()


def test_the_certificate_measures_how_far_outside():
    traj = minsnap.plan(POINTS, [2, 2, 2])
    moved = [(0, 0, 1), Gate((3, 1, 2.5), (1, 0, 0), 1.0, 0.6), (6, -1, 1.5), (9, 0, 1)]
    found = minsnap.certify(traj, moved, tolerance=Ball([0, 0, 0.1, 0]))
    assert not found.ok and found.waypoint_excess == pytest.approx(0.4)
    assert minsnap.certify(traj, moved, tolerance=Ball([0, 0, 0.5, 0])).waypoint_excess == pytest.approx(0.2)


def test_regions_know_their_insides():
    rng = np.random.default_rng(1)
    for gate in GATES.values():
        region = gate_region(gate)
        weights = rng.dirichlet(np.ones(len(gate.corners)), 50)
        for offset in weights @ gate.corners - gate.center:
            assert region.excess(offset) <= 1e-12
        assert region.excess(1.2 * (gate.corners[0] - gate.center)) > 0.01
        assert region.excess(0.05 * gate.normal) == pytest.approx(0.05)
    assert ball_region(0.3, 3).excess(np.array([0.2, 0.2, 0.2])) == pytest.approx(np.sqrt(0.12) - 0.3)


def test_measures_of_a_rectangle():
    width, height = (np.linalg.norm(SLANTED.corners[k + 1] - SLANTED.corners[k]) for k in (0, 1))
    assert (width, height) == pytest.approx((1.0, 0.6))
    assert SLANTED.corners[0, 2] == pytest.approx(SLANTED.corners[1, 2])
    assert np.abs((SLANTED.corners - SLANTED.center) @ SLANTED.normal).max() < 1e-15
    lying = Gate((0, 0, 0), (0, 0, 1), 2.0, 1.0, up=(1, 0, 0))
    assert np.ptp(lying.corners, axis=0) == pytest.approx([1.0, 2.0, 0.0])
    assert not lying.corners.flags.writeable and Gate.polygon(lying.corners).crossing == 0
    assert "Gate(center=" in repr(lying) and repr(Ball(0.3)) == "Ball(0.3)"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Ball(-0.1), "radius of a ball is -0.1"),
        (lambda: Ball("wide"), "the radius of a ball must be finite numbers, not 'wide'"),
        (lambda: Gate("here", (1, 0), 1.0), "the center of a gate must be finite numbers, not 'here'"),
        (lambda: Gate((0, 0), "up", 1.0), "the normal of a gate must be finite numbers, not 'up'"),
        (lambda: Gate.polygon("round"), "the corners of a gate must be finite numbers, not 'round'"),
        (lambda: Ball(np.nan), "must be finite numbers"),
        (lambda: Gate((0, 0), (1, 0), "wide"), "the width of a gate must be finite numbers"),
        (lambda: Gate((0, 0, 0), (1, 0, 0), 1, up="up"), "^up of a gate is 'up': give three coordinates$"),
        (lambda: Gate.polygon([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), "^the area of a polygon is zero"),
        (lambda: Gate.polygon([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 2, 0)]), "none on a straight side"),
        (lambda: Gate((0, 0), (1, 0, 0), 1), r"3 \(or 2\) coordinates"),
        (lambda: Gate((0, 0, 0), (0, 0, 0), 1), "normal of a gate is zero"),
        (lambda: Gate((0, 0, 0), (1, 0, 0), 0.0), "width of a gate is 0.0"),
        (lambda: Gate((0, 0, 0), (1, 0, 0), 1, -2), "height of a gate is -2"),
        (lambda: Gate((0, 0, 0), (1, 0, 0), 1, up=(2, 0, 0)), "along its normal"),
        (lambda: Gate((0, 0, 0), (1, 0, 0), 1, crossing=2), "crossing of a gate is 2"),
        (lambda: Gate.polygon([(0, 0, 0), (1, 0, 0)]), "at least three corners"),
        (lambda: Gate.polygon([(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]), "lie in one plane"),
        (lambda: Gate.polygon([(0, 0, 0), (2, 0, 0), (0.5, 0.5, 0), (0, 2, 0)]), "convex"),
        (lambda: minsnap.plan(POINTS, [1, 1, 1], waypoint_tolerance=Ball([0.1, 0.2])), "2 radii.*4 waypoints"),
        (lambda: minsnap.plan([SLANTED, (9, 0, 1), (0, 9, 1), SLANTED.center], [1, 1, 1], closed=True), "same gate"),
    ],
)
def test_malformed_regions_are_refused_in_one_sentence(make, message):
    with pytest.raises(WaypointError, match=message):
        make()


BEHIND = Boxes([[-1, -2, 0], [3, -2, 0]], [[4, 2, 4], [10, 2, 4]])


@pytest.mark.parametrize(
    ("gate", "message"),
    [
        (Gate((4.5, 0, 1), (1, 0, 0), 1.0), "the gate of waypoint 1 .* is 0.5 m outside the box of leg 0"),
        (Gate((4.5, 0, 1), (1, 1, 0), 1.2), "the gate of waypoint 1 .* is .* outside the box of leg 0"),
        (Gate.polygon([(3.9, 2.5, 1), (5, 1.5, 1), (5, 2.5, 1.5)]), "the gate of waypoint 1 .* has no point inside"),
    ],
)
def test_gates_behind_a_wall_are_named(gate, message):
    with pytest.raises(CorridorError, match=message) as caught:
        minsnap.plan([(0, 0, 1), gate, (9, 0, 1)], [2, 2], corridor=BEHIND)
    assert caught.value.waypoint == 1


def test_a_ball_outside_the_walls_of_its_legs_is_named():
    corridor = Boxes([[-1, -2, 0], [3, -2, 0]], [[4, 2, 4], [10, 2, 4]])
    walled = minsnap.plan(
        [(0, 0, 1), (3.5, 2.2, 1), (9, 0, 1)], [2, 2], corridor=corridor, waypoint_tolerance=Ball(0.3)
    )
    assert minsnap.certify(walled, corridor=corridor).ok
    with pytest.raises(CorridorError, match="the ball of waypoint 1"):
        minsnap.plan([(0, 0, 1), (4.3, 2.3, 1), (9, 0, 1)], [2, 2], corridor=corridor, waypoint_tolerance=Ball(0.4))


def test_a_crossing_out_of_all_that_a_leg_may_reach_is_named():
    corridor = Boxes([[-1, -2, 0], [-1, -2, 0]], [[4, 2, 4], [4, 2, 4]])
    gate = Gate((4.0, 0, 1), (1, 0, 0), 1.0, crossing=1)
    with pytest.raises(CorridorError, match="crossed along .* all of leg 1's corridor lies behind it"):
        minsnap.plan([(0, 0, 1), gate, (2, 1, 1)], [2, 2], corridor=corridor)
    near = Gate((3.5, 0, 1), (1, 0, 0), 1.0, crossing=1)
    assert minsnap.plan([(0, 0, 1), near, (2, 1, 1)], [2, 2], corridor=corridor).report.corridor_margin >= 0.0
    with pytest.raises(CorridorError, match="all of leg 0's corridor lies beyond it"):
        opposite = Gate((-1.0, 0, 1), (1, 0, 0), 1.0, crossing=1)
        minsnap.plan([(0, 0, 1), opposite, (2, 1, 1)], [2, 2], corridor=corridor)


@pytest.mark.parametrize("size", (1.0, 100.0))
@pytest.mark.parametrize(("height", "flat"), ((0.9e-9, True), (1.1e-9, False)))
def test_corners_are_in_one_plane_to_a_billionth_of_the_opening(height, flat, size):
    corners = size * np.array([(1, 1, height), (-1, 1, -height), (-1, -1, height), (1, -1, -height)])
    if flat:
        assert Gate.polygon(corners).normal == pytest.approx([0, 0, 1], abs=1e-8)
    else:
        with pytest.raises(WaypointError, match="one plane"):
            Gate.polygon(corners)


@pytest.mark.parametrize(("cosine", "width_along"), ((1.0 - 0.9e-9, 0), (1.0 - 1.1e-9, 1)))
def test_an_opening_is_level_to_a_billionth(cosine, width_along):
    """The height of a level one is along y, of all others as much upwards as can be: along x here."""
    gate = Gate((0, 0, 0), (np.sqrt(1.0 - cosine**2), 0, cosine), 2.0, 1.0)
    assert np.ptp(gate.corners, axis=0)[width_along] == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize(("off", "along"), ((0.9e-9, True), (1.1e-9, False)))
def test_up_is_along_the_normal_to_a_billionth(off, along):
    if along:
        with pytest.raises(WaypointError, match="along its normal"):
            Gate((0, 0, 0), (0, 1, 0), 1.0, up=(3.0 * off, 3.0, 0))
    else:
        assert Gate((0, 0, 0), (0, 1, 0), 1.0, up=(3.0 * off, 3.0, 0)).corners.shape == (4, 3)


@pytest.mark.parametrize(("off", "zero"), ((0.9e-12, True), (1.1e-12, False)))
def test_components_of_a_normal_that_are_rounding_are_zero(off, zero):
    assert bool(Gate((0, 0), (1, off), 1.0).normal[1] == 0.0) is zero


def test_an_opening_stands_upright_and_is_crossed_either_way_unless_told():
    gate = Gate((1, 2, 3), (1, 1, 0), 2.0, 1.0)
    assert gate.crossing == 0
    assert sorted(gate.corners[:, 2].tolist()) == [2.5, 2.5, 3.5, 3.5]
    assert (gate.corners - gate.center) @ gate.normal == pytest.approx(np.zeros(4), abs=1e-12)


def test_an_opening_in_the_plane_ends_at_its_corners():
    region = gate_region(Gate((1, 1), (1, 1), 2.0))
    along = np.array([1.0, -1.0]) / np.sqrt(2.0)
    for share, excess in ((1.0, 0.0), (-1.0, 0.0), (1.5, 0.5), (-1.25, 0.25)):
        assert max(region.excess(share * along), 0.0) == pytest.approx(excess, abs=1e-12)


def test_a_wall_of_an_opening_along_the_axes_is_part_of_its_box():
    region = gate_region(Gate((0.1, 0.2), (0, 1), 0.3))
    assert not len(region.normals) and region.plane is None
    assert region.upper == pytest.approx([0.15, 0.0]) and region.lower == pytest.approx([-0.15, 0.0])
    upright = gate_region(Gate((0, 0, 1), (1, 0, 0), 1.0, 0.6))
    assert upright.upper == pytest.approx([0.0, 0.5, 0.3]) and upright.lower == pytest.approx([0.0, -0.5, -0.3])


def test_what_is_no_polygon_in_space_or_no_list_of_radii_is_refused():
    with pytest.raises(WaypointError, match="three corners of 3 coordinates"):
        Gate.polygon([(0, 0), (1, 0), (0, 1)])
    with pytest.raises(WaypointError, match="radius of a ball"):
        Ball([[0.1], [0.2]])


def test_a_gate_that_is_level_but_for_rounding_is_a_flat_box():
    region = gate_region(Gate.polygon([(0, 0, 1), (1, 0, 1), (0, 1, 1.0 + 2e-13)]))
    assert region.plane is None and region.lower[2] == region.upper[2] == 0.0


@pytest.mark.parametrize(
    ("place", "normal", "sides"),
    [
        ((1e6, 2e6, 30.0), (1, 0, 0), (1e-20, 1.0)),
        ((1e6, 2e6, 30.0), (1, 0, 0), (1.0, 1e-20)),
        ((1e6, 2e6), (1, 0), (1e-20,)),
    ],
)
def test_a_gate_with_a_side_that_vanishes_in_rounding_is_refused(place, normal, sides):
    with pytest.raises(WaypointError, match="two corners of a gate are both .* too small beside its place"):
        Gate(place, normal, *sides)
    with pytest.raises(WaypointError, match="^the width of a gate"):
        Gate(place, normal, 0.9 * SMALLEST)
    assert Gate(np.zeros(len(place)), normal, SMALLEST).corners.any()


def test_names_that_a_gate_does_not_have_are_answered():
    with pytest.raises(TypeError, match=r"write normal=\(cos\(heading\)"):
        Gate((1, 0, 1), heading=0.3, width=1.0)
