"""What sentences of refusals name, and the evidence that their errors carry; test_refusals.py asks whole questions."""

import pytest

from minsnap.errors import InfeasibleError, LimitError, UnprovedError
from minsnap.refusals import sentences
from minsnap.trajectory.report import Utilisation


def used(name="speed"):
    return Utilisation(name, value=3.0, limit=2.0, fraction=1.5, leg=1, instant=0.5)


@pytest.mark.parametrize(("waypoint", "said"), [(0, "leg 0, or slow down first"), (3, "leg 2, or end more slowly")])
def test_a_state_that_no_way_leads_from_or_to_names_the_leg_beside_it(waypoint, said):
    error = sentences.no_connector(waypoint, used())
    assert isinstance(error, LimitError) and str(error).endswith(said) and "speed 3 where 2 is allowed" in str(error)
    assert (error.waypoint, error.smallest) == (waypoint, 3.0)


@pytest.mark.parametrize(("name", "change"), [("speed", "raise"), ("min_thrust", "lower")])
def test_a_pinned_state_says_to_which_side_its_limit_is_changed(name, change):
    error = sentences.pinned_beyond(2, used(name), 3.1, True)
    assert f"waypoint 2 has {name} 3, at its limit 2: {change} the limit to at" in str(error)
    assert error.smallest == 3.1


def test_a_plan_of_least_cost_names_the_time_that_would_do_where_a_factor_is_known():
    error = sentences.exceeded_at_least_cost(4.0, used(), True, 1.5)
    assert str(error).endswith("reaches 3 on leg 1 at 0.5 s with the vehicle's drag; 6 s would do in these proportions")
    assert (error.shortest, error.stretch, error.leg) == (6.0, 1.5, 1)
    unknown = sentences.exceeded_at_least_cost(4.0, used(), False, None)
    assert str(unknown).endswith("on leg 1 at 0.5 s; give more time") and unknown.shortest is None


def test_a_refusal_without_its_proof_keeps_the_rest():
    proved = InfeasibleError("too narrow", leg=2, instant=0.7, smallest_width=0.1, contradiction=object())
    error = sentences.unproved(proved)
    assert type(error) is UnprovedError and error.contradiction is None
    assert (str(error), error.leg, error.instant, error.smallest_width) == ("too narrow", 2, 0.7, 0.1)
    assert sentences.unproved(error) is error
