"""How far limits are used: exact maxima against dense sampling, with the vehicle's flatness as oracle."""

import numpy as np
import pytest

import minsnap
from minsnap.basics.limit_kinds import KINDS
from minsnap.limits import limits
from minsnap.limits.limits import Limits
from minsnap.limits.utilisation import leg_at, measured
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import VelocityHeading
from minsnap.vehicle.attitude import specific_thrust, tilt, tilt_rate

GRAVITY = Limits().gravity


def random_path(seed, size=1.0):
    """Unconnected pieces of random control points: nothing but polynomials is assumed of a measured path."""
    random = np.random.default_rng(seed)
    pieces, degree = int(random.integers(1, 5)), int(random.choice([3, 5, 7, 9]))
    durations = 10.0 ** random.uniform(-0.3, 0.5, pieces)
    points = size * random.normal(size=(pieces, degree + 1, 3)) * durations[:, None, None] ** 2 / degree**2
    return Trajectory(points, durations)


def dense(path, order):
    """Each piece by itself, both its ends included."""
    pieces = zip(path.control_points, path.durations, strict=True)
    return np.concatenate([_piece(Trajectory(points[None], [duration]), order) for points, duration in pieces])


def _piece(path, order):
    return path(np.linspace(0.0, path.duration, 4001), order)


def length(vectors):
    return np.linalg.norm(vectors, axis=1)


SAMPLED = {
    "speed": lambda p: length(dense(p, 1)),
    "acceleration": lambda p: length(dense(p, 2)),
    "jerk": lambda p: length(dense(p, 3)),
    "snap": lambda p: length(dense(p, 4)),
    "horizontal_speed": lambda p: length(dense(p, 1)[:, :2]),
    "horizontal_acceleration": lambda p: length(dense(p, 2)[:, :2]),
    "climb_speed": lambda p: dense(p, 1)[:, 2],
    "descent_speed": lambda p: -dense(p, 1)[:, 2],
    "vertical_speed": lambda p: np.abs(dense(p, 1)[:, 2]),
    "vertical_acceleration": lambda p: np.abs(dense(p, 2)[:, 2]),
    "max_thrust": lambda p: specific_thrust(dense(p, 2)) / GRAVITY,
    "tilt": lambda p: tilt(dense(p, 2)),
    "body_rate": lambda p: tilt_rate(dense(p, 2), dense(p, 3)),
}
AT_ONCE = {
    "speed": lambda p, t: np.linalg.norm(p(t, 1)),
    "max_thrust": lambda p, t: specific_thrust(p(t, 2)) / GRAVITY,
    "tilt": lambda p, t: tilt(p(t, 2)),
    "body_rate": lambda p, t: tilt_rate(p(t, 2), p(t, 3)),
}


def test_every_limit_is_compared_with_samples():
    """Those that are not in the table have tests of their own below; rotors are in test_vehicle_limits."""
    assert SAMPLED.keys() == {kind.name for kind in KINDS if kind.measure != "rotors"} - {"min_thrust", "yaw_rate"}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("name", SAMPLED)
def test_nothing_sampled_exceeds_the_measure_and_it_is_attained(name, seed):
    path = random_path(seed, 0.3)
    used = Limits(**{name: 1.2}).utilisation(path)[0]
    samples = SAMPLED[name](path)
    assert used.value >= samples.max() - 1e-9 * np.abs(samples).max()
    assert used.value <= samples.max() + 1e-3 * np.ptp(samples)
    assert used.fraction == pytest.approx(max(used.value, 0.0) / 1.2)
    assert used.method == "exact" and used.limit == 1.2 and used.name == name
    assert path.breaks[used.leg] <= used.instant <= path.breaks[used.leg + 1]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("name", AT_ONCE)
def test_the_instant_is_where_the_maximum_is(name, seed):
    path = random_path(seed, 0.3)
    used = Limits(**{name: 1.2}).utilisation(path)[0]
    before, at = np.nextafter(used.instant, 0.0), used.instant
    values = [AT_ONCE[name](path, t) for t in (before, at)]
    assert max(values) == pytest.approx(used.value, rel=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_least_thrust(seed):
    path = random_path(seed, 0.3)
    used = Limits(min_thrust=0.5).utilisation(path)[0]
    samples = specific_thrust(dense(path, 2)) / GRAVITY
    assert used.value <= samples.min() + 1e-9
    assert used.value >= samples.min() - 2e-3 * np.ptp(samples)
    assert used.fraction == pytest.approx(0.5 / used.value)


def falling(speed=1.0):
    """Straight down with twice the acceleration of gravity in the middle."""
    return Trajectory(np.array([[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, -speed * GRAVITY]]], dtype=float), [1.0])


