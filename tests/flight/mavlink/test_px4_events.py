"""PX4's arming checks come as events: hashed names between two summaries, for the modes that they concern."""

import json
import lzma
from pathlib import Path

import pytest
from px4_reports import POSCTL, event, event_id, report
from standin import mavlink

from minsnap.errors import FileError
from minsnap.flight.mavlink import vehicle_messages
from minsnap.flight.mavlink.vehicle_messages import BEGIN, END, TEXTS, ArmingReport, load_dialect, read_events


def heard(messages, **how):
    state = ArmingReport()
    for message in messages:
        state = state.told(message, **how)
    return state


def test_the_number_of_an_event_is_a_hash_of_its_name():
    assert event_id("a") == 0x010C292C and event_id("foobar") == 0x019CF968, "vectors of FNV-1a, 0xe40c292c, 0xbf9cf968"
    assert (BEGIN, END) == (event_id("commander_arming_check_summary"), event_id("commander_health_summary"))
    content = json.loads(Path(vehicle_messages.__file__).with_name("px4_events.json").read_text())
    events = content["components"]["1"]["event_groups"]["arming_check"]["events"]
    assert {event_id(event["name"]): event["message"] for event in events.values()} == TEXTS


def test_the_message_travels_with_the_checksum_that_its_definition_has():
    sent = event("check_modes_local_pos")
    crc = mavlink.x25crc(b"EVENT ")
    for name, kind in zip(sent.fieldnames, sent.fieldtypes, strict=True):
        crc.accumulate(f"{kind} {name} ".encode())
    crc.accumulate(bytes([40]))
    assert (crc.crc & 0xFF) ^ (crc.crc >> 8) == sent.crc_extra
    packed = sent.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1))
    (come,) = load_dialect().MAVLink(None).parse_buffer(packed)
    assert come.get_type() == "EVENT" and come.id == sent.id and list(come.arguments) == sent.arguments


def test_a_report_lists_the_checks_that_concern_offboard_and_replaces_the_one_before():
    first = heard(report(event("check_modes_local_pos"), event("check_modes_manual_control", POSCTL)))
    assert first.failed == ("no valid local position",)
    assert heard(report(event(0x01000001))).failed[0].startswith("event 0x01000001")
    unfinished = heard([*report(event("check_modes_attitude")), event("commander_arming_check_summary")])
    assert unfinished.failed == ("no valid attitude",)
    assert heard([*report(event("check_modes_attitude")), *report()]).failed == ()
    assert heard([event("check_modes_attitude")]).failed == ()


@pytest.mark.parametrize("pack", [lambda raw: raw, lzma.compress])
def test_the_texts_of_a_build_are_read_from_its_own_file(tmp_path, pack):
    number = event_id("check_of_this_build")
    said = {"events": {str(number & 0xFFFFFF): {"name": "check_of_this_build", "message": "Too warm"}}}
    build = {"version": 2, "components": {"1": {"namespace": "px4", "event_groups": {"arming_check": said}}}}
    (tmp_path / "all_events.json").write_bytes(pack(json.dumps(build).encode()))
    texts = read_events(tmp_path / "all_events.json")
    found = heard(report(event("check_of_this_build"), event("check_modes_attitude")), texts=texts)
    assert found.failed == ("Too warm", "no valid attitude")
    (tmp_path / "wrong.json").write_text("[]")
    with pytest.raises(FileError):
        read_events(tmp_path / "wrong.json")
