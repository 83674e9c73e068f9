"""Every InfeasibleError has a proof that verifies; where only a search found nothing, the error says so."""

import ast
from pathlib import Path

import numpy as np
import pytest
from tasks import REFERENCE

import minsnap
from minsnap.errors import InfeasibleError, UnprovedError
from minsnap.limits.limits import Limits

KINDS = {"InfeasibleError": InfeasibleError, "UnprovedError": UnprovedError}
PACKAGE = Path(minsnap.__file__).parent
POINTS = [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 1)]
LIMITS = Limits(speed=3.0, acceleration=6.0)
NEAR = [(0, 0, 0), (0.03, 0, 0), (3, 0, 0)]
FAST = {"start": {"velocity": (2.5, 0, 0)}}
BLOCK = minsnap.Cuboid((2, -1, -1), (3, 1, 1))
STAND = [(0, 0, 0), (2, 0, 0), (4, 1, 0)]

SITES = [
    (
        ("given_times", "overdetermined", InfeasibleError),
        "pins and continuity ask for more",
        {
            "waypoints": STAND,
            "durations": [1.5, 0.9],
            "degree": 3,
            "continuity": 2,
            "pins": {1: {"velocity": (1, 1, 0)}},
        },
    ),
    (
        ("given_times", "_too_fast", InfeasibleError),
        "the limits cannot be kept in 10 s.* times as long would do",
        {"waypoints": REFERENCE, "durations": [3.3, 1.7, 3.3, 1.7], "limits": Limits(speed=2.5)},
    ),
    (
        ("infeasibility", "explain_corridor", InfeasibleError),
        "it is too narrow at",
        {"waypoints": REFERENCE, "durations": [4, 2, 4, 2], "corridor": 1e-4, "continuity": 5},
    ),
    (
        ("infeasibility", "_too_near", InfeasibleError),
        "no curve passes the waypoints as near as asked for: leg 1 is the hardest",
        {
            "waypoints": [(0, 0), (2, 1), (3, 5)],
            "durations": [3, 5],
            "continuity": 5,
            "end": {"velocity": (-0.2, -1), "acceleration": (-0.1, 0.1)},
            "pins": {1: {"velocity": (0.3, -0.5), "acceleration": (-0.1, 0.3)}},
            "waypoint_tolerance": 0.3,
        },
    ),
    (
        ("sentences", "shorter_than_found", UnprovedError),
        "no plan of 4 s within the limits was found: the shortest found is 4.3",
        {"waypoints": POINTS, "total_time": 4.0, "limits": LIMITS},
    ),
    (
        ("sentences", "total_too_short", InfeasibleError),
        "3 s are too short for the limits: the lengths of the legs alone need 3.* s, and the shortest found is 4.3",
        {"waypoints": POINTS, "total_time": 3.0, "limits": LIMITS},
    ),
    (
        ("sentences", "below_least_time", InfeasibleError),
        "3.7 s are too short for the limits: every flight takes 3.73.* s, and the shortest found takes 4.3",
        {"waypoints": POINTS, "total_time": 3.7, "limits": LIMITS},
    ),
    (
        ("sentences", "exceeded_at_least_cost", UnprovedError),
        "the plan of least cost in 3 s does not keep body_rate: it reaches 4.3.* 5.0.* s would do",
        {"waypoints": POINTS, "durations": [1, 1, 1], "limits": Limits(body_rate=1.0)},
    ),
    (
        ("sentences", "leg_too_short", InfeasibleError),
        "leg 0 has 0.01 s, and its length alone needs 1 s",
        {"waypoints": POINTS, "durations": [0.01, 2, 2], "limits": LIMITS, "start": {"velocity": (3, 0, 0)}},
    ),
    (
        ("sentences", "leg_too_short", InfeasibleError),
        r"leg 1 has 1 s, and its length alone needs 1\.6 s: give it more time; 2\.3\d* times as long would do",
        {"waypoints": REFERENCE, "durations": [2, 1, 2, 1], "limits": Limits(speed=2.5)},
    ),
    (
        ("sentences", "unproved", UnprovedError),
        "the limits cannot be kept in 0.7 s",
        {"waypoints": [(0, 0, 3), (1, 0, 0)], "durations": [0.7], "limits": Limits(speed=50.0, min_thrust=0.5)},
    ),
    (
        ("sentences", "connector_too_long", UnprovedError),
        "leg 0 has 0.0101 s, and the way between its limits",
        {"waypoints": NEAR, "durations": [0.0101, 2], "limits": LIMITS, "start": {"velocity": (3, 0, 0)}},
    ),
    (
        ("around", "_plan_around", UnprovedError),
        "no way around the obstacles was found; without them the path is 0.5 m inside obstacle 0",
        {"waypoints": [(0, 0, 0), (6, 0, 0)], "durations": [3], "corridor": 0.2, "avoid": [BLOCK]},
    ),
    (
        ("around", "_among", UnprovedError),
        "no plan was found among the moving obstacles; without them the path is 0.5 m inside obstacle 0",
        {"waypoints": [(0, 0), (6, 0)], "durations": [3], "corridor": 0.2, "avoid": [minsnap.Moving([(0, 3, 0)], 0.5)]},
    ),
]
"""Module, function and class of what is raised, the sentence, and a question that ends there."""


