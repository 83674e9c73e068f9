"""The shortest times within limits: relaxation, its gradient, the search and the final touch."""

import numpy as np
import pytest
from tasks import REFERENCE, random_legs, task_of

import minsnap
from minsnap.corridors.tubes import Tube
from minsnap.limits.limits import Limits
from minsnap.time_allocation.least_time import (
    ShortestSearch,
    most_used,
    norm_limits,
    stop_and_go_times,
    touching_factor,
)

LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.mark.parametrize(
    "limits",
    [LIMITS, Limits(jerk=5.0), Limits(snap=30.0), Limits(speed=0.1, acceleration=9.0, jerk=3.0, snap=70.0)],
)
def test_first_guess_is_the_least_at_which_each_leg_alone_keeps_the_limits(limits):
    for length in (0.2, 3.0, 40.0):
        (duration,) = stop_and_go_times(np.array([length]), limits)
        fractions = [
            most_used(limits, minsnap.plan([(0, 0, 0), (length, 0, 0)], [duration * factor])).fraction
            for factor in (1.0, 0.999)
        ]
        assert fractions[0] <= 1.0 + 2e-5 < fractions[1]


def test_limits_on_parts_bound_what_any_direction_may_do():
    limits = Limits(speed=3.0, climb_speed=1.0, tilt=0.5, max_thrust=1.2, body_rate=2.0)
    speed, acceleration, jerk, snap = norm_limits(limits)
    assert speed == 1.0 and acceleration == pytest.approx(0.2 * limits.gravity) and np.isinf(snap)
    assert jerk == pytest.approx(limits.gravity)


