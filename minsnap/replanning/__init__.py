"""Replanning in flight: from a moving start, within a budget of time, with a way to stop."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
