"""The log of a stream, read back: what was sent and what was heard, in world axes, also when its end was cut off."""

import numpy as np
import pytest
from clocks import SharedClock
from flying import PATH, START, Flight
from standin import POSCTL, PointMass, StandIn

from minsnap.errors import FileError
from minsnap.files.flights import is_stream_log, load_flight, load_reference, read_stream_log
from minsnap.flight.tracking.log_comparison import compare_in_log


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path, clock = tmp_path_factory.mktemp("log") / "flight.csv", SharedClock()
    with StandIn(clock=clock, body=PointMass(START)) as vehicle:
        with Flight(vehicle, PATH, clock, log=path) as flight:
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: "holding the end" in flight.events)
            vehicle.enter(POSCTL)
            report = flight.result()
    return path, report


@pytest.mark.slow
def test_the_flight_is_found_by_its_setpoints_and_has_the_error_of_the_report(log):
    path, report = log
    read = read_stream_log(path)
    (one,) = compare_in_log(PATH, read.reference, read.flight)
    assert one.place.mismatch < 0.02 and one.place.rate == pytest.approx(1.0, abs=5e-3)
    assert one.comparison.rmse_3d == pytest.approx(report.rmse, abs=0.05)
    assert np.abs(load_flight(path).position - read.flight.position).max() == 0.0
    assert len(load_reference(path)) == len(read.reference)


def test_a_line_that_was_cut_off_is_left_out(log, tmp_path):
    path, _ = log
    text = path.read_text()
    (tmp_path / "cut.csv").write_text(text[:-9])
    assert len(read_stream_log(tmp_path / "cut.csv").flight) >= len(read_stream_log(path).flight) - 1


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t,x,y,z\n0,0,0,0\n", "is no log of a stream"),
        ("time,kind,index\n0.1,setpoint,\n", "does not say in which frame"),
    ],
)
def test_other_files_are_refused(tmp_path, text, says):
    path = tmp_path / "other.csv"
    path.write_text(text)
    assert is_stream_log(path) == text.startswith("time")
    with pytest.raises(FileError, match=says):
        read_stream_log(path)
