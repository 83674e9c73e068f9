"""Which degree, continuity and pieces fit a corridor of any width: as docs/continuity.rst has it."""

from math import perm

import numpy as np
import pytest

import minsnap
from minsnap.errors import InfeasibleError

CORNERS = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)
TIMES = [4.0, 2.0, 4.0, 2.0]
ALWAYS = [(5, 2, 1), (5, 3, 2), (7, 3, 1), (7, 4, 2), (7, 5, 3), (9, 4, 1), (9, 5, 2), (11, 5, 1), (11, 6, 2)]


def stop_and_go(degree, continuity, pieces):
    """Residual and least-squares spline from 0 to 1, still at both ends up to the continuity; powers per piece."""
    size, rows, right = degree + 1, [], []
    at = {
        s: [[perm(j, p) * s ** (j - p) if j >= p else 0.0 for j in range(size)] for p in range(continuity + 1)]
        for s in (0.0, 1.0)
    }
    for joint in range(pieces + 1):
        for order in range(continuity + 1):
            row = np.zeros((pieces, size))
            if joint:
                row[joint - 1] = at[1.0][order]
            if joint < pieces:
                row[joint] -= at[0.0][order]
            rows.append(row.reshape(-1) / perm(degree, order))
            right.append(float(joint == pieces and order == 0))
    found = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    return np.abs(np.array(rows) @ found - right).max(), found.reshape(pieces, size)


@pytest.mark.parametrize(("degree", "continuity", "pieces"), ALWAYS)
def test_stop_and_go_needs_exactly_so_many_pieces(degree, continuity, pieces):
    assert pieces == -(-(continuity + 1) // (degree - continuity))
    assert stop_and_go(degree, continuity, pieces)[0] < 1e-9
    assert pieces == 1 or stop_and_go(degree, continuity, pieces - 1)[0] > 1e-3


@pytest.mark.parametrize(("degree", "continuity", "pieces"), [(5, 2, 1), (7, 3, 1), (7, 5, 3), (9, 5, 2), (11, 7, 2)])
def test_stop_and_go_never_turns_back(degree, continuity, pieces):
    values = [np.polyval(c[::-1], np.linspace(0, 1, 30)) for c in stop_and_go(degree, continuity, pieces)[1]]
    assert (np.diff(np.concatenate(values)) > -1e-12).all()


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "continuity", "pieces"), ALWAYS)
@pytest.mark.parametrize("width", [1.0, 0.05, 1e-3])
def test_any_width_has_a_plan(degree, continuity, pieces, width):
    traj = minsnap.plan(CORNERS, TIMES, corridor=width, degree=degree, continuity=continuity, pieces=pieces)
    certificate = minsnap.certify(traj, CORNERS, width)
    assert certificate.ok and certificate.continuity >= continuity


@pytest.mark.slow
@pytest.mark.parametrize(
    ("degree", "continuity", "pieces", "width"),
    [(7, 4, 1, 0.02), (7, 5, 1, 0.3), (7, 6, 1, 0.3), (7, 5, 2, 1e-3), (5, 3, 1, 0.05), (9, 5, 1, 1e-3)],
)
def test_with_fewer_pieces_a_narrow_corridor_is_refused(degree, continuity, pieces, width):
    with pytest.raises(InfeasibleError):
        minsnap.plan(CORNERS, TIMES, corridor=width, degree=degree, continuity=continuity, pieces=pieces)


def test_more_pieces_never_cost_more_on_the_rectangle():
    costs = [minsnap.plan(CORNERS, TIMES, corridor=0.3, pieces=pieces).cost() for pieces in (1, 2, 4, 8)]
    assert costs == pytest.approx([1557.005, 1461.668, 1460.096, 1459.863], rel=1e-5)
