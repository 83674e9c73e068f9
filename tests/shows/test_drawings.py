"""Formations that are drawn: letters, SVG and meshes, their sizes and heights, and what cannot be drawn."""

import struct

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FleetError
from minsnap.shows.formations import (
    along,
    circle,
    grid,
    mesh,
    relaxed,
    spacing_of,
    svg,
    svg_lines,
    text_lines,
)
from minsnap.shows.meshes import read_triangles
from minsnap.shows.show_yaml import read_show
from minsnap.shows.strokes import GLYPHS, MARKS, missing_strokes, stroke_lines
from minsnap.shows.svg_lines import read_lines

SHOW = """
vehicles: {vehicles}
separation: 0.8
limits: {{speed: 3, acceleration: 3}}
home: {{grid: {{spacing: 1.5}}}}
acts: [{{formation: {{{drawn}}}}}]
"""


def show_of(folder, drawn, vehicles=6):
    """The show of one drawing."""
    (folder / "show.yaml").write_text(SHOW.format(vehicles=vehicles, drawn=drawn))
    return read_show(folder / "show.yaml")


def test_formations_have_their_measures():
    assert spacing_of(grid(7, 1.5, 2.0))[0] == pytest.approx(1.5) and np.ptp(grid(7, 1.5, 2.0)[:, 2]) == 0.0
    assert np.ptp(grid(6, 1.0, columns=6)[:, 0]) == pytest.approx(5.0)
    ring = circle(10, 4.0, 3.0)
    assert np.linalg.norm(ring[:, :2], axis=1) == pytest.approx(4.0)
    assert spacing_of(ring)[0] == pytest.approx(8.0 * np.sin(np.pi / 10.0))
    assert spacing_of(minsnap.fleet.Separation(1.0, 2.0).flat(circle(4, 1.0, 4.0, upright=True)))[0] == pytest.approx(
        1.0
    ), "top and bottom"


CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 2) for y in (0, 2) for z in (0, 2))
CUBE += "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3/1 4/2 8/3 7/4\nf 1 3 7 5\nf -7 -5 -1 -3\n"


