"""Formulas as MathML, written when the documentation is built: browsers draw it without a script or a network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator


def formula(node: nodes.Element) -> str:
    """Return the TeX of a formula with braces in its fractions: ``frac12`` would be read as 12 over what follows."""
    return re.sub(r"frac(\d)(\d)", r"frac{\1}{\2}", node.astext())


def inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(tex2mathml(formula(node)))
    raise nodes.SkipNode


def block(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula that stands by itself; where it is wider than the page it can be moved sideways."""
    writer.body.append(f'<div class="formula">{tex2mathml(formula(node), as_block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
