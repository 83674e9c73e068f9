"""Missions: continuous from the ground to the ground, through every gate and ball, lap by lap, within limits."""

import numpy as np
import pytest

import minsnap
from minsnap import Course, Gate, Limits, Stop, plan_mission
from minsnap.errors import WaypointError, YawError

LIMITS = Limits(speed=4.0, acceleration=6.0)
GATE = Gate((5, 0, 1.5), (1, 0, 0), 1.0, 0.8, crossing=1)
YARD = (Stop((0, 0, 1.5)), Stop(GATE, straight=0.5), Stop((8, 3, 2), ball=0.4), Stop((4, 5, 2)))


def whole(mission):
    """Check what holds of every mission."""
    found = minsnap.certify(mission.trajectory, limits=mission.limits)
    assert found.ok and found.continuity >= 3
    starts = [part.start for part in mission.parts]
    ends = [part.start + part.duration for part in mission.parts]
    assert starts[0] == 0.0 and ends[-1] == pytest.approx(mission.trajectory.duration)
    assert ends[:-1] == pytest.approx(starts[1:])
    return [part.name for part in mission.parts]


@pytest.fixture(scope="module")
def yard():
    return plan_mission(Course(YARD, closed=True, laps=2, limits=LIMITS, takeoff=True, land=True))


def test_a_mission_begins_and_ends_at_rest_on_the_ground(yard):
    assert whole(yard) == ["take-off", "lap 1", "lap 2", "landing"]
    path = yard.trajectory
    assert path([0.0, path.duration]) == pytest.approx(np.zeros((2, 3)), abs=1e-9)
    for order in (1, 2, 3):
        assert path([0.0, path.duration], order) == pytest.approx(np.zeros((2, 3)), abs=1e-9)
    climb, descent = yard.parts[0], yard.parts[-1]
    assert path(np.linspace(0, climb.duration, 200), 1)[:, 2].max() <= 1.0 + 1e-6
    assert path(np.linspace(descent.start, path.duration, 200), 1)[:, 2].min() >= -0.5 - 1e-6


def test_each_lap_passes_the_gate_straight_and_the_ball(yard):
    for part in yard.parts[1:3]:
        t = np.linspace(part.start, part.start + part.duration, 40_001)
        position, velocity = yard.trajectory(t), yard.trajectory(t, 1)
        inside = np.abs(position[:, 1:] - [0.0, 1.5]) <= np.array([0.5, 0.4]) + 1e-9
        inside &= np.abs(velocity[:, 1:]) <= np.tan(np.radians(1.0)) * velocity[:, :1] + 1e-6
        near = (np.abs(position[:, 0] - 5.0) <= 0.5) & (np.abs(position[:, 1]) < 1.5)
        assert near.any() and inside[near].all() and (velocity[near, 0] > 0.0).all()
        assert np.linalg.norm(position - [8, 3, 2], axis=1).min() <= 0.4 + 1e-4
        assert np.linalg.norm(position - [4, 5, 2], axis=1).min() <= 1e-3


@pytest.mark.parametrize(
    "course",
    [
        Course(YARD, closed=True, laps=2, limits=LIMITS, takeoff=True, land=True),
        Course((*YARD[:2], Stop((8, 3, 2), hold=1.0), YARD[3]), tube=0.9, limits=LIMITS, takeoff=True),
        Course(YARD, closed=True, laps=2, limits=LIMITS),
    ],
)
def test_the_walls_of_a_mission_are_on_the_legs_of_the_whole(course, tmp_path):
    mission = plan_mission(course, pieces=2)
    found = minsnap.certify(mission.trajectory, corridor=mission.corridor)
    assert found.ok and found.corridor_margin >= 0.0
    gate = [part for part in mission.corridor if part.offset.tolist() == pytest.approx([-1.1, 0.5, 1.9, 0.5])]
    legs = sorted({leg for part in gate for leg in part.legs})
    assert len(legs) >= 2 * course.laps
    middles = mission.trajectory(np.mean([mission.trajectory.leg_breaks[k : k + 2] for k in legs], axis=1))
    assert np.abs(middles[:, 0] - 5.0).max() <= 0.5
    from minsnap.files.formats.polynomials import read_polynomials, write_polynomials

    write_polynomials(mission.trajectory, tmp_path / "m.json", corridor=mission.corridor, limits=mission.limits)
    again = read_polynomials(tmp_path / "m.json")
    assert minsnap.certify(again.trajectory, corridor=again.corridor).corridor_margin == found.corridor_margin


