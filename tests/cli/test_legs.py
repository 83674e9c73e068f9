"""``--legs``: the table of the legs, as text and as JSON, and what it refuses."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.plot import plot_limits
from minsnap.plot.leg_figures import _spans

COURSE = """
waypoints:
  - [0, 0, 1]
  - {center: [5, 1, 1.5], normal: [1, 0.3, 0], width: 0.8, height: 0.9}
  - [6, 5, 2]
limits: {speed: 4, acceleration: 6, tilt: 0.5}
pieces: 1
"""


def run(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code or 0


def test_legs_are_a_table_after_the_summary(tmp_path, capsys):
    file = tmp_path / "course.yaml"
    file.write_text(COURSE)
    assert run("plan", file, "--legs") == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("leg  "))
    assert lines[first - 1] == "" and [line.split()[0] for line in lines[first + 1 : first + 3]] == ["0", "1"]
    assert any(line.startswith("gate of waypoint 1  0.4 m") for line in lines[first:])
    assert any("28.65 degree" in line and line.endswith("s per degree") for line in lines[first:])


def test_json_holds_both_tables(tmp_path, capsys):
    file = tmp_path / "points.csv"
    file.write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    assert run("plan", file, "--legs", "--json", "--pieces", "1") == 0
    figures = json.loads(capsys.readouterr().out)
    assert [use["leg"] for use in figures["leg_table"]] == [0, 1] and figures["legs"] == 2
    assert sum(use["duration"] for use in figures["leg_table"]) == pytest.approx(figures["duration"])
    assert {one["name"] for one in figures["sensitivities"]} == {"speed", "acceleration", "jerk"}
    assert run("plan", file, "--json", "--pieces", "1") == 0
    assert "leg_table" not in json.loads(capsys.readouterr().out)


def test_a_plan_in_a_given_time_has_the_first_table_alone(tmp_path, capsys):
    file = tmp_path / "points.csv"
    file.write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    assert run("plan", file, "--legs", "--time", "8") == 0
    out = capsys.readouterr().out
    assert "limits that bind [s]" in out and "one unit more of" not in out


def test_shapes_have_no_legs(capsys):
    assert run("circle", "--legs") == 2
    assert "a shape has no legs" in capsys.readouterr().err


def test_limits_are_drawn_with_a_bar_where_they_bind():
    limits = minsnap.Limits(speed=3, acceleration=6)
    path = minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 4, 1)], limits=limits, pieces=1)
    stack = plot_limits(path, limits)
    assert len(stack) == 3 and [text.get_text() for text in stack[0].texts] == ["0", "1"]
    assert [label.get_text() for label in stack[1].get_yticklabels()] == ["speed", "acceleration"]
    with pytest.raises(minsnap.InputError, match="no limit is set"):
        plot_limits(path, minsnap.Limits())
    with pytest.raises(minsnap.InputError, match="needs 3 axes"):
        plot_limits(path, limits, stack[:2])
    with pytest.raises(minsnap.InputError, match="a Trajectory"):
        plot_limits(minsnap.circle(1.0), limits)


def test_spans_are_stretches_in_which_something_holds():
    t = np.arange(6.0)
    assert _spans(t, np.array([1, 1, 0, 0, 1, 0], dtype=bool)) == [(0.0, 1.5), (3.5, 1.0)]
    assert _spans(t, np.ones(6, dtype=bool)) == [(0.0, 5.0)] and _spans(t, np.zeros(6, dtype=bool)) == []
