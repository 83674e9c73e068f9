"""Undo and redo."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from minsnap.files.file_request import FileRequest
from minsnap.studio.workbench import PAUSE, EditHistory

FIRST = FileRequest(((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)), total_time=1.0)


def lasting(seconds):
    return replace(FIRST, total_time=float(seconds))


def test_undo_goes_back_through_every_edit_and_redo_forward():
    history = EditHistory(FIRST)
    for seconds in (2, 3, 4):
        assert history.edit(lasting(seconds))
    assert [history.undo() and history.present.total_time for _ in range(3)] == [3.0, 2.0, 1.0]
    assert not history.undo()
    assert [history.redo() and history.present.total_time for _ in range(3)] == [2.0, 3.0, 4.0]
    assert not history.redo()


def test_one_drag_is_one_step_and_a_pause_ends_it():
    now = [0.0]
    history = EditHistory(FIRST, clock=lambda: now[0])
    history.edit(lasting(2), "total")
    for seconds in (3, 4):
        now[0] += 0.5 * PAUSE
        assert not history.edit(lasting(seconds), "total")
    history.pause()
    assert history.edit(lasting(5), "total")
    now[0] += 2.0 * PAUSE
    assert history.edit(lasting(6), "total")
    assert [state.total_time for state in history.past] == [1.0, 4.0, 5.0]


def test_what_is_held_is_one_step_however_long_it_takes():
    now = [0.0]
    history = EditHistory(FIRST, clock=lambda: now[0])
    for seconds in (2, 3, 4):
        history.edit(lasting(seconds), "drag", held=True)
        now[0] += 100.0 * PAUSE
    history.pause()
    assert history.undo() and history.present == FIRST


def test_an_edit_that_changes_nothing_is_none():
    history = EditHistory(FIRST)
    assert not history.edit(lasting(1))
    assert not history.past


@given(st.lists(st.one_of(st.integers(1, 5), st.sampled_from(["undo", "redo"])), max_size=30))
def test_it_agrees_with_a_list_and_a_place_in_it(steps):
    history, states, place = EditHistory(FIRST), [FIRST], 0
    for step in steps:
        if step == "undo":
            history.undo()
            place = max(place - 1, 0)
        elif step == "redo":
            history.redo()
            place = min(place + 1, len(states) - 1)
        elif lasting(step) != states[place]:
            history.edit(lasting(step))
            states = [*states[: place + 1], lasting(step)]
            place += 1
        assert history.present == states[place]
