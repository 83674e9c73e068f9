"""Binary Skybrush shows: bytes by hand, the checksum bit by bit, the proved distance, and what does not fit."""

import struct

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError
from minsnap.files.consistency import check_samples
from minsnap.files.convert import read_samples, resolution_of
from minsnap.files.formats.bezier_segments import packed, unpacked
from minsnap.files.formats.cubic_segments import CUBIC, as_cubic_segments, worst_distance
from minsnap.files.formats.skybrush import (
    Lights,
    checksum,
    light_bytes,
    lights_of,
    parsed,
    read_skybrush,
    skybrush_bytes,
    write_skybrush,
)
from minsnap.trajectory.trajectory import Trajectory

CORNERS = [(0, 0, 1), (3, 0, 2), (3, 2, 4), (0, 2, 1)]


def remainder(content):
    """CRC-32 bit by bit: reflected 0xEDB88320, begins at 0, not inverted."""
    state = 0
    for byte in content:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (0xEDB88320 if state & 1 else 0)
    return state


def test_bytes_are_those_of_the_format():
    up = np.linspace((1.0, 0.0, 0.0), (1.0, 0.0, 3.0), 4)
    along = np.array([(1.0, 0.0, 3.0), (1.5, 0.0, 3.0), (2.0, 0.0, 3.0), (2.0, 0.0, 3.0)])
    content = skybrush_bytes(as_cubic_segments(Trajectory(np.stack([up, along]), [2.0, 1.5])))
    body = struct.pack("<B4h", 1, 1000, 0, 0, 0) + struct.pack("<BHh", 1 << 4, 2000, 3000)
    body += struct.pack("<BH3h", 2, 1500, 1500, 2000, 2000)
    blocks = struct.pack("<BH", 1, len(body)) + body + struct.pack("<BHB", 2, 1, 0)
    assert content[:6] == b"skyb\x02\x01" and content[10:] == blocks
    assert struct.unpack_from("<I", content, 6) == (remainder(content[:6] + bytes(4) + blocks),)


def test_the_checksum_is_that_of_the_polynomial():
    content = np.random.default_rng(0).bytes(300)
    assert checksum(content) == remainder(content)
    assert checksum(b"hello-world") == 0xDA53B3B7  # published in the tests of libskybrush


@pytest.mark.parametrize(("far", "scale"), [(0.0, 1), (40.0, 2), (150.0, 5)])
def test_what_is_read_is_within_the_proved_distance(tmp_path, far, scale):
    path = minsnap.plan(np.add(CORNERS, (far, 0, 0)), [2.0003, 1.5004, 2.0])
    written = write_skybrush(path, tmp_path / "a.skyb")
    again = read_skybrush(tmp_path / "a.skyb").trajectory
    assert written.scale == scale
    t = np.linspace(0.0, path.duration, 20001)
    off = np.linalg.norm(again(t) - path(t), axis=1).max()
    assert off <= written.distance <= 1.5 * off + 1e-4
    assert written.distance <= CUBIC.tolerance + np.sqrt(3.0) * 0.5e-3 * scale + 1e-9
    assert path.duration <= again.duration <= path.duration + 1e-3
    assert np.abs(again(again.duration) - path(path.duration)).max() <= 0.5e-3 * scale + 1e-12


def test_a_finer_tolerance_takes_more_segments():
    path = minsnap.plan(CORNERS, [2.0, 1.5, 2.0])
    coarse, fine = as_cubic_segments(path, 0.05), as_cubic_segments(path, 0.0005)
    assert len(coarse.points) < len(fine.points) and fine.distance < coarse.distance


def test_long_holds_are_split_at_a_minute():
    still = Trajectory(np.tile((1.0, 2.0, 3.0), (1, 8, 1)), [150.0])
    assert np.diff(as_cubic_segments(still).breaks).max() <= 60_000


