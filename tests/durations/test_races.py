"""Courses with known shortest times, and everything that a vehicle must keep on them."""

import numpy as np
import pytest
from tasks import REFERENCE

import minsnap
from minsnap.corridors.boxes import Boxes
from minsnap.errors import InfeasibleError, LimitError, SolverError
from minsnap.limits.limits import Limits
from minsnap.vehicle import Quadrotor

LIMITS = Limits(speed=3.0, acceleration=6.0)
MAZE = Boxes(
    [(0.3, 0.3), (0.3, 5.7), (2.4, 0.3), (2.4, 0.3), (4.4, 0.3), (4.4, 5.7), (6.4, 0.3), (6.4, 0.3), (8.4, 0.3)],
    [(1.8, 7.7), (3.8, 7.7), (3.8, 7.7), (5.8, 2.3), (5.8, 7.7), (7.8, 7.7), (7.8, 7.7), (9.7, 2.3), (9.7, 7.7)],
)
PATH = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
AROUND = Boxes(np.minimum(PATH[:-1], PATH[1:]) - 0.5, np.maximum(PATH[:-1], PATH[1:]) + 0.5)
RACER = Quadrotor(0.85, (0.001, 0.001, 0.0017), 0.15, 1e-6, 5e-8, np.sqrt(6.879e6))
LOOP = [(-1.1, -1.6, 3.6), (9.2, 6.6, 1), (9.2, -4, 1.2), (-4.5, -6, 3.5), (-4.5, -6, 0.8), (4.75, -0.9, 1.2)]


@pytest.mark.parametrize(("pieces", "most"), [(1, 10.86), (2, 9.39), (3, 9.16)])
def test_the_rectangle(pieces, most):
    path = minsnap.plan(REFERENCE, corridor=0.3, limits=LIMITS, pieces=pieces)
    assert minsnap.certify(path, REFERENCE, corridor=0.3, limits=LIMITS).ok and path.duration <= most
    assert path.report.cost == pytest.approx(path.cost(), rel=1e-6)


def test_a_line_is_divided_again_where_a_stage_makes_no_progress():
    """With three pieces it takes 1.054 of the profile of bounded jerk, rise, cruise and fall."""
    way, speed, acceleration, jerk = 17.446724, 4.635186, 3.18465, 56.581088
    limits = Limits(speed=speed, acceleration=acceleration, jerk=jerk)
    least = way / speed + speed / acceleration + acceleration / jerk
    assert least <= minsnap.plan([(0.0,), (way,)], limits=limits, pieces="auto").duration <= 1.01 * least


@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_the_maze_in_any_unit(unit):
    limits, boxes = Limits(speed=2.0 * unit, acceleration=4.0 * unit), Boxes(MAZE.lower * unit, MAZE.upper * unit)
    ends = {"start": {"position": (1.05 * unit, 0.55 * unit)}, "end": {"position": (9.05 * unit, 7.05 * unit)}}
    path = minsnap.plan(None, corridor=boxes, limits=limits, **ends)
    assert path.duration <= 15.2 and minsnap.certify(path, corridor=boxes, limits=limits).ok


@pytest.mark.parametrize(("pieces", "most"), [(1, 3.23), (2, 3.06), (3, 3.03)])
def test_a_moving_start_through_boxes(pieces, most):
    start = {"position": PATH[0], "velocity": (1.5, 0.2, 0), "acceleration": (0.5, 0, 0)}
    options = {"corridor": AROUND, "start": start, "end": {"position": PATH[-1]}, "limits": LIMITS}
    path = minsnap.plan(None, pieces=pieces, **options)
    assert minsnap.certify(path, corridor=AROUND, limits=LIMITS).ok and path.duration <= most
    assert path(0.0, 1) == pytest.approx(start["velocity"]) and path(0.0, 2) == pytest.approx(start["acceleration"])


