"""One polynomial inside conditions at instants: against Clarabel on its monomials, and what is malformed."""

from dataclasses import replace
from math import perm

import clarabel
import numpy as np
import pytest
from scipy.sparse import csc_matrix

from minsnap import Boxes, Limits, Trajectory
from minsnap.durations.connector import piece_demands
from minsnap.durations.single_piece import Demand, SinglePiece, conditions_of
from minsnap.native.library import core, using
from minsnap.native.piece_programme import PieceConditions, piece_within

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

ACCELERATION = 5.0
BOX = Boxes([(-0.4, -0.5, 0.0)], [(3.0, 0.6, 2.0)])
LIMITS = Limits(speed=3.0, acceleration=ACCELERATION, tilt=0.5)


def demands_from(state):
    """Demands on a piece from a state that may exceed its limits: on the way, and at its end, extrapolated too."""
    walls = [wall.from_origin(np.array([0.0, 0.0, 1.0])) for wall in BOX.walls(np.zeros((2, 3)))]
    walls += LIMITS.walls(np.zeros((2, 3)))
    way = [demand for wall in walls for demand in piece_demands(wall, state, 0.6)]
    return way + [Demand(wall, np.ones(1), np.array([0.02]), ahead=0.05 * (wall.order == 1)) for wall in walls]


def start(seed, half):
    """A state and a duration, some with no way inside the limits at the end."""
    random = np.random.default_rng(seed)
    state = random.normal(size=(half, 3)) * np.array([0.0, 2.2, 2.0, 10.0, 50.0])[:half, None]
    return state, float(random.uniform(0.3, 1.0))


def of_monomials(half, order, s, duration):
    """Factors of the coefficients of (t / T)^j in a derivative at s, (2k,)."""
    return np.array([perm(j, order) * s ** max(j - order, 0) / duration**order for j in range(2 * half)])


def by_clarabel(state, duration, demands):
    """Least price of both slacks and of the curve, and the first slack; unknown are the coefficients of monomials."""
    half, size = len(state), 6 * len(state) + 2
    start_rows = [np.kron(of_monomials(half, order, 0.0, duration), np.eye(3)) for order in range(half)]
    blocks, sides = [np.pad(np.concatenate(start_rows), ((0, 0), (0, 2)))], [state.reshape(-1)]
    cones = [clarabel.ZeroConeT(3 * half)]
    for demand in demands:
        rows, offset = demand.walls.in_widths
        inwards = np.broadcast_to(demand.inwards.reshape(len(demand.s), -1), (len(demand.s), len(rows)))
        for s, moves in zip(demand.s, inwards, strict=True):
            order = demand.walls.order
            factors = of_monomials(half, order, s, duration)
            factors = factors + demand.ahead * of_monomials(half, order + 1, s, duration)
            for matrix, bound, move in zip(rows, offset, moves, strict=True):
                block = np.zeros((len(matrix), size))
                block[:, :-2] = -np.einsum("f,cd->cfd", factors, matrix).reshape(len(matrix), -1)
                block[0, -1 if demand.soft else -2] = -1.0
                blocks.append(block)
                sides.append(bound - move * (np.arange(len(bound)) == 0))
                cones.append(clarabel.SecondOrderConeT(len(bound)))
    blocks.append(-np.eye(2, size, size - 2))
    sides.append(np.zeros(2))
    cones.append(clarabel.NonnegativeConeT(2))
    gram, linear = price_of_curve(half), np.zeros(size)
    linear[-2:] = 1.0, 1e-4
    hessian = np.pad(np.kron(gram, np.eye(3)), ((0, 2), (0, 2))) / (ACCELERATION * duration**2) ** 2
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    problem = csc_matrix(np.triu(hessian)), linear, csc_matrix(np.concatenate(blocks)), np.concatenate(sides)
    solution = clarabel.DefaultSolver(*problem, cones, settings).solve()
    assert str(solution.status) == "Solved"
    return solution.obj_val, solution.x[-2]


