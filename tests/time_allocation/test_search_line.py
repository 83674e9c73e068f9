"""The line of a search: shown after a while, rewritten, cleared at the end and on an error."""

import io

import pytest

import minsnap
from minsnap.time_allocation import search_line
from minsnap.time_allocation.search_line import SearchLine, shown
from minsnap.trajectory.report import Step

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1)]


def test_a_line_is_rewritten_and_cleared(monkeypatch):
    monkeypatch.setattr(search_line, "INTERVAL", 0.0)
    stream = io.StringIO()
    line = SearchLine(stream, " (hint)")
    line(Step(1, 12.5, 3.0, 3.0))
    line(Step(2, 11.5, 2.0, 2.0))
    line.clear()
    first, second, end, rest = stream.getvalue().split("\r")[1:]
    assert "1 plans, 12.5 s (hint)" in first and "2 plans, 11.5 s (hint)" in second
    assert not end.strip() and len(end) >= len(second.rstrip()) and rest == ""


@pytest.mark.parametrize("limits", [minsnap.Limits(speed=3.0), None])
def test_progress_true_shows_the_search_on_standard_error(monkeypatch, capsys, limits):
    monkeypatch.setattr(search_line, "INTERVAL", 0.0)
    asked = {"limits": limits} if limits else {"total_time": 9.0}
    plain = minsnap.plan(CORNERS, corridor=0.3, **asked)
    assert capsys.readouterr().err == ""
    watched = minsnap.plan(CORNERS, corridor=0.3, progress=True, **asked)
    assert "searching [" in capsys.readouterr().err
    assert watched.duration == pytest.approx(plain.duration)
    minsnap.plan(CORNERS, corridor=0.3, progress=False, **asked)
    assert capsys.readouterr().err == ""


def test_other_callables_are_handed_on_and_an_error_clears_the_line(monkeypatch, capsys):
    with shown(print) as told:
        assert told is print
    monkeypatch.setattr(search_line, "INTERVAL", 0.0)
    with pytest.raises(RuntimeError), shown(True) as told:
        told(Step(1, 1.0, 1.0, 1.0))
        raise RuntimeError
    assert capsys.readouterr().err.endswith("\r")