@pytest.mark.slow
def test_a_race_with_every_rotor_within_its_thrust():
    """The first lap of a published course; the rotors recomputed from position, and from axes carried without spin."""
    points = np.array([(-5, 4.5, 1.2), *LOOP], dtype=float)
    limits, ball = Limits.of(RACER, reserve=0.0, body_rate=15.0, yaw_rate=3.0), minsnap.Ball(0.3)
    path = minsnap.plan(points, limits=limits, yaw="tilt", waypoint_tolerance=ball, pieces=2)
    assert minsnap.certify(path, points, limits=limits, tolerance=ball).ok
    t = np.linspace(0.0, path.duration, 5001)
    lift, jerk, snap = path(t, 2) + [0.0, 0.0, RACER.gravity], path(t, 3), path(t, 4)
    size = np.linalg.norm(lift, axis=1, keepdims=True)
    axis = lift / size
    pull = (axis * jerk).sum(axis=1, keepdims=True)
    across = jerk - axis * pull
    turn = (snap - axis * (axis * snap).sum(axis=1, keepdims=True) - 2.0 * across * pull / size) / size
    forward = np.tile([1.0, 0.0, 0.0], (len(t), 1))
    for i in range(1, len(t)):
        both = axis[i - 1] + axis[i]
        forward[i] = forward[i - 1] - both * (forward[i - 1] @ axis[i]) / (1.0 + axis[i - 1] @ axis[i])
    torques = 0.001 / (2.0 * 0.15) * np.stack([(turn * arm).sum(axis=1) for arm in (forward, np.cross(axis, forward))])
    diagonals = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]) / np.sqrt(2.0)
    rotors = 0.85 * size[:, 0] / 4.0 + diagonals @ torques
    assert rotors.max() <= 6.879 + 1e-6 and rotors.min() >= -1e-6
    assert rotors.max() >= 0.9998 * 6.879 and np.abs((forward * axis).sum(axis=1)).max() <= 1e-9
    assert (np.linalg.norm(across, axis=1) / size[:, 0]).max() <= 15.0 + 1e-6


CLIMB = [(8.31, -5.73, 0.69), (15.79, -10.32, 1.64), (17.43, -6.09, 0.19), (13.01, -9.77, 3.38), (10.52, -12.19, 2.11)]
HAIRPINS = [
    *[(-6.14, 2.45, 1.79), (-12.12, 6.34, 3.14), (-12.05, 0.98, 2.37), (-13.5, 3.74, 3.45), (-17.45, 3.33, 3.41)],
    *[(-18.14, 7.12, 3.08), (-18.42, 1.18, 3.25), (-22.18, 8.73, 3.43), (-6.14, 2.45, 1.79)],
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("points", "vehicle", "given", "ball", "pieces", "most"),
    [
        (HAIRPINS, (1.5, (0.0163, 0.0179, 0.0293), 0.192, 1e-6, 3.25e-8, 3810.0, 0.0, "+"), (0.0, 4.29), 0.2, 1, 6.56),
        (CLIMB, (1.28, (0.011, 0.0121, 0.0198), 0.194, 1e-6, 3.64e-8, 2640.0, 396.0, "x"), (0.1, 4.15), 0.13, 3, 4.45),
    ],
)
def test_searches_that_end_outside_go_on_from_a_curve_that_keeps_the_limits(points, vehicle, given, ball, pieces, most):
    """Curves close to free fall, on which slower flight means faster turns: 6.58 and 4.57 s without.

    Rounding decides where such a search ends: inputs that differ by 1e-12 to 1e-6, and two kernels of BLAS, gave 6.38
    to 6.51 s on the first.
    """
    limits, ball = (
        Limits.of(Quadrotor(*vehicle), reserve=given[0], body_rate=given[1], yaw_rate=3.0),
        minsnap.Ball(ball),
    )
    closed = points[0] == points[-1]
    path = minsnap.plan(points, limits=limits, yaw="tilt", waypoint_tolerance=ball, pieces=pieces, closed=closed)
    assert minsnap.certify(path, points, limits=limits, tolerance=ball).ok and path.duration <= most
    assert path.report.steps[-1].best == pytest.approx(path.duration, rel=0.01)


@pytest.mark.slow
def test_rotors_under_a_fixed_yaw_begin_from_the_curve_without_spin():
    """From rest at every ball the search under a fixed yaw ended at 2.4 times the time without spin."""
    points = np.array([(-5, 4.5, 1.2), *LOOP[:3]], dtype=float)
    asked = {"limits": Limits.of(RACER, reserve=0.0, body_rate=15.0), "waypoint_tolerance": minsnap.Ball(0.3)}
    free = minsnap.plan(points, yaw="tilt", **asked)
    for pieces in (1, 2):
        fixed = minsnap.plan(points, yaw=0.0, pieces=pieces, **asked)
        assert minsnap.certify(fixed, points, limits=asked["limits"], tolerance=minsnap.Ball(0.3)).ok
        assert fixed.duration < 1.3 * free.duration


