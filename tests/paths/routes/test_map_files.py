"""Maps from files: each form as its programs write it, its choices, and damaged files."""

import struct

import numpy as np
import pytest
from PIL import Image

from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes import read_map
from minsnap.paths.routes.map_files import decompress, read_cloud

YAML = (
    "image: {image}\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
PICTURE = np.array([[0, 254, 205, 254], [254, 254, 254, 0], [254, 100, 254, 254]], dtype=np.uint8)
POINTS = np.array([[0.0, 0.0, 0.5], [1.0, -2.0, 3.25], [0.5, 0.25, 0.125]])


def map_server(folder, picture=PICTURE, name="map.pgm", text=YAML):
    Image.fromarray(picture).save(folder / name)
    (folder / "map.yaml").write_text(text.format(image=name))
    return folder / "map.yaml"


def test_the_type_of_a_map_of_nav2_is_read_over(tmp_path):
    """A shipped map, which map_server reads, was refused for its last key."""
    typed = map_server(tmp_path, text=YAML + "\nmap_type: occupancy\n")
    again = read_map(typed).occupied
    assert np.array_equal(again, read_map(map_server(tmp_path)).occupied)


@pytest.mark.parametrize("name", ["map.pgm", "map.png"])
def test_map_server_picture_has_its_last_row_at_the_origin(tmp_path, name):
    found = read_map(map_server(tmp_path, name=name))
    assert found.occupied.shape == (4, 3)
    assert np.array_equal(found.occupied.T[::-1], [[1, 0, 1, 0], [0, 0, 0, 1], [0, 1, 0, 0]])
    assert found.lower == pytest.approx([-1.0, 2.0]) and found.resolution == pytest.approx([0.05, 0.05])


def test_a_text_picture_is_the_same_as_a_binary_one(tmp_path):
    rows = "\n".join(" ".join(map(str, row)) for row in PICTURE)
    (tmp_path / "text.pgm").write_text(f"P2\n# map\n4 3\n255\n{rows}\n")
    (tmp_path / "text.yaml").write_text(YAML.format(image="text.pgm"))
    assert np.array_equal(read_map(tmp_path / "text.yaml").occupied, read_map(map_server(tmp_path)).occupied)


@pytest.mark.parametrize(
    ("pixels", "cells"),
    [
        (np.array([[0, 100, 200, 254]], dtype=np.uint16) * 257, "#??."),
        (np.array([[300, 30000, 65535]], dtype=np.uint16), "#?."),
        (np.array([[[255, 255, 0], [0, 255, 255], [255, 0, 0], [255] * 3]], dtype=np.uint8), "??#."),
        (np.array([[[255, 0], [255, 128], [255, 255], [0, 255]]], dtype=np.uint8), "??.#"),
    ],
    ids=["16 bits", "16 bits, all but black", "colours", "not opaque"],
)
def test_pictures_of_other_kinds_are_read_as_map_server_reads_them(tmp_path, pixels, cells):
    file = map_server(tmp_path, pixels, name="map.png")
    assert read_map(file).occupied.ravel().tolist() == [cell != "." for cell in cells]
    assert read_map(file, unknown="free").occupied.ravel().tolist() == [cell == "#" for cell in cells]


def test_unknown_cells_and_thresholds_are_choices(tmp_path):
    file = map_server(tmp_path)
    free = read_map(file, unknown="free").occupied.T[::-1]
    assert np.array_equal(free, [[1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
    low = read_map(file, threshold=0.6).occupied.T[::-1]
    assert np.array_equal(low, [[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 0, 0]])
    assert read_map(file, threshold=0.1).occupied.sum() == 4


def test_negate_and_raw(tmp_path):
    negated = read_map(map_server(tmp_path, 255 - PICTURE, text=YAML.replace("negate: 0", "negate: 1")))
    assert np.array_equal(negated.occupied, read_map(map_server(tmp_path)).occupied)
    raw = np.array([[0, 100, 255, 49]], dtype=np.uint8)
    assert read_map(map_server(tmp_path, raw, text=YAML + "mode: raw\n")).occupied.ravel().tolist() == [0, 1, 1, 0]


@pytest.mark.parametrize(
    ("values", "occupied"),
    [
        (np.array([[True, False]]), [1, 0]),
        (np.array([[0, 1]], dtype=np.int32), [0, 1]),
        (np.array([[0, 100, 49, 50, -1]], dtype=np.int8), [0, 1, 0, 1, 1]),
        (np.array([[0, 255]], dtype=np.uint8), [0, 1]),
        (np.array([[0.0, 0.49, 0.5, 1.0, np.nan, -1.0]]), [0, 0, 1, 1, 1, 1]),
    ],
)
def test_values_of_arrays_are_read_as_programs_write_them(tmp_path, values, occupied):
    np.save(tmp_path / "map.npy", values)
    found = read_map(tmp_path / "map.npy", 0.1)
    assert found.occupied.ravel().tolist() == [bool(value) for value in occupied]


@pytest.mark.parametrize("values", [np.array([[0.0, 1.5]]), np.array([[0, 150, 255]]), np.array([["a", "b"]])])
def test_values_of_no_kind_are_refused(tmp_path, values):
    np.save(tmp_path / "map.npy", values)
    with pytest.raises((CorridorError, FileError)):
        read_map(tmp_path / "map.npy", 0.1)


def pcd(fields, kind, data, count, sizes="4 4 4", types="F F F"):
    lines = ["# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7", f"FIELDS {fields}", f"SIZE {sizes}"]
    lines += [f"TYPE {types}", f"COUNT {' '.join('1' for _ in fields.split())}", f"WIDTH {count}", "HEIGHT 1"]
    return "\n".join([*lines, "VIEWPOINT 0 0 0 1 0 0 0", f"POINTS {count}", f"DATA {kind}\n"]).encode() + data


def literal_lzf(content):
    """Return an LZF block of literal runs only."""
    runs = [content[at : at + 32] for at in range(0, len(content), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def with_intensity():
    layout = np.dtype([("intensity", "<u1"), ("x", "<f8"), ("y", "<f8"), ("z", "<f8")])
    cloud = np.zeros(3, dtype=layout)
    for axis, values in zip("xyz", POINTS.T, strict=True):
        cloud[axis] = values
    return cloud


def ply(form, body):
    header = (
        f"ply\nformat {form} 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    )
    return (
        header.encode()
        + b"property uchar red\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
        + body
    )


def clouds():
    text = "\n".join(" ".join(map(str, row)) for row in POINTS).encode()
    flat = POINTS.astype("<f4")
    block = literal_lzf(flat.T.tobytes())
    coloured = np.zeros(3, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("red", "u1")])
    for axis, values in zip("xyz", POINTS.T, strict=True):
        coloured[axis] = values
    rows = b"\n".join(b" ".join(str(v).encode() for v in row) + b" 7" for row in POINTS)
    packed = struct.pack("<II", len(block), flat.nbytes) + block
    return {
        "ascii.pcd": pcd("x y z", "ascii", text, 3),
        "binary.pcd": pcd("intensity x y z", "binary", with_intensity().tobytes(), 3, "1 8 8 8", "U F F F"),
        "packed.pcd": pcd("x y z", "binary_compressed", packed, 3),
        "ascii.ply": ply("ascii", rows),
        "little.ply": ply("binary_little_endian", coloured.astype(coloured.dtype.newbyteorder("<")).tobytes()),
        "big.ply": ply("binary_big_endian", coloured.astype(coloured.dtype.newbyteorder(">")).tobytes()),
        "plain.xyz": b"# x y z\n" + text,
        "commas.xyz": text.replace(b" ", b","),
    }


@pytest.mark.parametrize("name", sorted(clouds()))
def test_every_form_of_a_cloud_holds_the_same_points(tmp_path, name):
    (tmp_path / name).write_bytes(clouds()[name])
    assert np.array_equal(read_cloud(tmp_path / name), POINTS)
    found = read_map(tmp_path / name, 0.1, ends=[(0, 0, 1), (3, 0, 1)], clearance=0.2)
    cells = np.unique(np.floor((POINTS - found.lower) / 0.1), axis=0)
    assert found.occupied.sum() == len(cells) and found.holds(np.array([3.0, 0.0, 1.0]))
    assert all(found.occupied[tuple(found.cell(point))] for point in POINTS)


@pytest.mark.parametrize("name", sorted(clouds()))
def test_a_damaged_cloud_is_refused_in_one_sentence(tmp_path, name):
    content, draw = clouds()[name], np.random.default_rng(1)
    for cut in draw.integers(0, len(content), 40):
        damaged = bytearray(content[: int(cut)])
        if damaged and cut % 2:
            damaged[int(draw.integers(len(damaged)))] ^= 0x55
        (tmp_path / name).write_bytes(damaged)
        try:
            assert read_cloud(tmp_path / name).shape[1] == 3
        except FileError as error:
            assert name in str(error) and "\n" not in str(error)


@pytest.mark.parametrize("row", ["1,5 2,5 3,0", "1,5;2,5;3,0", "1;2;3", "1 2"])
def test_text_with_decimal_commas_is_no_cloud(tmp_path, row):
    """The first was read as (1, 5, 2)."""
    (tmp_path / "cloud.xyz").write_text(f"{row}\n")
    with pytest.raises(FileError, match="x,? y,? z"):
        read_cloud(tmp_path / "cloud.xyz")


def test_lzf_repeats_what_it_has_just_written():
    assert decompress(bytes([0, 65, 0x60, 0]), 6) == b"AAAAAA"
    assert decompress(bytes([1, 65, 66, 0xE0, 3, 1]), 14) == b"AB" * 7
    with pytest.raises(ValueError, match="before the block"):
        decompress(bytes([0, 65, 0x60, 9]), 6)
    with pytest.raises(ValueError, match="another size"):
        decompress(bytes([0, 65]), 6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("resolution: 0.05\n", ""), "map.yaml has no resolution"),
        (("negate: 0", "colour: 1"), "'colour' is not known"),
        (("[-1.0, 2.0, 0.0]", "[-1.0, 2.0, 0.5]"), "the map is turned by 0.5 rad"),
        (("0.05", "-0.05"), "resolution is -0.05"),
        (("{image}", "[1]"), "image is"),
        (("{image}", "nothing.pgm"), "nothing.pgm cannot be read"),
        (("{image}", "map.yaml"), "map.yaml (is not a picture|cannot be read)"),
        (("occupied_thresh: 0.65", "occupied_thresh: 0.1"), "two probabilities, in order"),
    ],
)
def test_a_description_that_is_wrong_is_refused(tmp_path, change, message):
    file = map_server(tmp_path, text=YAML.replace(*change))
    with pytest.raises(FileError, match=message):
        read_map(file)


def test_arguments_that_do_not_go_with_a_file_are_refused(tmp_path):
    np.save(tmp_path / "map.npy", np.zeros((4, 4)))
    (tmp_path / "plain.xyz").write_text("1 2 3\n")
    for file, arguments, message in (
        (map_server(tmp_path), {"resolution": 0.1}, "says its resolution and origin"),
        (tmp_path / "map.npy", {}, "does not say how large its cells are"),
        (tmp_path / "map.npy", {"resolution": 0.1, "threshold": 2.0}, "threshold is 2.0"),
        (tmp_path / "plain.xyz", {"resolution": 0.1, "threshold": 0.5}, "no probabilities"),
        (tmp_path / "plain.xyz", {"resolution": 0.1, "ends": [(1, 2)]}, "three coordinates"),
        (tmp_path / "plain.xyz", {"resolution": 1e-4}, "give a larger resolution"),
    ):
        with pytest.raises(CorridorError, match=message):
            read_map(file, **arguments)
    with pytest.raises(FileError, match="is no map: give one that ends in"):
        read_map(tmp_path / "map.txt", 0.1)


def test_points_too_far_away_for_cells_are_refused(tmp_path):
    (tmp_path / "far.xyz").write_text("0 1e30 0\n1 1e30 0\n")
    with pytest.raises(CorridorError, match="far.xyz lies up to 1e\\+30 m from the origin"):
        read_map(tmp_path / "far.xyz", 0.5)
