"""All ways to choose durations: what is refused, that limits hold in each of them, and Ctrl-C."""

import numpy as np
import pytest
from tasks import REFERENCE, random_legs

import minsnap
from minsnap.cli.app import exit_status
from minsnap.errors import InfeasibleError, LimitError, TimingError, UnprovedError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.planning.request import plan_arguments

LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "give one of durations, total_time, time_weight, limits"),
        ({"time_weight": 1.0, "total_time": 4.0}, "total_time and time_weight exclude each other"),
        ({"durations": [1.0] * 4, "total_time": 4.0}, "durations and total_time exclude each other"),
        ({"durations": [1.0] * 4, "time_weight": 4.0}, "durations and time_weight exclude each other"),
        ({"time_weight": 0.0}, "must be a positive number"),
        ({"time_weight": -1.0}, "must be a positive number"),
        ({"time_weight": float("nan")}, "must be a positive number"),
        ({"total_time": float("inf")}, "must be positive"),
        ({"total_time": 0.0}, "must be positive"),
        ({"total_time": "12"}, "total"),
        ({"limits": LIMITS, "split": "equal"}, "split is 'equal'"),
    ],
)
def test_what_cannot_be_meant_is_refused(given, said):
    with pytest.raises(TimingError, match=said) as refused:
        minsnap.plan(REFERENCE, **plan_arguments(given))
    assert exit_status(refused.value) == 2


@pytest.mark.parametrize("limits", [{"speed": 3.0}, 3.0, Limits()])
def test_what_are_no_limits_is_refused(limits):
    with pytest.raises(LimitError):
        minsnap.plan(REFERENCE, limits=limits)


def test_repeated_waypoints_need_durations_of_their_own():
    with pytest.raises(WaypointError, match="waypoints 0 and 1"):
        minsnap.plan([(0, 0, 0), (0, 0, 0), (1, 0, 0)], limits=LIMITS)


PINNED = [
    ({"speed": 3.0}, {"velocity": (4, 0, 0)}, 4.0),
    ({"speed": 3.0, "norm": "axis"}, {"velocity": (4, 3.5, 0)}, 4.0),
    ({"acceleration": 3.0}, {"acceleration": (0, 3, 4)}, 5.0),
    ({"jerk": 3.0}, {"jerk": (0, 3, 4)}, 5.0),
    ({"climb_speed": 1.0}, {"velocity": (0, 0, 2)}, 2.0),
    ({"descent_speed": 1.0}, {"velocity": (0, 0, -2)}, 2.0),
    ({"vertical_speed": 1.0}, {"velocity": (0, 0, -2)}, 2.0),
    ({"horizontal_speed": 1.0}, {"velocity": (0, 2, 5)}, 2.0),
    ({"horizontal_acceleration": 1.0}, {"acceleration": (0, 2, 5)}, 2.0),
    ({"vertical_acceleration": 1.0}, {"acceleration": (0, 2, 5)}, 5.0),
    ({"max_thrust": 1.5}, {"acceleration": (0, 0, 9.80665)}, 2.0),
    ({"tilt": 0.3}, {"acceleration": (9.80665, 0, 0)}, np.pi / 4.0),
    ({"body_rate": 0.1}, {"jerk": (9.80665, 0, 0)}, 1.0),
]


@pytest.mark.parametrize(("limits", "state", "smallest"), PINNED)
@pytest.mark.parametrize("where", ["end", "inner"])
def test_a_pinned_state_beyond_a_limit_is_named_with_the_value_that_would_do(limits, state, smallest, where):
    pins = {"end": state} if where == "end" else {"pins": {2: state}}
    with pytest.raises(LimitError) as refused:
        minsnap.plan(REFERENCE, limits=Limits(**({"speed": 30.0} | limits)), **pins)
    name = next(name for name in limits if name != "norm")
    assert name in str(refused.value) or name.replace("_", " ") in str(refused.value)
    assert f"waypoint {4 if where == 'end' else 2}" in str(refused.value)
    assert refused.value.smallest == pytest.approx(smallest)


