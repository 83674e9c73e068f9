"""The command as a process; in this process, where only its words and status matter, it is `call`."""

from __future__ import annotations

import subprocess
import sys

import pytest

COMMAND = [sys.executable, "-m", "minsnap"]


@pytest.fixture
def process(tmp_path):
    """Run the command as a process in an empty folder."""

    def run(*arguments, **options):
        given = {
            "cwd": tmp_path,
            "capture_output": True,
            "text": True,
            "check": False,
            "stdin": subprocess.DEVNULL,
            "timeout": 60,
        }
        return subprocess.run([*COMMAND, *map(str, arguments)], **(given | options))

    return run
