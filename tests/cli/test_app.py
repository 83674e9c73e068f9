"""Every exit status, and what the command says and does not say."""

from __future__ import annotations

import fcntl
import os
import re
import shlex
import signal
import subprocess
import termios
import time
from array import array
from pathlib import Path

import pytest

from minsnap.cli import app
from minsnap.native.library import core

from .conftest import COMMAND

WAYPOINTS = "x,y,z,duration\n0,0,1,4\n8,0,1,2\n8,4,1,\n"


def is_one_sentence(text):
    return text.startswith("minsnap: ") and text.endswith("\n") and text.count("\n") == 1


def wait_until_read(run):
    """Return when a command has read all that was written to its standard input, and waits for more."""
    waiting = array("i", [1])
    while waiting[0]:
        assert run.poll() is None, run.stderr.read()
        time.sleep(0.02)
        fcntl.ioctl(run.stdin.fileno(), termios.FIONREAD, waiting)
    time.sleep(0.2)


def test_done_is_0_and_only_the_summary_is_printed(process, tmp_path):
    run = process("rect", "--corridor", "0.3", "-o", "traj.csv")
    assert (run.returncode, run.stderr) == (0, "")
    assert "corridor margin" in run.stdout
    assert os.listdir(tmp_path) == ["traj.csv"]


@pytest.mark.slow
def test_what_cannot_be_met_is_1(process, tmp_path):
    (tmp_path / "w.csv").write_text("x,y,z\n0,0,1\n8,0,1\n8,4,1\n0,4,1\n0,0,1\n")
    run = process("plan", "w.csv", "--corridor", "0.3", "--time", "1", "--max-speed", "3", "-o", "t.csv")
    assert run.returncode == 1
    assert is_one_sentence(run.stderr) and run.stdout == ""
    assert "leg" in run.stderr
    assert not (tmp_path / "t.csv").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rect", "--width", "-1"], "width"),
        (["rect", "--nonsense"], "--nonsense"),
        (["rect", "--width", "wide"], "--width"),
        (["nonsense"], "nonsense"),
        (["plan", "missing.csv"], "missing.csv"),
        (["plan"], "FILE"),
        (["circle", "-o", "nowhere/circle.csv"], "nowhere"),
    ],
)
def test_bad_usage_and_bad_input_are_2(process, tmp_path, arguments, said):
    run = process(*arguments)
    assert run.returncode == 2
    assert is_one_sentence(run.stderr) and said in run.stderr
    assert run.stdout == "" and os.listdir(tmp_path) == []


def test_no_command_is_2_and_shows_the_help(process):
    run = process()
    assert run.returncode == 2
    assert "Usage: minsnap" in run.stderr and run.stdout == ""


