"""Octrees as nested dicts, and their files as OctoMap's library writes them; recursive, unlike what reads them."""

import struct

NAME = {True: "# Octomap OcTree binary file", False: "# Octomap OcTree file"}
NOTE = "# (feel free to add / change comments, but leave the first line as it is!)\n#"


def put(tree, key, depth, odds):
    """Set a cube of a tree: children by their number, or the odds of a leaf.

    The key holds the first cell of the cube along x, y and z, and the depth is how many levels it lies below the root.
    """
    for level in range(depth):
        slot = sum((key[axis] >> (15 - level) & 1) << axis for axis in range(3))
        if level == depth - 1:
            tree[slot] = odds
        else:
            tree = tree.setdefault(slot, {})


def cells(tree, corner=(0, 0, 0), side=1 << 16):
    """Yield first cell, cells a side and odds of every leaf."""
    if not isinstance(tree, dict):
        yield corner, side, tree
        return
    for slot, child in tree.items():
        half = side // 2
        yield from cells(child, tuple(c + half * (slot >> axis & 1) for axis, c in enumerate(corner)), half)


def nodes(tree):
    """Return the number of nodes."""
    return 1 + (sum(map(nodes, tree.values())) if isinstance(tree, dict) else 0)


def octree_file(tree, binary, resolution=0.25, kind="OcTree"):
    """Return the bytes of a file."""
    head = f"{NAME[binary]}\n{NOTE}\nid {kind}\nsize {nodes(tree)}\nres {resolution}\ndata\n"
    body = _binary(tree) if binary else _full(tree, b"\xff\x00\x7f" if kind == "ColorOcTree" else b"")
    return head.encode() + body


def old_file(tree, resolution=0.25):
    """Return the bytes of a binary file before OctoMap 1.0."""
    return struct.pack("<idI", 3, resolution, nodes(tree)) + _binary(tree)


def _binary(tree):
    word = 0
    for slot, child in tree.items():
        word |= (3 if isinstance(child, dict) else 2 if child >= 0.0 else 1) << 2 * slot
    inner = (child for _, child in sorted(tree.items()) if isinstance(child, dict))
    return struct.pack("<H", word) + b"".join(map(_binary, inner))


def _full(tree, colour):
    if not isinstance(tree, dict):
        return struct.pack("<f", tree) + colour + b"\x00"
    flags = sum(1 << slot for slot in tree)
    below = b"".join(_full(child, colour) for _, child in sorted(tree.items()))
    return struct.pack("<f", 9.0) + colour + bytes([flags]) + below
