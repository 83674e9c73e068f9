"""Proofs that nothing fits: exact multipliers, against a linear programme in other unknowns, and tampered ones."""

from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from tasks import REFERENCE, random_legs

import minsnap
from minsnap.basics.deadline import Deadline, LateError
from minsnap.errors import InfeasibleError
from minsnap.native.library import using
from minsnap.refusals import infeasibility
from minsnap.refusals.given_times import explain

SIDEWAYS = {"velocity": (0.0, 3.0, 0.0)}
LEG = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)]
BEND = [*LEG, (5.0, 5.0, 0.0)]


def refusal(*given, **options):
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(*given, **options)
    return refused.value


CASES = {
    "continuity": lambda: refusal(REFERENCE, [4, 2, 4, 2], corridor=1e-4, continuity=5),
    "all continuity": lambda: refusal(REFERENCE, [4, 2, 4, 2], corridor=0.01, continuity=6),
    "degree 5": lambda: refusal(*random_legs(3, 5), corridor=1e-3, continuity=4, degree=5),
    "nothing free": lambda: refusal(LEG, [2], corridor=0.01, start=SIDEWAYS),
    "nothing free in a cylinder": lambda: refusal(LEG, [2], corridor=minsnap.RoundTube(0.01), start=SIDEWAYS),
    "pieces": lambda: refusal(BEND, [2, 2], corridor=0.05, pieces=3, start=SIDEWAYS),
    "cylinders": lambda: refusal(BEND, [2, 2], corridor=minsnap.RoundTube(0.05), pieces=2, start=SIDEWAYS),
    "a room": lambda: refusal(
        BEND, [2, 2], corridor=minsnap.Room((-1, -0.1, -1), (6, 6, 6)), start={"velocity": (0, -3, 1)}
    ),
}


@pytest.fixture(scope="module", params=list(product(CASES, ("auto", "python"))), ids="-".join)
def refused(request):
    case, core = request.param
    with using(core):
        return CASES[case]()


def vandermonde(task, s, duration, order):
    """Derivative of the powers of s at a place of a piece, (degree + 1,)."""
    powers = np.polynomial.polynomial.polyder(np.eye(2 * task.half), order, axis=0)
    return (s ** np.arange(len(powers))) @ powers / duration**order


def power_basis_programme(proof):
    """Equations and inequalities of the rows in the coefficients of powers of s of every piece and axis."""
    task, durations = proof.task, proof.durations
    count, size, dim = len(durations), 2 * task.half, task.dim
    equal, sides = [], []

    def functional(*parts):
        found = np.zeros((count, size, dim))
        for piece, s, order, axis, factor in parts:
            found[piece, :, axis] += factor * vandermonde(task, s, durations[piece], order)
        return found.reshape(-1)

    for axis in range(dim):
        for waypoint, point in enumerate(task.waypoints):
            piece = waypoint * task.pieces
            place = (piece, 0.0) if piece < count else (piece - 1, 1.0)
            equal.append(functional((*place, 0, axis, 1.0)))
            sides.append(point[axis])
            for order, value in task.pins.get(waypoint, {}).items():
                equal.append(functional((*place, order, axis, 1.0)))
                sides.append(value[axis])
        for piece in range(count - 1):
            for order in range(task.continuity + 1):
                equal.append(functional((piece, 1.0, order, axis, 1.0), (piece + 1, 0.0, order, axis, -1.0)))
                sides.append(0.0)
    rows, bounds = [], []
    places = zip(proof.walls.piece[proof.wall], proof.s, proof.orders, strict=True)
    for row, place in enumerate(places):
        normal, bound = proof.exact_plane(row)
        parts = [(*place, axis, float(factor)) for axis, factor in enumerate(normal)]
        rows.append(functional(*parts))
        bounds.append(float(bound))
    return np.array(equal), np.array(sides), np.array(rows), np.array(bounds)


@pytest.mark.slow
def test_the_proof_holds_and_names_the_leg(refused):
    proof = refused.contradiction
    assert refused.verify() and proof.verify()
    assert refused.leg in proof.legs
    assert (proof.instants >= 0.0).all() and (proof.instants <= proof.durations.sum()).all()


def test_another_programme_finds_no_curve_either_but_one_where_the_walls_are_wider(refused):
    equal, sides, rows, bounds = power_basis_programme(refused.contradiction)
    give = np.append(np.zeros(rows.shape[1]), 1.0)
    # Rows that lie 1e-6 s apart are parallel but for rounding: along it a programme in floats has no end.
    within = (-1e6, 1e6)
    found = linprog(
        give,
        np.column_stack((rows, -np.ones(len(rows)))),
        bounds,
        np.column_stack((equal, np.zeros(len(equal)))),
        sides,
        bounds=within,
        method="highs",
    )
    assert found.success and found.x[-1] > 1e-4, "all rows must give way by a length"
    wider = linprog(give[:-1], rows, bounds + 1.01 * found.x[-1], equal, sides, bounds=within, method="highs")
    assert wider.success


def largest(proof):
    """Return which wall has the largest part in the sum."""
    parts = [abs(bound * m) for (_, bound), m in zip(proof.rows, proof.multipliers, strict=True)]
    return max(range(len(proof.wall)), key=parts.__getitem__)


def times(proof, row, factor):
    """The same proof with another multiplier of a wall."""
    return proof.with_multipliers([m * factor if i == row else m for i, m in enumerate(proof.multipliers)])