ELSEWHERE = {
    ("sentences", "only_found", UnprovedError),
    ("sentences", "any_time_too_short", InfeasibleError),  # tests/refusals/test_short_total.py
    ("in_loop", "plan_kept_in_loop", UnprovedError),  # tests/test_vehicle_tube.py
    ("passage", "_too_narrow", InfeasibleError),
    ("plan_route", "_around", UnprovedError),
    ("explorer", "_way", UnprovedError),
    ("explorer", "_corridor", UnprovedError),
    ("frontiers", "_no_way", UnprovedError),
    ("time_search", "unproved_fleet", UnprovedError),
    ("fleet_planner", "_finished", UnprovedError),
    ("show_course", "too_short", UnprovedError),
    ("show_course", "_fenced", UnprovedError),
    ("show_course", "_in_turn", UnprovedError),
    ("sample_fit", "fit_samples", UnprovedError),
}
"""Tested in ``routes/test_barrier.py``, ``routes/test_plan_route.py``, ``routes/test_explorer.py``,
``files/test_sample_fit.py``, ``fleet/test_fleet_planner.py``, ``fleet/test_fleet_last_look.py``,
``shows/test_times_of_acts.py`` and ``shows/test_site.py``."""


def raising_sites():
    """Return module, function and class of every refusal that the package makes, and the keywords of its call."""
    found = []
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        tree = ast.parse(text if any(f"{name}(" in text for name in KINDS) else "")
        for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
            for call in (node for node in ast.walk(function) if isinstance(node, ast.Call)):
                kind = KINDS.get(getattr(call.func, "id", ""))
                if kind is not None:
                    found.append(((path.stem, function.name, kind), {word.arg for word in call.keywords}))
    return found


def test_refusals_are_given_a_proof_or_called_unproved():
    for site, given in raising_sites():
        assert ("contradiction" in given) is (site[-1] is InfeasibleError), site


def test_every_site_that_refuses_is_tested():
    assert {site for site, _ in raising_sites()} == {site for site, *_ in SITES} | ELSEWHERE


@pytest.mark.slow
@pytest.mark.parametrize(("site", "sentence", "asked"), SITES)
def test_a_refusal_verifies_or_says_what_was_tried(site, sentence, asked):
    kind = site[-1]
    with pytest.raises(InfeasibleError, match=sentence) as refused:
        minsnap.plan(**asked)
    assert refused.type is kind
    assert refused.value.verify() is (kind is InfeasibleError)


def test_a_single_leg_has_the_total_asked_for():
    asked = {"total_time": 2.0, "corridor": 0.01, "start": {"velocity": (0, 3, 0)}}
    with pytest.raises(InfeasibleError, match="would do$") as refused:
        minsnap.plan([(0, 0, 0), (5, 0, 0)], **asked)
    assert refused.value.verify()


@pytest.mark.parametrize("pieces", [1, 3])
def test_a_total_of_a_single_leg_is_proved_too_short_for_limits(pieces):
    asked = {"waypoints": [(0, 0, 0), (5, 0, 0)], "limits": Limits(speed=6.0, acceleration=6.0), "pieces": pieces}
    with pytest.raises(InfeasibleError, match="cannot be kept in 1.6 s.* the shortest found is") as refused:
        minsnap.plan(total_time=1.6, **asked)
    assert refused.type is InfeasibleError and refused.value.verify()
    assert minsnap.plan(total_time=refused.value.shortest, **asked).duration > 1.8


def test_where_pieces_are_chosen_a_total_of_a_single_leg_is_proved_too_short_by_its_length():
    with pytest.raises(InfeasibleError, match=r"the lengths of the legs alone need 1\.8\d* s") as refused:
        minsnap.plan([(0, 0, 0), (5, 0, 0)], total_time=1.6, limits=Limits(speed=6.0, acceleration=6.0), pieces="auto")
    assert refused.value.verify()


@pytest.mark.parametrize("seed", range(4))
def test_a_width_named_where_pieces_are_chosen_is_that_of_the_pieces(seed):
    random = np.random.default_rng(seed)
    points, durations = 2.0 * random.normal(size=(4, 2)), np.exp(0.4 * random.normal(size=3))
    known = {"durations": durations, "continuity": 6, "pieces": "auto"}
    with pytest.raises(InfeasibleError, match="too narrow") as refused:
        minsnap.plan(points, corridor=1e-3, **known)
    least = refused.value.smallest_width
    assert least < 0.03 and minsnap.plan(points, corridor=1.001 * least, **known).pieces == 3
