"""A corridor on some legs only: an infinite half-width is none."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import CorridorError
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials
from minsnap.plot import plot_path

POINTS, TIMES = [(0, 0, 1), (1, 0, 1), (1, 2, 1), (0, 2, 1)], [1.0, 1.5, 1.0]
ONE = [np.inf, 0.05, np.inf]


@pytest.mark.parametrize("kind", [lambda widths: widths, minsnap.RoundTube], ids=["tube", "round"])
def test_an_infinite_half_width_is_no_corridor_on_its_leg(kind):
    """The published way to say so was refused, and 1e3 in its place was planned."""
    path, wide = (minsnap.plan(POINTS, TIMES, corridor=kind([far, 0.05, far])) for far in (np.inf, 1e3))
    assert path.cost() == pytest.approx(wide.cost(), rel=1e-6)
    aside = path(np.linspace(1.0, 2.5, 2001))[:, 0] - 1.0
    assert np.abs(aside).max() <= 0.05 + 1e-9
    assert minsnap.certify(path, POINTS, corridor=kind(ONE)).ok
    assert path.report.corridor_margin == pytest.approx(wide.report.corridor_margin, abs=1e-6)
    assert len(plot_path(path, corridor=kind(ONE), waypoints=POINTS).patches) >= 1


def test_batches_and_limits_take_it_too():
    assert (
        minsnap.plan_many([POINTS], [TIMES], corridor=[ONE])[0].cost()
        == minsnap.plan(POINTS, TIMES, corridor=ONE).cost()
    )
    limits = minsnap.Limits(speed=2.0, acceleration=4.0, jerk=20.0)
    path = minsnap.plan(POINTS, limits=limits, corridor=ONE)
    assert minsnap.certify(path, POINTS, corridor=ONE, limits=limits).ok


@pytest.mark.parametrize("widths", [np.inf, [np.inf] * 3, [np.nan, 0.1, 0.1], [-np.inf, 0.1, 0.1]], ids=str)
def test_a_corridor_on_no_leg_is_none(widths):
    with pytest.raises(CorridorError, match="must be positive and finite"):
        minsnap.plan(POINTS, TIMES, corridor=widths)


def test_a_stored_plan_keeps_it(tmp_path):
    path = minsnap.plan(POINTS, TIMES, corridor=ONE)
    for name in ("a.json", "a.yaml"):
        write_polynomials(path, tmp_path / name, waypoints=POINTS, corridor=ONE)
        stored = read_polynomials(tmp_path / name)
        assert stored.corridor == ONE and stored.certified()[1] == []
