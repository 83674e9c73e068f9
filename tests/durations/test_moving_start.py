"""Shortest plans from starts on and outside their limits, judged by the certificate and by dense samples."""

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits
from minsnap.durations.ways import joined
from minsnap.errors import LimitError

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
BOXES = Boxes(np.minimum(POINTS[:-1], POINTS[1:]) - 0.5, np.maximum(POINTS[:-1], POINTS[1:]) + 0.5)
LIMITS = Limits(speed=3.0, acceleration=6.0)


def planned(speed, acceleration=0.0):
    start = {"velocity": (speed, 0, 0), "acceleration": (acceleration, 0, 0)}
    return minsnap.plan(POINTS, limits=LIMITS, corridor=BOXES, start=start)


def check(path, start):
    after = minsnap.certify(path, POINTS, BOXES, LIMITS, limits_from=start)
    assert after.ok and after.continuity >= 3
    instants = np.linspace(start, path.duration, 4001)
    assert np.linalg.norm(path(instants, 1), axis=1).max() <= 3.0 * (1.0 + 1e-8)
    assert np.linalg.norm(path(instants, 2), axis=1).max() <= 6.0 * (1.0 + 1e-8)


@pytest.mark.parametrize("speed", [2.999, 3.0, 3.0 + 1e-13, 3.0 - 1e-13])
def test_a_start_within_rounding_of_its_limit_keeps_it_from_the_first_instant(speed):
    path = planned(speed)
    assert path.report.limits_from == 0.0
    assert path(0.0, 1) == pytest.approx([speed, 0, 0], abs=1e-9)
    check(path, 0.0)


@pytest.mark.parametrize(("speed", "acceleration"), [(3.1, 0.0), (3.5, 0.0), (2.0, 7.0)])
def test_a_start_outside_is_brought_back_and_the_certificate_names_the_span(speed, acceleration):
    path = planned(speed, acceleration)
    assert path(0.0, 1) == pytest.approx([speed, 0, 0], abs=1e-9)
    assert path(0.0, 2) == pytest.approx([acceleration, 0, 0], abs=1e-8)
    start = path.report.limits_from
    assert 0.0 < start < 0.3
    certificate = minsnap.certify(path, POINTS, BOXES, LIMITS)
    assert not certificate.ok
    assert certificate.limits_from == pytest.approx(start, abs=1e-6)
    assert path.report.corridor_margin == pytest.approx(certificate.corridor_margin, abs=1e-9)
    check(path, start)


def test_where_nothing_can_be_mended_the_start_is_refused():
    narrow = Boxes([(-0.5, -0.5, 0.5), (0.1, -0.5, 0.5)], [(0.3, 0.5, 1.5), (3.0, 0.5, 1.5)])
    points = [(0, 0, 1), (0.2, 0, 1), (2, 0, 1)]
    with pytest.raises(LimitError, match="the start has speed 6 where 3 is allowed, and no way back") as refused:
        minsnap.plan(points, limits=LIMITS, corridor=narrow, start={"velocity": (6, 0, 0)})
    assert refused.value.waypoint == 0


def test_a_piece_joined_before_a_plan_is_the_same_curve_with_as_many_legs():
    rest = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.9, 1.1], pieces=2)
    first, second = rest.between(0.0, 0.2), rest.between(0.2, rest.duration)
    again = joined(first, minsnap.Trajectory(second.control_points, second.durations, pieces=2))
    assert (again.legs, again.pieces) == (rest.legs, 3)
    t = np.linspace(0.0, rest.duration, 101)
    assert again(np.minimum(t, again.duration)) == pytest.approx(rest(t), abs=1e-12)
    assert again.leg_breaks == pytest.approx(rest.leg_breaks)


