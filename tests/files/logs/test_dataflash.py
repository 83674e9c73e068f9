"""Dataflash logs written here by ArduPilot's format, message by message, and read through pymavlink."""

import struct

import numpy as np
import pytest

from minsnap.errors import FileError
from minsnap.files.autopilot_logs import read_dataflash
from minsnap.files.flights import load_flight, load_reference
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.trajectory.samples import Samples

FMT = (0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
PSC = {
    axis: (k, f"PSC{axis}", "Qffffffff", f"TimeUS,TP{axis},P{axis},DV{axis},TV{axis},V{axis},DA{axis},TA{axis},A{axis}")
    for k, axis in ((0x90, "N"), (0x91, "E"), (0x92, "D"))
}
ATT = (0x93, "ATT", "Qff", "TimeUS,DesYaw,Yaw")
GUIP = (0x95, "GUIP", "QBfffffffff", "TimeUS,Type,pX,pY,pZ,vX,vY,vZ,aX,aY,aZ")
XKF = (0x94, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD")
NKF = (0x96, "NKF1", *XKF[2:])
OLD = (0x97, "NKF1", "Qffffff", "TimeUS,VN,VE,VD,PN,PE,PD")
SIZES = {"Q": 8, "f": 4, "B": 1, "n": 4, "N": 16, "Z": 64}


def record(kind, *values):
    codes = {"Q": "Q", "f": "f", "B": "B", "n": "4s", "N": "16s", "Z": "64s"}
    packed = struct.pack("<" + "".join(codes[c] for c in kind[2]), *values)
    return bytes([0xA3, 0x95, kind[0]]) + packed


def format_of(kind):
    length = 3 + sum(SIZES[c] for c in kind[2])
    return record(FMT, kind[0], length, kind[1].encode(), kind[2].encode(), kind[3].encode())


def controlled(count=200):
    """North 0.5 t wanted, 0.1 m behind; east sin t wanted and flown; 1.5 m up; turning through north."""
    out = b"".join(format_of(kind) for kind in (FMT, *PSC.values(), ATT))
    for k in range(count):
        t, stamp = k * 0.05, 30_000_000 + 50_000 * k
        north = (0.5 * t, 0.5 * t - 0.1, 0, 0.5, 0.5, 0, 0, 0)
        east = (np.sin(t), np.sin(t), 0, np.cos(t), np.cos(t), 0, -np.sin(t), -np.sin(t))
        down = (-1.5, -1.5, 0, 0, 0, 0, 0, 0)
        for lag, (axis, values) in enumerate(zip("NED", (north, east, down), strict=True)):
            out += record(PSC[axis], stamp + 4 * lag, *values)
        out += record(ATT, stamp, (350 + 5 * t) % 360, (349 + 5 * t) % 360)
    return out


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "flight.bin"
    path.write_bytes(controlled())
    return path


def test_targets_and_positions_of_the_controller(log):
    read = read_dataflash(log)
    assert read.damage is None and read.start == 30.0
    t = read.flight.t
    np.testing.assert_allclose(read.flight.position, np.stack([np.sin(t), 0.5 * t - 0.1, 1.5 + 0 * t], 1), atol=1e-5)
    np.testing.assert_allclose(read.reference.position[:, 1], 0.5 * t, atol=1e-5)
    np.testing.assert_allclose(read.reference.velocity[:, 0], np.cos(t), atol=1e-5)
    np.testing.assert_allclose(read.reference.acceleration[:, 0], -np.sin(t), atol=1e-5)
    np.testing.assert_allclose(np.diff(read.flight.yaw), -np.radians(0.25), atol=1e-5)
    np.testing.assert_allclose(read.flight.yaw - read.reference.yaw, np.radians(1), atol=1e-5)


def sent_in_laps(down, target_lag=0.6, laps=3):
    """Three laps of a circle of 2 m, logged as sent (GUIP), with targets that the autopilot keeps half a metre behind.

    ``down`` is the sign of the heights that were sent: 1 from 4.7 on.
    """
    out = b"".join(format_of(kind) for kind in (FMT, *PSC.values(), GUIP))
    for k in range(int(20 * (3 + 6 * laps + 3))):
        t, stamp = k * 0.05, 30_000_000 + 50_000 * k
        (north, east), (lag_north, lag_east), (flown_north, flown_east) = (
            lap(t - 3.0 - late, laps) for late in (0.0, target_lag, target_lag + 0.1)
        )
        rows = ((lag_north, flown_north), (lag_east, flown_east), (-1.5, -1.5))
        for axis, (target, flown) in zip("NED", rows, strict=True):
            out += record(PSC[axis], stamp, target, flown, *(0.0,) * 6)
        out += record(GUIP, stamp + 2, 3, north, east, -1.5 * down, *(0.0,) * 6)
        out += record(GUIP, stamp + 3, 2, 9.0, 9.0, 9.0, *(0.0,) * 6)
    return out


def lap(t, laps):
    """Return north and east at an instant of laps of 6 s, at rest before and after."""
    angle = 2.0 * np.pi * np.clip(t / 6.0, 0.0, laps)
    return 2.0 * np.cos(angle), 2.0 * np.sin(angle)


@pytest.mark.parametrize("down", [1, -1])
def test_a_flight_is_judged_by_what_was_sent(tmp_path, down):
    """By the autopilot's own targets, one flight of three laps was three that were not flown to their end."""
    (tmp_path / "flight.bin").write_bytes(sent_in_laps(down))
    read = read_dataflash(tmp_path / "flight.bin")
    t = np.arange(0.0, 18.01, 0.05)
    file = Samples(t, np.array([(*lap(each, 3)[::-1], 1.5) for each in t]))
    np.testing.assert_allclose(read.reference.position[:, 2], 1.5, atol=1e-6)
    (flight,) = compare_in_log(file, read.reference, read.flight)
    assert flight.place.end is None and abs(flight.place.start - 3.0) < 0.03
    assert flight.comparison.rmse_3d == pytest.approx(2.0 * 2.0 * np.sin(0.5 * 0.7 * 2.0 * np.pi / 6.0), rel=0.05)


@pytest.mark.parametrize(("row", "bit"), [(50, 40), (50, 24)])
def test_a_time_with_a_wrong_bit_costs_its_row_alone(log, row, bit):
    """All rows after it used to be dropped without a word."""
    sound, raw = read_dataflash(log), bytearray(log.read_bytes())
    start = b"\xa3\x95\x90"
    place = [k for k in range(len(raw)) if raw.startswith(start, k)][row] + len(start)
    (stamp,) = struct.unpack_from("<Q", raw, place)
    struct.pack_into("<Q", raw, place, stamp ^ 1 << bit)
    log.write_bytes(raw)
    rest = np.delete(np.arange(200), row)
    read = read_dataflash(log)
    np.testing.assert_allclose(read.flight.position, sound.flight.position[rest], atol=1e-12)
    assert sound.damage is None and "goes back: 1 of its rows are left out" in read.damage


def test_flights_are_loaded_by_their_ending(log):
    assert len(load_flight(log)) == len(load_reference(log)) == 200


@pytest.mark.parametrize("kind", [XKF, NKF, OLD], ids=["EKF3", "EKF2", "EKF2 of old logs"])
def test_without_a_controller_there_is_the_estimate_of_the_first_core(tmp_path, kind):
    out = format_of(FMT) + format_of(kind)
    cores = (0, 1) if kind is not OLD else (None,)
    for k in range(50):
        for core in cores:
            numbered = () if core is None else (core,)
            out += record(kind, 1_000_000 + 100_000 * k, *numbered, 1, 2, 3, 10 * (core or 0) + k, 0, -1)
    path = tmp_path / "flight.bin"
    path.write_bytes(out)
    read = read_dataflash(path)
    assert read.reference is None
    assert read.flight.position[:, 1].tolist() == list(range(50))
    assert read.flight.velocity[0].tolist() == [2, 1, -3]


def test_a_damaged_log_gives_what_there_is_and_says_so(tmp_path, log, capfd):
    raw = bytearray(log.read_bytes())
    middle = len(raw) // 2
    raw[middle : middle + 400] = bytes(400)
    path = tmp_path / "broken.bin"
    path.write_bytes(raw)
    read = read_dataflash(path)
    assert 150 < len(read.flight) < 200
    assert "is damaged; " in read.damage and f"{len(read.flight)} positions" in read.damage
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("length", [0, 1, 2])
def test_a_message_shorter_than_its_header_is_refused(tmp_path, length):
    """One of no length would be read again and again, until the memory is full."""
    path = tmp_path / "flight.bin"
    named = record(FMT, 0x95, length, b"NONE", b"", b"")
    path.write_bytes(format_of(FMT) + named + b"\xa3\x95\x95" * 20)
    with pytest.raises(FileError, match=f"type 149 have a length of {length} bytes"):
        read_dataflash(path)


def test_a_log_cut_short_is_read_to_its_end(tmp_path, log):
    path = tmp_path / "cut.bin"
    path.write_bytes(log.read_bytes()[:-1000])
    assert 150 < len(read_dataflash(path).flight) < 200


@pytest.mark.parametrize("content", [b"", b"t,x,y,z\n" * 100, bytes(600)])
def test_what_is_no_log(tmp_path, content):
    path = tmp_path / "flight.bin"
    path.write_bytes(content)
    with pytest.raises(FileError):
        read_dataflash(path)


def test_a_log_without_positions(tmp_path):
    path = tmp_path / "flight.bin"
    path.write_bytes(format_of(FMT) + format_of(ATT) + record(ATT, 1, 0, 0))
    with pytest.raises(FileError, match="holds no positions"):
        read_dataflash(path)
