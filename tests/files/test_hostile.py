"""Hostile files: each ends in one sentence of one exception, soon, whatever is in it."""

import io
import os
import threading
import zipfile

import numpy as np
import pytest

import minsnap
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.text import LARGEST_YAML, load_yaml
from minsnap.errors import FileError, TimingError
from minsnap.files.convert import file_formats, read_any, write_any
from minsnap.files.formats.tables import read_npz, write_npz

PATH = minsnap.plan([(0, 0, 1), (2, 0, 1), (2, 1, 1)], [2.0, 1.5], yaw=[0.0, 0.5, 0.0])


def lines(*rows):
    return "\n".join(rows) + "\n"


def nines(name):
    """Nine aliases of what the letter before is."""
    return f"{name}: &{name} [{', '.join(['*' + chr(ord(name) - 1)] * 9)}]"


BILLIONS = lines("a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0]", *map(nines, "bcdefghij"), "waypoints: [*j]")

YAML = {
    "aliases": (BILLIONS, "line .*: aliases are not read"),
    "nesting": ("[" * 5000 + "]" * 5000, "32 levels of nesting"),
    "open nesting": ("[" * 5000, "line|not YAML"),
    "digits": (f"- [0, 0, 1]\n- [{'9' * 400}, 0, 1]\n", "waypoint 1: x is .*give a finite number"),
    "digits of another sign": (f"- [0, 0, 1]\n- [-{'9' * 4500}, 0, 1]\n", "waypoint 1: x is .*give a finite number"),
    "sexagesimal": ("- [0, 0, 1]\n- [1:30, 0, 1]\n", "x is '1:30': give a finite number"),
    "twice": ("waypoints: [[0, 0, 1], [1, 0, 1]]\nwaypoints: [[0, 0, 1], [2, 0, 1]]\n", "'waypoints' is there twice"),
    "twice within": ("- [0, 0, 1]\n- {x: 1, y: 0, z: 1, x: 2}\n", "line 2: 'x' is there twice"),
    "object": ("- !!python/object/apply:os.getcwd []\n", "line 1"),
    "long text": (f"- [0, 0, 1]\n- {'a' * 100_000}\n", r"waypoint 1 is '.{20,70}': give"),
    "a list as key": ("? [1, 2]\n: 3\n", "list|YAML"),
}


@pytest.mark.parametrize("name", YAML)
def test_hostile_yaml_is_refused_in_a_sentence(tmp_path, name):
    text, says = YAML[name]
    path = tmp_path / "points.yaml"
    path.write_text(text)
    with pytest.raises(FileError, match=says) as caught:
        minsnap.read_waypoints(path)
    assert len(str(caught.value)) < 400


def test_numbers_of_yaml_are_decimal(tmp_path):
    path = tmp_path / "points.yaml"
    path.write_text("- [010, 1e1, .5]\n- [1.5e+3, -2., 0x10]\n")
    assert load_yaml(path) == [[10, 10.0, 0.5], [1500.0, -2.0, "0x10"]]


def test_too_large_a_yaml_is_not_read(tmp_path):
    path = tmp_path / "points.yaml"
    with path.open("wb") as file:
        file.truncate(LARGEST_YAML + 1)
    with pytest.raises(FileError, match="32 MB: files of this kind are read up to"):
        minsnap.read_waypoints(path)


READERS = (minsnap.read_csv, minsnap.read_waypoints, read_any, read_npz)


@pytest.mark.parametrize("name", ["a\0b.csv", "a\0b.npz", "a\0b.yaml"])
@pytest.mark.parametrize("reader", READERS)
def test_a_name_that_is_none_is_refused(reader, name):
    with pytest.raises(FileError, match="no name of a file"):
        reader(name)


def saved(**arrays):
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def archive(members, **options):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, **options) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return stream.getvalue()


def array_header(shape):
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()


