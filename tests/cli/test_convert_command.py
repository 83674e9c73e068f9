"""Converting by the command."""

import re

import numpy as np
import pytest
from ulog_bytes import fields, ulog

import minsnap
from minsnap.cli import options
from minsnap.files.convert import file_formats
from minsnap.plot.animation import ENDINGS


def ulog_bytes():
    rows = [(5_000_000 + 20_000 * k, 0.01 * k, 0.0, -1.5) for k in range(100)]
    return ulog([("vehicle_local_position", fields("float", "x y z"), rows)])


def test_formats_by_their_endings_and_by_name(call, tmp_path):
    assert call("rect", "--pieces", 1, "-o", "rect.csv").returncode == 0
    assert (
        call("convert", "rect.csv", "rect.parquet", "--to-frame", "ned").stdout == "rect.parquet: parquet, frame ned\n"
    )
    done = call("convert", "rect.parquet", "cf.csv", "--to", "crazyflie")
    assert done.returncode == 0 and done.stdout == "cf.csv: crazyflie, frame enu\n"
    assert np.loadtxt(tmp_path / "cf.csv", delimiter=",", skiprows=1, usecols=range(33)).shape[0] <= 31
    assert call("convert", "cf.csv", "back.csv").returncode == 0
    first, back = minsnap.read_csv(tmp_path / "rect.csv"), minsnap.read_csv(tmp_path / "back.csv")
    count = min(len(first), len(back)) - 1
    np.testing.assert_allclose(back.position[:count], first.position[:count], atol=1.5e-3)


def test_refusals(call, tmp_path):
    assert call("convert", "none.csv", "a.npz").returncode == 2
    (tmp_path / "a.npz").write_bytes(b"")
    call("rect", "-o", "rect.csv")
    kept = call("convert", "rect.csv", "a.npz", "--no-clobber")
    assert kept.returncode == 2 and "a.npz is there already" in kept.stderr
    assert call("convert", "rect.csv", "a.npz", "--to", "paper").stderr.startswith(
        "minsnap: no format is called 'paper'"
    )


def test_a_rate_that_does_nothing_is_refused(call, tmp_path):
    """Samples kept theirs, and polynomials stayed polynomials, without a word on --rate."""
    (tmp_path / "flight.ulg").write_bytes(ulog_bytes())
    call("rect", "-o", "a.csv", "--rate", "50")
    call("rect", "-o", "a.json")
    for source, target in (("a.csv", "b.csv"), ("flight.ulg", "b.csv"), ("a.csv", "b.traj"), ("a.json", "b.traj")):
        done = call("convert", source, target, "--rate", "20")
        assert done.returncode == 2 and f"{source} holds" in done.stderr and "leave it out" in done.stderr
        assert not (tmp_path / target).exists()
    assert call("convert", "a.json", "b.csv", "--rate", "10").returncode == 0
    assert minsnap.read_csv(tmp_path / "b.csv").rate == pytest.approx(10.0)


def test_a_damaged_log_is_converted_as_far_as_it_goes(call, tmp_path):
    (tmp_path / "flight.ulg").write_bytes(ulog_bytes()[:-20])
    done = call("convert", "flight.ulg", "flight.csv")
    assert done.returncode == 0, done.stderr
    assert "ends in the middle of a message; 99 positions and 0 setpoints could be read" in done.stderr
    assert len(minsnap.read_csv(tmp_path / "flight.csv")) == 99


def test_the_help_names_every_format(call):
    """The texts are written out, for the table is slow to import: they lacked formats, and named some wrongly."""
    table = file_formats().values()
    read, written = ({*re.findall(r"\.\w+", text)} for text in (options.READABLE, options.WRITABLE))
    assert read == {ending for known in table for ending in known.reads} - {".yml"}
    assert written == {ending for known in table if known.write for ending in known.endings} - {".yml"}
    assert {*re.split(", | or ", options.FORMATS)} == {known.name for known in table if known.write}
    shown = "".join(call("convert", "--help").stdout.split())
    assert all(text.replace(" ", "") in shown for text in (options.READABLE, options.WRITABLE, options.FORMATS))
    for command in ("plot", "simulate", "fleet"):
        shown = call(command, "--help").stdout
        assert all(ending in shown for ending in ENDINGS), command


FRAMES = "Time [msec];X (mm);Y (mm);Z (mm);mode\n" + "".join(
    f"{40 * i};{1000 * (10 * (i / 50) ** 3 - 15 * (i / 50) ** 4 + 6 * (i / 50) ** 5):.0f};0;1500;70\n"
    for i in range(51)
)


def test_frames_become_few_polynomials_within_a_tolerance(call, tmp_path):
    (tmp_path / "frames.csv").write_text(FRAMES)
    refused = call("convert", "frames.csv", "path.json")
    assert refused.returncode == 2 and "(--tolerance 5mm)" in refused.stderr
    done = call("convert", "frames.csv", "path.json", "--tolerance", "3mm")
    assert done.returncode == 0 and re.search(
        r"\d polynomials?, at most .* mm from the samples and, at every", done.stdout
    )
    assert minsnap.files.convert.read_any(tmp_path / "path.json").duration == pytest.approx(2.0)
    assert call("convert", "frames.csv", "path.csv", "--tolerance", "3mm", "--rate", 50).returncode == 0
    assert minsnap.read_csv(tmp_path / "path.csv").acceleration is not None
    assert call("convert", "path.csv", "path.traj", "--tolerance", "1cm", "--ends", "free").returncode == 0
    named = ("--columns", "t=Time [msec],x=X (mm),y=Y (mm),z=Z (mm)")
    assert call("convert", "frames.csv", "again.csv", *named).returncode == 0
    assert call("check", "frames.csv", *named).returncode == call("check", "frames.csv").returncode


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--tolerance", "5"), "--tolerance is '5': it takes a length such as 8mm"),
        (("--tolerance", "5km"), "it takes a length"),
        (("--tolerance", "-5mm"), "it takes a length"),
        (("--ends", "free"), "--ends is 'free': it is rest or free, with --tolerance"),
        (("--tolerance", "5mm", "--ends", "moving"), "--ends is 'moving'"),
        (("--columns", "t"), "the columns are 't': give pairs such as t=time,x=px"),
        (("--columns", "t=clock"), "has no column 'clock'"),
        (("--origin", "47", "8", "500"), "no column is known as lat, lon, alt"),
    ],
)
def test_what_is_wrong_of_frames_is_one_sentence(call, tmp_path, words, said):
    (tmp_path / "frames.csv").write_text(FRAMES)
    done = call("convert", "frames.csv", "path.json", *words)
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "path.json").exists()


def test_a_folder_of_setpoints_is_checked_for_separation(call, tmp_path):
    (tmp_path / "show").mkdir()
    for i in range(2):
        plan = minsnap.plan([(0, i, 1), (4, 1 - i, 1)], total_time=4.0)
        minsnap.write_csv(plan, tmp_path / "show" / f"v{i}.csv")
    done = call("check", "show", "--separation", 1)
    assert done.returncode == 1 and "v0 and v1 come within 0.0000 m at 2.00 s" in done.stdout
    assert call("plot", "show", "-o", "show.png").returncode == 0
    assert "--columns" in call("check", "show", "--separation", 1, "--columns", "t=x").stderr
