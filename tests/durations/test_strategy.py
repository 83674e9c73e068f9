"""Shortest plans by the interior point, and which questions it is asked."""

import os
import subprocess
import sys

import numpy as np
import pytest
from random_combinations import question

import minsnap
from minsnap import Ball, Boxes, Limits, Search
from minsnap.durations import watched_search
from minsnap.native.library import core
from minsnap.vehicle import Quadrotor

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

LIMITS = Limits(speed=3.0, acceleration=6.0)
RECTANGLE = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)
DIVE = [(0, 0, 6), (5, 0, 3), (9, 6, 0), (14, 9, 4)]
"""Near free fall, where the search with one piece a leg finds no end."""
AROUND = Boxes(np.minimum(RECTANGLE[:-1], RECTANGLE[1:]) - 0.5, np.maximum(RECTANGLE[:-1], RECTANGLE[1:]) + 0.5)
ASKED = {
    "tube": {"corridor": 0.3, "limits": LIMITS},
    "boxes": {"corridor": AROUND, "limits": LIMITS, "waypoint_tolerance": 0.3},
    "round": {"corridor": minsnap.RoundTube(0.3), "limits": LIMITS},
    "balls": {"limits": LIMITS, "waypoint_tolerance": Ball(0.4)},
    "flat": {"waypoints": RECTANGLE[:, :2], "corridor": 0.3, "limits": LIMITS},
    "axes": {"limits": Limits(speed=3.0, acceleration=6.0, norm="axis")},
    "parts": {"limits": Limits(acceleration=6.0, horizontal_speed=2.5, climb_speed=1.0, descent_speed=0.5)},
    "jerk": {"limits": Limits(speed=3.0, acceleration=6.0, jerk=20.0, snap=200.0)},
    "thrust": {"limits": Limits(max_thrust=1.5, min_thrust=0.6, tilt=0.5)},
    "body rate": {"limits": Limits(speed=4.0, max_thrust=2.0, min_thrust=0.33, tilt=1.0, body_rate=2.1)},
    "rate alone": {"limits": Limits(acceleration=8.0, body_rate=1.5), "corridor": 0.5},
    "rotors": {"limits": Limits.of(Quadrotor.dji_f330()), "yaw": "tilt"},
    "rotors, yaw": {"limits": Limits.of(Quadrotor.dji_f330()), "yaw": 0.3},
    "rotors, dive": {"limits": Limits.of(Quadrotor.dji_f330()), "yaw": 0.3, "waypoints": DIVE},
    "view": {"limits": Limits(speed=4.0, acceleration=8.0, yaw_rate=1.0), "yaw": minsnap.LookAt((3.3, 1.7))},
    "lap": {"closed": True, "limits": LIMITS, "corridor": 0.3},
    "moving": {"start": {"velocity": (1.5, 0.2, 0.0)}, "limits": LIMITS, "corridor": 0.5},
    "pinned": {"pins": {2: {"velocity": (-1.0, 1.0, 0.0)}}, "limits": LIMITS},
}


@pytest.mark.slow
@pytest.mark.parametrize("pieces", [1, 3, "auto"])
@pytest.mark.parametrize("name", ASKED)
def test_every_kind_is_certified_and_uses_a_limit_fully(name, pieces):
    given = {"waypoints": RECTANGLE, **ASKED[name]}
    path = minsnap.plan(**given, pieces=pieces)
    certificate = minsnap.certify(path, limits=given["limits"], corridor=given.get("corridor"))
    assert certificate.ok
    assert 0.998 <= max(used.fraction for used in certificate.utilisation) <= 1.0 + 1e-9


def test_plans_do_not_depend_on_what_was_planned_before():
    first = minsnap.plan(RECTANGLE, corridor=0.3, limits=LIMITS, pieces=3)
    minsnap.plan(RECTANGLE[:3], limits=Limits(max_thrust=1.5), pieces=2)
    again = minsnap.plan(RECTANGLE, corridor=0.3, limits=LIMITS, pieces=3)
    assert (first.control_points == again.control_points).all() and (first.breaks == again.breaks).all()


