"""Why nothing fits: the smallest width that would do, against what can be planned."""

import re

import numpy as np
import pytest
from random_plans import question
from tasks import REFERENCE, random_legs

import minsnap
from minsnap.cli.app import exit_status
from minsnap.errors import InfeasibleError, SolverError
from minsnap.native.corridor import Give
from minsnap.native.library import using
from minsnap.optimisation.least_slacks import native_slacks
from minsnap.optimisation.task_walls import all_walls
from minsnap.planning.planner import task_of
from minsnap.planning.request import PlanRequest
from minsnap.refusals.contradiction import find_contradiction

TIMES = np.array([4.0, 2.0, 4.0, 2.0])


def refusal(*given, **options):
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(*given, **options)
    assert exit_status(refused.value) == 1
    return refused.value


def fits(*given, **options):
    try:
        minsnap.plan(*given, **options)
    except (InfeasibleError, SolverError):  # within rounding of the least width there is neither a plan nor a proof
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("continuity", [4, 5])
def test_smallest_width_would_do_and_little_less_would_not(continuity):
    least = refusal(REFERENCE, TIMES, corridor=1e-3, continuity=continuity).smallest_width
    assert fits(REFERENCE, TIMES, corridor=least, continuity=continuity)
    assert not fits(REFERENCE, TIMES, corridor=0.998 * least, continuity=continuity)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_widths_said_for_legs_that_differ_would_do(seed):
    points, durations = random_legs(seed, 4)
    widths = 1e-3 * np.array([1.0, 2.0, 1.0, 2.0])
    refused = refusal(points, durations, corridor=widths, continuity=5)
    named = {refused.leg: refused.smallest_width}
    named |= {int(leg): float(width) for width, leg in re.findall(r"([\d.e-]+) m on leg (\d)", str(refused))}
    wider = np.array([max(width, named.get(leg, 0.0)) for leg, width in enumerate(widths)])
    assert fits(points, durations, corridor=wider * (1.0 + 1e-4), continuity=5)


@pytest.mark.parametrize("core", ["auto", "python"])
def test_gates_that_stand_do_not_hide_which_wall_is_too_near(core):
    """Rows of gates press too, and with any sign; leg 0 alone has walls that give way."""
    points = np.array([[-0.2, 0.5, 0.6], [0.3, -0.2, 0.9], [0.4, 1.0, 0.1], [1.4, 1.4, 0.2], [3.3, 2.3, -0.3]])
    normals = [[-0.48, 1.72, 0.81], [-2.41, -0.15, -0.69], [-0.13, 0.19, 0.05]]
    gates = [minsnap.Gate(point, normal, 0.004) for point, normal in zip(points[1:4], normals, strict=True)]
    asked = {"durations": [1.4, 1.0, 0.9, 0.5], "continuity": 6}
    sides = points[:, 1].max() + 0.01, 0.01 - points[:, 1].min()
    with using(core):
        along = minsnap.HalfSpaces([[0, 1, 0], [0, -1, 0]], sides, legs=[0])
        refused = refusal([points[0], *gates, points[4]], **asked, corridor=along)
        assert refused.leg == 0 and refused.instant == pytest.approx(1.137, abs=1e-3) and refused.verify()
        refused = refusal([points[0], *gates, points[4]], **asked, corridor=minsnap.Tube(0.01))
        assert refused.leg == 1 and refused.instant == pytest.approx(1.95, abs=1e-2) and refused.verify()


def test_the_sentence_says_where_when_and_what_to_do():
    refused = refusal(REFERENCE, TIMES, corridor=0.02, continuity=4)
    assert re.search(rf"leg {refused.leg}.* too narrow at .* s; a half-width of .* m .*would do", str(refused))
    assert "continuity=3 fits any width" in str(refused)
    breaks = np.concatenate(([0.0], np.cumsum(TIMES)))
    assert breaks[refused.leg] <= refused.instant <= breaks[refused.leg + 1]


