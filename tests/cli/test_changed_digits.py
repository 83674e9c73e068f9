"""Files of plans in which one digit was changed: what is said to be in order keeps what its file says."""

import json
import re

import numpy as np
import pytest

import minsnap
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials

POINTS, LIMITS = [(0, 0, 1), (4, 0, 1), (4, 3, 1.5)], minsnap.Limits(speed=2.0, acceleration=3.0)


@pytest.fixture(scope="module")
def plan():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=0.3, pieces=2)


def written(plan, path):
    if path.suffix == ".csv":
        minsnap.write_csv(plan, path, rate=20.0)
    else:
        write_polynomials(plan, path, waypoints=POINTS, corridor=0.3, limits=LIMITS)
    return path.read_text()


def with_changed_digit(text, draw):
    place = int(draw.choice([found.start() for found in re.finditer(r"\d", text)]))
    digit = str(draw.choice([one for one in "0123456789" if one != text[place]]))
    return text[:place] + digit + text[place + 1 :]


def keeps_what_is_said(stored):
    """Samples of the curve against the corridor and the limits of the file, and the joints of its pieces."""
    curve, points, s = stored.trajectory, np.asarray(stored.waypoints), np.linspace(0.0, 1.0, 33)
    knots = curve.breaks
    t = np.minimum(knots[:-1, None] + s * np.diff(knots)[:, None], curve.duration).reshape(len(points) - 1, -1)
    for times, start, end in zip(t, points[:-1], points[1:], strict=True):
        offset, along = curve(times) - start, (end - start) / np.linalg.norm(end - start)
        assert np.abs(offset - np.outer(offset @ along, along)).max() <= stored.corridor + 1e-9
    for order, bound in ((1, stored.limits.speed), (2, stored.limits.acceleration)):
        assert np.linalg.norm(curve(t.ravel(), order), axis=1).max() <= bound * (1.0 + 1e-6)
    for order, name in enumerate(("speed", "acceleration", "jerk"), 1):
        most, said = np.linalg.norm(curve(t.ravel(), order), axis=1).max(), stored.certificate[f"max_{name}"]
        assert most <= said * (1.0 + 1e-6) + 1e-8
    assert np.abs(curve.control_points[:-1, -1] - curve.control_points[1:, 0]).max() <= 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["json", "yaml"])
def test_a_changed_plan_in_order_keeps_what_its_file_says(plan, ending, call, tmp_path):
    path, draw, outcomes = tmp_path / f"plan.{ending}", np.random.default_rng(3), []
    text = written(plan, path)
    assert call("check", str(path)).returncode == 0
    for _ in range(40):
        path.write_text(with_changed_digit(text, draw))
        outcomes.append(call("check", str(path)).returncode)
        if outcomes[-1]:
            continue
        keeps_what_is_said(read_polynomials(path))
    assert 10 <= sum(outcome != 0 for outcome in outcomes) < 40


@pytest.mark.parametrize("moved", [-0.05, 0.05])
def test_a_plan_that_reaches_more_than_its_file_says_is_refused(plan, moved, call, tmp_path):
    """A point beside an end at rest moves along its leg, within the corridor, the limits and the joints."""
    path = tmp_path / "plan.json"
    stored = json.loads(written(plan, path))
    stored["control_points"][0][2][0] += moved
    path.write_text(json.dumps(stored))
    run = call("check", str(path))
    assert run.returncode == 1
    assert "the plan reaches" in run.stdout
    assert "and its file says" in run.stdout


@pytest.mark.slow
def test_a_changed_setpoint_that_no_flight_passes_is_refused(plan, call, tmp_path):
    """Half of what a column spans, in positions and velocities, which the next column bounds; else thrice."""
    path, draw = tmp_path / "plan.csv", np.random.default_rng(4)
    lines = written(plan, path).splitlines()
    rows = np.array([line.split(",") for line in lines[1:]], dtype=float)
    for column, share in ((1, 0.5), (2, 0.5), (4, 0.5), (5, 0.5), (7, 3.0), (8, 3.0)):
        for _ in range(4):
            row, changed = int(draw.integers(2, len(rows) - 2)), rows.copy()
            changed[row, column] += share * draw.choice([-1.0, 1.0]) * np.ptp(rows[:, column])
            path.write_text("\n".join([lines[0], *(",".join(map(repr, one.tolist())) for one in changed)]) + "\n")
            assert call("check", str(path)).returncode == 1, (row, column)
