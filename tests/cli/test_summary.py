"""The figures of a summary, as text and as JSON."""

from __future__ import annotations

import json

import pytest

import minsnap
from minsnap.cli.output import as_json, as_text, summarise
from minsnap.limits.limits import Limits


@pytest.fixture(scope="module")
def figures():
    return summarise(minsnap.rectangle(), 0.3, limits=Limits(speed=2.0, acceleration=1.0))


def test_each_limit_tells_how_far_it_is_used_and_where(figures):
    speed, acceleration = json.loads(as_json(figures))["limits"]
    assert speed["fraction"] == pytest.approx(figures["max_speed"] / 2.0)
    assert acceleration["fraction"] == pytest.approx(figures["max_acceleration"]) and acceleration["fraction"] > 1.0
    assert 0 <= speed["leg"] < 4 and 0.0 < speed["instant"] < figures["duration"]


def test_text_shows_limits_below_the_greatest_values(figures):
    labels = [line[:20].strip() for line in as_text(figures).splitlines()]
    assert labels[:11] == [
        "duration", "flight time", "legs", "cost", "max speed", "max acceleration", "max jerk",
        "limit speed", "limit acceleration", "limits that bind", "corridor margin",
    ]  # fmt: skip


def test_limits_of_a_shape_stand_below_the_greatest_values_too():
    limits = Limits(speed=2.0)
    figures = summarise(minsnap.circle(radius=3.0, limits=limits), limits=limits) | {"output": "circle.csv"}
    labels = [line[:20].strip() for line in as_text(figures).splitlines()]
    assert labels[3:] == ["max jerk", "limit speed", "limits that bind", "written"]


@pytest.mark.parametrize(("degree", "unit"), ((3, "m²/s³"), (7, "m²/s⁷"), (11, "m²/s¹¹")))
def test_the_cost_is_that_of_the_derivative_minimised_in_its_unit(degree, unit):
    traj = minsnap.rectangle(degree=degree)
    figures = summarise(traj)
    assert figures["cost"] == pytest.approx(traj.report.cost) and figures["cost"] > 0.0
    assert any(line.startswith("cost ") and line.endswith(f" {unit}") for line in as_text(figures).splitlines())


def test_a_shape_that_is_no_polynomial_has_speeds_and_no_cost():
    found = summarise(minsnap.circle(2.0, speed=1.0))
    assert found["max_speed"] == pytest.approx(1.0)
    assert found["cost"] is None and found["legs"] is None and found["limits"] == []


def test_the_shortest_flight_tells_how_near_it_is_to_the_least_time():
    limits = Limits(speed=2.0, acceleration=1.0, body_rate=9.0)
    path = minsnap.plan([(0, 0, 1), (3, 1, 1), (4, 4, 1)], limits=limits)
    figures = summarise(path, limits=limits)
    said = json.loads(as_json(figures))
    assert said["lower_bound"] <= said["duration"] and said["gap"] == said["duration"] / said["lower_bound"] - 1.0
    line = (
        f"flight time         at most {100 * said['gap']:.2f} % longer than any flight within these limits, body rate"
    )
    assert as_text(figures).splitlines()[1].startswith(line)


def test_a_time_that_was_given_tells_no_least_time():
    figures = summarise(minsnap.plan([(0, 0, 1), (3, 1, 1), (4, 4, 1)], [2.0, 2.0]))
    assert figures["gap"] is None and "flight time" not in as_text(figures)
