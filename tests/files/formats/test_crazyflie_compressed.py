"""The Crazyflie's compressed form: bytes by hand, the bound on rounding, and what does not fit."""

import struct
from math import comb

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FirmwareWarning
from minsnap.files.convert import write_any
from minsnap.files.formats.crazyflie import (
    END,
    MEMORY,
    compressed,
    curve_of_bytes,
    read_compressed,
    rounding_bounds,
    write_compressed,
    write_crazyflie,
)
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.trajectory import Trajectory

CORNERS = [(0, 0, 1), (3, 0, 1), (3, 2, 1.5), (0, 2, 1)]


def played(content):
    """Decode as the firmware does (pptraj_compressed.c): yield (start [s], end [s], control points of each axis)."""
    last, offset, clock = list(struct.unpack_from("<4h", content)), 8, 0.0
    while True:
        types, duration = content[offset], int.from_bytes(content[offset + 1 : offset + 3], "little")
        offset += 3
        if duration == 0:
            return
        axes = []
        for axis in range(4):
            count = {0: 0, 1: 1, 2: 3, 3: 7}[types >> 2 * axis & 0b11]
            axes.append([last[axis], *struct.unpack_from(f"<{count}h", content, offset)])
            last[axis] = axes[-1][-1]
            offset += 2 * count
        yield clock, clock + duration / 1000.0, axes
        clock += duration / 1000.0


def placed(axes, share):
    """Position [m] and yaw [rad] at a share of a piece, from Bernstein's formula."""
    values = []
    for points in axes:
        n = len(points) - 1
        values.append(sum(comb(n, i) * share**i * (1 - share) ** (n - i) * p for i, p in enumerate(points)))
    return np.array(values[:3]) / 1000.0, np.radians(values[3] / 10.0)


def test_bytes_are_those_of_the_format():
    bent = np.linspace((0.0, 0.0, 1.0), (0.7, 0.0, 1.0), 8)[None].copy()
    bent[0, 3, 0] = 0.5
    with pytest.warns(FirmwareWarning, match=r"before 2026\.08 flies a compressed yaw wrongly"):
        content = compressed(Trajectory(bent, [2.0], ConstantHeading(np.pi / 2.0)))
    middle = struct.pack("<BH7h", 0b000011, 2000, 100, 200, 500, 400, 500, 600, 700)
    assert content == struct.pack("<4h", 0, 0, 1000, 900) + middle + b"\x00\x00\x00"


def test_lines_and_cubics_are_stored_as_such():
    line = np.linspace((0.0, 0.0, 1.0), (0.7, 0.0, 1.0), 8)[None]
    assert compressed(Trajectory(line, [2.0])) == struct.pack("<4hBHh3x", 0, 0, 1000, 0, 0b01, 2000, 700)
    cubic = np.array([[(0.0, 0.0, 1.0), (0.3, 0.0, 1.0), (-0.1, 0.0, 1.0), (0.2, 0.0, 1.0)]])
    assert compressed(Trajectory(cubic, [2.0])) == struct.pack("<4hBH3h3x", 0, 0, 1000, 0, 0b10, 2000, 300, -100, 200)


def test_a_piece_at_constant_yaw_takes_45_bytes_and_ninety_fit_with_the_end():
    corners = np.random.default_rng(1).uniform(-3.0, 3.0, (92, 3))
    path = minsnap.plan(corners[:91], np.full(90, 2.0))
    assert len(compressed(path)) == 8 + 90 * 45 + len(END) <= MEMORY
    longer = minsnap.plan(corners, np.full(91, 2.0))
    with pytest.raises(FileError, match="91 pieces take 4106 bytes, 10 above .*: the first 90 would fit"):
        compressed(longer)
    with pytest.raises(FileError, match=r"91 pieces do not fit .* crazyflie-compressed \(.traj\), in which 90 of them"):
        write_crazyflie(longer, "never.csv")


def test_legs_of_several_pieces_are_told_how_many_one_a_leg_makes():
    """A course of ten laps fitted until legs had several pieces unless told otherwise."""
    divided = minsnap.plan(np.random.default_rng(1).uniform(-3.0, 3.0, (40, 3)), np.full(39, 2.0), pieces=3)
    for write in (compressed, lambda path: write_crazyflie(path, "never.csv")):
        with pytest.raises(
            FileError, match=r"117 pieces .* \(pieces=1, --pieces 1\), which makes 39, more around obstacles, or fewer"
        ):
            write(divided)