def test_the_prism_behind_a_gate_holds_where_the_path_turns_at_once():
    gate = Gate((3, 0, 1), (1, 0, 0), 0.6, crossing=1)
    stops = (Stop((0, 0.2, 1)), Stop(gate, straight=0.6), Stop((3.7, 2.5, 1)))
    path = plan_mission(Course(stops, limits=LIMITS)).trajectory
    inside, after = path.leg_breaks[1:4:2], path.duration
    t = np.linspace(*inside, 5001)
    assert np.abs(path(t)[:, 1:] - [0.0, 1.0]).max() <= 0.3 + 1e-9
    assert path(t[[0, -1]])[:, 0] == pytest.approx([2.4, 3.6]) and path(after)[1] == pytest.approx(2.5)


def test_a_closed_course_alone_is_a_lap_at_speed_again_and_again():
    mission = plan_mission(Course(YARD, closed=True, laps=3, limits=LIMITS))
    assert whole(mission) == ["lap 1", "lap 2", "lap 3"]
    lap = mission.parts[1].start
    assert np.linalg.norm(mission.trajectory(0.0, 1)) > 0.5
    assert mission.trajectory(2 * lap, 1) == pytest.approx(mission.trajectory(0.0, 1), abs=1e-6)


def test_holds_are_spent_at_rest():
    stops = (Stop((0, 0, 1)), Stop((3, 0, 1), hold=2.5), Stop((3, 3, 1), hold=1.0))
    mission = plan_mission(Course(stops, limits=LIMITS, takeoff=True))
    assert whole(mission) == ["take-off", "course", "hold", "course", "hold"]
    hold = mission.parts[2]
    t = np.linspace(hold.start, hold.start + 2.5, 50)
    assert hold.duration == pytest.approx(2.5)
    assert mission.trajectory(t) == pytest.approx(np.tile([3, 0, 1], (50, 1)), abs=1e-12)
    assert np.abs(mission.trajectory(t[1:-1], 1)).max() == 0.0


def test_gates_at_the_ends_have_a_run_up_and_a_run_out():
    course = Course(
        (Stop(GATE), Stop(Gate((5, 6, 2), (-1, 0, 0), 1.0, crossing=1))), limits=LIMITS, takeoff=True, land=True
    )
    mission = plan_mission(course)
    assert whole(mission) == ["take-off", "run-up", "course", "run-out", "landing"]
    enters = mission.parts[2].start
    assert mission.trajectory(enters)[0] == pytest.approx(5.0) and mission.trajectory(enters, 1)[0] > 0.5
    assert mission.trajectory(0.0)[0] < 4.0 and mission.trajectory(mission.trajectory.duration)[0] < 4.0


@pytest.mark.parametrize("closed", [False, True])
def test_a_yaw_towards_a_point_is_part_of_the_search(closed):
    """The parts were planned without it, and the whole was flown 1.6 to 3.7 times more slowly to keep its rate."""
    points, limits = [(0, 0, 1.5), (5, 0, 1.5), (8, 3, 2), (4, 5, 2)], Limits(speed=3, acceleration=5, yaw_rate=1)
    yaw = minsnap.LookAt((3, 2.5))
    course = Course(tuple(map(Stop, points)), limits=limits, yaw=yaw, closed=closed)
    lap = [*points, points[0]] if closed else points
    assert plan_mission(course).trajectory.duration == pytest.approx(
        minsnap.plan(lap, limits=limits, yaw=yaw, closed=closed).duration
    )


def test_the_ground_may_be_elsewhere():
    mission = plan_mission(Course(YARD[2:], limits=LIMITS, takeoff=(6.0, 0.0, -0.5), land=(4.0, 4.0, 0.2)))
    assert whole(mission) == ["take-off", "run-up", "course", "run-out", "landing"]
    assert mission.trajectory(0.0) == pytest.approx([6.0, 0.0, -0.5])
    assert mission.trajectory(mission.trajectory.duration) == pytest.approx([4.0, 4.0, 0.2])


