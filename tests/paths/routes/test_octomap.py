"""Octrees of OctoMap: random ones from a writer of their own, maps too large for one, and damaged files."""

import numpy as np
import pytest
from octree_files import cells, octree_file, old_file, put

from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes import octree_cells, plan_through, read_map

MIDDLE = 1 << 15
RES = 0.25


def random_tree(seed, count=60):
    """Return a tree of cubes of 1 to 8 cells within 16 cells of the middle."""
    random, tree, filled = np.random.default_rng(seed), {}, np.zeros((32, 32, 32), dtype=bool)
    for _ in range(count):
        side = 1 << int(random.integers(4))
        place = side * random.integers(0, 32 // side, 3)
        block = tuple(slice(p, p + side) for p in place)
        if not filled[block].any():
            filled[block] = True
            odds = float(np.float32(random.choice([-2.0, -0.4, 0.0, 0.85, 3.5])))
            put(tree, (place + MIDDLE - 16).tolist(), 16 - (side.bit_length() - 1), odds)
    return tree


def wanted(tree, grid, unknown, odds=0.0):
    """Return which cells of a map are occupied, cell by cell."""
    found = np.full(grid.occupied.shape, unknown == "occupied")
    first = np.round(grid.lower / RES).astype(int) + MIDDLE
    for corner, side, value in cells(tree):
        low = np.maximum(np.array(corner) - first, 0)
        high = np.maximum(np.array(corner) + side - first, 0)
        found[tuple(map(slice, low, high))] = value >= odds
    return found


FORMS = {
    "binary.bt": lambda tree: octree_file(tree, True),
    "old.bt": old_file,
    "full.ot": lambda tree: octree_file(tree, False),
    "colour.ot": lambda tree: octree_file(tree, False, kind="ColorOcTree"),
}


@pytest.mark.parametrize("unknown", ["occupied", "free"])
@pytest.mark.parametrize("name", FORMS)
def test_every_form_of_an_octree_is_the_same_map(tmp_path, name, unknown):
    for seed in range(5):
        tree = random_tree(seed)
        (tmp_path / name).write_bytes(FORMS[name](tree))
        found = read_map(tmp_path / name, unknown=unknown)
        assert np.array_equal(found.occupied, wanted(tree, found, unknown))
        corners = np.array([(corner, np.array(corner) + side) for corner, side, _ in cells(tree)]) - MIDDLE
        low, high = RES * corners[:, 0].min(axis=0), RES * corners[:, 1].max(axis=0)
        beyond = 0.25 if unknown == "occupied" else 1.0
        assert found.lower == pytest.approx(low - [beyond, beyond, 0.25 if unknown == "occupied" else 0.0])
        assert found.upper == pytest.approx(high + beyond)


def test_a_threshold_is_a_probability_of_full_trees_alone(tmp_path):
    tree = random_tree(7)
    for name in ("full.ot", "binary.bt"):
        (tmp_path / name).write_bytes(FORMS[name](tree))
    found = read_map(tmp_path / "full.ot", threshold=0.6)
    assert np.array_equal(found.occupied, wanted(tree, found, "occupied", np.log(0.6 / 0.4)))
    with pytest.raises(CorridorError, match="binary.bt is binary: it has no probabilities"):
        read_map(tmp_path / "binary.bt", threshold=0.6)


def room():
    """Return a free room of 16 cells a side above the middle, with a wall of 10 cells in it."""
    tree = {}
    for x in range(16):
        for y in range(16):
            for z in range(16):
                put(tree, (MIDDLE + x, MIDDLE + y, MIDDLE + z), 16, 3.5 if x == 8 and y < 10 else -2.0)
    return tree


@pytest.mark.slow
def test_a_flight_keeps_away_from_what_is_occupied_and_unknown(tmp_path):
    (tmp_path / "room.bt").write_bytes(octree_file(room(), True))
    route = plan_through(tmp_path / "room.bt", (1, 1, 2), (3.2, 1, 2), 0.3)
    flown = route(np.linspace(0.0, route.duration, 400))
    beside = np.linalg.norm(np.maximum(np.abs(flown[:, :2] - (2.125, 1.25)) - (0.125, 1.25), 0.0), axis=1)
    assert beside.min() >= 0.3 - 1e-9 and flown.min() >= 0.3 - 1e-9 and flown.max() <= 3.7 + 1e-9


def test_a_map_too_large_is_cut_around_start_and_goal(tmp_path, monkeypatch):
    """A free cube of 4096 cells a side has 7e10 cells."""
    tree = random_tree(3)
    put(tree, (0, 0, 0), 4, -2.0)
    (tmp_path / "large.bt").write_bytes(octree_file(tree, True))
    with pytest.raises(CorridorError, match="at most 50000000 are searched; say which points"):
        read_map(tmp_path / "large.bt")
    monkeypatch.setattr(octree_cells, "LARGEST_MAP", 20_000)
    ends = np.array([(-1.0, 0.3, 0.3), (1.0, 0.3, 0.3)])
    for unknown in ("occupied", "free"):
        found = read_map(tmp_path / "large.bt", unknown=unknown, ends=ends)
        assert 10_000 < found.occupied.size <= 20_000 and all(map(found.holds, ends))
        inner = (slice(1, -1),) * 3
        assert np.array_equal(found.occupied[inner], wanted(tree, found, unknown)[inner])
        rim = np.ones_like(found.occupied)
        rim[inner] = False
        assert found.occupied[rim].all()
    with pytest.raises(CorridorError, match="start and goal are too far apart in large.bt"):
        read_map(tmp_path / "large.bt", ends=[(-99, -99, -99), (99, 99, 99)])


def test_ends_far_beyond_the_tree_are_no_trouble(tmp_path):
    (tmp_path / "full.ot").write_bytes(octree_file(random_tree(1), False))
    (tmp_path / "fine.ot").write_bytes(octree_file(random_tree(1), False, 1e-12))
    for name in ("full.ot", "fine.ot"):
        with pytest.raises(CorridorError, match="too far apart"):
            read_map(tmp_path / name, ends=[(1e308, 0, 0), (0, -1e308, np.nan)])


def damage(content, random):
    body = content.index(b"data\n") + 5 if b"data\n" in content else 16
    damaged = bytearray(content)
    kind = int(random.integers(3))
    if kind == 0:
        del damaged[int(random.integers(len(damaged))) :]
    elif kind == 1:
        damaged[int(random.integers(body, len(damaged)))] ^= 1 << int(random.integers(8))
    else:
        damaged[int(random.integers(len(damaged)))] = int(random.integers(256))
    return bytes(damaged)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMS)
