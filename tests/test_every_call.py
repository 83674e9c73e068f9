"""No exception but the library's leaves a public call: draws over the values of its arguments that hold every pair."""

import importlib
import inspect
import pickle
import warnings
from dataclasses import fields
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import minsnap
import minsnap.vehicle
from minsnap import (
    Ball,
    Boxes,
    Course,
    Gate,
    HalfSpaces,
    Limits,
    LookAt,
    Replanner,
    Room,
    RoundTube,
    Search,
    Separation,
    Stop,
    Tube,
)
from minsnap.errors import InputError, MinsnapError
from minsnap.files.convert import read_any, write_any

NAN, INF, HUGE = float("nan"), float("inf"), 10**400
POINTS = np.array([(0.0, 0.0, 1.0), (3.0, 0.0, 1.0), (3.0, 2.0, 1.5)])
WIDE = Limits(speed=3.0, acceleration=5.0)
CURVE = minsnap.plan(POINTS, limits=WIDE)
MANY = np.stack([POINTS, POINTS + 1.0, POINTS * 2.0])
ODD = [NAN, INF, -1.0, 0, HUGE, "no", [], [[1, 2], [3]], {}, True, 1e-13, 1e13, object()]
LIMITS = [Limits(speed=3.0), Limits(acceleration=4.0, tilt=0.5), Limits(), Limits(speed=1e-9), 3.0, [Limits(speed=1.0)]]
WALLS = [0.3, [0.4, 0.5], Tube(0.2), RoundTube(0.3), HalfSpaces((1, 0, 0), 3.5), HalfSpaces((1, 0), 1.0, order=1)]
WALLS += [Boxes(np.zeros((2, 3)) - 1, np.zeros((2, 3)) + 4), [0.5, Room((-1, -1, -1), (5, 5, 5))], Ball(0.1), "tube"]
STATES = [{"velocity": (1, 0, 0)}, {"velocity": (1, 0)}, {"position": (0, 0, 1)}, {"jerk": (NAN, 0, 0)}, {"up": 1}]
GATE = Gate((2, 1, 1), (1, 0, 0), 1.0, 1.0)
ROUND = tuple(Stop(place) for place in ((0, 0, 1), GATE, (3, 3, 1.5), (0, 3, 1)))
YAWS = [0.3, "velocity", "tilt", "north", [0, 1, 2], LookAt((9, 9, 9)), np.sin]
FLEETS = [
    POINTS[None, :2] + np.array([(0, 0, 0), (0, 2, 0), (0, 0, 2)])[:, None],
    MANY,
    POINTS,
    [POINTS, POINTS[:, :2]],
]

