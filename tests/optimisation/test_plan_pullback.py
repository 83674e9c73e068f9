"""The adjoint of plans without walls: derivatives of any function of their control points, against differences."""

import numpy as np
import pytest

import minsnap
from minsnap.optimisation.plan_pullback import plan_pullback


@pytest.mark.parametrize(("degree", "legs"), [(3, 4), (5, 1), (7, 2), (7, 5), (9, 3)])
def test_derivatives_of_a_function_of_plans_are_those_of_differences(degree, legs):
    draw = np.random.default_rng(degree)
    points, times = draw.normal(size=(2, legs + 1, 3)), draw.uniform(0.7, 1.6, (2, legs))
    weights = draw.normal(size=(2, legs, degree + 1, 3))
    ends = {"start": {"velocity": (0.4, -0.2, 0.1)}}

    def value(points, times):
        return (weights * minsnap.plan_many(points, times, degree=degree, **ends).stacked).sum()

    pulled = plan_pullback(minsnap.plan_many(points, times, degree=degree, **ends).stacked, times, weights)
    for given, slopes, put in ((points, pulled.waypoints, lambda x: (x, times)), (times, pulled.durations, lambda x: (points, x))):  # fmt: skip # noqa: E501
        direction, step = draw.normal(size=given.shape), 1e-5
        ahead, behind = (value(*put(given + sign * step * direction)) for sign in (1.0, -1.0))
        assert (slopes * direction).sum() == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6, abs=1e-7)
