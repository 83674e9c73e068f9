"""Logs of a stand-in autopilot come over MAVLink whole, with what was lost on the way asked for again."""

import os

import pytest

from minsnap.errors import LinkError
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.parameters import DOWNLOAD, download_log, list_logs


@pytest.fixture
def link(vehicle, clock):
    link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock)
    link.wait_for_vehicle(5.0)
    yield link
    link.close()


def test_the_newest_log_arrives_whole_though_pieces_are_lost(vehicle, link, clock, tmp_path):
    vehicle.logs = [b"older", os.urandom(DOWNLOAD.request + 5 * DOWNLOAD.piece + 17)]
    vehicle.lost_pieces = {0, 3 * DOWNLOAD.piece, DOWNLOAD.request, DOWNLOAD.request + 5 * DOWNLOAD.piece}
    shares = []
    download_log(link, clock, tmp_path / "flight.ulg", shares.append)
    assert (tmp_path / "flight.ulg").read_bytes() == vehicle.logs[1]
    assert shares == sorted(shares) and shares[-1] == 1.0 and not vehicle.lost_pieces


def test_a_log_that_was_there_before_the_flight_is_not_taken_for_it(vehicle, link, clock, tmp_path):
    """With its logging off, a vehicle was tuned by a flight of another day."""
    vehicle.logs = [b"of another day", b"of yesterday"]
    before = list_logs(link, clock)
    with pytest.raises(LinkError, match="has no log of this flight"):
        download_log(link, clock, tmp_path / "none.ulg", before=before)
    vehicle.logs.insert(0, b"of today")
    download_log(link, clock, tmp_path / "flight.ulg", before=before)
    assert (tmp_path / "flight.ulg").read_bytes() == b"of today"


def test_a_vehicle_without_logs_and_one_that_stops_sending_are_told(vehicle, link, clock, tmp_path):
    with pytest.raises(LinkError, match="does not tell of its logs"):
        download_log(link, clock, tmp_path / "none.ulg")
    vehicle.logs = [bytes(DOWNLOAD.piece * 4)]
    vehicle._send_log = lambda asked: None
    with pytest.raises(LinkError, match="stopped sending its log after 0 of 360 bytes"):
        download_log(link, clock, tmp_path / "none.ulg")
    assert not (tmp_path / "none.ulg").exists()