CALLS = {
    "plan_many": (
        lambda **asked: _planned({"waypoints": MANY} | asked),
        {"waypoints": [MANY, MANY[:, :, :2], [POINTS, POINTS[:2]], POINTS, MANY[:0], None]},
        {
            "durations": [[1.5, 1.5], np.ones((3, 2)), [1.0], [[1.0, 1.0], [1.0]], None],
            "corridor": WALLS,
            "limits": LIMITS,
        }
        | {"pins": [{1: {"velocity": (1, 0, 0)}}, [None] * 3, {9: {}}], "total_time": [3.0, [3.0, 4.0, 5.0], [1.0]]}
        | {"degree": [3, 5, 9, 11, 4, "7"], "start": STATES, "end": STATES, "gradients": [True, 1], "threads": [1, 2]}
        | {"pieces": [1, 3, "auto", [1, "auto", None], [1], 0, "many"]},
    ),
    "replan": (
        lambda **asked: minsnap.replan(**{"flown": CURVE, "now": 0.5, "limits": WIDE} | asked),
        {"now": [0.0, 0.5, CURVE.duration, CURVE.duration + 1.0, -1.0]},
        {
            "waypoints": [POINTS[1:], POINTS[2:], POINTS[:, :2], POINTS[:0]],
            "budget": [0.05, 1e-9],
            "goal": [(4, 4, 1), (1, 1)],
        }
        | {"durations": [[1.0, 1.0], [1.0]], "total_time": [3.0], "yaw": YAWS, "limits": LIMITS, "corridor": WALLS}
        | {"room": [Room((-1, -1, 0), (5, 5, 5)), Room((9, 9, 9), (10, 10, 10))], "clearance": [0.1], "horizon": [1, 2]}
        | {"degree": [5, 9], "pieces": [2, 3], "recover": [0.5], "boxes": WALLS, "flown": [CURVE, CURVE.derivative()]},
    ),
    "replanner": (
        lambda now=0.5, again=0.2, **asked: _changed(Replanner(**{"limits": WIDE} | asked), now, again),
        {"now": [0.0, 0.5, CURVE.duration, -1.0], "again": [0.2, 9.0]},
        {"limits": LIMITS, "corridor": WALLS, "yaw": YAWS, "horizon": [1, 2], "pieces": [2], "degree": [5, 9]},
    ),
    "plan_fleet": (
        lambda **asked: minsnap.plan_fleet(
            **{"waypoints": FLEETS[0], "search": minsnap.Search(time_limit=0.2), "limits": WIDE, "separation": 0.3}
            | asked
        ),
        {"waypoints": FLEETS, "limits": LIMITS[:3]},
        {
            "separation": [0.3, Separation(0.3, downwash=2.0), 5.0],
            "room": [Room((-9, -9, -9), (9, 9, 9)), [(0, 0, 0), (1, 1, 1)]],
        }
        | {"total_time": [9.0, 0.1], "pieces": [4, "auto"], "yaw": YAWS, "names": [["a", "b", "c"], ["a", "a", "a"]]}
        | {
            "seed": [1],
            "polish": [0.05],
            "fixed": [[CURVE], CURVE],
            "holds": [[None, [1.0, 0.0], None]],
            "start": [STATES[:3]],
        },
    ),
    "certify": (
        lambda **asked: minsnap.certify(**{"traj": CURVE} | asked).ok,
        {"waypoints": [POINTS, POINTS[:, :2], POINTS[:2], None]},
        {
            "traj": [CURVE, minsnap.circle(speed=1.0), 3],
            "corridor": WALLS,
            "limits": LIMITS,
            "tolerance": [0.1, Ball(0.1)],
        }
        | {"limits_from": [0.5, 99.0], "tracking": [minsnap.Loop.px4(), "px4"], "wind": [1.0, -1.0, NAN]},
    ),
    "certify_fleet": (
        lambda **asked: minsnap.certify_fleet(**{"fleet": [CURVE, CURVE]} | asked).ok,
        {"fleet": [[CURVE], [CURVE, minsnap.circle(speed=1.0)], [], CURVE]},
        {
            "separation": [0.3, Separation(0.3)],
            "limits": LIMITS,
            "room": [Room((0, 0, 0), (1, 1, 1))],
            "reach": [3.0],
            "threads": [2],
        },
    ),
    "circle": (
        minsnap.circle,
        {"radius": [1.0, 3.0], "period": [5.0], "speed": [1.0]},
        {"laps": [0.5, 2], "ramp": [1.0], "center": [(1, 2)], "yaw": YAWS, "limits": LIMITS, "altitude": [1.0]},
    ),
    "rectangle": (
        lambda **asked: minsnap.rectangle(**{"total_time": 12.0} | asked),
        {"width": [1.0, 6.0], "length": [2.0]},
        {
            "corridor": WALLS,
            "laps": [2, 3],
            "start_corner": [2, 7],
            "total_time": [12.0, 0.1],
            "limits": LIMITS,
            "yaw": YAWS,
        }
        | {"degree": [5, 9], "search": [Search(split="distance"), 3], "continuity": [4], "closed": [True]},
    ),
    "line": (
        minsnap.line,
        {"start": [(0, 0, 1)], "goal": [(3, 0, 1), (0, 0, 1)]},
        {
            "total_time": [3.0],
            "limits": LIMITS,
            "constant_speed": [True],
            "corridor": WALLS,
            "degree": [5],
            "yaw": YAWS,
        },
    ),
    "helix": (
        minsnap.helix,
        {"radius": [1.0, 3.0], "speed": [1.0], "period": [5.0]},
        {"pitch": [0.5, -0.5], "laps": [0.5, 3], "ramp": [1.0], "center": [(1, 2)], "yaw": YAWS, "limits": LIMITS}
        | {"altitude": [1.0, 2], "start_angle": [1.0], "clockwise": [True, 1]},
    ),
    "stop": (
        lambda **asked: Stop(**{"place": (0, 0, 1)} | asked),
        {"place": [(0, 0, 1), (0, 1), GATE, POINTS]},
        {"ball": [0.2], "hold": [1.0], "straight": [0.5]},
    ),
    "plan_mission": (
        lambda **asked: _flown({"stops": (Stop((0, 0, 1)), Stop(GATE), Stop((4, 2, 1), hold=1.0))} | asked),
        {"stops": [ROUND, tuple(Stop(point) for point in POINTS[:, :2]), (Stop((0, 0, 1)),), list(ROUND)]},
        {"closed": [True], "laps": [2], "limits": LIMITS, "tube": [0.4, 0.01], "yaw": YAWS, "tolerance": [0.1]}
        | {"takeoff": [True, (1.0, 1.0, 0.0), (0.0, 0.0, 9.0)], "land": [True, (1.0, 1.0, 0.0)], "start": STATES}
        | {"end": STATES, "boxes": WALLS, "pieces": [2, "auto"], "continuity": [2, 4], "search": [Search(), 3]},
    ),
    "files": (
        lambda **asked: _written(**asked),
        {"ending": [".csv", ".json", ".yaml", ".npz", ".traj", ".skyb", ".parquet", ".npy", ".nothing", ""]},
        {"curve": [CURVE, CURVE.derivative(), minsnap.circle(speed=1.0), minsnap.plan(POINTS[:, :2], total_time=3.0)]}
        | {"frame": ["enu", "ned", "flu", "optitrack", "up"], "rate": [1.0, 50], "to": ["mav", "px4", "setpoints"]},
    ),
    "assign": (
        lambda starts=POINTS, goals=POINTS: minsnap.assign(starts, goals),
        {"starts": [POINTS, POINTS[:2]], "goals": [POINTS, POINTS[:, :2]]},
        {},
    ),
}
"""The call; arguments that are nearly always given; others. Odd values stand among those of all."""


