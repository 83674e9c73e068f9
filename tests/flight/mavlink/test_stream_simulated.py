"""A whole flight of the simulated quadrotor by MAVLink alone: arm, offboard, trajectory, hold, land."""

import csv

import numpy as np
import pytest
from clocks import SharedClock
from flying import Flight, in_ned, patient_rules
from quadrotor_body import QuadrotorBody
from standin import LAND, StandIn

import minsnap
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
    assert report.rmse < 0.4 and report.worst_error < 0.8
    with open(log, newline="") as file:
        lines = list(csv.DictReader(file))
    flown = [[float(line[name]) for name in "xyz"] for line in lines if line["kind"] == "position"]
    track = map_vectors(flown, "ned", "enu")
    farthest = [np.linalg.norm(track - corner, axis=1).min() for corner in samples.position[:: len(samples) // 4]]
    assert max(farthest) < 0.4, "it went round the corners"
