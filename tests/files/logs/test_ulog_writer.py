"""Logs written as ULog are read back, by the reader that PX4's own logs go through."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.files.autopilot_logs import read_ulog, write_ulog
from minsnap.files.flight_log import FlightLog
from minsnap.flight import CascadeController, simulate, simulated_log
from minsnap.vehicle import Quadrotor


def test_a_log_reads_back_as_it_was_written(tmp_path):
    vehicle, path = Quadrotor.px4_sih(), minsnap.plan([(0, 0, 1), (3, 1, 2)], total_time=4.0, yaw=0.4)
    log = simulated_log(vehicle, simulate(vehicle, CascadeController(), path.sample(20.0)), path.sample(20.0))
    write_ulog(log, tmp_path / "flown.ulg")
    back = read_ulog(tmp_path / "flown.ulg", inertial=True)
    for there, here in ((back.reference, log.reference), (back.flight, log.flight)):
        assert there.t == pytest.approx(here.t, abs=1e-6)
        assert there.position == pytest.approx(here.position, abs=1e-6)
        assert there.velocity == pytest.approx(here.velocity, abs=1e-6)
    assert back.reference.acceleration == pytest.approx(log.reference.acceleration, abs=1e-6)
    assert back.reference.yaw == pytest.approx(log.reference.yaw, abs=1e-6)
    turned = np.abs((back.inertial.quaternion * log.inertial.quaternion).sum(axis=1))
    assert turned == pytest.approx(1.0, abs=1e-6)
    assert back.inertial.specific_force == pytest.approx(log.inertial.specific_force, abs=1e-5)
    assert back.inertial.throttle == pytest.approx(log.inertial.throttle, abs=1e-6)


def test_a_log_of_nothing_is_refused(tmp_path):
    with pytest.raises(InputError, match="neither setpoints nor positions"):
        write_ulog(FlightLog(None, None, 0.0), tmp_path / "none.ulg")
