"""Paths of standard shapes: circle, helix, lemniscate, line, rectangle."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
