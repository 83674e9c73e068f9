"""Measurements of a DJI F330 from the literature, and fits to them; what repeats the published experiment."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
