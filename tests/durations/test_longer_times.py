"""Where a plan chooses its times, longer ones are tried before it is refused; what a refusal names was tried."""

from types import SimpleNamespace

import numpy as np
import pytest

import minsnap
from minsnap import HalfSpaces, InfeasibleError, Limits, UnprovedError
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.durations.longer_times import LONGER, least_longer
from minsnap.planning.request import plan_arguments

SLOW = HalfSpaces((1, 0, 0), 0.9, order=1)
TWO = [(0, 0, 0), (5, 1, 0)]

CURLED = [
    (-0.4355543021500487, 0.028720626919515397),
    (0.5094364211922586, 0.2654686664235477),
    (-3.573172917176441, -1.4337024105779688),
    (-1.9983674816247048, -2.1881263414074494),
    (-1.6383762643948165, -1.661413793746516),
]


@pytest.mark.parametrize(
    "chosen", [{"limits": Limits(speed=3)}, {"limits": Limits(speed=3), "split": "distance"}, {"time_weight": 9.0}]
)
def test_times_that_a_plan_chooses_keep_a_wall_on_the_velocity(chosen):
    path = minsnap.plan(TWO, corridor=SLOW, **plan_arguments(chosen))
    assert minsnap.certify(path, TWO, SLOW, chosen.get("limits")).ok
    assert path.duration <= 1.01 * 35.0 / 16.0 * 5.0 / 0.9


def test_a_start_that_leads_past_the_goal_comes_back():
    """2.9 m/s cannot end within half a metre under 6 m/s^2."""
    limits, points = Limits(speed=3.0, acceleration=6.0), [(0, 0, 0), (0.5, 0, 0)]
    path = minsnap.plan(points, limits=limits, start={"velocity": (2.9, 0, 0)})
    assert minsnap.certify(path, points, limits=limits).ok and path(0.0, 1) == pytest.approx([2.9, 0, 0])
    assert path.extent((1, 0, 0))[1] > 2.9**2 / 12.0


def test_a_factor_on_times_that_is_named_has_a_plan():
    asked = {"corridor": SLOW, "limits": Limits(speed=3)}
    with pytest.raises(InfeasibleError, match="times as long would do in these proportions") as refused:
        minsnap.plan(TWO, durations=[6.0], **asked)
    assert minsnap.certify(minsnap.plan(TWO, durations=[6.0 * refused.value.stretch], **asked), TWO, SLOW).ok
    assert refused.value.verify() and f"{refused.value.stretch:.4g} times" in str(refused.value)


def test_a_total_that_is_too_short_is_refused_with_the_shortest_one_found():
    asked = {"corridor": SLOW, "limits": Limits(speed=3)}
    with pytest.raises(InfeasibleError, match=r"the shortest found is 12\.15\d* s") as refused:
        minsnap.plan(TWO, total_time=6.0, **asked)
    assert refused.value.verify()
    assert minsnap.certify(minsnap.plan(TWO, total_time=refused.value.shortest, **asked), TWO, SLOW).ok


@pytest.mark.parametrize("asked", [{"durations": [1.6148001944098884]}, {"total_time": 1.6148001944098884}], ids=str)
def test_a_refusal_speaks_of_the_times_of_the_request_and_names_a_factor_only_where_one_was_found(asked):
    """The way back from a start beyond its limits takes a part of them; what is searched then is the rest."""
    points = [(1.4486647217808546, 1.7472524892620327), (0.4054230280001305, 4.511673295865986)]
    asked |= {
        "corridor": 0.06821868286297694,
        "pieces": 3,
        "start": {"velocity": (1.560173174788416, -6.252084091187593)},
    }
    limits = Limits(speed=5.081607977133792, acceleration=3.281004367161573, norm="axis")
    with pytest.raises(UnprovedError) as refused:
        minsnap.plan(points, limits=limits, **asked)
    assert getattr(refused.value, "stretch", None) is None and "would do" not in str(refused.value)
    assert str(refused.value).startswith("of 1.6148 s the ways")


def test_a_plan_that_was_found_is_not_shortened_after_the_time_limit():
    """Twice the durations have a plan; before the limit the least factor is looked for as well."""
    tried = []

    def attempt(durations):
        tried.append(float(durations[0]))
        return SimpleNamespace(trajectory=SimpleNamespace(duration=tried[-1])) if tried[-1] >= 2.0 else None

    shortest = least_longer(attempt, np.ones(1), NEVER).trajectory.duration
    assert 2.0 <= shortest <= 2.02
    unlimited = len(tried)
    tried.clear()
    assert least_longer(attempt, np.ones(1), Deadline(0.0)).trajectory.duration == tried[-1] == 2.5
    assert len(tried) < min(unlimited, len(LONGER))
