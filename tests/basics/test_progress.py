"""The line of progress: shown after a while, rewritten, removed at the end and on an error."""

import re

import pytest

import minsnap
from minsnap.basics import progress
from minsnap.basics.progress import ProgressLine, progress_line

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1)]


@pytest.fixture
def at_once(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 0.0)
    monkeypatch.setattr(progress, "INTERVAL", 0.0)


def lines(shown):
    """Return the texts of a line that was rewritten, without the codes of the terminal."""
    plain = re.sub(r"\x1b\[[?\d;]*[A-Za-z]", "", shown)
    return [text.strip() for text in re.split(r"[\r\n]", plain) if text.strip()]


def test_a_line_is_rewritten_and_removed(at_once, capsys):
    line = ProgressLine("flying")
    line.show(0.25, "a quarter")
    line.show(1.0, "all [of it]")
    assert [text.split("  ")[0].split()[0] for text in lines(capsys.readouterr().err)] == ["flying"] * 3
    line.show(1.0, "all [of it]")
    assert lines(capsys.readouterr().err)[0].endswith("all [of it]")
    line.clear()
    assert capsys.readouterr().err.endswith("\x1b[2K")


def test_what_is_quick_shows_nothing(capsys):
    line = ProgressLine("flying")
    line.show(0.5)
    line.clear()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("limits", [minsnap.Limits(speed=3.0), None])
def test_progress_true_shows_a_search(at_once, capsys, limits):
    asked = {"limits": limits} if limits else {"total_time": 9.0}
    plain = minsnap.plan(CORNERS, corridor=0.3, **asked)
    assert capsys.readouterr().err == ""
    watched = minsnap.plan(CORNERS, corridor=0.3, progress=True, **asked)
    shown = lines(capsys.readouterr().err)
    assert any(re.match(r"searching .* 1 plans, [\d.]+ s$", text) for text in shown), shown
    assert watched.duration == pytest.approx(plain.duration)
    minsnap.plan(CORNERS, corridor=0.3, progress=True, search=minsnap.Search(on_interrupt="return"), **asked)
    assert "(Ctrl-C takes the best)" in capsys.readouterr().err
    minsnap.plan(CORNERS, corridor=0.3, progress=False, **asked)
    assert capsys.readouterr().err == ""


def test_progress_true_shows_a_flight_and_an_experiment(at_once, capsys):
    from minsnap.flight import GeometricController, simulate
    from minsnap.flight.thesis.experiment import run_experiment
    from minsnap.vehicle import Quadrotor

    simulate(Quadrotor.dji_f330(), GeometricController(), minsnap.line(), duration=0.2, progress=True)
    assert "flying" in capsys.readouterr().err
    run_experiment("line", 1, compensations=[None], progress=True)
    assert "flying" in capsys.readouterr().err


def test_other_callables_are_handed_on_and_an_error_removes_the_line(at_once, capsys):
    with progress_line(print, "searching", lambda line: line.show) as watch:
        assert watch is print
    with pytest.raises(RuntimeError), progress_line(True, "searching", lambda line: line.show) as watch:
        watch(0.5)
        raise RuntimeError
    assert capsys.readouterr().err.endswith("\x1b[2K")