def price_of_curve(half):
    """A millionth of the integral of the squared k-th derivative on the unit interval, over that of x(0)."""
    highest = np.array([perm(j, half) for j in range(2 * half)], dtype=float)
    power = np.add.outer(np.arange(2 * half), np.arange(2 * half)) - 2 * half + 1
    largest = {2: 12.0, 3: 720.0, 4: 100800.0, 5: 25401600.0}[half]
    return 1e-6 * np.outer(highest, highest) / np.maximum(power, 1) / largest


def price(points, duration, demands):
    """Price of control points, and by how many widths the conditions that must hold are exceeded."""
    half, slacks = len(points) // 2, [0.0, 0.0]
    polynomial = Trajectory(points[None], np.array([duration]))
    for demand in demands:
        order = demand.walls.order
        values = polynomial(demand.s * duration, order) + demand.ahead * polynomial(demand.s * duration, order + 1)
        excess = demand.walls.excess_at(values) + demand.inwards.reshape(len(demand.s), -1)
        slacks[demand.soft] = max(slacks[demand.soft], excess.max())
    times = np.linspace(0.0, 1.0, 40)
    monomials = np.polynomial.polynomial.polyfit(times, polynomial(times * duration), 2 * half - 1)
    monomials /= ACCELERATION * duration**2
    curve = 0.5 * np.einsum("id,ij,jd->", monomials, price_of_curve(half), monomials)
    return slacks[0] + 1e-4 * slacks[1] + curve, slacks[0]


@pytest.mark.parametrize("half", (3, 4, 5))
@pytest.mark.parametrize("seed", [*range(8), 21, 28, 37, 38])
def test_it_costs_as_little_as_by_clarabel_and_keeps_what_must_hold(seed, half):
    state, duration = start(seed, half)
    demands = demands_from(state)
    piece = SinglePiece(state, ACCELERATION)
    points = piece.solve(duration, piece.start_ends(duration), range(half), conditions_of(demands))
    least, exceeded = by_clarabel(state, duration, demands)
    assert (points is not None) == (exceeded < 1e-6)
    if points is not None:
        cost, excess = price(points, duration, demands)
        assert excess < 2e-6
        assert cost == pytest.approx(least, abs=2e-6)


STILL = PieceConditions(
    *(np.array(values, dtype=np.int64) for values in ([1], [0], [0, 2])),
    *(np.array(values) for values in ([1.0], [0.0], [[0.0], [1.0]], [1.0, 0.0])),
)
"""A speed of 1 m/s at most at the end, along one axis."""

ENDS = np.array([[0.0], [2.0], [2.0], [2.0]])
"""At 2 m/s for 1 s."""


def test_the_smallest_piece_brakes_to_its_limit():
    points = piece_within(STILL, 1.0, ENDS, (0, 1), 1.0)
    assert abs(Trajectory(points[None], np.ones(1))(1.0, 1)[0]) <= 1.0 + 1e-6
    assert points[:2, 0] == pytest.approx([0.0, 2.0 / 3.0])


@pytest.mark.parametrize(
    "changes",
    [
        {"order": np.array([-1])},
        {"first": np.array([0, 0])},
        {"first": np.array([1, 2])},
        {"matrix": np.array([[np.nan], [1.0]])},
        {"bound": np.array([np.inf, 0.0])},
        {"s": np.array([np.nan])},
        {"ahead": np.array([np.inf])},
    ],
)
def test_conditions_that_are_malformed_are_refused(changes):
    assert piece_within(replace(STILL, **changes), 1.0, ENDS, (0, 1), 1.0) is None


@pytest.mark.parametrize(
    ("duration", "ends", "free", "acceleration"),
    [
        (0.0, ENDS, (0,), 1.0),
        (np.nan, ENDS, (0,), 1.0),
        (1.0, ENDS, (), 1.0),
        (1.0, ENDS, (2,), 1.0),
        (1.0, ENDS[:2], (0,), 1.0),
        (1.0, np.where(ENDS == 2.0, np.inf, ENDS), (0,), 1.0),
        (1.0, ENDS, (0,), 0.0),
    ],
)
def test_pieces_that_are_malformed_are_refused(duration, ends, free, acceleration):
    assert piece_within(STILL, duration, ends, free, acceleration) is None


def test_none_without_the_native_core():
    with using("python"):
        assert piece_within(STILL, 1.0, ENDS, (0, 1), 1.0) is None