@pytest.mark.slow
@pytest.mark.parametrize("yaw", [0.0, 0.7, "tilt", "velocity", [0.0, 0.5, 1.0, 0.5, 0.0]], ids=str)
def test_a_vehicle_with_any_heading(yaw):
    limits = Limits.of(Quadrotor.dji_f330(), reserve=0.2, speed=6.0)
    path = minsnap.plan(REFERENCE, limits=limits, yaw=yaw)
    assert minsnap.certify(path, REFERENCE, limits=limits).ok
    assert path.report.binding.fraction >= 0.999


def test_gates_are_crossed_in_their_openings():
    gates = [minsnap.Gate((4, 1, 1), (1, 0.5, 0), 1.0, 0.8), minsnap.Gate((8, -1, 1.5), (1, 0, 0), 1.0, 0.8)]
    points = [(0, 0, 1), gates[0], gates[1], (12, 0, 1)]
    path = minsnap.plan(points, limits=LIMITS)
    assert minsnap.certify(path, points, limits=LIMITS).ok
    pinned = minsnap.plan([(0, 0, 1), (4, 1, 1), (8, -1, 1.5), (12, 0, 1)], limits=LIMITS)
    assert path.duration < 0.97 * pinned.duration


def test_a_search_out_of_time_returns_what_it_has():
    path = minsnap.plan(REFERENCE, corridor=0.3, limits=LIMITS, pieces=3, search=minsnap.Search(time_limit=1e-6))
    assert path.report.interrupted and minsnap.certify(path, REFERENCE, corridor=0.3, limits=LIMITS).ok
    with pytest.raises(minsnap.MinsnapError, match="time_limit"):
        minsnap.plan(REFERENCE, limits=LIMITS, search=minsnap.Search(time_limit=-1.0))


@pytest.mark.parametrize("step", [1, 4, 14])
def test_an_interrupted_search_returns_what_it_has(step):
    def stop(found):
        if found.evaluation == step:
            raise KeyboardInterrupt

    path = minsnap.plan(
        REFERENCE, corridor=0.3, limits=LIMITS, pieces=2, progress=stop, search=minsnap.Search(on_interrupt="return")
    )
    assert path.report.interrupted and minsnap.certify(path, REFERENCE, corridor=0.3, limits=LIMITS).ok


@pytest.mark.slow
def test_what_cannot_be_kept_at_any_speed_is_named():
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(REFERENCE, limits=LIMITS, start={"velocity": (0.0, 2.9, 0.0)}, corridor=0.05)
    assert refused.value.leg == 0
    with pytest.raises(SolverError, match="acceleration reaches"):
        box = Boxes([(-1, -1, -1)], [(0.65, 1, 1)])
        minsnap.plan([(0, 0, 0), (0.5, 0, 0)], limits=LIMITS, corridor=box, start={"velocity": (2.9, 0, 0)})
    with pytest.raises(LimitError, match="nothing limits the time: the path keeps the limit on climb speed"):
        minsnap.plan(REFERENCE, limits=Limits(climb_speed=1.0))


@pytest.mark.slow
def test_where_several_pieces_find_nothing_the_search_begins_with_one():
    """Under a fixed yaw three pieces ended outside; what came instead took 29 s for 18 on the whole course."""
    course, limits = [(-5.0, 4.5, 1.2), *LOOP], Limits.of(RACER, reserve=0.0, body_rate=15.0, yaw_rate=3.0)
    question = {"limits": limits, "yaw": 0.464, "waypoint_tolerance": minsnap.Ball(0.3)}
    path, single = (minsnap.plan(course, **question, pieces=pieces) for pieces in (3, 1))
    assert path.pieces == 3 and path.duration <= single.duration * (1.0 + 1e-4)
    assert minsnap.certify(path, course, limits=limits, tolerance=minsnap.Ball(0.3)).ok
