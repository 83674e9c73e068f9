from dataclasses import replace

import numpy as np
import pytest
from batches import good_row, walks, write_problems

import minsnap
from minsnap.batch.dataset_rows import STATUSES, planned_row, request, stopped_row
from minsnap.batch.spec import read_mapping
from minsnap.durations import allocate, within_limits
from minsnap.durations.refused_times import AskedTimes


def test_a_row_is_what_plan_and_certify_return():
    spec = walks()
    for number in (0, 7):
        row, given = planned_row(spec, number), request(spec, number).arguments
        curve = minsnap.plan(**given)
        proof = minsnap.certify(curve, given["waypoints"], given["corridor"])
        assert row["status"] == "done" and row["certified"] is True and proof.ok
        assert (row["control_points"] == curve.control_points).all() and row["cost"] == curve.cost()
        assert (row["corridor_margin"], row["max_jerk"]) == (proof.corridor_margin, proof.max_jerk)
        assert row["corridor"] == given["corridor"] and (row["waypoints"] == given["waypoints"]).all()
        assert (row["legs"], row["dim"], row["degree"]) == (curve.legs, 3, 7)


def test_what_was_drawn_is_in_the_row():
    spec = walks(limits={"speed": [2.0, 4.0], "acceleration": 6.0}, vehicle=["f330", "crazyflie"], legs=2)
    rows = [planned_row(spec, number) for number in range(6)]
    assert {row["vehicle"] for row in rows} == {"dji_f330", "crazyflie"}
    for row in rows:
        assert row["status"] == "done" and row["certified"] and row["limit_acceleration"] == 6.0
        assert 2.0 <= row["limit_speed"] <= 4.0 and row["max_speed"] <= row["limit_speed"] * (1.0 + 1e-9)
        assert row["limit_max_thrust"] > 1.0 and row["limit_jerk"] is None
    assert planned_row(walks(total_time=9.0), 0)["total_time"] == 9.0


def test_gates_and_boxes_are_in_the_row():
    spec = read_mapping({"generator": "gates", "count": 2, "legs": 3})
    row, given = planned_row(spec, 1), request(spec, 1).arguments
    assert row["status"] == "done" and row["certified"]
    assert np.isnan(row["gates"][[0, 3]]).all() and (row["gates"][1] == given["waypoints"][1].corners).all()
    spec = read_mapping({"generator": "boxes", "count": 2, "extent": 8.0, "dim": 2})
    row, given = planned_row(spec, 0), request(spec, 0).arguments
    assert row["status"] == "done" and (row["boxes"][:, 1] == given["corridor"].upper).all()


def test_poisoned_problems_have_their_status_and_sentence(tmp_path):
    rows = [good_row(seed) for seed in range(6)]
    rows[0]["waypoints"][1][2] = float("nan")
    rows[1] |= {"room": [[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]]}
    rows[2] |= {"start": {"velocity": [0.0, 40.0, 0.0]}, "corridor": 0.01}
    rows[3]["durations"] = [1.0]
    rows[5] |= {"limits": {"body_rate": 1e-3}}
    write_problems(tmp_path / "p.csv", rows)
    spec = read_mapping({"table": str(tmp_path / "p.csv")})
    found = [planned_row(spec, number) for number in range(6)]
    assert [row["status"] for row in found] == ["invalid", "invalid", "infeasible", "invalid", "done", "unsolved"]
    assert "waypoint 1" in found[0]["error"] and "durations" in found[3]["error"]
    assert (
        all("control_points" not in row for row in found[:4]) and (found[3]["waypoints"] == rows[3]["waypoints"]).all()
    )


def test_a_mistake_in_the_code_is_a_row_too(monkeypatch):
    monkeypatch.setattr("minsnap.batch.dataset_rows.plan", lambda **given: 1 / 0)
    row = planned_row(walks(), 3)
    assert row["status"] == "crashed" and row["error"] == "ZeroDivisionError: division by zero"
    assert set(stopped_row(walks(), 3, "timeout", "slow")) == {"problem", "seed", "status", "error"}
    assert "timeout" in STATUSES


@pytest.mark.parametrize("option", [{"degree": 5}, {"pieces": 2}, {"total_time": 12.0}, {"waypoint_tolerance": 0.1}])
def test_options_of_plan_reach_it(option):
    row = planned_row(walks(**option), 0)
    curve = minsnap.plan(**request(walks(**option), 0).arguments)
    assert row["status"] == "done" and row["certified"] and (row["control_points"] == curve.control_points).all()


def test_what_the_last_look_refuses_is_no_row_of_a_data_set(monkeypatch):
    """A limit is switched off inside: the row says so, and has no curve."""
    spec, solve = walks(limits={"speed": 2.0}), allocate._choose_times
    faster = minsnap.Limits(speed=9.0)
    monkeypatch.setattr(
        allocate, "_choose_times", lambda task, timing, *rest: solve(task, replace(timing, limits=faster), *rest)
    )
    monkeypatch.setattr(AskedTimes, "in_other_times", lambda *question: None)
    monkeypatch.setattr(within_limits, "at_rest_everywhere", lambda *question: None)
    row = planned_row(spec, 0)
    assert row["status"] == "unsolved" and "last look: speed reaches" in row["error"] and "control_points" not in row
