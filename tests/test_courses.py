"""The courses of the benchmarks: every file is read wholly, and a plan through what it says is certified."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import minsnap

ROOT = Path(__file__).parents[1] / "benchmarks"
KNOWN = set("name waypoints gates boxes tube ball tolerance start end closed yaw limits vehicle best published".split())


@pytest.fixture(scope="module")
def courses():
    spec = importlib.util.spec_from_file_location("courses", ROOT / "courses.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["courses"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["courses"]


FILES = sorted(path.stem for path in (ROOT / "courses").glob("*.yaml"))


def test_there_are_enough_of_them():
    assert len(FILES) >= 10


@pytest.mark.parametrize("name", FILES)
def test_a_course_says_nothing_that_is_not_read(name):
    data = yaml.safe_load((ROOT / "courses" / f"{name}.yaml").read_text(encoding="utf-8"))
    assert set(data) <= KNOWN and "limits" in data
    for figure in (*([data["best"]] if "best" in data else []), *data.get("published", ())):
        assert figure["seconds"] > 0.0 and figure["what"]


@pytest.mark.parametrize("name", FILES)
def test_a_slow_flight_through_a_course_is_certified(courses, name):
    course = courses.read_course(name)
    how = {key: value for key, value in course.arguments.items() if key != "limits"}
    traj = minsnap.plan(
        total_time=60.0 if "moving" not in name else 5.0, search=minsnap.Search(split="distance"), **how
    )
    found = minsnap.certify(traj, **(course.checks | {"limits": None}))
    assert found.ok


def test_a_vehicle_brings_the_limits_of_its_rotors(courses):
    course = courses.read_course("split_s")
    assert course.vehicle.rotor_thrust_limits == pytest.approx((0.0, 6.879))
    assert course.limits.max_thrust == pytest.approx(4 * 6.879 / (0.85 * 9.80665))
    assert np.shape(course.arguments["waypoints"]) == (21, 3)
    assert course.best.seconds < course.published[0].seconds
