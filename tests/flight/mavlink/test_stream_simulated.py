"""A whole flight of the simulated quadrotor by MAVLink alone: arm, offboard, trajectory, hold, land."""

import csv

import numpy as np
import pytest
from clocks import SharedClock
from flying import Flight, in_ned, patient_rules
from quadrotor_body import QuadrotorBody
from standin import LAND, StandIn

import minsnap
from minsnap.basics.arrays import interpolated
from minsnap.files.frames import map_vectors


@pytest.mark.slow
def test_from_the_ground_round_a_planned_rectangle_and_back_to_the_ground(tmp_path):
    plan = minsnap.rectangle(width=3, length=2)
    samples = plan.sample(20.0)
    ground = (*in_ned(samples.position[0])[:2], 0.0)
    clock, log = SharedClock(), tmp_path / "flight.csv"
    with StandIn(clock=clock, body=QuadrotorBody(ground), armed=False) as vehicle:
        rules = patient_rules(max_start_distance=0.2, abort_distance=1.5)
        with Flight(vehicle, samples, clock, rules=rules, arm=True, land=True, log=log, delay=0.2) as flight:
            report = flight.result()
        assert vehicle.mode == LAND and not vehicle.failsafes
        vehicle.until(lambda v: not v.armed)
    assert report.completed and len(samples) - report.schedule.skipped <= report.flown <= len(samples)
    with open(log, newline="") as file:
        lines = list(csv.DictReader(file))

    def places(kept):
        return np.array([[float(line[name]) for name in ("time", *"xyz")] for line in kept])

    asked = places(line for line in lines if line["kind"] == "setpoint" and line["index"])
    seen = places(line for line in lines if line["kind"] == "position")
    there = interpolated(asked[:, 0], seen[:, 0], seen[:, 1:])
    apart = np.linalg.norm(there - asked[:, 1:], axis=1)
    assert report.rmse == pytest.approx(np.sqrt((apart**2).mean()), rel=0.03), "as late as the body is behind it"
    assert report.worst_error == pytest.approx(apart.max(), rel=0.03) and apart.max() < 0.8
    track = map_vectors(seen[:, 1:], "ned", "enu")
    farthest = [np.linalg.norm(track - corner, axis=1).min() for corner in samples.position[:: len(samples) // 4]]
    assert max(farthest) < 0.4, "it went round the corners"