@pytest.mark.filterwarnings("ignore::minsnap.errors.FirmwareWarning")
@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("yaw", [0.3, "turning"])
def test_the_firmware_flies_within_the_bounds_of_the_plan(tmp_path, degree, yaw):
    heading = [0.0, 1.0, 2.0, 0.5] if yaw == "turning" else yaw
    path = minsnap.plan(CORNERS, [2.0001, 1.5004, 2.0], degree=degree, yaw=heading)
    write_compressed(path, tmp_path / "path.traj")
    bounds = rounding_bounds(path)
    assert bounds[0] < 3e-3
    for start, end, axes in played((tmp_path / "path.traj").read_bytes()):
        for share in np.linspace(0.0, 1.0, 101):
            t = min(start + share * (end - start), path.duration)
            place, turned = placed(axes, share)
            assert np.linalg.norm(place - path(t)) <= bounds[0]
            assert abs(turned - path.yaw(t)) <= np.pi / 3600.0 + 0.5e-3 * 4.0


@pytest.mark.filterwarnings("ignore::minsnap.errors.FirmwareWarning")
@pytest.mark.parametrize(("degree", "short"), [(5, 0.5004), (7, 0.5004), (5, 1.5004), (7, 1.5004)])
def test_what_is_read_is_within_the_bounds_with_its_derivatives(tmp_path, degree, short):
    path = minsnap.plan(CORNERS, [2.0001, short, 2.0], degree=degree, yaw=0.3)
    write_compressed(path, tmp_path / "path.traj")
    again = read_compressed(tmp_path / "path.traj")
    t = np.linspace(0.0, min(path.duration, again.duration), 2001)
    bounds = rounding_bounds(path)
    for order, bound in enumerate(bounds):
        off = np.linalg.norm(again(t, order) - path(t, order), axis=1)
        assert off.max() <= bound <= 8.0 * off.max(), order
    assert (again.control_points[1:, 0] == again.control_points[:-1, -1]).all(), "knots are shared"
    assert abs(again.duration - path.duration) <= 1e-3 and again.durations.min() >= 0.1
    if short > 1.0:
        assert np.abs(again.breaks - path.breaks).max() <= 0.5e-3 + 1e-12, "rounding of times does not add up"


def test_short_pieces_are_stored_as_cubics_that_keep_the_acceleration(tmp_path):
    """Straight flights of 18 to 29 ms pieces reached 34 to 133 m/s^2 of 3 in their files."""
    path = minsnap.plan([(0, 0, 1), (4, 0, 1)], limits=minsnap.Limits(speed=2, acceleration=3), pieces=5)
    assert path.durations.min() < 0.05
    write_compressed(path, tmp_path / "path.traj")
    pieces = list(played((tmp_path / "path.traj").read_bytes()))
    assert min(end - start for start, end, _ in pieces) >= 0.1 and len(pieces) < 30
    bends = [6e-3 * np.abs(np.diff(axis, 2)).max(initial=0.0) / (end - start) ** 2 for start, end, (axis, *_) in pieces]
    assert 2.5 <= max(bends) <= 4.5, "an acceleration that jumps is met by no cubic"
    ends = [(len(axis) - 1) * np.diff(axis)[[0, -1]] / (end - start) for start, end, (axis, *_) in pieces]
    assert max(abs(b[0] - a[1]) for a, b in zip(ends[:-2], ends[1:-1], strict=True)) == 0.0, "velocities do not step"


def test_pieces_that_last_too_short_or_too_long_are_stored_as_others(tmp_path):
    """A rest of under a millisecond between two flights, and a hold of over a minute, were refused."""
    for wrong in (4e-4, 70.0):
        points = np.stack([np.zeros((8, 3)), np.repeat([[0.0, 0, 0], [1, 0, 0]], 4, axis=0)])
        path = Trajectory(points, [wrong, 3.0])
        write_compressed(path, tmp_path / "path.traj")
        again = read_compressed(tmp_path / "path.traj")
        t = np.linspace(0.0, path.duration, 2001)
        assert np.abs(again(t) - path(t)).max() <= 3e-3 and 0.1 <= again.durations.min() <= 60.0