def check(path, limits, points=REFERENCE, corridor=None):
    certificate = minsnap.certify(path, points, corridor=corridor, limits=limits)
    assert certificate.ok, certificate
    assert max(used.fraction for used in certificate.utilisation) <= 1.0 + 1e-9
    return certificate


@pytest.mark.parametrize("corridor", [None, 0.3])
def test_start_and_inner_states_are_met_and_limits_kept(corridor):
    state = {"velocity": (-1.0, 1.0, 0.0)}
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=corridor, start={"velocity": (2, 0, 0)}, pins={2: state})
    check(path, LIMITS, corridor=corridor)
    assert path(0.0, 1) == pytest.approx([2.0, 0.0, 0.0], abs=1e-9)
    assert path(path.leg_breaks[2], 1) == pytest.approx([-1.0, 1.0, 0.0], abs=1e-9)
    assert path.report.binding.fraction >= 0.999


def test_a_start_at_the_limit_itself():
    path = minsnap.plan(REFERENCE, limits=LIMITS, start={"velocity": (3.0, 0.0, 0.0)}, corridor=0.3)
    check(path, LIMITS, corridor=0.3)
    assert path.report.limits_from == 0.0


def test_a_state_at_its_limit_on_the_way_is_refused():
    with pytest.raises(LimitError, match="has speed 3, at its limit 3: raise the limit to at least 3.03") as refused:
        minsnap.plan(REFERENCE, limits=LIMITS, pins={2: {"velocity": (-3.0, 0.0, 0.0)}}, corridor=0.3)
    assert refused.value.waypoint == 2


def test_pinned_states_do_not_scale():
    with pytest.raises(TimingError, match="do not scale"):
        minsnap.plan(REFERENCE, limits=LIMITS, start={"velocity": (2, 0, 0)}, search=minsnap.Search(split="distance"))


OTHERS = {
    "yaw_rate": (Limits(speed=20.0, yaw_rate=0.5), {"yaw": [0.0, 1.5, 3.0, 4.5, 6.0]}),
    "body_rate": (Limits(speed=20.0, body_rate=1.0), {}),
    "min_thrust": (Limits(speed=20.0, min_thrust=0.9), {}),
    "yaw along the velocity": (Limits(speed=20.0, yaw_rate=1.0), {"yaw": "velocity", "corridor": 0.5}),
}
POINTS = np.array([(0, 0, 1), (4, 0, 3), (4, 4, 1), (0, 4, 3), (0, 0, 1)], dtype=float)


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize(
    "mode", [{}, {"total_time": 60.0}, {"time_weight": 1e4}, {"durations": [15.0] * 4}, {"split": "distance"}]
)
def test_limits_that_are_no_walls_hold_in_every_mode(name, mode):
    limits, options = OTHERS[name]
    path = minsnap.plan(POINTS, limits=limits, **plan_arguments(mode | options))
    check(path, limits, POINTS, options.get("corridor"))


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("mode", [{"total_time": 1.0}, {"durations": [0.7] * 4}])
def test_limits_that_are_no_walls_are_never_exceeded_in_silence(name, mode):
    """A path faster than this keeps a least thrust: it needs much of it everywhere.

    A heading that is held at low speeds has a plan in 0.7 s a leg: the turns are flown slowly there.
    """
    limits, options = OTHERS[name]
    try:
        path = minsnap.plan(POINTS, limits=limits, **plan_arguments(mode | options))
    except InfeasibleError:
        return
    assert options.get("yaw") == "velocity" and "durations" in mode
    check(path, limits, POINTS, options["corridor"])


@pytest.mark.slow
def test_what_only_sufficient_walls_refuse_is_not_refused_with_proof():
    """A least thrust is planned as a bound on its vertical part; a steep turn keeps it without."""
    asked = {"limits": Limits(speed=20.0, min_thrust=0.9), "durations": [0.5] * 4}
    check(minsnap.plan(POINTS, **asked), asked["limits"], POINTS)
    with pytest.raises(UnprovedError) as refused:
        minsnap.plan(POINTS, **asked | {"durations": [0.7] * 4})
    assert not refused.value.verify()
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(POINTS, **asked | {"limits": Limits(speed=5.0, min_thrust=0.9)})
    assert refused.value.verify()