def test_a_damaged_octree_is_one_sentence(tmp_path, name):
    content, random, refused = FORMS[name](random_tree(2, 20)), np.random.default_rng(4), 0
    for _ in range(150):
        (tmp_path / name).write_bytes(damage(content, random))
        try:
            assert read_map(tmp_path / name).dim == 3
        except (FileError, CorridorError) as error:
            refused += 1
            assert name in str(error) and "\n" not in str(error) and len(str(error)) < 300
    assert refused > 40


def binary(body, size, head="# Octomap OcTree binary file\nid OcTree\n", res="0.1"):
    return f"{head}size {size}\nres {res}\ndata\n".encode() + body


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is not an octree of OctoMap"),
        (b"# Octomap OcTree binary file\nid OcTree\n", "has no line 'data'"),
        (b"# something else of more than 16 bytes\n", "begins neither with '# Octomap OcTree binary file' nor"),
        (binary(b"\0\0", 1), "knows of no cell whether it is occupied"),
        (binary(b"", 0), "has 0 nodes: octrees of 1 to 20000000 are read"),
        (binary(b"\1\0", 3), "has 2 nodes where its header says 3"),
        (binary(b"\3\0", 9), "ends before its nodes do"),
        (binary(b"\3\0" * 17, 99), "more than 15 levels below the first"),
        (binary(b"\1\0", 30_000_000), "has 30000000 nodes: octrees of 1 to"),
        (binary(b"\1\0", -2), "has -2 nodes"),
        (binary(b"\1\0", 2, res="-1"), "res is -1"),
        (binary(b"\1\0", 2, res="nan"), "res is nan"),
        (binary(b"\1\0", 2, "# Octomap OcTree binary file\n"), "is not an octree"),
        (binary(b"\0" * 5, 1, "# Octomap OcTree file\nid Countings\n"), "of kind 'Countings'"),
    ],
)
def test_what_is_no_octree_says_why(tmp_path, content, message):
    (tmp_path / "map.bt").write_bytes(content)
    with pytest.raises(FileError, match=message):
        read_map(tmp_path / "map.bt")


def test_arguments_that_an_octree_says_itself_are_refused(tmp_path):
    (tmp_path / "map.ot").write_bytes(octree_file(random_tree(1), False))
    with pytest.raises(CorridorError, match="says its resolution and origin"):
        read_map(tmp_path / "map.ot", 0.1)
    with pytest.raises(CorridorError, match="three coordinates"):
        read_map(tmp_path / "map.ot", ends=[(0, 0), (1, 1)])
