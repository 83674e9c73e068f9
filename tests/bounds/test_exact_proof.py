"""The check of a bound in exact rationals: what it refuses, and that it agrees with the sum in floating point."""

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from minsnap import Ball, Limits, least_time
from minsnap.bounds.exact_proof import least_time_proved, root_above, root_below

COURSE = [(0, 0, 0), (5, 1, 0), (6, 5, 1), (1, 4, 2)]
QUESTIONS = {
    "speed and acceleration": Limits(speed=3, acceleration=5),
    "acceleration": Limits(acceleration=5),
    "axes": Limits(speed=3, acceleration=5, norm="axis"),
    "thrust and tilt": Limits(max_thrust=2, tilt=0.8),
    "several velocities": Limits(speed=3, horizontal_speed=2.5, climb_speed=1, descent_speed=2, acceleration=5),
}


@pytest.fixture(scope="module", params=[*QUESTIONS])
def bound(request):
    return least_time(COURSE, QUESTIONS[request.param], waypoint_tolerance=Ball(0.2), start={"velocity": (1, 0.5, 0)})


@pytest.mark.slow
def test_the_sum_in_floating_point_is_the_exact_one(bound):
    proved = least_time_proved(bound.proof)
    assert float(proved) == pytest.approx(bound.proof.seconds()[0], rel=1e-12)
    assert bound.verify()
    assert bound.seconds == pytest.approx(float(proved), rel=1e-8)


@pytest.mark.slow
def test_more_than_is_proved_is_refused(bound):
    assert not replace(bound, seconds=bound.seconds * (1.0 + 1e-8)).verify()
    assert not replace(bound, seconds=None).verify()
    assert not replace(bound, proof=None).verify()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["costate", "rate", "grid", "splits", "rate_splits"])
def test_numbers_that_were_changed_prove_no_more(bound, name):
    """A costate of another scale proves less; one that jumps between legs, or a grid that is none, proves nothing."""
    array = getattr(bound.proof, name).copy()
    if not array.size or (name == "rate" and not bound.proof.velocities):
        return
    array *= 1.03
    changed = replace(bound, proof=replace(bound.proof, **{name: array}))
    assert not changed.verify()


def test_a_costate_that_jumps_proves_nothing(bound):
    costate = bound.proof.costate.copy()
    costate[1, 0] += 1e-12
    assert least_time_proved(replace(bound.proof, costate=costate)) is None


def test_a_costate_with_more_ends_than_cells_proves_nothing(bound):
    """Its last value was compared with the next leg's, and the last cell's was another."""
    costate = np.concatenate((bound.proof.costate, bound.proof.costate[:, -1:]), axis=1)
    costate[:, -2] += 1e-3
    assert least_time_proved(replace(bound.proof, costate=costate)) is None


def test_a_share_where_a_set_bounds_nothing_proves_nothing():
    bound = least_time(COURSE, Limits(speed=3, horizontal_speed=2, acceleration=5))
    assert bound.verify()
    splits = bound.proof.rate_splits.copy()
    splits[..., 2] = 1e-6
    assert least_time_proved(replace(bound.proof, rate_splits=splits)) is None


@pytest.mark.slow
def test_a_longer_way_or_a_higher_limit_is_another_question(bound):
    course = bound.proof.course
    nearer = replace(course, centers=0.9 * course.centers)
    assert not replace(bound, proof=replace(bound.proof, course=nearer)).verify()
    freer = tuple(one.scaled(1.1) for one in bound.proof.accelerations)
    assert not replace(bound, proof=replace(bound.proof, accelerations=freer)).verify()


def test_legs_with_a_product_below_zero_prove_nothing(bound):
    backwards = replace(bound.proof, rate=-bound.proof.rate, costate=-bound.proof.costate)
    assert least_time_proved(backwards) is None


@pytest.mark.parametrize(
    "square", [Fraction(2), Fraction(1, 3), Fraction(10**40, 7), Fraction(1, 10**60), Fraction(9, 4)]
)
def test_roots_are_bounded_on_both_sides(square):
    low, high = root_below(square), root_above(square)
    assert low**2 <= square <= high**2
    assert high - low <= high / 2**70
    assert root_below(0) == root_above(0) == 0


def test_the_checker_is_short_and_shares_nothing_with_the_search():
    """What it takes from elsewhere are the values that it reads, and rational arithmetic."""
    from pathlib import Path

    import minsnap.bounds.exact_proof as checker

    text = Path(checker.__file__).read_text()
    numbers = Path(checker.__file__).with_name("exact_numbers.py").read_text()
    assert len(text.splitlines()) + len(numbers.splitlines()) <= 260
    assert re.findall("from (minsnap.*) import", text) == [
        "minsnap.bounds.costate_proof",
        "minsnap.bounds.derivative_sets",
        "minsnap.bounds.exact_numbers",
    ]
    assert "minsnap" not in numbers
    assert not any(call in text for call in (".seconds()", ".support(", ".reach(", ".sums", ".at("))


def test_a_proof_keeps_its_own_arrays(bound):
    with pytest.raises(ValueError, match="read-only"):
        bound.proof.costate[0, 0, 0] = 1.0
    assert isinstance(bound.proof.costate, np.ndarray)
