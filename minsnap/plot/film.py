"""Films from pictures: GIF by Pillow, MP4 and WebM by the program ffmpeg."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from itertools import chain
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from minsnap.basics.storage.atomic import atomic_write, check_destination
from minsnap.errors import FileError

ENDINGS = (".gif", ".mp4", ".webm")

Picture = npt.NDArray[np.uint8]
"""Rows from the top, shape (height, width, 3): red, green, blue."""


def check_film_name(file: str | os.PathLike[str]) -> str:
    """Return the ending of a film's name in lower case, or raise FileError if it cannot be written."""
    ending = FilePath(file).suffix.lower()
    if ending not in ENDINGS:
        raise FileError(f"{file} does not end in {' or '.join(ENDINGS)}: an animation is written as one of these")
    if ending != ".gif" and shutil.which("ffmpeg") is None:
        name = ending[1:].upper().replace("WEBM", "WebM")
        raise FileError(f"{file}: {name} needs the program ffmpeg, which is not installed; write a .gif instead")
    return ending


def write_film(pictures: Iterator[Picture], file: str | os.PathLike[str], rate: float, *, clobber: bool = True) -> None:
    """Write pictures as a film, in one step when the last one is there.

    Parameters
    ----------
    pictures : iterator of ndarray, shape (height, width, 3)
        At least one; all of one size.
    file : str or path
        ``.gif``; ``.mp4`` or ``.webm`` where ffmpeg is installed.
    rate : float
        Pictures a second [Hz].
    clobber : bool
        False: a file that exists is an error.

    Raises
    ------
    FileError
        If the ending is another, ffmpeg is not there or fails, or the file cannot be written.
    """
    ending = check_film_name(file)
    check_destination(file, clobber=clobber)
    with TemporaryDirectory() as folder:
        place = FilePath(folder) / f"film{ending}"
        (_write_gif if ending == ".gif" else _encode)(pictures, place, rate)
        with atomic_write(file, "wb", clobber=clobber) as out:
            out.write(place.read_bytes())


def _write_gif(pictures: Iterator[Picture], place: FilePath, rate: float) -> None:
    from PIL import Image

    images = (Image.fromarray(picture) for picture in pictures)
    next(images).save(place, save_all=True, append_images=images, duration=1e3 / rate, loop=0)


def _encode(pictures: Iterator[Picture], place: FilePath, rate: float) -> None:
    """Hand raw pictures to ffmpeg; its codecs need even sides."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{rate}", "-i", "-")
    made = ("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", f"{place}")
    command = ("ffmpeg", "-y", "-loglevel", "error", *raw, *made)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL) as encoder:
        assert encoder.stdin is not None
        try:
            for picture in chain((first,), pictures):
                encoder.stdin.write(picture.tobytes())
        except BrokenPipeError:
            pass  # it has ended: its status says so
        encoder.stdin.close()
    if encoder.returncode:
        raise FileError(f"ffmpeg could not write {place.suffix}: write a .gif instead")
