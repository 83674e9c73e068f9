"""The packages for ROS 2 in C++: compiled against stand-ins of the headers of others, and driven by their topics."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c_programs import TESTS as PROGRAMS
from c_programs import build, link_flags

import minsnap
from minsnap.native.library import core

TESTS = PROGRAMS / "ros"
ROS = PROGRAMS.parents[1] / "ros"
OWN = ROS / "minsnap_cpp" / "include"
OTHERS = re.compile(r"#include <((?:rclcpp|nav_msgs|trajectory_msgs|builtin_interfaces|px4|Eigen)[^>]*)>")
LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0)

pytestmark = pytest.mark.skipif(core().library is None, reason="there is no native core")


@pytest.fixture(scope="module")
def headers(tmp_path_factory):
    """A folder in which each header of others is that of the stand-ins."""
    folder = tmp_path_factory.mktemp("include")
    for source in ROS.rglob("*.?pp"):
        for name in OTHERS.findall(source.read_text(encoding="utf-8")):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f'#include "{TESTS / "stand_ins.hpp"}"\n', encoding="utf-8")
    return folder


def rows_of(said, word):
    return np.array([line.split()[1:] for line in said if line.split()[0] == word], dtype=float)


def run(source: Path, headers: Path, *flags: str) -> list[str]:
    flags = ("-Wall", "-Wextra", "-Werror", f"-I{OWN}", f"-I{headers}", "-pthread", *flags, *link_flags())
    program = build(source, headers / f"test_{source.stem}", *flags)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()


def test_the_node_plans_begins_at_the_start_changes_in_flight_and_ends(headers):
    said = run(TESTS / "planner.cpp", headers, "-DMINSNAP_WITH_PX4=1", str(ROS / "minsnap_cpp/src/planner.cpp"))
    assert said[0] == "error positions in odom, and plans in map: transform them, or set frame_id"
    assert said[1] == "error a plan needs at least two waypoints"
    plan = minsnap.plan([[0, 0, 1], [4, 0, 1], [4, 3, 1.5]], limits=LIMITS, corridor=0.3)
    samples = plan.sample(20.0)
    first = rows_of(said, "plan")[: len(samples)]
    np.testing.assert_array_equal(first, np.hstack([samples.position, samples.velocity]))
    sent = rows_of(said, "setpoint")
    waiting = sent[sent[:, 0] < 1.4]
    np.testing.assert_allclose(waiting[:, 1:], [[0, 0, -1]] * len(waiting))
    assert len(waiting) >= 25
    began = sent[np.flatnonzero(np.ptp(sent[:, 1:], axis=1) != 1.0)[0] - 1, 0]
    assert 1.45 <= began <= 1.7
    flown = sent[(sent[:, 0] > began) & (sent[:, 0] < 3.0)]
    errors = [
        np.abs(plan(flown[:, 0] - start)[:, [1, 0, 2]] * (1, 1, -1) - flown[:, 1:]).max()
        for start in (began, began - 0.05)
    ]
    assert min(errors) < 1e-5
    assert (
        "error the vehicle flies a plan: change it by the service replan, or plan from its end once it is there" in said
    )
    assert int(next(line for line in said if line.startswith("changed")).split()[1]) > 10
    np.testing.assert_allclose(sent[-1, 1:], [6, 4.1, -1.8], atol=1e-5)
    steps = np.linalg.norm(np.diff(sent[:, 1:], axis=0), axis=1)
    assert steps.max() <= 3.0 * 0.05 + 1e-5
    assert said[-2].startswith("info the vehicle does not follow setpoints any more") and said[-1] == "over"


def test_without_px4_the_node_is_compiled_and_publishes_plans(headers):
    said = run(TESTS / "planner.cpp", headers, "-DMINSNAP_WITH_PX4=0", str(ROS / "minsnap_cpp/src/planner.cpp"))
    assert said[0] == "info built without px4_msgs: the plan is published, and no setpoints for PX4"
    assert len(rows_of(said, "plan")) > 50 and not len(rows_of(said, "setpoint"))


def test_the_flight_mode_flies_from_where_the_vehicle_hovers_and_completes(headers):
    said = run(TESTS / "mode.cpp", headers, f"-I{ROS / 'minsnap_px4_mode/src'}")
    plan = minsnap.plan([[0, 0, 2], [4, 0, 2], [4, 3, 3]], limits=LIMITS)
    sent = rows_of(said, "setpoint")
    t = np.minimum(np.cumsum(np.full(len(sent), np.float32(0.02), dtype=float)), plan.duration)
    planned = np.hstack([plan(t, order)[:, [1, 0, 2]] * (1, 1, -1) for order in (0, 1)])
    np.testing.assert_allclose(sent, planned, atol=1e-5)
    assert said[-3:] == ["error the vehicle moves: hover first", "completed", "failed"]