def test_a_heading_along_the_velocity_is_that_of_the_whole():
    mission = plan_mission(
        Course(YARD[2:], limits=Limits(speed=2.0, acceleration=3.0, yaw_rate=1.5), takeoff=True, yaw="velocity")
    )
    t = np.linspace(0, mission.trajectory.duration, 5000)
    assert np.abs(np.diff(mission.trajectory.yaw(t)) / np.diff(t)).max() <= 1.5 + 1e-6
    whole(mission)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Course((Stop((0, 0, 1)),)), "at least 2 waypoints or gates, not 1"),
        (lambda: Course(YARD, laps=0), "laps is 0"),
        (lambda: Course(YARD, tolerance=0.2), "a tolerance around all waypoints, or balls around some"),
        (lambda: Stop((0, 0, 1), hold=-1.0), "hold of a waypoint is -1.0"),
        (lambda: Stop((0, 0, 1), straight=1.0), "only a gate with a crossing"),
        (lambda: Stop(GATE, ball=0.2), "a gate is passed anywhere in its opening"),
        (
            lambda: plan_mission(Course((Stop((0, 0)), Stop((1, 1))), takeoff=True)),
            "need waypoints of three coordinates",
        ),
        (
            lambda: plan_mission(Course(YARD, takeoff=True, avoid=(("cuboid", (-1, -1, 0.4, 1, 1, 0.8)),))),
            r"the take-off is straight, and it is 0.2 m inside obstacle 0 at \(0, 0, 0.6\) m",
        ),
        (
            lambda: plan_mission(Course(YARD[2:], land=True, avoid=(("cylinder", (4, 5, 0.5, 0, 1)),))),
            "the landing is straight, and it is 0.5 m inside obstacle 0",
        ),
        (
            lambda: plan_mission(Course(YARD[2:], takeoff=(0, 0, 9.0))),
            "the ground at 9 m is not below the course at 2 m",
        ),
        (lambda: plan_mission(Course(YARD[1:2] + YARD[2:], closed=True)), "the first gate of a closed lap cannot be"),
    ],
)
def test_what_is_no_course_is_refused(make, message):
    with pytest.raises(WaypointError, match=message):
        make()


def test_the_figure_numbers_the_waypoints(yard):
    figure = minsnap.plot.plot_mission(yard)
    said = [text.get_text().split("\n")[0] for text in figure.subfigs[0].axes[0].texts if text.get_text()]
    assert said == ["0", "1", "2", "3"]
    again = plan_mission(Course((*YARD[:1], *YARD[2:], *YARD[:1]), limits=LIMITS))
    figure = minsnap.plot.plot_mission(again)
    assert [text.get_text() for text in figure.subfigs[0].axes[0].texts if text.get_text()] == ["0, 3", "1", "2"]


