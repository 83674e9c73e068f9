"""The script that ArduCopter flies by itself, run by Lua beside what stands in for the vehicle."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from helpers import __path__ as helpers

from minsnap import Limits, Trajectory, plan
from minsnap.errors import FileError
from minsnap.files.convert import write_any
from minsnap.files.formats.ardupilot_lua import write_script

STANDIN = Path(helpers[0]) / "ardupilot.lua"

ON = "2=world.switch = 2"


def lua(script: Path, seconds: float, *events: str) -> list[list[str]]:
    """Run a script for some seconds, and return what it did."""
    found = shutil.which("lua5.3") or shutil.which("lua")
    if found is None and not os.environ.get("CI"):
        pytest.skip("there is no Lua here")
    assert found is not None, "continuous integration needs Lua: .ci/run installs it"
    done = subprocess.run(
        [found, str(STANDIN), str(script), str(seconds), *events], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split("\t") for line in done.stdout.splitlines()]


def said(rows: list[list[str]]) -> list[str]:
    return [row[3].removeprefix("minsnap: ") for row in rows if row[0] == "say"]


def setpoints(rows: list[list[str]]) -> np.ndarray:
    return np.array([row[1:] for row in rows if row[0] == "set"], dtype=float)


@pytest.fixture(scope="module")
def flight() -> Trajectory:
    limits = Limits(speed=4, acceleration=5, jerk=40)
    return plan([[0, 0, 0], [6, 0, 1], [6, 4, 2], [0, 0, 3]], limits=limits, yaw=[0.0, 1.0, 2.0, 7.0])


@pytest.fixture
def script(flight: Trajectory, tmp_path: Path) -> Path:
    path = tmp_path / "flight.lua"
    write_script(flight, path)
    return path


def test_it_sends_what_was_planned_and_holds_the_end(flight: Trajectory, script: Path) -> None:
    rows = lua(script, flight.duration + 8, ON)
    sent = setpoints(rows)
    t = np.minimum(sent[:, 0] - sent[0, 0], flight.duration)
    for order, columns in ((0, sent[:, 1:4]), (1, sent[:, 4:7]), (2, sent[:, 7:10])):
        enu = columns[:, [1, 0, 2]] * (1, 1, -1)
        np.testing.assert_allclose(enu, flight(t, order), atol=10.0 ** (2 * order - 5))
    turned = np.radians(90 - sent[:, 10]) - flight.yaw(t)
    np.testing.assert_allclose(np.remainder(turned + 1, 2 * np.pi) - 1, 0, atol=1e-5)
    np.testing.assert_allclose(np.radians(-sent[:, 11]), flight.yaw(t, 1), atol=1e-4)
    assert said(rows)[-1] == "flown; holds until the mode is changed"
    assert sent[-1, 0] > flight.duration + 7


def test_numbers_of_single_precision_stay_within_a_millimetre(flight: Trajectory, script: Path) -> None:
    lines = script.read_text(encoding="utf-8").splitlines()
    rows = [line.strip(" {},").split(", ") for line in lines if line.startswith("  {")]
    pieces = np.array(rows, dtype=np.float32)
    for start, row in zip(flight.breaks, pieces, strict=False):
        s = np.linspace(0, row[0], 50, dtype=np.float32)
        value = np.zeros((3, 50), dtype=np.float32)
        for power in row[1:25].reshape(3, 8).T[::-1]:
            value = value * s + power[:, None]
        planned = flight(np.minimum(start + s.astype(float), flight.duration)).T
        np.testing.assert_allclose(value[[1, 0, 2]] * [[1], [1], [-1]], planned, atol=1e-3)


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        ("6=world.mode = 5", "stopped, the mode was left"),
        ("6=world.armed = false", "stopped, disarmed"),
        ("6=world.here = nil", "stopped, no position"),
        ("6=world.takes = false", "stopped, a setpoint was refused"),
        ("6=world.here:x(90)", "stopped, "),
        ("6=world.now = world.now + 600", "stopped, the script was held up"),
    ],
)
def test_each_rule_stops_it_for_good(script: Path, event: str, reason: str) -> None:
    rows = lua(script, 12, ON, event, "9=world.mode, world.armed, world.takes = 4, true, true")
    assert said(rows)[-1].startswith(reason)
    assert setpoints(rows)[-1, 0] < 7.2
    given_back = [row[2] for row in rows if row[0] == "mode"]
    assert given_back == ([] if "mode" in event or "armed" in event else ["17"])


@pytest.mark.parametrize(
    "event",
    ["0=world.switch = 2", "2=world.switch = 0", "1=world.armed = false", "1=world.here:x(3)", "1=world.mode = 5"],
)
def test_it_begins_only_by_a_switch_that_was_low_and_at_rest_at_the_start(script: Path, event: str) -> None:
    events = [event] if "switch" in event else [event, ON]
    assert len(setpoints(lua(script, 8, *events))) == 0


def test_it_can_begin_where_the_vehicle_hovers(flight: Trajectory, script: Path) -> None:
    script.write_text(script.read_text(encoding="utf-8").replace("FROM_HERE = false", "FROM_HERE = true"), "utf-8")
    sent = setpoints(lua(script, flight.duration + 8, "1=world.here:x(20)", ON))
    np.testing.assert_allclose(sent[0, 1:4], [20, 0, 0], atol=1e-9)
    np.testing.assert_allclose(sent[-1, 1:4], [20, 0, -3], atol=1e-5)


def test_what_does_not_rest_at_both_ends_is_refused(tmp_path: Path) -> None:
    moving = plan([[0, 0, 1], [5, 0, 1], [5, 5, 1]], total_time=5.0, start={"velocity": [1, 0, 0]})
    with pytest.raises(FileError, match=r"begins and ends at rest, and the path is 1 m/s fast at its start"):
        write_any(moving, tmp_path / "moving.lua")
    assert not list(tmp_path.iterdir())
