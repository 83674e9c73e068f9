"""Polynomials on the unit interval: the Bernstein basis, exact extrema, quotients and ranges."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
