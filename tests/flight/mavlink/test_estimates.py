"""The estimate of each autopilot's versions, from what was recorded and what their sources say."""

import csv
from pathlib import Path

import pytest
from standin import mavlink

from minsnap.flight.mavlink.estimates import estimate_faults
from minsnap.flight.mavlink.vehicle_messages import load_dialect

with open(Path(__file__).parents[2] / "recorded" / "estimates.csv", newline="") as file:
    REPORTS = list(csv.DictReader(file))


def status(flags, ratios=(0.1, 0.1, 0.1, 0.1)):
    velocity, position, height, heading = ratios
    return mavlink.MAVLink_estimator_status_message(
        0, flags, velocity, position, height, heading, 0.0, float("nan"), 0.0, 0.0
    )


def ekf_report(flags, variance=0.01):
    """As it arrives: over the wire, read by the dialect that was taught it."""
    sent = mavlink.MAVLink_ekf_status_report_message(flags, *(variance,) * 4, 0.0, 0.0)
    (come,) = load_dialect().MAVLink(None).parse_buffer(sent.pack(mavlink.MAVLink(None, srcSystem=1)))
    assert come.get_type() == "EKF_STATUS_REPORT" and come.flags == flags
    return come


@pytest.mark.parametrize("row", REPORTS, ids=lambda row: f"{row['autopilot']}-{row['version']}-{row['where']}")
def test_a_version_that_is_well_flies_and_one_that_is_not_is_told_from_it(row):
    make = {"ESTIMATOR_STATUS": status, "EKF_STATUS_REPORT": ekf_report}[row["message"]]
    faults = estimate_faults([make(int(row["flags"]))], row["landed"] == "yes")
    assert "; ".join(faults) == row["faults"]


def test_constant_position_is_a_fault_of_a_vehicle_that_flies():
    assert estimate_faults([status(1023)], landed=True) == []
    assert estimate_faults([status(1023)], landed=False) == ["its position is assumed constant"]
    assert "no horizontal position" in estimate_faults([status(1023 & ~24)], landed=True)


def test_measurements_that_are_rejected_all_the_time_are_a_fault_and_one_gust_is_none():
    shaken = status(831, (0.2, 1.7, 0.1, 0.1))
    assert estimate_faults([shaken, shaken], True) == ["measurements of its position do not fit (test ratio 1.7)"]
    assert estimate_faults([shaken, status(831)], True) == []
    assert estimate_faults([status(831, (0.2, float("nan"), 0.1, 0.1))], True) == []
    assert (
        len(estimate_faults([ekf_report(831, 0.9)], True)) == 4 and estimate_faults([ekf_report(831, 0.7)], True) == []
    )
