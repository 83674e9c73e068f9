"""Plans around obstacles: clear of them at every instant, with everything else that a plan keeps."""

import dataclasses

import numpy as np
import pytest

import minsnap
from minsnap import Cuboid, Cylinder, Ellipsoid, Gate, Limits, Room, SolverError
from minsnap.basics.deadline import Deadline
from minsnap.cli import main
from minsnap.corridors.keep_out import clearance_of
from minsnap.files.request_yaml import read_request, write_request
from minsnap.planning import around

ACROSS = [(0.0, 0.0, 1.0), (6.0, 0.0, 1.0)]
LIMITS = Limits(speed=2.0, acceleration=4.0)
PILLAR = Cylinder((3.0, 0.1), 0.5)


def nearest(curve, obstacles):
    """Return the least clearance at many instants."""
    points = curve(np.linspace(0.0, curve.duration, 4001))
    points = np.concatenate((points, np.zeros((len(points), 3 - curve.dim))), axis=1)
    return min(clearance_of(obstacle, point) for obstacle in obstacles for point in points)


SCENES = {
    "limits": {"limits": LIMITS, "avoid": PILLAR},
    "in the middle": {"limits": LIMITS, "avoid": Cylinder((3.0, 0.0), 0.5)},
    "a total time": {"total_time": 5.0, "avoid": PILLAR},
    "durations": {"durations": [5.0], "avoid": Cylinder((3.0, 0.1), 0.5, high=1.2)},
    "a sphere": {"limits": LIMITS, "avoid": Ellipsoid((3.0, 0.0, 1.0), 0.5)},
    "a box in a room": {
        "limits": LIMITS,
        "corridor": Room((-1, -1.5, 0), (7, 1.5, 3)),
        "avoid": Cuboid((2, -1, -1), (4, 1, 9)),
    },
    "a tube": {"limits": LIMITS, "corridor": 0.8, "avoid": [PILLAR]},
    "three": {"limits": LIMITS, "avoid": [Cylinder((x, y), 0.5) for x, y in ((1.5, 0.1), (3.0, -0.3), (4.5, 0.2))]},
    "a moving start": {"limits": LIMITS, "start": {"velocity": (1.0, 0.0, 0.0)}, "avoid": PILLAR},
    "a lap": {
        "waypoints": [(0, 0, 1), (4, 0, 1), (2, 3, 1), (0, 0, 1)],
        "limits": LIMITS,
        "closed": True,
        "avoid": Cylinder((2.0, -0.6), 0.4),
    },  # fmt: skip
    "along": {"limits": LIMITS, "avoid": PILLAR, "yaw": "velocity"},
    "the plane": {"waypoints": [(0.0, 0.0), (6.0, 0.0)], "limits": LIMITS, "avoid": PILLAR},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_plans_keep_out_and_keep_everything_else(name):
    asked = {"waypoints": ACROSS} | SCENES[name]
    avoid = asked["avoid"] if isinstance(asked["avoid"], list) else [asked["avoid"]]
    assert nearest(minsnap.plan(**asked | {"avoid": None}), avoid) < -0.1  # in the way
    curve = minsnap.plan(**asked)
    assert nearest(curve, avoid) >= -1e-9
    assert curve.dim == 2 or minsnap.certify_fleet([curve], avoid=avoid).ok
    assert minsnap.certify(curve, asked["waypoints"], asked.get("corridor"), asked.get("limits")).ok
    assert curve.legs == len(asked["waypoints"]) - 1
    for name in asked.keys() & {"total_time", "durations"}:
        assert curve.duration == pytest.approx(np.sum(asked[name]))


def test_gates_are_passed_on_the_way():
    course = [(0.0, 0.0, 1.0), Gate((3.0, 0.0, 1.0), (1.0, 0.0, 0.0), 1.0), (6.0, 2.0, 1.0)]
    avoid = [Cylinder((1.5, 0.0), 0.4), Cylinder((4.5, 0.8), 0.4)]
    curve = minsnap.plan(course, limits=LIMITS, avoid=avoid)
    assert nearest(curve, avoid) >= -1e-9
    assert minsnap.certify(curve, course, limits=LIMITS).ok


def test_what_is_not_in_the_way_changes_nothing():
    far = minsnap.plan(ACROSS, limits=LIMITS, avoid=Cylinder((3.0, 2.0), 0.5))
    assert (far.control_points == minsnap.plan(ACROSS, limits=LIMITS).control_points).all()


def test_a_way_around_is_little_longer_than_the_bound():
    curve = minsnap.plan(ACROSS, limits=LIMITS, avoid=PILLAR, pieces="auto")
    assert 3.5 <= curve.duration <= 3.5 * 1.05  # 6 m at 2 m/s, and 0.5 s of acceleration


@pytest.mark.slow
@pytest.mark.parametrize("count", [60, 150])
def test_forests_are_passed(count):
    """One of 150 trunks was refused, and others took seconds."""
    rng = np.random.default_rng(0)
    trunks = [
        c for c in rng.uniform((0, -15), (60, 15), (count, 2)) if min(np.hypot(*c), np.hypot(c[0] - 60, c[1])) > 2
    ]
    avoid, limits = [Cylinder(center, 1.0) for center in trunks], Limits(speed=6.0, acceleration=5.0)
    curve = minsnap.plan([(0, 0, 2), (60, 0, 2)], limits=limits, avoid=avoid, pieces="auto")
    assert minsnap.certify(curve, avoid=avoid, limits=limits).ok and nearest(curve, avoid) >= -1e-9
    assert 11.2 <= curve.duration <= 13.5  # 60 m at 6 m/s, and 1.2 s of acceleration


@pytest.mark.slow
def test_a_way_that_took_all_of_the_time_leaves_some_for_the_flight(monkeypatch):
    """Flights of 24 s were returned for 11 s: there was a way, and no time left to search along it."""
    asked = {"limits": Limits(speed=6.0, acceleration=5.0), "avoid": [Cylinder((x, 0.3), 1.0) for x in (10, 20, 30)]}
    best, now = minsnap.plan([(0, 0, 2), (40, 0, 2)], **asked), [0.0]
    search, look = around._plan_around, around._line_around

    def on_a_clock(task, timing, obstacles):
        deadline = Deadline(clock=lambda: now[0])
        return search(dataclasses.replace(task, deadline=deadline), dataclasses.replace(timing, due=1e3), obstacles)

    def slowly(*known):
        now[0] = 2e3
        return look(*known)

    monkeypatch.setattr(around, "_plan_around", on_a_clock)
    monkeypatch.setattr(around, "_line_around", slowly)
    late = minsnap.plan([(0, 0, 2), (40, 0, 2)], **asked)
    assert now[0] == 2e3 and nearest(late, asked["avoid"]) >= -1e-9
    assert late.duration <= 1.02 * best.duration


@pytest.mark.parametrize(("legs", "pieces"), [(1, 1), (6, 6)])
def test_what_closes_a_tube_off_is_refused_with_every_number_of_pieces(legs, pieces):
    """Many pieces ended in "the native core does not take this fleet", and refusing one leg took ten seconds."""
    points = [(3.0 * leg, 0.2 * (leg % 2), 1.0) for leg in range(legs + 1)]
    with pytest.raises(minsnap.UnprovedError, match="no way around"):
        minsnap.plan(points, durations=[2.0] * legs, corridor=0.1, pieces=pieces, avoid=Cylinder((1.5, 0.1), 0.4))


def test_plans_around_obstacles_are_as_smooth_as_their_pieces():
    """One polynomial a leg became sixteen, with jerk of thousands of m/s^3."""
    curve = minsnap.plan(ACROSS, limits=LIMITS, avoid=PILLAR, pieces=1)
    assert curve.pieces <= 4 and curve.max_norm(3)[0] < 60.0


@pytest.mark.parametrize(
    ("avoid", "error", "words"),
    [
        (Cylinder((6.0, 0.1), 0.5), minsnap.errors.CorridorError, "waypoint 1, .* is 0.4 m inside obstacle 0"),
        (Cuboid((2, -9, -9), (4, 9, 9)), minsnap.UnprovedError, "1 m inside obstacle 0"),
        ("a pillar", minsnap.errors.CorridorError, "give cylinders"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(avoid, error, words):
    with pytest.raises(error, match=words):
        minsnap.plan(ACROSS, limits=LIMITS, corridor=Room((-1, -2, 0), (7, 2, 2)), avoid=avoid)


def test_files_and_the_command_line_say_what_to_avoid(tmp_path):
    (tmp_path / "asked.yaml").write_text(
        "waypoints: [[0, 0, 1], [6, 0, 1]]\ntotal_time: 5\navoid:\n- cylinder: [3, 0.1, 0.5]\n"
        "- cuboid: [2, 2, 0, 3, 3, 1]\n- ellipsoid: [1, 3, 1, 0.2, 0.2, 0.2]\n"
    )
    request = read_request(tmp_path / "asked.yaml")
    write_request(request, tmp_path / "again.yaml")
    assert read_request(tmp_path / "again.yaml") == request
    curve = minsnap.plan(**request.request().arguments())
    assert nearest(curve, request.obstacles) >= -1e-9
    (tmp_path / "asked.csv").write_text("x,y,z\n0,0,1\n6,0,1\n")
    files = [str(tmp_path / name) for name in ("asked.csv", "out.csv")]
    with pytest.raises(SystemExit) as left:
        main(["plan", files[0], "--time", "5", "--avoid", "3,0.1,0.5", "-o", files[1]])
    assert not left.value.code
    assert np.abs(minsnap.read_csv(tmp_path / "out.csv").position[:, 1]).max() > 0.35


@pytest.mark.parametrize(
    "said", ["{cone: [1, 2, 3]}", "{cylinder: [1, 2]}", "[1, 2, 3]", "{cuboid: [1, a, 2, 3, 4, 5]}"]
)
def test_malformed_obstacles_in_files_are_refused(tmp_path, said):
    (tmp_path / "asked.yaml").write_text(f"waypoints: [[0, 0, 1], [6, 0, 1]]\ntotal_time: 5\navoid: [{said}]\n")
    with pytest.raises(minsnap.InputError):
        read_request(tmp_path / "asked.yaml").request().arguments()


OFF = {
    "obstacle": ({}, "m inside obstacle 0 at"),
    "wall": ({"walls": ()}, "it leaves the corridor of leg 0"),
    "waypoint": ({"waypoints": ACROSS + np.array([(0, 0, 0), (0, 0, 1e-6)])}, "it passes a waypoint"),
    "start": ({"pins": {0: {}, 1: {}}}, "derivative 1 at waypoint 0"),
}


@pytest.mark.slow
@pytest.mark.parametrize("off", OFF)
def test_what_the_search_around_does_not_know_is_seen(monkeypatch, off):
    """The search has the question without one of its parts, and what it finds must not leave."""
    asked = {
        "waypoints": ACROSS,
        "limits": LIMITS,
        "corridor": 0.9,
        "start": {"velocity": (0.5, 0.9, 0.0)},
        "pieces": 1,
    }
    asked["avoid"] = Cylinder((3.0, 0.3), 0.5)
    search, (changed, sentence) = around._plan_around, OFF[off]
    obstacles = [Cylinder((9.0, 9.0), 0.1)] if off == "obstacle" else None

    def without(task, timing, known):
        other = task if off == "obstacle" else dataclasses.replace(task, **changed)
        return search(other, timing, obstacles or known)

    minsnap.plan(**asked)
    monkeypatch.setattr(around, "_plan_around", without)
    with pytest.raises(SolverError, match=f"refused at the last look: .*{sentence}"):
        minsnap.plan(**asked)
