"""Why limits cannot be kept in given durations: the stretch of time that would do."""

import numpy as np
import pytest
from tasks import REFERENCE

import minsnap
from minsnap.errors import InfeasibleError, UnprovedError
from minsnap.limits.limits import Limits
from minsnap.refusals.contradiction import Contradiction

TIMES = np.array([4.0, 2.0, 4.0, 2.0])


def refusal(*given, **options):
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(*given, **options)
    return refused.value


def fits(*given, **options):
    try:
        minsnap.plan(*given, **options)
    except InfeasibleError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("limits", [Limits(speed=1.0), Limits(speed=2.5), Limits(acceleration=2.0), Limits(tilt=0.15)])
@pytest.mark.parametrize("corridor", [None, 0.3])
def test_stretch_of_time_said_would_do_and_little_less_would_not(limits, corridor):
    refused = refusal(REFERENCE, TIMES / 2.0, corridor=corridor, limits=limits)
    times = TIMES / 2.0 * refused.stretch
    longest = 1.0 if len(limits.given()) == 1 else 1.02
    assert fits(REFERENCE, times * 1.02 * longest, corridor=corridor, limits=limits)
    assert not fits(REFERENCE, times * 0.9, corridor=corridor, limits=limits)


def test_a_stretch_does_and_a_little_less_does_not():
    durations, within = np.array([1.0, 0.8]), {"corridor": 0.2, "limits": Limits(speed=2.0, acceleration=3.0)}
    points = [(0, 0, 1), (4, 0, 1), (4, 3, 1)]
    stretch = refusal(points, durations=durations, **within).stretch
    assert fits(points, durations=1.001 * stretch * durations, **within)
    assert not fits(points, durations=0.97 * stretch * durations, **within)


def test_a_proof_is_kept_where_the_work_is_spent_after_it(monkeypatch):
    """A wall of the least thrust is sufficient only: a proof in which it has no part is not sought again."""

    def refined(proof, find=Contradiction.refined):
        found = find(proof)
        proof.task.deadline.spend(0.0 if found is None else np.inf)
        return found

    monkeypatch.setattr(Contradiction, "refined", refined)
    assert refusal([(0, 0, 0), (8, 0, 0)], [2.0], limits=Limits(speed=2.5, min_thrust=0.1)).verify()
    sufficient = refusal([(0, 0, 3), (1, 0, 0)], [0.7], limits=Limits(speed=50.0, min_thrust=0.5))
    assert isinstance(sufficient, UnprovedError)


def test_durations_within_limits_that_leave_time_are_planned():
    limits = Limits(speed=3.0, acceleration=6.0)
    path = minsnap.plan(REFERENCE, [4.2, 1.8, 3.2, 2.4], corridor=0.3, limits=limits)
    assert minsnap.certify(path, REFERENCE, corridor=0.3, limits=limits).ok
    free = minsnap.plan(REFERENCE, [4.2, 1.8, 3.2, 2.4], corridor=0.3)
    assert max(u.fraction for u in limits.utilisation(free)) > 1.0, "the limits bind"
    assert path.cost() > free.cost()


@pytest.mark.slow
def test_no_factor_is_named_where_no_longer_time_was_found():
    """What is refused is the part after a way back to the limits, in the time that is left of those asked for."""
    points = [(0, 0, 1), (4, 0, 1), (4, 3, 1.5)]
    refused = refusal(points, [3.0, 3.0], limits=Limits(speed=3.0), start={"velocity": (5.0, 0.0, 0.0)})
    assert not refused.verify() and refused.stretch is None
    assert "they are exceeded on leg 0" in str(refused) and "times as long" not in str(refused)