def test_thrust_that_points_down_is_no_angle_below_a_right_one():
    path = falling()
    assert Limits(tilt=0.5).utilisation(path)[0].value == np.pi
    assert Limits(min_thrust=0.5).utilisation(path)[0].fraction > 1e6


def test_thrust_that_vanishes_while_it_turns_turns_infinitely_fast():
    fall = np.array([[(0, 0, 0), (0, 0, 0), (0.5, 0, -GRAVITY / 2.0)]], dtype=float) + [0.0, 0.0, 1.0]
    path = Trajectory(np.concatenate((fall, fall[:, :1] * 0.0), axis=1), [1.0])
    used = Limits(body_rate=1.0).utilisation(path)[0]
    assert used.value >= tilt_rate(dense(path, 2), dense(path, 3)).max()


def test_hover_uses_nothing_but_thrust():
    path = Trajectory(np.tile([1.0, 2.0, 3.0], (1, 8, 1)), [2.0])
    used = {u.name: u for u in Limits(speed=1, tilt=0.5, body_rate=1, max_thrust=2, min_thrust=0.5).utilisation(path)}
    assert used["speed"].value == used["tilt"].value == used["body_rate"].value == 0.0
    assert used["max_thrust"].value == pytest.approx(1.0) and used["min_thrust"].fraction == pytest.approx(0.5)


CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]


def test_rate_of_a_planned_yaw_is_exact_and_stretches_with_time():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2], yaw=[0.0, 1.5, 3.0, 4.0, 6.0])
    used = Limits(yaw_rate=1.0).utilisation(path)[0]
    t = np.linspace(0.0, path.duration, 100001)
    rates = np.abs(path.yaw(t, 1))
    assert used.method == "exact"
    assert rates.max() <= used.value <= rates.max() * (1.0 + 1e-6)
    assert abs(path.yaw(used.instant, 1)) == pytest.approx(used.value)
    assert path.leg_breaks[used.leg] <= used.instant <= path.leg_breaks[used.leg + 1]
    slower = Limits(yaw_rate=1.0).utilisation(path.stretched(2.0))[0]
    assert slower.value == pytest.approx(used.value / 2.0) and slower.instant == pytest.approx(2.0 * used.instant)
    assert slower.leg == used.leg


def test_rate_of_a_yaw_along_the_velocity_is_exact():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.5, yaw="velocity")
    used = Limits(yaw_rate=1.0).utilisation(path)[0]
    rates = np.abs(VelocityHeading(path)(np.linspace(0.0, path.duration, 100001), 1))
    assert used.method == "exact"
    assert used.value == pytest.approx(rates.max(), rel=1e-4) and used.value >= rates.max() * (1.0 - 1e-12)
    slower = Limits(yaw_rate=1.0).utilisation(path.stretched(2.0))[0]
    assert slower.value == pytest.approx(used.value / 2.0) and slower.instant == pytest.approx(2.0 * used.instant)
    assert abs(path.stretched(2.0).yaw(slower.instant, 1)) == pytest.approx(slower.value, rel=1e-6)


def test_rate_of_a_yaw_towards_a_point_is_exact():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2], yaw=minsnap.LookAt((4.0, 2.0, 0.0)))
    used = Limits(yaw_rate=1.0).utilisation(path)[0]
    rates = np.abs(path.yaw(np.linspace(0.0, path.duration, 20001), 1))
    assert used.method == "exact" and rates.max() * (1.0 - 1e-9) <= used.value <= rates.max() * (1.0 + 1e-4)
    assert abs(path.yaw(used.instant, 1)) == pytest.approx(used.value, rel=1e-6)


TURNING = {
    "planned": [0.0, 1.5, 3.0, 4.0, 6.0],
    "along the velocity": "velocity",
    "towards a point": minsnap.LookAt((4.0, 2.0, 0.0)),
    "constant": 0.7,
}
CUT = {
    "cut": lambda path: path.between(1.0, 11.0),
    "cut twice": lambda path: path.between(1.0, 11.0).between(0.5, 7.0),
    "the end": lambda path: path.between(11.5, 12.0),
    "reversed": lambda path: path.reversed(),
    "stretched after a cut": lambda path: path.between(2.0, 9.0).stretched(1.5),
    "joined": lambda path: path.between(0.0, 5.0).then(path.between(5.0, 10.0)),
}


