"""The table of limits: it has a row for each limit, and the rest of the library reads it."""

from dataclasses import fields
from math import radians
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.basics.limit_kinds import KIND, KINDS
from minsnap.cli.options import limit_values
from minsnap.cli.output import as_text, summarise
from minsnap.cli.planning import TimingOptions
from minsnap.limits.limits import Limits
from minsnap.limits.measures import MEASURES, sampled_motion
from minsnap.limits.uses_over_time import utilisation_curves
from minsnap.plot.style import dense_samples
from minsnap.vehicle import Quadrotor

OF_PLANS = [kind for kind in KINDS if kind.measure != "rotors"]
CORNERS = [(0, 0, 1), (4, 0, 2), (4, 3, 1)]


@pytest.fixture(scope="module")
def path():
    return minsnap.plan(CORNERS, [2.0, 1.6], yaw=[0.0, 1.0, 0.5])


def test_every_field_of_limits_has_a_row_in_the_same_order():
    assert [entry.name for entry in fields(Limits) if entry.name not in ("norm", "gravity", "leg_speeds")] == [
        k.name for k in OF_PLANS
    ]


def test_walls_are_named_after_their_limits():
    """Body and yaw rate are not convex and have none."""
    limits = Limits(**{kind.name: 0.5 if kind.least else 1.2 for kind in OF_PLANS})
    names = {wall.name for wall in limits.walls(np.zeros((3, 3)))}
    assert names == {kind.name for kind in OF_PLANS} - {"body_rate", "yaw_rate"}


def test_the_docs_list_every_limit_and_its_option():
    text = (Path(__file__).parents[2] / "docs" / "limits.rst").read_text()
    for kind in OF_PLANS:
        assert f"``{kind.name}``" in text and f"``{kind.option}``" in text, kind.name


@pytest.mark.parametrize("kind", OF_PLANS, ids=lambda kind: kind.name)
def test_the_option_sets_the_limit(kind):
    field = kind.option.lstrip("-").replace("-", "_")
    value = 0.9 if kind.least else 30.0 if kind.degrees else 1.5
    limits = TimingOptions(**{field: value}).limits
    assert limits.given()[kind.name] == (radians(value) if kind.degrees else value)
    assert limit_values(TimingOptions()) == {}


@pytest.mark.parametrize("kind", OF_PLANS, ids=lambda kind: kind.name)
def test_the_curve_drawn_has_the_exact_maximum_as_its_largest_value(kind, path):
    limits = Limits(**{kind.name: 1.2 if kind.name == "max_thrust" else 0.5})
    (used,) = limits.utilisation(path)
    (curve,) = utilisation_curves(dense_samples(path), limits).values()
    assert curve.max() == pytest.approx(used.fraction, rel=2e-3)
    assert curve.max() <= used.fraction * (1.0 + 1e-9)


@pytest.mark.parametrize("norm", ["euclidean", "axis"])
def test_walls_hold_at_samples_where_the_measure_is_within_the_limit(path, norm):
    t = np.linspace(0.0, path.duration, 301)
    motion = sampled_motion(dense_samples(path), norm, Limits().medium)
    assert len(t) and (motion.order(0) == dense_samples(path).position).all()
    for kind in OF_PLANS:
        if kind.measure not in MEASURES or kind.least:
            continue
        values = MEASURES[kind.measure].sampled(motion, kind.order)
        limit = float(np.median(values[values > 0.0])) if (values > 0.0).any() else 1.0
        if (kind.name == "max_thrust" and limit <= 1.0) or limit <= 0.0:
            continue
        inside = np.ones(len(values), dtype=bool)
        for wall in Limits(**{kind.name: limit, "norm": norm}).walls(path(path.leg_breaks)):
            cones, points = wall, motion.order(wall.order)
            inside &= (cones.slack(points[None])[cones.leg == 0] >= -1e-9).all(axis=0)
        if kind.measure != "body_rate":
            assert (inside == (values <= limit * (1.0 + 1e-9))).all(), kind.name


def test_a_summary_prints_every_limit_in_its_unit(path):
    limits = Limits.of(Quadrotor.dji_f330(), speed=9.0, climb_speed=2.0)
    lines = [line for line in as_text(summarise(path, limits=limits)).splitlines() if line.startswith("limit ")]
    assert any("min rotor thrust" in line and " N, on leg" in line for line in lines)
    assert any("limit rotor thrust" in line and " N, on leg" in line for line in lines)
    assert any("climb speed" in line and " m/s, on leg" in line for line in lines)
    assert {used.name for used in limits.utilisation(path)} <= set(KIND)
