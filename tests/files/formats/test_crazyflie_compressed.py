"""The Crazyflie's compressed form: bytes by hand, the bound on rounding, and what does not fit."""

import struct

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError
from minsnap.files.formats.crazyflie_compressed import (
    MEMORY,
    compressed,
    read_compressed,
    rounding_bound,
    write_compressed,
)
from minsnap.trajectory.path import ConstantHeading
from minsnap.trajectory.trajectory import Trajectory

CORNERS = [(0, 0, 1), (3, 0, 1), (3, 2, 1.5), (0, 2, 1)]


def test_bytes_are_those_of_the_format():
    line = np.linspace((0.0, 0.0, 1.0), (0.7, 0.0, 1.0), 8)[None]
    content = compressed(Trajectory(line, [2.0], ConstantHeading(np.pi / 2.0)))
    assert content == struct.pack("<4hBH7h", 0, 0, 1000, 900, 0b000011, 2000, *range(100, 701, 100))


def test_a_piece_at_constant_yaw_takes_45_bytes_and_ninety_fit():
    corners = np.random.default_rng(1).uniform(-3.0, 3.0, (91, 3))
    path = minsnap.plan(corners, np.full(90, 2.0), yaw=0.4)
    assert len(compressed(path)) == 8 + 90 * 45 <= MEMORY
    longer = minsnap.plan(np.vstack([corners, (0.0, 0.0, 0.0)]), np.full(91, 2.0), yaw=0.4)
    with pytest.raises(FileError, match="91 pieces take 4103 bytes, 7 above .*: the first 90 would fit"):
        compressed(longer)


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("yaw", [0.3, "turning"])
def test_the_curve_is_within_its_bound_and_stays_continuous(tmp_path, degree, yaw):
    heading = [0.0, 1.0, 2.0, 0.5] if yaw == "turning" else yaw
    path = minsnap.plan(CORNERS, [2.0001, 1.5004, 2.0], degree=degree, yaw=heading)
    write_compressed(path, tmp_path / "path.traj")
    again = read_compressed(tmp_path / "path.traj")
    t = np.linspace(0.0, min(path.duration, again.duration), 2001)
    assert np.linalg.norm(again(t) - path(t), axis=1).max() <= rounding_bound(path) < 3e-3
    assert np.abs(again.yaw(t) - path.yaw(t)).max() <= np.pi / 3600.0 + 0.5e-3 * np.abs(path.yaw(t, 1)).max() + 1e-9
    assert (again.control_points[1:, 0] == again.control_points[:-1, -1]).all(), "knots are shared"
    assert np.abs(again.breaks - path.breaks).max() <= 0.5e-3 + 1e-12, "rounding of times does not add up"


def test_reading_knows_all_four_types(tmp_path):
    axes = struct.pack("<3h", 10, 20, 30) + struct.pack("<h", 80) + struct.pack("<7h", *range(1, 8))
    (tmp_path / "a.traj").write_bytes(struct.pack("<4hBH", 0, 0, 0, 5, 0b00110110, 500) + axes)
    path = read_compressed(tmp_path / "a.traj")
    assert path(0.5) == pytest.approx([0.030, 0.080, 0.007])
    assert path(0.25)[0] == pytest.approx((3 * 10 + 3 * 20 + 30) / 8e3)
    assert path(0.25)[1] == pytest.approx(0.040) and path.yaw(0.3) == pytest.approx(np.radians(0.5))


@pytest.mark.parametrize("content", [b"", b"1234567", b"12345678", b"12345678\x03", b"12345678\x03\x00\x01\x00"])
def test_what_is_cut_off_is_refused(tmp_path, content):
    (tmp_path / "a.traj").write_bytes(content)
    with pytest.raises(FileError, match=r"a\.traj is not a compressed trajectory"):
        read_compressed(tmp_path / "a.traj")


def test_what_the_format_cannot_hold_is_refused():
    with pytest.raises(FileError, match="x reaches 40000 units"):
        compressed(minsnap.plan([(0, 0, 1), (40, 0, 1)], [20.0]))
    with pytest.raises(FileError, match="70000 ms"):
        compressed(minsnap.plan([(0, 0, 1), (4, 0, 1)], [70.0]))
    with pytest.raises(FileError, match="degree"):
        compressed(minsnap.plan([(0, 0, 1), (4, 0, 1)], [7.0], degree=9))
    with pytest.raises(FileError, match="3 coordinates"):
        compressed(minsnap.plan([(0, 0), (4, 0)], [7.0]))
