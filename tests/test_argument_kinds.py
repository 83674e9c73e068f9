"""Arguments of a kind that makes no sense: each is one sentence on one line, whatever arrives."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, MinsnapError
from minsnap.planning.request import plan_arguments
from minsnap.vehicle import BodyDrag, Quadrotor

P = [(0, 0, 1), (4, 0, 1), (4, 3, 1.5)]
LARGE = 10**400
TABLE = np.full((3, 3), np.nan)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("time_weight", LARGE, "time_weight is 10{50}"),
        ("time_weight", np.complex128(1.0), "time_weight is"),
        ("total_time", TABLE, "total_time is array"),
        ("durations", [LARGE, 1], "durations must be numbers"),
        ("corridor", LARGE, "the corridor half-width must be numbers"),
        ("solver", [1, 2], "solver is .*: it is a word"),
        ("solver", np.zeros(0), "solver is .*: it is a word"),
        ("split", TABLE, "split is .*: it is a word"),
        ("on_interrupt", TABLE, "on_interrupt is .*: it is a word"),
        ("closed", np.zeros(0), "closed is .*: it is True or False"),
        ("closed", 1, "closed is 1: it is True or False"),
        ("pins", [1, 2], "pins must be a mapping"),
        ("pins", TABLE, "pins must be a mapping"),
    ],
    ids=lambda value: str(value).split("\n")[0][:30],
)
def test_an_argument_of_plan_of_another_kind(name, value, said):
    searched = name == "on_interrupt"
    timed = {"limits": minsnap.Limits(speed=2.0)} if searched else {"durations": [2, 2]}
    free = {} if name in ("time_weight", "total_time") else timed
    with pytest.raises(InputError, match=said) as refused:
        minsnap.plan(P, **plan_arguments(free | {name: value}))
    assert "\n" not in str(refused.value) and len(str(refused.value)) <= 1000


@pytest.mark.parametrize(
    "make",
    [
        lambda: minsnap.Limits(speed=1.0, norm=TABLE),
        lambda: minsnap.Limits(speed=LARGE),
        lambda: minsnap.RoundTube(LARGE),
        lambda: minsnap.Samples(LARGE, [0.0]),
        lambda: minsnap.Trajectory("", [1.0]),
        lambda: minsnap.corridor_from_grid([[1, 2], [3]], 0.1, [(0, 0)]),
        lambda: minsnap.rectangle(altitude=TABLE),
        lambda: minsnap.plan(P, [2, 2], corridor=minsnap.Tube),
        lambda: minsnap.certify(minsnap.plan(P, [2, 2]), corridor=[0.3, minsnap.Room]),
        lambda: minsnap.plan_fleet([P], minsnap.Limits(speed=1.0), minsnap.Separation(0.3), room=minsnap.Room),
        lambda: minsnap.plan(P, [2, 2], avoid=minsnap.Cylinder),
        lambda: minsnap.Limits.of(Quadrotor),
        lambda: Quadrotor(1.0, (1.0, 1.0, 1.0), 0.2, 1e-6, 1e-8, 1e3, drag=BodyDrag),
    ],
)
def test_a_value_of_another_kind(make):
    with pytest.raises(MinsnapError) as refused:
        make()
    assert "\n" not in str(refused.value)


def test_a_long_message_is_shortened_in_the_middle():
    error = MinsnapError("it begins " + "x" * 5000 + "\n   and ends")
    assert len(str(error)) <= 1000 and str(error).startswith("it begins x") and str(error).endswith("x and ends")
