"""Files that are fit to fly pass whatever their rate and rounding; every kind of defect is seen and named."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import minsnap
from minsnap.files.consistency import check_samples
from minsnap.trajectory.samples import Samples


def helix(rate=20.0, radius=3.0, omega=1.05, duration=12.0, decimals=None):
    """A climbing circle that turns its nose: exact derivatives."""
    t = np.arange(round(duration * rate) + 1) / rate
    c, s = radius * np.cos(omega * t), radius * np.sin(omega * t)
    up = 1 + 0.2 * t
    position = np.stack([c, s, up], 1)
    velocity = np.stack([-omega * s, omega * c, np.full_like(t, 0.2)], 1)
    acceleration = np.stack([-(omega**2) * c, -(omega**2) * s, np.zeros_like(t)], 1)
    samples = Samples(t, position, velocity, acceleration, yaw=omega * t, yaw_rate=np.full_like(t, omega))
    return samples if decimals is None else rounded(samples, decimals)


def rounded(samples, decimals):
    names = ("position", "velocity", "acceleration", "yaw", "yaw_rate")
    return replace(samples, **{name: getattr(samples, name).round(decimals) for name in names})


def spoiled(name, change, samples=None):
    samples = samples or helix()
    values = np.array(getattr(samples, name))
    change(values)
    return replace(samples, **{name: values})


@pytest.mark.slow
@given(rate=st.sampled_from([10.0, 20.0, 33.0, 50.0, 100.0]), radius=st.floats(0.1, 50), omega=st.floats(0.05, 3))
def test_exact_derivatives_pass_at_every_rate(rate, radius, omega):
    assert check_samples(helix(rate, radius, omega)).problems == ()


def test_a_plan_whose_acceleration_turns_within_a_step_passes():
    limits = minsnap.Limits(speed=3.0, acceleration=30.0)
    plan = minsnap.rectangle(0.5, 4.0, laps=2, limits=limits, pieces="auto")
    assert check_samples(plan.sample(20.0)).problems == ()


@pytest.mark.parametrize("decimals", [3, 4, 6])
def test_rounding_to_millimetres_passes(decimals):
    assert check_samples(helix(decimals=decimals)).ok


@pytest.mark.parametrize("rate", [True, False])
def test_a_yaw_that_is_wrapped_is_seen(rate):
    turning = helix() if rate else replace(helix(), yaw_rate=None)
    assert check_samples(turning).ok
    wrapped = replace(turning, yaw=(turning.yaw + np.pi) % (2.0 * np.pi) - np.pi)
    problem = check_samples(wrapped).problems[0]
    assert "yaw jumps from 3.098 to -3.133 rad at t = 2.95 s" in problem and "unwrap it" in problem


def test_a_yaw_in_degrees_is_consistent_but_noted():
    """Yaw and its rate in degrees agree with each other, and passed without a word, as plan does not let them."""
    turning = helix(duration=6.0)
    assert check_samples(turning).notes == ()
    report = check_samples(replace(turning, yaw=np.degrees(turning.yaw), yaw_rate=np.degrees(turning.yaw_rate)))
    assert report.ok and report.notes == ("yaw goes to 360.963 rad, 57 turns: if it is degrees, give radians",)


def test_figures_of_a_helix():
    report = check_samples(helix())
    x, _, z, yaw = report.axes
    assert (report.rows, report.duration, report.rate) == (241, 12.0, 20.0)
    assert (x.name, z.name, yaw.name) == ("x", "z", "yaw")
    assert x.highest == 3.0 and x.hardest == pytest.approx(3 * 1.05**2)
    assert x.fastest == pytest.approx(3.15, rel=1e-3)
    assert (z.lowest, z.highest, z.fastest) == (1.0, pytest.approx(3.4), pytest.approx(0.2))
    assert yaw.fastest == 1.05 and yaw.hardest is None
    assert x.velocity_mismatch == x.acceleration_mismatch == 0.0
    chord = 2 * 3 * np.sin(1.05 * 0.05 / 2)
    assert report.largest_jump == pytest.approx(np.hypot(chord, 0.01))
    assert (report.starts_at_rest, report.ends_at_rest) == (False, False)


DEFECTS = {
    "velocity in km/h": ("velocity", lambda v: v.__imul__(3.6), "x and vx disagree"),
    "velocity 3 % high": ("velocity", lambda v: v.__imul__(1.03), "x and vx disagree"),
    "velocity of another axis": ("velocity", lambda v: v.__setitem__((slice(None), [0, 1]), v[:, [1, 0]]), "x and vx"),
    "velocity negated": ("velocity", lambda v: v.__setitem__((slice(None), 2), -v[:, 2]), "z and vz"),
    "velocity late": ("velocity", lambda v: v.__setitem__(slice(10, None), v[:-10].copy()), "x and vx"),
    "acceleration without sign": ("acceleration", lambda a: np.abs(a, out=a), "vx and ax"),
    "acceleration with gravity": ("acceleration", lambda a: a.__setitem__((slice(None), 2), 9.81), "vz and az"),
    "one wrong position": ("position", lambda p: p.__setitem__((100, 1), p[100, 1] + 0.5), "y and vy disagree at t = "),
    "one wrong acceleration": ("acceleration", lambda a: a.__setitem__((100, 1), -9.0), "ay is -9 at t = 5 s"),
    "position frozen": ("position", lambda p: p.__setitem__(slice(100, 110), p[100]), "disagree"),
    "yaw wrapped": ("yaw", lambda y: np.copyto(y, np.mod(y, 2 * np.pi)), "yaw and yaw_rate disagree at t = 5.95"),
    "not a number": ("velocity", lambda v: v.__setitem__((7, 1), np.nan), "vy is nan in sample 7"),
    "infinite": ("position", lambda p: p.__setitem__((3, 2), np.inf), "z is inf in sample 3"),
    "a step missing": ("t", lambda t: t.__setitem__(slice(50, None), t[50:] + 0.05), "rate is not uniform"),
    "time backwards": ("t", lambda t: t.__setitem__(5, 0.1), "time goes from 0.2 s to 0.1 s at sample 5"),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_every_defect_is_seen_and_named(defect):
    name, change, said = DEFECTS[defect]
    report = check_samples(spoiled(name, change))
    assert not report.ok
    assert any(said in problem for problem in report.problems), report.problems


def test_the_size_of_a_mismatch_is_told():
    report = check_samples(spoiled("velocity", lambda v: v.__setitem__((slice(None), 2), 0.5)))
    assert report.axes[2].velocity_mismatch == pytest.approx(0.3 - 1e-3 / 0.05)


def test_positions_alone_are_searched_for_jumps():
    bare = Samples(helix().t, helix().position)
    assert check_samples(bare).ok
    leap = spoiled("position", lambda p: p.__setitem__((100, 0), p[100, 0] + 1.0), bare)
    assert "the position jumps at t = 5" in check_samples(leap).problems[0]
    assert check_samples(bare).axes[0].velocity_mismatch is None


def test_a_file_may_end_on_its_paths_last_state_before_the_step_is_over():
    samples = helix()
    late = np.append(samples.t, samples.t[-1] + 0.05)
    t = np.minimum(late, 12.02)
    c, s = 3 * np.cos(1.05 * t), 3 * np.sin(1.05 * t)
    still = np.zeros_like(t)
    position, velocity = np.stack([c, s, still], 1), 1.05 * np.stack([-s, c, still], 1)
    assert check_samples(Samples(late, position, velocity, -(1.05**2) * position)).ok


def test_constant_velocity_passes_and_rest_is_seen():
    t = np.arange(120) / 20
    steady = Samples(t, np.outer(t, [1.2, 0, 0]), np.tile([1.2, 0, 0], (120, 1)), np.zeros((120, 3)))
    assert check_samples(steady).ok
    still = Samples(t, np.ones((120, 3)), np.zeros((120, 3)))
    assert (check_samples(still).starts_at_rest, check_samples(still).ends_at_rest) == (True, True)


def test_a_lone_sample_is_no_path():
    assert "only one sample" in check_samples(Samples(np.zeros(1), np.zeros((1, 3)))).problems[0]


def test_planar_files_are_checked_too():
    samples = helix()
    flat = Samples(samples.t, samples.position[:, :2], samples.velocity[:, :2])
    assert check_samples(flat).ok
    assert [axis.name for axis in check_samples(flat).axes] == ["x", "y"]


@pytest.mark.parametrize("apart", [0.0, 0.25])
def test_instants_that_do_not_go_on_are_a_problem_of_their_own(apart):
    """Joins of segments are twice in many files: the other samples are judged as they are."""
    path = helix()
    rows = np.concatenate([np.arange(60), [59, 58], np.arange(60, len(path))])
    joined = path[rows]
    place = np.array(joined.position)
    place[60, 2] += apart
    report = check_samples(replace(joined, position=place))
    where = ", 0.25 m apart" if apart else ""
    said = f"time goes from 2.95 s to 2.95 s at sample 60{where}: it must increase (2 such samples)"
    assert report.problems == (said,) and report.rows == len(path) + 2
    assert report.axes == check_samples(path).axes


def test_a_path_whose_time_stands_still_is_told():
    report = check_samples(Samples(np.zeros(4), np.zeros((4, 3))))
    assert report.problems == ("time goes from 0.0 s to 0.0 s at sample 1: it must increase (3 such samples)",)


@pytest.mark.parametrize("rate", [20.0, 50.0, 100.0])
def test_a_heading_from_the_tilt_passes_where_the_thrust_tilts_between_two_samples(rate):
    """A plan without a limit on its jerk leans at once, and its heading turns with it: stream refused it."""
    plan = minsnap.plan([(0, 0, 1), (8, 0, 1), (8, 4, 1)], limits=minsnap.Limits(speed=8, acceleration=20), yaw="tilt")
    assert check_samples(plan.sample(rate)).problems == ()
