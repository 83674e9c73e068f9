"""Setpoint CSV: exact round trips, both frames, other readers, and every way a file can be bad."""

from __future__ import annotations

import os
import stat

import numpy as np
import pandas
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import minsnap
from minsnap.errors import FileError, FrameError, TimingError
from minsnap.trajectory.samples import Samples

HEADER = "t,x,y,z,vx,vy,vz,ax,ay,az,yaw,yaw_rate"
FRAMES = ["enu", "flu", "frd", "optitrack"]
"""Those that round nothing: a yaw in NED is subtracted from pi/2."""
QUANTITIES = ("t", "position", "velocity", "acceleration", "yaw", "yaw_rate")


@pytest.fixture
def path():
    return minsnap.helix(1.1, 0.37, laps=2.0, period=3.3, yaw="velocity")


def write(folder, text):
    file = folder / "given.csv"
    file.write_text(text)
    return file


@pytest.mark.parametrize("frame", FRAMES)
def test_reads_back_exactly(path, tmp_path, frame):
    minsnap.write_csv(path, tmp_path / "a.csv", rate=50.0, frame=frame)
    read, wanted = minsnap.read_csv(tmp_path / "a.csv", frame=frame), path.sample(50.0)
    for name in QUANTITIES:
        assert np.array_equal(getattr(read, name), getattr(wanted, name)), name
    assert read.jerk is None and read.snap is None


def test_ned_swaps_north_and_east_and_counts_down_and_clockwise(path, tmp_path):
    minsnap.write_csv(path, tmp_path / "a.csv", frame="ned")
    rows, wanted = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1).T, path.sample(20.0)
    for first, array in ((1, wanted.position), (4, wanted.velocity), (7, wanted.acceleration)):
        assert np.array_equal(rows[first : first + 3], array.T[[1, 0, 2]] * [[1], [1], [-1]])
    assert rows[10] == pytest.approx(np.pi / 2 - wanted.yaw)
    assert rows[11] == pytest.approx(-wanted.yaw_rate)
    back = minsnap.read_csv(tmp_path / "a.csv", frame="ned")
    assert np.array_equal(back.position, wanted.position)
    assert back.yaw == pytest.approx(wanted.yaw, abs=1e-14)


