"""What keeps a flight from being disturbed is asked for, said, and undone."""

import gc
import os

import pytest

from minsnap.flight.mavlink import sender as module
from minsnap.flight.mavlink.sender import SENDING, undisturbed


def test_everything_is_as_before_at_the_end():
    before = os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    with undisturbed(True) as said:
        assert not gc.isenabled()
        first = os.sched_getscheduler(0) == os.SCHED_FIFO
        assert ("has real-time priority" in said) == first
        assert not first or os.sched_getparam(0).sched_priority == SENDING.priority
    assert gc.isenabled() and before == (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)


def test_a_flight_among_others_leaves_collector_and_memory_to_whoever_flies_all():
    with undisturbed(False) as _:
        with undisturbed(True, within=True) as said:
            assert not gc.isenabled() and "locked memory" not in said
        assert not gc.isenabled()
    assert gc.isenabled()


def test_without_a_grant_the_command_that_grants_it_is_said(monkeypatch):
    def refuse(*_):
        raise PermissionError("not granted")

    monkeypatch.setattr(module.os, "sched_setscheduler", refuse)
    with undisturbed(True) as said:
        assert "sudo prlimit --pid $$ --rtprio=20" in said


def test_a_clock_that_is_not_real_asks_for_nothing():
    with pytest.raises(ValueError), undisturbed(False) as said:
        assert said == "" and not gc.isenabled() and os.sched_getscheduler(0) == os.SCHED_OTHER
        raise ValueError
    assert gc.isenabled()
