"""Any format to any other, by the endings; and polynomials through samples."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FrameError
from minsnap.files.convert import file_formats, read_any, write_any
from minsnap.files.formats.pieces import refit
from minsnap.files.formats.tables import to_dataframe
from minsnap.trajectory.heading import wrap
from minsnap.trajectory.samples import ARRAYS, Samples

NAMES = {"setpoints": "a.csv", "crazyflie": "cf.csv", "mav": "a.yaml", "npz": "a.npz", "parquet": "a.parquet",
         "polynomials": "a.json", "crazyflie-compressed": "a.traj"}  # fmt: skip
PLAN = minsnap.rectangle(width=6, length=4, pieces=1)


def sampled(content, rate=20.0):
    return content if isinstance(content, Samples) else content.sample(rate)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), list(itertools.permutations(NAMES, 2)))
def test_there_and_on_to_another(tmp_path, first, second):
    """The plan, through two formats, is the plan: to a millimetre where polynomials were fitted to samples."""
    one, two = (tmp_path / f"{k}{NAMES[name]}" for k, name in enumerate((first, second)))
    write_any(PLAN, one, first)
    assert write_any(read_any(one), two, second)[0] == second
    back, expected = sampled(read_any(two)), PLAN.sample(20.0)
    count = min(len(back), len(expected)) - 1
    assert count >= len(expected) - 2
    np.testing.assert_allclose(back.position[:count], expected.position[:count], atol=3e-3)


@pytest.mark.parametrize("name", ["a.json", "a.npz"])
def test_a_frame_beside_a_file_that_has_its_own_is_refused(tmp_path, name):
    """It was ignored."""
    write_any(PLAN, tmp_path / name)
    with pytest.raises(FrameError, match="have their own axes: leave the frame 'ned' out"):
        read_any(tmp_path / name, "ned")


def test_a_table_of_another_program_is_read_in_the_frame_that_is_given(tmp_path):
    """A frame beside Parquet was ignored, and rows in NED were read as ENU."""
    table, plan = to_dataframe(PLAN.sample(20.0), "ned"), PLAN.sample(20.0)
    write_any(PLAN, tmp_path / "own.parquet", frame="ned")
    table.attrs.clear()
    table.to_parquet(tmp_path / "other.parquet")
    for name, frame in (("own", None), ("own", "ned"), ("other", "ned")):
        np.testing.assert_allclose(read_any(tmp_path / f"{name}.parquet", frame).position, plan.position, atol=1e-12)
    with pytest.raises(FileError, match="is in ned, as it says, not in enu"):
        read_any(tmp_path / "own.parquet", "enu")


ENDINGS = [
    (".csv", "setpoints"), (".yml", "polynomials"), (".npy", "px4"), (".json", "polynomials"), (".npz", "npz"),
    (".traj", "crazyflie-compressed"),
]  # fmt: skip


@pytest.mark.parametrize(("ending", "name"), ENDINGS)
def test_endings_mean_formats(tmp_path, ending, name):
    path = tmp_path / f"a{ending}"
    assert write_any(PLAN, path)[0] == name and path.stat().st_size > 100
    with pytest.raises(FileError, match="there already"):
        write_any(PLAN, path, clobber=False)


@pytest.mark.parametrize("name", ["crazyflie", "mav", "npz", "polynomials", "crazyflie-compressed"])
def test_a_shape_is_written_as_polynomials_and_its_error_is_stated(tmp_path, name):
    circle = minsnap.circle(radius=2.0, period=8.0)
    chosen, note = write_any(circle, tmp_path / NAMES[name], name)
    assert chosen == name and "the shape is written as 19 polynomials, at most 1e-06 m from it" in note
    back = read_any(tmp_path / NAMES[name])
    t = np.linspace(0.0, min(circle.duration, back.duration), 1001)
    assert np.linalg.norm(back(t) - circle(t), axis=1).max() <= (3e-3 if "compressed" in name else 1e-6)


def test_setpoints_keep_the_frame_they_are_asked_for(tmp_path):
    write_any(PLAN, tmp_path / "ned.csv", frame="ned", rate=10.0)
    samples = read_any(tmp_path / "ned.csv", "ned")
    assert samples.rate == pytest.approx(10.0)
    np.testing.assert_allclose(samples.position, PLAN.sample(10.0).position, atol=1e-12)


NAMED = {"t": "the first instant (2 s)", "feed_forward": "feed-forward", "lead": "the lead (0.1 s)"}
ALL = {**NAMES, "skybrush": "a.skyb", "px4": "a.npy", "multidof": "m.json"}


@pytest.mark.parametrize("name", ALL)
def test_all_of_samples_that_a_format_does_not_hold_is_named(tmp_path, name):
    """Feed-forward, leads, first instants, jerks and snaps were dropped without a word."""
    plain = PLAN.sample(20.0)
    given = replace(plain, t=plain.t + 2.0, feed_forward=0.5 * plain.velocity, lead=0.1)
    lost = write_any(given, tmp_path / ALL[name], name)[1] or ""
    words = [NAMED.get(field, field) for field in file_formats()[name].leaves_out]
    assert f"left out: {', '.join(words)}" in lost if words else lost == ""
    if name in ("setpoints", "parquet", "npz"):
        back = read_any(tmp_path / ALL[name])
        held = {field for field in ARRAYS if np.array_equal(getattr(back, field), getattr(given, field))}
        assert held == {*ARRAYS} - {*words} and back.lead == 0.1
    assert "left out: " not in (write_any(PLAN, tmp_path / ALL[name], name)[1] or "")


def test_what_cannot_be_converted(tmp_path):
    with pytest.raises(FileError, match="cannot be read by its ending: it must be one of .csv, .ulg"):
        read_any(tmp_path / "a.doc")
    with pytest.raises(FileError, match="cannot be written by its ending: use .csv, .*name a format of"):
        write_any(PLAN, tmp_path / "a.doc")
    with pytest.raises(FileError, match="no format is called 'paper'"):
        write_any(PLAN, tmp_path / "a.csv", "paper")
    assert list(tmp_path.iterdir()) == []


def test_a_refit_passes_every_sample_and_is_smooth():
    samples = minsnap.circle(radius=3.0).sample(20.0)
    curve = refit(samples)
    t = np.minimum(samples.t, curve.duration)
    assert np.linalg.norm(curve(t) - samples.position, axis=1).max() <= 1e-3
    assert len(curve.durations) < len(samples) / 3
    inner = curve.breaks[1:-1]
    for order in (0, 1, 2):
        np.testing.assert_allclose(curve(inner - 1e-12, order), curve(inner, order), atol=1e-6)


@pytest.mark.parametrize("rate", [20.0, 1.0])
@pytest.mark.parametrize("rated", [True, False])
def test_a_refit_goes_on_where_headings_are_wrapped(rate, rated):
    """Against the spin that was wrapped: 2 rad/s, which at 1 Hz is more than half a turn in two steps."""
    still = minsnap.line((0, 0, 1), (1e-3, 0, 1), total_time=20.0).sample(rate)
    spin = 2.0 * still.t
    samples = replace(still, yaw=wrap(spin), yaw_rate=np.full_like(spin, 2.0) if rated else None)
    curve = refit(samples)
    t = np.linspace(0.0, curve.duration, 999)
    np.testing.assert_allclose(curve.yaw(t), 2.0 * t, atol=2e-3)
    np.testing.assert_allclose(curve.yaw(t, 1), 2.0, atol=1e-2)


def test_a_show_keeps_the_heading_of_samples(tmp_path):
    """It was left out: a camera that was to turn stood still."""
    samples = PLAN.sample(20.0)
    write_any(replace(samples, yaw=np.sin(samples.t), yaw_rate=np.cos(samples.t)), tmp_path / "turning.skyb")
    held = read_any(tmp_path / "turning.skyb")
    np.testing.assert_allclose(held.yaw(samples.t), np.sin(samples.t), atol=np.radians(0.65))


def test_a_refit_that_needs_more_pieces_says_what_it_would_reach():
    wild = minsnap.circle(radius=3.0, laps=20).sample(20.0)
    with pytest.raises(FileError, match="31 pieces are .* m from the samples, more than 0.001: fly it in parts"):
        refit(wild, 31)
    spun = replace(minsnap.line((0, 0, 1), (5, 0, 1)).sample(20.0), yaw_rate=None)
    with pytest.raises(FileError, match="2 pieces are .* rad of heading from the samples"):
        refit(replace(spun, yaw=np.sin(5.0 * spun.t)), 2)
    with pytest.raises(FileError, match="need samples with velocities and accelerations"):
        refit(Samples(wild.t, wild.position))
