"""Every status is reached, and no input makes the entry points for corridors read or write where they must not."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from corners import problem
from helpers.questions import tube_planes, tube_question
from helpers.tasks import REFERENCE
from hypothesis import given, settings
from hypothesis import strategies as st

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.native.corridor import CorridorQuestion, solve_corridor
from minsnap.native.library import core
from minsnap.native.status import Status
from minsnap.native.tube import tube_optimum

pytestmark = pytest.mark.skipif(core().library is None, reason="there is no native core")

DURATIONS = np.array([4.0, 2.0, 4.0, 2.0])
ODD = st.one_of(
    st.floats(-3.0, 3.0),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e308, 1e-308, np.nan, np.inf, 1.0, 1e-3]),
)

ALLOCATE = """
import resource, sys
import numpy as np
from minsnap.corridors.constraint import Walls
from minsnap.native.corridor import CorridorQuestion, solve_corridor
from minsnap.native.free_optimum import pinned_optimum
legs = 100_000
points, durations = np.random.default_rng(0).normal(size=(legs + 1, 3)), np.ones(legs)
points[-1] = points[0]
slope = np.tile((-1.0, 0.0, 0.0), (legs, 1))
walls = Walls(np.arange(legs), np.zeros((legs, 0, 3)), points[:-1], slope, np.full(legs, 9.0), np.ones(legs))
question = CorridorQuestion(4, points, durations, [walls.record], 1.0, 1.0)
pinned_optimum(points[:5], durations[:4], 4, {}, False), solve_corridor(question)
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
hold = [np.empty((legs, 8, 3)), np.empty((legs + 1, 4, 3)), np.empty(legs * 12 * 5), np.empty(legs * 12)]
del hold
resource.setrlimit(resource.RLIMIT_AS, (used + 85 * 2**20, resource.RLIM_INFINITY))
print(pinned_optimum(points[:5], durations[:4], 4, {}, False)[0].shape, solve_corridor(question).status.name)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits the memory of a process as Linux does")
@pytest.mark.skipif("asan" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs all addresses")
def test_a_refused_allocation_is_a_status():
    run = subprocess.run([sys.executable, "-c", ALLOCATE], capture_output=True, text=True, check=False)
    assert run.stdout.split() == ["(4,", "8,", "3)", "NO_MEMORY"], run.stderr


def test_a_gap_below_what_numbers_resolve_is_given_up():
    questions = [tube_question(REFERENCE, DURATIONS, width) for width in (0.1, 0.01, 1e-3, 1e-4)]
    assert {solve_corridor(question, 1e-10).status for question in questions} == {Status.DONE}
    given_up = {solve_corridor(question, 1e-45).status for question in questions}
    assert Status.NOT_PROVED in given_up <= {Status.NOT_PROVED, Status.NO_PROGRESS}


def test_a_wall_on_a_high_derivative_that_no_curve_can_change_is_no_progress():
    walls = tube_planes(REFERENCE, 0.3)
    planes = replace(walls, order=4, slope=np.zeros_like(walls.slope), radius=-walls.width)
    question = replace(tube_question(REFERENCE, DURATIONS, 0.3), walls=[planes.record])
    assert solve_corridor(question).status is Status.NO_PROGRESS


def test_a_request_that_is_too_much_work_is_handed_over_for_that_reason():
    points, durations, width, degree, pieces = problem(12)
    many = minsnap.plan(points, durations, corridor=width, degree=degree, pieces=pieces)
    assert many.report.handed_over == Status.SPENT.reason
    assert minsnap.certify(many, points, width).ok


def test_a_share_of_the_work_and_the_time_that_is_left_end_a_question():
    question = tube_question(REFERENCE, DURATIONS, 0.3)
    assert {solve_corridor(question, **less).status for less in ({"effort": 1e-9}, {"seconds": 0.0})} == {Status.SPENT}
    assert (solve_corridor(question, seconds=60.0).points == solve_corridor(question).points).all()


def drawn(data, *shape):
    count = int(np.prod(shape))
    return np.array(data.draw(st.lists(ODD, min_size=count, max_size=count)), float).reshape(shape)


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 4), st.integers(1, 3), st.integers(2, 6), st.integers(0, 5), st.data())
def test_any_numbers_in_a_corridor_end_in_a_status(pieces, dim, half, walls, data):
    piece = np.array(data.draw(st.lists(st.integers(-1, pieces), min_size=walls, max_size=walls)), dtype=np.int64)
    at = np.array(data.draw(st.lists(st.integers(-2, 2), min_size=walls, max_size=walls)), dtype=np.int64)
    numbers = drawn(data, walls, dim), drawn(data, walls, dim), drawn(data, walls), drawn(data, walls)
    kind = {"at": data.draw(st.sampled_from([None, at])), "equal": data.draw(st.booleans())}
    order, rows = data.draw(st.integers(-1, 2 * half)), data.draw(st.integers(0, dim + 1))
    one = Walls(piece, drawn(data, walls, rows, dim), *numbers, order, **kind)
    other = replace(one, order=0, matrix=np.zeros((walls, 0, dim)))
    known = [one.record, other.record]
    question = CorridorQuestion(half, drawn(data, pieces + 1, dim), drawn(data, pieces), known, 1.0, 1.0)
    question = replace(question, closed=data.draw(st.booleans()))
    if data.draw(st.booleans()):
        known = np.array(
            data.draw(st.lists(st.booleans(), min_size=(pieces + 1) * half * dim, max_size=(pieces + 1) * half * dim))
        )
        shape = (pieces + 1, half, dim)
        question = replace(question, pinned=known.reshape(shape), values=drawn(data, *shape))
    answer = solve_corridor(question)
    if answer.status is Status.DONE:
        assert np.isfinite(answer.points).all() and answer.cost >= answer.bound - 1e-6 * abs(answer.cost) - 1e-20
    numbers = (question.positions, question.durations, *numbers, one.matrix)
    if not all(np.isfinite(array).all() for array in numbers):
        assert answer.status in (Status.BAD_NUMBER, Status.BAD_SIZE)


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 5), st.integers(1, 4), st.integers(2, 6), st.data())
def test_any_numbers_in_a_tube_end_in_a_curve_or_in_nothing(legs, dim, half, data):
    points, durations, widths = drawn(data, legs + 1, dim), drawn(data, legs), drawn(data, legs)
    found = tube_optimum(points, durations, widths, half)
    if found is not None:
        assert all(np.isfinite(array).all() for array in (*found, points, durations, widths))
        assert (durations > 0.0).all() and (widths > 0.0).all()