def test_a_start_too_fast_to_stop_at_the_goal_flies_past_it_and_comes_back():
    path = minsnap.plan([(0, 0, 0), (0.5, 0, 0)], limits=LIMITS, start={"velocity": (2.9, 0.0, 0.0)})
    assert minsnap.certify(path, limits=LIMITS).ok
    assert path(np.linspace(0.0, path.duration, 101))[:, 0].max() > 0.7


def test_a_least_thrust_alone_and_a_climb_alone_are_left_to_the_other_search():
    for limits in (Limits(min_thrust=0.8), Limits(climb_speed=1.0)):
        with pytest.raises(minsnap.errors.LimitError, match="nothing limits the time"):
            minsnap.plan(RECTANGLE, limits=limits)


def test_progress_is_told_every_iteration_and_a_time_limit_ends_with_a_certified_plan():
    told = []
    path = minsnap.plan(RECTANGLE, corridor=0.3, limits=LIMITS, progress=told.append)
    assert tuple(told) == path.report.steps and len(told) > 5
    quick = minsnap.plan(RECTANGLE, corridor=0.3, limits=LIMITS, search=Search(time_limit=1e-9))
    assert quick.report.interrupted and minsnap.certify(quick, corridor=0.3, limits=LIMITS).ok


def test_ctrl_c_before_there_is_a_plan_is_what_the_refusal_tells():
    def stop(step):
        raise KeyboardInterrupt

    asked = {"limits": LIMITS, "corridor": 0.3, "pins": {1: {"velocity": (1.0, 1.0, 0.0)}}, "progress": stop}
    with pytest.raises(minsnap.SolverError, match="was interrupted before it had a plan"):
        minsnap.plan(RECTANGLE, **asked, search=Search(on_interrupt="return"))
    with pytest.raises(KeyboardInterrupt):
        minsnap.plan(RECTANGLE, **asked)


DIGESTS = """
import hashlib, numpy as np, minsnap
points = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1)], dtype=float)
limits = minsnap.Limits(speed=3, acceleration=6, max_thrust=1.5)
for pieces, given in ((1, {"corridor": 0.3}), (3, {"waypoint_tolerance": minsnap.Ball(0.3)}), ("auto", {})):
    path = minsnap.plan(points, limits=limits, pieces=pieces, **given)
    print(hashlib.sha256(path.control_points.tobytes() + path.breaks.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_plans_are_the_same_to_the_bit_whatever_kernels_numpy_and_blas_choose():
    found = set()
    for kernel in ("Prescott", "Haswell"):
        environment = {**os.environ, "OPENBLAS_CORETYPE": kernel}
        done = subprocess.run(
            [sys.executable, "-c", DIGESTS], env=environment, capture_output=True, text=True, check=True
        )
        found.add(done.stdout)
    assert len(found) == 1


def test_a_search_whose_work_is_spent_ends_with_what_it_has(monkeypatch):
    search, ended = watched_search.search_shortest, []

    def spent(question, watch):
        ended.append(watch.tell([9.0], 1e9, False))
        return search(question, watch)

    monkeypatch.setattr(watched_search, "search_shortest", spent)
    plan = minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 1)], limits=Limits(speed=3.0, acceleration=4.0))
    assert ended == [True] and plan.report.interrupted


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "fewer", "more"), [(900000102, 3, 6), (900000252, 2, 4), (910000243, 2, 4)])
def test_more_pieces_never_take_longer_than_those_that_divide_them(seed, fewer, more):
    """They took 2.0, 1.7 and 1.2 % longer."""
    asked, _ = question(seed)
    asked = {name: value for name, value in asked.items() if name not in ("continuity", "search")}
    few, many = (minsnap.plan(**asked | {"pieces": pieces}).duration for pieces in (fewer, more))
    assert many <= few * 1.0005
