"""Flights whose setpoints were sent ahead: every tool holds them to the plan at the instant that it was made for."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.files.flights import load_log, read_stream_log
from minsnap.flight import compare, fit_flight, simulate
from minsnap.flight.mavlink.observer import StreamLog
from minsnap.flight.mavlink.setpoints import tabulate
from minsnap.flight.mavlink.vehicle_messages import VehicleState
from minsnap.flight.simulation.controllers import CascadeController
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

LATE, LEAD = 0.3, 0.2
PATH = minsnap.rectangle(width=6, length=4, total_time=14.0)
FILE = PATH.sample(20.0)


def late_flight(start=0.0):
    """Positions of a vehicle that is late by LATE after setpoints that begin at ``start``."""
    t = np.arange(0.0, PATH.duration + start + 3.0, 0.02)
    return Samples(t, PATH(np.clip(t - start - LATE, 0.0, PATH.duration)))


def truth(lead):
    """Distance to the plan, as defined: setpoints began ``lead`` before its time 0."""
    t = np.arange(0.0, PATH.duration, 0.01)
    gap = PATH(np.clip(t + lead - LATE, 0.0, PATH.duration)) - PATH(t)
    return float(np.sqrt((gap**2).sum(axis=1).mean()))


def streamed_log(path, lead):
    """What ``stream --log`` writes of such a flight."""
    table, t = tabulate(replace(FILE, lead=lead), frame="frd"), np.arange(0.0, PATH.duration + 6.0, 0.05)
    log = StreamLog(path, "frd", 0.0, lead)
    flown = late_flight(3.0)
    for now in t:
        step = round((now - 3.0) * 20.0)
        log.setpoint(now, step, table[max(step, 0)] if step > 0 else table.start, table.mask, 0.0)
        x, y, z = flown.position[np.searchsorted(flown.t, now)]
        slow = PATH(np.clip(now - 3.0 - LATE, 0, PATH.duration), 1)
        log.position(now, VehicleState(position=(x, -y, -z), velocity=(slow[0], -slow[1], -slow[2])))
    log.close()


@pytest.mark.parametrize("lead", [0.0, LEAD])
def test_a_flight_is_compared_with_the_plan_and_not_with_what_was_sent(tmp_path, lead):
    found = compare(replace(FILE, lead=lead), late_flight())
    assert found.rmse_3d == pytest.approx(truth(lead), rel=0.02) and found.delay == pytest.approx(LATE - lead, abs=2e-3)
    streamed_log(tmp_path / "a.csv", lead)
    log = load_log(tmp_path / "a.csv")
    (one,) = compare_in_log(FILE, log.reference, log.flight)
    assert one.comparison.rmse_3d == pytest.approx(truth(lead), rel=0.1)
    assert one.comparison.delay == pytest.approx(LATE - lead, abs=0.03)
    assert any("sent 0.2 s ahead" in remark for remark in one.remarks()) == bool(lead)


def test_a_fit_says_what_of_the_delay_the_lead_took(tmp_path):
    streamed_log(tmp_path / "a.csv", LEAD)
    found = fit_flight(tmp_path / "a.csv")
    assert found.lead == LEAD and found.delay.value == pytest.approx(LATE, abs=0.03)
    assert fit_flight(replace(read_stream_log(tmp_path / "a.csv")), lead=0.1).lead == 0.1


@pytest.mark.slow
def test_a_simulated_flight_is_held_to_its_plan():
    vehicle = Quadrotor.px4_sih()
    errors = [
        np.sqrt((simulate(vehicle, CascadeController(), replace(FILE, lead=lead)).error ** 2).sum(axis=1).mean())
        for lead in (0.0, LEAD, 0.4)
    ]
    assert errors[0] > errors[1] > errors[2]