@pytest.mark.parametrize("moved, message", [((1e-4, 0, 0), "join with"), ((0, 2.0, 0), "leaves the walls|join with")])
def test_parts_that_do_not_join_are_seen(monkeypatch, moved, message):
    """A control point inside one part is moved after it was planned."""
    from minsnap.paths.missions import mission

    join = mission._headed

    def broken(course, flown):
        curve = join(course, flown)
        points = curve.control_points.copy()
        points[len(points) // 2, 1] += moved
        return minsnap.Trajectory(points, curve.durations, pieces=curve.pieces)

    monkeypatch.setattr(mission, "_headed", broken)
    with pytest.raises(minsnap.SolverError, match=f"last look: it.* ({message})|do not keep"):
        plan_mission(Course(YARD, closed=True, limits=Limits(speed=400.0), takeoff=True, land=True))


def test_walls_of_a_mission_are_looked_at(monkeypatch):
    from minsnap.paths.missions import mission

    narrow = minsnap.HalfSpaces((1, 0, 0), 4.0)
    monkeypatch.setattr(mission, "_corridor", lambda joined, flown: (narrow,))
    with pytest.raises(minsnap.SolverError, match="last look: it leaves the walls of leg"):
        plan_mission(Course(YARD, closed=True, limits=LIMITS))


@pytest.mark.parametrize("degree", [5, 9])
def test_every_part_has_the_degree_of_the_course(degree):
    stops = (Stop((0, 0, 1)), Stop((3, 0, 1), hold=1.0), Stop((3, 3, 1)))
    course = Course(stops, takeoff=True, land=True, limits=Limits(speed=2, acceleration=4))
    mission = plan_mission(course, degree=degree)
    assert mission.trajectory.degree == degree and mission.course.degree == degree
    assert [part.name for part in mission.parts] == ["take-off", "course", "hold", "course", "landing"]


def test_laps_keep_out_of_obstacles_and_are_told_apart_by_their_waypoints():
    stops = (Stop((0, 0, 1)), Stop((4, 0, 1)), Stop((4, 4, 1)))
    limits = Limits(speed=3, acceleration=6)
    course = Course(stops, closed=True, laps=2, tube=1.0, land=True, limits=limits)
    mission = plan_mission(course.changed(avoid=(("cylinder", (2, 0.1, 0.5)),)))
    curve, (first, second, landing) = mission.trajectory, mission.parts
    away = curve(np.linspace(0.0, curve.duration, 5001))[:, :2] - (2.0, 0.1)
    assert np.hypot(*away.T).min() >= 0.5
    for part in (first, second, landing):
        assert curve(part.start) == pytest.approx([0, 0, 1], abs=1e-6)
    assert [part.name for part in (first, second, landing)] == ["lap 1", "lap 2", "landing"]
    assert minsnap.certify(curve, corridor=mission.corridor, limits=limits).ok


def test_a_list_of_angles_counts_the_whole_flight_and_is_the_course_s_own():
    """It was told of five waypoints beside three stops, and changed with the array that was given."""
    angles, stops = np.array([0.0, 0.5, 1.0]), tuple(map(Stop, [(0, 0, 1), (4, 0, 1), (4, 4, 1)]))
    course = Course(stops, yaw=angles, limits=LIMITS)
    angles[1] = 9.0
    mission = plan_mission(course)
    assert mission.trajectory.yaw(mission.trajectory.leg_breaks) == pytest.approx([0.0, 0.5, 1.0])
    with pytest.raises(YawError, match="3 angles: give one, or 5, one for each waypoint of the whole flight"):
        plan_mission(course.changed(takeoff=True, land=True))


DIVING = tuple(map(Stop, [(0, 0, 0.3), (3, 0, 2.0), (6, 0, 0.15), (9, 0, 2.5), (9, 3, 0.3)]))


FAST = Limits(speed=5.0, acceleration=10.0, jerk=200.0)


@pytest.mark.parametrize(
    "how", [{"closed": True, "laps": 2}, {"laps": 2, "takeoff": True, "land": True, "limits": FAST}]
)
def test_a_course_stays_above_the_ground_where_its_stops_are(how):
    """Between low stops it went below, with a note; plans through waypoints did not."""
    course = Course(DIVING, **how)
    deep = plan_mission(course.changed(floor=-5.0)).trajectory.extent((0, 0, 1))[0]
    mission = plan_mission(course)
    lowest = mission.trajectory(np.linspace(0.0, mission.duration, 20_001))[:, 2].min()
    assert deep < -0.01 and lowest >= -1e-9 and not any("goes down to" in note for note in mission.notes)
    higher = plan_mission(course.changed(floor=0.1))
    flown = [part for part in higher.parts if part.name not in ("take-off", "landing")]
    times = np.linspace(flown[0].start, flown[-1].start + flown[-1].duration, 20_001)
    assert higher.trajectory(times)[:, 2].min() >= 0.1 - 1e-9


def test_the_ground_is_where_the_vehicle_lands_and_no_stop_is_below_it():
    assert Course(DIVING).ground == 0.0 and Course(DIVING, floor=0.1).ground is None
    assert Course(DIVING, takeoff=(0, 0, -2.0)).ground == -2.0
    assert Course((*DIVING, Stop((9, 9, -1.0)))).ground is None
    assert Course(tuple(Stop(stop.center[:2]) for stop in DIVING)).ground is None
    with pytest.raises(WaypointError, match="floor is .*: give a height"):
        Course(DIVING, floor="low")
