"""The command that corrects setpoints by what a flight missed, from the flight's log."""

import json

import pytest
from flown_logs import Measured, ulog_of

import minsnap
from minsnap.files.autopilot_logs import write_ulog
from minsnap.flight import CascadeController, compare, simulate
from minsnap.flight.tracking.log_comparison import simulated_log
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

VEHICLE = Quadrotor.px4_sih()


def flown(sent, rate=None):
    end = sent.duration + 1.0
    return simulate(VEHICLE, CascadeController(), sent, setpoint_rate=rate, setpoint_delay=0.1, duration=end)


@pytest.mark.slow
def test_the_next_flight_misses_the_plan_by_half(call, tmp_path):
    corners = [(0, 0, 2), (8, 0, 2), (8, 4, 2), (0, 4, 2), (0, 0, 2)]
    path = minsnap.plan(corners, corridor=0.3, total_time=14.0)
    plan = path.sample(20.0)
    minsnap.write_csv(plan, tmp_path / "plan.csv")
    first = flown(path, 20.0)
    (tmp_path / "1.ulg").write_bytes(ulog_of(Measured(VEHICLE, first)))
    done = call("tune", "plan.csv", "1.ulg", "-o", "next.csv", "--report", "page.html")
    assert done.returncode == 0, done.stderr
    assert "this flight missed the plan by" in done.stdout
    assert "<h2>Legs</h2>" in (tmp_path / "page.html").read_text()
    second = flown(minsnap.read_csv(tmp_path / "next.csv"))
    write_ulog(simulated_log(VEHICLE, second, minsnap.read_csv(tmp_path / "next.csv")), tmp_path / "2.ulg")
    both = json.loads(
        call("compare", "plan.csv", "1.ulg", "2.ulg", "--sent", "plan.csv", "--sent", "next.csv", "--json").stdout
    )
    errors = [compare(plan, Samples(each.t, each.position)).rmse_3d for each in (first, second)]
    assert errors[1] < 0.5 * errors[0]
    assert [both[name]["rmse_3d"] for name in ("1.ulg", "2.ulg")] == pytest.approx(errors, abs=0.02)
    once = call("compare", "plan.csv", "1.ulg", "2.ulg", "--sent", "next.csv")
    assert once.returncode == 2 and "--sent stands 1 times beside 2 flights" in once.stderr
    checked = call("check", "next.csv")
    assert checked.returncode == 0
    wrong = call("tune", "plan.csv", "next.csv", "-o", "x.csv")
    assert wrong.returncode == 2 and "is no log with setpoints" in wrong.stderr
    for given in (["plan.csv"], ["plan.csv", "1.ulg", "--connect", "udpin:0"]):
        both = call("tune", *given)
        assert both.returncode == 2 and "or --connect to fly: one of them" in both.stderr
