"""Maps of OctoMap: octrees of occupied and free cubes, binary (``.bt``) and full (``.ot``).

A. Hornung and others, "OctoMap: an efficient probabilistic 3D mapping framework based on octrees", Autonomous Robots
2013. The bytes are those that its library writes (version 1.10: ``OccupancyOcTreeBase::writeBinaryNode`` and
``OcTreeBaseImpl::writeNodesRecurs``): nodes in the order parent, first child with all below it, second child, … Child i
lies towards larger x, y and z where bits 0, 1 and 2 of i are set. A binary node is 16 bits, two for each child: 0 where
nothing is known, 1 free, 2 occupied, 3 a node of its own. A full node is the logarithm of its odds as a float, three
bytes of colour in a ``ColorOcTree``, and a bit for each child that it has.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, FloatArray, IntArray, NDArray
from minsnap.basics.checks import check_number
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.cell_values import Reading
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.octree_cells import DEPTH, Cubes, cubes_map

TREES = (".bt", ".ot")
"""Endings of octrees."""

MOST_NODES = 20_000_000
"""Nodes of the largest octree that is read."""

BINARY, FULL = b"# Octomap OcTree binary file", b"# Octomap OcTree file"
"""How files begin."""

OLD = struct.Struct("<idI")
"""Header of binary files before OctoMap 1.0: the number 3, the side of a cell, the number of nodes."""

LONGEST_HEADER = 10_000
"""Bytes among which the line is that ends a header."""

ODDS: list[tuple[str, str]] = [("odds", "<f4")]
CHILDREN: list[tuple[str, str]] = [("children", "u1")]
PLAIN = np.dtype(ODDS + CHILDREN)
NODES = {
    "OcTree": PLAIN,
    "1": PLAIN,
    "OcTreeStamped": PLAIN,
    "ColorOcTree": np.dtype([*ODDS, ("colour", "V3"), *CHILDREN]),
}
"""Nodes of full octrees, by their kind."""

LARGEST_TREE = MOST_NODES * max(layout.itemsize for layout in NODES.values()) + LONGEST_HEADER
"""Bytes of the largest file that is read."""

OCCUPIED_CHILD, OWN_NODE = 2, 3
"""Children of a binary node of which something is known, beside free ones."""


@dataclass(frozen=True)
class Header:
    """What stands before the nodes: whether they are binary, their kind and number, the side of a cell [m], its end."""

    binary: bool
    kind: str
    nodes: int
    resolution: float
    end: int


def read_octomap(path: FileName, how: Reading, ends: FloatArray, clearance: float) -> GridMap:
    """Read an octree.

    Parameters
    ----------
    path : str or path
        ``.bt`` or ``.ot``; the first line says which of both it is.
    how : Reading
        What unknown cells count as, and the probability from which cells of a full octree are occupied.
    ends : ndarray, shape (m, 3)
        Points that the map must hold [m]: it is cut to a box around them where it would be too large.
    clearance : float
        [m]; where unknown cells are free, the map reaches so far past all cells.

    Returns
    -------
    GridMap

    Raises
    ------
    FileError
        If it cannot be read, is damaged, has too many nodes, or knows of no cell.
    CorridorError
        If a threshold is given for a binary octree, or the map would be too large.
    """
    with reading(path, "an octree of OctoMap"):
        content = read_bytes(path, LARGEST_TREE)
        header = _header(path, content)
        if not 0 < header.nodes <= MOST_NODES:
            raise FileError(f"{path} has {header.nodes} nodes: octrees of 1 to {MOST_NODES} are read")
        cubes = (_binary_cubes if header.binary else _full_cubes)(path, content, header)
        if not len(cubes.side):
            raise FileError(f"{path} knows of no cell whether it is occupied")
    if header.binary and how.threshold is not None:
        raise CorridorError(f"{path} is binary: it has no probabilities, leave the threshold out")
    return cubes_map(cubes, header.resolution, how, ends, clearance, Path(path).name)


def _header(path: FileName, content: bytes) -> Header:
    first = content[:LONGEST_HEADER].split(b"\n", 1)[0]
    if first.startswith((BINARY, FULL)):
        end = content.find(b"\ndata", 0, LONGEST_HEADER)
        if end < 0:
            raise FileError(f"{path} has no line 'data': it is cut off or damaged")
        lines = content[:end].decode("ascii").splitlines()
        words: Mapping[str, list[str]] = {line.split()[0]: line.split()[1:] for line in lines if line.split()}
        kind, nodes, side = words["id"][0], int(words["size"][0]), float(words["res"][0])
        header = Header(first.startswith(BINARY), kind, nodes, side, content.index(b"\n", end + 1) + 1)
    else:
        number, side, nodes = OLD.unpack_from(content)
        if number != 3:
            raise FileError(f"{path} begins neither with {BINARY.decode()!r} nor with {FULL.decode()!r}")
        header = Header(True, "OcTree", nodes, side, OLD.size)
    check_number("res", header.resolution, SMALLEST, inf, "give the side of a cell [m]", FileError)
    return header


def _binary_cubes(path: FileName, content: bytes, header: Header) -> Cubes:
    """Return the cubes of a binary octree: those that its nodes say of their children."""
    count = min((len(content) - header.end) // 2, header.nodes)
    words = np.frombuffer(content, "<u2", count, header.end)
    pairs = words & (words >> 1) & 0x5555  # a bit where both of a child's are set
    own = _bits_set(pairs.astype("<u2").view(np.uint8).reshape(-1, 2)).sum(axis=1, dtype=np.uint8)
    depth = _depths(path, own, DEPTH - 1)
    words = words[: len(depth)]
    corner, found, total = np.zeros((1, 3), dtype=np.int32), [], 1
    for level in range(int(depth.max(initial=0)) + 1):
        kinds = (words[depth == level][:, None] >> np.arange(0, 16, 2, dtype=np.uint16) & 3).astype(np.uint8)
        parent, slot = np.nonzero(kinds)
        kind, half = kinds[parent, slot], 1 << DEPTH - 1 - level
        below = _child_corners(corner[parent], slot, half)
        known = kind != OWN_NODE
        found.append(Cubes.of(below[known], half, kind[known] == OCCUPIED_CHILD))
        corner, total = below[~known], total + len(kind)
    _check_nodes(path, total, header)
    return Cubes.joined(found)


def _full_cubes(path: FileName, content: bytes, header: Header) -> Cubes:
    """Return the cubes of a full octree: its nodes without children."""
    if header.kind not in NODES:
        raise FileError(f"{path} holds a tree of kind {header.kind[:40]!r}: {', '.join(NODES)} are read")
    layout = NODES[header.kind]
    count = min((len(content) - header.end) // layout.itemsize, header.nodes)
    nodes: NDArray[Any] = np.frombuffer(content, layout, count, header.end)
    children = np.ascontiguousarray(nodes["children"])
    depth = _depths(path, _bits_set(children), DEPTH)
    _check_nodes(path, len(depth), header)
    with np.errstate(over="ignore"):
        chance = (1.0 / (1.0 + np.exp(-nodes["odds"].astype(np.float64)))).astype(np.float32)
    corner, found = np.zeros((1, 3), dtype=np.int32), []
    for level in range(int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero(depth == level)
        leaf = children[rows] == 0
        found.append(Cubes.of(corner[leaf], 1 << DEPTH - level, chance[rows[leaf]]))
        below = np.unpackbits(children[rows[~leaf], None], axis=1, bitorder="little")
        parent, slot = np.nonzero(below)
        corner = _child_corners(corner[~leaf][parent], slot, (1 << DEPTH - level) >> 1)
    return Cubes.joined(found)


def _child_corners(corner: NDArray[np.int32], slot: IntArray, half: int) -> NDArray[np.int32]:
    """Return the first cells of children of cubes, half as wide: (n, 3)."""
    towards = (slot[:, None] >> np.arange(3) & 1).astype(np.int32)
    return np.asarray(corner + half * towards)


def _bits_set(values: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return how many bits are set in each byte."""
    counts = np.array([bin(value).count("1") for value in range(256)], dtype=np.uint8)
    return np.asarray(counts[values])


def _depths(path: FileName, below: NDArray[np.uint8], deepest: int) -> NDArray[np.uint8]:
    """Return how deep in the tree each node lies, from how many nodes follow as its children.

    The order of the nodes of one depth is that of their parents and of the children of each: with the depths, the tree
    can be read level by level.
    """
    depths, left, depth = bytearray(), [0] * (deepest + 3), 0
    left[0] = 1
    for count in below.tobytes():
        while depth >= 0 and not left[depth]:
            depth -= 1
        if depth < 0:
            break
        left[depth] -= 1
        depths.append(depth)
        depth += 1
        left[depth] = count
        if depth > deepest and count:
            raise FileError(f"{path} has nodes more than {deepest} levels below the first: it is damaged")
    if any(left):
        raise FileError(f"{path} ends before its nodes do: it is cut off or damaged")
    return np.frombuffer(bytes(depths), dtype=np.uint8)


def _check_nodes(path: FileName, found: int, header: Header) -> None:
    if found != header.nodes:
        raise FileError(f"{path} has {found} nodes where its header says {header.nodes}: it is cut off or damaged")