@pytest.mark.parametrize(
    ("limits", "corridor"),
    [(LIMITS, None), (LIMITS, Tube(0.3)), (Limits(acceleration=2.0, norm="axis"), Tube(0.2)), (Limits(jerk=9.0), None)],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_gradient_of_the_relaxation(seed, limits, corridor):
    points, durations = random_legs(seed, 3)
    search = ShortestSearch(task_of(points, corridor, limits), durations)
    total = search.evaluate(np.zeros(3))[0]
    durations = durations * np.exp(total) / durations.sum() * 0.95

    def slack(logarithms):
        search.seed = None
        return search.relaxation(durations * np.exp(logarithms))[0]

    _, slopes = search.relaxation(durations)
    steps = 0.02 * np.eye(3)
    differences = np.array([(slack(step) - slack(-step)) / 0.04 for step in steps])
    assert slopes == pytest.approx(differences, rel=0.05, abs=0.02 * np.abs(differences).max())


@pytest.mark.parametrize(
    "limits",
    [
        LIMITS,
        Limits(jerk=4.0),
        Limits(max_thrust=1.5),
        Limits(tilt=0.2),
        Limits(body_rate=1.0),
        Limits(climb_speed=0.7),
    ],
)
@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_the_final_touch_reaches_a_limit_and_exceeds_none(limits, scale):
    points = [(0, 0, 0), (2, 1, 3), (0, -1, 1), (3, 0, 0)]
    path = minsnap.plan(points, scale * np.array([3.0, 2.0, 3.0]))
    used = most_used(limits, path.stretched(touching_factor(limits, path)))
    assert 1.0 - 1e-9 <= used.fraction <= 1.0 + 1e-9


@pytest.mark.parametrize("scale", [0.3, 1.0, 100.0])
def test_the_final_touch_reaches_a_least_thrust(scale):
    path = minsnap.plan([(0, 0, 0), (0, 0, 3), (0, 0, 1), (1, 0, 4)], scale * np.array([3.0, 2.0, 3.0]))
    limits = Limits(min_thrust=0.7)
    assert most_used(limits, path.stretched(touching_factor(limits, path))).fraction == pytest.approx(1.0, abs=1e-9)


def check_touching(path, limits, points, corridor=None):
    certificate = minsnap.certify(path, points, corridor=corridor, limits=limits)
    assert certificate.ok
    assert 0.999 <= max(used.fraction for used in certificate.utilisation) <= 1.0 + 1e-9


def test_reference_rectangle_within_its_limits():
    """No better than 10.857 s was found by 25 random starts of searches without gradients."""
    path = minsnap.plan(REFERENCE, corridor=0.3, limits=LIMITS)
    check_touching(path, LIMITS, REFERENCE, 0.3)
    assert path.duration <= 10.87


@pytest.mark.slow
def test_reference_rectangle_cruises_with_three_pieces_a_leg():
    path = minsnap.plan(REFERENCE, corridor=0.3, limits=LIMITS, pieces=3)
    check_touching(path, LIMITS, REFERENCE, 0.3)
    assert path.duration <= 9.4
    speed = np.linalg.norm(path(np.linspace(0.0, path.duration, 2001), 1), axis=1)
    assert (speed > 2.9).mean() > 0.4, "long sides are flown at the limit"


def test_reference_rectangle_by_scaling_alone():
    """The best split, the trapezoid and the distances, each only scaled: all slower than limits inside the QP."""
    durations = {}
    for name, options in {
        "best": {"enforce": "scaling"},
        "distance": {"split": "distance"},
        "trapezoid": {"split": "trapezoid"},
    }.items():
        path = minsnap.plan(REFERENCE, corridor=0.3, limits=LIMITS, **options)
        check_touching(path, LIMITS, REFERENCE, 0.3)
        durations[name] = path.duration
    assert durations["best"] <= 12.75
    assert durations["distance"] == pytest.approx(14.48, abs=0.01)
    assert durations["best"] < durations["distance"] < durations["trapezoid"]


@pytest.mark.parametrize("seed", range(3))
def test_no_durations_nearby_are_shorter(seed):
    """Random changes of the proportions found: none can be scaled to a shorter total."""
    points, _ = random_legs(seed, 3)
    search = ShortestSearch(task_of(points, Tube(0.3), LIMITS), stop_and_go_times(task_of(points).lengths, LIMITS))
    best = search.run()
    random = np.random.default_rng(seed)
    other = ShortestSearch(task_of(points, Tube(0.3), LIMITS), best)
    totals = [np.exp(other.evaluate(random.normal(scale=0.1, size=3))[0]) for _ in range(6)]
    assert min(totals) >= best.sum() * (1.0 - 2e-3)


def test_looser_limits_are_never_slower():
    points, _ = random_legs(4, 3)
    times = [minsnap.plan(points, limits=Limits(speed=2.0 * f, acceleration=3.0 * f)).duration for f in (1, 1.3, 2, 4)]
    assert times == sorted(times, reverse=True)


def test_units_do_not_matter():
    """Lengths in decimetres, limits alike: the same times."""
    points, _ = random_legs(5, 3)
    metres = minsnap.plan(points, limits=Limits(speed=2.0, acceleration=3.0), corridor=0.3)
    tenth = minsnap.plan(10.0 * points, limits=Limits(speed=20.0, acceleration=30.0), corridor=3.0)
    assert metres.duration == pytest.approx(tenth.duration, rel=1e-4)


def test_one_leg_is_as_fast_as_its_profile():
    path = minsnap.plan([(0, 0, 0), (8, 0, 0)], limits=LIMITS)
    check_touching(path, LIMITS, [(0, 0, 0), (8, 0, 0)])
    assert path.duration == pytest.approx(2.1875 * 8.0 / 3.0, rel=1e-6)


def test_more_pieces_come_near_the_trapezoid_of_one_leg():
    times = [minsnap.plan([(0, 0, 0), (8, 0, 0)], limits=LIMITS, pieces=n).duration for n in (1, 2, 4, 8)]
    assert times == sorted(times, reverse=True)
    trapezoid = 8.0 / 3.0 + 3.0 / 6.0
    assert trapezoid < times[-1] < 1.15 * trapezoid


def test_a_leg_without_anything_to_vary_is_planned_in_silence(capfd):
    minsnap.plan([(0, 0, 0), (1, 0, 0)], limits=LIMITS, corridor=0.1)
    assert tuple(capfd.readouterr()) == ("", "")
