"""A file is whole or not there, whatever happens while it is written."""

import os
import subprocess
import sys

import pytest

from minsnap.basics.storage.atomic import atomic_write, check_destination
from minsnap.errors import FileError


def test_the_name_appears_only_when_the_block_has_ended(tmp_path):
    path = tmp_path / "a.csv"
    with atomic_write(path) as file:
        file.write("t,x\n")
        file.flush()
        assert not path.exists()
    assert path.read_bytes() == b"t,x\n"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_failure_leaves_what_was_there_and_no_litter(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), atomic_write(path) as file:
        file.write("new")
        1 / 0  # noqa: B018
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_reader_of_what_was_there_reads_it_to_its_end(tmp_path):
    """A rename leaves the old file to those who have it open; writing over it would not."""
    path = tmp_path / "a.csv"
    path.write_text("old")
    with open(path) as reader:
        with atomic_write(path) as file:
            file.write("new")
        assert reader.read() == "old"
    assert path.read_text() == "new"


def test_bytes_and_permissions(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"")
    path.chmod(0o640)
    with atomic_write(path, "wb") as file:
        file.write(b"\x00\x01")
    assert path.read_bytes() == b"\x00\x01"
    assert path.stat().st_mode & 0o777 == 0o640


def test_without_clobber_an_existing_file_stays(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("old")
    with pytest.raises(FileError, match="there already"), atomic_write(path, clobber=False):
        pass
    assert path.read_text() == "old"


def test_without_clobber_a_file_that_came_meanwhile_stays(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(FileError, match="there already"), atomic_write(path, clobber=False) as file:
        file.write("mine")
        path.write_text("theirs")
    assert path.read_text() == "theirs"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_without_clobber_a_new_file_is_written(tmp_path):
    with atomic_write(tmp_path / "a.csv", clobber=False) as file:
        file.write("new")
    assert (tmp_path / "a.csv").read_text() == "new"


def test_a_folder_is_not_a_file(tmp_path):
    with pytest.raises(FileError, match="is a folder"), atomic_write(tmp_path):
        pass


def test_the_standard_input_is_no_file_to_write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileError, match="- is no file here: give the name of one"), atomic_write("-"):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("there", [False, True])
def test_a_folder_that_is_read_only_is_said_before_anything_is_computed(tmp_path, monkeypatch, there):
    if there:
        (tmp_path / "a.csv").write_text("old")
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)  # the superuser may write anywhere
    with pytest.raises(FileError, match=r"a\.csv cannot be written: its folder is read-only"):
        check_destination(tmp_path / "a.csv")
    assert check_destination("/dev/null").is_char_device()


def test_a_missing_folder_is_named_by_the_path_asked_for(tmp_path):
    path = tmp_path / "nowhere" / "a.csv"
    with pytest.raises(FileError) as caught, atomic_write(path):
        pass
    assert str(path) in str(caught.value)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has it")
def test_a_full_device_is_named():
    with (
        pytest.raises(FileError, match="/dev/full cannot be written: No space left"),
        atomic_write("/dev/full") as file,
    ):
        file.write("x")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_pipe_is_written_where_somebody_reads_it_and_refused_where_nobody_does(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    with pytest.raises(FileError, match="pipe.csv is a pipe that nobody reads"), atomic_write(pipe) as file:
        file.write("lost")
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with atomic_write(pipe) as file:
        file.write("0,1\n" * 100)
    assert os.read(reader, 4096) == b"0,1\n" * 100
    os.close(reader)


def test_a_file_that_is_being_written_goes_with_a_process_that_is_ended(tmp_path):
    """What SIGTERM left of it stayed beside its name for ever."""
    code = (
        "import os, signal\nfrom minsnap.basics.storage.atomic import atomic_write\n"
        "with atomic_write('a.csv') as file:\n    file.write('new')\n    os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    (tmp_path / "a.csv").write_text("old")
    ended = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (143, "")
    assert os.listdir(tmp_path) == ["a.csv"] and (tmp_path / "a.csv").read_text() == "old"
