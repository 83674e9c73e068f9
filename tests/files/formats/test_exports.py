"""Formats of other programs: read back exactly, and read as those programs read them."""

import struct

import numpy as np
import pytest
import yaml
from curves import curve

import minsnap
from minsnap.errors import FileError, InputError, YawError
from minsnap.files.formats.crazyflie import read_compressed, read_crazyflie, write_compressed, write_crazyflie
from minsnap.files.formats.mav_yaml import read_mav_yaml, write_mav_yaml
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials
from minsnap.files.formats.tables import read_npz, write_npz
from minsnap.trajectory.trajectory import Trajectory


def same(first, second, tolerance=1e-9):
    t = np.linspace(0, min(first.duration, second.duration), 333)
    for order in (0, 1, 2):
        np.testing.assert_allclose(first(t, order), second(t, order), atol=tolerance * 50**order)
    np.testing.assert_allclose(first.yaw(t), second.yaw(t), atol=tolerance)


def as_crazyswarm_reads(path):
    """The reader of uav_trajectories and crazyswarm2: by position, never by name."""
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(33))


def test_crazyflie_pieces_evaluate_to_the_trajectory(tmp_path):
    trajectory, path = curve(), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    start = 0.0
    for row in as_crazyswarm_reads(path):
        for share in (0.0, 0.3, 1.0):
            local = share * row[0]
            now = min(start + local, trajectory.duration) if share < 1 else start + local
            if share == 1.0:
                now = min(now, trajectory.duration) - 1e-12
            values = [np.polyval(row[1 + 8 * k : 9 + 8 * k][::-1], local) for k in range(4)]
            np.testing.assert_allclose(values[:3], trajectory(now), atol=1e-9)
            np.testing.assert_allclose(values[3], trajectory.yaw(now), atol=1e-9)
        start += row[0]
    assert path.read_text().startswith("duration,x^0,x^1,") and path.read_text().splitlines()[0].count(",") == 32


def test_crazyflie_files_read_back_exactly(tmp_path):
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    trajectory = curve()
    write_crazyflie(trajectory, first)
    back = read_crazyflie(first)
    same(trajectory, back)
    assert np.array_equal(back.durations, trajectory.durations)
    write_crazyflie(back, second)
    np.testing.assert_allclose(as_crazyswarm_reads(second), as_crazyswarm_reads(first), rtol=1e-9, atol=1e-9)


def test_a_planned_rectangle_survives_the_firmwares_float32(tmp_path):
    plan = minsnap.rectangle(width=6, length=4)
    path = tmp_path / "rect.csv"
    write_crazyflie(plan, path)
    rows = as_crazyswarm_reads(path)
    packed = b"".join(struct.pack("<33f", *row[1:], row[0]) for row in rows)
    assert len(packed) == 132 * len(rows) <= 4096
    single = np.frombuffer(packed, "<f4").reshape(-1, 33)
    for row, rough in zip(rows, single, strict=True):
        for k in range(3):
            exact = np.polyval(row[1 + 8 * k : 9 + 8 * k][::-1], row[0])
            assert np.polyval(rough[8 * k : 8 * k + 8][::-1], rough[32]) == pytest.approx(exact, abs=1e-3)


def test_a_lone_piece_becomes_two_rows(tmp_path):
    trajectory, path = curve(1), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    assert as_crazyswarm_reads(path).shape == (2, 33)
    same(trajectory, read_crazyflie(path))


def test_lower_degrees_and_constant_headings_fit(tmp_path):
    trajectory, path = curve(3, degree=5, turning=False), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    same(trajectory, read_crazyflie(path))
    assert "ConstantHeading" in repr(read_crazyflie(path).yaw)


def test_a_trailing_comma_as_in_crazyswarm2_is_read(tmp_path):
    path = tmp_path / "cf.csv"
    row = ",".join(["2.0", "1.5"] + ["0"] * 31)
    path.write_text("Duration,whatever\n" + f"{row},\n{row}\n")
    assert read_crazyflie(path)(3.0).tolist() == [1.5, 0, 0]


