"""What the logger of the package tells of plans; it is silent unless it is asked."""

import logging
import subprocess
import sys

import pytest

import minsnap

CORNERS = [(0, 0, 1), (4, 0, 1), (4, 3, 1.5)]
LIMITS = minsnap.Limits(speed=3, acceleration=6, jerk=30)


def test_a_plan_tells_its_searches_and_how_it_ended(caplog):
    with caplog.at_level(logging.DEBUG, "minsnap"):
        plan = minsnap.plan(CORNERS, limits=LIMITS, corridor=0.3)
    told = [record.getMessage() for record in caplog.records]
    assert "least time) of 2 legs" in told[0] and "from rest: done after" in told[0]
    assert told[-1].startswith("planned 2 legs in ") and f"{plan.duration:.6g} s of flight" in told[-1]
    assert {record.name.partition(".")[0] for record in caplog.records} == {"minsnap"}


def test_a_refusal_is_told_with_its_code(caplog):
    with caplog.at_level(logging.INFO, "minsnap"), pytest.raises(minsnap.InfeasibleError) as refused:
        minsnap.plan(CORNERS, total_time=1, limits=LIMITS, corridor=0.3)
    assert caplog.records[-1].getMessage() == f"refused ({refused.value.code}): {refused.value}"
    assert not any(record.levelno < logging.INFO for record in caplog.records)


def test_durations_are_told_too(caplog):
    with caplog.at_level(logging.DEBUG, "minsnap"):
        minsnap.plan(CORNERS, durations=[2, 2])
        minsnap.plan(CORNERS, durations=[2, 2], corridor=[0.3, minsnap.Room((-1, -1, 0), (6, 6, 3))])
    told = [record.getMessage() for record in caplog.records]
    assert told[0] == "planned 2 legs: 4 s of flight, by the quick way"
    assert any(text.startswith("curve of 2 pieces in 4 s: ") for text in told)


def test_nothing_is_written_by_default():
    code = f"import minsnap; minsnap.plan({CORNERS}, limits=minsnap.Limits(speed=3, acceleration=6, jerk=30))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (run.stdout, run.stderr) == ("", "")