@pytest.mark.parametrize("speed", [0.05, 3.0])
def test_smallest_radius_where_nothing_is_free_is_that_of_samples(speed):
    asked = {"start": {"velocity": (0.0, speed, 0.0)}}
    points, durations = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)], [2.0]
    refused = refusal(points, durations, corridor=minsnap.RoundTube(0.01), **asked)
    free = minsnap.plan(points, durations, **asked)
    reach = np.linalg.norm(free(np.linspace(0.0, 2.0, 20_001))[:, 1:], axis=1).max()
    assert refused.smallest_width == pytest.approx(reach, rel=3e-4)
    assert fits(points, durations, corridor=minsnap.RoundTube(refused.smallest_width), **asked)
    assert not fits(points, durations, corridor=minsnap.RoundTube(0.99 * reach), **asked)


@pytest.mark.slow
@pytest.mark.parametrize("chosen", ["auto", "python"])
def test_the_radius_named_where_much_is_free_would_do_and_little_less_would_not(chosen):
    points, durations = [(0, 0, 0), (5, 0, 0), (5, 4, 0)], [2.0, 2.0]
    asked = {"start": {"velocity": (0.0, 2.0, 0.0)}, "pieces": 2}
    with using(chosen):
        least = refusal(points, durations, corridor=minsnap.RoundTube(0.2), **asked).smallest_width
        assert fits(points, durations, corridor=minsnap.RoundTube(least), **asked)
        assert not fits(points, durations, corridor=minsnap.RoundTube(0.998 * least), **asked)


def test_pins_that_leave_nothing_free_to_join_a_derivative_are_refused():
    with pytest.raises(InfeasibleError, match="pins and continuity ask for more.*continuity=2"):
        minsnap.plan(
            [(0, 0, 0), (2, 1, 0), (4, 0, 0)],
            [1.5, 0.9],
            degree=3,
            continuity=2,
            pins={1: {"velocity": (1, 1, 0)}},
        )


@pytest.mark.slow
def test_a_width_that_only_giant_curves_keep_is_named_as_enough_only_if_it_is():
    """Control points a billion legs away: solvers find curves only in wider tubes than the least."""
    asked = question("round tubes", 62501)[1]
    with using("auto") as core:
        if core.library is None:
            pytest.skip("the Python core finds other curves")
        refused = refusal(**asked)
        if refused.smallest_width is None:
            assert "would do" not in str(refused) and "the others may need more" in str(refused)
        else:
            assert fits(**asked | {"corridor": minsnap.RoundTube(refused.smallest_width)})


def test_a_width_is_named_as_one_that_does_only_where_it_does_with_all_that_is_asked():
    """Limits need more room than the tube alone: the width that the tube needs has no plan in these times."""
    points, times = [(0, 0, 0), (4, 0, 0), (4, 4, 0)], [1.6, 1.6]
    asked = {"corridor": 1e-3, "continuity": 5, "limits": minsnap.Limits(acceleration=9.0)}
    refused = refusal(points, times, **asked)
    if refused.smallest_width is None:
        assert "would do" not in str(refused) and "the others may need more" in str(refused)
    else:
        assert fits(points, times, **asked | {"corridor": refused.smallest_width})
    alone = refusal(points, times, corridor=1e-3, continuity=5)
    assert fits(points, times, corridor=alone.smallest_width, continuity=5)
    assert not fits(points, times, **asked | {"corridor": alone.smallest_width})


def test_walls_that_must_give_way_are_proved_so_for_less_work_than_their_least_slack():
    points = np.array([(0, 0, 1), (4, 0, 1), (4, 3, 1)], float)
    asked = PlanRequest(waypoints=points, corridor=0.2)
    task = task_of(asked).with_walls(minsnap.Limits(speed=2.0, acceleration=3.0).walls(points))
    durations, walls = np.array([1.0, 0.8]), all_walls(task)
    give = Give(np.where(walls.order > 0, 0, -1), walls.order.astype(float), 1)
    if native_slacks(task, durations, give) is None:
        pytest.skip("there is no native core")
    whole, sign = (native_slacks(task, durations, give, sign=sign) for sign in (False, True))
    assert sign.work < 0.5 * whole.work
    assert 0.5 * whole.slacks[0] < sign.slacks[0] <= (1.0 + 1e-6) * whole.slacks[0]
    assert find_contradiction(task, durations, walls, sign).verify()
