"""Maps from files: each form as its programs write it, its choices, and damaged files."""

import io
import struct

import numpy as np
import pytest
from PIL import Image

from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes import plan_through, read_map
from minsnap.paths.routes.clouds import read_cloud
from minsnap.paths.routes.pcd import decompress

YAML = (
    "image: {image}\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
PICTURE = np.array([[0, 254, 205, 254], [254, 254, 254, 0], [254, 100, 254, 254]], dtype=np.uint8)
POINTS = np.array([[0.0, 0.0, 0.5], [1.0, -2.0, 3.25], [0.5, 0.25, 0.125]])


def map_server(folder, picture=PICTURE, name="map.pgm", text=YAML):
    Image.fromarray(picture).save(folder / name)
    (folder / "map.yaml").write_text(text.format(image=name))
    return folder / "map.yaml"


@pytest.mark.parametrize("further", ["map_type: occupancy", "date: [1, [2]]\nframe_id: map\n7: null"])
def test_entries_that_map_server_reads_over_are_read_over(tmp_path, further):
    """A shipped map, which map_server reads, was refused for its last key."""
    typed = map_server(tmp_path, text=f"{YAML}\n{further}\n")
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


@pytest.mark.parametrize("values", [np.array([[0, 1.5, 0, 0]]), np.array([[0, 150, 255]]), np.array([["a", "b"]])])
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
        "named.csv": b"# of a camera\nX [m],Y [m],Z [m]\n" + text.replace(b" ", b","),
        "plain.csv": text.replace(b" ", b"; ") + b"\n\n",
        "double.npy": npy(POINTS),
        "single.npy": npy(POINTS.astype("<f4")),
    }


