"""The joint search in the native core: its peaks and steps against those of the Python core."""

import dataclasses

import numpy as np
import pytest
from tasks import REFERENCE, random_legs

import minsnap
from minsnap.limits.limits import Limits
from minsnap.native.joint_steps import ConditionBlock, JointTerms, Pull
from minsnap.native.library import core, using
from minsnap.optimisation.problem import Task
from minsnap.time_allocation.initial_guess import guessed_lengths, stop_and_go, stop_and_go_times
from minsnap.time_allocation.joint_layout import JointState
from minsnap.time_allocation.joint_model import Caution, Penalties
from minsnap.time_allocation.joint_problem import JointProblem
from minsnap.time_allocation.native_steps import Tried, known_peaks
from minsnap.time_allocation.refinement import slowed
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.velocity_heading import VelocityHeading
from minsnap.vehicle import BodyDrag, Quadrotor

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

RACER = Quadrotor(0.85, (0.001, 0.001, 0.0017), 0.15, 1e-6, 5e-8, np.sqrt(6.879e6))
EVERYTHING = Limits.of(RACER, reserve=0.1, speed=12.0, acceleration=25.0, tilt=1.2, body_rate=15.0, min_thrust=0.3)

DRAG = BodyDrag((0.3, 0.3, 0.1), (0.02, 0.02, 0.05))
DRAGGED = Limits.of(
    dataclasses.replace(RACER, drag=DRAG),
    **{"reserve": 0.1, "speed": 12.0, "tilt": 1.2, "body_rate": 15.0, "min_thrust": 0.3, "yaw_rate": 2.0},
)


def search(limits=EVERYTHING, pieces=1, degree=7, closed=False, heading=None, dim=3):
    """Search on four random legs in a round tube, and a random state of it."""
    points = np.array(random_legs(4, 3)[0])[:, :dim]
    points[-1] = points[0] if closed else points[-1]
    half, zero = (degree + 1) // 2, np.zeros(points.shape)
    rest = {order: np.zeros(dim) for order in range(1, half)}
    pins = {} if closed else {0: rest, len(points) - 1: rest}
    walls = minsnap.RoundTube(0.4).walls(points)
    task = Task(points, -zero, zero, pins, half, half - 1, closed, pieces, walls, "auto")
    guess = stop_and_go_times(guessed_lengths(task), limits)
    found = JointProblem(task, limits, guess, heading).search(pieces)
    random = np.random.default_rng(3)
    durations = (
        np.repeat(guess, pieces) / pieces / found.layout.units.time * random.uniform(0.7, 1.2, found.layout.pieces)
    )
    state = stop_and_go(found.layout, durations)
    free = found.layout.problem.columns >= 0
    scaled = state.scaled + np.where(free, 0.05 * random.normal(size=state.scaled.shape), 0.0)
    return found, JointState(scaled, durations)