def test_points_of_a_mesh_lie_spread_on_its_surface(tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    points = mesh(60, tmp_path / "cube.obj", 6.0, 4.0)
    across = np.abs(points - (0.0, 0.0, 7.0)).max(axis=1)
    assert across == pytest.approx(3.0), "on a face of the cube"
    for axis in range(3):
        for side in (-3.0, 3.0):
            assert (np.abs(points[:, axis] - (7.0 if axis == 2 else 0.0) - side) < 1e-9).sum() >= 5, (axis, side)
    assert spacing_of(points)[0] > 0.5 * np.sqrt(6.0 * 36.0 / 60.0), "half the side of the square that each has"
    assert (points == mesh(60, tmp_path / "cube.obj", 6.0, 4.0)).all()
    (tmp_path / "empty.obj").write_text("v 0 0 0\n")
    with pytest.raises(FileError, match="holds no faces"):
        mesh(5, tmp_path / "empty.obj", 1.0)


def test_a_show_takes_meshes_beside_its_file(tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    drawn = "mesh: {file: cube.obj, size: 4, height: 3}"
    (tmp_path / "show.yaml").write_text(SHOW.format(vehicles=6, drawn=drawn))
    assert read_show(tmp_path / "show.yaml").acts[0].points == pytest.approx(mesh(6, tmp_path / "cube.obj", 4.0, 3.0))


SHAPES = {
    "path": ('<path d="M0 0 H4 v2 h-4 z"/>', 12.0),
    "curves": ('<path d="M1,0 A1,1 0 0 1 -1,0 A1 1 0 0 1 1 0Z"/>', 2.0 * np.pi),
    "smooth": ('<path d="M0 0C0 0 1 0 1 0S2 0 2 0q.5 0 1 0t1 0"/>', 4.0),
    "group": ('<g transform="translate(5,5) scale(2)"><line x1="0" y1="0" x2="3" y2="4"/></g>', 10.0),
    "turned": ('<rect transform="rotate(30 1 1)" x="0" y="0" width="2" height="1"/>', 6.0),
    "round": ('<circle cx="3" cy="3" r="2"/><defs><circle r="9"/></defs>', 4.0 * np.pi),
    "polygon": ('<polygon points="0,0 3,0 3,4"/>', 12.0),
    "flags": ('<path d="M1 0a1 1 0 01-2 0 1 1 0 112 0"/>', 2.0 * np.pi),
    "on": ('<path d="M0 0l1 0 1 0M5 5L6 5 7 5Zl0 1"/>', 2.0 + 2.0 + 2.0 + 1.0),
    "quadratics": ('<path d="M0 0Q1 0 2 0T4 0t2 0Q7 0 8 0"/>', 8.0),
    "cubics": ('<path d="M0 0c0 0 1 0 1 0s1 0 1 0S3 0 3 0"/>', 3.0),
    "corners": ('<rect width="4" height="3" rx="1"/>', 2.0 * (2.0 + 1.0) + 2.0 * np.pi),
    "repeated": ('<defs><path id="p" d="M0 0H2"/></defs><use href="#p" x="9"/><use href="#p" y="3"/>', 4.0),
    "hidden": (
        '<path d="M0 0H2"/><path d="M0 0H9" display="none"/><g style="display: none"><path d="M0 0V7"/></g>',
        2.0,
    ),
    "squashed": ('<ellipse rx="1" ry="1" transform="matrix(1 0 0 1 0 0)"/>', 2.0 * np.pi),
}


@pytest.mark.parametrize("name", SHAPES)
def test_drawings_are_read_as_lines_of_their_lengths(tmp_path, name):
    inside, length = SHAPES[name]
    (tmp_path / "a.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{inside}</svg>')
    lines = read_lines(tmp_path / "a.svg")
    assert sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines) == pytest.approx(length, rel=1e-3)


def test_points_of_a_drawing_move_along_its_lines_until_they_are_apart(tmp_path):
    """A star of 200, a logo and a word were refused for one sharp corner, and what would fit was not said."""
    apart = minsnap.Separation(1.5, 1.2)
    lines = text_lines("FLY", 24.0, 5.0)
    points = along(lines, 28)
    assert spacing_of(apart.flat(points))[0] < 1.3
    moved = relaxed(lines, points, apart)
    assert spacing_of(apart.flat(moved))[0] >= 1.5
    dense = np.concatenate(
        [
            one + (two - one) * np.linspace(0, 1, 400)[:, None]
            for row in lines
            for one, two in zip(row, row[1:], strict=False)
        ]
    )
    away = np.linalg.norm(moved[:, None] - dense[None], axis=2).min(axis=1)
    assert away.max() < 0.02, "on the lines"
    show = "vehicles: 28\nseparation: 1.5\ndownwash: 1.2\nlimits: {speed: 4, acceleration: 3}\n"
    show += "home: {grid: {spacing: 2}}\nacts: [{formation: {text: {words: FLY, size: 24, height: 5}}}]\n"
    (tmp_path / "show.yaml").write_text(show)
    assert read_show(tmp_path / "show.yaml").acts[0].points == pytest.approx(moved)
    (tmp_path / "show.yaml").write_text(show.replace("size: 24", "size: 12"))
    with pytest.raises(FleetError, match=r"make it [0-9.]+ times as large") as small:
        read_show(tmp_path / "show.yaml").check()
    larger = 12.0 * float(str(small.value).split("make it ")[1].split()[0])
    (tmp_path / "show.yaml").write_text(show.replace("size: 24", f"size: {larger}"))
    read_show(tmp_path / "show.yaml").check()


def test_a_drawing_stands_upright_with_its_top_above(tmp_path):
    (tmp_path / "a.svg").write_text('<svg><path d="M0 10 L5 0 L10 10"/></svg>')
    points = svg(21, tmp_path / "a.svg", 8.0, 3.0)
    assert not points[:, 1].any() and abs(points[10] - [0.0, 0.0, 11.0]).max() < 0.3
    assert points[:, 2].min() == pytest.approx(3.0, abs=0.5) and np.ptp(points[:, 0]) == pytest.approx(8.0, abs=0.5)


UNKNOWN = '<svg><line transform="tilt(3)" x2="1"/></svg>'


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "is not an SVG drawing"),
        ("no xml", "is not an SVG drawing"),
        ("<svg></svg>", "has no lines: give an SVG with paths"),
        ('<!DOCTYPE s [<!ENTITY a "b">]><svg>&a;</svg>', "declares entities"),
        (UNKNOWN, "is not an SVG drawing"),
        ('<svg><path d="M3 3 L3 3"/><circle r="0"/></svg>', "has no lines"),
        ("<svg><text>HI</text></svg>", "letters become paths in the program that drew it"),
        ('<svg><path d="M0 0 L1"/></svg>', "the path command L has 1 numbers of 2"),
        ('<svg><g id="a"><use href="#a"/></g></svg>', "an element repeats itself"),
    ],
)
def test_what_is_no_drawing_is_refused(tmp_path, content, sentence):
    (tmp_path / "a.svg").write_text(content)
    with pytest.raises(FileError, match=sentence):
        svg(4, tmp_path / "a.svg", 1.0)