def npy(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


@pytest.mark.parametrize("name", sorted(clouds()))
def test_every_form_of_a_cloud_holds_the_same_points(tmp_path, name):
    (tmp_path / name).write_bytes(clouds()[name])
    if not name.endswith(".npy"):
        assert np.array_equal(read_cloud(tmp_path / name), POINTS)
    found = read_map(tmp_path / name, 0.1, ends=[(0, 0, 1), (3, 0, 1)], clearance=0.2)
    cells = np.unique(np.floor((POINTS - found.lower) / 0.1), axis=0)
    assert found.occupied.sum() == len(cells) and found.holds(np.array([3.0, 0.0, 1.0]))
    assert all(found.occupied[tuple(found.cell(point))] for point in POINTS)


GAPS = np.array([(1.0, 2.0, 0.5), (np.nan, 0.0, 0.0), (0.5, 0.25, np.inf), (2.0, 2.0, 1.0)])


def clouds_with_gaps():
    text = b"\n".join(" ".join(map(str, row)).encode() for row in GAPS)
    flat = GAPS.astype("<f4")
    block = literal_lzf(flat.T.tobytes())
    header = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    return {
        "ascii.pcd": pcd("x y z", "ascii", text, 4),
        "binary.pcd": pcd("x y z", "binary", flat.tobytes(), 4),
        "packed.pcd": pcd("x y z", "binary_compressed", struct.pack("<II", len(block), flat.nbytes) + block, 4),
        "ascii.ply": header + b"end_header\n" + text,
        "plain.xyz": text,
        "double.npy": npy(GAPS),
        "single.npy": npy(flat),
        "plane.npy": npy(GAPS[:, 1:]),
    }


@pytest.mark.parametrize("name", sorted(clouds_with_gaps()))
def test_points_of_a_cloud_that_are_not_finite_are_counted(tmp_path, name):
    """They were left out without a word from arrays."""
    (tmp_path / name).write_bytes(clouds_with_gaps()[name])
    lost, first = (1, 2) if name == "plane.npy" else (2, 1)
    with pytest.warns(UserWarning, match=rf"{name}: {lost} of 4 points are not finite, the first is point {first}: "):
        found = read_map(tmp_path / name, 0.1)
    kept = GAPS[np.isfinite(GAPS).all(axis=1)] if lost == 2 else GAPS[[0, 1, 3], 1:]
    assert found.occupied.sum() == len(kept) and all(found.occupied[tuple(found.cell(point))] for point in kept)


@pytest.mark.parametrize("name", sorted(clouds()))
def test_a_damaged_cloud_is_refused_in_one_sentence(tmp_path, name):
    content, draw = clouds()[name], np.random.default_rng(1)
    for cut in draw.integers(0, len(content), 40):
        damaged = bytearray(content[: int(cut)])
        if damaged and cut % 2:
            damaged[int(draw.integers(len(damaged)))] ^= 0x55
        (tmp_path / name).write_bytes(damaged)
        try:
            assert read_map(tmp_path / name, 0.5).occupied.any()
        except (FileError, CorridorError) as error:
            assert name in str(error) and "\n" not in str(error)


@pytest.mark.parametrize("row", ["1,5 2,5 3,0", "1,5;2,5;3,0", "1;2;3", "1 2"])
def test_text_with_decimal_commas_is_no_cloud(tmp_path, row):
    """The first was read as (1, 5, 2)."""
    (tmp_path / "cloud.xyz").write_text(f"{row}\n")
    with pytest.raises(FileError, match="x,? y,? z"):
        read_cloud(tmp_path / "cloud.xyz")


@pytest.mark.parametrize("name", ["plane.csv", "plane.npy"])
def test_a_cloud_in_the_plane_is_a_plane_map(tmp_path, name):
    content = npy(POINTS[:, :2]) if name == "plane.npy" else b"x,y\n0,0\n1,-2\n0.5,0.25\n"
    (tmp_path / name).write_bytes(content)
    for ends in ([(0, 0), (3, 0)], [(0, 0, 1), (3, 0, 1)]):
        found = read_map(tmp_path / name, 0.1, ends=ends, clearance=0.2)
        assert found.dim == 2 and found.occupied.sum() == 3 and found.holds(np.array([3.0, 0.0]))
        assert all(found.occupied[tuple(found.cell(point))] for point in POINTS[:, :2])
        assert found.lower == pytest.approx([-1.2, -3.2])


@pytest.mark.slow
def test_a_cloud_flies_as_its_points_do(tmp_path):
    """An array of points was refused: its values were no percentages."""
    posts = np.array([(2.0, y, z) for y in np.arange(-1, 1.01, 0.1) for z in np.arange(0, 3, 0.2)])
    np.save(tmp_path / "posts.npy", posts)
    route = plan_through(tmp_path / "posts.npy", (0, 0, 1), (4, 0, 1), 0.3, resolution=0.2)
    assert route.distance >= 0.3 - 1e-9
    flown = route(np.linspace(0.0, route.duration, 500))
    assert np.linalg.norm(flown[:, None] - posts, axis=2).min() >= 0.3


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("c.csv", b"x,z\n1,2\n", "c.csv, line 1: no column y"),
        ("c.csv", b"x,y,z,w\n1,2,3,4\n", "c.csv, line 1: column 'w' is not known"),
        ("c.csv", b"1,2,3,4\n", "4 numbers without a header: the points of a cloud are x,y or x,y,z"),
        ("c.csv", b"1,5;2.5;3,0\n", "line 1: semicolons and commas are mixed"),
        ("c.csv", b"x,y,z\n1,2,3\n1,nan,3\n", "c.csv, line 3: y is 'nan'"),
        ("c.csv", b"", "c.csv is empty"),
        ("c.npy", npy(np.full((4, 3), np.nan)), "c.npy holds no points"),
        ("c.npy", npy(np.zeros((0, 3))), "c.npy holds no points"),
        ("c.npy", npy(np.array([[1, 2, 300], [4, 5, 6]])), "c.npy has values up to 300: .*points of a cloud are float"),
    ],
)
def test_a_cloud_that_is_none_says_where(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises((FileError, CorridorError), match=message):
        read_map(tmp_path / name, 0.1)


def test_a_table_too_large_for_one_is_refused_unread(tmp_path):
    with open(tmp_path / "large.csv", "wb") as file:
        file.truncate(64_000_001)
    with pytest.raises(FileError, match="large.csv has 64 MB: files of this kind are read up to 64 MB"):
        read_map(tmp_path / "large.csv", 0.1)


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
        (("negate: 0", "negated: 1"), "'negated' is not known"),
        (("occupied_thresh", "ocupied_tresh"), "'ocupied_tresh' is not known"),
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
        (tmp_path / "plain.xyz", {"resolution": 0.1, "ends": [(1, 2), (1, 2, 3)]}, "both with two, or both"),
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
