"""The machine of a flight's phases by itself: somebody who follows is never left without a setpoint."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from world import HERE, PX4, RATE, TABLE, World, fly, ready

from minsnap.errors import InputError, LinkError, TimingError
from minsnap.flight.mavlink.sequence import Sequence
from minsnap.flight.mavlink.stream_options import STREAM, Phase, SafetyRules, StreamOptions
from minsnap.flight.mavlink.vehicle_messages import get_autopilot

GIVE_UP = 30.0

EVENTS = st.lists(
    st.tuples(
        st.integers(1, 40),
        st.sampled_from(["offboard", "posctl", "silent", "heard", "nobeat", "away", "back", "trigger", "stop", "gap"]),
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
                assert world.stops >= 2 or not (followed and led) or silent, "left a vehicle that follows"
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