def test_header_grid_and_end_are_as_promised(path, tmp_path):
    minsnap.write_csv(path, tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == HEADER
    table = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    assert np.array_equal(table[:, 0], np.arange(len(table)) / 20.0)
    assert np.array_equal(table[-1, 1:4], path(path.duration))
    assert table[-2, 0] < path.duration <= table[-1, 0]


def test_other_readers_take_it_as_it_is(path, tmp_path):
    minsnap.write_csv(path, tmp_path / "a.csv")
    frame = pandas.read_csv(tmp_path / "a.csv")
    assert list(frame.columns) == HEADER.split(",")
    assert frame[["x", "y", "z"]].to_numpy() == pytest.approx(path.sample(20.0).position, rel=1e-15, abs=1e-15)


def test_plane_samples_get_altitude_zero(tmp_path):
    flat = Samples(np.arange(3.0), np.arange(6.0).reshape(3, 2), velocity=np.ones((3, 2)))
    minsnap.write_csv(flat, tmp_path / "a.csv")
    read = minsnap.read_csv(tmp_path / "a.csv")
    assert np.array_equal(read.position, np.column_stack([flat.position, np.zeros(3)]))
    assert np.array_equal(read.velocity[:, 2], np.zeros(3))


def test_what_samples_lack_is_left_out_and_reads_as_none(tmp_path):
    bare = Samples(np.arange(3.0), np.ones((3, 3)), yaw=np.zeros(3))
    minsnap.write_csv(bare, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "t,x,y,z,yaw"
    read = minsnap.read_csv(tmp_path / "a.csv")
    assert read.velocity is None and read.acceleration is None and read.yaw_rate is None
    assert np.array_equal(read.yaw, np.zeros(3))


def test_columns_may_come_in_any_order_with_windows_lines_and_a_byte_order_mark(tmp_path):
    file = tmp_path / "a.csv"
    file.write_bytes(b"\xef\xbb\xbfz, y ,x,t\r\n3,2,1,0\r\n6,5,4,0.5\r\n\r\n")
    read = minsnap.read_csv(file)
    assert np.array_equal(read.position, [[1, 2, 3], [4, 5, 6]])
    assert np.array_equal(read.t, [0.0, 0.5])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        ("t,x,y,z\n", "no rows"),
        ("t,x,y\n0,1,2\n", "line 1: no column z"),
        ("0,1,2,3\n1,1,2,3\n", "line 1: no column t, x, y, z"),
        ("x,y,z\n1,2,3\n", "line 1: no column t; .*; waypoints have no instants before they are planned$"),
        ("t,x,y,z,vx,vy\n0,1,2,3,4,5\n", "line 1: vz missing"),
        ("t,x,y,z,speed\n0,1,2,3,4\n", "line 1: column 'speed' is not known"),
        ("t,x,y,z,x\n0,1,2,3,4\n", "line 1: column x is there twice"),
        ("t,x,y,z\n0,1,2,3\n1,1,2\n", "line 3: 3 numbers, but there are 4"),
        ("t,x,y,z\n0,1,2,3\n\n1,1,2,3\n", "line 3: it is empty"),
        ("t,x,y,z\n0,1,2,3\n1,1,two,3\n", "line 3: y is 'two'"),
        ("t,x,y,z\n0,1,2,3\n1,1,nan,3\n", "line 3: y is 'nan'"),
        ("t,x,y,z\n0,1,2,3\n1,1e999,2,3\n", "line 3: x is '1e999'"),
        ("t,x,y,z\n0,1,2,3\n1,1_0,2,3\n", "line 3: x is '1_0'"),
        ("t,x,y,z\n0,1,2,3\n1,,2,3\n", "line 3: x is ''"),
        ("t,x,y,z\n0,1,2,3\n1,1,2,3\n1,1,2,3\n", "line 4: t is 1.0, not after"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(tmp_path, text, said):
    with pytest.raises(FileError, match=said):
        minsnap.read_csv(write(tmp_path, text))


def test_a_missing_file_a_folder_and_a_binary_file_are_bad_input(tmp_path):
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    for name, said in (("none.csv", "No such file"), ("", "folder|directory"), ("binary.csv", "not a text file")):
        with pytest.raises(FileError, match=said):
            minsnap.read_csv(tmp_path / name)


def test_nothing_that_is_not_finite_is_written_and_the_old_file_stays(tmp_path):
    file = write(tmp_path, "precious")
    position = np.ones((3, 3))
    position[1, 2] = np.nan
    with pytest.raises(FileError, match="z of sample 1 is nan"):
        minsnap.write_csv(Samples(np.arange(3.0), position), file)
    assert file.read_text() == "precious"
    assert os.listdir(tmp_path) == ["given.csv"]


def test_bad_requests_are_refused_before_anything_is_written(path, tmp_path):
    file = tmp_path / "a.csv"
    with pytest.raises(FrameError, match="enu"):
        minsnap.write_csv(path, file, frame="north")
    with pytest.raises(TimingError, match="rate"):
        minsnap.write_csv(path, file, rate=0.0)
    with pytest.raises(FileError, match="4"):
        minsnap.write_csv(Samples(np.arange(2.0), np.ones((2, 4))), file)
    assert not file.exists()


def test_clobber_and_unwritable_places(path, tmp_path):
    file = write(tmp_path, "precious")
    with pytest.raises(FileError, match="there already"):
        minsnap.write_csv(path, file, clobber=False)
    assert file.read_text() == "precious"
    with pytest.raises(FileError, match="cannot be written|no folder|No such"):
        minsnap.write_csv(path, tmp_path / "nowhere" / "a.csv")


def test_written_files_get_the_usual_permissions(path, tmp_path):
    minsnap.write_csv(path, tmp_path / "a.csv")
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == 0o666 & ~mask


def test_a_device_is_written_to_and_a_link_followed(path, tmp_path):
    minsnap.write_csv(path, os.devnull)
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    (tmp_path / "link.csv").symlink_to(tmp_path / "target.csv")
    minsnap.write_csv(path, tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert len(minsnap.read_csv(tmp_path / "target.csv")) == len(path.sample(20.0))


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(
    values=arrays(np.float64, st.tuples(st.integers(1, 5), st.just(11)), elements=FINITE), frame=st.sampled_from(FRAMES)
)
def test_any_finite_numbers_read_back_exactly(tmp_path_factory, values, frame):
    file = tmp_path_factory.mktemp("any") / "a.csv"
    columns = (values[:, :3], values[:, 3:6], values[:, 6:9])
    written = Samples(np.arange(float(len(values))), *columns, yaw=values[:, 9], yaw_rate=values[:, 10])
    minsnap.write_csv(written, file, frame=frame)
    read = minsnap.read_csv(file, frame=frame)
    for name in QUANTITIES:
        assert np.array_equal(getattr(read, name), getattr(written, name)), name


@given(st.one_of(st.binary(max_size=60), st.text("0123456789.,-+einfat_xyzv\n\r ", max_size=60).map(str.encode)))
def test_whatever_a_file_holds_it_is_read_or_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("any") / "a.csv"
    for text in (content, b"t,x,y,z\n" + content):
        file.write_bytes(text)
        try:
            assert np.isfinite(minsnap.read_csv(file).position).all()
        except FileError as error:
            assert str(file) in str(error)


def test_a_yaw_in_ned_reads_back_to_its_last_digit_and_all_else_exactly(tmp_path):
    random = np.random.default_rng(5)
    yaw = random.uniform(-7.0, 7.0, 400)
    first = Samples(np.arange(400.0), random.normal(size=(400, 3)), random.normal(size=(400, 3)), yaw=yaw)
    minsnap.write_csv(first, tmp_path / "ned.csv", frame="ned")
    again = minsnap.read_csv(tmp_path / "ned.csv", frame="ned")
    assert (again.position == first.position).all() and (again.velocity == first.velocity).all()
    assert np.abs(again.yaw - yaw).max() <= 2.0 * np.spacing(8.0)
