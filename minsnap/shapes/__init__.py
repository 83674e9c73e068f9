"""Paths of standard shapes: circle, helix, lemniscate, line, rectangle."""

from minsnap.shapes.curves import circle, helix, lemniscate
from minsnap.shapes.phase import PhaseLaw, PhasePath
from minsnap.shapes.polynomial_form import as_polynomials
from minsnap.shapes.straight import line, rectangle

__all__ = ["PhaseLaw", "PhasePath", "as_polynomials", "circle", "helix", "lemniscate", "line", "rectangle"]
