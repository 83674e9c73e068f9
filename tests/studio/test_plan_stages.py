"""Plans of the studio keep everything that the scene holds, the quick one as the last: what does not is not shown."""

from dataclasses import replace

import pytest

import minsnap
from minsnap.files.file_request import FileRequest
from minsnap.studio import workbench
from minsnap.studio.workbench import planned_in_stages

SCENE = FileRequest(
    waypoints=((0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.0)), corridor=(0.3, 0.3), limits=(("speed", 2.0),)
)


def shown(durations=None):
    return [plan.final for plan in planned_in_stages(SCENE, durations, lambda: False) if plan.certificate.ok]


def test_a_quick_plan_that_exceeds_a_limit_is_not_shown(monkeypatch):
    assert shown() == [False, True]
    monkeypatch.setattr(workbench, "_stretch", lambda name, fraction: min(1.0, fraction))
    assert [plan.final for plan in planned_in_stages(SCENE, [1.0, 1.0], lambda: False)] == [True]


@pytest.mark.parametrize("other", [{"corridor": None}, {"corridor": (0.9, 0.9)}])
def test_a_quick_plan_that_leaves_the_corridor_is_not_shown(monkeypatch, other):
    exact = minsnap.plan

    def loose(*given, **asked):
        return exact(*given, **(asked | other if asked.get("limits") is None else asked))

    monkeypatch.setattr(workbench, "plan", loose)
    assert shown() == [True]


def test_waypoints_are_held_to_the_tolerance_of_the_scene():
    scene = replace(SCENE, waypoint_tolerance=0.2)
    plans = list(planned_in_stages(scene, None, lambda: False))
    assert plans and all(plan.certificate.ok for plan in plans)
    assert plans[-1].certificate.waypoint_error > 1e-3
