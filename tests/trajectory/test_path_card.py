"""What notebooks show for paths, reports and certificates."""

import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import minsnap
from minsnap.native.library import core
from minsnap.trajectory.trajectory import as_plan

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 2), (0, 4, 1), (0, 0, 1)]
SVG = "{http://www.w3.org/2000/svg}"


def facts(value) -> dict[str, str]:
    """Return the table of a card, and fail where the card is not well-formed."""
    cells = [cell.text or "" for cell in ElementTree.fromstring(value._repr_html_()).iter("td")]
    return dict(zip(cells[::2], cells[1::2], strict=True))


def drawings(value) -> int:
    return len(list(ElementTree.fromstring(value._repr_html_()).iter(f"{SVG}svg")))


def test_a_plan_shows_its_figures():
    path = minsnap.plan(CORNERS, durations=[4, 2, 4, 2], corridor=0.3)
    shown, certificate = facts(path), minsnap.certify(path, CORNERS, corridor=0.3)
    assert shown["duration"] == "12 s"
    assert shown["legs"] == "4 of degree 7"
    assert shown["max speed"] == f"{certificate.max_speed:.4g} m/s"
    assert shown["cost"] == f"{path.cost():.6g} m²/s⁷"
    assert shown["corridor margin"] == f"{path.report.corridor_margin:.3g} m, at every instant"
    assert shown["rounds"].startswith(f"{path.report.rounds},")
    assert drawings(path) == 2


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_a_report_shows_its_search_and_its_limits():
    report = minsnap.plan(CORNERS, limits=minsnap.Limits(speed=3.0)).report
    shown = facts(report)
    assert shown["durations searched"] == f"{len(report.steps)} plans tried"
    assert shown["limit speed"].startswith(f"{100 * report.utilisation[0].fraction:.2f} %")
    assert drawings(report) == 1


def test_a_certificate_shows_whether_everything_holds():
    path = minsnap.plan(CORNERS, durations=[4, 2, 4, 2])
    good, bad = minsnap.certify(path, CORNERS), minsnap.certify(path, CORNERS, corridor=0.1)
    assert ">Certificate: all conditions hold<" in good._repr_html_()
    assert ">Certificate: not all conditions hold<" in bad._repr_html_()
    assert facts(bad)["corridor margin"].startswith(f"{bad.corridor_margin:.3g} m")
    assert "corridor margin" not in facts(good)


@pytest.mark.parametrize("dim", [1, 2, 3, 5])
def test_paths_of_any_dimension_have_a_card(dim):
    path = minsnap.plan(np.arange(4.0 * dim).reshape(4, dim), durations=[1, 1, 1])
    assert facts(path)["duration"] == "3 s"
    assert drawings(path) == (2 if dim == 3 else 1)


def test_paths_without_extent_and_of_many_legs_have_a_card():
    still = minsnap.plan(np.zeros((2, 3)), durations=[1.0])
    assert facts(still)["max speed"] == "0 m/s"
    walk = np.cumsum(np.random.default_rng(0).normal(size=(30_001, 3)), axis=0)
    long = minsnap.plan(walk, durations=np.ones(30_000))
    assert facts(long)["legs"] == "30000 of degree 7"
    assert len(long._repr_html_()) < 100_000


def test_sentences_of_a_report_are_escaped():
    path = minsnap.plan(CORNERS, durations=[4, 2, 4, 2])
    report = replace(path.report, notes=("1 < 2 & <script>alert(1)</script>",), handed_over="<i>")
    shown = facts(as_plan(path, report))
    assert shown["note"] == "1 < 2 & <script>alert(1)</script>"
    assert shown["handed over"] == "<i>"


def test_shapes_have_a_card():
    shown = facts(minsnap.circle(radius=2.0, altitude=1.5))
    assert shown["x"].endswith("2 m") and shown["z"] == "1.5 to 1.5 m"


def test_cards_need_no_matplotlib():
    code = (
        "import minsnap, sys; minsnap.plan([(0, 0), (1, 0)], durations=[1])._repr_html_(); "
        "print('matplotlib' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