def test_size_is_the_largest_extent_and_height_that_of_the_lowest_point_of_all(tmp_path):
    """The size of letters was that of a capital, and the height of an upright circle that of its center."""
    (tmp_path / "a.svg").write_text('<svg><path d="M1 1H9V4H1Z"/></svg>')
    (tmp_path / "cube.obj").write_text(CUBE)
    lines = [text_lines("Ag, g", 20.0, 3.0), text_lines("HI", 20.0, 3.0, outlines=True)]
    drawn = [np.concatenate(each) for each in (*lines, svg_lines(tmp_path / "a.svg", 20.0, 3.0))]
    drawn += [mesh(500, tmp_path / "cube.obj", 20.0, 3.0), circle(8, 10.0, 3.0, upright=True)]
    for points in drawn:
        assert np.ptp(points, axis=0).max() == pytest.approx(20.0, rel=0.02)
        assert points[:, 2].min() == pytest.approx(3.0, abs=0.2)
    for points in (circle(8, 10.0, 3.0), grid(9, 2.0, 3.0)):
        assert points[:, 2] == pytest.approx(3.0)


def test_every_letter_has_strokes_in_its_height():
    assert {*map(chr, range(ord("A"), ord("Z") + 1)), *"abcdefghijklmnopqrstuvwxyz0123456789.,:;!?-+"} <= {*GLYPHS}
    for letter in GLYPHS:
        points = np.concatenate(stroke_lines(letter))
        assert np.isfinite(points).all() and points[:, 1].min() >= -2.1 and points[:, 1].max() <= 7.0, letter
        assert sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in stroke_lines(letter)) >= 0.5, letter
    for letter in "ÄÖÜäöüéèêñçÅíőščŁż":
        assert not missing_strokes(letter), letter
    assert len(MARKS) == 13 and np.concatenate(stroke_lines("Ä"))[:, 1].max() == pytest.approx(7.2)


def test_a_stroke_is_one_line_where_a_font_has_two():
    one, two = text_lines("L", 6.0), text_lines("L", 6.0, outlines=True)
    lengths = [sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in each) for each in (one, two)]
    assert lengths[0] == pytest.approx(6.0 + 3.6) and lengths[1] > 1.6 * lengths[0]


