"""The command that corrects setpoints by what a flight missed, from the flight's log."""

import json
from types import SimpleNamespace

import pytest
from flown_logs import Measured, ulog_of

import minsnap
from minsnap.cli import flight_commands
from minsnap.files.autopilot_logs import write_ulog
from minsnap.files.flight_log import FlightLog
from minsnap.flight import CascadeController, compare, simulate
from minsnap.flight.mavlink.stream_options import StreamOptions
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


@pytest.mark.parametrize("writes", ["log", "damaged", None])
def test_a_log_in_the_folder_counts_if_it_was_written_during_the_flight(monkeypatch, tmp_path, writes):
    """That of yesterday used to be taken for the flight where the autopilot wrote none; one unread ended it all."""
    plan = minsnap.line().sample(20.0)
    folder, files = tmp_path / "logs", ("old.ulg", "growing.ulg")
    folder.mkdir()
    for name in files:
        (folder / name).write_bytes(b"before")

    def fly(*_):
        if writes == "log":
            (folder / "growing.ulg").unlink()
            write_ulog(FlightLog(plan, plan, 0.0), folder / "growing.ulg")
        elif writes:
            (folder / "growing.ulg").write_bytes(b"before and after")
        return SimpleNamespace(completed=True)

    monkeypatch.setattr(flight_commands, "fly", fly)
    pilot = flight_commands._Pilot("udpin:0", StreamOptions(), tmp_path / "tuned.csv", folder, False)
    log = pilot.fly(plan, 1)
    assert log == (folder / "growing.ulg" if writes == "log" else tmp_path / "tuned-1.log.csv")


def test_what_is_sent_is_not_written_over_the_plan(call, tmp_path):
    minsnap.write_csv(minsnap.line(), tmp_path / "tuned-2.csv")
    plan = (tmp_path / "tuned-2.csv").read_bytes()
    done = call("tune", "tuned-2.csv", "--connect", "udpin:0", "-o", "tuned.csv")
    assert done.returncode == 2 and "tuned-2.csv" in done.stderr
    assert (tmp_path / "tuned-2.csv").read_bytes() == plan
    none = call("tune", "tuned-2.csv", "--connect", "udpin:0", "-o", "other.csv", "--logs", "nowhere")
    assert none.returncode == 2 and "nowhere is no folder" in none.stderr