def _flown(asked):
    names = {entry.name for entry in fields(Course)}
    course = Course(**{name: value for name, value in asked.items() if name in names})
    return minsnap.plan_mission(course, **{name: value for name, value in asked.items() if name not in names})


def _written(ending=".json", curve=CURVE, frame="enu", rate=20.0, to=None):
    """Write a file by its ending, and read it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"a{ending}"
        write_any(curve, path, to, rate, frame)
        return read_any(path)


def _planned(asked):
    timed = {"durations", "limits", "total_time"} & set(asked)
    return minsnap.plan_many(**asked if timed else asked | {"durations": [1.5, 1.5]}).errors


def _changed(replanner, now, again):
    change = replanner.replan(CURVE, now, POINTS[1:], budget=0.05)
    return replanner.replan(change.trajectory, again, POINTS[2:], budget=0.05)


def drawn(name, seed):
    """Return arguments by name; a tenth of the values are odd."""
    _, usual, others = CALLS[name]
    draw, found = np.random.default_rng(seed), {}
    share = draw.choice([0.1, 0.3, 0.6])
    for option, values in (usual | others).items():
        if draw.random() < (0.8 if option in usual else share):
            found[option] = ODD[draw.integers(len(ODD))] if draw.random() < 0.1 else values[draw.integers(len(values))]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_no_other_exception_leaves_a_public_call(name):
    found = []
    for seed in range(50 if name in ("plan_fleet", "rectangle") else 150):
        asked = drawn(name, seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", minsnap.errors.MagnitudeWarning)
            try:
                CALLS[name][0](**asked)
            except MinsnapError as refused:
                assert "\n" not in str(refused), seed
            except Exception as error:  # that is what is looked for
                found.append((seed, type(error).__name__, str(error)[:100], asked))
    assert not found, found


def test_the_draws_hold_every_pair_of_arguments():
    for name, (_, usual, others) in CALLS.items():
        pairs = {pair for seed in range(150) for pair in combinations(sorted(drawn(name, seed)), 2)}
        assert pairs == set(combinations(sorted(usual | others), 2)), name


ONCE = {
    "a circle without a limit": lambda: minsnap.circle(limits=Limits()),
    "a ragged yaw": lambda: minsnap.replan(CURVE, 0.5, POINTS[1:], yaw=[[1, 2], [3]], limits=WIDE),
    "a table of two coordinates": lambda: _written(".parquet", minsnap.plan(POINTS[:, :2], total_time=3.0)),
    "a format that is a list": lambda: _written(to=[1]),
    "no path": lambda: _written(curve={}),
    "a state where it lands": lambda: minsnap.plan_mission(Course(ROUND, end=STATES[0], land=True)),
    "a state where it holds": lambda: Course((Stop((0, 0, 1), hold=1.0), Stop((4, 2, 1))), start=STATES[0]),
}
"""What drawn calls found: these ended in other exceptions, or in the last look."""


@pytest.mark.parametrize("name", ONCE)
def test_what_once_ended_otherwise_is_refused_in_one_sentence(name):
    with pytest.raises(InputError) as refused:
        ONCE[name]()
    assert "last look" not in str(refused.value)


def test_a_mission_with_a_hold_joins_as_smoothly_as_rest_is_given():
    stops = tuple(Stop(place, hold=hold) for place, hold in (((0, 0, 1), 0.0), ((3, 1, 1), 1.0), ((4, 3, 1), 0.0)))
    mission = minsnap.plan_mission(Course(stops, limits=WIDE), degree=9, pieces=2)
    assert minsnap.certify(mission.trajectory, limits=WIDE).continuity >= 4


def public_calls(package):
    """Return the functions and classes of a package by name, each with how many arguments it needs."""
    module = minsnap.routes if package == "routes" else importlib.import_module(f"minsnap.{package}")
    named = {name: getattr(module, name) for name in module.__all__}
    named = {name: called for name, called in named.items() if inspect.isfunction(called) or inspect.isclass(called)}
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    counts = {
        name: sum(p.default is p.empty and p.kind in kinds for p in inspect.signature(called).parameters.values())
        for name, called in named.items()
    }
    return {name: (called, max(counts[name], 1)) for name, called in named.items()}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("package", ["corridors", "fleet", "flight", "plot", "routes", "shows", "vehicle"])
def test_things_of_another_kind_are_refused_by_every_public_call(package, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = []
    for name, (called, count) in public_calls(package).items():
        for other in (*ODD, None, b"x", [None], CURVE, WIDE, POINTS[0], POINTS):
            try:
                called(*[other] * count)
            except (MinsnapError, TypeError, AttributeError) as refused:
                assert "\n" not in str(refused), (name, other)
            except Exception as error:  # that is what is looked for
                found.append((name, other, type(error).__name__, str(error)[:100]))
    assert not found, found


OBJECTS = [
    CURVE,
    CURVE.report,
    minsnap.certify(CURVE),
    minsnap.plan_many(MANY, durations=[1.5, 1.5]),
    minsnap.plan_fleet(FLEETS[0], limits=WIDE, separation=0.3),
    Replanner(limits=WIDE),
    WIDE,
    GATE,
    HalfSpaces((1, 0, 0), 3.5),
    Room((-1, -1, -1), (5, 5, 5)),
    minsnap.Moving([(0, 1, 1), (2, 3, 1)], 0.5),
    minsnap.Prism([(0, 0), (1, 0), (0, 1)], inclusion=True),
    LookAt((9, 9, 9)),
    minsnap.vehicle.Quadrotor.dji_f330(),
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("thing", OBJECTS, ids=lambda thing: type(thing).__name__)
def test_things_of_another_kind_are_refused_by_every_method(thing, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = [name for name in dir(type(thing)) if not name.startswith("_") and not hasattr(list, name)]
    methods = {name: method for name in names if inspect.isroutine(method := getattr(thing, name))}
    found = []
    for name, method in methods.items():
        count = sum(p.default is p.empty for p in inspect.signature(method).parameters.values())
        for other in (*ODD, None, b"x", [None]):
            try:
                method(*[other] * max(count, 1))
            except (MinsnapError, TypeError, AttributeError) as refused:
                assert "\n" not in str(refused), (name, other)
            except Exception as error:  # that is what is looked for
                found.append((name, other, type(error).__name__, str(error)[:100]))
    assert not found, found


class Broken(minsnap.Path):
    """A path that is of the kind that is asked for, and fails."""

    duration, dim = 1.0, 3

    def _evaluate(self, t, order):
        raise ValueError("of the caller")


def test_what_a_callers_own_path_raises_leaves_as_it_is():
    with pytest.raises(ValueError, match="of the caller"):
        minsnap.plot.plot_path(Broken())


def test_public_names_are_what_their_modules_define():
    import minsnap.planning.planner as planner

    assert minsnap.plan is planner.plan and minsnap.plan.__wrapped__ is planner.plan.__wrapped__
    twin = pickle.loads(pickle.dumps(minsnap.vehicle.tilt))
    assert twin is minsnap.vehicle.tilt and twin([0.0, 0.0, 0.0]) == 0.0