CASES = {
    "every limit": {},
    "three pieces": {"pieces": 3},
    "a constant yaw": {"heading": ConstantHeading(0.4)},
    "drag": {"limits": DRAGGED, "heading": VelocityHeading(minsnap.line(total_time=1.0))},
    "a point to look at": {
        "limits": Limits(speed=3.0, acceleration=6.0, yaw_rate=0.5),
        "heading": minsnap.LookAt((2.0, 7.0)).heading(minsnap.line(total_time=1.0)),
    },
    "a closed lap": {"closed": True, "limits": Limits(speed=3.0, acceleration=6.0, body_rate=4.0)},
    "degree 5": {"degree": 5, "limits": Limits(speed=3.0, acceleration=6.0)},
    "degree 9": {"degree": 9, "limits": Limits(speed=3.0, jerk=20.0, snap=90.0)},
    "a plane": {"dim": 2, "limits": Limits(speed=3.0, acceleration=6.0)},
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_cores_measure_the_same(case):
    found, state = search(**case)
    native = found.finder.measure(state)
    with using("python"):
        python = found.finder.measure(state)
    assert (native.limit, native.wall) == pytest.approx((python.limit, python.wall), rel=1e-9)
    assert native.worst == pytest.approx(python.worst, abs=1e-6)
    for ours, theirs in zip(native.peaks, python.peaks, strict=True):
        mine, others = np.lexsort((ours.s, ours.index)), np.lexsort((theirs.s, theirs.index))
        assert (ours.index[mine] == theirs.index[others]).all()
        assert ours.s[mine] == pytest.approx(theirs.s[others], abs=1e-7)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_cores_take_the_same_steps(case):
    """The second step depends on the multipliers of the first one, through the curvature, and is corrected by it."""
    steps = {}
    for name in ("native", "python"):
        found, state = search(**case)
        model, caution = found.model(state), Caution(1e-2, 0.2)
        with using(name):
            measured = found.finder.measure(state)
            tried = None
            for _ in range(2):
                step = model.step(state, measured.peaks, found.memory, caution, Penalties(), tried=tried)
                tried = Tried(step, found.layout.moved(state, step))
                found.memory = [[peaks] for peaks in measured.peaks]
        steps[name] = step
    size = np.abs(steps["python"]).max()
    assert steps["native"] == pytest.approx(steps["python"], abs=2e-3 * size)


@pytest.mark.parametrize("core_used", ["native", "python"])
def test_a_corrected_step_exceeds_limits_and_walls_less(core_used):
    found, state = search(**CASES["a closed lap"])
    state = slowed(found.run(state).state, 1.1)
    model, caution = found.model(state), Caution(1e-3, 0.3)
    excesses, tried = [], None
    with using(core_used):
        measured = found.finder.measure(state)
        for _ in range(2):
            step = model.step(state, measured.peaks, found.memory, caution, Penalties(), tried=tried)
            after = found.layout.moved(state, step)
            tried = Tried(step, after)
            excesses.append(max(found.evaluate(after).measured.limit, found.evaluate(after).measured.wall))
    assert excesses[0] > 1e-3
    assert excesses[1] < 0.5 * excesses[0]


def test_both_cores_find_the_same_time():
    options = {"limits": Limits(speed=3.0, acceleration=6.0), "corridor": 0.3}
    native = minsnap.plan(REFERENCE, **options).duration
    with using("python"):
        assert minsnap.plan(REFERENCE, **options).duration == pytest.approx(native, rel=2e-4)


def terms(kind=0, orders=(1, 1), size=4, piece=(0,), values=(0.0,) * 16):
    block = ConditionBlock(kind, orders, size, 0, 1.0, 0.3, np.array(piece), np.array(values))
    return JointTerms((1, 8, 3), [block], [np.zeros((8 - order, 8)) for order in range(5)])


@pytest.mark.parametrize(
    "changes",
    [{"kind": 9}, {"orders": (3, 2)}, {"orders": (1, 7)}, {"piece": (1,)}, {"values": (0.0,) * 3}, {"kind": 4}],
    ids=str,
)
def test_malformed_terms_are_refused(changes):
    assert terms(**changes).measure(np.zeros((1, 8, 3)), np.ones(1), 33) is None


def test_numbers_that_are_none_are_refused():
    assert terms().measure(np.zeros((1, 8, 3)), np.ones(1), 33) is not None
    assert terms().measure(np.full((1, 8, 3), np.nan), np.ones(1), 33) is None
    assert terms().measure(np.zeros((1, 8, 3)), np.zeros(1), 33) is None


def test_no_iteration_begins_once_the_time_is_over():
    found, state = search()
    measured, native = found.finder.measure(state), found.native
    known = known_peaks(measured.peaks, found.memory)
    lengths, terms = np.ones(found.layout.pieces), found.objective.terms(state)

    def step(seconds):
        pull = Pull(np.zeros((found.layout.pieces, 2 * found.layout.half, found.layout.dim)), np.zeros(len(lengths)))
        numbers = (1e-2, 0.2, 1.0, 0.6, 10.0, 10.0, 0.0, 0.0, 1e-6, seconds)
        return native.step(state, known, [], lengths, numbers, (terms.linear, terms.hessian), pull)

    assert step(np.inf) is not None
    assert step(0.0) is None
