"""A run of ``minsnap fleet`` that is killed, or interrupted, by signals; and the one that goes on."""

import io
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import minsnap
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

SHOW = """
vehicles: 12
separation: 0.8
downwash: 2
limits: {speed: 3, acceleration: 3}
home: {grid: {spacing: 1.5}}
acts:
  - {name: ring, formation: {circle: {radius: 4, height: 5}}}
  - {name: wheel, formation: {circle: {radius: 4, height: 2, upright: true}}, turn: 90}
"""
FLIGHTS = ["take-off", "ring", "wheel", "return", "landing"]


@pytest.fixture
def show(tmp_path):
    (tmp_path / "show.yaml").write_text(SHOW)
    return tmp_path / "show.yaml"


def begin(*words, script=None):
    """Start the command, or a script with its words."""
    start = ["-m", "minsnap", "fleet"] if script is None else ["-c", script]
    command = [sys.executable, *start, *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def names(said):
    """Flights that were told, and how each was found."""
    lines = [line.removeprefix("minsnap: ") for line in said.splitlines()]
    return {line.partition(":")[0]: line.partition("(")[2].rstrip(")") for line in lines}


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.glob("*") if path.is_file()}


HELD = """
import signal, sys
from minsnap.cli.app import main
from minsnap.shows import show_course

plan, calls = show_course.plan_fleet, []


def held(*arguments, **named):
    calls.append(plan(*arguments, **named))
    while len(calls) == 2:
        signal.pause()
    return calls[-1]


show_course.plan_fleet = held
main(["fleet", *sys.argv[1:]])
"""
"""The command, which stands still when it has found its second flight, before that is stored."""


@pytest.mark.slow
def test_a_show_that_is_killed_in_each_flight_ends_with_the_same_files(show, tmp_path):
    whole = begin(show, "-o", tmp_path / "whole")
    assert list(names(whole.communicate()[1])) == FLIGHTS and whole.returncode == 0
    folder = tmp_path / "out"
    for found in range(1, len(FLIGHTS)):
        process = begin(show, "-o", folder, script=HELD)
        for flight in FLIGHTS[:found]:
            assert process.stderr.readline().startswith(f"minsnap: {flight}: ")
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert len(list((folder / "flights").glob("*"))) == found and not contents(folder)
    resumed = begin(show, "-o", folder)
    told = names(resumed.communicate()[1])
    assert resumed.returncode == 0 and list(told.values())[:4] == ["kept"] * 4
    assert contents(folder) == contents(tmp_path / "whole") and len(contents(folder)) == 13


INTERRUPTED = """
import os, signal, sys
from minsnap.cli.app import main
from minsnap.shows import show_course

plan = show_course.plan_fleet


def interrupted(*arguments, progress, **named):
    return plan(*arguments, progress=lambda *_: os.kill(os.getpid(), signal.SIGINT), **named)


show_course.plan_fleet = interrupted
main(["fleet", *sys.argv[1:]])
"""
"""The command, interrupted as soon as a flight has a certified time."""


@pytest.mark.slow
def test_an_interrupt_flies_the_best_so_far_and_the_next_run_searches_on(show, tmp_path):
    show.write_text(SHOW.replace("spacing: 1.5", "spacing: 1.0"))
    process = begin(show, "-o", tmp_path / "out", script=INTERRUPTED)
    said, told = process.communicate()
    cut = [name for name, method in names(told).items() if method == "joint, ended by Ctrl-C"]
    assert process.returncode == 0 and cut
    assert all(f"note: the search for {name} was cut short" in said for name in cut)
    assert len(list((tmp_path / "out" / "flights").glob("*.npz"))) == len(FLIGHTS) - len(cut)
    first = read_fleet(tmp_path / "out")
    assert minsnap.certify_fleet(first).ok
    again = begin(show, "-o", tmp_path / "out")
    said, told = again.communicate()
    assert again.returncode == 0 and "cut short" not in said
    assert [name for name, method in names(told).items() if method != "kept"] == cut
    second = read_fleet(tmp_path / "out")
    assert minsnap.certify_fleet(second).ok and second.duration < first.duration


def damaged(number, files):
    """Damage the file of a flight: cut it off, empty it, take another flight's, or another archive."""
    content = files[0].read_bytes()
    file = io.BytesIO()
    np.savez(file, p0=np.zeros((1, 8, 3)), d0=np.ones(1))
    return [content[:300], b"", files[1].read_bytes(), file.getvalue()][number]


@pytest.mark.parametrize("number", range(4))
def test_a_stored_flight_that_is_damaged_is_planned_again(show, tmp_path, number):
    first = fly(read_show(show), tmp_path / "flights")
    files = sorted((tmp_path / "flights").glob("*"))
    content = files[0].read_bytes()
    files[0].write_bytes(damaged(number, files))
    again = fly(read_show(show), tmp_path / "flights")
    assert sorted(stage.method == "kept" for stage in again.stages) == [False, True, True, True, True]
    assert [stage.end for stage in again.stages] == [stage.end for stage in first.stages]
    assert np.load(files[0])["p0"].tolist() == np.load(io.BytesIO(content))["p0"].tolist()


@pytest.mark.parametrize(("to", "name"), [("csv", "manifest.json"), ("skyc", "show.skyc")])
def test_what_is_there_is_kept_before_a_flight_is_planned(show, tmp_path, to, name):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("precious")
    process = begin(show, "-o", tmp_path / "out", "--to", to, "--no-clobber")
    _, told = process.communicate()
    assert process.returncode == 2 and told.count("\n") == 1 and f"{name} is there already" in told
    assert contents(tmp_path / "out") == {name: b"precious"} and not (tmp_path / "out" / "flights").exists()