def test_lines_of_a_text_are_below_each_other_in_the_middle():
    points = np.concatenate(text_lines("HELLO\nI", 20.0))
    below = points[points[:, 2] < 0.3 * np.ptp(points[:, 2])]
    assert below[:, 0] == pytest.approx(0.0, abs=1e-9) and np.ptp(points[:, 0]) == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("drawn", "sentence"),
    [
        ("text: {words: 'A中B', size: 9}", "single strokes have no '中' of the text 'A中B': give outlines: true"),
        (
            "text: {words: 'A中B', size: 9, outlines: true}",
            "the font has no '中' of the text 'A中B': give another font",
        ),
        ("text: {words: HI, size: 9, font: Helvetika Nova}", "the font 'Helvetika Nova' is not found, or is none"),
        (
            "text: {words: HI, size: 9, font: none.ttf, outlines: true}",
            "none.ttf' is not found, or is none: give a font in TrueType or OpenType, or leave it out",
        ),
        ("circle: {height: 9}", "circle has no radius: give it"),
        ("text: {words: '  ', size: 9}", "has no letters: give some"),
        ("text: {words: HI}", "has no size: give it"),
        ("svg: {file: point.svg, size: 9}", "has no lines"),
        ("mesh: {file: point.obj, size: 9}", "are one point: give a mesh that has an extent"),
        ("mesh: {file: part.stl, size: 9}", "it has 90 bytes, not as many as 7 faces take"),
        ("mesh: {file: a.fbx, size: 9}", "is no mesh by its ending: give one of .obj, .stl, .ply"),
        ("mesh: {file: away.obj, size: 9}", "cannot be read|does not exist|No such file"),
    ],
)
def test_what_cannot_be_drawn_is_said_before_anything_is_planned(tmp_path, drawn, sentence):
    (tmp_path / "point.svg").write_text('<svg><path d="M3 3h0"/></svg>')
    (tmp_path / "point.obj").write_text("v 1 1 1\nf 1 1 1\n")
    (tmp_path / "part.stl").write_bytes(bytes(80) + struct.pack("<I", 7) + bytes(6))
    (tmp_path / "a.fbx").write_text("x")
    with pytest.raises((FileError, FleetError), match=sentence):
        show_of(tmp_path, drawn)


TETRAHEDRON = np.array([[[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 0, 0], [2, 0, 0], [0, 0, 2]]], dtype=float)


def _stl_text():
    rows = ["solid t"]
    for face in TETRAHEDRON:
        rows += ["facet normal 0 0 1", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in face), "endloop"]
    return "\n".join([*rows, "endsolid t"]).encode()


def _stl_bytes():
    faces = [struct.pack("<12fH", 0, 0, 1, *face.ravel(), 0) for face in TETRAHEDRON]
    return b"solid is no text here".ljust(80) + struct.pack("<I", len(faces)) + b"".join(faces)


def _ply(form):
    corners, faces = TETRAHEDRON.reshape(-1, 3), [[0, 1, 2], [3, 4, 5]]
    head = f"ply\nformat {form} 1.0\ncomment made here\nelement vertex {len(corners)}\nproperty double x\n"
    head += "property double y\nproperty double z\nproperty uchar red\nelement face 2\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    if form == "ascii":
        rows = [f"{x} {y} {z} 9" for x, y, z in corners] + ["3 " + " ".join(map(str, face)) for face in faces]
        return (head + "\n".join(rows)).encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3dB", *corner, 9) for corner in corners)
    return head.encode() + body + b"".join(struct.pack(f"{order}B3i", 3, *face) for face in faces)


MESHES = {"t.stl": _stl_text(), "b.stl": _stl_bytes(), "t.ply": _ply("ascii")}
MESHES |= {f"{end}.ply": _ply(f"binary_{end}_endian") for end in ("little", "big")}


@pytest.mark.parametrize("name", MESHES)
def test_the_same_mesh_has_the_same_faces_in_every_format(tmp_path, name):
    (tmp_path / name).write_bytes(MESHES[name])
    assert read_triangles(tmp_path / name) == pytest.approx(TETRAHEDRON)
    assert len(mesh(9, tmp_path / name, 4.0)) == 9
    (tmp_path / name).write_bytes(MESHES[name][:-9])
    with pytest.raises(FileError):
        read_triangles(tmp_path / name)


def test_a_cloud_of_points_is_a_mesh_of_points(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    (tmp_path / "c.ply").write_text(head + "0 0 0\n1 0 0\n0 1 0\n0 0 2\n1 1 0\n")
    points = mesh(5, tmp_path / "c.ply", 2.0)
    assert sorted(points[:, 2].round(9)) == [0, 0, 0, 0, 2] and spacing_of(points)[0] == pytest.approx(1.0)
