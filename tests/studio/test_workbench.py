"""The state machine of a studio: the latest document wins, the last good plan stays."""

import threading
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, WaypointError
from minsnap.studio import workbench
from minsnap.studio.documents import example_scene
from minsnap.studio.edits import move_waypoint, set_width, with_time
from minsnap.studio.workbench import Workbench, planned_in_stages


class Watcher:
    """Keeps every state."""

    def __init__(self):
        self.states = []

    def __call__(self, state):
        self.states.append(state)


@pytest.fixture
def watched():
    watcher = Watcher()
    bench = Workbench(example_scene(), watcher)
    assert bench.wait(60.0)
    yield bench, watcher
    bench.close()


def test_an_edit_is_planned_as_the_library_plans_it(watched):
    bench, _ = watched
    bench.edit(lambda request: move_waypoint(request, 1, (9.0, 0.5, 1.2)))
    assert bench.wait(60.0)
    state = bench.state
    points = [(0, 0, 1), (9, 0.5, 1.2), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
    same = minsnap.plan(points, total_time=12.0, corridor=0.3)
    assert state.is_plan_of_document and not state.searching and not state.refusal
    assert np.array_equal(state.planned.trajectory.control_points, same.control_points)
    assert state.planned.certificate.ok


@pytest.mark.slow
def test_what_cannot_be_done_keeps_the_last_good_plan_and_says_why(watched):
    bench, _ = watched
    good = bench.state.planned
    bench.edit(
        lambda request: replace(
            request, continuity=6, total_time=None, durations=(3.0,) * 4, corridor=(0.3, 1e-7, 0.3, 0.3)
        )
    )
    assert bench.wait(60.0)
    state = bench.state
    with pytest.raises(minsnap.InfeasibleError) as refused:
        minsnap.plan(**state.request.request().arguments())
    assert state.refusal == str(refused.value)
    assert state.leg == refused.value.leg is not None
    assert state.planned is good and not state.searching
    bench.undo()
    assert bench.wait(60.0)
    assert not bench.state.refusal and bench.state.is_plan_of_document


def test_undo_returns_to_the_same_plan_and_redo_to_the_other(watched):
    bench, _ = watched
    first = bench.state.planned.trajectory.control_points
    bench.edit(lambda request: set_width(request, 0, 0.05))
    assert bench.wait(60.0)
    second = bench.state.planned.trajectory.control_points
    assert not np.array_equal(first, second)
    assert np.array_equal(bench.state.ghost.control_points, first)
    bench.undo()
    assert bench.wait(60.0)
    assert np.array_equal(bench.state.planned.trajectory.control_points, first)
    bench.redo()
    assert bench.wait(60.0)
    assert np.array_equal(bench.state.planned.trajectory.control_points, second)


def test_a_refused_change_leaves_everything_as_it_is(watched):
    bench, watcher = watched
    count = len(watcher.states)

    def refuse(request):
        raise InputError("no")

    with pytest.raises(InputError):
        bench.edit(refuse)
    assert len(watcher.states) == count and not bench._history.past


def test_only_the_latest_of_many_requests_is_planned(monkeypatch):
    planned, gate = [], threading.Event()

    def slow(request, durations, superseded):
        planned.append(request.total_time)
        gate.wait(30.0)
        yield from planned_in_stages(request, durations, superseded)

    monkeypatch.setattr(workbench, "planned_in_stages", slow)
    bench = Workbench(example_scene(), lambda state: None)
    for seconds in range(13, 40):
        bench.edit(lambda request, s=seconds: replace(request, total_time=float(s)))
    gate.set()
    assert bench.wait(60.0)
    assert bench.state.planned.trajectory.duration == pytest.approx(39.0)
    assert len(planned) <= 3 and planned[-1] == 39.0
    bench.close()


def test_a_newer_request_ends_a_search(monkeypatch):
    began = threading.Event()

    def reporting(request, durations, superseded):
        for stage in planned_in_stages(request, durations, superseded):
            began.set()
            yield stage

    monkeypatch.setattr(workbench, "planned_in_stages", reporting)
    limited = replace(with_time(example_scene(), "limits", (), {"speed": 3.0, "acceleration": 6.0}), pieces=3)
    watcher = Watcher()
    bench = Workbench(limited, watcher)
    assert began.wait(60.0)
    bench.edit(lambda request: replace(request, pieces=1, total_time=12.0, limits=()))
    assert bench.wait(60.0)
    finals = [state.planned.request for state in watcher.states if state.planned and state.planned.final]
    assert limited not in finals and bench.state.is_plan_of_document
    bench.close()


def test_within_limits_a_quick_certified_plan_comes_first_and_is_marked():
    limited = with_time(example_scene(), "limits", (), {"speed": 3.0, "acceleration": 6.0})
    quick, final = planned_in_stages(limited, None, lambda: False)
    assert (quick.final, final.final) == (False, True)
    assert quick.certificate.ok and final.certificate.ok
    assert max(used.fraction for used in quick.certificate.utilisation) > 0.999
    assert final.trajectory.duration < quick.trajectory.duration
    same = minsnap.plan(limited.waypoints, limits=minsnap.Limits(speed=3.0, acceleration=6.0), corridor=0.3)
    assert np.array_equal(final.trajectory.control_points, same.control_points)


def test_an_error_inside_a_plan_is_told_and_does_not_end_the_studio(monkeypatch, capfd):
    def broken(request, durations, superseded):
        raise RuntimeError("inside")
        yield

    bench = Workbench(example_scene(), lambda state: None)
    assert bench.wait(60.0)
    with monkeypatch.context() as patch:
        patch.setattr(workbench, "planned_in_stages", broken)
        bench.edit(lambda request: replace(request, total_time=13.0))
        assert bench.wait(60.0)
        assert "unexpected" in bench.state.refusal
    bench.edit(lambda request: replace(request, total_time=14.0))
    assert bench.wait(60.0)
    assert bench.state.is_plan_of_document
    bench.close()
    assert "RuntimeError: inside" in capfd.readouterr().err


def test_what_fails_while_a_refusal_is_shown_does_not_end_the_planning():
    """The thread ended with it, and every later edit of every browser waited for ever."""

    def show(state):
        if state.refusal:
            raise ZeroDivisionError

    bench = Workbench(example_scene(), show)
    assert bench.wait(60.0)
    bench.edit(lambda request: replace(request, total_time=-1.0))
    assert bench.wait(60.0) and bench.state.refusal
    bench.edit(lambda request: replace(request, total_time=14.0))
    assert bench.wait(60.0) and bench.state.is_plan_of_document
    bench.close()


@pytest.mark.parametrize("far", [1e41, float("nan"), float("-inf")])
def test_waypoints_that_are_no_places_are_no_document(watched, far):
    """They were taken up, and refused after they were drawn, which failed."""
    bench, _ = watched
    good = bench.state
    with pytest.raises(WaypointError, match="every coordinate must be a finite number"):
        bench.edit(lambda request: move_waypoint(request, 1, (far, 0.0, 1.0)))
    assert bench.state is good and not bench._history.past
