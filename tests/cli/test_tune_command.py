"""The command that corrects setpoints by what a flight missed, from the flight's log."""

import json
import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from flown_logs import Measured, ulog_of

import minsnap
from minsnap.cli import tune_commands
from minsnap.cli.flight_commands import FlightOptions
from minsnap.errors import InputError
from minsnap.files.autopilot_logs import write_ulog
from minsnap.files.flight_log import FlightLog
from minsnap.files.limits_yaml import read_limits
from minsnap.flight import CascadeController, compare, simulate
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.flight.tracking.simulated_flights import simulated_log
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


@pytest.mark.slow
def test_learning_by_hand_ends_where_it_stops_helping(call, tmp_path):
    """Nothing said so, and a mission went on from 0.16 to 0.66 m: now the note of what was sent tells of the last."""
    plan = minsnap.plan([(0, 0, 2), (6, 0, 2), (6, 3, 2)], corridor=0.2, total_time=8.0).sample(20.0)
    minsnap.write_csv(plan, tmp_path / "plan.csv")

    def log(sent, name, late):
        setpoints = minsnap.read_csv(tmp_path / sent)
        flight = simulate(VEHICLE, CascadeController(), setpoints, setpoint_delay=late, duration=9.0)
        write_ulog(simulated_log(VEHICLE, flight, setpoints), tmp_path / name)

    log("plan.csv", "1.ulg", 0.1)
    first = call("tune", "plan.csv", "1.ulg", "-o", "second.csv")
    assert "second.csv is for the next one" in first.stdout
    log("second.csv", "2.ulg", 0.1)
    again = call("tune", "plan.csv", "2.ulg", "--sent", "second.csv", "-o", "third.csv")
    assert "third.csv is for the next one" in again.stdout
    log("third.csv", "3.ulg", 0.9)
    worse = call("tune", "plan.csv", "3.ulg", "--sent", "third.csv", "-o", "fourth.csv")
    assert worse.returncode == 0 and "learning ends: it missed by more than the 0." in worse.stdout
    assert "fourth.csv is second.csv, the best that was flown" in worse.stdout
    assert (tmp_path / "fourth.csv").read_bytes() == (tmp_path / "second.csv").read_bytes()


def test_a_flight_begins_where_the_vehicle_landed():
    """The next one was refused 1.14 m from its start, with the advice to give an option that tune did not have."""
    assert FlightOptions(trigger="now", origin="current").settings().relative
    assert not FlightOptions(trigger="now").settings().relative
    with pytest.raises(InputError, match="--origin is 'here'"):
        FlightOptions(origin="here").settings()


def test_limits_of_the_vehicle_come_from_a_file(call, tmp_path):
    (tmp_path / "limits.yaml").write_text("limits:\n  tilt: 0.2\n  horizontal_speed: 4\n")
    (tmp_path / "none.yaml").write_text("waypoints: [[0, 0, 1], [1, 0, 1]]\n")
    assert read_limits(tmp_path / "limits.yaml") == minsnap.Limits(tilt=0.2, horizontal_speed=4.0)
    minsnap.write_csv(minsnap.line(), tmp_path / "plan.csv")
    none = call("tune", "plan.csv", "1.ulg", "--limits", "none.yaml")
    assert none.returncode == 2 and "none.yaml has no limits: give a file as minsnap limits -o writes it" in none.stderr


@pytest.mark.parametrize("writes", ["log", "split", "damaged", None])
def test_a_log_in_the_folder_counts_if_it_was_written_during_the_flight(monkeypatch, tmp_path, writes):
    """That of yesterday used to be taken for the flight where the autopilot wrote none; one unread ended it all."""
    plan = minsnap.line().sample(20.0)
    folder, files = tmp_path / "logs", ("old.ulg", "growing.ulg")
    folder.mkdir()
    for name in files:
        (folder / name).write_bytes(b"before")

    def fly(*_):
        if writes in ("log", "split"):
            (folder / "growing.ulg").unlink()
            write_ulog(FlightLog(plan, plan, 0.0), folder / "growing.ulg")
        if writes == "split":  # as an autopilot that begins a new log when it has landed
            still = replace(plan, position=np.zeros((len(plan), 3)))
            write_ulog(FlightLog(still, still, 0.0), folder / "landed.ulg")
            stat = (folder / "growing.ulg").stat()
            os.utime(folder / "landed.ulg", ns=(stat.st_atime_ns, stat.st_mtime_ns + 10**9))
        elif writes == "damaged":
            (folder / "growing.ulg").write_bytes(b"before and after")
        return SimpleNamespace(completed=True)

    monkeypatch.setattr(tune_commands, "fly", fly)
    pilot = tune_commands._Pilot("udpin:0", StreamOptions(), tmp_path / "tuned.csv", folder, False)
    log = pilot.fly(plan, 1)
    assert log == (folder / "growing.ulg" if writes in ("log", "split") else tmp_path / "tuned-1.log.csv")


def test_what_is_sent_is_not_written_over_the_plan(call, tmp_path):
    minsnap.write_csv(minsnap.line(), tmp_path / "tuned-2.csv")
    plan = (tmp_path / "tuned-2.csv").read_bytes()
    done = call("tune", "tuned-2.csv", "--connect", "udpin:0", "-o", "tuned.csv")
    assert done.returncode == 2 and "tuned-2.csv" in done.stderr
    assert (tmp_path / "tuned-2.csv").read_bytes() == plan
    none = call("tune", "tuned-2.csv", "--connect", "udpin:0", "-o", "other.csv", "--logs", "nowhere")
    assert none.returncode == 2 and "nowhere is no folder" in none.stderr
