"""Figures of paths in the plane or in space and against time; matplotlib is imported when a figure is drawn."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