def cut(seed, share):
    """A plan on its limits, and the question for what is left of it from an instant on."""
    random = np.random.default_rng(seed)
    steps = random.normal(size=(4, 3)) * (1.0, 1.0, 0.4)
    steps *= random.uniform(1.0, 5.0, 4)[:, None] / np.linalg.norm(steps, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    rates = random.uniform(2.0, 6.0), random.uniform(3.0, 10.0), random.choice([30.0, 60.0])
    limits = Limits(**dict(zip(("speed", "acceleration", "jerk"), rates, strict=True)))
    whole = minsnap.plan(points, limits=limits, pieces=3)
    t = share * whole.duration
    start = {name: whole(t, order) for order, name in enumerate(("velocity", "acceleration", "jerk"), 1)}
    left = np.vstack((whole(t), points[np.searchsorted(whole.leg_breaks, t) :]))
    return whole.duration - t, {"waypoints": left, "limits": limits, "start": start}


@pytest.mark.parametrize(("seed", "share"), [(0, 0.25), (4, 0.4), (6, 0.6), (9, 0.1), (15, 0.1), (22, 0.25)])
def test_from_a_state_of_a_plan_on_its_limits_the_rest_takes_no_longer(seed, share):
    """From rest at every waypoint the search found loops back to the waypoint ahead, 15 to 35 % longer."""
    left, question = cut(seed, share)
    assert minsnap.plan(**question, pieces=3).duration <= 1.001 * left
    assert minsnap.plan(**question, pieces=2).duration <= 1.02 * left


def from_motion(**asked):
    return minsnap.plan(POINTS, limits=LIMITS, corridor=BOXES, start={"velocity": (2.0, 0, 0)}, **asked)


@pytest.mark.parametrize("seconds", [1e-6, 0.02, 0.2])
def test_a_time_limit_ends_with_a_certified_plan(seconds):
    path = from_motion(search=minsnap.Search(time_limit=seconds))
    assert minsnap.certify(path, POINTS, BOXES, LIMITS).ok


def test_a_search_from_motion_that_is_ended_is_no_longer_the_longer_it_lasts():
    """Before it had a curve inside the corridor there was no plan: the vehicle stops in the first leg, and rests."""

    def ended_after(steps):
        def tell(step):
            if step.evaluation == steps:
                raise KeyboardInterrupt

        path = from_motion(progress=tell, search=minsnap.Search(on_interrupt="return"))
        assert path.report.interrupted and minsnap.certify(path, POINTS, BOXES, LIMITS).ok
        return path.duration

    times = [ended_after(steps) for steps in (1, 2, 4, 8, 16, 30)]
    assert (np.diff(times) <= 1e-9).all() and times[-1] < 0.7 * times[0]


@pytest.mark.parametrize("instant", [-1.0, 9.0, True, "0"])
def test_limits_from_is_an_instant_of_the_trajectory(instant):
    with pytest.raises(minsnap.errors.InputError, match="limits_from is"):
        minsnap.certify(planned(2.0), limits=LIMITS, limits_from=instant)


@pytest.mark.parametrize("pieces", [3, "auto"])
@pytest.mark.parametrize(
    ("start", "end", "limits", "optimum"),
    [
        ((1.1032599505208334, 0.363378125, 0.8525), (2.90333757, 0.34773038, -0.8339429), (1, 1, 1), 2.313558),
        ((0.0, -0.98215380, -2.24148517), (-0.22611981, -1.35033702, 0.01601495), (3, 6, 30), 0.184991),
    ],
)
def test_between_two_states_in_motion_no_long_way_round_is_taken(start, end, limits, optimum, pieces):
    """Ruckig's optima, on one axis. The search from rest turned back on the way: 2.5 and 6.5 times as long."""
    states = {
        name: {"velocity": (velocity, 0.0), "acceleration": (acceleration, 0.0)}
        for name, (_, velocity, acceleration) in (("start", start), ("end", end))
    }
    bounds = minsnap.Limits(*limits)
    path = minsnap.plan([(start[0], 1.0), (end[0], 1.0)], limits=bounds, pieces=pieces, **states)
    assert minsnap.certify(path, limits=bounds).ok
    assert optimum * (1.0 - 1e-6) <= path.duration <= 1.03 * optimum