ROWS = np.arange(3.0)
NPZ = {
    "no durations": (saved(control_points=np.zeros((1, 8, 3))), "neither a trajectory"),
    "other shapes": (saved(t=ROWS, position=np.zeros((2, 3))), r"position has the shape \(2, 3\)"),
    "a flat position": (saved(t=ROWS, position=ROWS), "instants .*positions"),
    "a short velocity": (saved(t=ROWS, position=np.zeros((3, 3)), velocity=np.zeros((3, 2))), "velocity has the shape"),
    "not finite": (saved(t=ROWS, position=np.full((3, 3), np.nan)), "position holds a number that is not finite"),
    "backwards": (saved(t=ROWS[::-1], position=np.zeros((3, 3))), "instant 1 is not after"),
    "another array": (saved(t=ROWS, position=np.zeros((3, 3)), wings=ROWS), "holds 'wings', which neither"),
    "a bad yaw": (saved(control_points=np.zeros((1, 8, 3)), durations=[1.0], yaw_angle=np.nan), "yaw is nan"),
    "half a yaw": (saved(control_points=np.zeros((1, 8, 3)), durations=[1.0], yaw_control_points=ROWS), "is not a"),
    "objects": (saved(t=np.array([None, "a"]), position=np.zeros((2, 3))), "no NumPy archive|not a NumPy archive"),
    "a promise": (archive({"t.npy": array_header("(1000000000000, 3)")}), "not a NumPy archive"),
    "a negative promise": (archive({"t.npy": array_header("(-1,)") + bytes(8)}), "not a NumPy archive"),
    "a bomb": (lambda: archive({"t.npy": array_header("(50000000,)") + bytes(400_000_000)}), "unpacks to 400000128"),
    "not an archive": (b"PK\x03\x04 and so on", "not a NumPy archive"),
    "nothing": (b"", "not a NumPy archive"),
}


@pytest.mark.parametrize("name", NPZ)
def test_hostile_archives_are_refused_in_a_sentence(tmp_path, name):
    content, says = NPZ[name]
    path = tmp_path / "path.npz"
    path.write_bytes(content() if callable(content) else content)
    with pytest.raises(FileError, match=says):
        read_npz(path)


@pytest.mark.slow
def test_no_flipped_byte_of_an_archive_gets_past_its_reader(tmp_path):
    path = tmp_path / "path.npz"
    write_npz(PATH, path)
    content = path.read_bytes()
    for place in range(len(content)):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x55]) + content[place + 1 :])
        try:
            found = read_npz(path)
        except FileError:
            continue
        assert (found.control_points == PATH.control_points).all() and (found.durations == PATH.durations).all()
        assert (found.yaw.polynomial.control_points == PATH.yaw.polynomial.control_points).all()


def test_the_longest_names_are_written_and_longer_ones_refused(tmp_path):
    longest = tmp_path / ("a" * 250 + ".csv")
    minsnap.write_csv(PATH, longest)
    assert len(minsnap.read_csv(longest)) == 71
    with pytest.raises(FileError, match="cannot be written: File name too long"):
        minsnap.write_csv(PATH, tmp_path / ("a" * 300 + ".csv"))
    with pytest.raises(FileError, match="no name of a file"):
        minsnap.write_csv(PATH, "a\0b.csv")


def test_a_read_only_file_stays(tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("mine")
    path.chmod(0o444)
    with pytest.raises(FileError, match="path.csv is read-only"):
        minsnap.write_csv(PATH, path)
    assert path.read_text() == "mine"


def test_a_full_disk_names_the_file_that_was_asked_for(tmp_path):
    with pytest.raises(FileError, match=r"path.csv cannot be written: No space") as caught:
        with atomic_write(tmp_path / "path.csv") as file:
            with open("/dev/full", "w") as full:
                full.write("x")
                try:
                    full.flush()
                except OSError as error:
                    raise OSError(error.errno, error.strerror) from None
            file.write("never")
    assert ".part" not in str(caught.value) and not list(tmp_path.iterdir())


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has it")
@pytest.mark.parametrize("to", sorted(name for name, entry in file_formats().items() if entry.write))
def test_every_format_says_that_a_device_is_full_and_is_written_into_a_pipe(tmp_path, to):
    path = minsnap.plan([(0, 0, 1), (2, 0, 1), (2, 1, 1)], [2.0, 1.5])
    with pytest.raises(FileError, match="/dev/full cannot be written: No space left"):
        write_any(path, "/dev/full", to, origin=(47.0, 8.0, 400.0))
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    held = os.open(pipe, os.O_RDWR)
    reader = threading.Thread(target=lambda: read.append(os.read(held, 1 << 16)))
    reader.start()
    write_any(path, pipe, to, origin=(47.0, 8.0, 400.0))
    reader.join()
    os.close(held)
    assert read[0]


@pytest.mark.parametrize("rate", [1e12, 1e300])
def test_a_rate_that_no_memory_holds_is_refused(tmp_path, rate):
    with pytest.raises(TimingError, match="samples: at most"):
        minsnap.write_csv(PATH, tmp_path / "path.csv", rate=rate)
