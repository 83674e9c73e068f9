"""Devices, pipes and links to them or to themselves are refused in a sentence: reading one need not end."""

import os
import socket
import sys

import pytest

import minsnap
from minsnap.basics.storage.text import load_yaml, read_text
from minsnap.errors import FileError
from minsnap.files.flights import is_stream_log
from minsnap.files.formats.polynomials import is_polynomials
from minsnap.vehicle import Quadrotor

READERS = [minsnap.read_csv, minsnap.read_waypoints, minsnap.read_course, read_text, load_yaml]
READERS += [is_polynomials, is_stream_log, Quadrotor.from_yaml]


def places(folder):
    """Return what is no regular file, each under an ending of a format that is read."""
    (folder / "zero.csv").symlink_to("/dev/zero")
    (folder / "random.yaml").symlink_to("/dev/urandom")
    (folder / "self.csv").symlink_to(folder / "self.csv")
    (folder / "terminal.json").symlink_to("/dev/tty")
    os.mkfifo(folder / "pipe.csv")
    with socket.socket(socket.AF_UNIX) as served:
        served.bind(str(folder / "socket.yaml"))
    return sorted(folder.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such files")
@pytest.mark.parametrize("read", READERS, ids=lambda read: read.__qualname__)
def test_what_is_no_regular_file_is_refused(tmp_path, read):
    for place in places(tmp_path):
        if place.name == "self.csv" and read in (is_polynomials, is_stream_log):
            assert read(place) is False
            continue
        with pytest.raises(
            FileError, match=r"is no regular file but a device|cannot be read: Too many levels"
        ) as refused:
            read(place)
        assert place.name in str(refused.value) and "\n" not in str(refused.value)


def test_a_link_to_a_regular_file_is_read(tmp_path):
    (tmp_path / "a.txt").write_text("here")
    (tmp_path / "b.txt").symlink_to(tmp_path / "a.txt")
    assert read_text(tmp_path / "b.txt") == "here"
