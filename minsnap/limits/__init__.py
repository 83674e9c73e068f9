"""Limits of a vehicle on the derivatives of its path, and their utilisation by a path."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
