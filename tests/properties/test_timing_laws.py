"""Random problems with random limits: none violated by certify or by a dense grid, and no exception."""

import numpy as np
import pytest
from bench_limits import SPANS, excess
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from properties.strategies import decades

import minsnap
from minsnap.limits.limits import Limits

QUICK = (Phase.explicit, Phase.reuse, Phase.generate)
"""Without shrinking: every example is a search of its own, and a failure tells its arguments."""

NAMES = sorted(SPANS.keys() - {"yaw_rate"})
"""Limits that a path without a yaw of its own may use."""

ONE_SIDED = {"climb_speed", "descent_speed", "min_thrust"}
"""Limits that a path may not use at any speed: a leg that only descends, a thrust that is never small."""


@st.composite
def limits(draw):
    names = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=4, unique=True))
    if ONE_SIDED.issuperset(names):
        names.append("acceleration")
    chosen = {name: draw(decades(*SPANS[name])) for name in names}
    return Limits(**chosen, norm=draw(st.sampled_from(["euclidean", "axis"])))


@st.composite
def problems(draw):
    legs = draw(st.integers(1, 5))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = random.normal(size=(legs, 3))
    steps *= 10.0 ** random.uniform(-0.5, 1.0, (legs, 1)) / np.linalg.norm(steps, axis=1)[:, None]
    given = {"waypoints": np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0))), "limits": draw(limits())}
    if draw(st.booleans()):
        given["corridor"] = draw(decades(0.05, 1.6))
    return given


def check(path, asked):
    certificate = minsnap.certify(path, asked["waypoints"], corridor=asked.get("corridor"), limits=asked["limits"])
    assert certificate.ok, certificate
    assert excess(path, asked["limits"]) <= 1e-9


@settings(max_examples=15, phases=QUICK)
@given(problems())
def test_the_shortest_plan_touches_its_limits_and_exceeds_none(asked):
    path = minsnap.plan(**asked)
    check(path, asked)
    assert path.report.binding.fraction >= 0.999


@settings(max_examples=6, phases=QUICK)
@given(problems(), decades(0.1, 1e4))
def test_a_priced_plan_exceeds_no_limit(asked, weight):
    check(minsnap.plan(search=minsnap.Search(time_weight=weight), **asked), asked)


@settings(max_examples=6, phases=QUICK)
@given(problems(), st.floats(1.05, 3.0))
def test_a_total_within_reach_is_kept_with_the_limits(asked, longer):
    total = longer * minsnap.plan(**asked, pieces=1).duration
    path = minsnap.plan(**asked, total_time=total)
    check(path, asked)
    assert path.duration == pytest.approx(total, rel=1e-9)


@pytest.mark.slow
@settings(max_examples=2, phases=QUICK)
@given(problems())
def test_a_plan_that_is_only_scaled_exceeds_no_limit(asked):
    path = minsnap.plan(search=minsnap.Search(split="distance"), **asked)
    check(path, asked)
    assert path.report.binding.fraction >= 0.999


@settings(max_examples=6, phases=QUICK)
@given(problems(), st.floats(0.5, 2.0))
def test_time_does_not_know_which_unit_it_is_in(asked, factor):
    """Limits on speed and acceleration in another unit of time: the same path, another clock, as far as a search ends
    where it ends by rounding alone."""
    asked["limits"] = Limits(speed=2.0, acceleration=3.0)
    path = minsnap.plan(**asked)
    asked["limits"] = Limits(speed=2.0 * factor, acceleration=3.0 * factor**2)
    assert minsnap.plan(**asked).duration * factor == pytest.approx(path.duration, rel=5e-3)
