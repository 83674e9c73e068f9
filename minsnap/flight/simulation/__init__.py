"""Simulation of flights: rigid-body dynamics, controllers, sensors and wind."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