def test_a_show_that_is_too_long_says_how_much_fits():
    corners = np.random.default_rng(3).uniform(-3, 3, (900, 3))
    long = minsnap.plan(corners, np.full(899, 1.2))
    with pytest.raises(FileError, match=r"more than a block holds: the first \d+\.\d s of 1078\.8 s fit"):
        skybrush_bytes(as_cubic_segments(long, 1e-4))
    with pytest.raises(FileError, match="5000 m from the origin, and a show holds 4161 m"):
        as_cubic_segments(minsnap.plan([(0, 0, 0), (5000, 0, 0)], [1000.0]))


def test_the_worst_distance_is_of_what_a_show_holds():
    assert worst_distance(4000.0) == worst_distance(3000.0) > worst_distance(10.0)
    with pytest.raises(FileError, match="leads 5000 m from the origin, and a show holds 4161 m"):
        worst_distance(5000.0)


def test_a_changed_byte_is_refused(tmp_path):
    write_skybrush(minsnap.plan(CORNERS, [2.0, 1.5, 2.0]), tmp_path / "a.skyb")
    content = bytearray((tmp_path / "a.skyb").read_bytes())
    content[40] ^= 4
    (tmp_path / "a.skyb").write_bytes(content)
    with pytest.raises(FileError, match="checksum .* is wrong"):
        read_skybrush(tmp_path / "a.skyb")
    for cut in (3, 9, 12):
        (tmp_path / "a.skyb").write_bytes(bytes(content[:4]) + b"\x01" + bytes(content[10 : 10 + cut]))
        with pytest.raises(FileError, match=r"a\.skyb|cut off"):
            read_skybrush(tmp_path / "a.skyb")


def test_degree_7_quadratic_lines_and_the_retired_bit_are_read():
    body = struct.pack("<B4h", 0x82, 1, 2, 3, 0) + struct.pack("<BH", 0b000111, 500)
    body += struct.pack("<7h", *range(2, 9)) + struct.pack("<h", 12)
    path = read_of(b"skyb\x01" + struct.pack("<BH", 3, 2) + b"hi" + struct.pack("<BH", 1, len(body)) + body)
    assert path(0.5) == pytest.approx([0.016, 0.024, 0.006]) and path(0.25)[1] == pytest.approx(0.014)


def read_of(content):
    return parsed(content).trajectory


LINES = "02 0500 0a00 0700 9204  55 1027 0a00 1400 0f00 3408  41 8813 0f00 e40c  04 8813 1900  10 983a 0000  00 e803"
CUBICS = """02 0000 0000 0000 0000  aa 1027 00001900 1900 00001e00 1e00 00002300 2300 000020032003
    aa 8813 320064009600 64009600c800 9600c800fa00 900178056009"""
ROUND = "01 0000 0000 0000 0000  10 1027 1027  01 1027 1027  04 1027 1027  05 1027 0000 0000  10 1027 0000"
"""Trajectory blocks that libskybrush's tests publish, or describe field by field."""

PLAYED = {
    LINES: {0: (10, 20, 14), 10: (20, 40, 30), 15: (30, 40, 30), 17.5: (30, 45, 30), 20: (30, 50, 30), 36: (30, 50, 0)},
    CUBICS: {0: (0, 0, 0), 5: (25, 30, 35), 10: (50, 60, 70), 15: (300, 400, 500)},
    ROUND: {5: (0, 0, 5000), 15: (5000, 0, 10000), 25: (10000, 5000, 10000), 35: (5000, 5000, 10000), 50: (0, 0, 0)},
}


@pytest.mark.parametrize("block", PLAYED)
def test_published_trajectories_are_read_as_they_are_played_and_packed_as_they_were(block):
    body = bytes.fromhex("".join(block.split()))
    path = read_of(b"skyb\x01" + struct.pack("<BH", 1, len(body)) + body)
    for instant, place in PLAYED[block].items():
        assert 1e3 * path(instant) == pytest.approx(place, abs=1e-9), instant
    assert path.duration == max(PLAYED[block])
    milliseconds, points, _ = unpacked(body[9:], struct.unpack_from("<4h", body, 1))
    rows = []
    for duration, piece in zip(milliseconds, points.astype(int), strict=True):
        still, line = np.ptp(piece, axis=1) == 0, block != CUBICS
        controls = piece[:, [0, -1]] if line else piece
        rows.append(packed(int(duration), controls, np.where(still, 0, 1 if line else 3)))
    assert b"".join(rows) == body[9:]


