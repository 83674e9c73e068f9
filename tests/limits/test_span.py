"""From which instant on limits are kept: against dense samples, and in the figures of the whole trajectory."""

import numpy as np
import pytest

from minsnap import Limits, Trajectory
from minsnap.limits.span import kept_from, use_from
from minsnap.polynomials.bernstein import powers_to_points

# x = 4 t - t^2 on [0, 1.5]: the speed falls from 4 to 1 and is 3 at 0.5 s
POWERS = np.array([[0.0, 0.0], [6.0, 0.0], [-2.25, 0.0]])
SLOWING = Trajectory((powers_to_points(2) @ POWERS)[None], np.array([1.5]))


def test_the_instant_is_that_from_which_samples_keep_the_limit():
    start = kept_from(Limits(speed=3.0), SLOWING)
    assert start == pytest.approx(0.5, abs=1e-8)
    after = np.linspace(start, 1.5, 1001)
    assert np.linalg.norm(SLOWING(after, 1), axis=1).max() <= 3.0 * (1.0 + 1e-9)


def test_kept_always_or_never():
    assert kept_from(Limits(speed=4.0), SLOWING) == 0.0
    assert kept_from(Limits(acceleration=1.0), SLOWING) == pytest.approx(1.5)


def test_use_is_told_in_legs_and_instants_of_the_whole():
    whole = SLOWING.then(SLOWING.reversed().reversed().stretched(1.0).reversed())
    used = use_from(Limits(speed=3.0), whole, 2.0)[0]
    assert (used.leg, used.instant) == (1, pytest.approx(3.0))
    assert used.value == pytest.approx(4.0)
