"""The names under which files hold constraints."""

from dataclasses import astuple

import numpy as np
import pytest

import minsnap
from minsnap.corridors.named_constraints import CONSTRAINTS, FIXED

CORNERS = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 2.0), (4.0, 3.0, 1.0)])
SQUARE = np.concatenate((np.eye(3), -np.eye(3)))
FIXED_EXAMPLES = {
    minsnap.Boxes: minsnap.Boxes(np.full((2, 3), -9.0), np.full((2, 3), 9.0)),
    minsnap.Room: minsnap.Room((-9, -9, 0), (9, 9, np.inf)),
    minsnap.HalfSpaces: minsnap.HalfSpaces([(0, 0, 1), (1, 0, 0)], [3.0, 9.0], legs=(0,)),
    minsnap.Polytopes: minsnap.Polytopes([(SQUARE, np.full(6, 9.0))] * 2),
}


def test_every_fixed_constraint_has_an_example():
    assert FIXED_EXAMPLES.keys() == set(FIXED)


@pytest.mark.parametrize("constraint", FIXED_EXAMPLES.values(), ids=lambda one: type(one).__name__)
def test_the_walls_of_fixed_constraints_do_not_follow_the_waypoints(constraint):
    """Gradients in waypoints count on it."""
    for before, after in zip(constraint.walls(CORNERS), constraint.walls(CORNERS[:, ::-1] + 0.7), strict=True):
        assert all(np.array_equal(*pair) for pair in zip(astuple(before), astuple(after), strict=True))


def test_every_constraint_of_the_library_can_be_saved_by_name():
    public = {name: getattr(minsnap, name) for name in minsnap.__all__}
    of_corridors = {
        name: kind
        for name, kind in public.items()
        if isinstance(kind, type) and hasattr(kind, "walls") and kind.__module__.startswith("minsnap.corridors")
    }
    assert of_corridors == CONSTRAINTS