def test_a_proof_that_was_changed_does_not_hold(refused):
    proof = refused.contradiction
    first, one = largest(proof), np.zeros(len(proof.walls))
    one[proof.wall[first]] = 100.0 / proof.walls.width[proof.wall[first]]
    assert not replace(proof, walls=proof.walls.relaxed(one)).verify()
    assert not times(proof, first, 0).verify()
    if not proof.walls.place(proof.wall[first])[0].flat:
        for factor in (1.001, -1.0):
            direction = proof.direction.copy()
            direction[first] *= factor
            assert not replace(proof, direction=direction).verify()
    if proof.joints:
        assert not replace(proof, joints=(), multipliers=proof.multipliers[: len(proof.wall)]).verify()


def test_a_wider_corridor_has_no_proof_because_it_has_a_plan():
    refused = CASES["pieces"]()
    traj = minsnap.plan(BEND, [2, 2], corridor=refused.smallest_width, pieces=3, start=SIDEWAYS)
    assert traj.report.corridor_margin >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "asked",
    [
        {"corridor": 1e-6, "closed": True, "continuity": 6},
        {"corridor": 0.01, "waypoint_tolerance": 0.02, "start": {"velocity": (0.0, 3.0, 0.0)}},
        {"corridor": minsnap.RoundTube(0.01), "waypoint_tolerance": minsnap.Ball(0.02), "start": SIDEWAYS},
        {"limits": minsnap.Limits(speed=0.5)},
        {"limits": minsnap.Limits(speed=2.0, acceleration=1.0), "corridor": 0.5},
    ],
)
def test_laps_free_waypoints_and_limits_have_proofs(asked):
    square = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (0, 0, 0)]
    refused = refusal(square, [1, 9, 1, 9], **asked)
    assert refused.verify()
    assert not times(refused.contradiction, largest(refused.contradiction), 0).verify()


def test_pins_that_break_a_continuity_have_a_proof():
    points, pins = [(0, 0, 0), (2, 1, 0), (4, 0, 0)], {1: {"velocity": (1, 1, 0)}}
    refused = refusal(points, [1.5, 0.9], degree=3, continuity=2, pins=pins)
    assert refused.verify()


SHORT_LEGS = [(-6.32, 9.3), (-6.07, 9.51), (-4.97, 3.14), (-5.29, 2.93), (-5.31, 0.1), (-4.6, -0.47)]


def test_multipliers_that_prove_enough_are_not_refined():
    """A step of refinement may leave nothing of a contradiction, here where durations differ by a hundred."""
    durations, start = [0.225, 19.936, 0.171, 5.831, 0.63], {"velocity": (3.315, -1.312)}
    assert refusal(SHORT_LEGS, durations, degree=11, corridor=0.0725, start=start).verify()


def test_refined_multipliers_keep_what_they_contradict():
    proof = CASES["degree 5"]().contradiction
    off = times(proof, 0, Fraction(1001, 1000))
    refined = off.less_left(off.multipliers)
    assert sum_of_bounds(off, refined) == pytest.approx(sum_of_bounds(off, off.multipliers), rel=1e-9)
    assert replace(off, multipliers=refined).verify()


def test_a_joint_whose_sides_are_both_known_has_a_multiplier_too():
    """The first two legs stand still, pinned to rest: no derivative at the knot between them is unknown."""
    rest = {name: [0.0] for name in ("velocity", "acceleration", "jerk")}
    error = refusal(
        [[1.0], [1.0], [1.0], [2.0], [3.0]],
        [1, 1, 1, 1],
        pins={1: rest, 2: rest},
        continuity=4,
        limits=minsnap.Limits(speed=0.5),
    )
    assert error.verify() and error.contradiction.joints


def sum_of_bounds(proof, multipliers):
    return float(sum(m * bound for m, (_, bound) in zip(multipliers, proof.rows, strict=True)))


def test_continuity_that_least_squares_cannot_tell_from_a_solution_is_refused_by_elimination():
    """One equation too many among derivatives up to the tenth, of pieces of 0.1 and of 2.3 s."""
    points = [-0.9693203, 1.45015834, 0.07401514, -0.00914524, 2.33489319, 1.6862182]
    durations = [2.30616198, 1.80099956, 0.10279688, 1.74167231, 0.68488325]
    asked = {"end": {"jerk": [-0.87198031]}, "pins": {4: {"velocity": [0.0022526]}}}
    error = refusal(np.reshape(points, (6, 1)), durations, degree=11, continuity=10, **asked)
    assert "pins and continuity ask for more" in str(error) and error.verify()
    assert not len(error.contradiction.wall) and len(error.contradiction.joints) == 20


def test_the_proof_of_a_refusal_ends_at_the_deadline():
    proof = CASES["pieces"]().contradiction
    late = replace(proof, task=replace(proof.task, deadline=Deadline(0.0)))
    with pytest.raises(LateError, match="time_limit has passed"):
        explain(late.task, proof.durations)
    with pytest.raises(LateError, match="time_limit has passed"):
        late.refined()


def test_without_a_proof_nothing_is_called_infeasible(monkeypatch):
    monkeypatch.setattr(infeasibility, "find_contradiction", lambda *given: None)
    with pytest.raises(minsnap.MinsnapError, match="could not be proved") as failed:
        minsnap.plan(LEG, [2], corridor=0.01, start=SIDEWAYS)
    assert not isinstance(failed.value, InfeasibleError)


def test_what_multipliers_leave_over_is_counted():
    """A multiplier that is off by a part in a thousand proves nothing: curves of a billion legs are ruled out too."""
    proof = CASES["degree 5"]().contradiction
    off = times(proof, largest(proof), Fraction(1001, 1000))
    assert not off.verify()
    assert off.refined().verify()
    assert not times(proof, largest(proof), -1).verify()