def test_a_trajectory_does_not_end_before_its_block():
    """What lies behind a segment of 0 ms was left out without a word."""
    lines = [struct.pack("<BHh", 1, milliseconds, x) for milliseconds, x in ((1000, 500), (0, 600), (1000, 700))]
    body = struct.pack("<B4h", 1, 0, 0, 0, 0) + b"".join(lines)
    with pytest.raises(FileError, match="has a segment of 0 ms before its end"):
        parsed(b"skyb\x01" + struct.pack("<BH", 1, len(body)) + body)


def test_lights_are_read_as_written():
    lights = Lights([0.0, 1.0, 4.0, 4.0], [(255, 0, 0), (0, 255, 0), (0, 0, 255), (9, 9, 9)], [0, 1, 0, 0])
    programme = light_bytes(lights)
    assert programme[:5] == bytes([4, 255, 0, 0, 0]) and programme[5:10] == bytes([8, 0, 255, 0, 50])
    assert programme[10:16] == bytes([4, 0, 255, 0, 0x96, 0x01])
    again = lights_of(programme)
    t = np.linspace(0.0, 6.0, 301)
    assert again(t) == pytest.approx(lights(t))
    assert light_bytes(None) == b"\x00" and lights_of(b"\x00") is None


def test_loops_of_lights_are_played():
    lights = lights_of(bytes([12, 3, 4, 10, 0, 0, 5, 4, 20, 0, 0, 5, 13, 0]))
    assert lights(np.array([0.05, 0.15, 0.25, 0.55]))[:, 0] == pytest.approx([10, 20, 10, 20])
    with pytest.raises(FileError, match="runs more than 100000 commands"):
        lights_of(bytes([12, 255] * 9 + [13] * 9 + [0]))
    with pytest.raises(FileError, match="command 99"):
        lights_of(bytes([99, 0]))
    with pytest.raises(FileError, match="cut off"):
        lights_of(bytes([4, 1, 2, 3]))


def test_grays_black_white_and_waits_are_read():
    """Files of Skybrush's own tools hold them; their separation could not be checked for it."""
    lights = lights_of(bytes([1, 7, 5, 5, 90, 5, 3, 20, 10, 5, 9, 60, 5, 6, 0, 0]))
    assert lights(np.array([0.05, 0.15, 0.35, 0.45, 0.55, 0.65]))[:, 1] == pytest.approx([255, 90, 90, 45, 30, 0])
    assert lights(0.55) == pytest.approx([30, 30, 30])


@pytest.mark.parametrize("speed", [0.5, 3.0, 12.0])
def test_what_was_written_is_consistent_and_a_corner_is_not(tmp_path, speed):
    """Velocities that step by what whole millimetres are in a short segment were called wrong."""
    file = tmp_path / "a.skyb"

    def problems(trajectory):
        write_skybrush(trajectory, file)
        return check_samples(read_samples(file), resolution=resolution_of(file)).problems

    for corners in (CORNERS, [(0, 0, 1), (8, 0, 1), (8, 4, 1.5), (0, 4, 2), (0, 0, 1)]):
        assert problems(minsnap.plan(corners, limits=minsnap.Limits(speed=speed, acceleration=6.0))) == ()
    lines = [np.linspace((i * speed, 0.0, 1.0), ((i + 1) * speed, i * speed, 1.0), 4) for i in (0, 1)]
    assert "vy and ay disagree at t = 0.95 s" in problems(Trajectory(np.stack(lines), [1.0, 1.0]))[0]
