"""Corridors: the convex sets that a leg must stay in, and the regions of its knots."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