def test_what_a_crazyflie_cannot_hold(tmp_path):
    path = tmp_path / "cf.csv"
    with pytest.raises(FileError, match="32 pieces do not fit the Crazyflie's memory of 31"):
        write_crazyflie(curve(32), path)
    write_crazyflie(curve(32), path, max_pieces=None)
    assert len(read_crazyflie(path).durations) == 32
    with pytest.raises(FileError, match="degree 9, and this format holds 7"):
        write_crazyflie(curve(2, degree=9), path)
    with pytest.raises(FileError, match="3 coordinates, and the trajectory has 2"):
        write_crazyflie(curve(2, dim=2), path)
    sharp = Trajectory(curve(2).control_points, [1, 1], lambda t, order=0: np.sin(60 * np.asarray(t)))
    with pytest.raises(YawError, match="the heading of piece . is .* rad from any polynomial of degree 7"):
        write_crazyflie(sharp, path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("duration\n", "has no pieces"),
        ("duration\n1,2,3\n", "line 2: 3 numbers, but there are 33 columns"),
        ("duration\n" + ",".join(["x"] * 33) + "\n", "line 2: duration is 'x', not a finite number"),
        ("duration\n" + ",".join(["0"] * 33) + "\n", "line 2: the duration is 0 s: it must be positive"),
        ("duration\n" + ",".join(["1"] * 32 + ["nan"]) + "\n", r"line 2: yaw\^7 is 'nan', not a finite number"),
    ],
)
def test_bad_crazyflie_files(tmp_path, text, said):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        read_crazyflie(path)


@pytest.mark.parametrize("degree", [5, 7, 9])
def test_segments_are_plain_yaml_and_read_back(tmp_path, degree):
    trajectory, path = curve(3, degree), tmp_path / "t.yaml"
    write_mav_yaml(trajectory, path)
    said = yaml.safe_load(path.read_text())["segments"]
    assert [(s["N"], s["D"], type(s["time"])) for s in said] == [(degree + 1, 4, int)] * 3
    seconds = said[0]["time"] * 1e-9
    y = np.polyval(said[0]["coefficients"][1][::-1], seconds / 2)
    assert y == pytest.approx(trajectory(seconds / 2)[1], abs=1e-8)
    same(trajectory, read_mav_yaml(path), 1e-7)


def test_segments_without_yaw_have_three_dimensions(tmp_path):
    path = tmp_path / "t.yaml"
    write_mav_yaml(curve(2, turning=False), path)
    assert yaml.safe_load(path.read_text())["segments"][0]["D"] == 3
    same(curve(2, turning=False), read_mav_yaml(path), 1e-7)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("segments: []", "has no segments"),
        ("- 1", "has no segments"),
        ("segments: [{N: 2, D: 1}]", "segment 0: it needs numbers N, D, time"),
        ("segments: [{N: 3, D: 1, time: 5, coefficients: [[1, 2]]}]", r"segment 0: D and N are 1 and 3, .* \(1, 2\)"),
        ("segments: [{N: 2, D: 1, time: 0, coefficients: [[1, 2]]}]", "its time must be positive"),
        ("segments: [{N: 2, D: 1, time: 1, coefficients: [[1, .nan]]}]", "every coefficient finite"),
        ("segments: [{N: 2, D: 1, time: 1, coefficients: !!python/object:os.system [[1]]}]", "line 1"),
    ],
)
def test_bad_segments(tmp_path, text, said):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        read_mav_yaml(path)


SHAPES = [minsnap.circle(), minsnap.helix(), minsnap.lemniscate(laps=2.0, ramp=2 * np.pi), minsnap.circle(ramp=0.0)]
SHAPE_WRITERS = [
    (write_crazyflie, read_crazyflie, 1e-4),
    (write_mav_yaml, read_mav_yaml, 1e-6),
    (write_polynomials, lambda path: read_polynomials(path).trajectory, 1e-6),
    (write_npz, read_npz, 1e-6),
    (write_compressed, read_compressed, 3e-3),
]


@pytest.mark.parametrize("shape", SHAPES, ids=["circle", "helix", "eight", "no ramp"])
@pytest.mark.parametrize(("write", "read", "error"), SHAPE_WRITERS)
def test_shapes_are_written_as_polynomials_near_them(tmp_path, shape, write, read, error):
    write(shape, tmp_path / "shape")
    back = read(tmp_path / "shape")
    t = np.linspace(0.0, min(shape.duration, back.duration), 5001)
    assert np.linalg.norm(back(t) - shape(t), axis=1).max() <= error
    assert abs(back.duration - shape.duration) <= 1e-3


def test_paths_of_ones_own_have_no_polynomials(tmp_path):
    class Own(minsnap.Path):
        duration, dim = 1.0, 3

        def _evaluate(self, t, order):
            return np.zeros((len(t), 3))

    for write, _, _ in SHAPE_WRITERS:
        with pytest.raises(InputError, match="no polynomials of a proved error"):
            write(Own(), tmp_path / "own")
    assert not list(tmp_path.iterdir())
