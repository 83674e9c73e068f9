"""Cards are well-formed, draw to scale, and escape what they are given."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from minsnap.basics.cards import CARD, card, curve_svg, strip_svg

SVG = "{http://www.w3.org/2000/svg}"


def pixels(svg: str) -> np.ndarray:
    """Return the corners of the first curve of a drawing, in pixels."""
    line = ElementTree.fromstring(svg).find(f".//{SVG}polyline")
    return np.array([[float(c) for c in pair.split(",")] for pair in line.get("points").split()])


@pytest.mark.parametrize("size", [(8.0, 4.0), (1.0, 30.0), (1e-9, 1e-9), (1e200, 1e199), (0.0, 5.0), (5.0, 0.0)])
def test_curves_are_drawn_to_one_scale_inside_the_drawing(size):
    points = np.array([[-1.0, -1.0], [1.0, 1.0], [0.3, -0.8]]) / 2.0 * size + [7.0 * size[0], -3.0 * size[1]]
    drawn = pixels(curve_svg(points))
    assert (drawn >= 0.0).all() and (drawn <= [CARD.width, CARD.height]).all()
    spans = np.ptp(drawn, axis=0)
    assert spans[0] * size[1] == pytest.approx(spans[1] * size[0], abs=0.11 * max(size))
    assert (spans >= [CARD.width - 2 * CARD.margin - 0.2, CARD.height - 2 * CARD.margin - 0.2]).any()
    if size[1]:
        assert drawn[1, 1] < drawn[0, 1], "y upwards"


def test_the_scale_bar_has_the_length_that_it_names():
    svg = curve_svg(np.array([[0.0, 0.0], [8.0, 4.0]]))
    left, right = map(float, re.search(r"M([\d.]+) [\d.]+H([\d.]+)", svg).groups())
    named = float(re.search(r">([\d.e+-]+) m<", svg).group(1))
    spans = np.ptp(pixels(svg), axis=0)
    assert (right - left) / named == pytest.approx(spans[0] / 8.0, rel=1e-2)


def test_points_without_extent_and_too_many_waypoints_are_drawn():
    still = np.zeros((5, 2))
    assert np.isfinite(pixels(curve_svg(still))).all()
    assert "<g" in curve_svg(still, still)
    assert "<g" not in curve_svg(still, np.zeros((10_000, 2)))


@pytest.mark.parametrize("values", [[1.0, 3.0, 2.0], [2.0, 2.0, 2.0], [-1.7e308, 1.7e308, 0.0]])
def test_strips_span_their_height_and_name_their_range(values):
    svg = strip_svg(np.array([0.0, 1.0, 4.0]), np.array(values), "z [m]")
    drawn = pixels(svg)
    assert drawn[:, 0] == pytest.approx(
        [CARD.margin, CARD.margin + (CARD.width - 2 * CARD.margin) / 4.0, CARD.width - CARD.margin], abs=0.06
    )
    assert np.argmin(drawn[:, 1]) == np.argmax(values)
    assert f"{min(values):.4g}" in svg


def test_text_is_escaped_and_missing_facts_are_left_out():
    text = card("<b>&", [("<script>", '"a" < b & c'), ("absent", None)], [curve_svg(np.eye(2), caption="<&>")])
    tree = ElementTree.fromstring(text)
    cells = [cell.text for cell in tree.iter("td")]
    assert cells == ["<script>", '"a" < b & c']
    assert "<script>" not in text and "<b>" not in text
    assert tree.find(f".//{SVG}title").text == "<&>"
