"""Shortest times within rotors at a constant yaw: no luck of a course's form, and no loss by more pieces."""

import numpy as np
import pytest
from bench_rotors import FORMS, course, form, vehicle

import minsnap
from minsnap import Limits

LIMITS = Limits.of(vehicle())
ASIDE = 0.1
"""Least share of the thrust that is not along the heading."""


def planned(seed, name="as it is", **asked):
    points, corridor = course(seed)
    return minsnap.plan(form(points, name), limits=LIMITS, corridor=corridor, **asked)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "pieces"), [(3, 3), (0, "auto"), (7, 1)])
def test_forms_of_a_course_that_have_one_optimum_take_the_same_time(seed, pieces):
    """Three pieces took up to 6 % longer reversed than as it is."""
    times = [planned(seed, name, pieces=pieces).duration for name in FORMS]
    assert max(times) <= 1.005 * min(times)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 10])
def test_more_pieces_take_no_longer(seed):
    """One piece is a case of three; three took up to 33 % longer."""
    one, three, auto = (planned(seed, pieces=pieces).duration for pieces in (1, 3, "auto"))
    assert auto <= three <= one


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 9])
def test_the_thrust_stays_away_from_the_heading_where_a_small_change_spins_the_body_by_any_angle(seed):
    path = planned(seed, pieces=3)
    force = path(np.linspace(0.0, path.duration, 4001), 2) + (0.0, 0.0, LIMITS.gravity)
    across = np.linalg.norm(force[:, 1:], axis=1) / np.linalg.norm(force, axis=1)  # of a heading along x
    assert across.min() >= 0.98 * ASIDE
    assert minsnap.certify(path, *course(seed), limits=LIMITS).ok
