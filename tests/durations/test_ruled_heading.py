"""The heading that a search makes of its curve by a rule is the one that the curve is flown with."""

import numpy as np
import pytest
from tasks import random_legs, task_of

import minsnap
from minsnap import Limits, LookAt, Velocity
from minsnap.durations.shortest_question import begun_from, guess_of, question_of
from minsnap.native.library import core
from minsnap.native.shortest_time import InstantKind, Watch, search_shortest
from minsnap.vehicle import Quadrotor, flatness_of

pytestmark = pytest.mark.skipif(core().name != "native", reason="needs the native core")

LIMITS = Limits.of(Quadrotor.dji_f330())
RULES = {
    "velocity": Velocity(),
    "held longer": Velocity(hold_below=1.0, yaw_rate=1.0),
    "turned at the start": Velocity(yaw_at_start=2.0),
    "towards a point": LookAt((0.7, -0.4)),
}


def measured(path, most, least):
    """Return the largest excess of a rotor's thrust over its limits at many instants, in shares of the largest one."""
    states = flatness_of(LIMITS.vehicle, path, np.linspace(0.0, path.duration, 40_001))
    thrusts = LIMITS.vehicle.thrusts(states.rotor_speed)
    return float(max(thrusts.max() - most, least - thrusts.min()) / most)


@pytest.mark.parametrize(
    ("rule", "seed"),
    [("velocity", seed) for seed in (0, 1, 3, 4, 7)]
    + [("held longer", seed) for seed in (1, 2, 3, 4, 7)]
    + [("turned at the start", seed) for seed in (0, 1, 6, 7)]
    + [("towards a point", seed) for seed in (3, 4)],
)
def test_a_search_knows_the_heading_of_its_curve(rule, seed):
    """It begins from a plan, slowed until rotors are inside their limits, and is ended before its first step."""
    points, durations = random_legs(seed)
    path = minsnap.plan(3.0 * points, durations=1.2 * durations, yaw=RULES[rule])
    task = task_of(3.0 * points)
    question = begun_from(question_of(task, LIMITS, False, path), guess_of(path, task))
    curve = search_shortest(question, Watch(lambda *_: True, live=True))
    least, most = next(one.parameters[8:10] for one in question.limits if one.kind is InstantKind.TURNING_ROTORS)
    flown = path.stretched(curve.durations.sum() / path.duration)
    flown = flown.with_yaw(RULES[rule].heading(flown))
    assert -curve.slack == pytest.approx(measured(flown, most, least), abs=1e-3)
