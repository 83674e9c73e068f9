"""The view of a figure, on every command that draws one."""

from __future__ import annotations

from pathlib import Path

import pytest

SHAPES = ("rect", "line", "circle", "helix", "eight")


@pytest.fixture
def files(call):
    """Write a setpoint file and waypoints."""
    Path("w.csv").write_text("x,y,z\n0,0,1\n4,0,2\n")
    assert call("line", "-o", "a.csv").returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "view"),
    [
        *(("line", "xz"), ("plan w.csv", "3d"), ("plan w.csv", "xz")),
        *(("compare a.csv a.csv", "3d"), ("simulate a.csv", "xz")),
    ],
)
def test_a_view_reaches_the_figure(call, files, command, view):
    for name, option in (("one.svg", []), ("other.svg", ["--view", view])):
        run = call(*command.split(), "--plot", name, *option)
        assert run.returncode == 0, run.stderr
    assert Path("one.svg").read_text() != Path("other.svg").read_text()


@pytest.mark.slow
def test_the_command_that_plots_a_file_takes_a_view(call, files):
    assert call("plot", "a.csv", "-o", "a.svg", "--view", "xz").returncode == 0
    assert call("plot", "a.csv", "-o", "b.svg", "--view", "yz").returncode == 0
    assert Path("a.svg").read_text() != Path("b.svg").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", [(name,) for name in SHAPES] + [("experiment", "line"), ("simulate", "a.csv")], ids=" ".join
)
def test_an_unknown_view_and_a_view_of_no_figure_are_refused(call, command):
    run = call(*command, "--plot", "a.png", "--view", "top")
    assert run.returncode == 2 and "choose one of xy, xz, yz, 3d" in run.stderr
    run = call(*command, "--view", "3d")
    assert run.returncode == 2 and "give --plot" in run.stderr
    assert not Path("a.png").exists()
