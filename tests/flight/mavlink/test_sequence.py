"""The machine of a flight's phases by itself: somebody who follows is never left without a setpoint."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from world import HERE, OFFBOARD, PX4, RATE, TABLE, World, fly, ready

from minsnap.errors import InputError, LinkError, TimingError
from minsnap.flight.mavlink.sequence import Conditions, Sequence
from minsnap.flight.mavlink.stream_options import STREAM, Phase, SafetyRules, StreamOptions
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS, VehicleState, get_autopilot

GIVE_UP = 30.0

EVENTS = st.lists(
    st.tuples(
        st.integers(1, 40),
        st.sampled_from(
            "offboard posctl silent heard nobeat away back trigger stop gap disarm arm".split(),
        ),
    ),
    max_size=25,
)


@given(EVENTS, st.booleans(), st.booleans())
def test_it_ends_only_when_nobody_follows_or_the_user_insists(events, on_entry, relative):
    world = World()
    here = (5.0, 5.0, -5.0) if relative else None
    sequence = Sequence(TABLE, PX4, StreamOptions(trigger="mode" if on_entry else bool), 0.0, here)
    held, led = None, False
    for steps, event in [*events, (200, "posctl"), (200, "offboard")]:
        world.happen(event)
        for _ in range(steps):
            at = world.conditions(sequence.setpoint)
            step = sequence.step(at)
            followed = PX4.follows(world.vehicle)
            led |= not followed or sequence.phase is Phase.FLYING
            if step is None:
                silent = at.now - world.vehicle.heard > (3.0 if world.stops else GIVE_UP)
                still = not world.vehicle.armed
                assert world.stops >= 2 or not (followed and led) or silent or still, "left a vehicle that follows"
                return
            assert step.setpoint is not None and all(map(math.isfinite, step.setpoint.position))
            if held is not None:
                assert step.setpoint == held, "a hold stays where it is"
            if sequence.phase is Phase.HOLDING:
                held = step.setpoint
                assert held.velocity == held.acceleration == (0, 0, 0) and held.yaw_rate == 0
            if step.index is not None:
                silence = at.now - max(world.vehicle.heard, 0.0)
                assert followed and silence <= 1.0 and not world.stops
                assert world.vehicle.armed or sequence.completed


@given(st.integers(1, 60))
def test_a_mode_left_for_less_than_a_moment_does_not_end_the_hold(steps):
    sequence, world = Sequence(TABLE, PX4, StreamOptions(trigger=bool), 0.0), World()
    for event, count in (("trigger", 1), ("offboard", 60), ("posctl", min(steps, round(STREAM.linger * RATE) - 1))):
        world.happen(event)
        for _ in range(count):
            assert sequence.step(world.conditions(sequence.setpoint)) is not None
    world.happen("offboard")
    for _ in range(100):
        assert sequence.step(world.conditions(sequence.setpoint)) is not None
    assert sequence.phase is Phase.HOLDING and "left OFFBOARD" in sequence.reason


def test_two_seconds_of_start_then_every_row_then_the_end():
    world, sequence = ready()
    before = [sequence.step(world.conditions(sequence.setpoint)) for _ in range(39)]
    assert {s.setpoint for s in before} == {TABLE.start} and sequence.phase is Phase.PRESTREAM
    flown = [sequence.step(world.conditions(sequence.setpoint)) for _ in range(len(TABLE))]
    assert [s.index for s in flown] == list(range(len(TABLE)))
    assert [s.setpoint for s in flown] == [TABLE[k] for k in range(len(TABLE))]
    end = fly(world, sequence, 50)
    assert sequence.completed and end.setpoint == TABLE[len(TABLE) - 1].held()


def test_it_waits_for_arming_and_for_a_second_after_it():
    """A flight used to begin with motors that stood still, and the vehicle took off into the middle of it."""
    world, sequence = ready()
    world.happen("disarm")
    fly(world, sequence, 100)
    assert sequence.phase is Phase.READY and not sequence.ready
    assert sequence.waits_for(world.vehicle) == "the vehicle is not armed"
    world.happen("arm")
    assert fly(world, sequence, 20).index is None and fly(world, sequence, 1).index == 0


def test_a_heartbeat_without_any_flag_says_nothing_of_arming():
    unsaid = replace(HERE, base_mode=0)
    assert not unsaid.armed and not unsaid.disarmed


@pytest.mark.parametrize(("slots", "completed"), [(2, False), (40, False), (len(TABLE) - 2, True)])
def test_a_vehicle_that_is_disarmed_ends_the_flight_for_good(slots, completed):
    """It used to fly on in words, to its end, whether the vehicle had landed there or lay where it fell."""
    world, sequence = ready()
    fly(world, sequence, 39 + slots)
    world.happen("disarm")
    assert fly(world, sequence, 1) is None and sequence.completed == completed
    assert sequence.reason == (None if completed else "the vehicle was disarmed")
    world.happen("arm")
    assert fly(world, sequence, 50) is None


def climb(sequence, vehicle, slots, begin=0, drift=0.0):
    """The commands that are sent to a vehicle a metre below its start, slot by slot."""
    x, y, z = TABLE.start.position
    sent = []
    for slot in range(begin, begin + slots):
        now = slot / RATE
        seen = replace(vehicle, heard=now, heartbeat=now, position=(x + drift, y, z + 1.0), positioned=now)
        step = sequence.step(Conditions(slot, now, seen, True))
        sent += [] if step is None else [command.command for command in step.commands]
    return sent


@pytest.mark.parametrize(("stack", "mode"), [("px4", OFFBOARD), ("ardupilot", 4)])
@pytest.mark.parametrize("taken", [{"custom_mode": 5}, {"base_mode": 1}])
def test_a_climb_that_a_pilot_has_ended_is_not_begun_anew(stack, mode, taken):
    """A vehicle that left the mode, or was disarmed, in its climb used to be taken back, armed and flown."""
    pilot = AUTOPILOTS[stack]
    sequence = Sequence(TABLE, pilot, StreamOptions(trigger="now", arm=True), 0.0)
    beside = VehicleState(1, 1, {"px4": 12, "ardupilot": 3}[stack], 1, 5)
    inside = replace(beside, custom_mode=mode)
    flown = replace(inside, base_mode=129)
    assert climb(sequence, beside, 90) == [176] * 3 and climb(sequence, inside, 60, 90) == [400] * 3
    assert climb(sequence, flown, 40, 150) == ([22] * 2 if pilot.takes_off else []) and sequence.phase is Phase.READY
    assert climb(sequence, replace(flown, **taken), 60, 190) == [] and sequence.phase is Phase.DONE
    assert sequence.reason in (f"the vehicle left {pilot.mode}", "the vehicle was disarmed")
    assert climb(sequence, flown, 60, 250) == []


def test_a_vehicle_that_is_at_its_start_too_late_is_not_said_to_be_disarmed():
    sequence = Sequence(TABLE, PX4, StreamOptions(trigger="now", arm=True, wait=2.0), 0.0)
    x, y, z = TABLE.start.position
    for slot in range(90):
        now, drift = slot / RATE, 0.4 if slot < 70 else 0.0
        seen = VehicleState(1, 1, 12, 129, OFFBOARD, now, now, (x + drift, y, z), (0.0, 0.0, 0.0), now)
        sequence.step(Conditions(slot, now, seen, True))
    assert "at the start in time: it came to it too late" in sequence.reason


@pytest.mark.parametrize("before", [1, 129])
def test_a_vehicle_that_was_armed_in_its_mode_lands_after_a_stop_in_its_climb(before):
    """PX4 keeps OFFBOARD after a landing: armed in it, and blown off its start, it was left to PX4's failsafe."""
    sequence = Sequence(TABLE, PX4, StreamOptions(trigger="now", arm=True, land=True), 0.0)
    inside = VehicleState(1, 1, 12, before, OFFBOARD)
    flown = replace(inside, base_mode=129)
    assert climb(sequence, inside, 50) == ([400] if before == 1 else [])
    assert climb(sequence, flown, 20, 50) == [] and sequence.phase is Phase.READY
    sent = climb(sequence, flown, 60, 70, drift=1.5)
    assert "more than the 1 m allowed" in sequence.reason
    if before == 1:
        assert set(sent) == {21} and sequence.phase is Phase.HOLDING and sequence.led
    else:
        assert sent == [] and sequence.phase is Phase.DONE and not sequence.led, "another program leads it"