def test_help_lists_the_commands_and_version_the_version(process):
    shown = process("--help")
    assert shown.returncode == 0
    for command in ("rect", "circle", "line", "helix", "eight", "plan", "check", "plot"):
        assert re.search(rf"^  {command} ", shown.stdout, re.MULTILINE), command
    folder = process("--cmake-dir")
    assert folder.returncode == 0 and (Path(folder.stdout.strip()) / "minsnap-config.cmake").is_file()
    version = process("--version")
    assert version.returncode == 0 and re.fullmatch(r"minsnap \d+\.\d+\.\d+\n(native|python) core.+\n", version.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("variable", ["NO_COLOR", "FORCE_COLOR"])
def test_nothing_is_coloured(process, variable):
    environment = os.environ | {variable: "1", "TERM": "xterm-256color"}
    for arguments in (["circle", "--help"], ["circle"], ["circle", "--radius", "-1"], ["nonsense"]):
        run = process(*arguments, env=environment)
        assert "\x1b" not in run.stdout + run.stderr, arguments


def test_a_terminal_without_superscripts_gets_something_else(process):
    run = process("line", env=os.environ | {"PYTHONIOENCODING": "ascii"})
    assert (run.returncode, run.stderr) == (0, "")
    assert "max speed" in run.stdout and "²" not in run.stdout


@pytest.mark.slow
def test_a_reader_that_goes_away_is_met_in_silence(tmp_path):
    arguments = [*COMMAND, "circle", "--laps", "300", "-o", "-"]
    with subprocess.Popen(arguments, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        assert run.stdout.readline().startswith("t,x,y,z")
        run.stdout.close()
        assert run.wait(timeout=60) == 141
        assert run.stderr.read() == ""


@pytest.mark.parametrize("closed", [">&-", ">&- 2>&-"])
def test_a_standard_output_that_is_closed_is_met_without_a_traceback(tmp_path, closed):
    """A summary that nobody can read was an AttributeError; setpoints that nobody can read are an error."""

    def run(*arguments):
        line = f"{shlex.join([*COMMAND, *arguments])} {closed}"
        return subprocess.run(line, shell=True, cwd=tmp_path, stderr=subprocess.PIPE, text=True, check=False)

    done = run("rect", "-o", "a.csv")
    assert (done.returncode, done.stderr) == (0, "") and (tmp_path / "a.csv").read_text().startswith("t,x,y,z")
    lost = run("rect", "-o", "-")
    assert lost.returncode == 2 and (closed != ">&-" or is_one_sentence(lost.stderr))


@pytest.mark.slow
def test_an_interrupt_is_130_in_silence_and_leaves_nothing(tmp_path):
    arguments = [*COMMAND, "plan", "-", "-o", "path.csv"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(arguments, cwd=tmp_path, text=True, **pipes) as run:
        run.stdin.write("x,y,z\n")
        run.stdin.flush()
        wait_until_read(run)
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=60) == 130
        assert (run.stdout.read(), run.stderr.read()) == ("", "")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("compiled", [False, True])
def test_an_interrupt_while_the_command_is_loaded_is_130_in_silence(monkeypatch, capsys, compiled):
    def interrupt(first):
        if compiled:
            raise ImportError("initialization failed") from KeyboardInterrupt()
        raise KeyboardInterrupt

    monkeypatch.setattr(app, "load_commands", interrupt)
    with pytest.raises(SystemExit) as left:
        app.main(["rect"])
    assert left.value.code == 130 and capsys.readouterr() == ("", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has it")
def test_a_full_standard_output_is_one_sentence_with_its_heading():
    with open("/dev/full", "w") as full:
        run = subprocess.run([*COMMAND, "--help"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert run.returncode == 2
    assert run.stderr == "minsnap: the standard output: No space left on device [file]\n"


def test_the_command_loads_nothing_heavy_before_it_is_needed(tmp_path):
    code = (
        "import sys; from minsnap.cli.app import load_commands; load_commands();"
        "print([m for m in ('numpy', 'scipy', 'matplotlib', 'qpsolvers', 'pymavlink', 'rich') if m in sys.modules])"
    )
    run = subprocess.run([COMMAND[0], "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_every_command_is_found_in_the_module_that_it_alone_loads():
    app.load_commands()
    for command in app.app.registered_commands:
        name = command.name or command.callback.__name__
        assert app.COMMANDS[name] == command.callback.__module__.rpartition(".")[2], name


@pytest.mark.skipif(core().library is None, reason="the Python core loads scipy and the solvers")
def test_a_plan_by_the_native_core_loads_no_solver_and_no_search_that_it_does_not_run(tmp_path):
    arguments = ["rect", "--corridor", "0.3", "--time", "12", "-o", str(tmp_path / "t.csv")]
    listed = "import sys, atexit; atexit.register(lambda: print(*sys.modules))"
    code = f"{listed}; from minsnap.cli import main; main({arguments})"
    run = subprocess.run([COMMAND[0], "-c", code], capture_output=True, text=True, check=True)
    loaded = run.stdout.splitlines()[-1].split()
    assert "minsnap.planning.planner" in loaded and "numpy" in loaded
    outside = {"scipy", "qpsolvers", "clarabel", "daqp", "piqp", "osqp", "matplotlib", "pandas", "numpy.ma"}
    unused = {"minsnap.plot", "minsnap.vehicle", "minsnap.limits.limits", "minsnap.cli.flight_commands"}
    searches = {"minsnap.optimisation.reference_core", "minsnap.durations.strategy"}
    assert not (outside | unused | searches) & set(loaded)
