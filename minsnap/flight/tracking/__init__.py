"""Comparison of a flight with its reference: tracking errors and delay."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
