"""The native corridor solver: its answers, its proof and bound, and every way in which it gives up."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from helpers.questions import real_cost, tube_planes, tube_question
from helpers.tasks import REFERENCE, random_legs

from minsnap.certificate import certify
from minsnap.corridors.constraint import Walls
from minsnap.corridors.tubes import Tube
from minsnap.native import library
from minsnap.native.corridor import solve_corridor
from minsnap.native.status import Status
from minsnap.optimisation.native_solve import corridor_question
from minsnap.optimisation.task import Task
from minsnap.trajectory.trajectory import Trajectory

DURATIONS = np.array([4.0, 2.0, 4.0, 2.0])
COSTS = [(1.0, 722.550), (0.3, 1557.0050), (0.1, 3225.19), (0.05, 4174.92), (0.01, 15890.6)]

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


@pytest.mark.parametrize(("width", "cost"), COSTS)
def test_the_rectangle_costs_what_the_continuous_optimum_costs(width, cost):
    question = tube_question(REFERENCE, DURATIONS, width)
    answer = solve_corridor(question)
    assert answer.status is Status.DONE
    assert real_cost(question, answer.cost) == pytest.approx(cost, rel=3e-6)
    assert 0.0 <= answer.cost - answer.bound <= 1e-6 * answer.cost


@pytest.mark.parametrize("half", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("dim", [1, 2, 3, 4])
def test_answers_are_certified_inside_in_every_degree_and_dimension(half, dim):
    points, durations = random_legs(3, legs=4, dim=dim)
    question = tube_question(points, durations, 0.05, half=half)
    answer = solve_corridor(question)
    assert answer.status is Status.DONE
    found = certify(Trajectory(answer.points, durations), points, 0.05 if dim > 1 else None)
    assert found.ok and found.continuity >= half - 1
    assert found.waypoint_error == 0.0


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_the_bound_is_within_the_gap_asked_for(gap):
    answer = solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3), gap)
    assert answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= gap * answer.cost


def test_the_bound_is_below_the_cost_of_every_curve_inside():
    tight, wide = (solve_corridor(tube_question(REFERENCE, DURATIONS, width)) for width in (0.2999, 0.3))
    assert wide.bound < tight.bound < tight.cost


def test_contacts_are_where_the_curve_touches():
    answer = solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3))
    planes = tube_planes(REFERENCE, 0.3)
    curve = Trajectory(answer.points, DURATIONS)
    instants = curve.breaks[planes.leg[answer.wall]] + answer.s * DURATIONS[planes.leg[answer.wall]]
    offset = curve(instants) - planes.anchor[answer.wall]
    assert len(answer.wall) >= 4
    assert np.einsum("rd,rd->r", -planes.slope[answer.wall], offset) == pytest.approx(0.3, rel=1e-6)
    assert (answer.multiplier > 0.0).all()


def test_multipliers_say_how_the_cost_falls_with_the_width():
    step = 1e-4
    narrow, middle, wide = (
        solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3 + by), 1e-10) for by in (-step, 0.0, step)
    )
    slope = (wide.cost - narrow.cost) / (2.0 * step) * tube_question(REFERENCE, DURATIONS, 0.3).length
    assert -middle.multiplier.sum() == pytest.approx(slope, rel=1e-3)


def extreme_legs(seed, legs, dim, ratio, share):
    """Random legs of 1 to 10 m with durations of a given ratio, and half-widths of a share of their mean length."""
    draw = np.random.default_rng(seed)
    steps = draw.normal(size=(legs, dim))
    steps *= draw.uniform(1.0, 10.0, (legs, 1)) / np.linalg.norm(steps, axis=1)[:, None]
    exponents = draw.uniform(size=legs)
    exponents = (exponents - exponents.min()) / np.ptp(exponents)
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0)))
    return points, 2.0 * ratio ** (exponents - 0.5), share * float(np.linalg.norm(steps, axis=1).mean())


def pieces_question(points, durations, width, half, pieces):
    """The question of a tube with several polynomials per leg, rest to rest."""
    still = {order: np.zeros(points.shape[1]) for order in range(1, half)}
    none, walls = np.zeros_like(points), list(Tube(width).walls(points))
    pins = {0: still, len(points) - 1: still}
    task = Task(points, none, none, pins, half, half - 1, False, pieces, walls, "auto")
    times = task.piece_durations(durations)
    return corridor_question(task, times, task.units(times))


@pytest.mark.parametrize(("half", "pieces", "seed"), [(6, 3, 0), (6, 2, 3), (5, 5, 0)])
def test_contacts_beside_each_other_are_told_apart(half, pieces, seed):
    """Six legs, durations of ratio 45, half-widths of 0.6 mm per metre: some 120 contacts, several on one wall."""
    answer = solve_corridor(pieces_question(*extreme_legs(seed, 6, 3, 45.0, 6e-4), half, pieces))
    assert answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= 2e-6 * answer.cost


@pytest.mark.parametrize("seed", (0, 5))
def test_what_the_rounding_of_a_proof_costs_is_allowed_beside_the_gap(seed):
    """Two legs, durations of ratio 2,800: the optimum passes 1e9 m from a corridor of millimetres."""
    answer = solve_corridor(pieces_question(*extreme_legs(seed, 2, 4, 2800.0, 1e-3), 4, 2))
    assert answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= 1e-3 * answer.cost


def test_what_windows_do_not_solve_is_solved_whole():
    question = pieces_question(*extreme_legs(13, 10, 3, 1.02, 1e-3), 6, 5)
    answer = solve_corridor(question)
    assert len(question.durations) == 50 and answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= 1e-6 * answer.cost


def test_walls_far_from_the_curve_change_nothing():
    question = tube_question(REFERENCE, DURATIONS, 100.0)
    answer = solve_corridor(question)
    assert answer.status is Status.DONE and len(answer.wall) == 0
    assert real_cost(question, answer.cost) == pytest.approx(216.8955, rel=1e-6)


def test_a_moving_start_is_kept():
    values = np.zeros((5, 4, 3))
    values[0, 1] = (0.5, 0.2, -0.1)
    answer = solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3, values=values))
    assert answer.status is Status.DONE
    assert Trajectory(answer.points, DURATIONS)(0.0, 1) == pytest.approx(values[0, 1], abs=1e-12)


def test_a_closed_lap_ends_in_the_state_in_which_it_starts():
    pinned = np.zeros((5, 4, 3), dtype=bool)
    pinned[:, 0] = True
    answer = solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3, pinned=pinned, closed=True))
    assert answer.status is Status.DONE
    curve = Trajectory(answer.points, DURATIONS)
    for order in range(4):
        assert curve(12.0, order) == pytest.approx(curve(0.0, order), abs=1e-9)


def test_velocity_is_kept_below_a_limit():
    free = solve_corridor(tube_question(REFERENCE, DURATIONS, 100.0))
    fastest = np.abs(Trajectory(free.points, DURATIONS)(np.linspace(0.0, 12.0, 2001), 1)).max()
    question = tube_question(REFERENCE, DURATIONS, 100.0)
    slope, limit = np.tile(np.concatenate((np.eye(3), -np.eye(3))), (4, 1)), 0.9 * fastest
    numbers = np.zeros((24, 0, 3)), np.zeros((24, 3)), slope, np.full(24, limit), np.full(24, limit)
    planes = Walls(np.repeat(np.arange(4), 6), *numbers, order=1)
    answer = solve_corridor(replace(question, walls=[planes.record]))
    assert answer.status is Status.DONE
    speed = np.abs(Trajectory(answer.points, DURATIONS)(np.linspace(0.0, 12.0, 20001), 1)).max()
    assert 0.999 * limit < speed <= limit


def test_walls_that_leave_no_room_are_called_infeasible():
    planes = tube_planes(REFERENCE, 0.3)
    outside = replace(planes, radius=np.where(np.arange(len(planes.leg)) == 3, -0.1, planes.radius))
    question = replace(tube_question(REFERENCE, DURATIONS, 0.3), walls=[outside.record])
    assert solve_corridor(question).status is Status.INFEASIBLE


def test_velocity_limits_that_no_curve_keeps_are_called_infeasible():
    question = tube_question(REFERENCE[:3], DURATIONS[:2], 0.3)
    planes = tube_planes(REFERENCE[:3], 0.3)
    axes = np.where(np.arange(len(planes.leg))[:, None] % 2 == 0, np.eye(3)[0], -np.eye(3)[0])
    slow = replace(planes, order=1, anchor=0.0 * planes.anchor, slope=axes, radius=np.full(len(axes), 0.5))
    assert solve_corridor(replace(question, walls=[slow.record])).status is Status.INFEASIBLE


def test_where_rounding_is_coarser_than_the_corridor_nothing_is_claimed():
    question = tube_question(REFERENCE + 1e9, DURATIONS, 1e-7)
    assert solve_corridor(question).status is not Status.DONE


def test_a_chain_of_which_nothing_is_given_has_no_answer():
    pinned = np.zeros((5, 4, 3), dtype=bool)
    assert solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3, pinned=pinned)).status is not Status.DONE


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("durations", np.array([4.0, 0.0, 4.0, 2.0])),
        ("durations", np.array([4.0, np.nan, 4.0, 2.0])),
        ("positions", np.where(np.arange(5)[:, None] == 2, np.inf, REFERENCE)),
        ("length", 0.0),
        ("time", np.nan),
    ],
)
def test_numbers_that_cannot_be_are_refused(field, value):
    question = replace(tube_question(REFERENCE, DURATIONS, 0.3), **{field: value})
    assert solve_corridor(question).status is Status.BAD_NUMBER


@pytest.mark.parametrize("gap", [0.0, -1.0, np.nan])
def test_a_gap_that_cannot_be_is_refused(gap):
    assert solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3), gap).status is Status.BAD_NUMBER


def test_sizes_beyond_the_bounds_are_refused():
    points, durations = random_legs(0, legs=200_001)
    assert solve_corridor(tube_question(points, durations, 0.3)).status is Status.BAD_SIZE
    question = tube_question(REFERENCE, DURATIONS, 0.3)
    assert solve_corridor(replace(question, half=7)).status is Status.BAD_SIZE
    planes = tube_planes(REFERENCE, 0.3)
    astray = replace(planes, leg=planes.leg + 1)
    assert solve_corridor(replace(question, walls=[astray.record])).status is Status.BAD_SIZE


def test_eight_threads_at_once_give_the_same_bytes():
    questions = [tube_question(*random_legs(seed, legs=6), 0.05) for seed in range(8)]
    alone = [solve_corridor(question).points.tobytes() for question in questions]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda q: solve_corridor(q).points.tobytes(), questions * 4))
    assert together == alone * 4


def test_units_do_not_matter():
    one = solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3))
    other = solve_corridor(tube_question(REFERENCE * 1e-3, DURATIONS * 1e3, 0.3e-3))
    assert other.points == pytest.approx(one.points * 1e-3, abs=1e-9)


def test_a_python_core_in_use_is_not_gone_round():
    with library.using("python"):
        assert solve_corridor(tube_question(REFERENCE, DURATIONS, 0.3)).status is Status.UNSUPPORTED


def test_the_tube_of_the_helper_is_the_tube_of_the_library():
    cones = Tube(0.3).walls(REFERENCE)[0]
    planes = tube_planes(REFERENCE, 0.3)
    assert planes.slope == pytest.approx(cones.slope)
    assert planes.radius == pytest.approx(cones.radius)