def test_the_note_on_rounding_is_of_what_the_pieces_do():
    """Ten laps were said to differ by 92 m/s^2, and 2 m/s, and differ by 0.12: at an end that moves, and in trifles."""
    lap = minsnap.plan([*CORNERS, CORNERS[0]], limits=minsnap.Limits(speed=2, acceleration=6), closed=True)
    for path in (lap, lap.then(lap).then(lap), minsnap.plan(CORNERS, [2.0001, 1.5004, 2.0])):
        held = curve_of_bytes(compressed(path))
        t = np.linspace(0.0, min(path.duration, held.duration) - 1e-9, 40001)
        for order, bound in enumerate(rounding_bounds(path)):
            off = np.linalg.norm(held(t, order) - path(t, order), axis=1).max()
            assert off <= bound <= 4.0 * off, order


def test_reading_knows_all_four_types(tmp_path):
    axes = struct.pack("<3h", 10, 20, 30) + struct.pack("<h", 80) + struct.pack("<7h", *range(1, 8))
    (tmp_path / "a.traj").write_bytes(struct.pack("<4hBH", 0, 0, 0, 5, 0b00110110, 500) + axes + END + b"not read")
    path = read_compressed(tmp_path / "a.traj")
    assert path(0.5) == pytest.approx([0.030, 0.080, 0.007])
    assert path(0.25)[0] == pytest.approx((3 * 10 + 3 * 20 + 30) / 8e3)
    assert path(0.25)[1] == pytest.approx(0.040) and path.yaw(0.3) == pytest.approx(np.radians(0.5))


@pytest.mark.parametrize("content", [b"", b"1234567", b"12345678\x03", b"12345678\x03\x00\x01\x00", b"12345678" + END])
def test_what_is_cut_off_is_refused(tmp_path, content):
    (tmp_path / "a.traj").write_bytes(content)
    with pytest.raises(FileError, match=r"a\.traj is not a compressed trajectory"):
        read_compressed(tmp_path / "a.traj")


def test_what_the_format_cannot_hold_is_refused():
    with pytest.raises(FileError, match="x reaches 40000 units"):
        compressed(minsnap.plan([(0, 0, 1), (40, 0, 1)], [20.0]))
    wild = np.random.default_rng(1).uniform(-3.0, 3.0, (91, 8, 3))
    for piece, wrong in ((0, 70.0), (1, 4e-4)):
        durations = np.insert(np.full(90, 2.0), piece, wrong)
        with pytest.raises(FileError, match=rf"^piece {piece} takes {1e3 * wrong:.0f} ms, and .* 1 to 65535 ms"):
            compressed(minsnap.Trajectory(wild, durations))
    with pytest.raises(FileError, match="degree"):
        compressed(minsnap.plan([(0, 0, 1), (4, 0, 1)], [7.0], degree=9))
    with pytest.raises(FileError, match="3 coordinates"):
        compressed(minsnap.plan([(0, 0), (4, 0)], [7.0]))


def test_without_its_end_a_file_is_refused(tmp_path):
    content = compressed(minsnap.plan(CORNERS, [2.0, 1.5, 2.0]))
    for cut in (1, 2, 3):
        (tmp_path / "a.traj").write_bytes(content[:-cut])
        with pytest.raises(FileError, match=r"a\.traj"):
            read_compressed(tmp_path / "a.traj")
    with pytest.raises(FileError, match="three zero bytes"):
        read_compressed(tmp_path / "a.traj")


def test_check_allows_for_the_rounding_of_the_format(tmp_path, capsys):
    eight = minsnap.lemniscate(width=4.0, period=8.0)
    write_any(eight, tmp_path / "eight.traj")
    with pytest.raises(SystemExit) as left:
        main(["check", str(tmp_path / "eight.traj")])
    assert left.value.code in (0, None), capsys.readouterr().out


def test_check_still_sees_a_step_in_a_compressed_file(tmp_path, capsys):
    first = struct.pack("<4hBHh", 0, 0, 1000, 0, 0b01, 2000, 2000) + struct.pack("<BHh", 0b01, 2000, -2000)
    (tmp_path / "a.traj").write_bytes(first + END)
    with pytest.raises(SystemExit) as left:
        main(["check", str(tmp_path / "a.traj")])
    assert left.value.code == 1 and "disagree" in capsys.readouterr().out
