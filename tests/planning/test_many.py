"""plan_many against plan, problem by problem; errors by problem; the same bits with any number of threads."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import minsnap
from minsnap.errors import CorridorError, InfeasibleError, InputError, IntervalError, TimingError, WaypointError
from minsnap.native import library, plan_batches
from minsnap.native.library import core
from minsnap.planning import problem_rows

NATIVE = library.core().library is not None


def questions(count, legs, dim=3, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, legs + 1, dim)), rng.uniform(0.7, 1.4, (count, legs))


def same(one, other, exactly=NATIVE):
    if exactly:
        return (one.control_points == other.control_points).all() and (one.breaks == other.breaks).all()
    return np.allclose(one.control_points, other.control_points, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
@pytest.mark.parametrize("dim", [1, 2, 3, 4])
def test_every_plan_is_the_one_that_plan_makes(degree, dim):
    points, durations = questions(9, 5, dim, degree)
    many = minsnap.plan_many(points, durations=durations, degree=degree)
    assert len(many) == 9 and many.errors == (None,) * 9 and (many.dim, many.degree) == (dim, degree)
    for curve, P, T in zip(many, points, durations, strict=True):
        assert same(curve, minsnap.plan(P, durations=T, degree=degree))
    assert many.stacked.shape == (9, 5, degree + 1, dim)
    assert np.allclose(many.duration, durations.sum(axis=1), rtol=1e-14)


def test_the_python_core_makes_the_same_plans():
    points, durations = questions(4, 6)
    native = minsnap.plan_many(points, durations=durations)
    with library.using("python"):
        python = minsnap.plan_many(points, durations=durations)
        t = np.linspace(0.0, durations.sum(axis=1).min(), 17)
        values = python(t, 1)
    assert all(same(one, other, False) for one, other in zip(native, python, strict=True))
    assert np.allclose(native(t, 1), values, rtol=1e-9, atol=1e-9)
    assert python[0].report.core == "python"


def test_problems_of_any_length_and_moving_ends():
    rng = np.random.default_rng(3)
    sizes = [2, 7, 3, 12, 2]
    points = [rng.normal(size=(n, 2)) for n in sizes]
    durations = [rng.uniform(0.5, 1.5, n - 1) for n in sizes]
    velocity = rng.normal(size=(5, 2))
    many = minsnap.plan_many(points, durations, start={"velocity": velocity}, end={"acceleration": (1.0, -1.0)})
    for index, curve in enumerate(many):
        alone = minsnap.plan(
            points[index], durations[index], start={"velocity": velocity[index]}, end={"acceleration": (1.0, -1.0)}
        )
        assert same(curve, alone, False)
        assert np.allclose(curve(0.0, 1), velocity[index], rtol=1e-12)
    with pytest.raises(InputError, match="different numbers of legs"):
        _ = many.stacked


def test_what_fails_is_an_error_of_its_problem_alone():
    points, durations = questions(6, 4)
    points[1, 2, 0] = np.nan
    durations[3, 0] = -1.0
    durations[4, 0] = 1e9  # too far from the others for the native core, not for the Python core
    many = minsnap.plan_many(points, durations=durations)
    assert isinstance(many.errors[1], WaypointError) and isinstance(many.errors[3], TimingError)
    assert [error is None for error in many.errors] == [True, False, True, False, True, True]
    with pytest.raises(WaypointError, match="waypoint 2"):
        many[1]
    for index in (0, 2, 4, 5):
        assert same(many[index], minsnap.plan(points[index], durations=durations[index]))
    assert many[4].report.core == "python"
    values = many(0.1)
    assert np.isnan(values[[1, 3]]).all() and (values[0] == many[0](0.1)).all()
    assert np.isnan(many.duration[[1, 3]]).all()


def test_malformed_problems_among_good_ones():
    good = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
    odd = [[0.0, 0.0]], [[0.0, 0.0], [1.0]], "nonsense", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    many = minsnap.plan_many([good, *odd, good], [[1.0, 1.0]] * 6)
    assert many.errors[0] is None and many.errors[5] is None
    assert all(isinstance(error, minsnap.MinsnapError) for error in many.errors[1:5])
    assert "coordinates" in str(many.errors[4])
    assert same(many[5], minsnap.plan(good, durations=[1.0, 1.0]))


def test_one_row_of_durations_serves_all():
    points, durations = questions(5, 3)
    many = minsnap.plan_many(points, durations[0])
    assert same(many[4], minsnap.plan(points[4], durations=durations[0]))


def test_corridors_for_all_or_for_each():
    points, durations = questions(3, 3)
    many = minsnap.plan_many(points, durations, corridor=0.3)
    widths = minsnap.plan_many(points, durations, corridor=[0.3, 0.2, 0.4])
    for index, width in enumerate((0.3, 0.2, 0.4)):
        assert minsnap.certify(many[index], waypoints=points[index], corridor=0.3).ok
        alone = minsnap.plan(points[index], durations=durations[index], corridor=width)
        assert widths[index].report.cost == pytest.approx(alone.report.cost, rel=1e-6)
    walls = [None, 0.3, minsnap.Room((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))]
    mixed = minsnap.plan_many(points, durations, corridor=walls)
    assert mixed.errors[:2] == (None, None) and isinstance(mixed.errors[2], (InfeasibleError, InputError))


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_the_number_of_threads_changes_no_bit(threads):
    points, durations = questions(1000, 7, seed=5)
    one = minsnap.plan_many(points, durations, threads=1)
    with ThreadPoolExecutor(8) as pool:
        calls = [pool.submit(minsnap.plan_many, points, durations, threads=threads) for _ in range(8)]
        results = [call.result() for call in calls]
    t = np.linspace(0.0, 4.0, 33)
    for many in results:
        assert many.control_points.tobytes() == one.control_points.tobytes()
        assert many(t, 2).tobytes() == one(t, 2).tobytes()


@pytest.mark.parametrize("threads", [1, 3])
def test_results_larger_than_the_caches_are_the_same(threads):
    rng = np.random.default_rng(4)
    sizes = [120, 3, *[11] * 4800, 90]
    points, durations = [rng.normal(size=(n, 3)) for n in sizes], [rng.uniform(0.7, 1.4, n - 1) for n in sizes]
    many = minsnap.plan_many(points, durations, threads=threads)
    assert many.control_points.nbytes > 8 << 20
    for part in (slice(0, 40), slice(4000, 4040), slice(4790, 4803)):
        few = minsnap.plan_many(points[part], durations[part], threads=1)
        assert all(same(many[index], few[i]) for i, index in enumerate(range(*part.indices(len(sizes)))))


def test_evaluation_takes_one_instant_shared_ones_or_each_plans_own():
    points, durations = questions(4, 3)
    many = minsnap.plan_many(points, durations)
    own = many.duration[:, None] * np.linspace(0.0, 1.0, 9)
    for order in (0, 2, 8):
        assert np.allclose(many(own, order), [curve(t, order) for curve, t in zip(many, own, strict=True)])
        assert np.allclose(many([0.5, 1.0], order), [curve([0.5, 1.0], order) for curve in many])
        assert many(0.5, order).shape == (4, 3)
    with pytest.raises(IntervalError, match=r"plan \d: t = 1000"):
        many(1000.0)
    with pytest.raises(InputError, match="instants have shape"):
        many(np.zeros((3, 2)))


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"durations": [[1.0]] * 3}, TimingError, "2 problems need as many rows of durations, not 3"),
        ({"durations": 1.0}, InputError, "durations are 1.0"),
        ({"corridor": [0.3]}, CorridorError, "2 problems need one corridor, or one for each, not 1"),
        ({"threads": 0}, InputError, "threads is 0"),
        ({"threads": True}, InputError, "threads is True"),
        ({"degree": 4}, InputError, "degree"),
        ({"start": {"colour": (1, 0, 0)}}, WaypointError, "colour"),
        ({"start": {"velocity": (1, 0)}}, WaypointError, "velocity of start must be numbers"),
        ({"end": 3}, WaypointError, "end must be a mapping"),
    ],
)
def test_unclear_problems_are_refused(arguments, error, said):
    points, durations = questions(2, 2)
    with pytest.raises(error, match=said):
        minsnap.plan_many(points, **({"durations": durations} | arguments))


def test_a_corridor_that_is_no_corridor_is_an_error_of_each_problem():
    points, durations = questions(2, 2)
    for corridor in ("ab", "wide", {0: 0.3}):
        errors = minsnap.plan_many(points, durations, corridor).errors
        assert all(str(error).startswith("the corridor half-width must be numbers [m], not") for error in errors)


def test_a_plan_that_is_not_there_is_named():
    many = minsnap.plan_many(*questions(2, 2))
    assert np.array_equal(many[-1].control_points, many[1].control_points)
    for index in (2, -3):
        with pytest.raises(IndexError, match=f"there is no plan {index}: 2 plans"):
            many[index]


def test_no_problem_at_all_is_no_plan():
    assert len(minsnap.plan_many([], [])) == 0


@pytest.mark.slow
@pytest.mark.skipif(not NATIVE, reason="there is no native core")
@pytest.mark.parametrize("threads", [1, 2, 8])
def test_tubes_are_solved_together_to_the_bytes_of_each_alone(threads):
    rng = np.random.default_rng(5)
    points, durations = np.cumsum(rng.normal(size=(30, 6, 3)), axis=1), rng.uniform(0.5, 2.0, (30, 5))
    widths = [0.2, *rng.uniform(0.05, 0.5, 28), rng.uniform(0.1, 0.3, 5)]
    points[7, 2] = points[7, 1]
    durations[11, 0] = -1.0
    widths[13] = 0.0
    many = minsnap.plan_many(points, durations, corridor=widths, threads=threads)
    assert [i for i, error in enumerate(many.errors) if error] == [11, 13]
    with pytest.raises(CorridorError):
        many[13]
    for index in set(range(30)) - {11, 13}:
        alone = minsnap.plan(points[index], durations[index], corridor=widths[index])
        assert many[index].control_points.tobytes() == alone.control_points.tobytes()
        ours, its = many[index].report, alone.report
        assert (ours.core, ours.rounds, ours.rows) == ("native", its.rounds, its.rows)
        assert ours.cost == pytest.approx(its.cost, rel=1e-12)
        assert ours.corridor_margin == its.corridor_margin >= 0.0
        assert minsnap.certify(many[index], points[index], corridor=widths[index]).ok


def test_tubes_of_all_kinds_are_those_of_plan():
    points, durations = questions(6, 4, seed=8)
    rows = [0.3, 0.2, minsnap.Tube(0.25), [0.2, 0.3, 0.25, 0.4], minsnap.Tube([0.2, 0.3, 0.25, 0.4]), -1.0]
    many = minsnap.plan_many(points, durations, corridor=rows)
    for index, row in enumerate(rows[:5]):
        alone = minsnap.plan(points[index], durations=durations[index], corridor=row)
        assert same(many[index], alone) and many[index].report.core == alone.report.core
        assert many[index].report.corridor_margin == pytest.approx(alone.report.corridor_margin, abs=1e-9)
    assert isinstance(many.errors[5], CorridorError) and many.errors[:5] == (None,) * 5


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_change_no_bit_of_tubes(threads):
    points, durations = questions(80, 5, seed=6)
    widths = np.random.default_rng(1).uniform(0.2, 0.5, 80)
    one = minsnap.plan_many(points, durations, corridor=widths, threads=1, gradients=True)
    many = minsnap.plan_many(points, durations, corridor=widths, threads=threads, gradients=True)
    assert many.control_points.tobytes() == one.control_points.tobytes()
    assert many.gradients.waypoints.tobytes() == one.gradients.waypoints.tobytes()
    assert minsnap.certify(many[7], points[7], float(widths[7])).ok


@pytest.mark.parametrize("corridor", [None, 0.3])
def test_arrays_of_the_caller_are_neither_locked_nor_kept(corridor):
    points, durations = questions(5, 4)
    many = minsnap.plan_many(points, durations, corridor=corridor)
    kept = minsnap.plan_many(points.copy(), durations.copy(), corridor=corridor)
    points[:], durations[:] = 100.0, 5.0
    for curve, other in zip(many, kept, strict=True):
        assert same(curve, other, True) and curve.report.corridor_margin == other.report.corridor_margin


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_limits_pins_and_totals_for_all_or_for_each():
    points, durations = questions(3, 3, seed=2)
    limits = [minsnap.Limits(speed=2.0), minsnap.Limits(speed=3.0), None]
    many = minsnap.plan_many(points, limits=limits)
    for index in range(2):
        assert same(many[index], minsnap.plan(points[index], limits=limits[index]), False)
        assert many[index].max_norm(1)[0] <= (2.0, 3.0)[index] * (1 + 1e-9)
    assert isinstance(many.errors[2], TimingError)
    pins = [{1: {"velocity": (0.0, 0.0, 0.0)}}, None, {2: {"velocity": (1.0, 0.0, 0.0)}}]
    pinned = minsnap.plan_many(points, durations, pins=pins)
    for index in range(3):
        assert same(pinned[index], minsnap.plan(points[index], durations=durations[index], pins=pins[index]), False)
    total = minsnap.plan_many(points, total_time=[5.0, 6.0, 7.0], start={"velocity": (0.1, 0.0, 0.0)})
    assert np.allclose(total.duration, [5.0, 6.0, 7.0]) and np.allclose(total(0.0, 1), (0.1, 0.0, 0.0))
    with pytest.raises(TimingError, match="3 problems need one total_time, or one for each, not 2"):
        minsnap.plan_many(points, total_time=[5.0, 6.0])


def test_costs_of_all_at_once():
    points, durations = questions(5, 4, seed=9)
    durations[3, 1] = np.nan
    many = minsnap.plan_many(points, durations)
    assert np.isnan(many.costs[3])
    for index in (0, 1, 2, 4):
        assert many.costs[index] == pytest.approx(many[index].cost(), rel=1e-13)


@pytest.mark.parametrize("corridor", [0.5, minsnap.RoundTube(0.5)])
def test_progress_counts_problems(corridor):
    points, durations = questions(30, 3, seed=2)
    told = []
    many = minsnap.plan_many(points, durations, corridor, progress=told.append)
    assert told[-1] == (30, 30) and told == sorted(set(told)) and many.errors == (None,) * 30


@pytest.mark.skipif(not NATIVE, reason="blocks are those of the native core")
def test_blocks_change_no_bit(monkeypatch):
    points = [np.random.default_rng(n).normal(size=(2 + n % 5, 3)) for n in range(40)]
    durations = [np.linspace(0.7, 1.3, len(rows) - 1) for rows in points]
    whole = minsnap.plan_many(points, durations, corridor=0.4, gradients=True)
    monkeypatch.setattr(plan_batches, "BLOCK", 7)
    told = []
    parts = minsnap.plan_many(points, durations, corridor=0.4, gradients=True, progress=told.append)
    assert told == [(7 * k, 40) for k in range(1, 6)] + [(40, 40)]
    assert (parts.control_points == whole.control_points).all() and (parts.breaks == whole.breaks).all()
    for name in ("durations", "waypoints", "corridor"):
        assert np.array_equal(getattr(parts.gradients, name), getattr(whole.gradients, name))


LIMITS = (
    minsnap.Limits(speed=2.0, acceleration=3.0),
    minsnap.Limits(speed=3.0, acceleration=4.0, jerk=30.0, snap=300.0),
    minsnap.Limits(acceleration=2.0, jerk=20.0),
    minsnap.Limits(speed=3.0, max_thrust=1.4, min_thrust=0.5, tilt=0.6, body_rate=3.0),
    minsnap.Limits(speed=4.0, tilt=0.5),
)


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
@pytest.mark.parametrize("corridor", [None, 0.3])
def test_plain_plans_within_limits_are_made_together_with_the_bits_of_plan(corridor, monkeypatch):
    rng = np.random.default_rng(11)
    points = [np.cumsum(rng.normal(size=(n, 3)), axis=0) for n in (2, 3, 5, 4, 3)]
    limits, told, alone = list(LIMITS), [], []
    own = problem_rows.plan
    monkeypatch.setattr(problem_rows, "plan", lambda *asked, **others: alone.append(asked) or own(*asked, **others))
    many = minsnap.plan_many(points, corridor=corridor, limits=limits, progress=told.append)
    assert many.errors == (None,) * 5 and told[-1] == (5, 5) and not alone
    for curve, place, limit in zip(many, points, limits, strict=True):
        other = minsnap.plan(place, corridor=corridor, limits=limit)
        assert same(curve, other) and curve.pieces == other.pieces
        assert curve.report.cost == other.report.cost and curve.report.notes == other.report.notes
    once = minsnap.plan_many(points, corridor=corridor, limits=limits, threads=1)
    assert (once.control_points == many.control_points).all()


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_what_is_not_plain_within_limits_is_planned_and_refused_by_itself():
    line, fast = [(0, 0, 1), (4, 1, 1.5), (7, -1, 2)], minsnap.Limits(speed=3.0, acceleration=4.0)
    asked = [line, [(0, 0, 1), (0, 0, 1)], [(0, 0, 1), (np.nan, 0, 1)], line, line]
    limits = [fast, fast, fast, minsnap.Limits(speed=3.0, yaw_rate=1.0), minsnap.Limits(max_thrust=1.5)]
    many = minsnap.plan_many(asked, limits=limits, corridor=[None, None, None, 0.5, minsnap.RoundTube(0.5)])
    assert [type(error) for error in many.errors] == [type(None), WaypointError, WaypointError, type(None), type(None)]
    for index, corridor in ((0, None), (3, 0.5), (4, minsnap.RoundTube(0.5))):
        assert same(many[index], minsnap.plan(line, corridor=corridor, limits=limits[index]))


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_plans_that_first_fly_back_within_their_limits_keep_their_legs():
    """Each polynomial counted as a leg: 16 for 4, and the waypoints of the plan were refused."""
    points = np.array([(0, 0, 1), (4, 1, 1), (8, 0, 1), (12, 1, 1), (15, 0, 1)], dtype=float)
    question = {"limits": minsnap.Limits(speed=2.0, acceleration=4.0), "start": {"velocity": (2.2, 0.0, 0.0)}}
    alone, many = minsnap.plan(points, **question), minsnap.plan_many([points, points[::-1]], **question)
    assert many[0].pieces == alone.pieces > 1 and np.array_equal(many[0].leg_breaks, alone.leg_breaks)
    assert minsnap.certify(many[0], points).waypoint_error < 1e-9


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_plans_have_the_pieces_that_are_asked_for():
    points = np.array([(0, 0, 1), (4, 1, 1), (8, 0, 1)], dtype=float)
    within = {"limits": minsnap.Limits(speed=2.0, acceleration=4.0)}
    many = minsnap.plan_many([points] * 4, pieces=[1, 3, "auto", None], **within)
    alone = [minsnap.plan(points, pieces=pieces, **within) for pieces in (1, 3, "auto", None)]
    assert [one.pieces for one in many] == [one.pieces for one in alone] and many.duration[2] < many.duration[0]
    assert many.duration.tolist() == [one.duration for one in alone]
    given = minsnap.plan_many([points] * 2, [[2.5, 2.5]] * 2, pieces=3)
    assert given[0].pieces == 3 and given.control_points.shape == (12, 8, 3)
    assert minsnap.plan_many([points], pieces="many", **within).errors[0].code == "degree"
