"""Deadlines on a simulated clock: work that would be late does not begin."""

import pytest

from minsnap.basics import deadline as module
from minsnap.basics.deadline import NEVER, Deadline, LateError, Stopwatch, Work


class Ticking:
    """A clock that is set by hand."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    """A clock of which the processor is busy all the time."""
    ticking = Ticking()
    monkeypatch.setattr(module, "thread_time", ticking)
    return ticking


def test_what_other_programs_take_is_left_out(clock):
    wall = Ticking()
    watch = Stopwatch(wall)
    wall.now, clock.now = 7.0, 2.0
    assert watch.seconds == 2.0
    watch.restart()
    wall.now, clock.now = 8.0, 5.0
    assert (watch.seconds, watch.on_clock, watch.lap()) == (1.0, 1.0, 1.0)
    wall.now, clock.now = 9.5, 5.2
    assert (watch.began, watch.on_clock, watch.lap()) == (8.0, 1.5, pytest.approx(0.2))


def test_work_that_would_be_late_judged_by_the_longest_so_far_does_not_begin(clock):
    deadline = Deadline(10.0, clock)
    for clock.now in (0.0, 3.0, 4.0, 6.9):
        deadline.check()
    assert (deadline.longest, deadline.left) == (3.0, pytest.approx(3.1))
    clock.now = 7.5
    with pytest.raises(LateError, match="time_limit has passed without a certified plan"):
        deadline.check()
    assert not deadline.passed
    clock.now = 10.5
    assert deadline.passed


def test_what_is_expected_counts_from_the_first_check_on():
    with pytest.raises(LateError):
        Deadline(1.0, lambda: 0.0, expected=1.5).check()
    Deadline(1.0, lambda: 0.0, expected=0.5).check()


def test_work_with_an_end_of_its_own_is_left_out(clock):
    deadline = Deadline(10.0, clock)
    deadline.check()
    clock.now = 8.0
    deadline.resume()
    clock.now = 9.0
    deadline.check()
    assert deadline.longest == 1.0


def test_without_a_deadline_nothing_is_late():
    NEVER.check()
    NEVER.resume()
    assert not NEVER.passed and NEVER.left == float("inf")


def test_counted_work_ends_what_improves_at_half_and_what_begins_at_the_whole():
    deadline = Deadline(work=Work(10.0))
    other = deadline.until(float("inf"))
    deadline.spend(4.0)
    assert not other.passed
    other.spend(2.0)
    assert deadline.passed and deadline.affords(4.0) and not deadline.affords(4.5)
    deadline.check()
    deadline.spend(5.0)
    for required in (deadline.check, other.require):
        with pytest.raises(LateError, match="the work that a question is worth"):
            required()
