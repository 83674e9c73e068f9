"""Cone programmes of a chain: optimality conditions, Clarabel, and refusals."""

import numpy as np
import pytest
from oracles.cone_programme import ConeProgramme, Rows, solve_by_clarabel, solve_natively

from minsnap.native.chain_programme import solve_chain
from minsnap.native.library import core, using

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")


def chain(seed, pieces=4, border=2, size=3):
    """Programme of pieces that share three unknowns with the next one and a border with all, strictly feasible."""
    random = np.random.default_rng(seed)
    inner = 3 * (pieces + 1)
    total, width = inner + border, 6 + border
    columns = np.array([[*range(3 * i, 3 * i + 6), *range(inner, total)] for i in range(pieces)])
    roots = random.normal(size=(pieces, 3, width))
    hessian = np.einsum("pra,prb->pab", roots, roots)
    x = random.normal(size=total)
    rows = [random_rows(random, columns, x, 1, 8), random_rows(random, columns, x, size, 5)]
    linear, places = random.normal(size=total), np.arange(total + 1)
    return ConeProgramme(total, columns, hessian, np.full(total, 1e-3), linear, rows, places)


def random_rows(random, columns, x, size, count):
    """Cones with a point x inside all of them."""
    piece = random.integers(0, len(columns), count * len(columns))
    matrix = random.normal(size=(len(piece), size, columns.shape[1]))
    inside = random.normal(size=(len(piece), size))
    inside[:, 0] = np.linalg.norm(inside[:, 1:], axis=1) + random.uniform(0.01, 1.0, len(piece))
    return Rows(piece, matrix, np.einsum("ncw,nw->nc", matrix, x[columns[piece]]) + inside)


def dense(programme):
    """Hessian, and for each group of rows the whole matrix (n, c, size)."""
    hessian = np.diag(programme.diagonal)
    for columns, block in zip(programme.columns, programme.hessian, strict=True):
        hessian[np.ix_(columns, columns)] += block
    matrices = []
    for rows in programme.rows:
        whole = np.zeros((*rows.bound.shape, programme.size))
        for k, piece in enumerate(rows.piece):
            whole[k][:, programme.columns[piece]] = rows.matrix[k]
        matrices.append(whole)
    return hessian, matrices


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("seed", range(6))
def test_answers_meet_the_conditions_of_optimality(seed, size):
    programme = chain(seed, size=size)
    found = solve_natively(programme)
    hessian, matrices = dense(programme)
    gradient = hessian @ found.x + programme.linear
    for rows, matrix, z in zip(programme.rows, matrices, found.multipliers, strict=True):
        slack = rows.bound - matrix @ found.x
        for cone in (slack, z):
            assert (cone[:, 0] >= np.linalg.norm(cone[:, 1:], axis=1) - 1e-6).all()
        assert abs((slack * z).sum(axis=1)).max() < 1e-5
        gradient += np.einsum("ncs,nc->s", matrix, z)
    assert np.abs(gradient).max() < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_clarabel_finds_the_same(seed):
    programme = chain(seed, pieces=12)
    ours, theirs = solve_natively(programme), solve_by_clarabel(programme)
    assert ours.x == pytest.approx(theirs.x, abs=1e-4)
    for mine, other in zip(ours.multipliers, theirs.multipliers, strict=True):
        assert mine == pytest.approx(other, abs=1e-3)


def test_an_unknown_that_a_piece_names_twice_counts_twice():
    columns = np.array([[0, 0, 1]])
    rows = [Rows(np.zeros(1, dtype=int), np.array([[[-1.0, -1.0, 0.0]]]), np.array([[-4.0]]))]
    programme = ConeProgramme(2, columns, np.zeros((1, 3, 3)), np.ones(2), np.zeros(2), rows, np.arange(3))
    assert solve_natively(programme).x == pytest.approx([2.0, 0.0], abs=1e-6)


def test_a_programme_without_a_solution_is_not_answered():
    columns = np.array([[0]])
    matrix, bound = np.array([[[1.0]], [[-1.0]]]), np.array([[-1.0], [-1.0]])
    rows = [Rows(np.zeros(2, dtype=int), matrix, bound)]
    programme = ConeProgramme(1, columns, np.zeros((1, 1, 1)), np.ones(1), np.zeros(1), rows, np.arange(2))
    assert solve_natively(programme) is None and solve_by_clarabel(programme) is None


def call(**changes):
    """One unknown, x >= 1, least square; some arguments changed."""
    one = np.ones(1)
    given = {
        "columns": np.array([[0]], dtype=np.int64),
        "costs": (np.zeros((1, 1, 1)), one, np.zeros(1)),
        "cones": (np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.int64)),
        "rows": (-np.ones((1, 1)), -one),
    }
    return solve_chain(*(given | changes).values(), 1e-9)


def test_the_smallest_programme():
    x, z = call()
    assert x == pytest.approx([1.0], abs=1e-6) and z == pytest.approx([1.0], abs=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"columns": np.array([[5]], dtype=np.int64)},
        {"columns": np.array([[-1]], dtype=np.int64)},
        {"cones": (np.array([3], dtype=np.int64), np.ones(1, dtype=np.int64))},
        {"cones": (np.zeros(1, dtype=np.int64), np.array([2], dtype=np.int64))},
        {"cones": (np.zeros(1, dtype=np.int64), np.array([-1], dtype=np.int64))},
        {"rows": (np.full((1, 1), np.nan), np.ones(1))},
        {"rows": (np.ones((1, 1)), np.full(1, np.inf))},
        {"costs": (np.full((1, 1, 1), np.nan), np.ones(1), np.zeros(1))},
    ],
)
def test_what_is_malformed_is_refused(changes):
    assert call(**changes) is None


def test_without_the_native_core_clarabel_answers():
    with using("python"):
        assert call() is None
