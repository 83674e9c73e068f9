"""A search for durations on a terminal: its line, and the best plan on Ctrl-C."""

from __future__ import annotations

import os
import pty
import signal
import subprocess

import pytest

from .conftest import COMMAND


@pytest.fixture
def terminal(tmp_path):
    """Run the command on a terminal; give the process and the terminal's other side."""
    ours, theirs = pty.openpty()
    arguments = [*COMMAND, "rect", "--laps", "300", "--pieces", "6", "--max-body-rate", "3", "-o", "a.csv"]
    with subprocess.Popen(arguments, cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs) as run:
        os.close(theirs)
        yield run, ours
    os.close(ours)


def read(side, until=b"\0"):
    """Return what the terminal shows until a word appears or the command has left."""
    shown = b""
    while until not in shown:
        try:
            shown += os.read(side, 4096)
        except OSError:  # how a terminal without a process ends
            break
    return shown.decode()


@pytest.mark.slow
def test_a_long_search_shows_a_line_and_an_interrupt_takes_the_best_plan(terminal, tmp_path):
    run, side = terminal
    assert "searching" in read(side, until=b"Ctrl-C")
    run.send_signal(signal.SIGINT)
    rest = read(side)
    assert run.wait(timeout=60) == 0
    summary = rest.rpartition("\x1b[2K")[2]
    assert "interrupted" in summary and "best plan" in summary and "searching" not in summary.splitlines()[-1]
    assert (tmp_path / "a.csv").exists()
