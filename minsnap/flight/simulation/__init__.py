"""Simulation of flights: rigid-body dynamics, controllers, sensors and wind."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