@pytest.mark.parametrize("limits", [Limits(body_rate=1.0), Limits(min_thrust=0.8), Limits(max_thrust=1.4, tilt=0.4)])
def test_limits_of_attitude_alone_are_enough(limits):
    path = minsnap.plan(POINTS[:3], limits=limits)
    assert check(path, limits, POINTS[:3]).utilisation and path.report.binding.fraction >= 0.999


def test_a_limit_on_yaw_alone_needs_a_yaw_that_turns():
    turning = minsnap.plan(POINTS[:3], limits=Limits(yaw_rate=0.5), yaw=[0.0, 1.5, 3.0])
    assert check(turning, Limits(yaw_rate=0.5), POINTS[:3])
    with pytest.raises(LimitError):
        minsnap.plan(POINTS, limits=Limits(yaw_rate=0.5))


def test_a_total_too_short_for_the_limits_says_the_shortest_found():
    with pytest.raises(InfeasibleError, match="the shortest found is") as refused:
        minsnap.plan(REFERENCE, total_time=8.0, limits=LIMITS, corridor=0.3)
    shortest = refused.value.shortest
    assert shortest == pytest.approx(minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, pieces=1).duration, rel=2e-3)
    path = minsnap.plan(REFERENCE, total_time=shortest * 1.0001, limits=LIMITS, corridor=0.3)
    check(path, LIMITS, corridor=0.3)


def test_a_total_with_limits_costs_more_than_without_and_keeps_them():
    path = minsnap.plan(REFERENCE, total_time=12.0, limits=LIMITS, corridor=0.3)
    check(path, LIMITS, corridor=0.3)
    assert path.duration == pytest.approx(12.0)
    assert path.cost() > minsnap.plan(REFERENCE, total_time=12.0, corridor=0.3).cost()
    easy = minsnap.plan(REFERENCE, total_time=30.0, limits=LIMITS, corridor=0.3)
    assert easy.cost() == pytest.approx(minsnap.plan(REFERENCE, total_time=30.0, corridor=0.3).cost(), rel=1e-3)


def test_a_dear_second_with_limits_ends_near_the_shortest_time():
    shortest = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, pieces=1).duration
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, search=minsnap.Search(time_weight=1e6))
    check(path, LIMITS, corridor=0.3)
    assert shortest * 0.999 <= path.duration <= 1.03 * shortest
    cheap = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, search=minsnap.Search(time_weight=1.0))
    assert cheap.duration > path.duration and cheap.cost() < path.cost()


@pytest.mark.parametrize("degree", [3, 5, 9])
def test_every_degree_keeps_limits(degree):
    path = minsnap.plan(REFERENCE, limits=LIMITS, degree=degree)
    check(path, LIMITS)
    assert path.report.binding.fraction >= 0.999


@pytest.mark.parametrize("dim", [1, 2])
def test_paths_of_fewer_coordinates_have_limits_too(dim):
    points, _ = random_legs(2, 3, dim)
    path = minsnap.plan(points, limits=LIMITS)
    check(path, LIMITS, points)


@pytest.mark.parametrize("dim", [4, 5])
@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
def test_a_path_turned_into_more_coordinates_takes_as_long(degree, dim):
    """It was searched for in four coordinates with degree 7 alone; others took up to three times as long."""
    turned = np.linalg.qr(np.random.default_rng(degree).normal(size=(dim, 3)))[0]
    space, wide = (
        minsnap.plan(points, limits=LIMITS, degree=degree, pieces=2) for points in (REFERENCE, REFERENCE @ turned.T)
    )
    check(wide, LIMITS, REFERENCE @ turned.T)
    assert wide.duration == pytest.approx(space.duration, rel=1e-3)


