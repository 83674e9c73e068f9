"""Figures of paths in the plane or in space and against time; matplotlib is imported when a figure is drawn."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
