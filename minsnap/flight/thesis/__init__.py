"""Measurements of a DJI F330 from the literature, fits to them, and the published experiment in simulation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