def test_closed_laps_keep_limits_and_are_faster():
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, closed=True)
    check(path, LIMITS, corridor=0.3)
    assert path.duration < minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3).duration
    assert path(0.0, 2) == pytest.approx(path(path.duration, 2), abs=1e-6)


class Patience:
    """Raises what Ctrl-C raises at one evaluation of the search."""

    def __init__(self, evaluations):
        self.left = evaluations

    def __call__(self, step):
        self.left -= 1
        if not self.left:
            raise KeyboardInterrupt


@pytest.mark.parametrize(
    "asked",
    [
        {"total_time": 12.0, "corridor": 0.3, "room": ((-1, -1, 0), (9, 5, 3))},
        {"time_weight": 10.0},
        {"limits": LIMITS, "corridor": 0.3},
        {"limits": Limits(yaw_rate=1.0), "yaw": (0.0, 1.5, 3.0, 4.5, 6.0)},
        {"limits": LIMITS, "total_time": 14.0},
    ],
)
def test_an_interrupted_search_gives_the_best_certified_plan_and_says_so(asked):
    path = minsnap.plan(REFERENCE, progress=Patience(4), **plan_arguments({"on_interrupt": "return"} | asked))
    assert path.report.interrupted and len(path.report.steps) >= 4
    certificate = minsnap.certify(path, REFERENCE, corridor=asked.get("corridor"), limits=asked.get("limits"))
    assert certificate.ok
    if "total_time" in asked:
        assert path.duration == pytest.approx(asked["total_time"])
    if "room" in asked:
        assert path.cost() <= path.report.steps[-1].best * (1.0 + 1e-5)


@pytest.mark.parametrize("asked", [{}, {"corridor": 0.3}])
def test_a_search_by_one_call_is_the_same_whether_it_is_watched_or_not(asked):
    plain = minsnap.plan(REFERENCE, total_time=12.0, **asked)
    steps = []
    watched = minsnap.plan(REFERENCE, total_time=12.0, progress=steps.append, **asked)
    kept = minsnap.plan(
        REFERENCE, total_time=12.0, progress=Patience(2), search=minsnap.Search(on_interrupt="return"), **asked
    )
    for path in (watched, kept):
        assert (path.control_points == plain.control_points).all() and (path.breaks == plain.breaks).all()
    assert steps == list(plain.report.steps) and len(steps) > 2


@pytest.mark.parametrize(
    "asked",
    [
        {"total_time": 12.0},
        {"time_weight": 10.0},
        {"limits": LIMITS},
        {"limits": Limits(yaw_rate=1.0), "yaw": (0.0, 1.5, 3.0, 4.5, 6.0)},
        {"limits": LIMITS, "total_time": 16.0},
    ],
)
def test_an_interrupt_is_the_callers_own_unless_asked_for(asked):
    with pytest.raises(KeyboardInterrupt):
        minsnap.plan(REFERENCE, progress=Patience(3), **plan_arguments(asked))


def test_an_unknown_answer_to_interrupts_is_refused():
    with pytest.raises(minsnap.errors.TimingError, match="'raise' or 'return'"):
        minsnap.plan(REFERENCE, total_time=12.0, search=minsnap.Search(on_interrupt="ignore"))


def test_a_search_that_runs_to_its_end_was_not_interrupted():
    assert not minsnap.plan(REFERENCE, total_time=12.0).report.interrupted


def test_an_error_of_the_callback_is_the_callers_own():
    def broken(step):
        raise RuntimeError("disc full")

    with pytest.raises(RuntimeError, match="disc full"):
        minsnap.plan(REFERENCE, total_time=12.0, progress=broken)


def test_binding_is_the_limit_used_most():
    report = minsnap.plan(REFERENCE, limits=Limits(speed=3.0, acceleration=600.0), corridor=0.3).report
    assert report.binding.name == "speed" and report.binding.fraction >= 0.999
    assert {used.name for used in report.utilisation} == {"speed", "acceleration"}
    assert minsnap.plan(REFERENCE, total_time=12.0).report.binding is None
