"""The command that opens the studio: its address, its end, and what it refuses."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

import minsnap
from minsnap.cli.fleet_commands import _page
from minsnap.errors import FileError

pytest.importorskip("viser")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def start(*arguments, cwd):
    command = [sys.executable, "-m", "minsnap", "studio", "--no-browser", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, cwd=cwd, env=os.environ | {"PYTHONUNBUFFERED": "1"}, **pipes)


@pytest.fixture
def running(tmp_path):
    port = free_port()
    process = start("--port", port, cwd=tmp_path)
    line = process.stdout.readline()
    yield process, port, line
    process.kill()
    process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_serves_its_page_on_this_machine_only_and_ends_on_a_signal(running, number, tmp_path):
    process, port, line = running
    assert f"http://127.0.0.1:{port}" in line
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=30) as page:
        assert page.status == 200 and b"<html" in page.read()
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", port), timeout=5).close()
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_port_in_use_is_one_sentence(tmp_path):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        process = start("--port", port, cwd=tmp_path)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 2 and out == ""
    assert err.count("\n") == 1 and f"port {port}" in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.yaml"], "nowhere.yaml"),
        (["--obstacles", "nowhere.npz"], "nowhere.npz"),
        (["--folder", "nowhere"], "nowhere"),
        (["--host", "192.0.2.1"], "192.0.2.1"),
    ],
)
def test_bad_input_is_one_sentence(tmp_path, arguments, said):
    process = start("--port", 0, *arguments, cwd=tmp_path)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 2 and out == ""
    assert said in err and err.count("\n") == 1


@pytest.mark.slow
def test_obstacles_beside_a_fleet_are_refused(tmp_path):
    minsnap.shows.write_fleet(minsnap.Fleet([minsnap.line((0, 0, 1), (4, 0, 1))]), tmp_path / "fleet")
    out, err = start("fleet", "--obstacles", "cloud.npz", "--port", 0, cwd=tmp_path).communicate(timeout=60)
    assert out == "" and "a fleet, whose page shows no --obstacles" in err


def test_the_page_keeps_the_files_of_the_command(tmp_path):
    """Save replaced the course that the command was given."""
    course, cloud = tmp_path / "course.csv", tmp_path / "cloud.csv"
    for file in (course, cloud):
        file.write_text("x,y,z\n0,0,1\n8,0,1\n8,4,1\n")
    page = _page(course, tmp_path, "127.0.0.1", 0, cloud)
    for name in ("course", "cloud"):
        with pytest.raises(FileError, match="is the file that is read"):
            page._folder.target("setpoints (CSV)", name)
    page.close()
