"""Logs of a stand-in autopilot come over MAVLink whole, with what was lost on the way asked for again."""

import os

import pytest

from minsnap.errors import LinkError
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.log_download import DOWNLOAD, download_log, fresh_logs, list_logs


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
        fresh_logs(link, clock, before)
    vehicle.logs.insert(0, b"of today")
    (log,) = fresh_logs(link, clock, before)
    download_log(link, clock, tmp_path / "flight.ulg", log=log)
    assert (tmp_path / "flight.ulg").read_bytes() == b"of today"


def test_a_vehicle_without_logs_and_one_that_stops_sending_are_told(vehicle, link, clock, tmp_path):
    with pytest.raises(LinkError, match="does not tell of its logs"):
        download_log(link, clock, tmp_path / "none.ulg")
    vehicle.logs = [bytes(DOWNLOAD.piece * 4)]
    vehicle._send_log = lambda asked: None
    with pytest.raises(LinkError, match="stopped sending its log after 0 of 360 bytes"):
        download_log(link, clock, tmp_path / "none.ulg")
    assert not (tmp_path / "none.ulg").exists()


@pytest.mark.parametrize("folder", ["/fs/microsd/log/2026-11-29", "/log/sess003", "/log"])
def test_a_log_comes_by_file_transfer_where_the_vehicle_has_it(vehicle, link, clock, tmp_path, folder):
    log = os.urandom(9 * 239 + 17)
    vehicle.logs, vehicle._send_log = [log], lambda asked: pytest.fail("the slow way")
    vehicle.files = {f"{folder}/12_00_0{k}.ulg": bytes(100 + k) for k in range(5)} | {f"{folder}/13_00_00.ulg": log}
    vehicle.lost_parts = {0, 3 * 239, 9 * 239}
    shares = []
    download_log(link, clock, tmp_path / "flight.ulg", shares.append)
    assert (tmp_path / "flight.ulg").read_bytes() == log
    assert shares == sorted(shares) and shares[-1] == 1.0 and not vehicle.lost_parts


def test_messages_of_logs_take_over_where_files_are_others_or_stop(vehicle, link, clock, tmp_path):
    vehicle.logs, vehicle.files = [os.urandom(500)], {"/log/12_00_00.ulg": bytes(400)}
    download_log(link, clock, tmp_path / "other.ulg")
    assert (tmp_path / "other.ulg").read_bytes() == vehicle.logs[0]
    vehicle.files = {"/log/12_00_00.ulg": vehicle.logs[0]}
    vehicle.lost_parts = type("Never", (set,), {"__contains__": lambda *_: True, "discard": lambda *_: None})()
    download_log(link, clock, tmp_path / "stopped.ulg")
    assert (tmp_path / "stopped.ulg").read_bytes() == vehicle.logs[0]


@pytest.mark.parametrize("names", [("00000001.BIN", "00000002.BIN"), ("12_00_00.ulg", "13_00_00.ulg")])
def test_of_two_logs_of_one_size_the_right_one_comes(vehicle, link, clock, tmp_path, names):
    """ArduPilot writes whole blocks: a flight was learned from the log of the one before."""
    vehicle.logs = [b"before", *(os.urandom(700) for _ in range(2))]
    vehicle.files = {f"/log/{name}": log for name, log in zip(names, vehicle.logs[1:], strict=True)}
    for log in list_logs(link, clock):
        download_log(link, clock, tmp_path / "flight.bin", log=log)
        assert (tmp_path / "flight.bin").read_bytes() == vehicle.logs[log.number]


def test_logs_of_a_flight_that_was_split_come_one_after_another(vehicle, link, clock):
    vehicle.logs = [b"older"]
    before = list_logs(link, clock)
    vehicle.logs += [b"the flight itself", b"on the ground"]
    assert [entry.size for entry in fresh_logs(link, clock, before)] == [13, 17]


def test_a_vehicle_that_tells_of_no_log_by_messages_is_asked_for_its_folders(vehicle, link, clock, tmp_path):
    """PX4 in simulation sent no LOG_ENTRY, and its flights could not be learned from."""
    vehicle.files = {"/log/2026-11-28/09_00_00.ulg": b"of another day", "/log/2026-11-28/notes.txt": b"no log"}
    before = list_logs(link, clock)
    assert [log.path for log in before] == ["/log/2026-11-28/09_00_00.ulg"]
    with pytest.raises(LinkError, match="has no log of this flight"):
        fresh_logs(link, clock, before)
    parts = {"/log/2026-11-29/10_00_00.ulg": os.urandom(900), "/log/2026-11-29/10_05_00.ulg": os.urandom(500)}
    vehicle.files |= parts
    fresh = fresh_logs(link, clock, before)
    assert [log.path for log in fresh] == sorted(parts, reverse=True)
    for log in fresh:
        download_log(link, clock, tmp_path / "flight.ulg", log=log)
        assert (tmp_path / "flight.ulg").read_bytes() == parts[log.path]
    vehicle.lost_parts = type("Never", (set,), {"__contains__": lambda *_: True, "discard": lambda *_: None})()
    with pytest.raises(LinkError, match="stopped sending its log /log/2026-11-29/10_05_00.ulg"):
        download_log(link, clock, tmp_path / "stopped.ulg")
    assert not (tmp_path / "stopped.ulg").exists()
