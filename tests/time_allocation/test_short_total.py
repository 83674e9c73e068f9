"""Totals too short for the velocity: exact proofs, against the formulas of single limits, and tampered ones."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import task_of

import minsnap
from minsnap.limits.limits import Limits
from minsnap.time_allocation.short_total import short_leg, short_total

POINTS = np.array([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0), (3.0, 0.0, 2.0), (1.0, 0.0, -2.0)])
STEPS = np.diff(POINTS, axis=0)
LEAST = {
    "speed": (Limits(speed=2.0), np.linalg.norm(STEPS, axis=1) / 2.0),
    "per axis": (Limits(speed=2.0, norm="axis"), np.abs(STEPS).max(axis=1) / 2.0),
    "horizontal": (Limits(horizontal_speed=2.0), np.hypot(STEPS[:, 0], STEPS[:, 1]) / 2.0),
    "climb": (Limits(climb_speed=0.5), np.maximum(STEPS[:, 2], 0.0) / 0.5),
    "descent": (Limits(descent_speed=0.5), np.maximum(-STEPS[:, 2], 0.0) / 0.5),
    "both": (
        Limits(speed=2.0, vertical_speed=0.5),
        np.maximum(np.linalg.norm(STEPS, axis=1) / 2.0, np.abs(STEPS[:, 2]) / 0.5),
    ),
}


def asked(limits, tolerance=0.0):
    task = task_of(POINTS, limits=limits)
    return replace(task, lower=task.lower - tolerance, upper=task.upper + tolerance)


@pytest.mark.parametrize("name", LEAST)
def test_totals_are_proved_too_short_below_the_least_and_not_above(name):
    limits, times = LEAST[name]
    proof = short_total(asked(limits), 0.999999 * times.sum())
    assert proof.verify() and float(proof.least) == pytest.approx(times.sum(), rel=1e-8)
    assert short_total(asked(limits), 1.000001 * times.sum()) is None


@pytest.mark.parametrize("leg", range(3))
def test_a_leg_alone_is_proved_too_short(leg):
    limits, times = LEAST["both"]
    durations = np.where(np.arange(3) == leg, 0.999999, 1.1) * times
    proof = short_leg(asked(limits), durations)
    assert proof.verify() and proof.rows[0].piece == leg and proof.total == durations[leg]
    assert short_leg(asked(limits), 1.000001 * times) is None
    assert short_leg(asked(Limits(acceleration=2.0)), durations) is None


def test_waypoints_that_are_free_may_be_nearer():
    tolerance = np.array([[0.0], [0.5], [0.0], [0.0]])
    proof = short_total(asked(Limits(speed=2.0, norm="axis"), tolerance), 1.0)
    assert float(proof.least) == pytest.approx((3.5 + 3.5 + 4.0) / 2.0, rel=1e-8)


def test_no_proof_without_limits_on_the_velocity():
    assert short_total(asked(Limits(acceleration=2.0)), 1e-3) is None


def test_tampered_proofs_do_not_verify():
    proof = short_total(asked(Limits(speed=2.0)), 4.0)
    assert proof.verify()
    first = proof.rows[0]
    assert not replace(proof, rows=(replace(first, direction=1.01 * first.direction), *proof.rows[1:])).verify()
    assert not replace(proof, rows=(replace(first, order=2), *proof.rows[1:])).verify()
    assert not replace(proof, rows=(*proof.rows, first)).verify()
    assert not replace(proof, total=7.0).verify()
    assert not replace(proof, rows=proof.rows[1:], total=5.0).verify()


def test_a_refusal_in_gates_is_right():
    """The gate may be crossed anywhere, so that the least total counts from its edge."""
    gate = minsnap.Gate((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0)
    with pytest.raises(minsnap.InfeasibleError, match=r"the velocity alone needs 2\.\d* s") as refused:
        minsnap.plan([(0, 0, 0), gate, (2, 3, 0)], total_time=1.9, limits=Limits(speed=2.0, norm="axis"))
    assert refused.value.verify()
