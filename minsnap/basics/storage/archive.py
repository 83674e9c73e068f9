"""Safe reading of NumPy archives: sizes are checked before memory is allocated, and pickles are never loaded."""

from __future__ import annotations

import io
import math
import os
import zipfile
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.storage.text import check_size, reading
from minsnap.errors import FileError

SMALL = 64_000_000
"""Bytes up to which an archive may unpack, however small it is."""

RATIO = 20
"""How many times its own size a larger one may have unpacked."""


def read_archive(path: str | os.PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of an ``.npz`` file by name: numbers as float64, text unchanged.

    Raises
    ------
    FileError
        If it cannot be read, is no such archive, holds other than numbers and text, or unpacks to too much.
    """
    size = check_size(path)
    with reading(path, "a NumPy archive of numbers"), zipfile.ZipFile(path) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > max(SMALL, RATIO * size):
            raise FileError(f"{path} has {size} bytes and unpacks to {unpacked}: that is no archive of numbers")
        return {name.removesuffix(".npy"): _array(archive.read(name)) for name in archive.namelist()}


def _array(content: bytes) -> npt.NDArray[Any]:
    """Return the array of an ``.npy`` member, of numbers or text, if its size agrees with its header."""
    stream = io.BytesIO(content)
    read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, fortran, dtype = read_header[np.lib.format.read_magic(stream)](stream)
    body = content[stream.tell() :]
    if dtype.kind not in "fiubU" or math.prod(shape) * dtype.itemsize != len(body):
        raise ValueError("an array of another size or kind than its header says")
    array = np.frombuffer(body, dtype=dtype).reshape(shape, order="F" if fortran else "C")
    return array if dtype.kind == "U" else array.astype(np.float64)
