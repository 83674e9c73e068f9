"""Measurements of a DJI F330 from the literature, fits to them, and the published experiment in simulation."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