@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_a_vehicle_that_left_its_start_when_all_begin_does_not_join_them_later(drift):
    """It used to be sent to where the flight was by then, in one step."""
    world, sequence = ready()
    world.happen("posctl")
    sent = [fly(world, sequence, 5)]
    world.happen("offboard")
    for slot in range(6, 100):
        at = replace(world.conditions(sequence.setpoint), triggered=slot >= 60, begin=60)
        x, y, z = TABLE.start.position
        gone = replace(at.vehicle, position=(x + drift, y, z)) if 55 <= slot < 65 else at.vehicle
        sent.append(sequence.step(replace(at, vehicle=gone)))
    if drift:
        assert {step.index for step in sent} == {None} and sequence.phase is Phase.HOLDING
        assert sequence.reason == "it was no longer ready at its start when all began"
    else:
        assert [step.index for step in sent[55:]] == list(range(40))


def test_a_missed_slot_is_left_out_not_made_up_for():
    world, sequence = ready()
    fly(world, sequence, 50)
    world.slot += 5
    assert fly(world, sequence, 1).index == 16


@pytest.mark.parametrize("bad", [{"max_start_distance": 0.0}, {"abort_distance": -1.0}, {"link_timeout": math.nan}])
def test_bounds_are_positive(bad):
    with pytest.raises(InputError, match="a safety bound must be positive"):
        SafetyRules(**bad)


def test_an_unknown_autopilot_is_generic_and_an_unknown_name_an_error():
    assert get_autopilot("auto", replace(HERE, autopilot=0)).name == "generic"
    assert get_autopilot("auto", replace(HERE, autopilot=3)).mode == "GUIDED"
    with pytest.raises(LinkError, match="no autopilot is called 'betaflight'"):
        get_autopilot("betaflight", HERE)


@pytest.mark.parametrize(("stack", "rate"), [("px4", 1.9), ("auto", 1.0), ("ardupilot", 0.5)])
def test_rates_that_would_lose_the_mode(stack, rate):
    with pytest.raises(TimingError, match="is too slow"):
        StreamOptions(autopilot=stack).check_rate(rate)
    StreamOptions(autopilot="ardupilot").check_rate(1.0)
    with pytest.raises(TimingError, match="at least 2 s"):
        StreamOptions(prestream=1.0)
