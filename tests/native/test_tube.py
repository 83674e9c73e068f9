"""Tubes in one call of the native core: the answer of the general call, and of the Python core."""

from __future__ import annotations

import numpy as np
import pytest

import minsnap
from minsnap.native.library import core, using
from minsnap.native.tube import tube_optimum

pytestmark = pytest.mark.skipif(core().library is None, reason="without a native core there is nothing to test")


def course(legs, dim, seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(legs + 1, dim)), axis=0)
    return points, rng.uniform(0.5, 2.0, legs), rng.uniform(0.05, 0.4, legs)


@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_cost_is_that_of_the_python_core_and_the_curve_is_inside(degree, dim):
    points, durations, widths = course(5, dim, degree)
    native = minsnap.plan(points, durations, corridor=widths, degree=degree)
    with using("python"):
        python = minsnap.plan(points, durations, corridor=widths, degree=degree)
    assert (native.report.core, python.report.core) == ("native", "python")
    assert native.report.cost == pytest.approx(python.report.cost, rel=2e-6)
    certificate = minsnap.certify(native, points, corridor=widths)
    assert certificate.ok and certificate.continuity >= (degree - 1) // 2
    assert native.report.corridor_margin >= 0.0 and certificate.verify()


@pytest.mark.parametrize("legs", [1, 2, 12, 60])
def test_one_width_for_all_is_as_many_equal_ones(legs):
    points, durations, _ = course(legs, 3, legs)
    one, each = (tube_optimum(points, durations, widths, 4) for widths in (np.array(0.2), np.full(legs, 0.2)))
    assert one.points.tobytes() == each.points.tobytes()
    np.testing.assert_array_equal(one.breaks, np.concatenate(([0.0], np.cumsum(durations))))
    cost, bound, contacts, rounds = one.figures
    assert (1.0 - 1e-12) * bound <= cost <= (1.0 + 1e-6) * bound and rounds >= 1 and contacts == int(contacts)


@pytest.mark.parametrize("widths", [0.2, [0.2] * 4, (1, 0.5, 0.2, 2), np.full(4, 0.2), np.array([1, 2, 1, 2])])
def test_half_widths_of_every_kind_take_the_quick_way_and_the_same_as_a_tube(widths):
    points, durations, _ = course(4, 3, 0)
    quick = minsnap.plan(points, durations, corridor=widths)
    general = minsnap.plan(points, durations, corridor=minsnap.Tube(widths))
    np.testing.assert_allclose(quick.control_points, general.control_points, rtol=0, atol=1e-6)
    assert type(quick.report.rounds) is int and quick.report.rounds == general.report.rounds


def bad(change):
    points, durations, widths = course(4, 3, 1)
    change(points, durations, widths)
    return points, durations, widths


@pytest.mark.parametrize(
    "change",
    [
        lambda p, t, w: p.__setitem__((1, 0), np.nan),
        lambda p, t, w: p.__setitem__((1, 0), np.inf),
        lambda p, t, w: t.__setitem__(0, 0.0),
        lambda p, t, w: t.__setitem__(0, np.inf),
        lambda p, t, w: t.__setitem__(3, np.nan),
        lambda p, t, w: w.__setitem__(2, -1.0),
        lambda p, t, w: w.__setitem__(2, np.nan),
    ],
)
def test_what_is_malformed_is_left_to_the_checks_that_name_it(change):
    points, durations, widths = bad(change)
    assert tube_optimum(points, durations, widths, 4) is None
    with pytest.raises(minsnap.MinsnapError):
        minsnap.plan(points, durations, corridor=widths)


@pytest.mark.parametrize("change", [lambda p, t, w: p.__setitem__(2, p[1]), lambda p, t, w: w.__setitem__(2, np.inf)])
def test_a_hold_and_a_leg_without_a_tube_are_left_to_the_general_way(change):
    points, durations, widths = bad(change)
    assert tube_optimum(points, durations, widths, 4) is None
    path = minsnap.plan(points, durations, corridor=widths)
    assert path(path.leg_breaks) == pytest.approx(points, abs=1e-9)


def test_sizes_out_of_bounds_are_refused():
    points, durations, widths = course(3, 3, 2)
    assert tube_optimum(points, durations, widths, 1) is None and tube_optimum(points, durations, widths, 7) is None
    many = np.random.default_rng(0).normal(size=(4, 9))
    assert tube_optimum(many, durations, widths, 4) is None
    assert minsnap.plan(many, durations, corridor=0.3).report.core == "python"


def skewed(seed):
    """Eight legs of 0.1 to 50 m, 1 mm to 1 m wide: the curve leaves the box around its waypoints by kilometres."""
    rng = np.random.default_rng(seed)
    lengths, steps = 10.0 ** rng.uniform(-1.0, 1.7, 8), rng.normal(size=(8, 3))
    steps *= (lengths / np.linalg.norm(steps, axis=1))[:, None]
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points, lengths * 10.0 ** rng.uniform(-0.5, 0.5, 8), 10.0 ** rng.uniform(-3.0, 0.0, 8)


@pytest.mark.parametrize("seed", [7, 38, 60, 65, 141, 150])
def test_walls_move_inwards_by_what_the_certificate_loses_to_rounding(seed):
    points, durations, widths = skewed(seed)
    one, tube = (minsnap.plan(points, durations, corridor=corridor) for corridor in (widths, minsnap.Tube(widths)))
    many = minsnap.plan_many(points[None], durations=durations, corridor=[widths])
    for curve in (one, tube, many[0]):
        certificate = minsnap.certify(curve, points, widths)
        assert curve.report.core == "native"
        assert certificate.ok and curve.report.corridor_margin == certificate.corridor_margin >= 0.0


def test_what_moving_walls_for_rounding_costs_is_no_reason_to_hand_over():
    points, durations, widths = skewed(150)
    curve = minsnap.plan(points, durations, corridor=widths)
    with using("python"):
        python = minsnap.plan(points, durations, corridor=widths)
    assert curve.report.core == "native" and minsnap.certify(curve, points, widths).ok
    assert curve.cost() <= 1.00001 * python.cost()
