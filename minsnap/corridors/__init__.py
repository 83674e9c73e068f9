"""Corridors: the convex sets that a leg must stay in, and the regions of its knots."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
