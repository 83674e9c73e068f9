"""Arc length of polynomials."""

from math import asinh, sqrt

import numpy as np
import pytest

from minsnap.trajectory.norm_maxima import arc_length


def test_arc_length_of_parabolas_is_that_of_the_closed_form():
    """Pieces of (t, t^2) from 0 to 1 and from 1 to 3."""
    velocity = np.array([[(1.0, 0.0), (1.0, 2.0)], [(1.0, 2.0), (1.0, 6.0)]])
    expected = 0.5 * 3.0 * sqrt(37.0) + 0.25 * asinh(6.0)
    assert arc_length(velocity, np.array([1.0, 2.0]), 1e-13) == pytest.approx(expected, rel=1e-14)
    assert arc_length(1e-9 * velocity, np.array([1.0, 2.0]), 1e-13) == pytest.approx(1e-9 * expected, rel=1e-14)


def test_arc_length_is_as_accurate_as_it_is_asked_to_be():
    there_and_back = np.array([[(-1.0,), (2.0,)]])
    assert arc_length(there_and_back, np.ones(1), 1e-13) == pytest.approx(5.0 / 6.0, rel=1e-13)
    assert 1e-12 < abs(arc_length(there_and_back, np.ones(1), 0.1) - 5.0 / 6.0) < 0.1
