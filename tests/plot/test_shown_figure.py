"""Figures show themselves in a notebook, twice as fine as the page."""

import struct

import pytest

import minsnap


@pytest.mark.slow
def test_a_figure_is_png_of_twice_the_size_at_which_it_is_shown():
    figure = minsnap.plot.plot_overview(minsnap.line(total_time=3.0))
    data, shown = figure._repr_png_()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert abs(width - 2 * shown["width"]) <= 2
    assert abs(height - 2 * shown["height"]) <= 2
