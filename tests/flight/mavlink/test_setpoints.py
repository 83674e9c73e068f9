"""What a setpoint says on the wire, and how rows become setpoints."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from flying import excursion
from pymavlink.dialects.v20 import common

import minsnap
from minsnap.cli import main
from minsnap.errors import InputError, LinkError, TimingError
from minsnap.files.consistency import check_samples
from minsnap.files.frames import map_samples
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.setpoints import Setpoint, setpoint_message, tabulate, type_mask, vehicle_frame
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.flight.mavlink.vehicle_messages import VehicleState
from minsnap.trajectory.samples import Samples

P, V, A, Y, R = "position", "velocity", "acceleration", "yaw", "yaw_rate"

MASKS = [
    ((P, V, A, Y, R), 0),
    ((P, V, A, Y), 2048),
    ((P, V, A), 3072),
    ((P, V, Y), 2496),
    ((P, Y), 2552),
    ((P,), 3576),
]


@pytest.mark.parametrize(("fields", "mask"), MASKS)
def test_masks_are_those_of_the_manuals(fields, mask):
    assert type_mask(fields) == mask


def test_masks_are_made_of_mavlinks_own_bits():
    axes = {P: "XYZ", V: ("VX", "VY", "VZ"), A: ("AX", "AY", "AZ"), Y: ("YAW",), R: ("YAW_RATE",)}
    for name, bits in axes.items():
        expected = sum(getattr(common, f"POSITION_TARGET_TYPEMASK_{bit}_IGNORE") for bit in bits)
        assert type_mask({P, V, A, Y, R} - {name}) == expected, name


def test_a_message_has_every_field_where_it_belongs():
    setpoint = Setpoint((1, 2, 3), (4, 5, 6), (7, 8, 9), 0.5, 0.25)
    message = setpoint_message(setpoint, 2048, VehicleState(7, 1), 2**32 + 5)
    codec = common.MAVLink(None)
    back = codec.parse_buffer(message.pack(codec))[0]
    names = "x y z vx vy vz afx afy afz yaw yaw_rate".split()
    assert [getattr(back, name) for name in names] == [1, 2, 3, 4, 5, 6, 7, 8, 9, 0.5, 0.25]
    assert (back.time_boot_ms, back.target_system, back.target_component) == (5, 7, 1)
    assert (back.type_mask, back.coordinate_frame, back.get_type()) == (2048, 1, "SET_POSITION_TARGET_LOCAL_NED")


def test_rows_are_the_samples_in_north_east_down():
    samples = excursion()
    table = tabulate(samples)
    assert table.rate == 20.0 and len(table) == len(samples) and table.mask == 0
    for i in (0, 57, 200):
        x, y, z = samples.position[i]
        vx, vy, vz = samples.velocity[i]
        assert table[i].position == (y, x, -z) and table[i].velocity == (vy, vx, -vz)
        assert table[i].yaw == math.pi / 2 - samples.yaw[i] and table[i].yaw_rate == -samples.yaw_rate[i]


def test_a_rooms_rows_are_forward_right_down():
    samples = excursion()
    setpoint = tabulate(samples, frame=vehicle_frame("optitrack"))[40]
    x, y, z = samples.position[40]
    assert setpoint.position == (x, -y, -z) and setpoint.yaw == -samples.yaw[40]
    assert [vehicle_frame(name) for name in ("enu", "ned", "flu", "frd", "optitrack")] == ["ned"] * 2 + ["frd"] * 3


def test_headings_are_wrapped_for_the_message_and_otherwise_untouched():
    t = np.arange(200) / 20
    spin = Samples(t, np.zeros((200, 3)), np.zeros((200, 3)), yaw=2.0 * t, yaw_rate=np.full(200, 2.0))
    headings = np.array([tabulate(spin)[i].yaw for i in range(200)])
    assert np.abs(headings).max() <= math.pi
    np.testing.assert_allclose(np.exp(1j * headings), np.exp(1j * (math.pi / 2 - 2 * t)), atol=1e-12)


def test_fields_that_are_not_wanted_are_masked_and_zero():
    table = tabulate(excursion(), fields=["yaw", "position"])
    assert table.fields == (P, Y) and table.mask == 2552 and table.missing == ()
    assert table[50].velocity == (0, 0, 0) and table[50].yaw != 0


def test_fields_that_are_not_there_are_told():
    samples = excursion()
    table = tabulate(Samples(samples.t, samples.position, samples.velocity))
    assert table.fields == (P, V) and table.missing == (A, Y, R)
    assert tabulate(Samples(samples.t, samples.position, None, samples.acceleration)).fields == (P,)


@pytest.mark.parametrize("rate", [50.0, 10.0, 33.0])
def test_another_rate_goes_through_the_derivatives(rate):
    """The quintic through samples of a smooth path is the path, to what 1/20 s leaves of its sixth derivative."""
    table, fine = tabulate(excursion(), rate=rate), tabulate(excursion(rate=rate))
    steps = len(excursion(rate=rate))
    np.testing.assert_allclose(table.rows[:steps], fine.rows, atol=2e-5)
    assert check_samples(Samples(np.arange(len(table)) / rate, table.rows[:, :3], table.rows[:, 3:6])).ok


def test_positions_alone_are_interpolated_too():
    samples = excursion()
    rows = tabulate(Samples(samples.t, samples.position), rate=40.0).rows
    np.testing.assert_allclose(rows[1:-1:2, :3], (rows[:-2:2, :3] + rows[2::2, :3]) / 2, atol=1e-12)


def test_laps_share_the_row_where_they_meet():
    table = tabulate(excursion(4.0), laps=3)
    assert len(table) == 3 * 80 + 1
    assert [table[i] for i in (0, 80, 160)] == [table[0]] * 3
    assert table[81] == table[1] and table[240] == table[10_000]
    assert table[240].position == pytest.approx(table[0].position)


def test_the_start_stands_still():
    assert tabulate(excursion()).start == Setpoint((0.0, 0.0, -1.5), yaw=math.pi / 2)


BAD = [
    ({"fields": ["position", "jerk"]}, InputError, "'jerk'"),
    ({"fields": ["velocity"]}, InputError, "position must be among"),
    ({"fields": ["position", "acceleration"]}, InputError, "without velocity"),
    ({"rate": 0.0}, TimingError, "rate is 0.0"),
    ({"rate": math.nan}, TimingError, "rate is nan"),
    ({"laps": 0}, InputError, "laps is 0"),
]


@pytest.mark.parametrize(("options", "error", "said"), BAD)
def test_bad_requests(options, error, said):
    with pytest.raises(error, match=said):
        tabulate(excursion(), **options)


def test_laps_of_a_path_that_does_not_close():
    half = excursion()
    open_path = Samples(half.t[:100], half.position[:100], half.velocity[:100])
    with pytest.raises(InputError, match="m from the start: only a path that closes"):
        tabulate(open_path, laps=2)


@pytest.mark.parametrize(("turned", "flown"), [(0.0, True), (2 * math.pi, True), (-4 * math.pi, True), (0.2, False)])
@pytest.mark.parametrize("frame", ["ned", "frd"])
def test_laps_close_in_their_heading_too(turned, flown, frame):
    """A heading that ends elsewhere used to be commanded as a step from one setpoint to the next where laps meet."""
    lap = excursion()
    turning = replace(lap, yaw=1.0 + turned * lap.t / lap.t[-1], yaw_rate=None)
    if flown:
        assert len(tabulate(turning, laps=2, frame=frame)) == 2 * (len(lap) - 1) + 1
        return
    with pytest.raises(InputError, match="the heading at the end is 0.2 rad from that at the start"):
        tabulate(turning, laps=2, frame=frame)
    assert tabulate(turning, laps=2, fields=["position", "velocity"]).laps == 2


@pytest.mark.parametrize(("frame", "vehicles"), [("enu", "ned"), ("ned", "ned"), ("flu", "frd"), ("optitrack", "frd")])
def test_a_file_that_says_its_frame_is_flown_in_it(tmp_path, frame, vehicles):
    samples = minsnap.circle(radius=1.0, period=6.0).sample(20.0)
    minsnap.write_csv(samples, tmp_path / "a.csv", frame=frame)
    table = prepare(tmp_path / "a.csv", StreamOptions())
    assert table.frame == vehicles
    np.testing.assert_array_equal(table.rows[:, :3], map_samples(samples, "enu", vehicles).position)


@pytest.mark.parametrize("command", ["stream", "preflight"])
def test_commands_take_a_file_that_says_its_frame(tmp_path, monkeypatch, capsys, command):
    def reached(*_, **__):
        raise LinkError("the file was read")

    monkeypatch.setattr("minsnap.flight.mavlink.link.open_link", reached)
    minsnap.write_csv(minsnap.circle(radius=1.0, period=6.0), tmp_path / "a.csv", frame="ned")
    with pytest.raises(SystemExit):
        main([command, str(tmp_path / "a.csv"), "--connect", "udpin:127.0.0.1:14540"])
    assert capsys.readouterr().err == "minsnap: the file was read [link]\n"


def test_a_path_that_begins_or_ends_at_speed_is_told_of():
    corners = [(0, 0, 1), (4, 0, 1), (4, 4, 1), (0, 0, 1)]
    assert prepare(minsnap.plan(corners, total_time=9.0), StreamOptions()).note == ""
    lap = prepare(minsnap.plan(corners, total_time=9.0, closed=True), StreamOptions()).note
    assert re.fullmatch(r"the path begins at (\S+) m/s and ends at \1 m/s, where the vehicle is held at rest", lap)
    goes_on = minsnap.plan(corners, total_time=9.0, end={"velocity": (-1, -1, 0)})
    assert prepare(goes_on, StreamOptions()).note == "the path ends at 1.4 m/s, where the vehicle is held at rest"


def test_a_yaw_that_may_be_in_degrees_is_said_before_the_flight():
    """Only a plan said so, and a file of setpoints flew."""
    path = minsnap.plan([(0, 0, 1), (4, 0, 1)], total_time=9.0).sample(20.0)
    turned = replace(path, yaw=20.0 * path.t, yaw_rate=np.full_like(path.t, 20.0))
    assert prepare(turned, StreamOptions()).note == "yaw goes to 180 rad, 29 turns: if it is degrees, give radians"
