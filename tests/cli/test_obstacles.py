"""Obstacles on the command line: in summaries, stored plans, their checks, their figures and simulated flights."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.corridors.keep_out import clearance_of, named_obstacle

COURSE = """waypoints: [[0, 0, 2], {center: [6, 0, 2], heading_deg: 0, width: 1.2, margin: 0.2}, [9, 2, 2]]
takeoff: true
limits: {speed: 2}
avoid: [{cylinder: [3, 0.2, 0.5]}, {cuboid: [7, 1.5, 0, 8, 4, 4]}]
"""
PLAN = "waypoints: [[0, 0, 2], [6, 0, 2], [9, 2, 2]]\ncorridor: 2.0\navoid: [{cylinder: [3, 0.2, 0.5]}]\n"
FILES = {"course": COURSE, "plan": PLAN}


def least(curve, avoid):
    """Return the least distance of a curve to obstacles of a file, at many instants."""
    obstacles = [named_obstacle(*named) for entry in avoid for named in entry.items()]
    points = curve(np.linspace(0.0, curve.duration, 4001))
    return min(clearance_of(obstacle, point) for obstacle in obstacles for point in points)


@pytest.fixture
def plan(call, tmp_path):
    """Plan a course or a plan file, stored as JSON; return the summary and the stored content."""

    def planned(kind, *more):
        (tmp_path / f"{kind}.yaml").write_text(FILES[kind])
        done = call("plan", f"{kind}.yaml", "--max-speed", "2", "-o", f"{kind}.json", "--json", *more)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout), json.loads((tmp_path / f"{kind}.json").read_text())

    return planned


@pytest.mark.slow
@pytest.mark.parametrize("kind", FILES)
def test_obstacles_stay_in_the_summary_the_stored_plan_and_its_check(call, plan, tmp_path, kind):
    said, stored = plan(kind)
    curve = minsnap.Trajectory(stored["control_points"], stored["durations"])
    exact = least(curve, stored["avoid"])
    assert said["obstacle_distance"] == pytest.approx(exact, abs=1e-3) and said["obstacle_distance"] <= exact
    place = curve(said["obstacle_instant"])
    assert said["obstacle"] == 0 and said["obstacle_place"] == pytest.approx(place, abs=1e-9)
    shown = call("plan", f"{kind}.json").stdout
    assert f"{said['obstacle_distance']:.4g} m from obstacle 0, at every instant, least at" in shown
    checked = call("check", f"{kind}.json", "--exact")
    assert checked.returncode == 0, checked.stdout
    assert "obstacles" in checked.stdout and "clear by" in checked.stdout and "obstacle margin" in checked.stdout
    assert json.loads(call("check", f"{kind}.json", "--json").stdout)["certified"]["obstacle"]["obstacle"] == 0
    stored["avoid"].append({"cylinder": [*curve(0.5 * curve.duration)[:2].tolist(), 0.2]})
    (tmp_path / f"{kind}.json").write_text(json.dumps(stored))
    refused = call("check", f"{kind}.json")
    last = len(stored["avoid"]) - 1
    assert refused.returncode == 1 and f"m inside obstacle {last} at" in refused.stdout


@pytest.mark.slow
def test_check_and_simulate_say_each_margin_of_a_plan(call, plan):
    plan("plan")
    checked = " ".join(call("check", "plan.json").stdout.split())
    for words in (
        "corridor of 2 m inside by",
        "obstacles clear by",
        "waypoints",
        "limit jerk",
        "limit acceleration",
    ):
        assert words in checked, checked
    flown = " ".join(call("simulate", "plan.json").stdout.split())
    assert "corridor of 2 m inside by" in flown and "obstacle 0" in flown and "stayed inside" in flown
    said = json.loads(call("simulate", "plan.json", "-o", "flown.csv", "--json").stdout)
    samples = minsnap.read_csv("flown.csv").position
    aside = min(clearance_of(named_obstacle("cylinder", [3, 0.2, 0.5]), point) for point in samples)
    assert said["obstacle"]["value"] == pytest.approx(aside, abs=2e-2) and said["corridor"]["margin"] > 0.0
    assert said["stayed_inside"] == (said["obstacle"]["value"] >= 0.0)


@pytest.mark.slow
def test_a_simulated_flight_beside_its_corridor_or_its_gate_is_told(call, tmp_path):
    assert call("rect", "--corridor", "0.1", "-o", "rect.json").returncode == 0
    said = json.loads(call("simulate", "rect.json", "--json").stdout)
    assert said["corridor"]["margin"] < 0.0 and said["stayed_inside"] is False
    assert "left by" in call("simulate", "rect.json").stdout
    gate = "{center: [4, 0, 2], heading_deg: 0, width: 0.6, margin: 0.05}"
    (tmp_path / "g.yaml").write_text(f"waypoints: [[0, 0, 2], {gate}, [4, 4, 2]]\nlimits: {{speed: 4}}\n")
    assert call("plan", "g.yaml", "-o", "g.json").returncode == 0
    checked = call("check", "g.json").stdout
    assert "gate 1" in checked and "m from its edge" in checked
    assert "gate 1" in call("simulate", "g.json").stdout


@pytest.mark.slow
def test_a_rectangle_says_how_near_it_comes_to_an_obstacle(call):
    done = call("rect", "--corridor", "1", "--avoid=0,-1.2,0.5", "-o", "r.json", "--json")
    said = json.loads(done.stdout)
    assert 0.0 <= said["obstacle_distance"] < 1.0 and said["obstacle"] == 0
    assert call("check", "r.json").returncode == 0


def test_a_box_on_the_ground_is_passed_above_it(call, tmp_path):
    """The room of ordinary flight had a floor below the ground, and the way beneath the box was the shortest."""
    (tmp_path / "box.yaml").write_text(
        "waypoints: [[0, 0, 1], [5, 0, 1]]\navoid: [{cuboid: [[2, -1, 0], [3, 1, 3]]}]\n"
    )
    assert call("plan", "box.yaml", "-o", "box.csv").returncode == 0
    assert minsnap.read_csv(tmp_path / "box.csv").position[:, 2].min() >= 0.0
