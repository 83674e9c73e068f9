"""The command as a process, and the same in this process where only its words and status matter."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import pytest

from minsnap.cli import main

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


@pytest.fixture
def call(tmp_path, capsys, monkeypatch):
    """Run the command in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return SimpleNamespace(returncode=left.value.code, stdout=printed.out, stderr=printed.err)

    return run
