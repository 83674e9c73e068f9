"""No exception but the library's leaves a public call, whatever options meet: 5,000 draws that hold every pair of them.

TypeError is for what Python itself refuses: an argument that does not exist.
"""

import warnings
from itertools import combinations

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Boxes, Gate, HalfSpaces, Limits, LookAt, Room, RoundTube, Sampled, Search, Tube, Velocity
from minsnap.errors import MinsnapError

FLAT, LINE = np.array([(0.0, 0.0), (3.0, 0.5), (3.0, 2.0)]), np.array([[0.0], [2.0], [1.0]])
DEEP = np.array([(0.0, 0.0, 1.0), (3.0, 0.0, 1.0), (3.0, 2.0, 1.5)])
NAN, INF, HUGE = float("nan"), float("inf"), 10**400

OPTIONS = {
    "waypoints": [DEEP, FLAT, LINE, DEEP[:2], [*DEEP, DEEP[0]], [DEEP[0], Gate(DEEP[1], (1, 1, 0), 1.0), DEEP[2]], None]
    + [np.hstack((DEEP, DEEP)), DEEP[[0, 0, 1]], [], 1e13 * DEEP, NAN * DEEP, "abc", [(0, 0), (1, 2, 3)], HUGE],
    "durations": [None, None, None, [1.5, 1.5], [1.5], [3.0, 1e-6], [1e-12, 1e9], [0, 1], [NAN, 1], "no", HUGE, 2.0],
    "total_time": [None, None, None, 3.0, 1e-9, 1e8, INF, -1.0, "no", [1.0]],
    "limits": [None, Limits(speed=3), Limits(acceleration=3), Limits(speed=2, norm="axis"), Limits(snap=1e-9)]
    + [Limits(speed=1e-12), Limits(yaw_rate=1.0), Limits(max_thrust=1.5, tilt=0.4, body_rate=2.0), Limits(), 3.0],
    "corridor": [None, 0.3, [0.4, 0.5], Tube(0.2), RoundTube(0.3), Boxes(np.zeros((2, 3)) - 1, np.zeros((2, 3)) + 4)]
    + [HalfSpaces((1, 0, 0), 1.2, order=1), HalfSpaces((1, 0), -0.3, order=2), [0.5, Room((-1, -1, -1), (4, 4, 4))]]
    + [HalfSpaces((1, 0, 0), 3.0), Sampled(0.3, 9), 0.0, -1.0, NAN, 1e-14, "tube", [Tube(0.2), "tube"]],
    "continuity": [None, 0, 1, 2, 3, 4, 6, 99, -1, 2.5, "3"],
    "degree": [7, 3, 5, 9, 11, 4, 0, 7.0, "7", None],
    "yaw": [None, 0.3, [0, 1, 2], "velocity", "tilt", LookAt((9, 9, 9)), LookAt((1, 1)), np.sin, lambda t: "x"]
    + [Velocity(yaw_rate=1.0), "north", NAN, [0, 1], lambda t: 1.0 / 0.0 if np.ndim(t) < 0 else t * NAN],
    "start": [None, {"velocity": (1, 0, 0)}, {"velocity": (1, 0)}, {"velocity": (50, 0, 0)}, {"position": (0, 0, 1)}]
    + [{"acceleration": (1, 1, 1)}, {"snap": (1, 1, 1)}, {"speed": 1}, {"velocity": (NAN, 0, 0)}, 3, "rest"],
    "end": [None, {"velocity": (0.5, 0.5, 0)}, {"jerk": (1, 0, 0)}, {"velocity": "fast"}, {"position": (9, 9, 9)}],
    "closed": [False, True, 1, None, "yes"],
    "solver": ["auto", "auto", "auto", "daqp", "clarabel", "none", 5],
    "pins": [
        None,
        {1: {"velocity": (1, 0, 0)}},
        {1: {"velocity": (1, 0)}},
        {0: {}},
        {7: {}},
        {1: 3},
        [1],
        {1: {"up": 1}},
    ],
    "pieces": [1, 2, 3, 6, "auto", 0, 1.5, "many", 1000000],
    "waypoint_tolerance": [None, 0.1, [0, 0.2, 0], Ball(0.2), Ball(1e-13), -1.0, NAN, "near", [[1, 2], [3, 4]], 1e-12],
    "search": [None, Search(split="distance"), Search(time_weight=2.0)]
    + [Search(time_limit=0.01), Search(time_limit=1e-9), 3, "fast", {"split": "distance"}],
    "progress": [None, None, False, lambda step: None, 3],
}
"""Values of every argument, those that make sense and those that do not."""

USUAL = {"waypoints": DEEP, "search": Search(time_limit=0.02)}
DRAWS = 5_000


def drawn(seed):
    """Return arguments by name: some are left out, so that those that are given reach further in."""
    draw = np.random.default_rng(seed)
    given = draw.random(len(OPTIONS)) < draw.choice([0.15, 0.3, 0.6])
    places = [int(draw.integers(len(values))) for values in OPTIONS.values()]
    return {name: place for name, place, one in zip(OPTIONS, places, given, strict=True) if one}


def planned(places):
    """Plan with the values at these places of their tables; a draw without times gets some."""
    asked = {**USUAL, **{name: OPTIONS[name][place] for name, place in places.items()}}
    if not {"durations", "total_time", "limits"} & set(places):
        asked |= {"limits": Limits(speed=3.0, acceleration=5.0)}
    curve = minsnap.plan(**asked)
    return curve.report and minsnap.certify(curve)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_no_other_exception_leaves_plan(part):
    found = []
    for seed in range(part, DRAWS, 10):
        places = drawn(seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", minsnap.errors.MagnitudeWarning)
            try:
                planned(places)
            except MinsnapError as refused:
                assert "\n" not in str(refused), seed
            except Exception as error:  # that is what is looked for
                found.append((seed, type(error).__name__, str(error)[:100], places))
    assert not found, found


def test_the_draws_hold_all_pairs_of_values():
    pairs = {pair for seed in range(DRAWS) for pair in combinations(sorted(drawn(seed).items()), 2)}
    names = sorted(OPTIONS)
    asked = sum(len(OPTIONS[a]) * len(OPTIONS[b]) for a, b in combinations(names, 2))
    assert len(pairs) >= 0.99 * asked


def test_an_argument_that_does_not_exist_is_named():
    with pytest.raises(TypeError, match="corridors"):
        minsnap.plan(DEEP, durations=[1, 1], corridors=0.3)