@pytest.mark.parametrize("yaw", TURNING)
@pytest.mark.parametrize("cut", CUT)
def test_rate_of_a_part_is_exact(yaw, cut):
    path = CUT[cut](minsnap.plan(CORNERS, [4, 2, 4, 2], yaw=TURNING[yaw]))
    used = Limits(yaw_rate=1.0).utilisation(path)[0]
    rates = np.abs(path.yaw(np.linspace(0.0, path.duration, 20001), 1)).max()
    assert used.method == "exact" and rates * (1.0 - 1e-9) <= used.value <= rates * (1.0 + 1e-3) + 1e-12
    assert abs(path.yaw(used.instant, 1)) == pytest.approx(used.value, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("left", (1e-3, 1e-6, 1e-9))
def test_rate_of_what_little_is_left_of_a_planned_yaw_has_its_digits(left):
    path = minsnap.plan(CORNERS, [4, 2, 4, 2], yaw=[0.0, 1.5, 3.0, 4.0, 6.0])
    part = path.between(4.0 - left, 4.0)
    assert Limits(yaw_rate=1.0).utilisation(part)[0].value == pytest.approx(
        abs(path.yaw(4.0, 1)), rel=2e3 * left + 1e-9
    )


def test_rate_of_any_other_yaw_is_sampled_and_says_so():
    def turning(t, order=0):
        return np.sin(np.asarray(t) + order * np.pi / 2.0)

    path = minsnap.plan(CORNERS, [4, 2, 4, 2]).with_yaw(turning)
    used = Limits(yaw_rate=1.0).utilisation(path)[0]
    assert used.method == "sampled" and used.value == pytest.approx(1.0, rel=1e-3)
    assert abs(path.yaw(used.instant, 1)) == pytest.approx(used.value) and used.limit == 1.0
    slower = Limits(yaw_rate=1.0).utilisation(path.stretched(2.0))[0]
    assert slower.method == "sampled" and slower.value == pytest.approx(0.5, rel=1e-3)


def test_an_instant_belongs_to_the_leg_that_begins_there():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2])
    assert [leg_at(path, instant) for instant in (0.0, 3.9, 4.0, 6.5, 10.0, 12.0)] == [0, 0, 1, 2, 3, 3]


def test_limits_are_measured_in_the_order_in_which_they_are_given():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2])
    used = measured({"yaw_rate": 1.0, "speed": 2.0}, path, "euclidean", GRAVITY)
    assert [each.name for each in used] == ["yaw_rate", "speed"]


def test_constant_yaw_does_not_turn():
    assert Limits(yaw_rate=1.0).utilisation(minsnap.plan(CORNERS, [4, 2, 4, 2], yaw=1.0))[0].value == 0.0


def test_legs_are_counted_not_pieces():
    path = minsnap.plan(CORNERS, [4, 2, 4, 2], pieces=3, corridor=0.3)
    used = Limits(speed=1.0).utilisation(path)[0]
    assert path.leg_breaks[used.leg] <= used.instant <= path.leg_breaks[used.leg + 1]
    assert np.linalg.norm(path(used.instant, 1)) == pytest.approx(used.value)


RATES = {"speed": 3.0, "acceleration": 6.0, "horizontal_speed": 2.0, "climb_speed": 1.0, "descent_speed": 0.7}
ALL = Limits(**RATES, max_thrust=1.8, min_thrust=0.3, tilt=0.9, body_rate=2.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_state_is_measured_as_the_curve_is_at_its_start(seed):
    """A piece that keeps its highest derivative hardly changes in a tenth of a millisecond."""
    random = np.random.default_rng(seed)
    state = dict(enumerate(random.normal(size=(3, 3)), 1))
    motion = [np.zeros(3), *state.values()]
    steps = np.array([[0, 0, 0, 0], [0, 1 / 3, 0, 0], [0, 2 / 3, 1 / 6, 0], [0, 1, 1 / 2, 1 / 6]])
    curve = Trajectory((steps @ (np.array(motion) * 1e-4 ** np.arange(4)[:, None]))[None], [1e-4])
    at_once, exactly = ALL.use_of_state(state, 3), ALL.utilisation(curve)
    assert [used.name for used in at_once] == [used.name for used in exactly]
    assert [used.fraction for used in at_once] == pytest.approx([used.fraction for used in exactly], rel=3e-3)


def test_thrust_that_vanishes_has_no_direction_and_turns_at_once():
    used = {one.name: one for one in ALL.use_of_state({2: np.array([0.0, 0.0, -GRAVITY]), 3: np.ones(3)}, 3)}
    assert used["tilt"].value == np.pi / 2.0 and used["body_rate"].fraction == used["min_thrust"].fraction == np.inf


def test_a_curve_is_measured_once_and_anew_for_others_of_either(monkeypatch):
    seen = []
    monkeypatch.setattr(limits, "measured", lambda *given: seen.append(given) or measured(*given))
    path, same, equal = random_path(0), Limits(speed=2.0), Limits(speed=2.0)
    first = same.utilisation(path)
    assert same.utilisation(path) is first and len(seen) == 1
    assert equal.utilisation(path) == first and len(seen) == 2
    assert same.utilisation(path.stretched(2.0)) != first and len(seen) == 3
