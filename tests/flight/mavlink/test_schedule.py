"""Slots stay where they belong, however long it takes and whoever is late."""

import numpy as np
import pytest

from minsnap.errors import TimingError
from minsnap.flight.mavlink.link import Clock, Schedule


@pytest.mark.slow
@pytest.mark.parametrize("rate", [20.0, 50.0, 30.0, 7.3])
def test_ten_minutes_do_not_drift(rate):
    """With every slot served late by up to 2 ms, slot k is still due at k/rate and the mean rate is the rate."""
    schedule, late = Schedule(rate, 1000.0), np.random.default_rng(4)
    for k in range(round(600 * rate)):
        assert schedule.due == pytest.approx(1000.0 + k / rate, abs=1e-9)
        assert schedule.take(schedule.due + late.uniform(0, 2e-3)) == k
    figures = schedule.lateness()
    assert (figures.sent, figures.skipped) == (round(600 * rate), 0)
    assert figures.rate == pytest.approx(rate, rel=1e-5)
    assert figures.p99 == pytest.approx(1.98e-3, rel=0.02) and figures.worst <= 2e-3 + 1e-9


def test_who_is_late_gets_the_slot_for_now_and_only_that():
    schedule = Schedule(20.0, 0.0)
    assert [schedule.take(t) for t in (0.0, 0.05, 0.31, 0.35, 0.41)] == [0, 1, 6, 7, 8]
    figures = schedule.lateness()
    assert figures.skipped == 4 and figures.sent == 5
    assert figures.worst == pytest.approx(0.21)


def test_who_is_early_still_gets_every_slot_once():
    schedule = Schedule(20.0, 0.0)
    assert [schedule.take(t) for t in (0.0, 0.01, 0.02)] == [0, 1, 2]


def test_an_empty_schedule_has_no_lateness():
    assert Schedule(20.0, 0.0).lateness().sent == 0


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_must_be_positive(rate):
    with pytest.raises(TimingError, match="rate is"):
        Schedule(rate, 0.0)


def test_the_clock_goes_forward_and_wakes_for_what_can_be_read():
    import os
    import time

    clock = Clock()
    before = clock.now()
    clock.wait(before + 0.02, [])
    assert clock.now() >= before + 0.02
    reader, writer = os.pipe()
    os.write(writer, b"x")
    began = time.monotonic()
    clock.wait(clock.now() + 300.0, [reader])
    assert time.monotonic() - began < 200.0
    os.close(reader)
    os.close(writer)
