"""Distances to round walls against decimals of sixty digits, never too large; walls that bound nothing."""

from decimal import Decimal, localcontext

import numpy as np
import pytest

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import Margin, _distances, margin_to
from minsnap.native.library import core, using

UNIT = Decimal(2) ** -53


def drawn(count):
    """Radii and shares of their squares, of every size."""
    random = np.random.default_rng(0)
    return 10.0 ** random.uniform(-3.0, 3.0, count), 10.0 ** random.uniform(-17.0, 1.0, count), random


def test_a_distance_to_a_ball_or_a_cone_is_the_lower_end():
    radius, share, random = drawn(3000)
    excess = np.where(random.integers(2, size=3000) == 1, share, -np.minimum(share, 1.0)) * radius**2
    excess[:1000] = -(radius[:1000] ** 2) * (1.0 - share[:1000] / 10.0)
    found = _distances(radius, excess)
    with localcontext(prec=60):
        for r, off, slack in zip(radius.tolist(), excess.tolist(), found.tolist(), strict=True):
            r, off = Decimal(r), Decimal(off)
            exact = -off / (r + max(r * r + off, Decimal(0)).sqrt())
            least = -off / (r + (max(r * r + off, Decimal(0)) + 10 * UNIT * (r * r + abs(off))).sqrt())
            assert min(exact, least) - 16 * UNIT * abs(exact) <= Decimal(slack) <= exact


@pytest.mark.parametrize("choice", ("python", *(("native",) if core().library is not None else ())))
def test_planes_that_bound_nothing_are_infinitely_far_at_the_beginning(choice):
    path = minsnap.plan([(0, 0), (1, 0), (2, 1)], [1.0, 1.0])
    unbounded = Walls.planes([1], [[0.0, 1.0]], [[0.0, 0.0]], [-np.inf], [np.inf], [1.0])
    with using(choice):
        assert margin_to(path, unbounded) == Margin(np.inf, 0, 0.0, "corridor")
